#include "truth/gate/strip.hpp"

#include "libfingertip/random.hpp"
#include "libfingertip/text.hpp"

extern "C" {
#include "common/contact_flags.h"
#include "condition/condition.h"
#include "config/defaults.h"
}

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <optional>
#include <stdexcept>

namespace fingertip::truth {
namespace {

constexpr double NOT_A_NUMBER = std::numeric_limits<double>::quiet_NaN();
constexpr double STEPS_PER_mm = 1000.0;
constexpr double PRESSURE_LEAST_Pa = 30e3, PRESSURE_MOST_Pa = 400e3;
constexpr double PITCH_mm = 6.0;
constexpr double NOISE_Pa = 6.0; // of the recordings themselves

// The touching rule. Depths are shares of the recording's deepest, or of the hold's.
constexpr double DEEPEST = 0.98, FREE_DEPTH = 0.45, OUT_DEPTH = 0.3, RETURN_DEPTH = 0.5;
constexpr double HOLD_LEAST_s = 0.2, ZERO_s = 1.0, AFTER_LEAVING_s = 0.3, ABOVE_TOUCH = 0.97;
constexpr std::ptrdiff_t ZERO_ROWS = 5, PEAK_ROWS = 3;
constexpr double PEAK_LEAST_Pa = 3000.0, FELT = 0.03;

constexpr double JUDGED_FROM_s = 4.0, GAP_MAX_s = 0.3;
constexpr double LOCATED_LEAST_Pa = 500.0;
constexpr double FEELS_Pa = 3000.0;   // somewhere in the recording, or the sensor counts as dead
constexpr double RESPONSE_FROM = 0.3; // of its most: below, lobes and zeros tell more
constexpr double AHEAD_mm = 1.0;      // a sensor so far past the last press is felt from both sides
constexpr double WIDTHS_mm[] = {0.1, 0.25, 0.35, 0.5, 1.0, 2.0};

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  return values.size() % 2 != 0 ? values[half] : 0.5 * (values[half - 1] + values[half]);
}

bool read_row(const std::string &line, StripRow &row) {
  std::vector<double> values;
  for (const std::string_view cell : split(line, ',')) {
    const auto value = to_double(trim(cell));
    if (!value || !std::isfinite(*value)) {
      return false;
    }
    values.push_back(*value);
  }
  if (values.size() != STRIP_SENSORS + 3) {
    return false;
  }
  std::copy_n(values.begin(), STRIP_SENSORS, row.pressure_Pa.begin());
  row.x_mm = values[4] / STEPS_PER_mm;
  row.depth_steps = values[5];
  row.t_s = values[6];
  return std::all_of(row.pressure_Pa.begin(), row.pressure_Pa.end(), [](double pressure_Pa) {
    return pressure_Pa > PRESSURE_LEAST_Pa && pressure_Pa < PRESSURE_MOST_Pa;
  });
}

double deepest_of(const std::vector<StripRow> &rows) {
  double deepest = -HUGE_VAL;
  for (const StripRow &row : rows) {
    deepest = std::max(deepest, row.depth_steps);
  }
  return deepest;
}

// Rows of one depth near the deepest, for long enough.
std::vector<std::pair<std::size_t, std::size_t>> plateaus(const std::vector<StripRow> &rows, double deepest) {
  std::vector<std::pair<std::size_t, std::size_t>> found;
  for (std::size_t first = 0; first < rows.size(); first++) {
    const double depth = rows[first].depth_steps;
    if (deepest <= 0.0 || depth < DEEPEST * deepest) {
      continue;
    }
    std::size_t last = first;
    while (last + 1 < rows.size() && rows[last + 1].depth_steps == depth) {
      last++;
    }
    if (rows[last].t_s - rows[first].t_s >= HOLD_LEAST_s) {
      found.emplace_back(first, last);
    }
    first = last;
  }
  return found;
}

// Whether a plateau is a hold that something felt; if so, what follows it is free from when the
// stage has gone up past where the strongest sensor first felt it.
bool judge_hold(Strip &strip, std::size_t first, std::size_t last) {
  const std::vector<StripRow> &rows = strip.rows;
  const double depth = rows[first].depth_steps;
  std::size_t down = first, out = last;
  while (down > 0 && rows[down - 1].depth_steps >= OUT_DEPTH * depth) {
    down--;
  }
  while (out < rows.size() && rows[out].depth_steps >= OUT_DEPTH * depth) {
    out++;
  }
  if (down == 0 || out == rows.size()) {
    return false;
  }
  down--; // the last row above, before the hold
  std::size_t again = out;
  while (again + 1 < rows.size() && rows[again + 1].depth_steps < RETURN_DEPTH * depth) {
    again++;
  }
  std::array<std::vector<double>, STRIP_SENSORS> quiet_Pa;
  for (const StripRow &row : rows) {
    if (row.t_s > rows[down].t_s - ZERO_s && row.t_s <= rows[down].t_s) {
      for (std::size_t k = 0; k < STRIP_SENSORS; k++) {
        quiet_Pa[k].push_back(row.pressure_Pa[k]);
      }
    }
  }
  if (quiet_Pa[0].size() < static_cast<std::size_t>(ZERO_ROWS)) {
    return false;
  }
  std::size_t strongest = 0;
  double peak_Pa = -HUGE_VAL, zero_Pa = 0.0;
  const auto at = static_cast<std::ptrdiff_t>(first);
  for (std::size_t k = 0; k < STRIP_SENSORS; k++) {
    const double zero_of_k_Pa = median(quiet_Pa[k]);
    for (std::ptrdiff_t i = std::max<std::ptrdiff_t>(at - PEAK_ROWS, 0);
         i <= at + PEAK_ROWS && i < static_cast<std::ptrdiff_t>(rows.size()); i++) {
      const double above_Pa = rows[static_cast<std::size_t>(i)].pressure_Pa[k] - zero_of_k_Pa;
      if (above_Pa > peak_Pa) {
        peak_Pa = above_Pa;
        strongest = k;
        zero_Pa = zero_of_k_Pa;
      }
    }
  }
  std::size_t touch = down;
  while (touch <= first && rows[touch].pressure_Pa[strongest] - zero_Pa <= FELT * peak_Pa) {
    touch++;
  }
  if (peak_Pa < PEAK_LEAST_Pa || touch > first) {
    return false;
  }
  const double touch_depth = rows[touch].depth_steps;
  std::size_t left = last;
  while (left < rows.size() && rows[left].depth_steps > touch_depth) {
    left++;
  }
  if (left == rows.size()) {
    return false;
  }
  for (std::size_t i = 0; i < rows.size(); i++) {
    if (rows[i].t_s >= rows[left].t_s + AFTER_LEAVING_s && rows[i].t_s < rows[again].t_s &&
        rows[i].depth_steps < ABOVE_TOUCH * touch_depth) {
      strip.is_free[i] = true;
    }
  }
  return true;
}

void find_touches(Strip &strip) {
  const double deepest = deepest_of(strip.rows);
  for (const StripRow &row : strip.rows) {
    strip.is_free.push_back(row.depth_steps < FREE_DEPTH * deepest);
  }
  for (const auto &[first, last] : plateaus(strip.rows, deepest)) {
    if (judge_hold(strip, first, last)) {
      strip.holds.emplace_back(first, last);
    }
  }
  for (const auto &[first, last] : strip.holds) {
    std::fill(strip.is_free.begin() + static_cast<std::ptrdiff_t>(first),
              strip.is_free.begin() + static_cast<std::ptrdiff_t>(last) + 1, false);
  }
}

frame frame_of(const std::array<double, STRIP_SENSORS> &pressure_Pa, double t_s, double noise_Pa) {
  frame made{};
  made.sensor_count = STRIP_SENSORS;
  made.noise_Pa_q10 = static_cast<std::int32_t>(1024.0 * noise_Pa);
  made.valid = (1u << STRIP_SENSORS) - 1;
  made.t_us = static_cast<std::uint64_t>(1e6 * (1.0 + t_s));
  for (std::size_t k = 0; k < STRIP_SENSORS; k++) {
    made.pressure_Pa_q10[k] = static_cast<std::int32_t>(std::lround(1024.0 * pressure_Pa[k]));
  }
  return made;
}

// A contact of which the place is asked.
struct Press {
  std::array<std::int32_t, STRIP_SENSORS> pressure_Pa_q10;
  std::uint32_t usable;
  double x_mm;  // of the stage
  bool is_full; // at the full depth
};

struct Presses {
  std::vector<Press> all; // between two sensors that feel
  double sigma_mm = NOT_A_NUMBER, sigma_of_even_mm = NOT_A_NUMBER, sigma_of_odd_mm = NOT_A_NUMBER;
};

// What a sensor feels of presses that move along the strip: log p is a parabola of x, about the
// sensor's place on the stage.
struct Response {
  double place_mm, sigma_mm;
};

std::optional<Response> response_of(const std::vector<Press> &presses, std::size_t k) {
  std::int32_t most = 0;
  for (const Press &press : presses) {
    most = std::max(most, press.pressure_Pa_q10[k]);
  }
  if (most < 1024 * FEELS_Pa) {
    return std::nullopt;
  }
  // Least squares of c0 + c1 x + c2 x^2, by Cramer's rule.
  double m[5] = {}, v[3] = {}, least_mm = HUGE_VAL, most_mm = -HUGE_VAL;
  for (const Press &press : presses) {
    if (!press.is_full || press.pressure_Pa_q10[k] < RESPONSE_FROM * most) {
      continue;
    }
    const double x = press.x_mm, y = std::log(press.pressure_Pa_q10[k]);
    least_mm = std::min(least_mm, x);
    most_mm = std::max(most_mm, x);
    double power = 1.0;
    for (int i = 0; i < 5; i++, power *= x) {
      m[i] += power;
      if (i < 3) {
        v[i] += power * y;
      }
    }
  }
  const auto determinant = [](const std::array<double, 9> &a) {
    return a[0] * (a[4] * a[8] - a[5] * a[7]) - a[1] * (a[3] * a[8] - a[5] * a[6]) + a[2] * (a[3] * a[7] - a[4] * a[6]);
  };
  const double whole = determinant({m[0], m[1], m[2], m[1], m[2], m[3], m[2], m[3], m[4]});
  const double c1 = determinant({m[0], v[0], m[2], m[1], v[1], m[3], m[2], v[2], m[4]}) / whole;
  const double c2 = determinant({m[0], m[1], v[0], m[1], m[2], v[1], m[2], m[3], v[2]}) / whole;
  const double place_mm = -0.5 * c1 / c2;
  if (!(c2 < 0.0) || place_mm < least_mm - AHEAD_mm || place_mm > most_mm + AHEAD_mm) {
    return std::nullopt;
  }
  return Response{place_mm, std::sqrt(-0.5 / c2)};
}

fit_array line() {
  float x_mm[STRIP_SENSORS], y_mm[STRIP_SENSORS] = {};
  for (std::size_t k = 0; k < STRIP_SENSORS; k++) {
    x_mm[k] = static_cast<float>(PITCH_mm * static_cast<double>(k));
  }
  fit_array array;
  if (fit_array_init(&array, STRIP_SENSORS, x_mm, y_mm, static_cast<float>(PITCH_mm)) != FT_OK) {
    throw std::runtime_error("fit_array_init refuses the strip");
  }
  return array;
}

fit_result fit(const Press &press, double prior_sigma_mm, double prior_width_mm) {
  static const fit_array array = line();
  fit_settings settings{};
  settings.iterations = DEFAULT_FIT_ITERATIONS;
  settings.cut_noises = DEFAULT_CUT_NOISES;
  settings.noise_Pa_q10 = static_cast<std::int32_t>(1024.0 * NOISE_Pa);
  settings.prior_sigma_mm = static_cast<float>(prior_sigma_mm);
  settings.prior_width_mm = static_cast<float>(prior_width_mm);
  fit_result result;
  fit_gaussian(&array, press.pressure_Pa_q10.data(), press.usable, &settings, &result);
  return result;
}

// Presses of every other millimetre of the stage.
bool is_odd(const Press &press) {
  return std::lround(press.x_mm) % 2 != 0;
}

std::vector<Press> half_of(const std::vector<Press> &presses, bool odd) {
  std::vector<Press> half;
  std::copy_if(presses.begin(), presses.end(), std::back_inserter(half),
               [&](const Press &press) { return is_odd(press) == odd; });
  return half;
}

// The median over the sensors; NaN where none is felt from both sides.
double sigma_of(const std::vector<Press> &presses) {
  std::vector<double> sigmas_mm;
  for (std::size_t k = 0; k < STRIP_SENSORS; k++) {
    if (const auto response = response_of(presses, k)) {
      sigmas_mm.push_back(response->sigma_mm);
    }
  }
  return sigmas_mm.empty() ? NOT_A_NUMBER : median(sigmas_mm);
}

Presses presses_of(const Strip &strip) {
  const double deepest = deepest_of(strip.rows);
  Presses found;
  condition state;
  condition_start(&state);
  for (const StripRow &row : strip.rows) {
    const frame taken = frame_of(row.pressure_Pa, row.t_s - strip.rows.front().t_s, NOISE_Pa);
    conditioned readings;
    condition_frame(&state, &taken, nullptr, &readings);
    condition_follow(&state, &taken, &readings);
    if (readings.contact && !readings.zero_doubtful && readings.peak_Pa_q10 >= 1024 * LOCATED_LEAST_Pa) {
      Press press{{}, readings.usable, row.x_mm, row.depth_steps >= DEEPEST * deepest};
      std::copy_n(readings.pressure_Pa_q10, STRIP_SENSORS, press.pressure_Pa_q10.begin());
      found.all.push_back(press);
    }
  }
  std::array<std::optional<Response>, STRIP_SENSORS> responses;
  for (std::size_t k = 0; k < STRIP_SENSORS; k++) {
    responses[k] = response_of(found.all, k);
  }
  found.sigma_mm = sigma_of(found.all);
  found.sigma_of_even_mm = sigma_of(half_of(found.all, false));
  found.sigma_of_odd_mm = sigma_of(half_of(found.all, true));
  const auto is_outside = [&](const Press &press) {
    for (std::size_t k = 0; k + 1 < STRIP_SENSORS; k++) {
      if (responses[k] && responses[k + 1] && press.x_mm >= responses[k]->place_mm &&
          press.x_mm <= responses[k + 1]->place_mm) {
        return false;
      }
    }
    return true;
  };
  found.all.erase(std::remove_if(found.all.begin(), found.all.end(), is_outside), found.all.end());
  return found;
}

struct Prior {
  double of_even_mm, of_odd_mm, width_mm; // sigma by the press
};

// By what the strip felt of the other presses.
Prior own_prior(const Presses &presses, double width_mm) {
  return {presses.sigma_of_odd_mm, presses.sigma_of_even_mm, width_mm};
}

double median_error_mm(const Presses &presses, const Prior &prior) {
  std::vector<double> errors_mm;
  for (const Press &press : presses.all) {
    const fit_result result = fit(press, is_odd(press) ? prior.of_odd_mm : prior.of_even_mm, prior.width_mm);
    if (result.flags & CONTACT_FLAG_FIT_VALID) {
      errors_mm.push_back(static_cast<double>(result.x_mm) - press.x_mm);
    }
  }
  if (errors_mm.empty()) {
    return NOT_A_NUMBER;
  }
  const double shift_mm = median(errors_mm);
  for (double &error : errors_mm) {
    error = std::abs(error - shift_mm);
  }
  return median(errors_mm);
}

double width_for_others(const std::vector<Presses> &all, std::size_t judged) {
  double best_mm = WIDTHS_mm[0], least = HUGE_VAL;
  for (const double width_mm : WIDTHS_mm) {
    double sum = 0.0;
    for (std::size_t i = 0; i < all.size(); i++) {
      if (i != judged && !all[i].all.empty()) {
        sum += median_error_mm(all[i], own_prior(all[i], width_mm));
      }
    }
    if (sum < least) {
      least = sum;
      best_mm = width_mm;
    }
  }
  return best_mm;
}

double sigma_of_others(const std::vector<Presses> &all, std::size_t judged) {
  double sum = 0.0;
  int count = 0;
  for (std::size_t i = 0; i < all.size(); i++) {
    if (i != judged && std::isfinite(all[i].sigma_mm)) {
      sum += all[i].sigma_mm;
      count++;
    }
  }
  return count > 0 ? sum / count : NOT_A_NUMBER;
}

} // namespace

std::vector<Strip> read_strips(const std::filesystem::path &folder) {
  std::vector<std::filesystem::path> paths;
  for (const auto &entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".csv") {
      paths.push_back(entry.path());
    }
  }
  std::sort(paths.begin(), paths.end());
  std::vector<Strip> strips;
  for (const auto &path : paths) {
    Strip strip;
    strip.name = path.filename().string();
    std::ifstream file(path);
    for (std::string line; std::getline(file, line);) {
      StripRow row;
      if (read_row(line, row)) {
        strip.rows.push_back(row);
      }
    }
    if (strip.rows.size() < 2) {
      throw std::runtime_error(path.string() + " has no rows of four pressures, x, z and time");
    }
    find_touches(strip);
    strips.push_back(std::move(strip));
  }
  return strips;
}

Touches gate_on(const Strip &strip, double frames_per_s, double noise_Pa) {
  const std::vector<StripRow> &rows = strip.rows;
  const double begin_s = rows.front().t_s;
  Random random(1, static_cast<std::uint64_t>(frames_per_s), 0);
  condition state;
  condition_start(&state);
  conditioned readings{};
  double t_s = begin_s, free_s = 0, phantom_s = 0, doubted_s = 0, run_s = 0;
  std::vector<double> in_hold_s(strip.holds.size()), certain_s(strip.holds.size());
  double doubted_in_hold_s = 0;
  std::size_t hold = 0;
  Touches touches;
  for (std::size_t i = 1; i < rows.size(); i++) {
    const StripRow &before = rows[i - 1], &after = rows[i];
    const double gap_s = after.t_s - before.t_s;
    for (; t_s <= after.t_s; t_s += 1.0 / frames_per_s) {
      const double share = gap_s > 0.0 ? std::clamp((t_s - before.t_s) / gap_s, 0.0, 1.0) : 0.0;
      std::array<double, STRIP_SENSORS> pressure_Pa;
      for (std::size_t k = 0; k < STRIP_SENSORS; k++) {
        pressure_Pa[k] =
            before.pressure_Pa[k] + share * (after.pressure_Pa[k] - before.pressure_Pa[k]) + noise_Pa * random.normal();
      }
      const frame taken = frame_of(pressure_Pa, t_s - begin_s, noise_Pa);
      condition_frame(&state, &taken, nullptr, &readings);
      condition_follow(&state, &taken, &readings);
    }
    const double step_s = std::clamp(gap_s, 0.0, GAP_MAX_s);
    const bool certain = readings.contact && !readings.zero_doubtful;
    if (strip.is_free[i] && after.t_s > JUDGED_FROM_s) {
      free_s += step_s;
      phantom_s += certain ? step_s : 0.0;
      doubted_s += readings.zero_doubtful ? step_s : 0.0;
      run_s = certain ? run_s + step_s : 0.0;
      touches.longest_s = std::max(touches.longest_s, run_s);
    }
    while (hold < strip.holds.size() && strip.holds[hold].second < i) {
      hold++;
    }
    if (hold < strip.holds.size() && strip.holds[hold].first <= i) {
      in_hold_s[hold] += step_s;
      certain_s[hold] += certain ? step_s : 0.0;
      doubted_in_hold_s += readings.contact && readings.zero_doubtful ? step_s : 0.0;
    }
  }
  double held_s = 0;
  for (std::size_t i = 0; i < in_hold_s.size(); i++) {
    held_s += in_hold_s[i];
    touches.holds_missed += certain_s[i] < 0.5 * in_hold_s[i] ? 1 : 0;
  }
  touches.phantom_percent = free_s > 0.0 ? 100.0 * phantom_s / free_s : 0.0;
  touches.doubted_percent = free_s > 0.0 ? 100.0 * doubted_s / free_s : 0.0;
  touches.doubted_in_hold_percent = held_s > 0.0 ? 100.0 * doubted_in_hold_s / held_s : 0.0;
  return touches;
}

std::vector<Located> locate(const std::vector<Strip> &strips) {
  std::vector<Presses> presses;
  for (const Strip &strip : strips) {
    presses.push_back(presses_of(strip));
  }
  std::vector<Located> found;
  for (std::size_t i = 0; i < strips.size(); i++) {
    Located one;
    one.name = strips[i].name;
    one.is_test = one.name.rfind("test_", 0) == 0;
    one.fits = presses[i].all.size();
    one.sigma_mm = presses[i].sigma_mm;
    if (one.fits > 0) {
      one.prior_width_mm = width_for_others(presses, i);
      one.median_mm = median_error_mm(presses[i], own_prior(presses[i], one.prior_width_mm));
      one.others_sigma_mm = sigma_of_others(presses, i);
      one.median_by_others_mm =
          median_error_mm(presses[i], {one.others_sigma_mm, one.others_sigma_mm, one.prior_width_mm});
      one.median_without_prior_mm = median_error_mm(presses[i], {0.0, 0.0, 0.0});
    }
    found.push_back(one);
  }
  return found;
}

} // namespace fingertip::truth
