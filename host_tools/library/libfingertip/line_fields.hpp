/* written by firmware/wire/line.py from line.toml; change it there.
 *
 * Fields of packets in the order of recordings, and words. No interface. */
#pragma once

#include "libfingertip/wire.hpp"

#include <cstddef>
#include <cstdint>
#include <string>

namespace fingertip::recording {

/* A value of the packet that the file shows in another unit: shown = raw / scale. */
template <typename Integer> struct Scaled {
  Integer &raw;
  double scale;
  int digits;
};

/* A float that holds under a flag. */
struct Quantity {
  float &value;
  bool valid;
};

inline constexpr std::size_t RAW_COLUMNS = 6; /* without those of the sensors */

/* Sets of columns that came later, one after the other; a recording has the first N of them. */
inline constexpr int LATER_SETS = 2;

/* Flags of columns that a recording with N of these sets lacks. */
inline constexpr std::uint32_t flags_beyond(int sets) {
  std::uint32_t flags = 0;
  flags |= sets > 0 ? 0u : static_cast<std::uint32_t>(CONTACT_FLAG_TANGENTIAL_VALID | CONTACT_FLAG_VELOCITY_VALID);
  flags |= sets > 1 ? 0u : static_cast<std::uint32_t>(CONTACT_FLAG_SHAPE_VALID | CONTACT_FLAG_TWO_CONTACTS | CONTACT_FLAG_EDGE);
  return flags;
}

template <typename Visitor>
void visit_contact(Visitor &visit, wire_packet &packet, int sets = LATER_SETS) {
  wire_contact &contact = packet.body.contact;
  visit("sequence", packet.sequence);
  visit("flags", contact.flags);
  visit("sensors_used", contact.sensors_used);
  visit("x_mm", Quantity{contact.x_mm, (contact.flags & CONTACT_FLAG_FIT_VALID) != 0});
  visit("y_mm", Quantity{contact.y_mm, (contact.flags & CONTACT_FLAG_FIT_VALID) != 0});
  visit("p0_Pa", Quantity{contact.p0_Pa, (contact.flags & CONTACT_FLAG_FIT_VALID) != 0});
  visit("sigma_mm", Quantity{contact.sigma_mm, (contact.flags & CONTACT_FLAG_FIT_VALID) != 0});
  visit("force_N", Quantity{contact.force_N, (contact.flags & CONTACT_FLAG_FIT_VALID) != 0});
  visit("slip_mm", Quantity{contact.slip_mm, (contact.flags & CONTACT_FLAG_SLIP_VALID) != 0});
  visit("residual_rms_Pa", Quantity{contact.residual_rms_Pa, (contact.flags & CONTACT_FLAG_FIT_VALID) != 0});
  visit("location_sd_mm", Quantity{contact.location_sd_mm, (contact.flags & CONTACT_FLAG_UNCERTAINTY_VALID) != 0});
  visit("force_sd_N", Quantity{contact.force_sd_N, (contact.flags & CONTACT_FLAG_UNCERTAINTY_VALID) != 0});
  visit("sigma_x_mm", Quantity{contact.sigma_x_mm, (contact.flags & CONTACT_FLAG_WIDTHS_VALID) != 0});
  visit("sigma_y_mm", Quantity{contact.sigma_y_mm, (contact.flags & CONTACT_FLAG_WIDTHS_VALID) != 0});
  visit("width_correlation", Quantity{contact.width_correlation, (contact.flags & CONTACT_FLAG_WIDTHS_VALID) != 0});
  visit("convert_us", contact.stages.convert_us);
  visit("read_us", contact.stages.read_us);
  visit("queue_us", contact.stages.queue_us);
  visit("condition_us", contact.stages.condition_us);
  visit("fit_us", contact.stages.fit_us);
  visit("contact_us", contact.stages.contact_us);
  visit("total_us", contact.stages.total_us);
  if (sets == 0) {
    return;
  }
  visit("qx_N", Quantity{contact.qx_N, (contact.flags & CONTACT_FLAG_TANGENTIAL_VALID) != 0});
  visit("qy_N", Quantity{contact.qy_N, (contact.flags & CONTACT_FLAG_TANGENTIAL_VALID) != 0});
  visit("q_sd_N", Quantity{contact.q_sd_N, (contact.flags & CONTACT_FLAG_TANGENTIAL_VALID) != 0});
  visit("tangential_ratio", Quantity{contact.tangential_ratio, (contact.flags & CONTACT_FLAG_TANGENTIAL_VALID) != 0});
  visit("vx_mm_s", Quantity{contact.vx_mm_s, (contact.flags & CONTACT_FLAG_VELOCITY_VALID) != 0});
  visit("vy_mm_s", Quantity{contact.vy_mm_s, (contact.flags & CONTACT_FLAG_VELOCITY_VALID) != 0});
  if (sets == 1) {
    return;
  }
  visit("shape_age_ms", Quantity{contact.shape_age_ms, (contact.flags & CONTACT_FLAG_SHAPE_VALID) != 0});
  visit("x1_mm", Quantity{contact.x1_mm, (contact.flags & CONTACT_FLAG_TWO_CONTACTS) != 0});
  visit("y1_mm", Quantity{contact.y1_mm, (contact.flags & CONTACT_FLAG_TWO_CONTACTS) != 0});
  visit("location1_sd_mm", Quantity{contact.location1_sd_mm, (contact.flags & CONTACT_FLAG_TWO_CONTACTS) != 0});
  visit("force1_N", Quantity{contact.force1_N, (contact.flags & CONTACT_FLAG_TWO_CONTACTS) != 0});
  visit("force1_sd_N", Quantity{contact.force1_sd_N, (contact.flags & CONTACT_FLAG_TWO_CONTACTS) != 0});
  visit("x2_mm", Quantity{contact.x2_mm, (contact.flags & CONTACT_FLAG_TWO_CONTACTS) != 0});
  visit("y2_mm", Quantity{contact.y2_mm, (contact.flags & CONTACT_FLAG_TWO_CONTACTS) != 0});
  visit("location2_sd_mm", Quantity{contact.location2_sd_mm, (contact.flags & CONTACT_FLAG_TWO_CONTACTS) != 0});
  visit("force2_N", Quantity{contact.force2_N, (contact.flags & CONTACT_FLAG_TWO_CONTACTS) != 0});
  visit("force2_sd_N", Quantity{contact.force2_sd_N, (contact.flags & CONTACT_FLAG_TWO_CONTACTS) != 0});
  visit("edge_angle_deg", Quantity{contact.edge_angle_deg, (contact.flags & CONTACT_FLAG_EDGE) != 0});
  visit("edge_angle_sd_deg", Quantity{contact.edge_angle_sd_deg, (contact.flags & CONTACT_FLAG_EDGE) != 0});
  visit("edge_length_mm", Quantity{contact.edge_length_mm, (contact.flags & CONTACT_FLAG_EDGE) != 0});
}

template <typename Visitor>
void visit_raw(Visitor &visit, wire_packet &packet, std::uint8_t sensor_count) {
  wire_raw &raw = packet.body.raw;
  visit("raw_sequence", packet.sequence);
  visit("raw_flags", raw.flags);
  visit("valid", raw.valid);
  visit("saturated", raw.saturated);
  visit("doubtful", raw.doubtful);
  visit("temperature_degC", Scaled<std::int16_t>{raw.temperature_cC, 100.0, 2});
  for (int k = 0; k < sensor_count; k++) {
    visit("s" + std::to_string(k) + "_Pa", Scaled<std::int32_t>{raw.pressure_Pa_q10[k], 1024.0, 4});
  }
  for (int k = 0; k < sensor_count; k++) {
    visit("tare" + std::to_string(k) + "_Pa", Scaled<std::int32_t>{raw.baseline_Pa_q10[k], 1024.0, 4});
  }
}

template <typename Visitor> void visit_health(Visitor &visit, wire_health &health) {
  visit("capabilities", health.capabilities);
  visit("uptime_s", health.uptime_s);
  visit("frames", health.frames);
  visit("frames_incomplete", health.frames_incomplete);
  visit("frames_skipped", health.frames_skipped);
  visit("packets_sent", health.packets_sent);
  visit("packets_dropped", health.packets_dropped);
  visit("commands_done", health.commands_done);
  visit("commands_rejected", health.commands_rejected);
  visit("bus_nacks", health.bus_nacks);
  visit("bus_timeouts", health.bus_timeouts);
  visit("bus_recoveries", health.bus_recoveries);
  visit("zero_readings", health.zero_readings);
  visit("implausible_readings", health.implausible_readings);
  visit("fit_failures", health.fit_failures);
  visit("sensors_present", health.sensors_present);
  visit("sensors_prom_bad", health.sensors_prom_bad);
  visit("watchdog_resets", health.watchdog_resets);
  visit("cpu_busy_permille", health.cpu_busy_permille);
  visit("stack_free_bytes", health.stack_free_bytes);
}

template <typename Visitor> void visit_ack(Visitor &visit, wire_ack &ack) {
  visit("command", ack.command);
  visit("result", ack.result);
  visit("command_sequence", ack.sequence);
  visit("host_time_us", ack.host_time_us);
}

template <typename Visitor> void visit_sync(Visitor &visit, wire_sync &sync) {
  visit("number", sync.number);
  visit("level", sync.level);
}

template <typename Visitor> void visit_info(Visitor &visit, wire_info &info) {
  visit("sensors", info.sensor_count);
  visit("capabilities", info.capabilities);
  visit("rate_mHz", info.rate_mHz);
  visit("measured_rate_mHz", info.measured_rate_mHz);
  visit("osr", info.osr);
  visit("temperature_interval_ms", info.temperature_interval_ms);
  visit("slip_threshold_mm", info.slip_threshold_mm);
  visit("slip_window_ms", info.slip_window_ms);
  visit("fit_iterations", info.fit_iterations);
  visit("streams", info.streams);
  visit("pitch_mm", info.pitch_mm);
  visit("prior_sigma_mm", info.prior_sigma_mm);
  visit("prior_width_mm", info.prior_width_mm);
  visit("location_limit_mm", info.location_limit_mm);
  visit("sync", info.sync);
  visit("stored", info.stored);
}

/* What there is only of a calibrated fingertip: numbers, and lists with one for each sensor. */
template <typename Visitor> void visit_calibration(Visitor &visit, struct calibration &calibration) {
  visit("calibration_date_s", calibration.date_s);
  visit("calibration_placements", calibration.placements);
  visit("force_scale", calibration.force_scale);
  visit("force_scale_sd", calibration.force_scale_sd);
  visit("calibration_sigma_um", calibration.sigma_um);
  visit("calibration_sigma_sd_um", calibration.sigma_sd_um);
  visit("calibration_dip_share_q16", calibration.dip_share_q16);
  visit("calibration_dip_sd_um", calibration.dip_sd_um);
  visit("calibration_ambient_kPa", calibration.ambient_kPa);
}

template <typename Visitor> void visit_sensor_lists(Visitor &visit) {
  visit("gains", &sensor_calibration::gain);
  visit("gain_sds", &sensor_calibration::gain_sd);
  visit("off_x_um", &sensor_calibration::off_x_um);
  visit("off_y_um", &sensor_calibration::off_y_um);
  visit("wider_q15", &sensor_calibration::wider_q15);
}

/* What there is only where a pad's profile is stored: numbers, and lists with one for each term. */
template <typename Visitor> void visit_pad(Visitor &visit, pad_profile &pad) {
  visit("pad_thickness_mm", pad.thickness_mm);
  visit("pad_overhang_mm", pad.overhang_mm);
  visit("pad_spread_mm2", pad.spread_mm2);
  visit("pad_spread_sd_mm2", pad.spread_sd_mm2);
  visit("pad_force_ratio", pad.force_ratio);
  visit("pad_tangential_scale", pad.tangential_scale);
  visit("pad_tangential_scale_sd", pad.tangential_scale_sd);
  visit("pad_from_touch", pad.from_touch);
}

struct PadList {
  const char *name;
  std::size_t terms;
  float &(*value)(pad_profile &pad, std::size_t term);
};
inline constexpr PadList pad_lists[] = {
    {"pad_shares", 2, [](pad_profile &pad, std::size_t j) -> float & { return pad.normal[j].share; }},
    {"pad_sds_mm", 2, [](pad_profile &pad, std::size_t j) -> float & { return pad.normal[j].sd_mm; }},
    {"pad_moments_mm", 3, [](pad_profile &pad, std::size_t j) -> float & { return pad.tangential[j].moment_mm; }},
    {"pad_moment_sds_mm", 3, [](pad_profile &pad, std::size_t j) -> float & { return pad.tangential[j].sd_mm; }},
    {"pad_edge_ratio_x", 3, [](pad_profile &pad, std::size_t j) -> float & { return pad.edges.ratio_x[j]; }},
    {"pad_edge_ratio_y", 3, [](pad_profile &pad, std::size_t j) -> float & { return pad.edges.ratio_y[j]; }},
    {"pad_edge_gain_x", 3, [](pad_profile &pad, std::size_t j) -> float & { return pad.edges.gain_x[j]; }},
    {"pad_edge_gain_y", 3, [](pad_profile &pad, std::size_t j) -> float & { return pad.edges.gain_y[j]; }},
    {"pad_edge_place_x_mm", 3, [](pad_profile &pad, std::size_t j) -> float & { return pad.edges.place_x_mm[j]; }},
    {"pad_edge_place_y_mm", 3, [](pad_profile &pad, std::size_t j) -> float & { return pad.edges.place_y_mm[j]; }},
    {"pad_edge_pull_x_mm", 3, [](pad_profile &pad, std::size_t j) -> float & { return pad.edges.pull_x_mm[j]; }},
    {"pad_edge_pull_y_mm", 3, [](pad_profile &pad, std::size_t j) -> float & { return pad.edges.pull_y_mm[j]; }},
    {"pad_edge_force", 3, [](pad_profile &pad, std::size_t j) -> float & { return pad.edges.force[j]; }},
};

} // namespace fingertip::recording

namespace fingertip::words {

struct Word {
  std::uint32_t value; /* a bit, or a number */
  const char *word;
};
inline constexpr Word streams[] = {
    {WIRE_STREAM_CONTACT, "contact"},
    {WIRE_STREAM_RAW, "raw"},
    {WIRE_STREAM_HEALTH, "health"},
};
inline constexpr Word capabilities[] = {
    {WIRE_CAPABILITY_FIT, "fit"},
    {WIRE_CAPABILITY_SLIP, "slip"},
    {WIRE_CAPABILITY_RAW_STREAM, "raw"},
    {WIRE_CAPABILITY_TANGENTIAL, "tangential"},
    {WIRE_CAPABILITY_SYNC, "sync"},
    {WIRE_CAPABILITY_SECOND, "second"},
};
inline constexpr Word stored[] = {
    {WIRE_STORED_CALIBRATION, "calibration"},
    {WIRE_STORED_SETTINGS, "settings"},
    {WIRE_STORED_WRITING, "writing"},
    {WIRE_STORED_DAMAGED, "damaged"},
    {WIRE_STORED_PAD, "pad"},
};
inline constexpr Word results[] = {
    {WIRE_RESULT_DONE, "done"},
    {WIRE_RESULT_UNKNOWN_COMMAND, "its firmware does not know this command"},
    {WIRE_RESULT_OUT_OF_RANGE, "the value is out of range for this firmware"},
    {WIRE_RESULT_NOT_NOW, "not possible now"},
};
inline constexpr Word commands[] = {
    {WIRE_CMD_STREAM, "stream"},
    {WIRE_CMD_TARE, "tare"},
    {WIRE_CMD_RATE, "rate"},
    {WIRE_CMD_OSR, "osr"},
    {WIRE_CMD_SLIP, "slip"},
    {WIRE_CMD_INFO, "info"},
    {WIRE_CMD_HEALTH, "health"},
    {WIRE_CMD_CRASH, "crash"},
    {WIRE_CMD_LOADER, "loader"},
    {WIRE_CMD_CALIBRATE, "calibrate"},
    {WIRE_CMD_ERASE_CALIBRATION, "erase calibration"},
    {WIRE_CMD_KEEP, "keep"},
    {WIRE_CMD_PRIOR, "prior"},
    {WIRE_CMD_LOCATION_LIMIT, "limit"},
    {WIRE_CMD_PAD, "pad"},
    {WIRE_CMD_ERASE_PAD, "erase pad"},
    {WIRE_CMD_SYNC, "sync"},
};

struct Flag {
  std::uint32_t bit;
  const char *name;
  bool warning;
};
/* Those of state, then the warnings. */
inline constexpr Flag flags[] = {
    {CONTACT_FLAG_CONTACT, "CONTACT", false},
    {CONTACT_FLAG_FIT_VALID, "FIT_VALID", false},
    {CONTACT_FLAG_UNCERTAINTY_VALID, "UNCERTAINTY_VALID", false},
    {CONTACT_FLAG_SLIP_VALID, "SLIP_VALID", false},
    {CONTACT_FLAG_SLIP, "SLIP", false},
    {CONTACT_FLAG_TARED, "TARED", false},
    {CONTACT_FLAG_HELD, "HELD", false},
    {CONTACT_FLAG_WIDTHS_VALID, "WIDTHS_VALID", false},
    {CONTACT_FLAG_CALIBRATED, "CALIBRATED", false},
    {CONTACT_FLAG_TANGENTIAL_VALID, "TANGENTIAL_VALID", false},
    {CONTACT_FLAG_TANGENTIAL_FROM_TOUCH, "TANGENTIAL_FROM_TOUCH", false},
    {CONTACT_FLAG_VELOCITY_VALID, "VELOCITY_VALID", false},
    {CONTACT_FLAG_MOVING, "MOVING", false},
    {CONTACT_FLAG_SLIDING, "SLIDING", false},
    {CONTACT_FLAG_SHAPE_VALID, "SHAPE_VALID", false},
    {CONTACT_FLAG_EDGE, "EDGE", false},
    {CONTACT_FLAG_LOW_SIGNAL, "LOW_SIGNAL", true},
    {CONTACT_FLAG_FLAT, "FLAT", true},
    {CONTACT_FLAG_UNCERTAIN, "UNCERTAIN", true},
    {CONTACT_FLAG_MODEL, "MODEL", true},
    {CONTACT_FLAG_SATURATED, "SATURATED", true},
    {CONTACT_FLAG_FORCE_LOWER_BOUND, "FORCE_LOWER_BOUND", true},
    {CONTACT_FLAG_SENSOR_MASKED, "SENSOR_MASKED", true},
    {CONTACT_FLAG_AT_BOUND, "AT_BOUND", true},
    {CONTACT_FLAG_ELONGATED, "ELONGATED", true},
    {CONTACT_FLAG_ZERO_DOUBTFUL, "ZERO_DOUBTFUL", true},
    {CONTACT_FLAG_SENSOR_DOUBTFUL, "SENSOR_DOUBTFUL", true},
    {CONTACT_FLAG_TANGENTIAL_LATE, "TANGENTIAL_LATE", true},
    {CONTACT_FLAG_TWO_CONTACTS, "TWO_CONTACTS", true},
    {CONTACT_FLAG_SHAPE_UNKNOWN, "SHAPE_UNKNOWN", true},
};

} // namespace fingertip::words
