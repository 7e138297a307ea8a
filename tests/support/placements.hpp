/* Placements on a pad whose everything is known, for tests of the calibration. */
#pragma once

#include "libfingertip/random.hpp"
#include "tool/calibration/solver.hpp"

extern "C" {
#include "config/geometry.h"
}

#include <cmath>
#include <vector>

namespace test {

struct KnownPad {
  fingertip::calibrating::Array array;
  std::vector<double> gain; /* mean 1 */
  std::vector<double> x_mm, y_mm;
  std::vector<double> own_width; /* log: of a contact at each sensor, over the usual */

  double dip = 0.0, dip_mm = 20.0; /* of cast rubber: share of the peak, and how wide */

  explicit KnownPad(std::uint64_t seed, double spread = 0.1, double misplaced_mm = 0.0) {
    fingertip::Random random(seed, 1, 0);
    array.pitch_mm = static_cast<double>(geometry.pitch_mm);
    double mean = 0.0;
    for (std::size_t k = 0; k < geometry.sensor_count; k++) {
      array.x_mm.push_back(static_cast<double>(geometry.x_mm[k]));
      array.y_mm.push_back(static_cast<double>(geometry.y_mm[k]));
      x_mm.push_back(array.x_mm[k] + misplaced_mm * random.normal());
      y_mm.push_back(array.y_mm[k] + misplaced_mm * random.normal());
      gain.push_back(1.0 + spread * random.normal());
      own_width.push_back(0.0);
      mean += gain[k] / geometry.sensor_count;
    }
    for (double &each : gain) {
      each /= mean;
    }
  }

  struct Press {
    double x_mm, y_mm;
    double force = 1.0;             /* times the usual */
    double axes = 1.0, slant = 0.0; /* ratio of the axes, and the direction of the long one */
    double width_mm = 5.5;
    double slope = 0.0; /* tangential force along x over the normal one, as PULL has it */
  };
  static constexpr double PEAK_Pa = 14000.0;

  /* A heavy-shouldered bump, (1 + r^2 / (2 n s^2))^-n: not of the solver's own family. */
  double base_Pa(const Press &press, std::size_t k) const {
    constexpr double n = 12.0;
    const double width_mm = press.width_mm * std::exp(own_width[k]);
    const double u = x_mm[k] - press.x_mm, v = y_mm[k] - press.y_mm;
    const double c = std::cos(press.slant), s = std::sin(press.slant), root = std::sqrt(press.axes);
    const double a = (c * u + s * v) / root, b = (c * v - s * u) * root;
    const double square = a * a + b * b;
    double pulled = 0.0;
    for (const auto &[strength, ratio] : fingertip::calibrating::PULL) {
      pulled += press.slope * strength * u / width_mm * std::exp(-square / (2.0 * ratio * ratio * width_mm * width_mm));
    }
    return PEAK_Pa * press.force *
           (std::pow(1.0 + square / (2.0 * n * width_mm * width_mm), -n) + pulled - dip * std::exp(-square / (2.0 * dip_mm * dip_mm)));
  }

  fingertip::calibrating::Placement place(const Press &press, double t_s, fingertip::Random &random, double noise_Pa = 1.0) const {
    fingertip::calibrating::Placement placement;
    placement.t_s = t_s;
    placement.usable = (1u << array.sensors()) - 1u;
    placement.noise_Pa = noise_Pa;
    for (std::size_t k = 0; k < array.sensors(); k++) {
      placement.reading_Pa.push_back(gain[k] * base_Pa(press, k) + noise_Pa * random.normal());
    }
    return placement;
  }
};

/* Anywhere on the array, one weight, one every four seconds. */
inline std::vector<fingertip::calibrating::Placement> good_session(const KnownPad &pad, std::size_t count, std::uint64_t seed,
                                                                   double slope = 0.0) {
  fingertip::Random random(seed, 2, 0);
  std::vector<fingertip::calibrating::Placement> placements;
  for (std::size_t i = 0; i < count; i++) {
    const double x = random.uniform(pad.array.x_mm.front(), pad.array.x_mm.back());
    const double y = random.uniform(pad.array.y_mm.front(), pad.array.y_mm.back());
    KnownPad::Press press{x, y};
    press.slope = slope;
    placements.push_back(pad.place(press, 4.0 * static_cast<double>(i), random));
  }
  return placements;
}

} // namespace test
