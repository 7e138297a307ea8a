// Recordings of real barometric strips: four MPL3115A2 in a line, 6 mm apart, under moulded rubber,
// pressed at known places along the line: Imperial College London, 2023, JiannnH/
// MTL-BaroTactileSensor, Data_collection. They are not part of this project.
//
// A row is the sensors' absolute pressures, the stage's place along the strip and its depth in
// steps, and the time; about 17 a second. There is no force: a touch shows by the depth.
#pragma once

extern "C" {
#include "fit/fit.h"
}

#include <array>
#include <cstddef>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace fingertip::truth {

constexpr std::size_t STRIP_SENSORS = 4;

struct StripRow {
  std::array<double, STRIP_SENSORS> pressure_Pa;
  double x_mm, depth_steps, t_s;
};

struct Strip {
  std::string name;
  std::vector<StripRow> rows;
  // Of each row: nothing touches for certain. What is neither free nor in a hold may be either.
  std::vector<bool> is_free;
  std::vector<std::pair<std::size_t, std::size_t>> holds; // first and last row
};

// All *.csv of a folder, by name. Rows that are not seven numbers, or no pressures, are left out.
std::vector<Strip> read_strips(const std::filesystem::path &folder);

// The strip at another rate: frames between the rows, with noise, through the firmware's gate.
struct Touches {
  double phantom_percent = 0;         // of the free time after 4 s: contact without a doubt
  double longest_s = 0;               // of that, from one free time to the next
  double doubted_percent = 0;         // of the free time: zero_doubtful
  double doubted_in_hold_percent = 0; // of the holds: contact, but zero_doubtful
  std::size_t holds_missed = 0;       // contact without a doubt in less than half of it
};
Touches gate_on(const Strip &strip, double frames_per_s, double noise_Pa);

// Location along the line, of contacts without a doubt above 500 Pa and between two neighbours that
// feel something. One constant of the recording is taken off: the strip's place under the stage.
//
// The prior on sigma is the width of the strip's response to other presses of it: those of every
// other millimetre, as a calibration of the strip would find it; strips differ (1.9 to 2.5 mm), and
// where the sigma is that of other strips the location is worse (median_by_others_mm). How wide
// the prior is, the other recordings choose.
struct Located {
  std::string name;
  bool is_test = false; // of the series test_*
  std::size_t fits = 0; // none where no two neighbours feel anything
  double sigma_mm = 0;  // of the response
  double prior_width_mm = 0, others_sigma_mm = 0;
  double median_mm = 0, median_by_others_mm = 0, median_without_prior_mm = 0;
};
std::vector<Located> locate(const std::vector<Strip> &strips);

} // namespace fingertip::truth
