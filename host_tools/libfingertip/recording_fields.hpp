/* The tables of fields behind recordings: columns, cells and comments, for their writers and their
 * reader; no interface of the library. */
#pragma once

#include "libfingertip/packet_fields.hpp"
#include "libfingertip/text.hpp"
#include "libfingertip/wire.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace fingertip::recording {

inline constexpr const char *FIRST_WORDS = "# fingertip-recording ";
inline constexpr const char *FORMAT_OF_ONE = "1";
inline constexpr const char *FORMAT_OF_SEVERAL = "2";
inline constexpr const char *JOINT_COLUMNS = "device,time_us,";
inline constexpr const char *PACKET_HEALTH = "health";
inline constexpr const char *PACKET_INFO = "info";
inline constexpr const char *PACKET_ACK = "ack";
inline constexpr double Q10 = 1024.0;
inline constexpr std::size_t RAW_COLUMNS = 6; /* without those of the sensors */

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

/* One walk over the fields of each packet serves the header, the rows and the reader; the order
 * here is the order of the columns. A quantity that holds only under a flag names it: where the
 * flag is off the field is zero (contact_flags.h), and its cell empty. Recordings of before there
 * was a tangential load have no columns for it: has_tangential. */
template <typename Visitor>
void visit_contact(Visitor &visit, wire_packet &packet, bool has_tangential = true) {
  wire_contact &contact = packet.body.contact;
  visit("sequence", packet.sequence);
  visit("flags", contact.flags);
  visit("sensors_used", contact.sensors_used);
  auto quantity = [&](const char *name, float &value, std::uint32_t flag) {
    visit(name, Quantity{value, (contact.flags & flag) != 0});
  };
  quantity("x_mm", contact.x_mm, CONTACT_FLAG_FIT_VALID);
  quantity("y_mm", contact.y_mm, CONTACT_FLAG_FIT_VALID);
  quantity("p0_Pa", contact.p0_Pa, CONTACT_FLAG_FIT_VALID);
  quantity("sigma_mm", contact.sigma_mm, CONTACT_FLAG_FIT_VALID);
  quantity("force_N", contact.force_N, CONTACT_FLAG_FIT_VALID);
  quantity("slip_mm", contact.slip_mm, CONTACT_FLAG_SLIP_VALID);
  quantity("residual_rms_Pa", contact.residual_rms_Pa, CONTACT_FLAG_FIT_VALID);
  quantity("location_sd_mm", contact.location_sd_mm, CONTACT_FLAG_UNCERTAINTY_VALID);
  quantity("force_sd_N", contact.force_sd_N, CONTACT_FLAG_UNCERTAINTY_VALID);
  quantity("sigma_x_mm", contact.sigma_x_mm, CONTACT_FLAG_WIDTHS_VALID);
  quantity("sigma_y_mm", contact.sigma_y_mm, CONTACT_FLAG_WIDTHS_VALID);
  quantity("width_correlation", contact.width_correlation, CONTACT_FLAG_WIDTHS_VALID);
  visit("convert_us", contact.stages.convert_us);
  visit("read_us", contact.stages.read_us);
  visit("queue_us", contact.stages.queue_us);
  visit("condition_us", contact.stages.condition_us);
  visit("fit_us", contact.stages.fit_us);
  visit("contact_us", contact.stages.contact_us);
  visit("total_us", contact.stages.total_us);
  if (!has_tangential) {
    return;
  }
  quantity("qx_N", contact.qx_N, CONTACT_FLAG_TANGENTIAL_VALID);
  quantity("qy_N", contact.qy_N, CONTACT_FLAG_TANGENTIAL_VALID);
  quantity("q_sd_N", contact.q_sd_N, CONTACT_FLAG_TANGENTIAL_VALID);
  quantity("tangential_ratio", contact.tangential_ratio, CONTACT_FLAG_TANGENTIAL_VALID);
  quantity("vx_mm_s", contact.vx_mm_s, CONTACT_FLAG_VELOCITY_VALID);
  quantity("vy_mm_s", contact.vy_mm_s, CONTACT_FLAG_VELOCITY_VALID);
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
    visit("s" + std::to_string(k) + "_Pa", Scaled<std::int32_t>{raw.pressure_Pa_q10[k], Q10, 4});
  }
  for (int k = 0; k < sensor_count; k++) {
    visit("tare" + std::to_string(k) + "_Pa", Scaled<std::int32_t>{raw.baseline_Pa_q10[k], Q10, 4});
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
  visit("stored", info.stored);
}

/* What there is only of a calibrated fingertip: numbers, and lists with one for each sensor. */
template <typename Visitor> void visit_calibration(Visitor &visit, calibration &calibration) {
  visit("calibration_date_s", calibration.date_s);
  visit("calibration_placements", calibration.placements);
  visit("force_scale", calibration.force_scale);
  visit("force_scale_sd", calibration.force_scale_sd);
}

struct SensorList {
  const char *name;
  float sensor_calibration::*value;
};
inline constexpr SensorList sensor_lists[] = {{"gains", &sensor_calibration::gain},
                                              {"gain_sds", &sensor_calibration::gain_sd}};

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
    {"pad_shares", PAD_NORMAL_TERMS,
     [](pad_profile &pad, std::size_t j) -> float & { return pad.normal[j].share; }},
    {"pad_sds_mm", PAD_NORMAL_TERMS,
     [](pad_profile &pad, std::size_t j) -> float & { return pad.normal[j].sd_mm; }},
    {"pad_moments_mm", PAD_TANGENTIAL_TERMS,
     [](pad_profile &pad, std::size_t j) -> float & { return pad.tangential[j].moment_mm; }},
    {"pad_moment_sds_mm", PAD_TANGENTIAL_TERMS,
     [](pad_profile &pad, std::size_t j) -> float & { return pad.tangential[j].sd_mm; }},
    {"pad_edge_ratio_x", PAD_EDGE_TERMS,
     [](pad_profile &pad, std::size_t j) -> float & { return pad.edges.ratio_x[j]; }},
    {"pad_edge_ratio_y", PAD_EDGE_TERMS,
     [](pad_profile &pad, std::size_t j) -> float & { return pad.edges.ratio_y[j]; }},
    {"pad_edge_gain_x", PAD_EDGE_TERMS,
     [](pad_profile &pad, std::size_t j) -> float & { return pad.edges.gain_x[j]; }},
    {"pad_edge_gain_y", PAD_EDGE_TERMS,
     [](pad_profile &pad, std::size_t j) -> float & { return pad.edges.gain_y[j]; }},
    {"pad_edge_place_x_mm", PAD_EDGE_TERMS,
     [](pad_profile &pad, std::size_t j) -> float & { return pad.edges.place_x_mm[j]; }},
    {"pad_edge_place_y_mm", PAD_EDGE_TERMS,
     [](pad_profile &pad, std::size_t j) -> float & { return pad.edges.place_y_mm[j]; }},
    {"pad_edge_pull_x_mm", PAD_EDGE_TERMS,
     [](pad_profile &pad, std::size_t j) -> float & { return pad.edges.pull_x_mm[j]; }},
    {"pad_edge_pull_y_mm", PAD_EDGE_TERMS,
     [](pad_profile &pad, std::size_t j) -> float & { return pad.edges.pull_y_mm[j]; }},
    {"pad_edge_force", PAD_EDGE_TERMS,
     [](pad_profile &pad, std::size_t j) -> float & { return pad.edges.force[j]; }}};

struct Namer {
  std::string text;
  template <typename Value> void operator()(const std::string &name, const Value &) {
    text += "," + name;
  }
};

template <typename Value> std::string cell_text(const Value &value) {
  if constexpr (std::is_same_v<Value, float>) {
    return shortest(value);
  } else if constexpr (std::is_same_v<Value, Quantity>) {
    bool empty = !value.valid && value.value == 0 && !std::signbit(value.value);
    return empty ? "" : shortest(value.value);
  } else if constexpr (std::is_integral_v<Value>) {
    return std::to_string(value);
  } else {
    return fixed(value.raw / value.scale, value.digits);
  }
}

struct RowWriter {
  std::string text;
  template <typename Value> void operator()(const std::string &, const Value &value) {
    text += "," + cell_text(value);
  }
};

struct PairWriter {
  Metadata pairs;
  template <typename Value> void operator()(const std::string &name, const Value &value) {
    pairs.emplace_back(name, cell_text(value));
  }
  std::string text() const {
    std::string joined;
    for (const auto &[key, value] : pairs) {
      joined += " " + key + "=" + value;
    }
    return joined;
  }
};

/* What is wrong with a line, without its place. */
struct Damage {
  std::string what;
};

template <typename Integer> Integer checked(std::int64_t value, const std::string &name) {
  if (value < static_cast<std::int64_t>(std::numeric_limits<Integer>::min()) ||
      value > static_cast<std::int64_t>(std::numeric_limits<Integer>::max())) {
    throw Damage{name + " is out of range"};
  }
  return static_cast<Integer>(value);
}

template <typename Value>
void parse_cell(const std::string &name, std::string_view cell, Value &&value) {
  using Plain = std::decay_t<Value>;
  std::string wrong = name + " is \"" + std::string(cell) + "\"";
  if constexpr (std::is_same_v<Plain, Quantity>) {
    if (cell.empty() && !value.valid) {
      value.value = 0;
      return;
    }
    parse_cell(name, cell, value.value);
  } else if constexpr (std::is_same_v<Plain, float>) {
    auto number = to_float(cell);
    if (!number) {
      throw Damage{wrong};
    }
    value = *number;
  } else if constexpr (std::is_same_v<Plain, std::uint64_t>) {
    auto number = to_u64(cell);
    if (!number) {
      throw Damage{wrong};
    }
    value = *number;
  } else if constexpr (std::is_integral_v<Plain>) {
    auto number = to_i64(cell);
    if (!number) {
      throw Damage{wrong};
    }
    value = checked<Plain>(*number, name);
  } else {
    auto number = to_double(cell);
    if (!number || std::fabs(*number) > 1e12) {
      throw Damage{wrong};
    }
    value.raw =
        checked<std::decay_t<decltype(value.raw)>>(std::llround(*number * value.scale), name);
  }
}

struct RowReader {
  const std::vector<std::string_view> &cells;
  std::size_t at;
  template <typename Value> void operator()(const std::string &name, Value &&value) {
    parse_cell(name, cells[at++], std::forward<Value>(value));
  }
};

struct PairReader {
  const std::map<std::string, std::string, std::less<>> &pairs;
  template <typename Value> void operator()(const std::string &name, Value &&value) {
    auto pair = pairs.find(name);
    if (pair == pairs.end()) {
      throw Damage{name + " is missing"};
    }
    parse_cell(name, pair->second, std::forward<Value>(value));
  }
};

inline std::string header_text(std::uint8_t sensor_count, bool has_tangential = true) {
  wire_packet packet;
  std::memset(&packet, 0, sizeof packet);
  Namer namer;
  visit_contact(namer, packet, has_tangential);
  visit_raw(namer, packet, sensor_count);
  return "t_us,frame" + namer.text;
}

inline std::size_t contact_columns(bool has_tangential = true) {
  wire_packet packet;
  std::memset(&packet, 0, sizeof packet);
  Namer namer;
  visit_contact(namer, packet, has_tangential);
  return static_cast<std::size_t>(std::count(namer.text.begin(), namer.text.end(), ','));
}

/* The packets of a row. */
struct RowPackets {
  std::optional<wire_packet> contact, raw; /* one of them at least */
};

/* From t_us on. */
inline std::string row_text(const wire_packet *contact, const wire_packet *raw,
                            std::uint8_t sensor_count, bool has_tangential = true) {
  const wire_packet &any = contact ? *contact : *raw;
  std::uint32_t frame = contact ? contact->body.contact.frame : raw->body.raw.frame;
  RowWriter writer;
  writer.text = std::to_string(any.t_us) + "," + std::to_string(frame);
  if (contact) {
    wire_packet copy = *contact;
    visit_contact(writer, copy, has_tangential);
  } else {
    writer.text += std::string(contact_columns(has_tangential), ',');
  }
  if (raw) {
    wire_packet copy = *raw;
    visit_raw(writer, copy, sensor_count);
  } else {
    writer.text += std::string(RAW_COLUMNS + 2u * sensor_count, ',');
  }
  return writer.text;
}

/* Back. Throws Damage. */
inline RowPackets parse_row(std::string_view text, std::uint8_t sensor_count, bool has_tangential) {
  auto cells = split(text, ',');
  std::size_t contact_count = contact_columns(has_tangential);
  std::size_t raw_count = RAW_COLUMNS + 2 * std::size_t{sensor_count};
  if (cells.size() != 2 + contact_count + raw_count) {
    throw Damage{std::to_string(cells.size()) + " columns where the header has " +
                 std::to_string(2 + contact_count + raw_count)};
  }
  auto is_empty = [&](std::size_t from, std::size_t count) {
    return std::all_of(cells.begin() + static_cast<std::ptrdiff_t>(from),
                       cells.begin() + static_cast<std::ptrdiff_t>(from + count),
                       [](std::string_view cell) { return cell.empty(); });
  };
  std::uint64_t t_us = 0;
  std::uint32_t frame = 0;
  parse_cell("t_us", cells[0], t_us);
  parse_cell("frame", cells[1], frame);
  RowPackets row;
  if (!is_empty(2, contact_count)) {
    wire_packet &packet = row.contact.emplace();
    packet.type = WIRE_CONTACT;
    packet.t_us = t_us;
    RowReader reader{cells, 2};
    visit_contact(reader, packet, has_tangential);
    packet.body.contact.frame = frame;
  }
  if (!is_empty(2 + contact_count, raw_count)) {
    if (sensor_count == 0) {
      throw Damage{"pressures in a recording without sensors"};
    }
    wire_packet &packet = row.raw.emplace();
    packet.type = WIRE_RAW;
    packet.t_us = t_us;
    RowReader reader{cells, 2 + contact_count};
    visit_raw(reader, packet, sensor_count);
    packet.body.raw.frame = frame;
    packet.body.raw.sensor_count = sensor_count;
  }
  if (!row.contact && !row.raw) {
    throw Damage{"a row without a packet"};
  }
  return row;
}

/* The columns of a header, from t_us on. */
struct Columns {
  std::uint8_t sensor_count;
  bool has_tangential;
};
inline std::optional<Columns> columns_of(const std::string &header) {
  auto columns = static_cast<std::size_t>(std::count(header.begin(), header.end(), ',')) + 1;
  bool has_tangential = header.find(",qx_N,") != std::string::npos;
  std::size_t fixed_columns = 2 + contact_columns(has_tangential) + RAW_COLUMNS;
  std::size_t sensors = columns > fixed_columns ? (columns - fixed_columns) / 2 : 0;
  if (sensors > FT_MAX_SENSORS ||
      header != header_text(static_cast<std::uint8_t>(sensors), has_tangential)) {
    return std::nullopt;
  }
  return Columns{static_cast<std::uint8_t>(sensors), has_tangential};
}

} // namespace fingertip::recording
