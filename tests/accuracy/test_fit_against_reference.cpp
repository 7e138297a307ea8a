// The on-chip fit against the reference optimum on random presses that the array can resolve.
//
// Presses are ideal Gaussians plus noise, so that the optimum differs from the truth and the test
// compares optimiser with optimiser: half of them inside the array (set A: sigma 3 to 20 mm, peak
// 0.5 to 100 kPa, noise 2 to 20 Pa), half up to 6 mm outside its edge (set B).
extern "C" {
#include "config/geometry.h"
#include "fit/fit.h"
}
#include "common/contact_flags.h"
#include "report/reference/reference.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <vector>

namespace reference = fingertip::reference;

namespace {

struct Press {
  std::vector<double> pressure_Pa;
  std::vector<std::int32_t> pressure_Pa_q10;
  double noise_Pa;
};

Press random_press(std::mt19937_64 &random, const reference::Array &array, bool outside) {
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const auto log_uniform = [&](double low, double high) { return std::exp(uniform(std::log(low), std::log(high))); };
  double x = uniform(-9, 9);
  double y = uniform(-18, 18);
  if (outside) {
    do {
      x = uniform(-15, 15);
      y = uniform(-24, 24);
    } while (std::abs(x) <= 9 && std::abs(y) <= 18);
  }
  const double sigma = log_uniform(3, 20);
  const double p0 = log_uniform(500, 100000);
  Press press;
  press.noise_Pa = log_uniform(2, 20);
  std::normal_distribution<double> noise(0.0, press.noise_Pa);
  for (std::size_t k = 0; k < array.x_mm.size(); k++) {
    const double r2 = std::pow(array.x_mm[k] - x, 2) + std::pow(array.y_mm[k] - y, 2);
    const double p = p0 * std::exp(-r2 / (2 * sigma * sigma)) + noise(random);
    press.pressure_Pa_q10.push_back(static_cast<std::int32_t>(std::lround(p * 1024)));
    press.pressure_Pa.push_back(press.pressure_Pa_q10.back() / 1024.0);
  }
  return press;
}

double quantile(std::vector<double> &values, double share) {
  const auto index = static_cast<std::size_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(index), values.end());
  return values[index];
}

} // namespace

int main(int argc, char **argv) {
  const int wanted = argc > 1 ? std::atoi(argv[1]) : 10000;
  const auto iterations = static_cast<std::uint8_t>(argc > 2 ? std::atoi(argv[2]) : 7);
  reference::Array array;
  array.pitch_mm = static_cast<double>(geometry.pitch_mm);
  for (int k = 0; k < geometry.sensor_count; k++) {
    array.x_mm.push_back(static_cast<double>(geometry.x_mm[k]));
    array.y_mm.push_back(static_cast<double>(geometry.y_mm[k]));
  }
  fit_array chip_array;
  if (fit_array_init(&chip_array, geometry.sensor_count, geometry.x_mm, geometry.y_mm, geometry.pitch_mm) != FT_OK) {
    std::puts("the geometry is refused");
    return 1;
  }

  std::mt19937_64 random(20221015);
  std::vector<double> distance_um, force_error_ppm;
  int above_100um = 0, above_100um_unflagged = 0, flagged = 0, gated_out = 0;
  const auto all = (std::uint32_t{1} << geometry.sensor_count) - 1;
  for (int i = 0; static_cast<int>(distance_um.size()) < wanted; i++) {
    const Press press = random_press(random, array, i % 2 == 1);
    const auto peak = *std::max_element(press.pressure_Pa.begin(), press.pressure_Pa.end());
    if (peak < 20 * press.noise_Pa) {
      gated_out++;
      continue;
    }
    fit_settings settings{};
    settings.iterations = iterations;
    settings.noise_Pa_q10 = static_cast<std::int32_t>(press.noise_Pa * 1024);
    fit_result chip;
    fit_gaussian(&chip_array, press.pressure_Pa_q10.data(), all, &settings, &chip);
    const reference::Parameters start{static_cast<double>(chip.p0_Pa), static_cast<double>(chip.x_mm),
                                      static_cast<double>(chip.y_mm), static_cast<double>(chip.sigma_mm)};
    const reference::Fit best = reference::fit(array, press.pressure_Pa, all, press.noise_Pa, {start});
    if (!reference::observable(best) || best.at_bound) {
      gated_out++;
      continue;
    }
    const double um = 1e3 * std::hypot(static_cast<double>(chip.x_mm) - best.theta.x_mm,
                                       static_cast<double>(chip.y_mm) - best.theta.y_mm);
    distance_um.push_back(um);
    force_error_ppm.push_back(1e6 * std::abs(static_cast<double>(chip.force_N) / best.force_N - 1));
    const bool warned = (chip.flags & CONTACT_FLAG_UNCERTAIN) != 0;
    flagged += warned;
    above_100um += um > 100;
    above_100um_unflagged += um > 100 && !warned;
  }
  const double p50 = quantile(distance_um, 0.5), p99 = quantile(distance_um, 0.99);
  const double p999 = quantile(distance_um, 0.999), worst = quantile(distance_um, 1.0);
  std::printf("%d observable presses (%d not), %d iterations\n", wanted, gated_out, iterations);
  std::printf("distance to the reference, um: p50 %.3f  p99 %.3f  p99.9 %.3f  worst %.1f\n", p50, p99, p999, worst);
  std::printf("force against the reference, ppm: p50 %.2f  p99.9 %.1f\n", quantile(force_error_ppm, 0.5),
              quantile(force_error_ppm, 0.999));
  std::printf("above 100 um: %d, of these not flagged UNCERTAIN: %d; flagged in all: %d\n", above_100um,
              above_100um_unflagged, flagged);

  // float32 leaves about 0.15 um at p99.9 on these sets; the limits leave a factor of three.
  const bool good = p50 < 0.05 && p999 < 0.5 && above_100um * 10000 <= wanted * 3 && above_100um_unflagged == 0;
  std::puts(good ? "as close as float32 allows" : "FAILED: farther from the optimum than float32 explains");
  return good ? 0 : 1;
}
