#include "libfingertip/fingertip.h"

#include "libfingertip/clock_fit.hpp"
#include "libfingertip/command.hpp"
#include "libfingertip/fingertip_values.hpp"
#include "libfingertip/line_values.hpp"
#include "libfingertip/names.hpp"
#include "libfingertip/recording_fields.hpp"
#include "libfingertip/text.hpp"
#include "libfingertip/uf2.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <new>
#include <type_traits>
#include <utility>

using namespace fingertip;

static_assert(FINGERTIP_PROTOCOL == WIRE_VERSION);
static_assert(FINGERTIP_SENSORS_MOST == FT_MAX_SENSORS);
static_assert(int{FINGERTIP_FRAME_MOST} == int{WIRE_MAX_FRAME_BYTES});
static_assert(int{FINGERTIP_TEXT_LENGTH} == int{WIRE_TEXT_BYTES});

namespace fingertip::values {

constexpr bool all_fit() {
  for (const Packet &packet : packets) {
    std::size_t sum = 0;
    for (std::size_t i = 0; i < packet.count; i++) {
      sum += packet.fields[i].count;
    }
    if (sum > FINGERTIP_VALUES_MOST) {
      return false;
    }
  }
  return true;
}
static_assert(all_fit());

static thread_local std::string last_error;

static const Packet *find(std::uint8_t type) {
  return find_in(packets, [&](const Packet &each) { return each.type == type; });
}

/* Calls with a number of the kind's type. */
template <typename Visitor> static void visit_kind(Kind kind, const Visitor &visit) {
  switch (kind) {
  case Kind::u16: return visit(std::uint16_t{});
  case Kind::i16: return visit(std::int16_t{});
  case Kind::u32: return visit(std::uint32_t{});
  case Kind::i32: return visit(std::int32_t{});
  case Kind::u64: return visit(std::uint64_t{});
  case Kind::f32: return visit(float{});
  default: return visit(std::uint8_t{});
  }
}

static double load(Kind kind, const std::uint8_t *from) {
  double value = 0;
  visit_kind(kind, [&](auto number) {
    std::memcpy(&number, from, sizeof number);
    value = static_cast<double>(number);
  });
  return value;
}

static void store(const Field &field, double value, std::uint8_t *to) {
  visit_kind(field.kind, [&](auto number) {
    using Number = decltype(number);
    const auto largest = static_cast<double>(std::numeric_limits<Number>::max()); /* of 64 bits, rounded up */
    if (std::is_integral_v<Number> &&
        (!(value >= static_cast<double>(std::numeric_limits<Number>::min()) && value <= largest) || value != std::floor(value))) {
      throw Error(ErrorCode::bad_value, std::string(field.name) + " is out of range");
    }
    number = std::is_integral_v<Number> && value == largest ? std::numeric_limits<Number>::max() : static_cast<Number>(value);
    if (!std::isfinite(static_cast<double>(number))) {
      throw Error(ErrorCode::bad_value, std::string(field.name) + " is no finite number");
    }
    std::memcpy(to, &number, sizeof number);
  });
}

std::size_t count_of(std::uint8_t type) {
  const Packet *packet = find(type);
  std::size_t sum = 0;
  for (std::size_t i = 0; packet && i < packet->count; i++) {
    sum += packet->fields[i].count;
  }
  return sum;
}

wire_packet packet_of(std::uint8_t type, const double *values, std::size_t count) {
  const Packet *known = find(type);
  if (!known || count != count_of(type)) {
    throw Error(ErrorCode::wrong_choice, known ? "a packet of type " + std::to_string(type) + " has " + std::to_string(count_of(type)) +
                                                     " numbers, not " + std::to_string(count)
                                               : "there is no packet of type " + std::to_string(type));
  }
  wire_packet packet;
  std::memset(&packet, 0, sizeof packet);
  packet.type = type;
  auto *bytes = reinterpret_cast<std::uint8_t *>(&packet);
  for (std::size_t i = 0; i < known->count; i++) {
    const Field &field = known->fields[i];
    if (std::strcmp(field.name, "sensor_count") == 0 && !(*values >= 1 && *values <= FT_MAX_SENSORS)) {
      throw Error(ErrorCode::bad_value, "sensor_count is not 1 to " + std::to_string(FT_MAX_SENSORS));
    }
    for (std::size_t k = 0; k < field.count; k++) {
      store(field, *values++, bytes + field.offset + k * field.stride);
    }
  }
  return packet;
}

void put(const wire_packet &packet, double *values) {
  const Packet *known = find(packet.type);
  const auto *bytes = reinterpret_cast<const std::uint8_t *>(&packet);
  for (std::size_t i = 0; known && i < known->count; i++) {
    const Field &field = known->fields[i];
    for (std::size_t k = 0; k < field.count; k++) {
      *values++ = load(field.kind, bytes + field.offset + k * field.stride);
    }
  }
}

static_assert(std::tuple_size_v<decltype(LineStatistics::counts)> == FINGERTIP_COUNTS - 1); /* in the same order */

void put(const LineStatistics &statistics, double counts[FINGERTIP_COUNTS]) {
  *counts = static_cast<double>(statistics.bytes);
  for (const auto &[name, count] : LineStatistics::counts) {
    *++counts = static_cast<double>(statistics.*count);
  }
}

LineStatistics statistics_of(const double counts[FINGERTIP_COUNTS]) {
  const auto whole = [](double count) { return count > 0 ? static_cast<std::uint64_t>(count) : 0; };
  LineStatistics statistics;
  statistics.bytes = whole(*counts);
  for (const auto &[name, count] : LineStatistics::counts) {
    statistics.*count = whole(*++counts);
  }
  return statistics;
}

fingertip_status failed(fingertip_status status, const std::string &text) {
  last_error = text;
  return status;
}

fingertip_status failed(const Error &error) {
  constexpr std::pair<ErrorCode, fingertip_status> STATUSES[] = {
      {ErrorCode::wrong_choice, FINGERTIP_ERR_ARGUMENT},           {ErrorCode::bad_value, FINGERTIP_ERR_VALUE},
      {ErrorCode::not_a_recording, FINGERTIP_ERR_NOT_A_RECORDING}, {ErrorCode::other_format, FINGERTIP_ERR_OTHER_FORMAT},
      {ErrorCode::unread_kind, FINGERTIP_ERR_NOT_A_RECORDING},     {ErrorCode::damaged_line, FINGERTIP_ERR_DAMAGED_LINE},
      {ErrorCode::damaged_head, FINGERTIP_ERR_DAMAGED_HEAD},       {ErrorCode::other_sensor_count, FINGERTIP_ERR_SENSORS},
      {ErrorCode::not_firmware, FINGERTIP_ERR_FIRMWARE},           {ErrorCode::other_chip, FINGERTIP_ERR_FIRMWARE},
      {ErrorCode::damaged_firmware, FINGERTIP_ERR_FIRMWARE}};
  const auto *found = find_in(STATUSES, [&](const auto &each) { return each.first == error.code(); });
  return failed(found ? found->second : FINGERTIP_ERR_OTHER, error.what());
}

std::size_t put_text(const std::string &from, char *text, std::size_t size) {
  if (text && size > 0) {
    const std::size_t length = std::min(from.size(), size - 1);
    std::memcpy(text, from.data(), length);
    text[length] = '\0';
  }
  return from.size();
}

} // namespace fingertip::values

using namespace fingertip::values;

struct fingertip_decoder {
  Decoder decoder;
};

struct fingertip_clock {
  ClockFit fit;
};

const char *fingertip_error(void) { return last_error.c_str(); }

enum fingertip_status fingertip_field_of(uint8_t type, size_t index, struct fingertip_field *field) {
  const Packet *packet = find(type);
  if (!packet || !field) {
    return failed(FINGERTIP_ERR_ARGUMENT, "there is no such type of packets");
  }
  if (index >= packet->count) {
    return FINGERTIP_END;
  }
  std::uint32_t at = 0;
  for (std::size_t i = 0; i < index; i++) {
    at += packet->fields[i].count;
  }
  const Field &found = packet->fields[index];
  *field = {found.name, at, found.count, found.kind == Kind::text};
  return FINGERTIP_OK;
}

size_t fingertip_value_count(uint8_t type) { return count_of(type); }

enum fingertip_status fingertip_encode(uint8_t type, const double *values, size_t count, uint8_t *frame, size_t size, size_t *length) {
  return guarded([&] {
    if (!values || !frame || !length) {
      return failed(FINGERTIP_ERR_ARGUMENT, "a pointer is NULL");
    }
    const wire_packet packet = packet_of(type, values, count);
    std::uint8_t encoded[WIRE_MAX_FRAME_BYTES];
    std::size_t bytes = 0;
    if (wire_encode(wire_find_layout(wire_all_layouts, type), &packet, encoded, &bytes) != FT_OK) {
      return failed(FINGERTIP_ERR_VALUE, "a text has other than printable characters");
    }
    if (bytes > size) {
      return failed(FINGERTIP_ERR_ARGUMENT, "there is no room for the frame");
    }
    std::memcpy(frame, encoded, bytes);
    *length = bytes;
    return FINGERTIP_OK;
  });
}

enum fingertip_status fingertip_encode_info_of(uint8_t version, uint8_t *frame, size_t size, size_t *length) {
  return guarded([&] {
    const auto bytes = info_frame_of_version(version);
    if (!frame || !length || bytes.size() > size) {
      return failed(FINGERTIP_ERR_ARGUMENT, "there is no room for the frame");
    }
    std::copy(bytes.begin(), bytes.end(), frame);
    *length = bytes.size();
    return FINGERTIP_OK;
  });
}

struct fingertip_decoder *fingertip_decoder_new(void) {
  return new (std::nothrow) fingertip_decoder;
}

void fingertip_decoder_free(struct fingertip_decoder *decoder) { delete decoder; }

size_t fingertip_decoder_feed(struct fingertip_decoder *decoder, const uint8_t *bytes, size_t length, double *values, size_t size,
                              size_t *filled) {
  if (filled) {
    *filled = 0;
  }
  if (!decoder || !bytes || !values || !filled) {
    return 0;
  }
  /* A frame ends with a zero: up to each of them there is room for one packet more, or none. */
  std::size_t taken = 0, used = 0;
  while (taken < length && size - used > FINGERTIP_VALUES_MOST) {
    const void *zero = std::memchr(bytes + taken, 0, length - taken);
    const std::size_t end = zero ? static_cast<std::size_t>(static_cast<const std::uint8_t *>(zero) - bytes) + 1 : length;
    decoder->decoder.feed(bytes + taken, end - taken, [&](const wire_packet &packet) {
      values[used++] = packet.type;
      put(packet, values + used);
      used += count_of(packet.type);
    });
    taken = end;
  }
  *filled = used;
  return taken;
}

void fingertip_decoder_restart(struct fingertip_decoder *decoder) { decoder->decoder.restart(); }

void fingertip_decoder_counts(const struct fingertip_decoder *decoder, double counts[FINGERTIP_COUNTS]) {
  put(decoder->decoder.statistics(), counts);
}

uint8_t fingertip_decoder_other_version(const struct fingertip_decoder *decoder) { return decoder->decoder.other_version(); }

struct fingertip_clock *fingertip_clock_new(void) {
  return new (std::nothrow) fingertip_clock;
}

void fingertip_clock_free(struct fingertip_clock *clock) { delete clock; }

void fingertip_clock_add(struct fingertip_clock *clock, double sent_us, double received_us, double device_us) {
  if (std::isfinite(sent_us) && std::isfinite(received_us) && device_us >= 0) {
    clock->fit.add({std::llround(sent_us), std::llround(received_us), static_cast<std::uint64_t>(device_us)});
  }
}

enum fingertip_status fingertip_clock_estimate(const struct fingertip_clock *clock, double estimate[4]) {
  const auto &found = clock->fit.estimate();
  if (!found) {
    return FINGERTIP_END;
  }
  const double numbers[4] = {static_cast<double>(found->device_us), found->host_us, found->drift_ppm, found->uncertainty_us};
  std::copy(std::begin(numbers), std::end(numbers), estimate);
  return FINGERTIP_OK;
}

unsigned fingertip_clock_jumps(const struct fingertip_clock *clock) { return clock->fit.jumps(); }

void fingertip_clock_restart(struct fingertip_clock *clock) { clock->fit = ClockFit(); }

const char *fingertip_flag(size_t index, uint32_t *bit, int *is_warning) {
  const auto &all = flag_names();
  if (index >= all.size()) {
    return nullptr;
  }
  if (bit) {
    *bit = all[index].bit;
  }
  if (is_warning) {
    *is_warning = all[index].warning;
  }
  return all[index].name;
}

size_t fingertip_flags_text(uint32_t flags, char *text, size_t size) { return put_text(flags_text(flags), text, size); }

size_t fingertip_command_name(uint8_t type, char *text, size_t size) { return put_text(command_name(type), text, size); }

size_t fingertip_result_text(uint8_t result, char *text, size_t size) { return put_text(result_text(result), text, size); }

size_t fingertip_capabilities_text(uint32_t capabilities, char *text, size_t size) {
  return put_text(capabilities_text(capabilities), text, size);
}

size_t fingertip_stored_text(uint32_t stored, char *text, size_t size) { return put_text(stored_text(stored), text, size); }

size_t fingertip_columns(uint8_t sensor_count, char *text, size_t size) {
  return put_text(recording::header_text(std::min<std::uint8_t>(sensor_count, FT_MAX_SENSORS)), text, size);
}

size_t fingertip_number_text(float value, char *text, size_t size) { return put_text(shortest(value), text, size); }

enum fingertip_status fingertip_firmware(const char *name, const uint8_t *bytes, size_t length, char *board, char *version, char *git_hash,
                                         size_t size) {
  return guarded([&] {
    if (!bytes && length > 0) {
      return failed(FINGERTIP_ERR_ARGUMENT, "a pointer is NULL");
    }
    const FirmwareImage image = firmware_of(name ? name : "", std::vector<std::uint8_t>(bytes, bytes + length));
    put_text(image.board, board, size);
    put_text(image.version, version, size);
    put_text(image.git_hash, git_hash, size);
    return FINGERTIP_OK;
  });
}
