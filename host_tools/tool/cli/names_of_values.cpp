#include "tool/cli/names_of_values.hpp"

#include "libfingertip/text.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>

namespace fingertip {

std::string sensors_text(sensor_map sensors) {
  std::string text;
  for (int k = 0; k < FT_MAX_SENSORS; k++) {
    text += sensors >> k & 1u ? " " + std::to_string(k) : "";
  }
  return std::string(trim(text));
}

sensor_map missing_sensors(sensor_map present, std::uint8_t sensor_count) { return (sensor_bit(sensor_count) - 1) & ~present; }

std::string present_text(sensor_map present, std::uint8_t sensor_count) {
  sensor_map missing = missing_sensors(present, sensor_count);
  return std::to_string(sensor_count - count_sensors(missing)) + " of " + std::to_string(sensor_count) +
         (missing ? ", missing: " + sensors_text(missing) : "");
}

std::string rate_text(std::uint32_t rate_mHz) { return rate_mHz ? fixed(rate_mHz / 1000.0, 3) : "max"; }

std::string value_of(const Metadata &pairs, const std::string &key) {
  const auto *pair = find_in(pairs, [&](const auto &each) { return each.first == key; });
  return pair ? pair->second : "";
}

std::string date_text(std::uint32_t date_s) {
  std::time_t time = date_s;
  std::tm utc{};
  gmtime_r(&time, &utc);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%d %H:%M UTC", &utc);
  return text;
}

std::string shape_text(const calibration &calibration) {
  if (calibration.sigma_um == 0) {
    return "a usual contact: not known";
  }
  return "a usual contact: sigma " + fixed(1e-3 * calibration.sigma_um, 2) + " mm, sd " + fixed(1e-3 * calibration.sigma_sd_um, 2) +
         " mm; dip around it " + fixed(100.0 * calibration.dip_share_q16 / 65536.0, 1) + " % of its peak";
}

void print_gains(const calibration &calibration, std::uint8_t sensor_count, const std::vector<double> &misfit_share) {
  constexpr int HALF = 10;
  constexpr double PER_MARK = 0.02;
  const bool has_places = std::any_of(calibration.sensors, calibration.sensors + sensor_count, [](const sensor_calibration &sensor) {
    return sensor.off_x_um != 0 || sensor.off_y_um != 0 || sensor.wider_q15 != 0;
  });
  std::printf("\nsensor    gain    sd %%%s%s   -20 %%      mean      +20 %%\n", misfit_share.empty() ? "" : "  misfit %",
              has_places ? "  off by x, y mm  wider by %" : "");
  for (int k = 0; k < sensor_count; k++) {
    const sensor_calibration &sensor = calibration.sensors[k];
    char misfit[16] = "", place[64] = "";
    if (!misfit_share.empty()) {
      std::snprintf(misfit, sizeof misfit, "%10.2f", 100.0 * misfit_share[static_cast<std::size_t>(k)]);
    }
    if (has_places) {
      std::snprintf(place, sizeof place, "%+9.2f %+6.2f  %+10.1f", 1e-3 * sensor.off_x_um, 1e-3 * sensor.off_y_um,
                    100.0 * std::expm1(sensor.wider_q15 / 32768.0));
    }
    int marks = std::clamp(static_cast<int>(std::lround((static_cast<double>(sensor.gain) - 1) / PER_MARK)), -HALF, HALF);
    std::string below(static_cast<std::size_t>(std::max(-marks, 0)), '#');
    std::string above(static_cast<std::size_t>(std::max(marks, 0)), '#');
    std::printf("%6d  %6.3f  %6.1f%s%s   %*s%s|%s\n", k, static_cast<double>(sensor.gain), 100.0 * static_cast<double>(sensor.gain_sd),
                misfit, place, HALF + 2 - static_cast<int>(below.size()), "", below.c_str(), above.c_str());
  }
}

} // namespace fingertip
