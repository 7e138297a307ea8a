#include "libfingertip/recording.hpp"

#include "libfingertip/discovery.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/names.hpp"
#include "libfingertip/text.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <type_traits>

namespace fingertip {

namespace {

constexpr const char *FIRST_LINE = "# fingertip-recording 1";
constexpr const char *FIRST_LINE_JOINT = "# fingertip-recording 2";
constexpr const char *JOINT_COLUMNS = "device,time_us,";
constexpr double Q10 = 1024.0;
constexpr std::size_t RAW_COLUMNS = 6; /* without those of the sensors */

/* A value of the packet that the file shows in another unit: shown = raw / scale. */
template <typename Integer> struct Scaled {
  Integer &raw;
  double scale;
  int digits;
};

/* One walk over the fields of each packet serves the header, the rows and the reader; the order
 * here is the order of the columns. */
template <typename Visitor> void visit_contact(Visitor &visit, wire_packet &packet) {
  wire_contact &contact = packet.body.contact;
  visit("sequence", packet.sequence);
  visit("flags", contact.flags);
  visit("sensors_used", contact.sensors_used);
  visit("x_mm", contact.x_mm);
  visit("y_mm", contact.y_mm);
  visit("p0_Pa", contact.p0_Pa);
  visit("sigma_mm", contact.sigma_mm);
  visit("force_N", contact.force_N);
  visit("slip_mm", contact.slip_mm);
  visit("residual_rms_Pa", contact.residual_rms_Pa);
  visit("location_sd_mm", contact.location_sd_mm);
  visit("force_sd_N", contact.force_sd_N);
  visit("sigma_x_mm", contact.sigma_x_mm);
  visit("sigma_y_mm", contact.sigma_y_mm);
  visit("width_correlation", contact.width_correlation);
  visit("convert_us", contact.stages.convert_us);
  visit("read_us", contact.stages.read_us);
  visit("queue_us", contact.stages.queue_us);
  visit("condition_us", contact.stages.condition_us);
  visit("fit_us", contact.stages.fit_us);
  visit("contact_us", contact.stages.contact_us);
  visit("total_us", contact.stages.total_us);
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
constexpr SensorList sensor_lists[] = {{"gains", &sensor_calibration::gain},
                                       {"gain_sds", &sensor_calibration::gain_sd}};

struct Namer {
  std::string text;
  template <typename Value> void operator()(const std::string &name, const Value &) {
    text += "," + name;
  }
};

template <typename Value> std::string cell_text(const Value &value) {
  if constexpr (std::is_same_v<Value, float>) {
    return shortest(value);
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
  if constexpr (std::is_same_v<Plain, float>) {
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

std::string header_text(std::uint8_t sensor_count) {
  wire_packet packet;
  std::memset(&packet, 0, sizeof packet);
  Namer namer;
  visit_contact(namer, packet);
  visit_raw(namer, packet, sensor_count);
  return "t_us,frame" + namer.text;
}

std::size_t contact_columns() {
  wire_packet packet;
  std::memset(&packet, 0, sizeof packet);
  Namer namer;
  visit_contact(namer, packet);
  return static_cast<std::size_t>(std::count(namer.text.begin(), namer.text.end(), ','));
}

std::string text_field(const char *field) {
  return std::string(field, strnlen(field, WIRE_TEXT_BYTES));
}

template <typename ValueOf> std::string list_text(ValueOf value_of, std::uint8_t count) {
  std::string text;
  for (int k = 0; k < count; k++) {
    text += (k ? " " : "") + shortest(value_of(k));
  }
  return text;
}

constexpr const char *PACKET_HEALTH = "health";
constexpr const char *PACKET_INFO = "info";
constexpr const char *PACKET_ACK = "ack";

} // namespace

Metadata info_metadata(const wire_info &info) {
  const std::uint8_t *version = info.firmware_version;
  Metadata pairs = {
      {"serial", text_field(info.serial)},
      {"board", text_field(info.board)},
      {"scene", text_field(info.scene)},
      {"firmware", std::to_string(version[0]) + "." + std::to_string(version[1]) + "." +
                       std::to_string(version[2])},
      {"git", text_field(info.git_hash)},
  };
  wire_info copy = info;
  PairWriter writer;
  visit_info(writer, copy);
  pairs.insert(pairs.end(), writer.pairs.begin(), writer.pairs.end());
  auto list = [&](const char *name, auto value_of) {
    pairs.emplace_back(name, list_text(value_of, info.sensor_count));
  };
  list("x_mm", [&](int k) { return info.x_mm[k]; });
  list("y_mm", [&](int k) { return info.y_mm[k]; });
  if (info.stored & WIRE_STORED_CALIBRATION) {
    PairWriter of_calibration;
    visit_calibration(of_calibration, copy.calibration);
    pairs.insert(pairs.end(), of_calibration.pairs.begin(), of_calibration.pairs.end());
    for (const SensorList &each : sensor_lists) {
      list(each.name, [&](int k) { return info.calibration.sensors[k].*each.value; });
    }
  }
  return pairs;
}

std::vector<std::pair<std::string, std::uint32_t>> health_fields(const wire_health &health) {
  std::vector<std::pair<std::string, std::uint32_t>> fields;
  auto visit = [&](const std::string &name, std::uint32_t value) {
    fields.emplace_back(name, value);
  };
  wire_health copy = health;
  visit_health(visit, copy);
  return fields;
}

PacketLines::PacketLines(std::string path, std::uint8_t sensor_count, bool raw_expected,
                         CommentHandler comment, RowHandler row)
    : path_(std::move(path)), sensor_count_(sensor_count), raw_expected_(raw_expected),
      comment_(std::move(comment)), row_(std::move(row)) {}

void PacketLines::info(const wire_info &info) {
  Metadata all = info_metadata(info);
  for (const auto &pair : all) {
    if (std::find(info_.begin(), info_.end(), pair) == info_.end()) {
      comment_(pair.first, pair.second);
    }
  }
  info_ = all;
}

double PacketLines::seconds() const {
  return static_cast<double>(before_restart_us_ + (first_us_ ? last_us_ - *first_us_ : 0)) / 1e6;
}

void PacketLines::row(const wire_packet *contact, const wire_packet *raw) {
  const wire_packet &any = contact ? *contact : *raw;
  std::uint32_t frame = contact ? contact->body.contact.frame : raw->body.raw.frame;
  RowWriter writer;
  writer.text = std::to_string(any.t_us) + "," + std::to_string(frame);
  if (contact) {
    wire_packet copy = *contact;
    visit_contact(writer, copy);
  } else {
    writer.text += std::string(contact_columns(), ',');
  }
  if (raw) {
    wire_packet copy = *raw;
    visit_raw(writer, copy, sensor_count_);
  } else {
    writer.text += std::string(RAW_COLUMNS + 2u * sensor_count_, ',');
  }
  row_(any.t_us, writer.text);
  frames_++;
  if (first_us_ && any.t_us < last_us_) {
    before_restart_us_ += last_us_ - *first_us_;
    first_us_.reset();
  }
  first_us_ = first_us_.value_or(any.t_us);
  last_us_ = any.t_us;
}

void PacketLines::write_pending() {
  if (pending_contact_) {
    wire_packet contact = *pending_contact_;
    pending_contact_.reset();
    row(&contact, nullptr);
  }
}

void PacketLines::packet(const wire_packet &packet) {
  wire_packet copy = packet;
  PairWriter writer;
  writer("sequence", packet.sequence);
  writer("t_us", packet.t_us);
  switch (packet.type) {
  case WIRE_CONTACT:
    write_pending();
    if (raw_expected_) {
      pending_contact_ = packet;
    } else {
      row(&packet, nullptr);
    }
    return;
  case WIRE_RAW:
    if (packet.body.raw.sensor_count != sensor_count_) {
      throw Error(path_ + ": the fingertip now has " +
                  std::to_string(packet.body.raw.sensor_count) + " sensors instead of " +
                  std::to_string(sensor_count_) + "; start a new recording");
    }
    if (pending_contact_ && pending_contact_->body.contact.frame == packet.body.raw.frame &&
        pending_contact_->t_us == packet.t_us) {
      wire_packet contact = *pending_contact_;
      pending_contact_.reset();
      row(&contact, &packet);
    } else {
      write_pending();
      row(nullptr, &packet);
    }
    return;
  case WIRE_HEALTH:
    write_pending();
    visit_health(writer, copy.body.health);
    comment_("packet", PACKET_HEALTH + writer.text());
    return;
  case WIRE_ACK:
    write_pending();
    visit_ack(writer, copy.body.ack);
    comment_("packet", PACKET_ACK + writer.text());
    return;
  case WIRE_INFO:
    write_pending();
    info(packet.body.info);
    comment_("packet", PACKET_INFO + writer.text());
    return;
  default:
    return;
  }
}

RecordingWriter::RecordingWriter(const std::string &path, bool replace, const wire_info *info,
                                 std::uint8_t sensor_count, const Metadata &extra,
                                 bool raw_expected, OutputFile::Appears appears)
    : file_(path, replace, appears),
      lines_(
          path, sensor_count, raw_expected,
          [this](const std::string &key, const std::string &value) {
            line("# " + key + ": " + value);
          },
          [this](std::uint64_t, const std::string &cells) { line(cells); }) {
  line(FIRST_LINE);
  for (const auto &[key, value] : extra) {
    line("# " + key + ": " + printable(value));
  }
  if (info) {
    lines_.info(*info);
  }
  line(header_text(sensor_count));
}

void RecordingWriter::line(const std::string &text) {
  std::string whole = text + "\n";
  file_.append(whole.data(), whole.size());
}

void RecordingWriter::packet(const wire_packet &packet) {
  lines_.packet(packet);
}

void RecordingWriter::event(const std::string &text) {
  lines_.write_pending();
  line("# event: " + text);
}

void RecordingWriter::finish(const LineStatistics &statistics, const std::string &reason) {
  lines_.write_pending();
  line("# end: reason=" + reason + " frames=" + std::to_string(lines_.frames()) +
       " seconds=" + fixed(lines_.seconds(), 6) + " " + statistics.text());
  file_.finish();
}

JointRecordingWriter::JointRecordingWriter(const std::string &path, bool replace,
                                           const std::vector<wire_info> &infos,
                                           const Metadata &extra, std::int64_t host_zero_us,
                                           bool raw_expected, OutputFile::Appears appears)
    : file_(path, replace, appears), host_zero_us_(host_zero_us) {
  std::string serials;
  for (std::size_t i = 0; i < infos.size(); i++) {
    if (infos[i].sensor_count != infos[0].sensor_count) {
      throw Error("fingertips with " + std::to_string(infos[0].sensor_count) + " and " +
                  std::to_string(infos[i].sensor_count) +
                  " sensors do not fit into one file; record them apart");
    }
    serials += " " + text_field(infos[i].serial);
    auto number = std::to_string(i);
    devices_.emplace_back(PacketLines(
        path, infos[i].sensor_count, raw_expected,
        [this, number](const std::string &key, const std::string &value) {
          line("# " + number + "/" + key + ": " + value);
        },
        [this, number, i](std::uint64_t t_us, const std::string &cells) {
          const Device &device = devices_[i];
          double host_us =
              device.packet_host_us +
              static_cast<double>(static_cast<std::int64_t>(t_us - device.packet_t_us));
          waiting_.emplace(host_us, number + "," + time_text(host_us) + "," + cells);
          last_us_ = std::max(last_us_, host_us);
        }));
  }
  line(FIRST_LINE_JOINT);
  line("# devices:" + serials);
  line("# host_zero_us: " + std::to_string(host_zero_us));
  for (const auto &[key, value] : extra) {
    line("# " + key + ": " + printable(value));
  }
  for (std::size_t i = 0; i < infos.size(); i++) {
    devices_[i].lines.info(infos[i]);
  }
  line(JOINT_COLUMNS + header_text(infos[0].sensor_count));
}

void JointRecordingWriter::line(const std::string &text) {
  std::string whole = text + "\n";
  file_.append(whole.data(), whole.size());
}

std::string JointRecordingWriter::time_text(double host_us) const {
  return fixed(host_us - static_cast<double>(host_zero_us_), 1);
}

void JointRecordingWriter::packet(std::size_t device, const wire_packet &packet, double host_us) {
  if (packet.type == WIRE_ACK) {
    return;
  }
  devices_[device].packet_t_us = packet.t_us;
  devices_[device].packet_host_us = host_us;
  devices_[device].lines.packet(packet);
}

void JointRecordingWriter::event(std::size_t device, const std::string &text) {
  devices_[device].lines.write_pending();
  settle(std::numeric_limits<double>::infinity());
  line("# " + std::to_string(device) + "/event: " + text);
}

void JointRecordingWriter::clock(std::size_t device, const ClockEstimate &estimate,
                                 unsigned jumps) {
  constexpr double interval_us = 1e6;
  Device &state = devices_[device];
  state.clock = estimate;
  state.jumps = jumps;
  std::vector<double> bounds;
  for (const Device &each : devices_) {
    bounds.push_back(each.clock ? each.clock->uncertainty_us : 0);
  }
  std::sort(bounds.rbegin(), bounds.rend());
  alignment_us_ = std::max(alignment_us_, bounds[0] + (bounds.size() > 1 ? bounds[1] : 0));
  if (estimate.host_us - state.clock_written_us >= interval_us) {
    state.clock_written_us = estimate.host_us;
    line("# " + std::to_string(device) + "/clock: t_us=" + std::to_string(estimate.device_us) +
         " time_us=" + time_text(estimate.host_us) + " drift_ppm=" + fixed(estimate.drift_ppm, 3) +
         " uncertainty_us=" + fixed(estimate.uncertainty_us, 1));
  }
}

void JointRecordingWriter::settle(double host_us) {
  while (!waiting_.empty() && waiting_.begin()->first <= host_us) {
    line(waiting_.begin()->second);
    waiting_.erase(waiting_.begin());
  }
}

std::uint64_t JointRecordingWriter::frames() const {
  std::uint64_t sum = 0;
  for (const Device &device : devices_) {
    sum += device.lines.frames();
  }
  return sum;
}

void JointRecordingWriter::finish(const std::vector<LineStatistics> &statistics,
                                  const std::string &reason) {
  for (Device &device : devices_) {
    device.lines.write_pending();
  }
  settle(std::numeric_limits<double>::infinity());
  LineStatistics sum;
  for (std::size_t i = 0; i < devices_.size(); i++) {
    const Device &device = devices_[i];
    std::string clock = device.clock
                            ? " drift_ppm=" + fixed(device.clock->drift_ppm, 3) +
                                  " uncertainty_us=" + fixed(device.clock->uncertainty_us, 1)
                            : "";
    line("# " + std::to_string(i) + "/end: frames=" + std::to_string(device.lines.frames()) +
         " jumps=" + std::to_string(device.jumps) + clock + " " + statistics[i].text());
    sum += statistics[i];
  }
  double seconds = frames() > 0 ? (last_us_ - static_cast<double>(host_zero_us_)) / 1e6 : 0;
  line("# end: reason=" + reason + " frames=" + std::to_string(frames()) + " seconds=" +
       fixed(seconds, 6) + " alignment_us=" + fixed(alignment_us_, 1) + " " + sum.text());
  file_.finish();
}

RecordingReader::RecordingReader(const std::string &path, bool salvage, const std::string &device)
    : path_(path), salvage_(salvage), file_(path, std::ios::binary), wanted_(device) {
  if (!file_) {
    throw Error(path + ": " + std::strerror(errno) + "; check the path");
  }
  std::memset(&info_, 0, sizeof info_);
  std::string first;
  std::getline(file_, first);
  line_number_ = 1;
  joint_ = trim(first) == FIRST_LINE_JOINT;
  if (!joint_ && trim(first) != FIRST_LINE) {
    throw Error(path + ":1: no recording of this version; its first line must be \"" + FIRST_LINE +
                "\", or 2 for several fingertips");
  }
}

void RecordingReader::damaged(const std::string &what) const {
  throw Error(path_ + ":" + std::to_string(line_number_) + ": " + what +
              "; use --salvage to skip damaged lines");
}

std::optional<RecordingReader::Item> RecordingReader::next() {
  std::string text;
  while (items_.empty() && std::getline(file_, text)) {
    line_number_++;
    try {
      if (file_.eof() && !text.empty()) {
        throw Damage{"the last line is torn"};
      }
      read_line(text);
    } catch (const Damage &damage) {
      if (!salvage_ || !header_seen_) {
        damaged(damage.what);
      }
      skipped_lines_++;
    }
  }
  if (items_.empty()) {
    if (!header_seen_) {
      throw Error(path_ + ": no header line; record anew");
    }
    return std::nullopt;
  }
  Item item = items_.front();
  items_.pop_front();
  return item;
}

void RecordingReader::read_line(const std::string &text) {
  if (trim(text).empty()) {
    return;
  }
  if (text[0] == '#') {
    read_comment(text);
  } else if (header_seen_ && joint_) {
    auto mine = number_ + ",";
    std::size_t time = text.find(',');
    std::size_t rest = time == std::string::npos ? time : text.find(',', time + 1);
    if (rest == std::string::npos) {
      throw Damage{"neither a comment nor a row"};
    }
    if (text.compare(0, mine.size(), mine) == 0) {
      read_row(std::string_view(text).substr(rest + 1));
    }
  } else if (header_seen_) {
    read_row(text);
  } else {
    std::string text_of_one = text;
    if (joint_) {
      if (text.rfind(JOINT_COLUMNS, 0) != 0 || number_.empty()) {
        throw Damage{"unknown header"};
      }
      text_of_one = text.substr(std::string(JOINT_COLUMNS).size());
    }
    auto columns =
        static_cast<std::size_t>(std::count(text_of_one.begin(), text_of_one.end(), ',')) + 1;
    std::size_t fixed_columns = 2 + contact_columns() + RAW_COLUMNS;
    std::size_t sensors = columns > fixed_columns ? (columns - fixed_columns) / 2 : 0;
    if (sensors > FT_MAX_SENSORS ||
        text_of_one != header_text(static_cast<std::uint8_t>(sensors))) {
      throw Damage{"unknown header"};
    }
    sensor_count_ = static_cast<std::uint8_t>(sensors);
    header_seen_ = true;
  }
}

void RecordingReader::read_comment(const std::string &text) {
  std::size_t colon = text.find(": ");
  if (colon == std::string::npos) {
    throw Damage{"neither a comment \"# key: value\" nor a row"};
  }
  std::string key(trim(std::string_view(text).substr(1, colon - 1)));
  if (std::size_t slash = key.find('/'); joint_ && slash != std::string::npos) {
    if (key.compare(0, slash, number_) != 0 || key.compare(slash + 1, key.npos, "end") == 0) {
      return;
    }
    key = key.substr(slash + 1);
  } else if (joint_ && key == "devices") {
    choose_device(text.substr(colon + 2));
    return;
  }
  std::string value(text.substr(colon + 2));
  Item item{};
  std::map<std::string, std::string, std::less<>> pairs;
  auto copy_text = [&](char *field) {
    if (!std::all_of(value.begin(), value.end(), [](char c) { return c >= 0x20 && c <= 0x7E; })) {
      throw Damage{key + " is no printable ASCII"};
    }
    std::memset(field, 0, WIRE_TEXT_BYTES);
    std::memcpy(field, value.data(), std::min<std::size_t>(value.size(), WIRE_TEXT_BYTES));
  };
  auto read_list = [&](auto value_of) {
    auto numbers = split(value, ' ');
    if (numbers.size() > FT_MAX_SENSORS) {
      throw Damage{key + " has too many values"};
    }
    for (std::size_t k = 0; k < numbers.size() && !value.empty(); k++) {
      parse_cell(key, numbers[k], value_of(k));
    }
  };
  if (key == "packet") {
    auto words = split(value, ' ');
    for (std::size_t i = 1; i < words.size(); i++) {
      std::size_t equals = words[i].find('=');
      if (equals == std::string_view::npos) {
        throw Damage{"\"" + std::string(words[i]) + "\" is not key=value"};
      }
      pairs.emplace(words[i].substr(0, equals), words[i].substr(equals + 1));
    }
    PairReader reader{pairs};
    item.kind = Item::Kind::packet;
    reader("sequence", item.packet.sequence);
    reader("t_us", item.packet.t_us);
    if (words[0] == PACKET_HEALTH) {
      item.packet.type = WIRE_HEALTH;
      visit_health(reader, item.packet.body.health);
    } else if (words[0] == PACKET_ACK) {
      item.packet.type = WIRE_ACK;
      visit_ack(reader, item.packet.body.ack);
    } else if (words[0] == PACKET_INFO) {
      if (info_.sensor_count < 1 || info_.sensor_count > FT_MAX_SENSORS) {
        throw Damage{"an info packet without \"# sensors:\" before it"};
      }
      item.packet.type = WIRE_INFO;
      item.packet.body.info = info_;
      if (!(info_.stored & WIRE_STORED_CALIBRATION)) {
        item.packet.body.info.calibration = {};
      }
    } else {
      throw Damage{"packet \"" + std::string(words[0]) + "\" is unknown"};
    }
    items_.push_back(item);
  } else if (key == "event") {
    item.kind = Item::Kind::event;
    item.event = value;
    items_.push_back(item);
  } else if (key == "end") {
    has_end_ = true;
  } else if (key == "serial") {
    copy_text(info_.serial);
  } else if (key == "board") {
    copy_text(info_.board);
  } else if (key == "scene") {
    copy_text(info_.scene);
  } else if (key == "git") {
    copy_text(info_.git_hash);
  } else if (key == "firmware") {
    auto parts = split(value, '.');
    if (parts.size() != 3) {
      throw Damage{"firmware is \"" + value + "\""};
    }
    for (std::size_t i = 0; i < 3; i++) {
      parse_cell(key, parts[i], info_.firmware_version[i]);
    }
  } else if (key == "x_mm") {
    read_list([&](std::size_t k) -> float & { return info_.x_mm[k]; });
  } else if (key == "y_mm") {
    read_list([&](std::size_t k) -> float & { return info_.y_mm[k]; });
  } else {
    for (const SensorList &each : sensor_lists) {
      if (key == each.name) {
        read_list(
            [&](std::size_t k) -> float & { return info_.calibration.sensors[k].*each.value; });
      }
    }
    auto visit = [&](const std::string &name, auto &field) {
      if (name == key) {
        parse_cell(name, value, field);
      }
    };
    visit_info(visit, info_);
    visit_calibration(visit, info_.calibration);
  }
}

void RecordingReader::choose_device(const std::string &serials) {
  auto all = split(serials, ' ');
  for (std::size_t i = 0; i < all.size(); i++) {
    std::string serial(trim(all[i]));
    if (wanted_.empty() ? all.size() == 1 : is_same_serial(serial, wanted_)) {
      number_ = std::to_string(i);
      return;
    }
  }
  throw Error(
      path_ +
      (wanted_.empty() ? ": holds several fingertips" : ": no fingertip " + wanted_ + " in it") +
      "; choose one with --device: " + std::string(trim(serials)));
}

void RecordingReader::read_row(std::string_view text) {
  auto cells = split(text, ',');
  std::size_t contact_count = contact_columns();
  std::size_t raw_count = RAW_COLUMNS + 2 * std::size_t{sensor_count_};
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
  std::vector<Item> items;
  if (!is_empty(2, contact_count)) {
    Item item{};
    item.kind = Item::Kind::packet;
    item.packet.type = WIRE_CONTACT;
    item.packet.t_us = t_us;
    RowReader reader{cells, 2};
    visit_contact(reader, item.packet);
    item.packet.body.contact.frame = frame;
    items.push_back(item);
  }
  if (!is_empty(2 + contact_count, raw_count)) {
    Item item{};
    item.kind = Item::Kind::packet;
    item.packet.type = WIRE_RAW;
    item.packet.t_us = t_us;
    RowReader reader{cells, 2 + contact_count};
    visit_raw(reader, item.packet, sensor_count_);
    item.packet.body.raw.frame = frame;
    item.packet.body.raw.sensor_count = sensor_count_;
    items.push_back(item);
  }
  if (items.empty()) {
    throw Damage{"a row without a packet"};
  }
  items_.insert(items_.end(), items.begin(), items.end());
}

} // namespace fingertip
