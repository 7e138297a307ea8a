#include "libfingertip/ros_messages.hpp"

#include "libfingertip/little_endian.hpp"
#include "libfingertip/names.hpp"
#include "libfingertip/recording_fields.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>

namespace fingertip::ros {

using namespace recording;

namespace {

/* CDR as ROS 2 serializes its messages: little-endian, every number aligned to its own size,
 * counted from behind the four bytes of the encapsulation header. */
constexpr std::size_t CDR_HEAD_BYTES = 4;

class CdrWriter {
public:
  template <typename Number, typename = std::enable_if_t<std::is_arithmetic_v<Number>>> void put(Number value) {
    align(sizeof value);
    put_number(bytes_, value);
  }
  void put(bool value) { put(static_cast<std::uint8_t>(value)); }
  void put(std::string_view text) {
    put(static_cast<std::uint32_t>(text.size() + 1));
    bytes_ += text;
    bytes_ += '\0';
  }
  void put(const char *text) { put(std::string_view(text)); }
  template <typename... Values> std::enable_if_t<(sizeof...(Values) > 1)> put(const Values &...values) { (put(values), ...); }
  void count(std::size_t elements) { put(static_cast<std::uint32_t>(elements)); }

  const std::string &bytes() const { return bytes_; }

private:
  void align(std::size_t size) {
    std::size_t over = (bytes_.size() - CDR_HEAD_BYTES) % size;
    bytes_.append(over ? size - over : 0, '\0');
  }

  std::string bytes_{"\0\1\0\0", CDR_HEAD_BYTES};
};

/* What is read beyond the end is zero, and is_good false. */
class CdrReader {
public:
  explicit CdrReader(std::string_view bytes) : bytes_(bytes) {
    good_ = bytes.substr(0, CDR_HEAD_BYTES) == std::string_view("\0\1\0\0", CDR_HEAD_BYTES);
  }

  template <typename Number> void get(Number &value) {
    std::size_t over = (at_ - CDR_HEAD_BYTES) % sizeof value;
    at_ += over ? sizeof value - over : 0;
    good_ = good_ && at_ <= bytes_.size() && bytes_.size() - at_ >= sizeof value;
    value = good_ ? number_at<Number>(bytes_, at_) : Number{};
    at_ += sizeof value;
  }
  void get(bool &value) {
    std::uint8_t byte;
    get(byte);
    value = byte != 0;
  }
  void get(std::string &text) {
    std::uint32_t length;
    get(length);
    good_ = good_ && length >= 1 && length <= bytes_.size() - at_;
    text = good_ ? bytes_.substr(at_, length - 1) : std::string_view();
    at_ += good_ ? length : 0;
  }

  template <typename... Values> std::enable_if_t<(sizeof...(Values) > 1)> get(Values &...values) { (get(values), ...); }

  bool is_good() const { return good_; }
  bool has(std::size_t bytes) const { return bytes_.size() - std::min(at_, bytes_.size()) >= bytes; }

private:
  std::string_view bytes_;
  std::size_t at_ = CDR_HEAD_BYTES;
  bool good_;
};

constexpr double NOT_A_NUMBER = std::numeric_limits<double>::quiet_NaN();

double metres(float mm) { return double{mm} / 1000; }

CdrWriter begun(const Header &header) {
  constexpr std::uint64_t NS_IN_A_S = 1'000'000'000;
  CdrWriter writer;
  writer.put(static_cast<std::int32_t>(header.time_ns / NS_IN_A_S), static_cast<std::uint32_t>(header.time_ns % NS_IN_A_S),
             header.frame_id);
  return writer;
}

void skip_header(CdrReader &reader) {
  std::int32_t s;
  std::uint32_t ns;
  std::string frame_id;
  reader.get(s, ns, frame_id);
}

bool is_trusted(std::uint32_t flags) { return (flags & (CONTACT_FLAG_FIT_VALID | warning_flags())) == CONTACT_FLAG_FIT_VALID; }

/* Tared, and without a warning nothing presses. */
bool is_untouched(std::uint32_t flags) {
  return (flags & (CONTACT_FLAG_CONTACT | CONTACT_FLAG_TARED | warning_flags())) == CONTACT_FLAG_TARED;
}

struct Vector {
  double x, y, z;
};

void put(CdrWriter &writer, const Vector &vector) { writer.put(vector.x, vector.y, vector.z); }

std::string status(const Header &header, const std::string &name, const std::string &trouble, const std::string &otherwise,
                   const std::string &serial, const Metadata &values) {
  enum : std::uint8_t { OK, WARN };
  CdrWriter writer = begun(header);
  writer.count(1);
  writer.put(static_cast<std::uint8_t>(trouble.empty() ? OK : WARN), name, trouble.empty() ? otherwise : trouble, serial);
  writer.count(values.size());
  for (const auto &[key, value] : values) {
    writer.put(key, value);
  }
  return writer.bytes();
}

/* The fields of a packet in their order, for visit_contact and visit_raw. */
struct CdrPut {
  CdrWriter &writer;
  bool is_there;                      /* the packet */
  std::vector<std::uint32_t> &beyond; /* of its maps, the bits beyond a word */
  template <typename Value> void operator()(const std::string &, const Value &value) {
    using Plain = std::decay_t<Value>;
    if constexpr (std::is_same_v<Plain, sensor_map>) {
      writer.put(static_cast<std::uint32_t>(value));
      beyond.push_back(static_cast<std::uint32_t>(value >> WIRE_SENSORS_OF_WORD));
    } else if constexpr (std::is_same_v<Plain, Quantity>) {
      writer.put(cell_text(value).empty() ? std::numeric_limits<float>::quiet_NaN() : value.value);
    } else if constexpr (std::is_integral_v<Plain>) {
      writer.put(value);
    } else {
      writer.put(is_there ? value.raw / value.scale : NOT_A_NUMBER);
    }
  }
};

/* What another program made of a message. */
struct NoPacket {};

template <typename Integer> Integer scaled(double value, double scale) {
  double raw = std::round(value * scale);
  if (!(raw >= static_cast<double>(std::numeric_limits<Integer>::min()) &&
        raw <= static_cast<double>(std::numeric_limits<Integer>::max()))) {
    throw NoPacket();
  }
  return static_cast<Integer>(raw);
}

struct CdrGet {
  CdrReader &reader;
  bool is_there; /* the packet */
  std::vector<sensor_map *> &maps;
  template <typename Value> void operator()(const std::string &, Value &&value) {
    using Plain = std::decay_t<Value>;
    if constexpr (std::is_same_v<Plain, sensor_map>) {
      std::uint32_t word;
      reader.get(word);
      value = word;
      maps.push_back(&value);
    } else if constexpr (std::is_same_v<Plain, Quantity>) {
      reader.get(value.value);
      if (std::isnan(value.value)) {
        if (value.valid && is_there) {
          throw NoPacket();
        }
        value.value = 0;
      }
    } else if constexpr (std::is_integral_v<Plain>) {
      reader.get(value);
    } else {
      double number;
      reader.get(number);
      value.raw = is_there ? scaled<std::decay_t<decltype(value.raw)>>(number, value.scale) : 0;
    }
  }
};

constexpr std::uint8_t WITHOUT_SENSORS = 0;

std::uint32_t frame_of(const Row &row) { return row.contact ? row.contact->body.contact.frame : row.raw->body.raw.frame; }

} // namespace

std::string schema_of(const std::string &name) {
  std::vector<std::string> needed = {name};
  std::string text;
  for (std::size_t i = 0; i < needed.size(); i++) { /* grows */
    const std::string each = needed[i];
    const std::string &definition = definitions().at(each);
    text += (i > 0 ? std::string(80, '=') + "\nMSG: " + each + "\n" : "") + definition;
    for (std::string_view line : split(definition, '\n')) {
      std::string type(line.substr(0, line.find_first_of(" [")));
      if (definitions().count(type) && std::find(needed.begin(), needed.end(), type) == needed.end()) {
        needed.push_back(type);
      }
    }
  }
  return text;
}

std::string name_in_ros(const std::string &serial) {
  std::string name = serial.empty() ? "unknown" : serial;
  for (char &c : name) {
    c = std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  }
  return (std::isdigit(static_cast<unsigned char>(name[0])) ? "s" : "") + name;
}

std::string wrench(const Header &header, const wire_contact &contact) {
  Vector force = {0, 0, 0}, torque = {0, 0, 0};
  if (!is_untouched(contact.flags)) {
    constexpr std::uint32_t tangential = CONTACT_FLAG_TANGENTIAL_VALID | CONTACT_FLAG_TANGENTIAL_FROM_TOUCH;
    bool trusted = is_trusted(contact.flags);
    bool sure = trusted && (contact.flags & tangential) == CONTACT_FLAG_TANGENTIAL_VALID;
    double x_m = metres(contact.x_mm), y_m = metres(contact.y_mm);
    force = {sure ? double{contact.qx_N} : NOT_A_NUMBER, sure ? double{contact.qy_N} : NOT_A_NUMBER,
             trusted ? -double{contact.force_N} : NOT_A_NUMBER};
    torque = {trusted ? y_m * force.z : NOT_A_NUMBER, trusted ? -x_m * force.z : NOT_A_NUMBER,
              sure ? x_m * force.y - y_m * force.x : NOT_A_NUMBER};
  }
  CdrWriter writer = begun(header);
  put(writer, force);
  put(writer, torque);
  return writer.bytes();
}

std::string place(const Header &header, const wire_contact &contact) {
  CdrWriter writer = begun(header);
  put(writer,
      is_trusted(contact.flags) ? Vector{metres(contact.x_mm), metres(contact.y_mm), 0} : Vector{NOT_A_NUMBER, NOT_A_NUMBER, NOT_A_NUMBER});
  return writer.bytes();
}

std::string pressures(const Header &header, const wire_raw &raw, const std::vector<float> &x_mm, const std::vector<float> &y_mm) {
  constexpr std::uint8_t FLOAT32 = 7;
  constexpr std::uint32_t SIZE = sizeof(float);
  const char *const names[] = {"x", "y", "z", "pressure_pa"};
  const std::uint32_t step = SIZE * static_cast<std::uint32_t>(std::size(names));
  const std::uint32_t width = raw.sensor_count;
  CdrWriter writer = begun(header);
  writer.put(std::uint32_t{1}, width, static_cast<std::uint32_t>(std::size(names)));
  for (std::uint32_t i = 0; i < std::size(names); i++) {
    writer.put(names[i], i * SIZE, FLOAT32, std::uint32_t{1});
  }
  writer.put(false /* is_bigendian */, step, step * width, step * width);
  for (std::uint32_t k = 0; k < width; k++) {
    bool valid = raw.valid >> k & 1;
    double pressure_Pa = raw.pressure_Pa_q10[k] / Q10 - raw.baseline_Pa_q10[k] / Q10;
    for (double value : {metres(x_mm[k]), metres(y_mm[k]), 0.0, valid ? pressure_Pa : NOT_A_NUMBER}) {
      writer.put(static_cast<float>(value)); /* aligned: the bytes begin at a multiple of four */
    }
  }
  writer.put(false); /* is_dense */
  return writer.bytes();
}

std::string health(const Header &header, const std::string &serial, unsigned sensors, const Metadata &fields) {
  std::uint64_t present = 0, bad = 0;
  for (const auto &[key, value] : fields) {
    if (key == "sensors_present" || key == "sensors_prom_bad") {
      (key == "sensors_present" ? present : bad) = to_u64(value).value_or(0);
    }
  }
  std::string missing, damaged;
  for (unsigned k = 0; k < sensors; k++) {
    missing += present >> k & 1 ? "" : " " + std::to_string(k);
    damaged += bad >> k & 1 ? " " + std::to_string(k) : "";
  }
  missing = missing.empty() ? "" : "sensors missing:" + missing;
  damaged = damaged.empty() ? "" : "damaged PROM of sensors:" + damaged;
  const std::string trouble = joined(std::vector{missing, damaged}, "; ");
  return status(header, "fingertip " + serial, trouble, "all sensors are there", serial, fields);
}

std::string warnings(const Header &header, const std::string &serial, std::uint32_t flags) {
  std::uint32_t warned = flags & warning_flags();
  return status(header, "fingertip " + serial + " contact", warned ? flags_text(warned) : "", "no warning", serial, {});
}

std::string encode(const Header &header, const Line &line) {
  CdrWriter writer = begun(header);
  writer.put(line.number, line.text, line.torn);
  return writer.bytes();
}

std::optional<Line> decode_line(std::string_view bytes) {
  CdrReader reader(bytes);
  Line line;
  skip_header(reader);
  reader.get(line.number, line.text, line.torn);
  return reader.is_good() ? std::optional(line) : std::nullopt;
}

std::uint64_t line_number(std::string_view bytes) {
  CdrReader reader(bytes);
  std::uint64_t number = 0;
  skip_header(reader);
  reader.get(number);
  return number;
}

std::vector<double> locations_mm(std::string_view bytes, std::size_t sensors, std::size_t axis) {
  constexpr std::size_t POINT_bytes = 16, LENGTH_bytes = 4, END_bytes = 1;
  const std::size_t data = POINT_bytes * sensors;
  std::vector<double> all;
  if (bytes.size() < LENGTH_bytes + data + END_bytes ||
      number_at<std::uint32_t>(bytes, bytes.size() - END_bytes - data - LENGTH_bytes) != data) {
    return all;
  }
  for (std::size_t at = bytes.size() - END_bytes - data + 4 * axis; all.size() < sensors; at += POINT_bytes) {
    all.push_back(std::round(double{number_at<float>(bytes, at)} * 1e6) / 1e3); /* to a micrometre */
  }
  return all;
}

std::string encode(const Header &header, const Row &row) {
  CdrWriter writer = begun(header);
  writer.put(row.number, row.device, row.time_us.value_or(NOT_A_NUMBER), row.contact ? row.contact->t_us : row.raw->t_us, frame_of(row));
  wire_packet contact = row.contact.value_or(wire_packet{}), raw = row.raw.value_or(wire_packet{});
  std::vector<std::uint32_t> beyond;
  CdrPut put_contact{writer, row.contact.has_value(), beyond}, put_raw{writer, row.raw.has_value(), beyond};
  writer.put(put_contact.is_there);
  visit_contact(put_contact, contact);
  writer.put(put_raw.is_there);
  visit_raw(put_raw, raw, WITHOUT_SENSORS);
  for (const std::int32_t *readings : {raw.body.raw.pressure_Pa_q10, raw.body.raw.baseline_Pa_q10}) {
    writer.count(raw.body.raw.sensor_count);
    for (unsigned k = 0; k < raw.body.raw.sensor_count; k++) {
      writer.put(readings[k] / Q10);
    }
  }
  if (std::all_of(beyond.begin(), beyond.end(), [](std::uint32_t word) { return word == 0; })) {
    beyond.clear();
  }
  writer.count(beyond.size());
  std::for_each(beyond.begin(), beyond.end(), [&](std::uint32_t word) { writer.put(word); });
  return writer.bytes();
}

std::optional<Row> decode_row(std::string_view bytes) {
  CdrReader reader(bytes);
  Row row;
  double time_us = 0;
  std::uint64_t t_us = 0;
  std::uint32_t frame = 0;
  bool has_contact = false, has_raw = false;
  wire_packet contact{}, raw{};
  skip_header(reader);
  reader.get(row.number, row.device, time_us, t_us, frame);
  try {
    reader.get(has_contact);
    std::vector<sensor_map *> maps;
    CdrGet get_contact{reader, has_contact, maps};
    visit_contact(get_contact, contact);
    reader.get(has_raw);
    CdrGet get_raw{reader, has_raw, maps};
    visit_raw(get_raw, raw, WITHOUT_SENSORS);
    std::uint32_t count = 0, pressures = 0;
    for (std::int32_t *readings : {raw.body.raw.pressure_Pa_q10, raw.body.raw.baseline_Pa_q10}) {
      pressures = count;
      reader.get(count);
      if (!reader.is_good() || count > FT_MAX_SENSORS) {
        return std::nullopt;
      }
      for (std::uint32_t k = 0; k < count; k++) {
        double pressure_Pa;
        reader.get(pressure_Pa);
        readings[k] = scaled<std::int32_t>(pressure_Pa, Q10);
      }
    }
    if (has_raw && pressures != count) {
      return std::nullopt;
    }
    raw.body.raw.sensor_count = static_cast<std::uint8_t>(count);
    count = 0;
    if (reader.has(sizeof count)) { /* messages of before end without it */
      reader.get(count);
    }
    for (std::size_t i = 0; count == maps.size() && i < count; i++) {
      std::uint32_t word;
      reader.get(word);
      *maps[i] |= sensor_map{word} << WIRE_SENSORS_OF_WORD;
    }
    if (count != 0 && count != maps.size()) {
      return std::nullopt;
    }
  } catch (const NoPacket &) {
    return std::nullopt;
  }
  if (!reader.is_good() || (!has_contact && !has_raw) || std::isinf(time_us)) {
    return std::nullopt;
  }
  if (!std::isnan(time_us)) {
    row.time_us = time_us;
  }
  if (has_contact) {
    contact.type = WIRE_CONTACT;
    contact.t_us = t_us;
    contact.body.contact.frame = frame;
    row.contact = contact;
  }
  if (has_raw) {
    raw.type = WIRE_RAW;
    raw.t_us = t_us;
    raw.body.raw.frame = frame;
    row.raw = raw;
  }
  return row;
}

} // namespace fingertip::ros
