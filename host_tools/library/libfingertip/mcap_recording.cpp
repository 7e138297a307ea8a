#include "libfingertip/mcap_recording.hpp"

#include "libfingertip/error.hpp"
#include "libfingertip/names.hpp"
#include "libfingertip/recording_fields.hpp"
#include "libfingertip/text.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <ctime>

namespace fingertip {

using namespace recording;

constexpr const char *CONTACT = "fingertip_msgs/Contact";
constexpr const char *LINE = "fingertip_msgs/Line";
constexpr const char *PERIODIC_LINES = "/fingertip/lines/periodic"; /* those that each second has */
constexpr const char *PRESSURES = "sensor_msgs/PointCloud2";
constexpr std::uint64_t PERIOD_ns = 10'000'000;       /* each has the wrench, location and pressures of one row at most */
constexpr std::size_t WAITING_MOST = 1 << 16;         /* lines for one before them, before it counts as lost: 50 s, 50 MB */
constexpr std::size_t MESSAGE_MOST_bytes = 1 << 20;   /* packed by itself */
constexpr std::string_view ZSTD = "\x28\xb5\x2f\xfd"; /* begins what it packs */

/* Parses a time of a recording to ns since 1970. */
static std::optional<std::uint64_t> utc_ns(const std::string &text) {
  std::tm parts{};
  const char *rest = strptime(text.c_str(), "%Y-%m-%dT%H:%M:%S", &parts);
  if (!rest) {
    return std::nullopt;
  }
  std::string_view fraction = rest;
  std::uint64_t ms = 0;
  if (fraction.size() == 5 && fraction[0] == '.') {
    auto read = to_u64(fraction.substr(1, 3));
    if (!read) {
      return std::nullopt;
    }
    ms = *read;
    fraction.remove_prefix(4);
  }
  std::time_t seconds = timegm(&parts);
  if (fraction != "Z" || seconds < 0) {
    return std::nullopt;
  }
  return static_cast<std::uint64_t>(seconds) * 1'000'000'000 + ms * 1'000'000;
}

/* Later, or earlier, in the range of a message's time. */
static std::uint64_t shifted_ns(std::uint64_t ns, double by_us) {
  double by_ns = std::round(by_us * 1000);
  double most = static_cast<double>(ros::LATEST_ns);
  if (by_ns < 0) {
    auto less = static_cast<std::uint64_t>(std::min(-by_ns, most));
    return less > ns ? 0 : ns - less;
  }
  return std::min(ros::LATEST_ns, ns + static_cast<std::uint64_t>(std::min(by_ns, most)));
}

static bool begins_with(const std::string &text, const char *begin) { return text.rfind(begin, 0) == 0; }

/* "# key: value" taken apart; nothing of other lines. */
static std::optional<std::pair<std::string, std::string>> key_and_value(const std::string &text) {
  std::size_t colon = text.find(": ");
  if (text.empty() || text[0] != '#' || colon == std::string::npos) {
    return std::nullopt;
  }
  return std::pair(std::string(trim(std::string_view(text).substr(1, colon - 1))),
                   std::string(trim(std::string_view(text).substr(colon + 2))));
}

/* Of a line that each second or more has. */
static bool is_periodic(const std::string &text) {
  const auto pair = key_and_value(text);
  const std::string key = pair ? pair->first.substr(pair->first.find('/') + 1) : "";
  return key == "clock" || key == "grip" || (key == "packet" && begins_with(pair->second, PACKET_HEALTH));
}

/* UTF-8 without zeros; tabs and the end of a DOS line are none of the printable characters. */
static bool is_text(const std::string &text) {
  std::string plain = text;
  std::replace_if(
      plain.begin(), plain.end(), [](char c) { return c == '\t' || c == '\r'; }, ' ');
  return printable(plain) == plain;
}

/* In "/fingertip/SERIAL/contact". */
static std::string serial_in(const std::string &topic) {
  const auto words = split(topic, '/');
  std::string name(words[words.size() >= 2 ? words.size() - 2 : 0]);
  return name.substr(name.size() > 1 && name[0] == 's' && std::isdigit(static_cast<unsigned char>(name[1])) ? 1 : 0);
}

static mcap::Reader::Message line_message(const ros::Line &line) { return {"/fingertip/lines", LINE, ros::encode({0, ""}, line), 0}; }

LogClock::LogClock(const std::string &started_utc, const std::string &started_device_us)
    : begin_ns_(utc_ns(started_utc).value_or(0)), now_ns_(begin_ns_) {
  if (auto device_us = to_u64(started_device_us)) {
    anchor_ = {begin_ns_, *device_us};
  }
}

void LogClock::event(std::string_view text) {
  std::size_t blank = text.rfind(' ');
  event_ns_ = utc_ns(std::string(text.substr(blank == std::string_view::npos ? 0 : blank + 1))).value_or(event_ns_);
}

void LogClock::row(std::uint64_t t_us, std::optional<double> time_us) {
  if (time_us) {
    now_ns_ = shifted_ns(begin_ns_, *time_us);
    return;
  }
  if (!anchor_) {
    anchor_ = {begin_ns_, t_us};
  } else if (t_us < last_us_) { /* it restarted */
    anchor_ = {std::max(event_ns_, now_ns_), t_us};
  }
  last_us_ = t_us;
  now_ns_ = shifted_ns(anchor_->utc_ns, t_us >= anchor_->device_us ? static_cast<double>(t_us - anchor_->device_us)
                                                                   : -static_cast<double>(anchor_->device_us - t_us));
}

McapLineSink::McapLineSink(std::unique_ptr<ByteSink> file)
    : file_(std::move(file)),
      writer_([this](const std::string &bytes) { file_->append(bytes.data(), bytes.size()); }, "ros2", "fingertip") {}

void McapLineSink::line(const std::string &text) {
  in_head_ ? head_.push_back(text) : put(text);
  if (in_head_ && !text.empty() && text[0] != '#') {
    begin();
  }
}

void McapLineSink::finish() {
  if (in_head_) {
    begin();
  }
  writer_.finish();
  file_->finish();
}

McapLineSink::Device *McapLineSink::device_of(std::string &key) {
  if (!joint_) {
    return devices_.data();
  }
  std::size_t slash = key.find('/');
  auto number = to_u64(std::string_view(key).substr(0, slash));
  if (slash == std::string::npos || !number || *number >= devices_.size()) {
    return nullptr;
  }
  key = key.substr(slash + 1);
  return &devices_[*number];
}

void McapLineSink::device_key(Device &device, const std::string &key, const std::string &value) {
  if (key == "x_mm" || key == "y_mm") {
    std::vector<float> &places = key == "x_mm" ? device.x_mm : device.y_mm;
    places.clear();
    for (std::string_view word : split(value, ' ')) {
      places.push_back(to_float(word).value_or(NAN));
    }
  } else if (key == "sensors") {
    device.sensors = static_cast<unsigned>(std::min<std::uint64_t>(to_u64(value).value_or(0), FT_MAX_SENSORS));
  }
}

/* The head is complete. */
void McapLineSink::begin() {
  in_head_ = false;
  const auto head = std::exchange(head_, {});
  std::map<std::string, std::string> keys;
  for (const std::string &text : head) {
    if (auto pair = key_and_value(text)) {
      keys[pair->first] = pair->second;
    }
  }
  auto value = [&](const char *key) {
    const auto found = keys.find(key);
    return found == keys.end() ? std::string() : found->second;
  };
  joint_ = head[0] == std::string(FIRST_WORDS) + FORMAT_OF_SEVERAL;
  for (const std::string &serial : joint_ ? serials_in(value("devices")) : std::vector{value("serial")}) {
    Device &device = devices_.emplace_back();
    device.serial = serial;
    device.frame_id = "fingertip_" + ros::name_in_ros(device.serial);
  }
  for (const auto &[key, text] : keys) {
    std::string own = key;
    if (Device *device = device_of(own)) {
      device_key(*device, own, text);
    }
  }
  if (auto columns = columns_of(head.back(), joint_)) {
    sensor_count_ = columns->sensor_count;
    sets_ = columns->sets;
    has_rows_ = true;
  }
  clock_ = LogClock(value("started_utc"), value("started_device_us"));
  writer_.metadata("fingertip_recording", {keys.begin(), keys.end()});
  std::map<std::string, std::uint16_t> schemas;
  for (const char *name :
       {CONTACT, LINE, "geometry_msgs/WrenchStamped", "geometry_msgs/PointStamped", PRESSURES, "diagnostic_msgs/DiagnosticArray"}) {
    std::string full_name = name;
    full_name.insert(full_name.find('/'), "/msg");
    schemas[name] = writer_.schema(full_name, "ros2msg", ros::schema_of(name));
  }
  auto channel = [&](const std::string &topic, const char *name) {
    return writer_.channel(topic, schemas[name], "cdr", {{"offered_qos_profiles", ""}});
  };
  lines_ = channel("/fingertip/lines", LINE);
  periodic_lines_ = channel(PERIODIC_LINES, LINE);
  diagnostics_ = channel("/diagnostics", "diagnostic_msgs/DiagnosticArray");
  for (Device &device : devices_) {
    std::string root = "/fingertip/" + ros::name_in_ros(device.serial) + "/";
    device.contact = channel(root + "contact", CONTACT);
    device.wrench = channel(root + "wrench", "geometry_msgs/WrenchStamped");
    device.place = channel(root + "place", "geometry_msgs/PointStamped");
    device.pressures = channel(root + "pressures", PRESSURES);
  }
  for (const std::string &text : head) {
    put_line(text);
  }
  writer_.end_chunk();
}

void McapLineSink::put(const std::string &text) {
  if (text[0] == '#' || trim(text).empty() || !put_row(text)) {
    put_line(text);
    comment(text);
  }
}

void McapLineSink::put_line(const std::string &text) {
  number_++;
  if (!is_text(text)) {
    throw Error(path() + ": line " + std::to_string(number_) + " is no UTF-8 text, which an MCAP file cannot hold");
  }
  add(is_periodic(text) ? periodic_lines_ : lines_, ros::encode({clock_.now_ns(), ""}, ros::Line{number_, text}));
}

/* In order of time, so that no tool changes their order, although rows of several may step back in time. */
void McapLineSink::add(std::uint16_t channel, const std::string &message) {
  last_ns_ = std::max(last_ns_, clock_.now_ns());
  writer_.message(channel, last_ns_, message);
}

void McapLineSink::comment(const std::string &text) {
  auto pair = key_and_value(text);
  if (!pair) {
    return;
  }
  auto &[key, value] = *pair;
  Device *device = device_of(key);
  if (key == "event") {
    clock_.event(value);
  } else if (device && key == "packet") {
    auto words = split(value, ' ');
    Metadata fields;
    for (std::string_view word : words) {
      std::size_t equals = word.find('=');
      std::string name(word.substr(0, equals));
      if (equals != std::string_view::npos && name != "sequence" && name != "t_us") {
        fields.emplace_back(name, word.substr(equals + 1));
      }
    }
    if (words[0] == PACKET_HEALTH) {
      add(diagnostics_, ros::health({clock_.now_ns(), ""}, device->serial, device->sensors, fields));
    }
  } else if (device) {
    device_key(*device, key, value);
  }
}

/* False if it is none. */
bool McapLineSink::put_row(const std::string &text) {
  ros::Row row;
  std::string_view cells = text;
  try {
    if (!has_rows_) {
      throw Damage{"unknown header"};
    }
    if (joint_) {
      auto device = to_u64(cells.substr(0, cells.find(',')));
      cells.remove_prefix(std::min(cells.find(','), cells.size() - 1) + 1);
      row.time_us = to_double(cells.substr(0, cells.find(',')));
      cells.remove_prefix(std::min(cells.find(','), cells.size() - 1) + 1);
      if (!device || *device >= devices_.size() || !row.time_us) {
        throw Damage{"neither a comment nor a row"};
      }
      row.device = static_cast<std::uint32_t>(*device);
    }
    RowPackets packets = parse_row(cells, sensor_count_, sets_);
    row.contact = packets.contact;
    row.raw = packets.raw;
  } catch (const Damage &) {
    return false;
  }
  row.number = ++number_;
  clock_.row(row.contact ? row.contact->t_us : row.raw->t_us, row.time_us);
  Device &device = devices_[row.device];
  const ros::Header header = {clock_.now_ns(), device.frame_id};
  add(device.contact, ros::encode(header, row));
  const bool is_repeated = std::exchange(device.period, last_ns_ / PERIOD_ns) != last_ns_ / PERIOD_ns || repeats_every_row_;
  if (is_repeated && row.contact) {
    add(device.wrench, ros::wrench(header, row.contact->body.contact));
    add(device.place, ros::place(header, row.contact->body.contact));
  }
  if (is_repeated && row.raw && std::min(device.x_mm.size(), device.y_mm.size()) >= sensor_count_) {
    add(device.pressures, ros::pressures(header, row.raw->body.raw, device.x_mm, device.y_mm));
  }
  if (row.contact) {
    std::uint32_t warnings = row.contact->body.contact.flags & warning_flags();
    if (device.warnings != warnings) {
      device.warnings = warnings;
      add(diagnostics_, ros::warnings({header.time_ns, ""}, device.serial, warnings));
    }
  }
  return true;
}

McapLineSource::McapLineSource(std::string path, std::unique_ptr<ByteSource> bytes) : path_(std::move(path)), reader_(std::move(bytes)) {}

bool McapLineSource::next(Line &line) {
  try {
    for (;;) {
      const auto first = waiting_.begin();
      if (first != waiting_.end() &&
          (is_ended_ || first->first <= std::max(number_ + 1, left_out_until_) || waiting_.size() > WAITING_MOST)) {
        const auto next = waiting_.extract(first);
        if (number_ == 0 && next.key() > 1) {
          throw Error(ErrorCode::unread_kind, path_ + ": the recording's first lines are not in it. What the topics alone hold: " +
                                                  "mcap filter FILE -y '.*/(contact|pressures)' -o OUT");
        }
        const std::uint64_t gap = next.key() > number_ + 1 ? next.key() - number_ - 1 : 0;
        number_ = std::max(number_, next.key());
        line = line_of(next.key(), next.mapped());
        line.left_out = next.key() <= left_out_until_ ? gap : 0;
        line.time_s = (static_cast<double>(next.mapped().time_ns) - static_cast<double>(begin_ns_.value_or(0))) / 1e9;
        return true;
      }
      if (is_ended_) {
        break;
      }
      mcap::Reader::Message message;
      if (reader_.next(message)) {
        take(std::move(message));
        continue;
      }
      is_ended_ = true;
      if (!topic_.empty() && !reader_.is_torn()) {
        waiting_.emplace(number_ + 1, line_message({number_ + 1, "# end: reason=topics", false}));
      }
    }
  } catch (const mcap::Damage &damage) {
    throw Error(ErrorCode::damaged_line, path_ + ": " + damage.what());
  }
  if (!has_first_) {
    throw Error(ErrorCode::not_a_recording,
                path_ + (reader_.is_torn() ? ": breaks off before a recording begins" : ": an MCAP file, but no recording of a fingertip"));
  }
  if (reader_.is_torn() && !reported_torn_) {
    reported_torn_ = true;
    throw Error(ErrorCode::damaged_line, path_ + ": the last chunk is torn");
  }
  return false;
}

void McapLineSource::take(mcap::Reader::Message message) {
  const bool is_contact = message.type == CONTACT;
  if (!is_contact && message.type != LINE) {
    return;
  }
  if (message.data.compare(0, ZSTD.size(), ZSTD) == 0) { /* of a recorder that packs each message */
    unpacked_.resize(MESSAGE_MOST_bytes);
    const auto size = mcap::unpack(message.data, unpacked_);
    if (!size) {
      throw mcap::Damage("a message on " + printable(message.topic) + " cannot be unpacked");
    }
    message.data.assign(unpacked_, 0, *size);
  }
  if (is_contact && topic_.empty() && !reader_.knows(LINE)) {
    make_head(message);
  }
  if (!begin_ns_) {
    begin_ns_ = message.time_ns;
    for (const auto &each : reader_.together()) {
      begin_ns_ = each.type == message.type ? std::min(*begin_ns_, each.time_ns) : *begin_ns_;
    }
    if (!wanted_s_.is_all()) {
      const auto at = [&](double s) { return shifted_ns(*begin_ns_, s * 1e6); };
      reader_.want(at(wanted_s_.from_s), at(wanted_s_.to_s),
                   [](const std::string &topic, const std::string &type) { return type == LINE && topic != PERIODIC_LINES; });
    }
  }
  if (topic_.empty()) {
    const std::uint64_t number = ros::line_number(message.data);
    if (reader_.has_left_out()) {
      left_out_until_ = number;
      for (const auto &each : reader_.together()) {
        const bool is_ours = each.type == CONTACT || each.type == LINE;
        left_out_until_ = is_ours ? std::min(left_out_until_, ros::line_number(each.data)) : left_out_until_;
      }
    }
    waiting_.emplace(number, std::move(message));
  } else if (!is_contact) {
    throw Error(ErrorCode::unread_kind, path_ + ": chunks in another order than that of time, and no index: mcap recover FILE -o OUT");
  } else if (message.time_ns < latest_ns_) {
    throw Error(ErrorCode::unread_kind, path_ + ": messages in another order than that of time: mcap sort FILE -o OUT");
  } else if (message.topic == topic_) {
    latest_ns_ = message.time_ns;
    waiting_.emplace(number_ + waiting_.size() + 1, std::move(message));
  } else {
    throw Error(ErrorCode::unread_kind, path_ + ": topics of several fingertips, and no lines of a recording. Take one: " +
                                            "mcap filter FILE -y '" + printable(topic_.substr(0, topic_.rfind('/'))) + "/.*' -o OUT");
  }
}

/* Of a recording, by the first contact and what was read with it. */
void McapLineSource::make_head(const mcap::Reader::Message &contact) {
  topic_ = contact.topic;
  const auto row = ros::decode_row(contact.data);
  const std::uint8_t sensors = row && row->raw ? row->raw->body.raw.sensor_count : std::uint8_t{0};
  std::vector<std::string> lines = {std::string(FIRST_WORDS) + FORMAT_OF_ONE, "# serial: " + serial_in(topic_),
                                    "# sensors: " + std::to_string(sensors)};
  const std::string beside = topic_.substr(0, topic_.rfind('/')) + "/pressures"; /* others, of cameras, have this type too */
  const auto *cloud = find_in(reader_.together(), [&](const auto &each) { return each.type == PRESSURES && each.topic == beside; });
  for (std::size_t axis = 0; cloud && axis < 2; axis++) {
    lines.push_back(axis == 0 ? "# x_mm:" : "# y_mm:");
    for (double mm : ros::locations_mm(cloud->data, sensors, axis)) {
      lines.back() += " " + shortest(static_cast<float>(mm));
    }
  }
  lines.push_back(header_text(sensors));
  for (const std::string &text : lines) {
    const std::uint64_t number = waiting_.size() + 1;
    waiting_.emplace(number, line_message({number, text, false}));
  }
}

/* Throws mcap::Damage. */
LineSource::Line McapLineSource::line_of(std::uint64_t number, const mcap::Reader::Message &message) {
  if (message.type == CONTACT) {
    auto row = ros::decode_row(message.data);
    if (row && !topic_.empty()) {
      row->time_us.reset(); /* a recording of one */
    }
    if (!row || !has_header_ || row->time_us.has_value() != joint_ || (row->raw && row->raw->body.raw.sensor_count != sensor_count_)) {
      throw mcap::Damage("a message on " + printable(message.topic) +
                         " is damaged, or of another version of this tool, which can convert "
                         "it to CSV");
    }
    return {number, text_of(*row), false};
  }
  auto decoded = ros::decode_line(message.data);
  if (!decoded || decoded->text.find('\n') != std::string::npos) {
    throw mcap::Damage("a message on " + printable(message.topic) + " is damaged");
  }
  if (!has_first_) {
    has_first_ = true;
    joint_ = decoded->text == std::string(FIRST_WORDS) + FORMAT_OF_SEVERAL;
  }
  if (!has_header_ && !trim(decoded->text).empty() && decoded->text[0] != '#') {
    const auto columns = columns_of(decoded->text, joint_);
    sensor_count_ = columns ? columns->sensor_count : std::uint8_t{0};
    sets_ = columns ? columns->sets : LATER_SETS;
    has_header_ = true;
  }
  return {number, decoded->text, decoded->torn};
}

std::string McapLineSource::text_of(const ros::Row &row) const {
  return (joint_ ? std::to_string(row.device) + "," + fixed(*row.time_us, 1) + "," : "") +
         row_text(row.contact ? &*row.contact : nullptr, row.raw ? &*row.raw : nullptr, sensor_count_, sets_);
}

LineSource::Place McapLineSource::place() {
  auto place = reader_.place();
  return {place.offset, place.message, number_, waiting_};
}

void McapLineSource::go_to(const Place &place) {
  reader_.go_to({place.offset, place.message});
  number_ = place.number;
  waiting_ = std::any_cast<Waiting>(place.waiting);
  is_ended_ = reported_torn_ = false;
  latest_ns_ = 0;
}

} // namespace fingertip
