// fit_stiff: what the firmware says about presses that are hard, extreme, or none at all.
//
// Each case draws presses, turns them into frames of absolute readings and runs them through the
// firmware's own chain: tare and gate (condition), fit (fit_gaussian, with the build's number of
// iterations), flags (contact). Only what the scan adds to a frame is restated here: the mark of a
// reading beyond MS58XX_MAX_PRESSURE_Pa, and saturation to int32.
//
// A warning is UNCERTAIN, MODEL, FLAT, AT_BOUND, LOW_SIGNAL, FORCE_LOWER_BOUND, no contact or no
// fit. The firmware has the true settings: gains are exact where the case does not spread them. Bad
// means more than 1 mm from the truth, and any location where there is none to find; of two
// contacts the truth is the centroid of force.
#include "common/contact_flags.h"
#include "libfingertip/in_parallel.hpp"
#include "report/fit/json_file.hpp"
#include "report/fit/kernels.hpp"
#include "report/reference/dataset.hpp"
#include "report/reference/options.hpp"

extern "C" {
#include "condition/condition.h"
#include "config/defaults.h"
#include "contact/contact.h"
#include "fit/fit.h"
#include "ms58xx/ms58xx.h"
}

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

namespace fitting = fingertip::fitting;
namespace reference = fingertip::reference;
using reference::Random;

constexpr char HELP[] = "usage: fit_stiff [--limit N] [--seed S] [--case TEXT] [--out DIR] [--check]\n"
                        "  --limit N    presses of each case, 8000 by default\n"
                        "  --seed S     of the presses\n"
                        "  --case TEXT  only cases whose name holds it\n"
                        "  --out DIR    where stiff.json goes, build/.../report by default\n"
                        "  --check      exit status 1 if a result is not finite, or if more than 1.3 % of a case are\n"
                        "               bad and carry no warning (6 % where a prior is wrong)\n";

constexpr double ATMOSPHERE_Pa = 101325.0;
constexpr double NOISE_Pa = 5.0;
constexpr double BAD_mm = 1.0;
// A warning means a standard deviation above 0.6 mm, which one touch in fifty exceeds twice over.
constexpr double BAD_UNFLAGGED_MAX = 0.013;
// Where the prior itself is wrong, by more than its standard deviation.
constexpr double BAD_UNFLAGGED_MAX_WRONG_PRIOR = 0.06;
constexpr double NOT_A_NUMBER = std::numeric_limits<double>::quiet_NaN();
constexpr std::uint32_t WARNINGS = CONTACT_FLAG_UNCERTAIN | CONTACT_FLAG_MODEL | CONTACT_FLAG_FLAT |
                                   CONTACT_FLAG_AT_BOUND | CONTACT_FLAG_LOW_SIGNAL | CONTACT_FLAG_FORCE_LOWER_BOUND;

struct Flag {
  const char *name;
  std::uint32_t bit;
};
constexpr Flag FLAGS[] = {
    {"contact", CONTACT_FLAG_CONTACT},
    {"fit_valid", CONTACT_FLAG_FIT_VALID},
    {"low_signal", CONTACT_FLAG_LOW_SIGNAL},
    {"flat", CONTACT_FLAG_FLAT},
    {"uncertain", CONTACT_FLAG_UNCERTAIN},
    {"model", CONTACT_FLAG_MODEL},
    {"saturated", CONTACT_FLAG_SATURATED},
    {"force_lower_bound", CONTACT_FLAG_FORCE_LOWER_BOUND},
    {"sensor_masked", CONTACT_FLAG_SENSOR_MASKED},
    {"at_bound", CONTACT_FLAG_AT_BOUND},
    {"elongated", CONTACT_FLAG_ELONGATED},
};
constexpr std::size_t FLAG_COUNT = std::size(FLAGS);

struct Press {
  std::vector<double> pressure_Pa; // [sensor] above the atmosphere
  double noise_Pa = NOISE_Pa;      // as the firmware believes it
  double x_mm = 0, y_mm = 0;
  bool located = true;         // whether there is a location to find
  std::uint32_t dead = 0;      // bitmap of sensors without a reading
  bool limited_range = true;   // the sensor's; without it, scale is the only thing that grows
  double prior_sigma_mm = 0.0; // width of the prior 0.5 mm; 0 for none
  float gain_sd = 0.0f;        // as the firmware believes it
};

struct Case {
  const char *name;
  std::function<Press(const reference::Array &, Random &)> draw;
  bool duplicates = false; // on an array that has two sensors in each of seven places
  double bad_unflagged_max = BAD_UNFLAGGED_MAX;
};

struct Result {
  double error_mm; // NaN without a fit or without a truth
  std::uint32_t flags;
  bool located, finite;
};

struct Row {
  std::string name;
  std::size_t presses = 0, fits = 0, not_finite = 0;
  double p50_mm = 0, p95_mm = 0, worst_mm = 0;
  double share[FLAG_COUNT] = {};
  double bad_unflagged = 0, good_flagged = 0, bad_unflagged_max = BAD_UNFLAGGED_MAX;
};

std::vector<double> gaussian(const reference::Array &array, double x_mm, double y_mm, double sigma_mm, double p0_Pa) {
  std::vector<double> pressure_Pa;
  for (std::size_t k = 0; k < array.x_mm.size(); k++) {
    const double dx = array.x_mm[k] - x_mm, dy = array.y_mm[k] - y_mm;
    pressure_Pa.push_back(p0_Pa * std::exp(-0.5 * (dx * dx + dy * dy) / (sigma_mm * sigma_mm)));
  }
  return pressure_Pa;
}

void add_noise(Press &press, Random &random, double rms_Pa = NOISE_Pa) {
  for (double &p : press.pressure_Pa) {
    p += rms_Pa * random.normal();
  }
}

double half(const std::vector<double> &coordinates) {
  return *std::max_element(coordinates.begin(), coordinates.end());
}

std::size_t strongest(const Press &press) {
  const auto &p = press.pressure_Pa;
  return static_cast<std::size_t>(std::max_element(p.begin(), p.end()) - p.begin());
}

struct Range {
  double low, high;
};

double draw_from(Random &random, Range range) {
  return range.low == range.high ? range.low : random.log_uniform(range.low, range.high);
}

// A Gaussian at (x, y), without noise.
Press gaussian_at(const reference::Array &array, Random &random, double x_mm, double y_mm, Range sigma_mm,
                  Range p0_Pa) {
  Press press;
  press.x_mm = x_mm;
  press.y_mm = y_mm;
  const double sigma = draw_from(random, sigma_mm);
  press.pressure_Pa = gaussian(array, x_mm, y_mm, sigma, draw_from(random, p0_Pa));
  return press;
}

constexpr Range USUAL_SIGMA_mm{3, 20}, USUAL_P0_Pa{1e3, 9e4};

Press inside(const reference::Array &array, Random &random, Range sigma_mm = USUAL_SIGMA_mm,
             Range p0_Pa = USUAL_P0_Pa) {
  const double x = random.uniform(-half(array.x_mm), half(array.x_mm));
  const double y = random.uniform(-half(array.y_mm), half(array.y_mm));
  return gaussian_at(array, random, x, y, sigma_mm, p0_Pa);
}

auto noisy_inside(Range sigma_mm, Range p0_Pa) {
  return [=](const reference::Array &array, Random &random) {
    Press press = inside(array, random, sigma_mm, p0_Pa);
    add_noise(press, random);
    return press;
  };
}

// Past one edge, or past two (a corner), by low to high.
auto noisy_outside(bool corner, Range by_mm) {
  return [=](const reference::Array &array, Random &random) {
    double x = random.uniform(-half(array.x_mm), half(array.x_mm));
    double y = random.uniform(-half(array.y_mm), half(array.y_mm));
    const bool past_x = corner || random.next() % 2;
    const bool past_y = corner || !past_x;
    if (past_x) {
      x = std::copysign(half(array.x_mm) + random.uniform(by_mm.low, by_mm.high), x);
    }
    if (past_y) {
      y = std::copysign(half(array.y_mm) + random.uniform(by_mm.low, by_mm.high), y);
    }
    Press press = gaussian_at(array, random, x, y, USUAL_SIGMA_mm, USUAL_P0_Pa);
    add_noise(press, random);
    return press;
  };
}

// Every reading the same, or all of them but for noise of `noise_Pa` where the firmware expects 5.
auto everywhere(Range p0_Pa, double sign, double noise_Pa) {
  return [=](const reference::Array &array, Random &random) {
    Press press;
    press.located = false;
    press.pressure_Pa.assign(array.x_mm.size(), sign * draw_from(random, p0_Pa));
    add_noise(press, random, noise_Pa);
    return press;
  };
}

auto with_offset(double offset_Pa, bool one_sensor) {
  return [=](const reference::Array &array, Random &random) {
    Press press = inside(array, random);
    add_noise(press, random);
    const std::size_t chosen = random.next() % press.pressure_Pa.size();
    for (std::size_t k = 0; k < press.pressure_Pa.size(); k++) {
      press.pressure_Pa[k] += !one_sensor || k == chosen ? offset_Pa : 0.0;
    }
    return press;
  };
}

auto with_gain_spread(double spread) {
  return [=](const reference::Array &array, Random &random) {
    Press press = inside(array, random);
    for (double &p : press.pressure_Pa) {
      p *= 1.0 + spread * random.uniform(-1.0, 1.0);
    }
    press.gain_sd = DEFAULT_GAIN_SD;
    add_noise(press, random);
    return press;
  };
}

auto with_dead(int alive, bool peak) {
  return [=](const reference::Array &array, Random &random) {
    Press press = inside(array, random);
    add_noise(press, random);
    if (peak) {
      press.dead = std::uint32_t{1} << strongest(press);
      return press;
    }
    int left = static_cast<int>(array.x_mm.size());
    while (left > alive) {
      const auto bit = std::uint32_t{1} << random.next() % array.x_mm.size();
      left -= (press.dead & bit) ? 0 : 1;
      press.dead |= bit;
    }
    return press;
  };
}

auto two_contacts(Range apart_mm) {
  return [=](const reference::Array &array, Random &random) {
    const double sigma = random.log_uniform(4, 8);
    const double first = random.log_uniform(1e3, 3e4), second = first * random.log_uniform(0.3, 3);
    const double share = second / (first + second);
    for (;;) {
      const double angle = random.uniform(0, 2 * M_PI);
      const double apart = random.uniform(apart_mm.low, apart_mm.high);
      const double x = random.uniform(-half(array.x_mm), half(array.x_mm));
      const double y = random.uniform(-half(array.y_mm), half(array.y_mm));
      const double x2 = x + apart * std::cos(angle), y2 = y + apart * std::sin(angle);
      if (std::abs(x2) > half(array.x_mm) || std::abs(y2) > half(array.y_mm)) {
        continue;
      }
      Press press;
      press.x_mm = x + share * (x2 - x);
      press.y_mm = y + share * (y2 - y);
      press.pressure_Pa = gaussian(array, x, y, sigma, first);
      const std::vector<double> other = gaussian(array, x2, y2, sigma, second);
      for (std::size_t k = 0; k < other.size(); k++) {
        press.pressure_Pa[k] += other[k];
      }
      add_noise(press, random);
      return press;
    }
  };
}

auto from_set(reference::PressSet set, double prior_sigma_mm) {
  return [=](const reference::Array &array, Random &random) {
    const reference::Press drawn = reference::make_press(set, array, random.next(), 0);
    Press press;
    press.pressure_Pa = drawn.pressure_Pa;
    press.noise_Pa = drawn.noise_Pa;
    press.x_mm = drawn.x_mm;
    press.y_mm = drawn.y_mm;
    press.limited_range = false;
    press.prior_sigma_mm = prior_sigma_mm;
    return press;
  };
}

Press checkerboard(const reference::Array &array, Random &random) {
  Press press;
  press.located = false;
  const double p0_Pa = random.log_uniform(1e3, 9e4);
  for (std::size_t k = 0; k < array.x_mm.size(); k++) {
    const long node = std::lround((array.x_mm[k] + array.y_mm[k]) / array.pitch_mm);
    press.pressure_Pa.push_back(node % 2 ? p0_Pa : 0.0);
  }
  add_noise(press, random);
  return press;
}

// A few units of 1/1024 Pa, under a noise that fits.
Press few_units(const reference::Array &array, Random &random) {
  constexpr double UNIT_Pa = 1.0 / 1024.0;
  Press press = inside(array, random, USUAL_SIGMA_mm, {20 * UNIT_Pa, 40 * UNIT_Pa});
  press.noise_Pa = UNIT_Pa;
  return press;
}

// The least that the gate passes, in steps far coarser than the noise.
Press in_steps(const reference::Array &array, Random &random) {
  constexpr double STEP_Pa = 20.0;
  Press press = inside(array, random, {4, 15}, {200, 2000});
  add_noise(press, random);
  for (double &p : press.pressure_Pa) {
    p = STEP_Pa * std::round(p / STEP_Pa);
  }
  return press;
}

Press unlimited(Press press) {
  press.limited_range = false;
  return press;
}

std::vector<Case> all_cases() {
  const auto beyond_range = [](Range p0_Pa, bool limited) {
    return [=](const reference::Array &array, Random &random) {
      Press press = noisy_inside({4, 12}, p0_Pa)(array, random);
      return limited ? press : unlimited(press);
    };
  };
  const auto with_prior = [](Range sigma_mm, double prior_sigma_mm) {
    return [=](const reference::Array &array, Random &random) {
      Press press = noisy_inside(sigma_mm, USUAL_P0_Pa)(array, random);
      press.prior_sigma_mm = prior_sigma_mm;
      return press;
    };
  };
  return {
      {"inside", noisy_inside(USUAL_SIGMA_mm, USUAL_P0_Pa)},
      {"past an edge by 0..9 mm", noisy_outside(false, {0, 9})},
      {"past an edge by 9..30 mm", noisy_outside(false, {9, 30})},
      {"past a corner by 0..6 mm", noisy_outside(true, {0, 6})},
      {"past a corner by 6..30 mm", noisy_outside(true, {6, 30})},
      {"sigma 0.5 mm", noisy_inside({0.5, 0.5}, USUAL_P0_Pa)},
      {"sigma 1 mm", noisy_inside({1, 1}, USUAL_P0_Pa)},
      {"sigma 2 mm", noisy_inside({2, 2}, USUAL_P0_Pa)},
      {"sigma 3 mm", noisy_inside({3, 3}, USUAL_P0_Pa)},
      {"sigma 2 mm, prior 2", with_prior({2, 2}, 2)},
      {"sigma 3 mm, prior 3.3", with_prior({3, 3}, 3.3)},
      {"sigma 15..30 mm", noisy_inside({15, 30}, USUAL_P0_Pa)},
      {"sigma 30..50 mm", noisy_inside({30, 50}, USUAL_P0_Pa)},
      {"sigma 50..200 mm", noisy_inside({50, 200}, USUAL_P0_Pa)},
      {"all equal", everywhere({1e3, 9e4}, 1, 0)},
      {"all equal and noise", everywhere({1e3, 9e4}, 1, NOISE_Pa)},
      {"suction", everywhere({1e2, 9e4}, -1, NOISE_Pa)},
      {"suction, Gaussian",
       [](const reference::Array &array, Random &random) {
         Press press = noisy_inside(USUAL_SIGMA_mm, USUAL_P0_Pa)(array, random);
         for (double &p : press.pressure_Pa) {
           p = -p;
         }
         press.located = false;
         return press;
       }},
      {"nothing", everywhere({1, 1}, 0, 0)},
      {"noise only", everywhere({1, 1}, 0, NOISE_Pa)},
      {"noise ten times the expected", everywhere({1, 1}, 0, 10 * NOISE_Pa)},
      {"noise a thousand times the expected", everywhere({1, 1}, 0, 1000 * NOISE_Pa)},
      {"checkerboard", checkerboard},
      {"offset +500 Pa on all", with_offset(500, false)},
      {"offset -500 Pa on all", with_offset(-500, false)},
      {"offset +500 Pa on one", with_offset(500, true)},
      {"outlier +10 kPa", with_offset(1e4, true)},
      {"outlier -10 kPa", with_offset(-1e4, true)},
      {"gains within 10 %", with_gain_spread(0.1)},
      {"readings in steps of 20 Pa", in_steps},
      {"a few units of 1/1024 Pa", few_units},
      {"p0 1 Pa", noisy_inside(USUAL_SIGMA_mm, {1, 1})},
      {"p0 5 noise", noisy_inside(USUAL_SIGMA_mm, {5 * NOISE_Pa, 5 * NOISE_Pa})},
      {"p0 10 noise", noisy_inside(USUAL_SIGMA_mm, {10 * NOISE_Pa, 10 * NOISE_Pa})},
      {"p0 20 noise", noisy_inside(USUAL_SIGMA_mm, {20 * NOISE_Pa, 20 * NOISE_Pa})},
      {"p0 50 noise", noisy_inside(USUAL_SIGMA_mm, {50 * NOISE_Pa, 50 * NOISE_Pa})},
      {"p0 1.5 MPa, no end of range", beyond_range({1.5e6, 1.5e6}, false)},
      {"p0 10 MPa, masked beyond 2 bar", beyond_range({1e7, 1e7}, true)},
      {"p0 100..400 kPa, masked beyond 2 bar", beyond_range({1e5, 4e5}, true)},
      {"p0 0.4..10 MPa, masked beyond 2 bar", beyond_range({4e5, 1e7}, true)},
      {"dead sensor", with_dead(14, false)},
      {"dead peak sensor", with_dead(14, true)},
      {"8 sensors left", with_dead(8, false)},
      {"5 sensors left", with_dead(5, false)},
      {"4 sensors left", with_dead(4, false)},
      {"3 sensors left", with_dead(3, false)},
      {"1 sensor left", with_dead(1, false)},
      {"two sensors in each place", noisy_inside(USUAL_SIGMA_mm, USUAL_P0_Pa), true},
      {"two contacts 0..9 mm apart", two_contacts({0, 9})},
      {"two contacts 9..18 mm apart", two_contacts({9, 18})},
      {"two contacts 18..36 mm apart", two_contacts({18, 36})},
      {"layer 12 mm", from_set(reference::PressSet::C, 0)},
      {"layer 6 mm", from_set(reference::PressSet::D, 0)},
      {"layer 6 mm, prior 3.2", from_set(reference::PressSet::D, 3.2)},
      {"layer 6 mm, prior 3.8", from_set(reference::PressSet::D, 3.8), false, BAD_UNFLAGGED_MAX_WRONG_PRIOR},
  };
}

std::int32_t saturated_q10(double pressure_Pa) {
  return static_cast<std::int32_t>(std::clamp(std::round(1024.0 * pressure_Pa), -2147483648.0, 2147483647.0));
}

struct Chain {
  fit_array array;
  condition tared; // after a tare in air

  explicit Chain(const reference::Array &geometry) {
    std::vector<float> x_mm(geometry.x_mm.begin(), geometry.x_mm.end());
    std::vector<float> y_mm(geometry.y_mm.begin(), geometry.y_mm.end());
    if (fit_array_init(&array, static_cast<std::uint8_t>(x_mm.size()), x_mm.data(), y_mm.data(),
                       static_cast<float>(geometry.pitch_mm)) != FT_OK) {
      throw std::runtime_error("fit_array_init refuses the geometry");
    }
    condition_start(&tared);
    frame quiet = frame_of({std::vector<double>(x_mm.size(), 0.0)});
    conditioned ignored;
    for (int i = 0; i < ZERO_TARE_FRAMES; i++) {
      condition_frame(&tared, &quiet, nullptr, &ignored);
      condition_follow(&tared, &quiet, &ignored);
    }
  }

  static frame frame_of(const Press &press) {
    frame made{};
    made.sensor_count = static_cast<std::uint8_t>(press.pressure_Pa.size());
    made.noise_Pa_q10 = std::max(1, saturated_q10(press.noise_Pa));
    for (std::size_t k = 0; k < press.pressure_Pa.size(); k++) {
      const auto bit = std::uint32_t{1} << k;
      if (press.dead & bit) {
        continue;
      }
      made.valid |= bit;
      made.pressure_Pa_q10[k] = saturated_q10(ATMOSPHERE_Pa + press.pressure_Pa[k]);
      if (press.limited_range && made.pressure_Pa_q10[k] > MS58XX_MAX_PRESSURE_Pa * 1024) {
        made.saturated |= bit;
      }
    }
    return made;
  }

  // As the main loop of the firmware does it.
  Result operator()(const Press &press) const {
    condition state = tared;
    const frame taken = frame_of(press);
    conditioned readings;
    condition_frame(&state, &taken, nullptr, &readings);
    condition_follow(&state, &taken, &readings);
    fit_settings settings{};
    settings.iterations = DEFAULT_FIT_ITERATIONS;
    settings.cut_noises = DEFAULT_CUT_NOISES;
    settings.noise_Pa_q10 = taken.noise_Pa_q10;
    settings.prior_sigma_mm = static_cast<float>(press.prior_sigma_mm);
    settings.prior_width_mm = press.prior_sigma_mm > 0.0 ? 0.5f : 0.0f;
    fit_set_errors(&settings, press.gain_sd, DEFAULT_MODEL_SD);
    fit_result fit{};
    if (readings.contact) {
      fit_gaussian(&array, readings.pressure_Pa_q10, readings.usable, &settings, &fit);
    }
    contact_input input{};
    input.contact = readings.contact;
    input.tared = readings.tared;
    input.masked = readings.usable != UINT32_MAX >> (FT_MAX_SENSORS - taken.sensor_count);
    input.saturated = taken.saturated;
    input.fit = readings.contact ? &fit : nullptr;
    slip_history history{};
    const contact_settings slip{DEFAULT_SLIP_THRESHOLD_mm, DEFAULT_SLIP_WINDOW_ms * 1000u, 1.0f, 0.0f};
    contact_result said;
    contact_update(&history, &slip, &input, &said);

    Result result{NOT_A_NUMBER, said.flags, press.located, true};
    for (float value :
         {fit.x_mm, fit.y_mm, fit.p0_Pa, fit.sigma_mm, fit.force_N, fit.residual_rms_Pa, fit.location_sd_mm,
          fit.location_noise_mm, fit.force_sd_N, fit.sigma_x_mm, fit.sigma_y_mm, fit.width_correlation}) {
      result.finite = result.finite && std::isfinite(value);
    }
    if ((said.flags & CONTACT_FLAG_FIT_VALID) && press.located) {
      result.error_mm =
          std::hypot(static_cast<double>(fit.x_mm) - press.x_mm, static_cast<double>(fit.y_mm) - press.y_mm);
    }
    return result;
  }
};

// The first seven places of the array twice.
reference::Array doubled(const reference::Array &array) {
  reference::Array made{array.pitch_mm, {}, {}};
  for (std::size_t k = 0; k < 7; k++) {
    for (int copy = 0; copy < 2; copy++) {
      made.x_mm.push_back(array.x_mm[k]);
      made.y_mm.push_back(array.y_mm[k]);
    }
  }
  return made;
}

double quantile(const std::vector<double> &sorted, double share) {
  return sorted.empty() ? NOT_A_NUMBER
                        : sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
}

Row summarise(const std::string &name, const std::vector<Result> &results) {
  Row row;
  row.name = name;
  row.presses = results.size();
  const auto presses = static_cast<double>(results.size());
  std::vector<double> errors_mm;
  for (const Result &result : results) {
    const bool fitted = (result.flags & CONTACT_FLAG_FIT_VALID) != 0;
    const bool warned = !fitted || (result.flags & WARNINGS);
    const bool bad = fitted && !(result.error_mm <= BAD_mm);
    row.fits += fitted;
    row.not_finite += !result.finite;
    row.bad_unflagged += (bad && !warned) / presses;
    row.good_flagged += (fitted && !bad && warned) / presses;
    for (std::size_t i = 0; i < FLAG_COUNT; i++) {
      row.share[i] += ((result.flags & FLAGS[i].bit) != 0) / presses;
    }
    if (std::isfinite(result.error_mm)) {
      errors_mm.push_back(result.error_mm);
    }
  }
  std::sort(errors_mm.begin(), errors_mm.end());
  row.p50_mm = quantile(errors_mm, 0.5);
  row.p95_mm = quantile(errors_mm, 0.95);
  row.worst_mm = quantile(errors_mm, 1.0);
  return row;
}

void print(const Row &row) {
  std::printf("%-38s %9.4f %9.4f %9.3f", row.name.c_str(), row.p50_mm, row.p95_mm, row.worst_mm);
  for (double share : row.share) {
    std::printf(" %5.1f", 100.0 * share);
  }
  std::printf("  %7.3f %7.3f%s\n", 100.0 * row.bad_unflagged, 100.0 * row.good_flagged,
              row.not_finite ? "  NOT FINITE" : "");
  std::fflush(stdout);
}

void print_header() {
  std::printf("%-38s %9s %9s %9s", "case", "p50_mm", "p95_mm", "worst_mm");
  for (const Flag &flag : FLAGS) {
    std::printf(" %5.5s", flag.name);
  }
  std::printf("  %7s %7s\n", "bad!fl%", "good&f%");
}

void write_json(const std::string &path, const std::vector<Row> &rows, std::uint64_t seed) {
  double worst = 0;
  auto cases = nlohmann::ordered_json::array();
  for (const Row &r : rows) {
    worst = std::max(worst, r.bad_unflagged_max > BAD_UNFLAGGED_MAX ? 0.0 : r.bad_unflagged);
    nlohmann::ordered_json row{
        {"case", r.name},     {"presses", r.presses}, {"fits", r.fits},        {"not_finite", r.not_finite},
        {"p50_mm", r.p50_mm}, {"p95_mm", r.p95_mm},   {"worst_mm", r.worst_mm}};
    for (std::size_t i = 0; i < FLAG_COUNT; i++) {
      row[FLAGS[i].name] = r.share[i];
    }
    row["bad_unflagged"] = r.bad_unflagged;
    row["good_flagged"] = r.good_flagged;
    cases.push_back(std::move(row));
  }
  fingertip::fitting::write_json(path, {{"seed", seed}, {"bad_unflagged_worst", worst}, {"cases", std::move(cases)}});
}

struct Options {
  std::string name, out = FINGERTIP_REPORT_DIR;
  std::uint64_t limit = 8000, seed = 20221015;
  bool check = false;
};

int run(const Options &options) {
  if (options.limit == 0) {
    throw std::runtime_error("--limit needs at least one press");
  }
  const reference::Array plain = reference::firmware_array();
  const reference::Array twice = doubled(plain);
  const Chain chain(plain), twice_chain(twice);
  std::vector<Row> rows;
  print_header();
  for (const Case &c : all_cases()) {
    if (std::string(c.name).find(options.name) == std::string::npos) {
      continue;
    }
    // The name seeds the presses, so that a case of its own draws what it draws among the others.
    std::uint64_t stream = 0;
    for (const char *letter = c.name; *letter; letter++) {
      stream = stream * 131 + static_cast<unsigned char>(*letter);
    }
    std::vector<Result> results(options.limit);
    fingertip::twin::in_parallel(options.limit, [&](std::size_t i) {
      Random random(options.seed, stream, i);
      results[i] = c.duplicates ? twice_chain(c.draw(twice, random)) : chain(c.draw(plain, random));
    });
    rows.push_back(summarise(c.name, results));
    rows.back().bad_unflagged_max = c.bad_unflagged_max;
    print(rows.back());
  }
  if (rows.empty()) {
    throw std::runtime_error("no case is named '" + options.name + "'");
  }
  std::filesystem::create_directories(options.out);
  write_json(options.out + "/stiff.json", rows, options.seed);
  int failed = 0;
  for (const Row &row : rows) {
    if (row.not_finite > 0) {
      std::printf("%s: %zu results are not finite\n", row.name.c_str(), row.not_finite);
      failed = 1;
    }
    if (row.bad_unflagged > row.bad_unflagged_max) {
      std::printf("%s: %.2f %% are bad and carry no warning, at most %.1f %% may\n", row.name.c_str(),
                  100.0 * row.bad_unflagged, 100.0 * row.bad_unflagged_max);
      failed = 1;
    }
  }
  return options.check ? failed : 0;
}

} // namespace

int main(int argc, char **argv) {
  try {
    Options options;
    reference::parse_options(argc, argv,
                             {{"--case", &options.name},
                              {"--out", &options.out},
                              {"--limit", nullptr, &options.limit},
                              {"--seed", nullptr, &options.seed},
                              {"--check", nullptr, nullptr, &options.check}},
                             HELP);
    return run(options);
  } catch (const std::exception &error) {
    std::fprintf(stderr, "fit_stiff: %s\n", error.what());
    return 1;
  }
}
