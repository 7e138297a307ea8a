#include "simulation/player/scenario.hpp"

#include "libfingertip/error.hpp"
#include "libfingertip/text.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <map>
#include <optional>

namespace fingertip {

constexpr double PRESSURE_LIMIT_Pa = 1e7;
constexpr double TEMPERATURE_LIMIT_degC = 1e3;
constexpr const char *TRUTH[] = {"contact", "x_mm", "y_mm", "force_N", "p0_Pa", "sigma_mm", "slip"};
constexpr std::size_t TRUTHS = std::size(TRUTH);
/* After the sensors, in any order. */
constexpr const char *OPTIONAL[] = {"Qx_N", "Qy_N", "temperature_degC"};

Scenario::Scenario(const std::string &path) {
  std::ifstream file(path);
  if (!file) {
    throw Error(path + ": cannot read the scenario (" + std::strerror(errno) + "); check the path");
  }
  std::size_t line_number = 0;
  const auto fail = [&](const std::string &what) { throw Error(path + ":" + std::to_string(line_number) + ": " + what); };
  std::map<std::string, std::string> metadata;
  std::vector<std::string> header;
  std::optional<std::size_t> temperature_at;
  double temperature_degC = 25.0;
  std::vector<double> values;
  for (std::string line; std::getline(file, line);) {
    line_number++;
    if (file.eof()) {
      fail("the file ends within a line, so its end is missing; write it again");
    }
    line = std::string(trim(line));
    if (line_number == 1) {
      if (line != "# fingertip-scenario 1") {
        fail("not a scenario; the first line must be \"# fingertip-scenario 1\"");
      }
      continue;
    }
    if (line.empty()) {
      continue;
    }
    if (line[0] == '#') {
      const std::size_t colon = line.find(':');
      if (colon != std::string::npos && header.empty()) {
        metadata[std::string(trim(std::string_view(line).substr(1, colon - 1)))] = trim(std::string_view(line).substr(colon + 1));
      }
      continue;
    }
    if (header.empty()) {
      header = texts_of(split(line, ','), [](std::string_view cell) { return std::string(trim(cell)); });
      const auto given = [&](const char *key, double usual, double limit, const char *most) {
        const auto found = metadata.find(key);
        const double value = found == metadata.end() ? usual : to_double(found->second).value_or(std::nan(""));
        if (!(std::abs(value) <= limit)) {
          fail(std::string("metadata \"") + key + "\" is \"" + found->second + "\"; give " + most);
        }
        return value;
      };
      const double sensors = given("sensors", 15, 36, "a whole number from 1 to 36");
      if (sensors < 1 || sensors > 32 || sensors != std::floor(sensors)) {
        fail("metadata \"sensors\" must be a whole number from 1 to 36");
      }
      sensors_ = static_cast<unsigned>(sensors);
      ambient_Pa_ = given("ambient_Pa", ambient_Pa_, PRESSURE_LIMIT_Pa, "at most 1e7 Pa");
      temperature_degC = given("temperature_degC", temperature_degC, TEMPERATURE_LIMIT_degC, "at most 1000 degC");
      name_ = metadata["name"];
      std::vector<std::string> expected{"t_s"};
      expected.insert(expected.end(), std::begin(TRUTH), std::end(TRUTH));
      for (unsigned k = 0; k < sensors_; k++) {
        expected.push_back("s" + std::to_string(k) + "_Pa");
      }
      for (std::size_t i = 0; i < expected.size(); i++) {
        if (i >= header.size() || header[i] != expected[i]) {
          fail("column " + std::to_string(i + 1) + " is \"" + (i < header.size() ? header[i] : "") + "\"; expected \"" + expected[i] +
               "\"");
        }
      }
      const auto more = header.begin() + static_cast<std::ptrdiff_t>(expected.size());
      for (auto name = more; name != header.end(); ++name) {
        if (std::find(std::begin(OPTIONAL), std::end(OPTIONAL), *name) == std::end(OPTIONAL) || std::find(more, name, *name) != name) {
          fail("column " + std::to_string(name - header.begin() + 1) + " is \"" + *name +
               "\"; after the sensors there may be, once each: Qx_N, Qy_N, temperature_degC");
        }
        if (*name == "temperature_degC") {
          temperature_at = static_cast<std::size_t>(name - header.begin());
        }
      }
      continue;
    }
    values.clear();
    for (const std::string_view cell : split(line, ',')) {
      const std::size_t column = values.size();
      const auto value = to_double(cell);
      if (!value) {
        fail("column \"" + (column < header.size() ? header[column] : "") + "\" is \"" + std::string(cell) + "\"; give a finite number");
      }
      values.push_back(*value);
    }
    if (values.size() != header.size()) {
      fail(std::to_string(values.size()) + " columns; the header has " + std::to_string(header.size()));
    }
    if (values[0] < 0.0) {
      fail("t_s is negative; time starts at 0");
    }
    if (!times_s_.empty() && values[0] <= times_s_.back()) {
      fail("t_s does not increase");
    }
    times_s_.push_back(values[0]);
    for (unsigned k = 0; k < sensors_; k++) {
      const double pressure = values[1 + TRUTHS + k];
      if (std::abs(pressure) > PRESSURE_LIMIT_Pa) {
        fail("column \"s" + std::to_string(k) + "_Pa\": give at most 1e7 Pa");
      }
      pressures_Pa_.push_back(static_cast<float>(pressure));
    }
    if (temperature_at) {
      temperature_degC = values[*temperature_at];
      if (std::abs(temperature_degC) > TEMPERATURE_LIMIT_degC) {
        fail("column \"temperature_degC\": give at most 1000 degC");
      }
    }
    temperatures_degC_.push_back(static_cast<float>(temperature_degC));
  }
  if (times_s_.empty()) {
    fail("no rows; add at least one");
  }
}

} // namespace fingertip
