// fit_recordings: the firmware's fit on recordings of real barometric strips.
//
// Four barometers (MPL3115A2) in a line, 6 mm apart, under moulded rubber, pressed at known places
// along the line: Imperial College London, 2023, JiannnH/MTL-BaroTactileSensor, Data_collection.
// The recordings are not part of this project; without them there is nothing to do, and the result
// says so.
//
// Each row is a frame. It passes the firmware's tare and gate (condition), and is fitted on the
// line if its largest reading exceeds 500 Pa and the press is between the sensors, not beyond the
// last. One constant for each recording, the median of the errors, is taken off: the place of the
// strip under the stage. The prior is the width of the strip's response to a press that moves along
// it, known to 0.25 mm.
//
// Two strips: of test_*, whose sensors are 2.5 sigma apart, and of vac_*, where it is 3.2. There a
// press above a sensor leaves its neighbours less than the side lobes of the response (2 % of the
// peak, negative), and an outer sensor drifts by 2 kPa within the recording: the median over test_*
// is the one to judge by, that of vac_* is shown beside it.
#include "common/contact_flags.h"
#include "reference/options.hpp"

extern "C" {
#include "condition/condition.h"
#include "fit/fit.h"
}

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

namespace reference = fingertip::reference;

constexpr char HELP[] =
    "usage: fit_recordings [--recordings DIR] [--out DIR] [--check]\n"
    "  --recordings DIR  folder of the recordings, *.csv; the environment's FINGERTIP_RECORDINGS\n"
    "                    by default\n"
    "  --out DIR         where recordings.json goes, build/.../report by default\n"
    "  --check           exit status 1 if the median error with the prior exceeds 0.12 mm, 77 if\n"
    "                    there are no recordings\n";

constexpr int SENSORS = 4;
constexpr double PITCH_mm = 6.0;
constexpr double STEPS_PER_mm = 1000.0; // of the stage along the strip
constexpr double NOISE_Pa = 6.0;
constexpr double LAST_mm = 11.4; // place of the last sensor on the stage; it starts past the first
constexpr double LEAST_Pa = 500.0;
constexpr double PRIOR_WIDTH_mm = 0.25;
constexpr double MEDIAN_MAX_mm = 0.12;
constexpr int NO_RECORDINGS = 77;

struct Strip {
  const char *prefix; // of the names of its recordings
  double sigma_mm;
};
constexpr Strip STRIPS[] = {{"test_", 2.4}, {"vac_", 1.9}};

struct Recording {
  std::string name;
  double sigma_mm;
  std::vector<frame> frames;
  std::vector<double> x_mm; // of the press, in the stage's coordinates
};

// Columns by name; rows with anything but a number in one of them are left out.
Recording read(const std::filesystem::path &path, const Strip &strip) {
  std::ifstream file(path);
  std::string line;
  std::getline(file, line);
  std::vector<std::size_t> columns;
  for (const char *wanted : {"Sensor_0", "Sensor_1", "Sensor_2", "Sensor_3", "x"}) {
    std::istringstream names(line.substr(0, line.find_last_not_of("\r\n") + 1));
    std::string name;
    std::size_t column = 0;
    while (std::getline(names, name, ',') && name != wanted) {
      column++;
    }
    if (name != wanted) {
      throw std::runtime_error(path.string() + ": no column " + wanted);
    }
    columns.push_back(column);
  }
  Recording recording{path.filename().string(), strip.sigma_mm, {}, {}};
  while (std::getline(file, line)) {
    std::istringstream cells(line);
    std::vector<std::string> row;
    for (std::string cell; std::getline(cells, cell, ',');) {
      row.push_back(cell);
    }
    std::vector<double> values;
    for (std::size_t column : columns) {
      char *end = nullptr;
      const double value = column < row.size() ? std::strtod(row[column].c_str(), &end) : 0.0;
      if (end != nullptr && end != row[column].c_str() && std::isfinite(value)) {
        values.push_back(value);
      }
    }
    if (values.size() != columns.size()) {
      continue;
    }
    frame made{};
    made.sensor_count = SENSORS;
    made.noise_Pa_q10 = static_cast<std::int32_t>(1024 * NOISE_Pa);
    made.valid = (1u << SENSORS) - 1;
    for (int k = 0; k < SENSORS; k++) {
      made.pressure_Pa_q10[k] =
          static_cast<std::int32_t>(std::lround(1024.0 * values[static_cast<std::size_t>(k)]));
    }
    recording.frames.push_back(made);
    recording.x_mm.push_back(values[SENSORS] / STEPS_PER_mm);
  }
  return recording;
}

std::vector<double> errors_mm(const Recording &recording, const fit_array &array, bool prior) {
  fit_settings settings{};
  settings.iterations = 7;
  settings.noise_Pa_q10 = static_cast<std::int32_t>(1024 * NOISE_Pa);
  if (prior) {
    settings.prior_sigma_mm = static_cast<float>(recording.sigma_mm);
    settings.prior_width_mm = static_cast<float>(PRIOR_WIDTH_mm);
  }
  std::vector<double> errors;
  condition state;
  condition_tare(&state);
  for (std::size_t i = 0; i < recording.frames.size(); i++) {
    conditioned readings;
    condition_frame(&state, &recording.frames[i], nullptr, &readings);
    if (recording.x_mm[i] > LAST_mm || !readings.contact ||
        readings.peak_Pa_q10 < 1024 * LEAST_Pa) {
      continue;
    }
    fit_result fit;
    fit_gaussian(&array, readings.pressure_Pa_q10, readings.usable, &settings, &fit);
    if (fit.flags & CONTACT_FLAG_FIT_VALID) {
      errors.push_back(static_cast<double>(fit.x_mm) - recording.x_mm[i]);
    }
  }
  return errors;
}

double median(std::vector<double> values) {
  if (values.empty()) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Absolute errors after the constant is taken off.
std::vector<double> without_offset(std::vector<double> errors) {
  const double offset = median(errors);
  for (double &error : errors) {
    error = std::abs(error - offset);
  }
  return errors;
}

fit_array strip_array() {
  float x_mm[SENSORS], y_mm[SENSORS] = {};
  for (int k = 0; k < SENSORS; k++) {
    x_mm[k] = static_cast<float>(PITCH_mm * k);
  }
  fit_array array;
  if (fit_array_init(&array, SENSORS, x_mm, y_mm, static_cast<float>(PITCH_mm)) != FT_OK) {
    throw std::runtime_error("fit_array_init refuses the strip");
  }
  return array;
}

std::vector<Recording> read_all(const std::string &folder) {
  std::vector<Recording> recordings;
  for (const Strip &strip : STRIPS) {
    std::vector<std::filesystem::path> paths;
    for (const auto &entry : std::filesystem::directory_iterator(folder)) {
      if (entry.path().extension() == ".csv" &&
          entry.path().filename().string().rfind(strip.prefix, 0) == 0) {
        paths.push_back(entry.path());
      }
    }
    std::sort(paths.begin(), paths.end());
    for (const auto &path : paths) {
      recordings.push_back(read(path, strip));
    }
  }
  return recordings;
}

struct Options {
  std::string recordings, out = FINGERTIP_REPORT_DIR;
  bool check = false;
};

int run(const Options &options) {
  std::vector<Recording> recordings;
  if (!options.recordings.empty()) {
    recordings = read_all(options.recordings);
  }
  if (recordings.empty()) {
    std::puts("no recordings: name their folder with --recordings");
  }
  const fit_array array = strip_array();
  std::vector<double> judged[2]; // without and with the prior, over the strip to judge by
  std::ostringstream rows;
  const char *separator = "\n";
  for (const Recording &recording : recordings) {
    double medians[2];
    std::size_t fits = 0;
    for (bool prior : {false, true}) {
      const std::vector<double> errors = without_offset(errors_mm(recording, array, prior));
      if (errors.empty()) {
        throw std::runtime_error("no press in " + recording.name + " exceeds 500 Pa");
      }
      medians[prior] = median(errors);
      fits = errors.size();
      if (recording.name.rfind(STRIPS[0].prefix, 0) == 0) {
        judged[prior].insert(judged[prior].end(), errors.begin(), errors.end());
      }
    }
    std::printf("%s: %zu fits, median error along the line %.3f mm, without the prior on sigma "
                "%.3f mm\n",
                recording.name.c_str(), fits, medians[1], medians[0]);
    rows << separator << "{\"name\": \"" << recording.name << "\", \"fits\": " << fits
         << ", \"prior_sigma_mm\": " << recording.sigma_mm << ", \"median_mm\": " << medians[1]
         << ", \"median_without_prior_mm\": " << medians[0] << "}";
    separator = ",\n";
  }
  std::filesystem::create_directories(options.out);
  const std::string path = options.out + "/recordings.json";
  std::ofstream file(path);
  const auto number = [&](double value) -> std::string {
    return std::isfinite(value) ? std::to_string(value) : "null";
  };
  file << "{\"fits\": " << judged[1].size() << ", \"median_mm\": " << number(median(judged[1]))
       << ", \"median_without_prior_mm\": " << number(median(judged[0])) << ", \"recordings\": ["
       << rows.str() << "\n]}\n";
  file.close();
  if (!file) {
    throw std::runtime_error("cannot write " + path);
  }
  if (!options.check) {
    return 0;
  }
  return judged[1].empty() ? NO_RECORDINGS : median(judged[1]) > MEDIAN_MAX_mm;
}

} // namespace

int main(int argc, char **argv) {
  try {
    Options options;
    if (const char *folder = std::getenv("FINGERTIP_RECORDINGS")) {
      options.recordings = folder;
    }
    std::vector<char *> named{argv[0]};
    for (int i = 1; i < argc; i++) {
      if (std::strcmp(argv[i], "--check") == 0) {
        options.check = true;
      } else {
        named.push_back(argv[i]);
      }
    }
    reference::parse_options(static_cast<int>(named.size()), named.data(),
                             {{"--recordings", &options.recordings}, {"--out", &options.out}},
                             HELP);
    return run(options);
  } catch (const std::exception &error) {
    std::fprintf(stderr, "fit_recordings: %s\n", error.what());
    return 1;
  }
}
