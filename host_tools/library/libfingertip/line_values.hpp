/* written by firmware/wire/line.py from line.toml; change it there.
 *
 * Where wire_packet holds each field, for fingertip.cpp alone. */
#pragma once

#include "libfingertip/wire.hpp"

#include <cstddef>
#include <cstdint>

namespace fingertip::values {

enum class Kind : std::uint8_t { u8, u16, i16, u32, i32, u64, f32, text };

/* count numbers, stride bytes apart; a text is one. */
struct Field {
  const char *name;
  Kind kind;
  std::uint16_t offset, count, stride;
};

inline constexpr Field contact_fields[] = {
    {"sequence", Kind::u16, offsetof(wire_packet, sequence), 1, 2},
    {"t_us", Kind::u64, offsetof(wire_packet, t_us), 1, 8},
    {"frame", Kind::u32, offsetof(wire_packet, body.contact.frame), 1, 4},
    {"flags", Kind::u32, offsetof(wire_packet, body.contact.flags), 1, 4},
    {"convert_us", Kind::u16, offsetof(wire_packet, body.contact.stages.convert_us), 1, 2},
    {"read_us", Kind::u16, offsetof(wire_packet, body.contact.stages.read_us), 1, 2},
    {"queue_us", Kind::u16, offsetof(wire_packet, body.contact.stages.queue_us), 1, 2},
    {"condition_us", Kind::u16, offsetof(wire_packet, body.contact.stages.condition_us), 1, 2},
    {"fit_us", Kind::u16, offsetof(wire_packet, body.contact.stages.fit_us), 1, 2},
    {"contact_us", Kind::u16, offsetof(wire_packet, body.contact.stages.contact_us), 1, 2},
    {"total_us", Kind::u16, offsetof(wire_packet, body.contact.stages.total_us), 1, 2},
    {"sensors_used", Kind::u64, offsetof(wire_packet, body.contact.sensors_used), 1, 8},
    {"x_mm", Kind::f32, offsetof(wire_packet, body.contact.x_mm), 1, 4},
    {"y_mm", Kind::f32, offsetof(wire_packet, body.contact.y_mm), 1, 4},
    {"p0_Pa", Kind::f32, offsetof(wire_packet, body.contact.p0_Pa), 1, 4},
    {"sigma_mm", Kind::f32, offsetof(wire_packet, body.contact.sigma_mm), 1, 4},
    {"force_N", Kind::f32, offsetof(wire_packet, body.contact.force_N), 1, 4},
    {"residual_rms_Pa", Kind::f32, offsetof(wire_packet, body.contact.residual_rms_Pa), 1, 4},
    {"location_sd_mm", Kind::f32, offsetof(wire_packet, body.contact.location_sd_mm), 1, 4},
    {"force_sd_N", Kind::f32, offsetof(wire_packet, body.contact.force_sd_N), 1, 4},
    {"slip_mm", Kind::f32, offsetof(wire_packet, body.contact.slip_mm), 1, 4},
    {"sigma_x_mm", Kind::f32, offsetof(wire_packet, body.contact.sigma_x_mm), 1, 4},
    {"sigma_y_mm", Kind::f32, offsetof(wire_packet, body.contact.sigma_y_mm), 1, 4},
    {"width_correlation", Kind::f32, offsetof(wire_packet, body.contact.width_correlation), 1, 4},
    {"qx_N", Kind::f32, offsetof(wire_packet, body.contact.qx_N), 1, 4},
    {"qy_N", Kind::f32, offsetof(wire_packet, body.contact.qy_N), 1, 4},
    {"q_sd_N", Kind::f32, offsetof(wire_packet, body.contact.q_sd_N), 1, 4},
    {"tangential_ratio", Kind::f32, offsetof(wire_packet, body.contact.tangential_ratio), 1, 4},
    {"vx_mm_s", Kind::f32, offsetof(wire_packet, body.contact.vx_mm_s), 1, 4},
    {"vy_mm_s", Kind::f32, offsetof(wire_packet, body.contact.vy_mm_s), 1, 4},
    {"shape_age_ms", Kind::f32, offsetof(wire_packet, body.contact.shape_age_ms), 1, 4},
    {"x1_mm", Kind::f32, offsetof(wire_packet, body.contact.x1_mm), 1, 4},
    {"y1_mm", Kind::f32, offsetof(wire_packet, body.contact.y1_mm), 1, 4},
    {"location1_sd_mm", Kind::f32, offsetof(wire_packet, body.contact.location1_sd_mm), 1, 4},
    {"force1_N", Kind::f32, offsetof(wire_packet, body.contact.force1_N), 1, 4},
    {"force1_sd_N", Kind::f32, offsetof(wire_packet, body.contact.force1_sd_N), 1, 4},
    {"x2_mm", Kind::f32, offsetof(wire_packet, body.contact.x2_mm), 1, 4},
    {"y2_mm", Kind::f32, offsetof(wire_packet, body.contact.y2_mm), 1, 4},
    {"location2_sd_mm", Kind::f32, offsetof(wire_packet, body.contact.location2_sd_mm), 1, 4},
    {"force2_N", Kind::f32, offsetof(wire_packet, body.contact.force2_N), 1, 4},
    {"force2_sd_N", Kind::f32, offsetof(wire_packet, body.contact.force2_sd_N), 1, 4},
    {"edge_angle_deg", Kind::f32, offsetof(wire_packet, body.contact.edge_angle_deg), 1, 4},
    {"edge_angle_sd_deg", Kind::f32, offsetof(wire_packet, body.contact.edge_angle_sd_deg), 1, 4},
    {"edge_length_mm", Kind::f32, offsetof(wire_packet, body.contact.edge_length_mm), 1, 4},
};
inline constexpr Field raw_fields[] = {
    {"sequence", Kind::u16, offsetof(wire_packet, sequence), 1, 2},
    {"t_us", Kind::u64, offsetof(wire_packet, t_us), 1, 8},
    {"frame", Kind::u32, offsetof(wire_packet, body.raw.frame), 1, 4},
    {"flags", Kind::u32, offsetof(wire_packet, body.raw.flags), 1, 4},
    {"valid", Kind::u64, offsetof(wire_packet, body.raw.valid), 1, 8},
    {"saturated", Kind::u64, offsetof(wire_packet, body.raw.saturated), 1, 8},
    {"doubtful", Kind::u64, offsetof(wire_packet, body.raw.doubtful), 1, 8},
    {"temperature_cC", Kind::i16, offsetof(wire_packet, body.raw.temperature_cC), 1, 2},
    {"sensor_count", Kind::u8, offsetof(wire_packet, body.raw.sensor_count), 1, 1},
    {"pressure_Pa_q10", Kind::i32, offsetof(wire_packet, body.raw.pressure_Pa_q10), FT_MAX_SENSORS, 4},
    {"baseline_Pa_q10", Kind::i32, offsetof(wire_packet, body.raw.baseline_Pa_q10), FT_MAX_SENSORS, 4},
};
inline constexpr Field info_fields[] = {
    {"sequence", Kind::u16, offsetof(wire_packet, sequence), 1, 2},
    {"t_us", Kind::u64, offsetof(wire_packet, t_us), 1, 8},
    {"firmware_version", Kind::u8, offsetof(wire_packet, body.info.firmware_version), 3, 1},
    {"sensor_count", Kind::u8, offsetof(wire_packet, body.info.sensor_count), 1, 1},
    {"capabilities", Kind::u32, offsetof(wire_packet, body.info.capabilities), 1, 4},
    {"git_hash", Kind::text, offsetof(wire_packet, body.info.git_hash), 16, 1},
    {"board", Kind::text, offsetof(wire_packet, body.info.board), 16, 1},
    {"scene", Kind::text, offsetof(wire_packet, body.info.scene), 16, 1},
    {"serial", Kind::text, offsetof(wire_packet, body.info.serial), 16, 1},
    {"rate_mHz", Kind::u32, offsetof(wire_packet, body.info.rate_mHz), 1, 4},
    {"measured_rate_mHz", Kind::u32, offsetof(wire_packet, body.info.measured_rate_mHz), 1, 4},
    {"osr", Kind::u16, offsetof(wire_packet, body.info.osr), 1, 2},
    {"temperature_interval_ms", Kind::u16, offsetof(wire_packet, body.info.temperature_interval_ms), 1, 2},
    {"streams", Kind::u8, offsetof(wire_packet, body.info.streams), 1, 1},
    {"fit_iterations", Kind::u8, offsetof(wire_packet, body.info.fit_iterations), 1, 1},
    {"slip_window_ms", Kind::u16, offsetof(wire_packet, body.info.slip_window_ms), 1, 2},
    {"slip_threshold_mm", Kind::f32, offsetof(wire_packet, body.info.slip_threshold_mm), 1, 4},
    {"pitch_mm", Kind::f32, offsetof(wire_packet, body.info.pitch_mm), 1, 4},
    {"x_mm", Kind::f32, offsetof(wire_packet, body.info.x_mm), FT_MAX_SENSORS, 4},
    {"y_mm", Kind::f32, offsetof(wire_packet, body.info.y_mm), FT_MAX_SENSORS, 4},
    {"prior_sigma_mm", Kind::f32, offsetof(wire_packet, body.info.prior_sigma_mm), 1, 4},
    {"prior_width_mm", Kind::f32, offsetof(wire_packet, body.info.prior_width_mm), 1, 4},
    {"location_limit_mm", Kind::f32, offsetof(wire_packet, body.info.location_limit_mm), 1, 4},
    {"sync", Kind::u8, offsetof(wire_packet, body.info.sync), 1, 1},
    {"stored", Kind::u32, offsetof(wire_packet, body.info.stored), 1, 4},
    {"calibration_date_s", Kind::u32, offsetof(wire_packet, body.info.calibration.date_s), 1, 4},
    {"calibration_placements", Kind::u16, offsetof(wire_packet, body.info.calibration.placements), 1, 2},
    {"force_scale", Kind::f32, offsetof(wire_packet, body.info.calibration.force_scale), 1, 4},
    {"force_scale_sd", Kind::f32, offsetof(wire_packet, body.info.calibration.force_scale_sd), 1, 4},
    {"calibration_sigma_um", Kind::u16, offsetof(wire_packet, body.info.calibration.sigma_um), 1, 2},
    {"calibration_sigma_sd_um", Kind::u16, offsetof(wire_packet, body.info.calibration.sigma_sd_um), 1, 2},
    {"calibration_dip_share_q16", Kind::u16, offsetof(wire_packet, body.info.calibration.dip_share_q16), 1, 2},
    {"calibration_dip_sd_um", Kind::u16, offsetof(wire_packet, body.info.calibration.dip_sd_um), 1, 2},
    {"calibration_ambient_kPa", Kind::u8, offsetof(wire_packet, body.info.calibration.ambient_kPa), 1, 1},
    {"gain", Kind::f32, offsetof(wire_packet, body.info.calibration.sensors[0].gain), FT_MAX_SENSORS, sizeof(sensor_calibration)},
    {"gain_sd", Kind::f32, offsetof(wire_packet, body.info.calibration.sensors[0].gain_sd), FT_MAX_SENSORS, sizeof(sensor_calibration)},
    {"off_x_um", Kind::i16, offsetof(wire_packet, body.info.calibration.sensors[0].off_x_um), FT_MAX_SENSORS, sizeof(sensor_calibration)},
    {"off_y_um", Kind::i16, offsetof(wire_packet, body.info.calibration.sensors[0].off_y_um), FT_MAX_SENSORS, sizeof(sensor_calibration)},
    {"wider_q15", Kind::i16, offsetof(wire_packet, body.info.calibration.sensors[0].wider_q15), FT_MAX_SENSORS, sizeof(sensor_calibration)},
    {"pad_thickness_mm", Kind::f32, offsetof(wire_packet, body.info.pad.thickness_mm), 1, 4},
    {"pad_overhang_mm", Kind::f32, offsetof(wire_packet, body.info.pad.overhang_mm), 1, 4},
    {"pad_normal", Kind::f32, offsetof(wire_packet, body.info.pad.normal), 4, 4},
    {"pad_tangential", Kind::f32, offsetof(wire_packet, body.info.pad.tangential), 6, 4},
    {"pad_spread_mm2", Kind::f32, offsetof(wire_packet, body.info.pad.spread_mm2), 1, 4},
    {"pad_spread_sd_mm2", Kind::f32, offsetof(wire_packet, body.info.pad.spread_sd_mm2), 1, 4},
    {"pad_force_ratio", Kind::f32, offsetof(wire_packet, body.info.pad.force_ratio), 1, 4},
    {"pad_tangential_scale", Kind::f32, offsetof(wire_packet, body.info.pad.tangential_scale), 1, 4},
    {"pad_tangential_scale_sd", Kind::f32, offsetof(wire_packet, body.info.pad.tangential_scale_sd), 1, 4},
    {"pad_edge_ratio_x", Kind::f32, offsetof(wire_packet, body.info.pad.edges.ratio_x), 3, 4},
    {"pad_edge_ratio_y", Kind::f32, offsetof(wire_packet, body.info.pad.edges.ratio_y), 3, 4},
    {"pad_edge_gain_x", Kind::f32, offsetof(wire_packet, body.info.pad.edges.gain_x), 3, 4},
    {"pad_edge_gain_y", Kind::f32, offsetof(wire_packet, body.info.pad.edges.gain_y), 3, 4},
    {"pad_edge_place_x_mm", Kind::f32, offsetof(wire_packet, body.info.pad.edges.place_x_mm), 3, 4},
    {"pad_edge_place_y_mm", Kind::f32, offsetof(wire_packet, body.info.pad.edges.place_y_mm), 3, 4},
    {"pad_edge_pull_x_mm", Kind::f32, offsetof(wire_packet, body.info.pad.edges.pull_x_mm), 3, 4},
    {"pad_edge_pull_y_mm", Kind::f32, offsetof(wire_packet, body.info.pad.edges.pull_y_mm), 3, 4},
    {"pad_edge_force", Kind::f32, offsetof(wire_packet, body.info.pad.edges.force), 3, 4},
    {"pad_from_touch", Kind::u8, offsetof(wire_packet, body.info.pad.from_touch), 1, 1},
};
inline constexpr Field health_fields[] = {
    {"sequence", Kind::u16, offsetof(wire_packet, sequence), 1, 2},
    {"t_us", Kind::u64, offsetof(wire_packet, t_us), 1, 8},
    {"capabilities", Kind::u32, offsetof(wire_packet, body.health.capabilities), 1, 4},
    {"uptime_s", Kind::u32, offsetof(wire_packet, body.health.uptime_s), 1, 4},
    {"frames", Kind::u32, offsetof(wire_packet, body.health.frames), 1, 4},
    {"frames_incomplete", Kind::u32, offsetof(wire_packet, body.health.frames_incomplete), 1, 4},
    {"frames_skipped", Kind::u32, offsetof(wire_packet, body.health.frames_skipped), 1, 4},
    {"packets_sent", Kind::u32, offsetof(wire_packet, body.health.packets_sent), 1, 4},
    {"packets_dropped", Kind::u32, offsetof(wire_packet, body.health.packets_dropped), 1, 4},
    {"commands_done", Kind::u32, offsetof(wire_packet, body.health.commands_done), 1, 4},
    {"commands_rejected", Kind::u32, offsetof(wire_packet, body.health.commands_rejected), 1, 4},
    {"bus_nacks", Kind::u32, offsetof(wire_packet, body.health.bus_nacks), 1, 4},
    {"bus_timeouts", Kind::u32, offsetof(wire_packet, body.health.bus_timeouts), 1, 4},
    {"bus_recoveries", Kind::u32, offsetof(wire_packet, body.health.bus_recoveries), 1, 4},
    {"zero_readings", Kind::u32, offsetof(wire_packet, body.health.zero_readings), 1, 4},
    {"implausible_readings", Kind::u32, offsetof(wire_packet, body.health.implausible_readings), 1, 4},
    {"sensors_present", Kind::u64, offsetof(wire_packet, body.health.sensors_present), 1, 8},
    {"sensors_prom_bad", Kind::u64, offsetof(wire_packet, body.health.sensors_prom_bad), 1, 8},
    {"watchdog_resets", Kind::u32, offsetof(wire_packet, body.health.watchdog_resets), 1, 4},
    {"cpu_busy_permille", Kind::u16, offsetof(wire_packet, body.health.cpu_busy_permille), 1, 2},
    {"stack_free_bytes", Kind::u16, offsetof(wire_packet, body.health.stack_free_bytes), 1, 2},
    {"fit_failures", Kind::u32, offsetof(wire_packet, body.health.fit_failures), 1, 4},
};
inline constexpr Field ack_fields[] = {
    {"sequence", Kind::u16, offsetof(wire_packet, sequence), 1, 2},
    {"t_us", Kind::u64, offsetof(wire_packet, t_us), 1, 8},
    {"command", Kind::u8, offsetof(wire_packet, body.ack.command), 1, 1},
    {"result", Kind::u8, offsetof(wire_packet, body.ack.result), 1, 1},
    {"command_sequence", Kind::u16, offsetof(wire_packet, body.ack.sequence), 1, 2},
    {"host_time_us", Kind::u64, offsetof(wire_packet, body.ack.host_time_us), 1, 8},
};
inline constexpr Field crash_fields[] = {
    {"sequence", Kind::u16, offsetof(wire_packet, sequence), 1, 2},
    {"t_us", Kind::u64, offsetof(wire_packet, t_us), 1, 8},
    {"kind", Kind::u8, offsetof(wire_packet, body.crash.kind), 1, 1},
    {"exception", Kind::u8, offsetof(wire_packet, body.crash.exception), 1, 1},
    {"vector", Kind::u8, offsetof(wire_packet, body.crash.vector), 1, 1},
    {"activity", Kind::u8, offsetof(wire_packet, body.crash.activity), 1, 1},
    {"stuck", Kind::u8, offsetof(wire_packet, body.crash.stuck), 1, 1},
    {"event_codes", Kind::u8, offsetof(wire_packet, body.crash.event_codes), 8, 1},
    {"event_details", Kind::u8, offsetof(wire_packet, body.crash.event_details), 8, 1},
    {"r0", Kind::u32, offsetof(wire_packet, body.crash.r0), 1, 4},
    {"r1", Kind::u32, offsetof(wire_packet, body.crash.r1), 1, 4},
    {"r2", Kind::u32, offsetof(wire_packet, body.crash.r2), 1, 4},
    {"r3", Kind::u32, offsetof(wire_packet, body.crash.r3), 1, 4},
    {"r12", Kind::u32, offsetof(wire_packet, body.crash.r12), 1, 4},
    {"lr", Kind::u32, offsetof(wire_packet, body.crash.lr), 1, 4},
    {"pc", Kind::u32, offsetof(wire_packet, body.crash.pc), 1, 4},
    {"xpsr", Kind::u32, offsetof(wire_packet, body.crash.xpsr), 1, 4},
    {"sp", Kind::u32, offsetof(wire_packet, body.crash.sp), 1, 4},
    {"event_ages_1024us", Kind::u32, offsetof(wire_packet, body.crash.event_ages_1024us), 8, 4},
    {"end_us", Kind::u64, offsetof(wire_packet, body.crash.t_us), 1, 8},
};
inline constexpr Field sync_fields[] = {
    {"sequence", Kind::u16, offsetof(wire_packet, sequence), 1, 2},
    {"t_us", Kind::u64, offsetof(wire_packet, t_us), 1, 8},
    {"number", Kind::u32, offsetof(wire_packet, body.sync.number), 1, 4},
    {"level", Kind::u8, offsetof(wire_packet, body.sync.level), 1, 1},
};
inline constexpr Field cmd_stream_fields[] = {
    {"sequence", Kind::u16, offsetof(wire_packet, sequence), 1, 2},
    {"t_us", Kind::u64, offsetof(wire_packet, t_us), 1, 8},
    {"streams", Kind::u8, offsetof(wire_packet, body.cmd_stream.streams), 1, 1},
};
inline constexpr Field cmd_tare_fields[] = {
    {"sequence", Kind::u16, offsetof(wire_packet, sequence), 1, 2},
    {"t_us", Kind::u64, offsetof(wire_packet, t_us), 1, 8},
    {"force", Kind::u8, offsetof(wire_packet, body.cmd_tare.force), 1, 1},
};
inline constexpr Field cmd_rate_fields[] = {
    {"sequence", Kind::u16, offsetof(wire_packet, sequence), 1, 2},
    {"t_us", Kind::u64, offsetof(wire_packet, t_us), 1, 8},
    {"rate_mHz", Kind::u32, offsetof(wire_packet, body.cmd_rate.rate_mHz), 1, 4},
};
inline constexpr Field cmd_osr_fields[] = {
    {"sequence", Kind::u16, offsetof(wire_packet, sequence), 1, 2},
    {"t_us", Kind::u64, offsetof(wire_packet, t_us), 1, 8},
    {"osr", Kind::u16, offsetof(wire_packet, body.cmd_osr.osr), 1, 2},
};
inline constexpr Field cmd_slip_fields[] = {
    {"sequence", Kind::u16, offsetof(wire_packet, sequence), 1, 2},
    {"t_us", Kind::u64, offsetof(wire_packet, t_us), 1, 8},
    {"threshold_mm", Kind::f32, offsetof(wire_packet, body.cmd_slip.threshold_mm), 1, 4},
    {"window_ms", Kind::u16, offsetof(wire_packet, body.cmd_slip.window_ms), 1, 2},
};
inline constexpr Field cmd_info_fields[] = {
    {"sequence", Kind::u16, offsetof(wire_packet, sequence), 1, 2},
    {"t_us", Kind::u64, offsetof(wire_packet, t_us), 1, 8},
};
inline constexpr Field cmd_health_fields[] = {
    {"sequence", Kind::u16, offsetof(wire_packet, sequence), 1, 2},
    {"t_us", Kind::u64, offsetof(wire_packet, t_us), 1, 8},
};
inline constexpr Field cmd_crash_fields[] = {
    {"sequence", Kind::u16, offsetof(wire_packet, sequence), 1, 2},
    {"t_us", Kind::u64, offsetof(wire_packet, t_us), 1, 8},
};
inline constexpr Field cmd_loader_fields[] = {
    {"sequence", Kind::u16, offsetof(wire_packet, sequence), 1, 2},
    {"t_us", Kind::u64, offsetof(wire_packet, t_us), 1, 8},
    {"magic", Kind::u32, offsetof(wire_packet, body.cmd_loader.magic), 1, 4},
};
inline constexpr Field cmd_calibrate_fields[] = {
    {"sequence", Kind::u16, offsetof(wire_packet, sequence), 1, 2},
    {"t_us", Kind::u64, offsetof(wire_packet, t_us), 1, 8},
    {"sensor_count", Kind::u8, offsetof(wire_packet, body.cmd_calibrate.sensor_count), 1, 1},
    {"calibration_date_s", Kind::u32, offsetof(wire_packet, body.cmd_calibrate.calibration.date_s), 1, 4},
    {"calibration_placements", Kind::u16, offsetof(wire_packet, body.cmd_calibrate.calibration.placements), 1, 2},
    {"force_scale", Kind::f32, offsetof(wire_packet, body.cmd_calibrate.calibration.force_scale), 1, 4},
    {"force_scale_sd", Kind::f32, offsetof(wire_packet, body.cmd_calibrate.calibration.force_scale_sd), 1, 4},
    {"calibration_sigma_um", Kind::u16, offsetof(wire_packet, body.cmd_calibrate.calibration.sigma_um), 1, 2},
    {"calibration_sigma_sd_um", Kind::u16, offsetof(wire_packet, body.cmd_calibrate.calibration.sigma_sd_um), 1, 2},
    {"calibration_dip_share_q16", Kind::u16, offsetof(wire_packet, body.cmd_calibrate.calibration.dip_share_q16), 1, 2},
    {"calibration_dip_sd_um", Kind::u16, offsetof(wire_packet, body.cmd_calibrate.calibration.dip_sd_um), 1, 2},
    {"calibration_ambient_kPa", Kind::u8, offsetof(wire_packet, body.cmd_calibrate.calibration.ambient_kPa), 1, 1},
    {"gain", Kind::f32, offsetof(wire_packet, body.cmd_calibrate.calibration.sensors[0].gain), FT_MAX_SENSORS, sizeof(sensor_calibration)},
    {"gain_sd", Kind::f32, offsetof(wire_packet, body.cmd_calibrate.calibration.sensors[0].gain_sd), FT_MAX_SENSORS, sizeof(sensor_calibration)},
    {"off_x_um", Kind::i16, offsetof(wire_packet, body.cmd_calibrate.calibration.sensors[0].off_x_um), FT_MAX_SENSORS, sizeof(sensor_calibration)},
    {"off_y_um", Kind::i16, offsetof(wire_packet, body.cmd_calibrate.calibration.sensors[0].off_y_um), FT_MAX_SENSORS, sizeof(sensor_calibration)},
    {"wider_q15", Kind::i16, offsetof(wire_packet, body.cmd_calibrate.calibration.sensors[0].wider_q15), FT_MAX_SENSORS, sizeof(sensor_calibration)},
};
inline constexpr Field cmd_erase_calibration_fields[] = {
    {"sequence", Kind::u16, offsetof(wire_packet, sequence), 1, 2},
    {"t_us", Kind::u64, offsetof(wire_packet, t_us), 1, 8},
};
inline constexpr Field cmd_keep_fields[] = {
    {"sequence", Kind::u16, offsetof(wire_packet, sequence), 1, 2},
    {"t_us", Kind::u64, offsetof(wire_packet, t_us), 1, 8},
    {"keep", Kind::u8, offsetof(wire_packet, body.cmd_keep.keep), 1, 1},
};
inline constexpr Field cmd_prior_fields[] = {
    {"sequence", Kind::u16, offsetof(wire_packet, sequence), 1, 2},
    {"t_us", Kind::u64, offsetof(wire_packet, t_us), 1, 8},
    {"sigma_mm", Kind::f32, offsetof(wire_packet, body.cmd_prior.sigma_mm), 1, 4},
    {"width_mm", Kind::f32, offsetof(wire_packet, body.cmd_prior.width_mm), 1, 4},
};
inline constexpr Field cmd_location_limit_fields[] = {
    {"sequence", Kind::u16, offsetof(wire_packet, sequence), 1, 2},
    {"t_us", Kind::u64, offsetof(wire_packet, t_us), 1, 8},
    {"limit_mm", Kind::f32, offsetof(wire_packet, body.cmd_location_limit.limit_mm), 1, 4},
};
inline constexpr Field cmd_pad_fields[] = {
    {"sequence", Kind::u16, offsetof(wire_packet, sequence), 1, 2},
    {"t_us", Kind::u64, offsetof(wire_packet, t_us), 1, 8},
    {"pad_thickness_mm", Kind::f32, offsetof(wire_packet, body.cmd_pad.profile.thickness_mm), 1, 4},
    {"pad_overhang_mm", Kind::f32, offsetof(wire_packet, body.cmd_pad.profile.overhang_mm), 1, 4},
    {"pad_normal", Kind::f32, offsetof(wire_packet, body.cmd_pad.profile.normal), 4, 4},
    {"pad_tangential", Kind::f32, offsetof(wire_packet, body.cmd_pad.profile.tangential), 6, 4},
    {"pad_spread_mm2", Kind::f32, offsetof(wire_packet, body.cmd_pad.profile.spread_mm2), 1, 4},
    {"pad_spread_sd_mm2", Kind::f32, offsetof(wire_packet, body.cmd_pad.profile.spread_sd_mm2), 1, 4},
    {"pad_force_ratio", Kind::f32, offsetof(wire_packet, body.cmd_pad.profile.force_ratio), 1, 4},
    {"pad_tangential_scale", Kind::f32, offsetof(wire_packet, body.cmd_pad.profile.tangential_scale), 1, 4},
    {"pad_tangential_scale_sd", Kind::f32, offsetof(wire_packet, body.cmd_pad.profile.tangential_scale_sd), 1, 4},
    {"pad_edge_ratio_x", Kind::f32, offsetof(wire_packet, body.cmd_pad.profile.edges.ratio_x), 3, 4},
    {"pad_edge_ratio_y", Kind::f32, offsetof(wire_packet, body.cmd_pad.profile.edges.ratio_y), 3, 4},
    {"pad_edge_gain_x", Kind::f32, offsetof(wire_packet, body.cmd_pad.profile.edges.gain_x), 3, 4},
    {"pad_edge_gain_y", Kind::f32, offsetof(wire_packet, body.cmd_pad.profile.edges.gain_y), 3, 4},
    {"pad_edge_place_x_mm", Kind::f32, offsetof(wire_packet, body.cmd_pad.profile.edges.place_x_mm), 3, 4},
    {"pad_edge_place_y_mm", Kind::f32, offsetof(wire_packet, body.cmd_pad.profile.edges.place_y_mm), 3, 4},
    {"pad_edge_pull_x_mm", Kind::f32, offsetof(wire_packet, body.cmd_pad.profile.edges.pull_x_mm), 3, 4},
    {"pad_edge_pull_y_mm", Kind::f32, offsetof(wire_packet, body.cmd_pad.profile.edges.pull_y_mm), 3, 4},
    {"pad_edge_force", Kind::f32, offsetof(wire_packet, body.cmd_pad.profile.edges.force), 3, 4},
    {"pad_from_touch", Kind::u8, offsetof(wire_packet, body.cmd_pad.profile.from_touch), 1, 1},
};
inline constexpr Field cmd_erase_pad_fields[] = {
    {"sequence", Kind::u16, offsetof(wire_packet, sequence), 1, 2},
    {"t_us", Kind::u64, offsetof(wire_packet, t_us), 1, 8},
};
inline constexpr Field cmd_sync_fields[] = {
    {"sequence", Kind::u16, offsetof(wire_packet, sequence), 1, 2},
    {"t_us", Kind::u64, offsetof(wire_packet, t_us), 1, 8},
    {"mode", Kind::u8, offsetof(wire_packet, body.cmd_sync.mode), 1, 1},
};

struct Packet {
  std::uint8_t type;
  const Field *fields;
  std::size_t count;
};

inline constexpr Packet packets[] = {
    {0x01, contact_fields, sizeof contact_fields / sizeof *contact_fields},
    {0x02, raw_fields, sizeof raw_fields / sizeof *raw_fields},
    {0x03, info_fields, sizeof info_fields / sizeof *info_fields},
    {0x04, health_fields, sizeof health_fields / sizeof *health_fields},
    {0x05, ack_fields, sizeof ack_fields / sizeof *ack_fields},
    {0x06, crash_fields, sizeof crash_fields / sizeof *crash_fields},
    {0x07, sync_fields, sizeof sync_fields / sizeof *sync_fields},
    {0x80, cmd_stream_fields, sizeof cmd_stream_fields / sizeof *cmd_stream_fields},
    {0x81, cmd_tare_fields, sizeof cmd_tare_fields / sizeof *cmd_tare_fields},
    {0x82, cmd_rate_fields, sizeof cmd_rate_fields / sizeof *cmd_rate_fields},
    {0x83, cmd_osr_fields, sizeof cmd_osr_fields / sizeof *cmd_osr_fields},
    {0x84, cmd_slip_fields, sizeof cmd_slip_fields / sizeof *cmd_slip_fields},
    {0x85, cmd_info_fields, sizeof cmd_info_fields / sizeof *cmd_info_fields},
    {0x86, cmd_health_fields, sizeof cmd_health_fields / sizeof *cmd_health_fields},
    {0x8F, cmd_crash_fields, sizeof cmd_crash_fields / sizeof *cmd_crash_fields},
    {0x87, cmd_loader_fields, sizeof cmd_loader_fields / sizeof *cmd_loader_fields},
    {0x88, cmd_calibrate_fields, sizeof cmd_calibrate_fields / sizeof *cmd_calibrate_fields},
    {0x89, cmd_erase_calibration_fields, sizeof cmd_erase_calibration_fields / sizeof *cmd_erase_calibration_fields},
    {0x8A, cmd_keep_fields, sizeof cmd_keep_fields / sizeof *cmd_keep_fields},
    {0x8B, cmd_prior_fields, sizeof cmd_prior_fields / sizeof *cmd_prior_fields},
    {0x8C, cmd_location_limit_fields, sizeof cmd_location_limit_fields / sizeof *cmd_location_limit_fields},
    {0x8D, cmd_pad_fields, sizeof cmd_pad_fields / sizeof *cmd_pad_fields},
    {0x8E, cmd_erase_pad_fields, sizeof cmd_erase_pad_fields / sizeof *cmd_erase_pad_fields},
    {0x90, cmd_sync_fields, sizeof cmd_sync_fields / sizeof *cmd_sync_fields},
};

} // namespace fingertip::values
