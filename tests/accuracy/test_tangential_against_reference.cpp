// The on-chip tangential estimate against the optimum of its own definition in double precision (reference/tangential.hpp), on presses of a
// layer of 12 mm with noise, gain errors and pulls of up to 0.3 of the force that the array can resolve: optimiser against optimiser. C's
// function and struct of one name are a shadow to C++.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wshadow"
extern "C" {
#include "config/geometry.h"
#include "fit/fit_tangential.h"
}
#pragma GCC diagnostic pop
#include "report/reference/tangential.hpp"
#include "support/pad.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <random>
#include <vector>

namespace reference = fingertip::reference;

// A standard deviation of more than this share of the force is no observation of the pull.
constexpr double OBSERVABLE = 0.1;
constexpr int PRESSES = 2000;
// Limits: location in um, force and pull in shares of the force.
constexpr double MEDIAN_um = 0.15, P99_um = 1.5, PULL_P99 = 0.0003, FORCE_P99 = 0.0003;
constexpr int MOST_ELSEWHERE = PRESSES / 500;

static double quantile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

int main(int argc, char **argv) {
  const pad_profile profile = pad_of_12_mm();
  fit_array array;
  static fit_pad pad;
  if (fit_array_init(&array, geometry.sensor_count, geometry.x_mm, geometry.y_mm, geometry.pitch_mm) != FT_OK ||
      fit_pad_init(&pad, &array, &profile) != FT_OK) {
    std::puts("the geometry or the pad is refused");
    return 1;
  }
  std::mt19937_64 random(20240611);
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
  const auto all = (std::uint32_t{1} << geometry.sensor_count) - 1;
  std::vector<double> um, force, pull;
  int invalid = 0, not_observable = 0;
  for (int i = 0; i < PRESSES; i++) {
    const double x = uniform(-9, 9), y = uniform(-18, 18), N = std::exp(uniform(0, 2.3));
    const double ratio = 0.1 * (i % 4), angle = uniform(0, 2 * M_PI), spread = uniform(1, 8);
    const double noise_Pa = std::exp(uniform(0.7, 2.3)), gain_sd = i % 2 ? 0.02 : 0.0;
    fit_settings settings{};
    settings.iterations = 4;
    fit_set_errors(&settings, static_cast<float>(gain_sd), 0.0065f);
    settings.noise_Pa_q10 = static_cast<std::int32_t>(noise_Pa * 1024);
    std::vector<std::int32_t> readings;
    std::vector<reference::TangentialSample> samples;
    for (std::size_t k = 0; k < geometry.sensor_count; k++) {
      reference::TangentialSample sample{static_cast<double>(geometry.x_mm[k]), static_cast<double>(geometry.y_mm[k]), 0.0,
                                         settings.gain_sd_q16[k] / 65536.0};
      const double dx = sample.x_mm - x, dy = sample.y_mm - y, r2 = dx * dx + dy * dy;
      double Pa = 0.0;
      for (const auto &term : profile.normal) {
        const double v = std::pow(static_cast<double>(term.sd_mm), 2) + spread;
        Pa += N * static_cast<double>(term.share) / v * std::exp(-r2 / (2 * v));
      }
      for (const auto &term : profile.tangential) {
        const double v = std::pow(static_cast<double>(term.sd_mm), 2) + 1.3 * spread;
        Pa += N * ratio * (std::cos(angle) * dx + std::sin(angle) * dy) * static_cast<double>(term.moment_mm) / (v * v) *
              std::exp(-r2 / (2 * v));
      }
      Pa *= 1e6 / (2 * M_PI) * (1 + gain_sd * std::normal_distribution<double>()(random));
      Pa += std::normal_distribution<double>(0, noise_Pa)(random);
      readings.push_back(static_cast<std::int32_t>(std::lround(1024 * Pa)));
      sample.pressure_Pa = readings.back() / 1024.0;
      samples.push_back(sample);
    }
    fit_result start;
    fit_gaussian(&array, readings.data(), all, &settings, &start);
    struct fit_tangential found;
    fit_tangential_state state{};
    for (int frame = 0; frame < FIT_TANGENTIAL_FRAMES; frame++) {
      fit_tangential_estimate(&array, &pad, readings.data(), &settings, &start, &state, &found);
    }
    const reference::TangentialFit best =
        reference::fit_tangential_estimate(profile, samples, noise_Pa,
                                           {static_cast<double>(start.x_mm), static_cast<double>(start.y_mm),
                                            static_cast<double>(start.sigma_mm), static_cast<double>(start.force_N)});
    if (best.q_sd_N > OBSERVABLE * best.force_N || best.at_bound || start.used != all) {
      not_observable++;
      continue;
    }
    if (!found.valid) {
      invalid++;
      continue;
    }
    um.push_back(1e3 * std::hypot(static_cast<double>(found.x_mm) - best.x_mm, static_cast<double>(found.y_mm) - best.y_mm));
    force.push_back(std::abs(static_cast<double>(found.force_N) / best.force_N - 1));
    pull.push_back(std::hypot(static_cast<double>(found.qx_N) - best.qx_N, static_cast<double>(found.qy_N) - best.qy_N) / best.force_N);
  }
  const auto elsewhere = std::count_if(um.begin(), um.end(), [](double value) { return value > 100; });
  std::printf("%zu presses, %d not observable, %d not valid, %d more than 100 um away\n", um.size(), not_observable, invalid,
              static_cast<int>(elsewhere));
  std::printf("um p50 %.3f p90 %.3f p99 %.3f max %.1f\n", quantile(um, 0.5), quantile(um, 0.9), quantile(um, 0.99), quantile(um, 1.0));
  std::printf("pull over force p50 %.6f p99 %.6f, force p99 %.6f\n", quantile(pull, 0.5), quantile(pull, 0.99), quantile(force, 0.99));
  if (argc > 1) { // for the report
    std::ofstream(argv[1]) << "{\"optimum_p99_um\": " << quantile(um, 0.99) << ", \"optimum_p99_ratio\": " << quantile(pull, 0.99) << "}\n";
  }
  const bool good = um.size() > PRESSES / 2 && invalid < PRESSES / 100 && elsewhere <= MOST_ELSEWHERE && quantile(um, 0.5) < MEDIAN_um &&
                    quantile(um, 0.99) < P99_um && quantile(pull, 0.99) < PULL_P99 && quantile(force, 0.99) < FORCE_P99;
  std::puts(good ? "pass" : "FAIL");
  return good ? 0 : 1;
}
