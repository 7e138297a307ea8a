/* Columns, cells and comments of recordings, for their writers and their reader; line_fields.hpp lists
 * them. No interface of the library. */
#pragma once

#include "libfingertip/line_fields.hpp"
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
inline constexpr const char *PACKET_SYNC = "sync";
inline constexpr double Q10 = 1024.0;

/* Splits the serial numbers of a joint recording, "A B"; people write "A, B". */
inline std::vector<std::string> serials_in(std::string text) {
  std::replace(text.begin(), text.end(), ',', ' ');
  std::vector<std::string> found;
  for (std::string_view word : split(text, ' ')) {
    if (!word.empty()) {
      found.emplace_back(word);
    }
  }
  return found;
}

struct Namer {
  std::string text;
  template <typename Value> void operator()(const std::string &name, const Value &) { text += "," + name; }
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
  template <typename Value> void operator()(const std::string &, const Value &value) { text += "," + cell_text(value); }
};

struct PairWriter {
  Metadata pairs;
  template <typename Value> void operator()(const std::string &name, const Value &value) { pairs.emplace_back(name, cell_text(value)); }
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
  /* The beginning of it, for a message. */
  std::string text() const { return what.size() > 200 ? what.substr(0, 200) + "..." : what; }
};

template <typename Integer> Integer checked(std::int64_t value, const std::string &name) {
  if (value < static_cast<std::int64_t>(std::numeric_limits<Integer>::min()) ||
      value > static_cast<std::int64_t>(std::numeric_limits<Integer>::max())) {
    throw Damage{name + " is out of range"};
  }
  return static_cast<Integer>(value);
}

template <typename Value> void parse_cell(const std::string &name, std::string_view cell, Value &&value) {
  using Plain = std::decay_t<Value>;
  const auto found = [&](const auto &number) {
    if (!number) {
      throw Damage{name + " is \"" + std::string(cell) + "\""};
    }
    return *number;
  };
  if constexpr (std::is_same_v<Plain, Quantity>) {
    if (cell.empty() && !value.valid) {
      value.value = 0;
      return;
    }
    parse_cell(name, cell, value.value);
  } else if constexpr (std::is_same_v<Plain, float>) {
    value = found(to_float(cell));
  } else if constexpr (std::is_same_v<Plain, std::uint64_t>) {
    value = found(to_u64(cell));
  } else if constexpr (std::is_integral_v<Plain>) {
    value = checked<Plain>(found(to_i64(cell)), name);
  } else {
    auto number = to_double(cell);
    if (number && std::fabs(*number) > 1e12) {
      number.reset();
    }
    value.raw = checked<std::decay_t<decltype(value.raw)>>(std::llround(found(number) * value.scale), name);
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

inline std::string header_text(std::uint8_t sensor_count, int sets = LATER_SETS) {
  wire_packet packet;
  std::memset(&packet, 0, sizeof packet);
  Namer namer;
  visit_contact(namer, packet, sets);
  visit_raw(namer, packet, sensor_count);
  return "t_us,frame" + namer.text;
}

inline std::size_t contact_columns(int sets = LATER_SETS) {
  wire_packet packet;
  std::memset(&packet, 0, sizeof packet);
  Namer namer;
  visit_contact(namer, packet, sets);
  return static_cast<std::size_t>(std::count(namer.text.begin(), namer.text.end(), ','));
}

/* The packets of a row. */
struct RowPackets {
  std::optional<wire_packet> contact, raw; /* one of them at least */
};

/* From t_us on. */
inline std::string row_text(const wire_packet *contact, const wire_packet *raw, std::uint8_t sensor_count, int sets = LATER_SETS) {
  const wire_packet &any = contact ? *contact : *raw;
  std::uint32_t frame = contact ? contact->body.contact.frame : raw->body.raw.frame;
  RowWriter writer;
  writer.text = std::to_string(any.t_us) + "," + std::to_string(frame);
  if (contact) {
    wire_packet copy = *contact;
    visit_contact(writer, copy, sets);
  } else {
    writer.text += std::string(contact_columns(sets), ',');
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
inline RowPackets parse_row(std::string_view text, std::uint8_t sensor_count, int sets) {
  auto cells = split(text, ',');
  std::size_t contact_count = contact_columns(sets);
  std::size_t raw_count = RAW_COLUMNS + 2 * std::size_t{sensor_count};
  if (cells.size() != 2 + contact_count + raw_count) {
    const std::size_t columns = 2 + contact_count + raw_count;
    throw Damage{std::to_string(cells.size()) + " columns where the header has " + std::to_string(columns) +
                 (cells.size() > columns ? "; separators of thousands, decimal commas, or more cells?" : "")};
  }
  auto is_empty = [&](std::size_t from, std::size_t count) {
    return std::all_of(cells.begin() + static_cast<std::ptrdiff_t>(from), cells.begin() + static_cast<std::ptrdiff_t>(from + count),
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
    visit_contact(reader, packet, sets);
    packet.body.contact.frame = frame;
    if (packet.body.contact.flags & flags_beyond(sets)) {
      throw Damage{"its flags need columns that are not there"};
    }
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

/* The columns of a header; joint: of a recording of several. */
struct Columns {
  std::uint8_t sensor_count;
  int sets; /* of those that came later */
};
inline std::optional<Columns> columns_of(std::string_view header, bool joint) {
  const std::string_view before = joint ? JOINT_COLUMNS : "";
  if (header.substr(0, before.size()) != before) {
    return std::nullopt;
  }
  header.remove_prefix(before.size());
  auto columns = static_cast<std::size_t>(std::count(header.begin(), header.end(), ',')) + 1;
  for (int sets = LATER_SETS; sets >= 0; sets--) {
    std::size_t fixed_columns = 2 + contact_columns(sets) + RAW_COLUMNS;
    std::size_t sensors = columns > fixed_columns ? (columns - fixed_columns) / 2 : 0;
    if (sensors <= FT_MAX_SENSORS && header == header_text(static_cast<std::uint8_t>(sensors), sets)) {
      return Columns{static_cast<std::uint8_t>(sensors), sets};
    }
  }
  return std::nullopt;
}

} // namespace fingertip::recording
