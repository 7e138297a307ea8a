#include "libfingertip/recording_reader.hpp"

#include "libfingertip/error.hpp"
#include "libfingertip/mcap_recording.hpp"
#include "libfingertip/recording_fields.hpp"
#include "libfingertip/text.hpp"

#include <algorithm>
#include <cstring>
#include <map>
#include <utility>

namespace fingertip {

using namespace recording;

namespace {

constexpr std::string_view OUR_FILES = "# fingertip-";
constexpr std::size_t DAMAGES_MOST = 20; /* that are reported one by one */

/* Makes of a line what it was before a spreadsheet saved it: between semicolons, tabs or commas, with quotes, blanks and decimal commas,
 * and filled up with empty cells. */
class Spreadsheet {
public:
  void restore(LineSource::Line &line) {
    std::string &text = line.text;
    text.erase(0, std::min(text.find_first_not_of(" \t"), text.size()));
    const bool is_quoted = text.rfind("\"#", 0) == 0;
    std::size_t end = is_quoted; /* of the quotes */
    std::string quoted;
    for (; is_quoted && end < text.size() && (text[end] != '"' || text.compare(++end, 1, "\"") == 0); end++) {
      quoted += text[end];
    }
    const std::size_t filled = std::max(end, text.find_last_not_of(is_quoted ? ",;\t\"" : ",;\t") + 1);
    fill_ = line.number == 1 ? text.substr(filled) : fill_;
    is_one_ = is_one_ || (is_quoted && commas_ < 0) || !fill_.empty();
    if (is_quoted || text.rfind('#', 0) == 0) {
      const bool has_end = is_quoted ? std::count(text.begin(), text.end(), '"') % 2 == 0 : !fill_.empty();
      line.torn = line.torn && !(has_end && text.substr(filled) == fill_);
      text = quoted + text.substr(end, (is_quoted || !fill_.empty() ? filled : text.size()) - end);
      if (separator_ != ',' && !is_quoted && text.find(separator_) != std::string::npos) { /* cells, as a grasp's */
        text = plain(text);
      }
    } else if (!trim(text).empty() && (commas_ < 0 || is_one_)) {
      const std::size_t separator = text.find(',') == std::string::npos ? text.find_first_of(";\t") : std::string::npos;
      separator_ = commas_ < 0 && separator != std::string::npos ? text[separator] : separator_;
      std::string row = plain(text);
      row.erase(std::remove_if(row.begin(), row.end(), [](char c) { return c == ' ' || c == '\t'; }), row.end());
      const auto commas = [&] { return std::count(row.begin(), row.end(), ','); };
      const std::size_t used = row.find_last_not_of(',') + 1,
                        more = static_cast<std::size_t>(std::max<std::ptrdiff_t>(commas() - commas_, 0));
      row.resize(used == 0 ? 0 : std::max(used, row.size() - more));
      is_one_ = is_one_ || row != text;
      commas_ = commas_ < 0 ? commas() : commas_;
      text = row;
    }
  }

private:
  /* Without quotes, between commas, with decimal points. Commas beside points part thousands, and stay: too many cells. */
  std::string plain(std::string_view text) const {
    const char comma = text.find('.') == std::string::npos ? '.' : ',';
    std::string found;
    bool is_within = false; /* quotes */
    for (const char c : text) {
      is_within = is_within != (c == '"');
      if (c != '"') {
        found += c == separator_ && !is_within ? ',' : c == ',' ? comma : c;
      }
    }
    return found;
  }

  std::string fill_;           /* what ends the first line */
  char separator_ = ',';       /* between the header's cells */
  std::ptrdiff_t commas_ = -1; /* of the header, once it was there */
  bool is_one_ = false;
};

/* A mark before the first line, and ends by CR LF or CR alone, which editors write, are no part of them. */
class TextLines : public LineSource {
public:
  explicit TextLines(std::unique_ptr<ByteSource> bytes) : bytes_(std::move(bytes)) {}

  bool next(Line &line) override {
    std::size_t end = block_.find(end_, at_);
    while (end == std::string::npos && (number_ > 0 || part_.empty())) {
      begin_ += at_;
      block_.erase(0, std::exchange(at_, 0));
      if (block_.size() > LINE_MOST_bytes) {
        begin_ += block_.size();
        part_ = part_.empty() ? std::exchange(block_, "") : part_;
        block_.clear();
      }
      char more[16384];
      const std::size_t length = block_.size(), count = bytes_->read(begin_ + length, more, sizeof more);
      if (count == 0) {
        break;
      }
      block_.append(more, count);
      if (begin_ + length == 0) {
        end_ = block_.find('\n') == std::string::npos && block_.find('\r') != std::string::npos ? '\r' : '\n';
      }
      end = block_.find(end_, length);
    }
    const bool is_ended = end != std::string::npos;
    line.text = part_.empty() ? block_.substr(at_, is_ended ? end - at_ : end) : std::exchange(part_, "");
    at_ = is_ended ? end + 1 : block_.size();
    const bool is_long = line.text.size() > LINE_MOST_bytes;
    line.torn = is_long || !is_ended;
    line.number = number_ + 1;
    const bool is_there = !line.torn || !line.text.empty();
    number_ += is_there;
    while (!line.text.empty() && line.text.back() == '\r') {
      line.text.pop_back();
    }
    if (number_ == 1 && line.text.rfind(BYTE_ORDER_MARK, 0) == 0) {
      line.text.erase(0, BYTE_ORDER_MARK.size());
    }
    if (!is_long) {
      spreadsheet_.restore(line);
    }
    return is_there;
  }
  Place place() override { return {static_cast<std::streamoff>(begin_ + at_), 0, number_}; }
  void go_to(const Place &place) override {
    begin_ = static_cast<std::uint64_t>(place.offset);
    block_.clear();
    part_.clear();
    at_ = 0;
    number_ = place.number;
  }

private:
  static constexpr std::string_view BYTE_ORDER_MARK = "\xef\xbb\xbf";

  std::unique_ptr<ByteSource> bytes_;
  std::string block_;       /* the part of them that begins at begin_; read until at_ */
  std::string part_;        /* before it, of a line that is too long, whose rest is read over */
  std::uint64_t begin_ = 0; /* where it does */
  std::size_t at_ = 0;
  std::uint64_t number_ = 0;
  char end_ = '\n';
  Spreadsheet spreadsheet_;
};

/* See within. */
class LinesWithin : public LineSource {
public:
  LinesWithin(std::unique_ptr<LineSource> lines, const TimeSpan &interval) : lines_(std::move(lines)), interval_(interval) {
    lines_->want(interval.from_s, interval.to_s);
  }

  bool next(Line &line) override {
    while (!state_.is_over && !state_.is_ended && lines_->next(line)) {
      state_.left_out += line.left_out;
      state_.number = line.number;
      if (is_wanted(line)) {
        line.left_out = std::exchange(state_.left_out, 0);
        return true;
      }
      state_.left_out++;
    }
    if (!std::exchange(state_.is_over, false)) {
      return false;
    }
    state_.is_ended = true;
    line = {state_.number + 1, "# end: reason=part", false, state_.left_out};
    return true;
  }
  Place place() override {
    Place inner = lines_->place();
    return {inner.offset, inner.message, inner.number, std::pair(inner, state_)};
  }
  void go_to(const Place &place) override {
    const auto &[inner, state] = std::any_cast<const std::pair<Place, State> &>(place.waiting);
    lines_->go_to(inner);
    state_ = state;
  }

private:
  static constexpr double LATE_s = 1; /* rows come behind later ones by less */
  struct State {
    LogClock clock;
    std::string started_utc, started_device_us;
    bool joint = false, has_header = false, is_inside = false, is_over = false, is_ended = false;
    std::uint64_t left_out = 0, number = 0;
  };

  bool is_wanted(Line &line) {
    const std::string &text = line.text;
    if (text.empty() || line.torn) {
      return true;
    }
    if (text[0] != '#') {
      return !std::exchange(state_.has_header, true) || is_row_wanted(line);
    }
    const std::size_t colon = text.find(": ");
    const std::string key(trim(std::string_view(text).substr(1, colon == std::string::npos ? colon : colon - 1)));
    const std::string value = colon == std::string::npos ? "" : text.substr(colon + 2);
    const std::string own = key.substr(key.find('/') + 1);
    state_.joint = state_.joint || text == std::string(FIRST_WORDS) + FORMAT_OF_SEVERAL;
    if (own == "event") {
      state_.clock.event(value);
    } else if (own == "end") { /* counts of all of it */
      state_.is_over = key == own;
      return false;
    } else if (!state_.has_header && (key == "started_utc" || key == "started_device_us")) {
      (key == "started_utc" ? state_.started_utc : state_.started_device_us) = value;
      state_.clock = LogClock(state_.started_utc, state_.started_device_us);
    }
    const bool has_time = own == "event" || own == "clock" || own == "grip" || own == "packet";
    return !state_.has_header || !has_time || state_.is_inside || value.rfind(PACKET_INFO, 0) == 0;
  }

  bool is_row_wanted(const Line &line) {
    const auto cells = split(std::string_view(line.text).substr(0, 80), ',');
    const auto time_us = state_.joint && cells.size() > 2 ? to_double(cells[1]) : std::nullopt;
    const auto t_us = state_.joint ? std::nullopt : to_u64(cells[0]);
    if (!time_us && !t_us) {
      return true; /* its reader reports what is wrong */
    }
    state_.clock.row(t_us.value_or(0), time_us);
    const double s = time_us ? *time_us / 1e6 : std::isnan(line.time_s) ? state_.clock.seconds() : line.time_s;
    state_.is_inside = s >= interval_.from_s && s <= interval_.to_s;
    state_.is_over = s > interval_.to_s + LATE_s;
    return state_.is_inside;
  }

  std::unique_ptr<LineSource> lines_;
  TimeSpan interval_;
  State state_;
};

/* The format in the first line, "1" or "2". Throws Error with what it is instead. */
std::string format_of(const std::string &path, const std::string &line) {
  std::string_view words = trim(line);
  std::string_view begin = FIRST_WORDS;
  if (words.substr(0, begin.size()) == begin) {
    std::string format(words.substr(begin.size(), 9));
    if (format != FORMAT_OF_ONE && format != FORMAT_OF_SEVERAL) {
      throw Error(ErrorCode::other_format, path + ":1: recording format \"" + format + "\" is unknown, " + FORMAT_OF_ONE + " and " +
                                               FORMAT_OF_SEVERAL + " are known");
    }
    return format;
  }
  std::string kind(words.substr(0, OUR_FILES.size()) == OUR_FILES ? words.substr(OUR_FILES.size()) : "");
  throw Error(ErrorCode::not_a_recording,
              path + (kind.empty() ? ":1: no recording; its first line is not \"" + std::string(begin) + FORMAT_OF_ONE + "\""
                                   : ": a " + kind.substr(0, kind.find(' ')) + ", not a recording"));
}

/* Throws Error for a file that may hold a recording, with what makes one of it that is read. */
void refuse_others(const std::string &path, std::string_view start) {
  constexpr const char *ARRAYS = "arrays of NumPy or MATLAB, no text; save them as CSV";
  constexpr const char *UTF_16 = "text in UTF-16, an editor's or a spreadsheet's; save it as UTF-8";
  constexpr std::pair<std::string_view, const char *> OTHERS[] = {
      {"\x28\xb5\x2f\xfd", "packed as a whole by zstd: unzstd FILE"},
      {"\x04\x22\x4d\x18", "packed as a whole by lz4: unlz4 FILE"},
      {"\x1f\x8b\x08", "packed as a whole by gzip: gunzip FILE"},
      {"BZh", "packed as a whole by bzip2: bunzip2 FILE"},
      {"\3757zXZ", "packed as a whole by xz: unxz FILE"},
      {"\x89MCAP0", "an MCAP file that was copied as text; copy it again, as bytes"},
      {"PK\3\4", "packed as a ZIP archive: unzip FILE; a spreadsheet is to be saved as CSV"},
      {"\xd0\xcf\x11\xe0", "a spreadsheet; save it as CSV"},
      {"\x93NUMPY", ARRAYS},
      {"MATLAB 5", ARRAYS},
      {"\x89HDF", ARRAYS},
      {"SQLite format 3", "a bag of ROS 2 in SQLite; ros2 bag convert makes one in MCAP, packed as it is now"},
      {"\xff\xfe", UTF_16},
      {"\xfe\xff", UTF_16},
      {std::string_view("#\0", 2), UTF_16},
      {std::string_view("\0#", 2), UTF_16},
  };
  for (const auto &[begin, what] : OTHERS) {
    if (start.substr(0, begin.size()) == begin) {
      throw Error(ErrorCode::unread_kind, path + ": " + what);
    }
  }
}

} // namespace

bool is_mcap(ByteSource &bytes) {
  char begin[sizeof mcap::MAGIC];
  return bytes.read(0, begin, sizeof begin) == sizeof begin && std::memcmp(begin, mcap::MAGIC, sizeof begin) == 0;
}

bool is_recording(const std::string &path, ByteSource &bytes) {
  std::string start(4096, ' '); /* several frames, each of which would end with 0x00 */
  start.resize(bytes.read(0, start.data(), start.size()));
  if (start.substr(0, 16).find(OUR_FILES) != std::string::npos || is_mcap(bytes)) {
    return true;
  }
  refuse_others(path, start);
  if (start.find('\0') == std::string::npos) {
    throw Error(ErrorCode::not_a_recording,
                path + (start.empty() ? ": is empty" : ": neither a recording nor bytes of a fingertip's line"));
  }
  return false;
}

std::unique_ptr<LineSource> lines_of(const std::string &path, std::unique_ptr<ByteSource> bytes) {
  if (is_mcap(*bytes)) {
    return std::make_unique<McapLineSource>(path, std::move(bytes));
  }
  char start[16];
  refuse_others(path, {start, bytes->read(0, start, sizeof start)});
  return std::make_unique<TextLines>(std::move(bytes));
}

std::unique_ptr<LineSource> within(std::unique_ptr<LineSource> lines, const TimeSpan &interval) {
  return interval.is_all() ? std::move(lines) : std::make_unique<LinesWithin>(std::move(lines), interval);
}

RecordingReader::RecordingReader(const std::string &path, bool salvage, const std::string &device, const TimeSpan &interval)
    : path_(path), salvage_(salvage), source_(within(open_lines(path), interval)), wanted_(device) {
  begin();
}

RecordingReader::RecordingReader(std::string path, bool salvage, std::unique_ptr<LineSource> lines)
    : path_(std::move(path)), salvage_(salvage), source_(std::move(lines)), all_(true) {}

/* Reads the first line. */
void RecordingReader::begin() {
  LineSource::Line first;
  try {
    if (!source_->next(first)) {
      first.text.clear();
    }
  } catch (const Error &error) {
    bool damaged = error.code() == ErrorCode::damaged_line;
    throw Error(damaged ? ErrorCode::damaged_head : error.code(), error.what());
  }
  state_.line_number = 1;
  joint_ = format_of(path_, first.text) == FORMAT_OF_SEVERAL;
  on_line_(first, true);
  begun_ = true;
}

RecordingReader::~RecordingReader() = default;
RecordingReader::RecordingReader(RecordingReader &&) noexcept = default;
RecordingReader &RecordingReader::operator=(RecordingReader &&) noexcept = default;

std::optional<RecordingReader::Item> RecordingReader::next() {
  if (!begun_) {
    begin();
  }
  while (state_.items.empty() && read_next()) {
  }
  if (state_.items.empty()) {
    if (!state_.header_seen) {
      throw Error(ErrorCode::damaged_head, path_ + ": no header line");
    }
    return std::nullopt;
  }
  Item item = state_.items.front();
  state_.items.pop_front();
  return item;
}

/* False at the end. */
bool RecordingReader::read_next() {
  LineSource::Line line;
  auto damaged = [&](const std::string &what, std::uint64_t lines, bool is_comment = false) {
    const bool can_be_skipped = state_.header_seen || is_comment;
    if (!salvage_ || !can_be_skipped) {
      throw Error(can_be_skipped ? ErrorCode::damaged_line : ErrorCode::damaged_head, what);
    }
    state_.skipped_lines += lines;
    if (state_.damages.size() < DAMAGES_MOST) {
      state_.damages.push_back(what);
    }
  };
  try {
    if (!source_->next(line)) {
      return false;
    }
  } catch (const Error &error) {
    if (error.code() != ErrorCode::damaged_line) {
      throw;
    }
    damaged(error.what(), 1); /* the next line's number may show that more are lost */
    state_.unplaced++;
    return true;
  }
  auto place = [&] { return path_ + ":" + std::to_string(line.number) + ": "; };
  if (line.number > state_.line_number + 1 + line.left_out) {
    std::uint64_t lost = line.number - state_.line_number - 1 - line.left_out;
    damaged(place() + std::to_string(lost) + " lines are missing before it", lost - std::min(lost, std::exchange(state_.unplaced, 0)));
  }
  state_.line_number = line.number;
  try {
    if (line.torn && !trim(line.text).empty()) {
      throw Damage{line.text.size() > LineSource::LINE_MOST_bytes ? "the line is longer than a megabyte" : "the last line is torn"};
    }
    while (!line.text.empty() && line.text.back() == '\r') {
      line.text.pop_back(); /* of an MCAP file that was made of an editor's */
    }
    read_line(line.text);
    on_line_(line, true);
  } catch (const Damage &damage) {
    damaged(place() + damage.text(), 1, line.text.rfind('#', 0) == 0);
    on_line_(line, false);
  }
  return true;
}

void RecordingReader::read_line(const std::string &text) {
  if (trim(text).empty()) {
    return;
  }
  if (text[0] == '#') {
    read_comment(std::string(trim(text)));
  } else if (state_.header_seen && joint_) {
    std::size_t time = text.find(',');
    std::size_t rest = time == std::string::npos ? time : text.find(',', time + 1);
    if (rest == std::string::npos) {
      throw Damage{"neither a comment nor a row"};
    }
    if (auto device = device_of(std::string_view(text).substr(0, time), true)) {
      auto time_us = to_double(std::string_view(text).substr(time + 1, rest - time - 1));
      if (!time_us) {
        throw Damage{"time_us is no number"};
      }
      read_row(std::string_view(text).substr(rest + 1), *device, time_us);
    }
  } else if (state_.header_seen) {
    read_row(text, 0);
  } else {
    const auto columns = columns_of(text, joint_);
    if (!columns || (joint_ && devices_.empty())) {
      throw Damage{"unknown header: columns moved, renamed, missing, or added?"};
    }
    if (const std::string serial = text_field(state_.infos[0].serial);
        !joint_ && !wanted_.empty() && !serial.empty() && !is_same_serial(serial, wanted_)) {
      throw Error(ErrorCode::no_such_in_file, path_ + ": no fingertip " + wanted_ + " in it, there are: " + serial);
    }
    sensor_count_ = columns->sensor_count;
    sets_ = columns->sets;
    state_.header_seen = true;
  }
}

/* Nothing for one that is not wanted, or for a person's comment. Throws Damage for a row of one that is not in the file. */
std::optional<std::uint32_t> RecordingReader::device_of(std::string_view number, bool is_row) const {
  auto device = to_u64(number);
  if (!device || *device >= devices_.size() || std::to_string(*device) != number) {
    if (is_row) {
      throw Damage{"there is no fingertip \"" + std::string(number) + "\""};
    }
    return std::nullopt;
  }
  const auto found = static_cast<std::uint32_t>(*device);
  return all_ || found == number_ ? std::optional(found) : std::nullopt;
}

void RecordingReader::read_comment(const std::string &text) {
  if (text.rfind(FIRST_WORDS, 0) == 0) {
    throw Damage{"another recording begins; give each by itself"};
  }
  std::size_t colon = text.find(": ");
  if (colon == std::string::npos) {
    constexpr const char *ERRORS[] = {"#N/A,", "#VALUE!,", "#REF!,", "#NAME?,", "#NUM!,", "#DIV/0!,"};
    if (find_in(ERRORS, [&](const char *error) { return text.rfind(error, 0) == 0; })) {
      throw Damage{"a spreadsheet's error in place of a number"};
    }
    return; /* a person's note */
  }
  std::string key(trim(std::string_view(text).substr(1, colon - 1)));
  std::uint32_t device = number_.value_or(0);
  bool is_of_one = !joint_;
  if (std::size_t slash = key.find('/'); joint_ && slash != std::string::npos) {
    auto mine = device_of(std::string_view(key).substr(0, slash));
    if (!mine) {
      return;
    }
    device = *mine;
    is_of_one = true;
    key = key.substr(slash + 1);
    if (key == "end") {
      read_end(std::string_view(text).substr(colon + 2));
      return;
    }
  } else if (joint_ && key == "devices") {
    choose_device(text.substr(colon + 2));
    return;
  }
  std::string value(text.substr(colon + 2));
  Item item{};
  item.device = device;
  wire_info &info = state_.infos[device];
  if (key == "packet") {
    if (!is_of_one) {
      throw Damage{"a packet without a fingertip's number"};
    }
    std::map<std::string, std::string, std::less<>> pairs;
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
    } else if (words[0] == PACKET_SYNC) {
      item.packet.type = WIRE_SYNC;
      visit_sync(reader, item.packet.body.sync);
    } else if (words[0] == PACKET_INFO) {
      if (info.sensor_count < 1 || info.sensor_count > FT_MAX_SENSORS) {
        throw Damage{"an info packet without \"# sensors:\" before it"};
      }
      put_info(device, item.packet, false);
      return;
    } else {
      throw Damage{"packet \"" + std::string(words[0]) + "\" is unknown"};
    }
    state_.items.push_back(item);
  } else if (key == "event") {
    item.kind = Item::Kind::event;
    item.event = value;
    state_.items.push_back(item);
  } else if (key == "end") {
    if (!joint_) {
      read_end(value);
    }
    state_.has_end = true;
  } else {
    wire_info changed = info;
    read_info_field(changed, key, value);
    info = changed; /* not where it is damaged */
  }
}

/* With what the comments until now have. Before the first row one is made, where a recorder has written none. */
void RecordingReader::put_info(std::uint32_t device, wire_packet packet, bool made) {
  const wire_info &info = state_.infos[device];
  state_.has_info[device] = true;
  if (info.sensor_count < 1 || info.sensor_count > FT_MAX_SENSORS) {
    return;
  }
  packet.type = WIRE_INFO;
  packet.body.info = info;
  if (!(info.stored & WIRE_STORED_CALIBRATION)) {
    packet.body.info.calibration = {};
  }
  if (!(info.stored & WIRE_STORED_PAD)) {
    packet.body.info.pad = {};
  }
  state_.items.push_back({Item::Kind::packet, packet, "", {}, device, made});
}

void RecordingReader::read_end(std::string_view text) {
  LineStatistics statistics;
  if (text == "reason=part") {
    return; /* of a part of a recording, whose counts are those of its packets */
  }
  for (std::string_view word : split(text, ' ')) {
    std::size_t equals = word.find('=');
    if (equals == std::string_view::npos) {
      throw Damage{"\"" + std::string(word) + "\" is not key=value"};
    }
    if (auto count = to_u64(word.substr(equals + 1))) {
      statistics.set(word.substr(0, equals), *count);
    }
  }
  end_statistics_ = statistics;
}

void RecordingReader::read_info_field(wire_info &info, const std::string &key, const std::string &value) {
  bool known = false;
  const auto is = [&](const std::string &name) {
    known = known || name == key;
    return name == key;
  };
  const auto read_list = [&](const std::string &name, std::size_t most, const auto &value_of) {
    if (!is(name)) {
      return;
    }
    auto numbers = split(value, ' ');
    if (numbers.size() > most) {
      throw Damage{key + " has too many values"};
    }
    for (std::size_t k = 0; k < most; k++) {
      value_of(k) = 0;
    }
    for (std::size_t k = 0; k < numbers.size() && !value.empty(); k++) {
      parse_cell(key, numbers[k], value_of(k));
    }
  };
  const std::pair<const char *, char *> texts[] = {
      {"serial", info.serial}, {"board", info.board}, {"scene", info.scene}, {"git", info.git_hash}};
  for (const auto &[name, field] : texts) {
    if (is(name)) {
      if (!std::all_of(value.begin(), value.end(), [](char c) { return c >= 0x20 && c <= 0x7E; })) {
        throw Damage{key + " is no printable ASCII"};
      }
      std::memset(field, 0, WIRE_TEXT_BYTES);
      std::memcpy(field, value.data(), std::min<std::size_t>(value.size(), WIRE_TEXT_BYTES));
    }
  }
  if (is("firmware")) {
    auto parts = split(value, '.');
    if (parts.size() != 3) {
      throw Damage{"firmware is \"" + value + "\""};
    }
    for (std::size_t i = 0; i < 3; i++) {
      parse_cell(key, parts[i], info.firmware_version[i]);
    }
  }
  read_list("x_mm", FT_MAX_SENSORS, [&](std::size_t k) -> float & { return info.x_mm[k]; });
  read_list("y_mm", FT_MAX_SENSORS, [&](std::size_t k) -> float & { return info.y_mm[k]; });
  const auto visit_list = [&](const char *name, auto member) {
    read_list(
        name, FT_MAX_SENSORS, [&](std::size_t k) -> auto & { return info.calibration.sensors[k].*member; });
  };
  visit_sensor_lists(visit_list);
  for (const PadList &each : pad_lists) {
    read_list(each.name, each.terms, [&](std::size_t j) -> float & { return each.value(info.pad, j); });
  }
  const auto visit = [&](const std::string &name, auto &field) {
    if (is(name)) {
      parse_cell(name, value, field);
    }
  };
  visit_info(visit, info);
  visit_calibration(visit, info.calibration);
  visit_pad(visit, info.pad);
  if (!known && !state_.header_seen) {
    recorder_metadata_.emplace_back(key, value);
  }
}

void RecordingReader::choose_device(const std::string &serials) {
  devices_ = serials_in(serials);
  state_.infos.assign(devices_.size(), wire_info{});
  state_.has_info.assign(devices_.size(), false);
  if (all_) {
    return;
  }
  for (std::size_t i = 0; i < devices_.size(); i++) {
    if (wanted_.empty() ? devices_.size() == 1 : is_same_serial(devices_[i], wanted_)) {
      number_ = static_cast<std::uint32_t>(i);
      return;
    }
  }
  std::string names(trim(serials));
  if (wanted_.empty()) {
    throw Error(ErrorCode::several_in_file, path_ + ": holds several fingertips: " + names);
  }
  throw Error(ErrorCode::no_such_in_file, path_ + ": no fingertip " + wanted_ + " in it, there are: " + names);
}

void RecordingReader::read_row(std::string_view text, std::uint32_t device, std::optional<double> time_us) {
  RowPackets row = parse_row(text, sensor_count_, sets_);
  if (!state_.has_info[device]) {
    put_info(device, wire_packet{}, true);
  }
  for (const auto &packet : {row.contact, row.raw}) {
    if (packet) {
      state_.items.push_back({Item::Kind::packet, *packet, "", time_us, device, false});
    }
  }
}

void RecordingReader::go_to(const Place &place) {
  source_->go_to(place.in_file);
  state_ = place.state;
}

std::vector<std::string> fingertips_in(const std::string &path) {
  try {
    RecordingReader reader(path, true, open_lines(path));
    reader.next();
    return reader.devices_;
  } catch (const Error &) {
    return {}; /* the reader will report it */
  }
}

} // namespace fingertip
