#include "libfingertip/command.hpp"

#include "libfingertip/error.hpp"
#include "libfingertip/framing.hpp"
#include "libfingertip/text.hpp"

#include <cmath>
#include <cstring>

namespace fingertip {

namespace {

wire_packet packet_of(wire_type type) {
  wire_packet packet;
  std::memset(&packet, 0, sizeof packet);
  packet.type = static_cast<std::uint8_t>(type);
  return packet;
}

[[noreturn]] void out_of_range(const char *what, const std::string &value,
                               const std::string &range) {
  throw Error(ErrorCode::bad_value,
              std::string(what) + " " + value + " is out of range; give " + range);
}

std::string rate_range() {
  return fixed(WIRE_RATE_MIN_mHz / 1000.0, 1) + " to " + fixed(WIRE_RATE_MAX_mHz / 1000.0, 0) +
         " Hz, or max";
}

std::string osr_range() {
  std::string text = std::to_string(WIRE_OSR_MIN);
  for (unsigned osr = 2 * WIRE_OSR_MIN; osr < WIRE_OSR_MAX; osr *= 2) {
    text += ", " + std::to_string(osr);
  }
  return text + " or " + std::to_string(WIRE_OSR_MAX);
}

std::string threshold_range() {
  return shortest(WIRE_SLIP_THRESHOLD_MIN_mm) + " to " + shortest(WIRE_SLIP_THRESHOLD_MAX_mm) +
         " mm";
}

std::string window_range() {
  return std::to_string(WIRE_SLIP_WINDOW_MIN_ms) + " to " +
         std::to_string(WIRE_SLIP_WINDOW_MAX_ms) + " ms";
}

void check_rate(std::uint32_t rate_mHz, const std::string &text) {
  if (rate_mHz != 0 && (rate_mHz < WIRE_RATE_MIN_mHz || rate_mHz > WIRE_RATE_MAX_mHz)) {
    out_of_range("rate", text, rate_range());
  }
}

void check_osr(std::uint64_t osr) {
  if (osr < WIRE_OSR_MIN || osr > WIRE_OSR_MAX || (osr & (osr - 1)) != 0) {
    out_of_range("osr", std::to_string(osr), osr_range());
  }
}

void check_threshold(float threshold_mm) {
  if (!(threshold_mm >= WIRE_SLIP_THRESHOLD_MIN_mm && threshold_mm <= WIRE_SLIP_THRESHOLD_MAX_mm)) {
    out_of_range("slip threshold", shortest(threshold_mm), threshold_range());
  }
}

void check_window(std::uint64_t window_ms) {
  if (window_ms < WIRE_SLIP_WINDOW_MIN_ms || window_ms > WIRE_SLIP_WINDOW_MAX_ms) {
    out_of_range("slip window", std::to_string(window_ms), window_range());
  }
}

std::string prior_range() {
  return "SIGMA or SIGMA:WIDTH, " + shortest(WIRE_PRIOR_SIGMA_MIN_mm) + " to " +
         shortest(WIRE_PRIOR_SIGMA_MAX_mm) + " and " + shortest(WIRE_PRIOR_WIDTH_MIN_mm) + " to " +
         shortest(WIRE_PRIOR_WIDTH_MAX_mm) + " mm, or none";
}

std::string limit_range() {
  return shortest(WIRE_LOCATION_LIMIT_MIN_mm) + " to " + shortest(WIRE_LOCATION_LIMIT_MAX_mm) +
         " mm";
}

void check_prior(const Prior &prior) {
  bool none = prior.sigma_mm == 0 && prior.width_mm == 0;
  if (!none &&
      !(prior.sigma_mm >= WIRE_PRIOR_SIGMA_MIN_mm && prior.sigma_mm <= WIRE_PRIOR_SIGMA_MAX_mm &&
        prior.width_mm >= WIRE_PRIOR_WIDTH_MIN_mm && prior.width_mm <= WIRE_PRIOR_WIDTH_MAX_mm)) {
    out_of_range("prior", shortest(prior.sigma_mm) + ":" + shortest(prior.width_mm), prior_range());
  }
}

void check_limit(float limit_mm) {
  if (!(limit_mm >= WIRE_LOCATION_LIMIT_MIN_mm && limit_mm <= WIRE_LOCATION_LIMIT_MAX_mm)) {
    out_of_range("limit", shortest(limit_mm), limit_range());
  }
}

} // namespace

std::uint8_t possible_streams(const wire_info &info, std::uint8_t streams) {
  int missing = (info.capabilities & WIRE_CAPABILITY_FIT ? 0 : WIRE_STREAM_CONTACT) |
                (info.capabilities & WIRE_CAPABILITY_RAW_STREAM ? 0 : WIRE_STREAM_RAW);
  return static_cast<std::uint8_t>(streams & ~missing);
}

wire_packet command_stream(std::uint8_t streams) {
  wire_packet packet = packet_of(WIRE_CMD_STREAM);
  packet.body.cmd_stream.streams = streams;
  return packet;
}

wire_packet command_tare(bool force) {
  wire_packet packet = packet_of(WIRE_CMD_TARE);
  packet.body.cmd_tare.force = force ? 1 : 0;
  return packet;
}

wire_packet command_rate_mHz(std::uint32_t rate_mHz) {
  check_rate(rate_mHz, fixed(rate_mHz / 1000.0, 3));
  wire_packet packet = packet_of(WIRE_CMD_RATE);
  packet.body.cmd_rate.rate_mHz = rate_mHz;
  return packet;
}

wire_packet command_osr(std::uint32_t osr) {
  check_osr(osr);
  wire_packet packet = packet_of(WIRE_CMD_OSR);
  packet.body.cmd_osr.osr = static_cast<std::uint16_t>(osr);
  return packet;
}

wire_packet command_slip(float threshold_mm, std::uint32_t window_ms) {
  check_threshold(threshold_mm);
  check_window(window_ms);
  wire_packet packet = packet_of(WIRE_CMD_SLIP);
  packet.body.cmd_slip.threshold_mm = threshold_mm;
  packet.body.cmd_slip.window_ms = static_cast<std::uint16_t>(window_ms);
  return packet;
}

wire_packet command_info() {
  return packet_of(WIRE_CMD_INFO);
}
wire_packet command_health() {
  return packet_of(WIRE_CMD_HEALTH);
}
wire_packet command_crash() {
  return packet_of(WIRE_CMD_CRASH);
}

wire_packet command_loader() {
  wire_packet packet = packet_of(WIRE_CMD_LOADER);
  packet.body.cmd_loader.magic = WIRE_LOADER_MAGIC;
  return packet;
}

wire_packet command_calibrate(const calibration &calibration, std::uint8_t sensor_count) {
  if (sensor_count < 1 || sensor_count > FT_MAX_SENSORS ||
      !calibration_is_valid(&calibration, sensor_count)) {
    throw Error(ErrorCode::bad_value, "the calibration holds a value out of range");
  }
  wire_packet packet = packet_of(WIRE_CMD_CALIBRATE);
  packet.body.cmd_calibrate.sensor_count = sensor_count;
  packet.body.cmd_calibrate.calibration = calibration;
  return packet;
}

wire_packet command_erase_calibration() {
  return packet_of(WIRE_CMD_ERASE_CALIBRATION);
}

wire_packet command_keep(bool keep) {
  wire_packet packet = packet_of(WIRE_CMD_KEEP);
  packet.body.cmd_keep.keep = keep ? 1 : 0;
  return packet;
}

wire_packet command_prior(float sigma_mm, float width_mm) {
  check_prior({sigma_mm, width_mm});
  wire_packet packet = packet_of(WIRE_CMD_PRIOR);
  packet.body.cmd_prior.sigma_mm = sigma_mm;
  packet.body.cmd_prior.width_mm = width_mm;
  return packet;
}

wire_packet command_location_limit(float limit_mm) {
  check_limit(limit_mm);
  wire_packet packet = packet_of(WIRE_CMD_LOCATION_LIMIT);
  packet.body.cmd_location_limit.limit_mm = limit_mm;
  return packet;
}

wire_packet command_pad(const pad_profile &profile) {
  if (!pad_profile_is_valid(&profile)) {
    throw Error(ErrorCode::bad_value, "the pad's profile holds a value out of range");
  }
  wire_packet packet = packet_of(WIRE_CMD_PAD);
  packet.body.cmd_pad.profile = profile;
  return packet;
}

wire_packet command_erase_pad() {
  return packet_of(WIRE_CMD_ERASE_PAD);
}

std::uint32_t rate_mHz_from_text(const std::string &text) {
  if (text == "max") {
    return 0;
  }
  auto rate_Hz = to_double(text);
  if (!rate_Hz) {
    throw Error(ErrorCode::bad_value, "rate \"" + text + "\" is no number; give " + rate_range());
  }
  if (*rate_Hz * 1000 < WIRE_RATE_MIN_mHz || *rate_Hz * 1000 > WIRE_RATE_MAX_mHz) {
    out_of_range("rate", text, rate_range());
  }
  return static_cast<std::uint32_t>(std::lround(*rate_Hz * 1000));
}

std::uint32_t osr_from_text(const std::string &text) {
  auto osr = to_u64(text);
  if (!osr) {
    throw Error(ErrorCode::bad_value,
                "osr \"" + text + "\" is no whole number; give " + osr_range());
  }
  check_osr(*osr);
  return static_cast<std::uint32_t>(*osr);
}

float slip_threshold_mm_from_text(const std::string &text) {
  auto threshold_mm = to_float(text);
  if (!threshold_mm) {
    throw Error(ErrorCode::bad_value,
                "slip threshold \"" + text + "\" is no number; give " + threshold_range());
  }
  check_threshold(*threshold_mm);
  return *threshold_mm;
}

std::uint32_t slip_window_ms_from_text(const std::string &text) {
  auto window_ms = to_u64(text);
  if (!window_ms) {
    throw Error(ErrorCode::bad_value,
                "slip window \"" + text + "\" is no whole number; give " + window_range());
  }
  check_window(*window_ms);
  return static_cast<std::uint32_t>(*window_ms);
}

Prior prior_from_text(const std::string &text) {
  if (text == "none") {
    return {0, 0};
  }
  std::size_t colon = text.find(':');
  auto sigma_mm = to_float(text.substr(0, colon));
  auto width_mm = colon == std::string::npos ? WIRE_PRIOR_WIDTH_DEFAULT_mm : to_float(text.substr(colon + 1));
  if (!sigma_mm || !width_mm) {
    throw Error(ErrorCode::bad_value, "prior \"" + text + "\" is no number; give " + prior_range());
  }
  if (*sigma_mm == 0) {
    out_of_range("prior", text, prior_range());
  }
  check_prior({*sigma_mm, *width_mm});
  return {*sigma_mm, *width_mm};
}

float location_limit_mm_from_text(const std::string &text) {
  auto limit_mm = to_float(text);
  if (!limit_mm) {
    throw Error(ErrorCode::bad_value, "limit \"" + text + "\" is no number; give " + limit_range());
  }
  check_limit(*limit_mm);
  return *limit_mm;
}

std::string prior_text(const Prior &prior) {
  return prior.width_mm > 0 ? shortest(prior.sigma_mm) + ":" + shortest(prior.width_mm) : "none";
}

std::vector<std::uint8_t> frame_bytes(const wire_packet &packet) {
  std::vector<std::uint8_t> bytes(WIRE_MAX_FRAME_BYTES);
  std::size_t length = 0;
  const wire_layout *layout = wire_find_layout(wire_all_layouts, packet.type);
  if (wire_encode(layout, &packet, bytes.data(), &length) != FT_OK) {
    throw std::logic_error("a packet that the codec refuses");
  }
  bytes.resize(length);
  return bytes;
}

std::vector<std::uint8_t> info_frame_of_version(std::uint8_t version) {
  Bytes packet(WIRE_HEADER_BYTES);
  packet[0] = version;
  packet[1] = WIRE_CMD_INFO;
  Bytes frame;
  Envelope(std::move(packet)).append_frame(frame);
  return frame;
}

} // namespace fingertip
