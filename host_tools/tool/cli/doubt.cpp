#include "tool/cli/doubt.hpp"

#include "libfingertip/names.hpp"
#include "libfingertip/text.hpp"
#include "libfingertip/wire.hpp"

namespace fingertip {

namespace {

std::string words_of(std::uint32_t flag, float limit_mm) {
  switch (flag) {
  case CONTACT_FLAG_LOW_SIGNAL:
    return "hardly above the noise";
  case CONTACT_FLAG_FLAT:
    return "no peak, no location";
  case CONTACT_FLAG_UNCERTAIN:
    return limit_mm > 0 ? "may be off by more than " + fixed(static_cast<double>(limit_mm), 2) + " mm"
                        : "may be off by more than the limit";
  case CONTACT_FLAG_MODEL:
    return "not one round contact";
  case CONTACT_FLAG_SATURATED:
    return "a sensor is beyond its range";
  case CONTACT_FLAG_FORCE_LOWER_BOUND:
    return "the force is at least this";
  case CONTACT_FLAG_SENSOR_MASKED:
    return "a sensor is left out";
  case CONTACT_FLAG_AT_BOUND:
    return "the fit stopped at its limit";
  case CONTACT_FLAG_ELONGATED:
    return "the contact is not round";
  case CONTACT_FLAG_ZERO_DOUBTFUL:
    return "the zero may have moved";
  case CONTACT_FLAG_SENSOR_DOUBTFUL:
    return "a sensor is in doubt";
  default:
    return "the numbers deserve less trust";
  }
}

} // namespace

std::uint32_t warnings_of(std::uint32_t flags) {
  std::uint32_t warnings = 0;
  for (const FlagName &flag : flag_names()) {
    warnings |= flag.warning ? flags & flag.bit : 0;
  }
  return warnings;
}

std::vector<std::string> warning_names(std::uint32_t flags) {
  std::vector<std::string> names;
  for (const FlagName &flag : flag_names()) {
    if (flag.warning && (flags & flag.bit)) {
      names.emplace_back(flag.name);
    }
  }
  return names;
}

std::vector<std::string> warnings_in_words(std::uint32_t flags, float limit_mm) {
  std::vector<std::string> texts;
  for (const FlagName &flag : flag_names()) {
    if (flag.warning && (flags & flag.bit)) {
      texts.push_back(std::string(flag.name) + ", " + words_of(flag.bit, limit_mm));
    }
  }
  return texts;
}

} // namespace fingertip
