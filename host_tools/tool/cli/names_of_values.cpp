#include "tool/cli/names_of_values.hpp"

#include "libfingertip/text.hpp"
#include "libfingertip/wire.hpp"

#include <bitset>

namespace fingertip {

std::string sensors_text(std::uint32_t sensors) {
  std::string text;
  for (int k = 0; k < FT_MAX_SENSORS; k++) {
    if (sensors >> k & 1u) {
      text += (text.empty() ? "" : " ") + std::to_string(k);
    }
  }
  return text;
}

std::uint32_t missing_sensors(std::uint32_t present, std::uint8_t sensor_count) {
  std::uint64_t all = (std::uint64_t{1} << sensor_count) - 1u;
  return static_cast<std::uint32_t>(all) & ~present;
}

std::string present_text(std::uint32_t present, std::uint8_t sensor_count) {
  std::uint32_t missing = missing_sensors(present, sensor_count);
  auto count = sensor_count - std::bitset<32>(missing).count();
  return std::to_string(count) + " of " + std::to_string(sensor_count) +
         (missing ? ", missing: " + sensors_text(missing) : "");
}

std::string rate_text(std::uint32_t rate_mHz) { return rate_mHz ? fixed(rate_mHz / 1000.0, 3) : "max"; }

} // namespace fingertip
