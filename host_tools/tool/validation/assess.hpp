/* The figures of a pad's report card, and what is wrong with the pad or with the validation, from
 * what was measured.
 *
 * Findings follow from residuals against the profile that the presses themselves teach
 * (marks_fit.hpp), not from names of faults. Each bound below lies between what healthy and faulty
 * pads of the twin show (host_tools/report/newcomer, chosen on seeds 1 to 12, 101 to 124, 201 to
 * 206 and 501 to 512, judged on others). No real pad has been validated yet.
 */
#pragma once

#include "tool/calibration/judge.hpp"
#include "tool/validation/marks_fit.hpp"
#include "tool/validation/pull_figures.hpp"

#include <string>
#include <vector>

namespace fingertip::validating {

constexpr double ANSWERS_MIN = 0.5;      /* share of frames; less: the sensor is dead */
constexpr double ANSWERS_STEADY = 0.995; /* less: it is loose */
constexpr double FEELS_MIN = 0.3;        /* of the mean gain; less: it feels nothing */
/* Of the sensor whose residual is largest, rms against the profile. More: some sensor is odd. Up to
 * 0.007 on pads without a loose sensor, 0.011 at least on those with one. */
constexpr double ODD_RESIDUAL = 0.008;
/* How many times smaller the largest residual is once the loose sensors teach nothing. Up to 1.9
 * where there is none, 3.3 at least where there is one. */
constexpr double FITS_BETTER = 2.5;
/* So few presses reach a sensor at a corner that the fit may move them so that they follow it. Then
 * nothing is odd, and it is left out to see. */
constexpr std::size_t FELT_FEW = 8;
constexpr double NOISY_OVER_MEDIAN = 4.0; /* noise */
constexpr double TILT_MIN = 0.04;         /* the width's change from the middle to an end */
constexpr double TILT_SDS = 4.0;
constexpr double THIN_SHARE = 0.85;       /* of the thickness that the user states */
constexpr double DRIFT_MAX_Pa_min = 40.0; /* a sensor against the median of all */
/* What an uncalibrated pad reads of the force: the twin's, with the relaxation and the dip of real
 * ones. */
constexpr double READS_OF_FORCE = 0.87;
constexpr double WEIGHT_OFF_MAX = 0.22; /* force by the readings, over the weight, less 1 */

struct Finding {
  std::string code;                 /* dead_sensor, loose_sensor, swapped_wires, tilted_skin, thin_skin, drift,
                                       wrong_weight */
  std::vector<std::size_t> sensors; /* which; empty: the pad as a whole */
  std::string text;                 /* with the evidence, and what to do: two sentences */
};

struct Location {    /* of a press */
  double off_mm;     /* estimate from where it was pressed, the hand's error taken out */
  double x_mm, y_mm; /* the same, each way */
};

struct Card {
  Measured measured;
  MarksFit fit;
  calibrating::Judgement judgement;  /* of a calibration from these presses */
  std::vector<double> gain, gain_sd; /* [sensor] by its number; 0: none */
  std::vector<Location> locations;   /* as measured.presses; without an estimate off_mm is -1 */
  bool is_calibrated = false;        /* the fingertip, while it was validated */
  std::vector<Figure> figures;
  std::string pull_note; /* pull_figures.hpp */
  std::vector<Finding> findings;
  const Figure *figure(const std::string &key) const;
};

/* Throws Error where the recording holds no validation, or too little of one. name: of it. */
Card assess(Measured measured, const std::string &name);

} // namespace fingertip::validating
