#include "libfingertip/names.hpp"

#include "libfingertip/error.hpp"
#include "libfingertip/text.hpp"
#include "libfingertip/wire.hpp"

namespace fingertip {

const std::vector<FlagName> &flag_names() {
  static const std::vector<FlagName> names = {
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
  };
  return names;
}

std::uint32_t warning_flags() {
  std::uint32_t warnings = 0;
  for (const FlagName &flag : flag_names()) {
    warnings |= flag.warning ? flag.bit : 0;
  }
  return warnings;
}

std::string flags_text(std::uint32_t flags) {
  std::string text;
  auto add = [&](const std::string &name) { text += (text.empty() ? "" : " ") + name; };
  for (const FlagName &flag : flag_names()) {
    if (flags & flag.bit) {
      add(flag.name);
      flags &= ~flag.bit;
    }
  }
  for (int bit = 0; bit < 32; bit++) {
    if (flags >> bit & 1u) {
      add("bit" + std::to_string(bit));
    }
  }
  return text;
}

std::string command_name(std::uint8_t type) {
  switch (type) {
  case WIRE_CMD_STREAM:
    return "stream";
  case WIRE_CMD_TARE:
    return "tare";
  case WIRE_CMD_RATE:
    return "rate";
  case WIRE_CMD_OSR:
    return "osr";
  case WIRE_CMD_SLIP:
    return "slip";
  case WIRE_CMD_INFO:
    return "info";
  case WIRE_CMD_HEALTH:
    return "health";
  case WIRE_CMD_CRASH:
    return "crash";
  case WIRE_CMD_LOADER:
    return "loader";
  case WIRE_CMD_CALIBRATE:
    return "calibrate";
  case WIRE_CMD_ERASE_CALIBRATION:
    return "erase calibration";
  case WIRE_CMD_KEEP:
    return "keep";
  case WIRE_CMD_PRIOR:
    return "prior";
  case WIRE_CMD_LOCATION_LIMIT:
    return "limit";
  case WIRE_CMD_PAD:
    return "pad";
  case WIRE_CMD_ERASE_PAD:
    return "erase pad";
  default:
    return "0x" + hex({type});
  }
}

std::string result_text(std::uint8_t result) {
  switch (result) {
  case WIRE_RESULT_DONE:
    return "done";
  case WIRE_RESULT_UNKNOWN_COMMAND:
    return "its firmware does not know this command";
  case WIRE_RESULT_OUT_OF_RANGE:
    return "the value is out of range for this firmware";
  case WIRE_RESULT_NOT_NOW:
    return "not possible now";
  default:
    return "result " + std::to_string(result);
  }
}

namespace {

struct BitName {
  std::uint8_t bit;
  const char *name;
};
constexpr BitName stream_names[] = {
    {WIRE_STREAM_CONTACT, "contact"}, {WIRE_STREAM_RAW, "raw"}, {WIRE_STREAM_HEALTH, "health"}};

constexpr BitName capability_names[] = {{WIRE_CAPABILITY_FIT, "fit"},
                                        {WIRE_CAPABILITY_SLIP, "slip"},
                                        {WIRE_CAPABILITY_RAW_STREAM, "raw"},
                                        {WIRE_CAPABILITY_TANGENTIAL, "tangential"}};

constexpr BitName stored_names[] = {{WIRE_STORED_CALIBRATION, "calibration"},
                                    {WIRE_STORED_SETTINGS, "settings"},
                                    {WIRE_STORED_WRITING, "writing"},
                                    {WIRE_STORED_DAMAGED, "damaged"},
                                    {WIRE_STORED_PAD, "pad"}};

template <std::size_t count>
std::string bits_text(const BitName (&names)[count], std::uint32_t bits,
                      const char *none = "none") {
  std::string text;
  for (const BitName &name : names) {
    if (bits & name.bit) {
      text += (text.empty() ? "" : ",") + std::string(name.name);
    }
  }
  return text.empty() ? none : text;
}

} // namespace

std::string capabilities_text(std::uint32_t capabilities) {
  return bits_text(capability_names, capabilities);
}

std::string stored_text(std::uint32_t stored) {
  return bits_text(stored_names, stored, "nothing");
}

std::string streams_text(std::uint8_t streams) {
  return bits_text(stream_names, streams);
}

std::uint8_t streams_from_text(const std::string &text) {
  std::uint8_t streams = 0;
  if (text == "none") {
    return streams;
  }
  for (std::string_view part : split(text, ',')) {
    bool known = false;
    for (const BitName &stream : stream_names) {
      if (part == stream.name) {
        streams = static_cast<std::uint8_t>(streams | stream.bit);
        known = true;
      }
    }
    if (!known) {
      throw Error(ErrorCode::bad_value,
                  "stream \"" + std::string(part) +
                      "\" is unknown; give none, or some of contact,raw,health");
    }
  }
  return streams;
}

} // namespace fingertip
