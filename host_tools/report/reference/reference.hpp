// The fit's reference: the same model and the same parameters in double precision, by Ceres.
//
// Minimises sum_k (p0 exp(-((x_k - x)^2 + (y_k - y)^2) / (2 sigma^2)) - p_k)^2 (De Clercq et al.,
// RA-L 2022, eq. (2) and (3)) in a box, from many starts, and keeps the lowest cost: in
// ill-conditioned corners a single start stops early.
//
// Ceres needs 0.1 to 0.3 ms a start, so its starts are rationed:
// - A bounded Levenberg-Marquardt of our own runs from every start.
// - Ceres (at most 300 iterations) runs on every press from the lowest cost so found and,
//   independently, from the strongest sensor at middle width.
// - Where the two costs differ or the condition number is above 1e5, Ceres also runs on from every
//   distinct place where our own starts ended within four times the lowest cost. Not where the
//   bound of the location's sd is above 2 mm: there the optimum has no use.
// The record is Ceres' lowest cost, brought to rounding by Newton steps with the full Hessian; a
// step that would leave the valley (cost up by more than rounding) is not taken. Against Ceres from
// every start, on 10 810 observable presses of all sets and masks, the cost was never higher and
// once lower; the test accuracy.reference repeats that on fewer.
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

// Limits of the fit, those of the firmware: the array and 1.5 pitches around it, sigma 0.158 to 5
// pitches.
struct Fit {
  Parameters theta;
  double cost;             // half the sum of squared residuals, Pa^2
  double force_N;          // 2 pi p0 sigma^2
  double location_sd_mm;   // Cramer-Rao bound of the radial location error at theta for noise_Pa
  double condition_number; // of the scaled J^T J at theta
  bool at_bound;
};

// Whether the readings determine the location: the bound is below 0.5 mm and the normal matrix can
// be inverted in double precision.
bool observable(const Fit &fit);

enum class Starts {
  rationed, // as above
  all,      // Ceres from every start, always
};

// pressure_Pa[sensor]; usable: bitmap of the sensors to use, at least four, one of them positive.
// starts: first guesses beside the built-in ones (every sensor among the four strongest, at three
// widths).
Fit fit(const Array &array, const std::vector<double> &pressure_Pa, std::uint32_t usable, double noise_Pa,
        const std::vector<Parameters> &starts = {}, Starts effort = Starts::rationed);

} // namespace fingertip::reference
