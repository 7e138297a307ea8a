// The fit's reference: the same model and the same parameters in double precision, by Ceres.
//
// Minimises sum_k (p0 exp(-((x_k - x)^2 + (y_k - y)^2) / (2 sigma^2)) - p_k)^2 (De Clercq et al., RA-L 2022, eq. (2) and (3)) in a box,
// from many starts, and keeps the lowest cost: in ill-conditioned corners a single start stops early.
//
// Ceres' starts are rationed. A bounded Levenberg-Marquardt of our own runs from every start. Ceres (at most 300 iterations) runs on every
// press from the lowest cost so found and, independently, from the strongest sensor at middle width. Where the two costs differ or the
// condition number is above 1e5, and the bound of the location's sd is below 2 mm, it also runs from every distinct place where our own
// starts ended within four times the lowest cost. Newton steps with the full Hessian bring the lowest cost to rounding. The test
// accuracy.reference compares with Ceres from every start.
#pragma once

#include <cstdint>
#include <vector>

namespace fingertip::reference {

struct Array {
  double pitch_mm;
  std::vector<double> x_mm, y_mm; // [sensor]
};

struct Parameters {
  double p0_Pa, x_mm, y_mm, sigma_mm;
};

// Limits of the fit, those of the firmware: the array and 1.5 pitches around it, sigma 0.158 to 5 pitches.
struct Fit {
  double p0_Pa, x_mm, y_mm, sigma_mm;
  double cost;             // half the sum of squared residuals, Pa^2
  double force_N;          // 2 pi p0 sigma^2
  double location_sd_mm;   // Cramer-Rao bound of the radial location error there for noise_Pa
  double condition_number; // of the scaled J^T J there
  bool at_bound;
  // The readings determine the location, away from the limits: the bound is below 0.5 mm and the normal matrix can be
  // inverted in double precision.
  bool observable;
};

// pressure_Pa[sensor]; usable: bitmap of the sensors to use, at least four, one of them positive. start: a first guess beside the built-in
// ones (every sensor among the four strongest, at three widths), or nullptr. all_starts: Ceres from every start, always.
Fit fit(const Array &array, const double *pressure_Pa, std::uint64_t usable, double noise_Pa, const Parameters *start, bool all_starts);

} // namespace fingertip::reference
