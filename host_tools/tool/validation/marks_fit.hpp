/* What the presses at known places say of the sensors: where each one is, how much and how widely
 * it feels, and how far the readings leave this picture. Nothing is assumed of the sensors' places
 * at first, so two swapped wires, a sensor that feels nothing and one that sits loose show as what
 * they are.
 *
 * Press i is at c_i, near its mark; sensor k is at s_k. With R = |c_i - s_k|^2, c = NARROW of
 * calibration/solver.hpp and B = DIP_PITCHES pitches,
 *
 *   reading = g_k A exp(e_i) [(1 - m) exp(-R / 2 S^2) + m exp(-R / 2 c^2 S^2) - h exp(-R / 2 B^2)]
 *   S = S0 exp(b_k + w_x X_i + w_y Y_i),   X, Y: the mark's place, from -1 to 1 over the marks
 *
 * Unknowns are A, S0, m, h, the slopes w, per sensor g, s, b, per press c and e. Marks are known up
 * to the hand's error, whose sd is learnt from the presses. Robust least squares (Huber) by
 * Levenberg-Marquardt. Some 0.2 s for 46 presses of fifteen sensors. Same input, same bits.
 *
 * Twice. First nothing is assumed of the sensors' places. The print lies on the pad shifted and
 * turned by a little: where it lies follows from where the sensors are found, against the layout;
 * sensors that are found elsewhere do not count in it. Then each sensor sits at the place that it
 * was found nearest to, but for a tenth of a millimetre. So it is the readings of all sensors that
 * say where each press was, better than the hand hits a mark, and whatever their gains are: the
 * pad's own estimates are judged against that. What this cannot see is a shift that all sensors
 * have in common against the board's drawing.
 */
#pragma once

#include "tool/validation/gather.hpp"

#include <vector>

namespace fingertip::validating {

struct FoundSensor {
  bool answers = false;          /* it was measured in most presses */
  double gain = 0.0;             /* of the mean of those that feel; near 0: it feels nothing */
  double x_mm = 0.0, y_mm = 0.0; /* where it is found, in the layout's axes */
  double off_mm = 0.0;           /* from its place in the layout */
  std::size_t place = 0;         /* whose place in the layout it has: its own, unless it is found
                                    further from it than SWAPPED_PITCHES and nearer to another */
  double residual_share = 0.0;   /* rms of what the picture leaves, of its own readings that are at
                                    least FELT_SHARE of the strongest */
  double scatter_share = 0.0;    /* of the same readings over the expected ones, sd among the presses
                                    of one mark: what the picture itself is off by is not in it, nor
                                    what is not known of where and how hard each press was */
  std::size_t felt = 0;          /* presses in which it was expected to read at least that */
};

struct FoundPress {
  double x_mm = 0.0, y_mm = 0.0, sd_mm = 0.0; /* where it was, in the layout's axes; sd each way */
  double mark_x_mm = 0.0, mark_y_mm = 0.0;    /* its mark in those axes */
  double force = 0.0;                         /* log of its force over the common one */
};

struct MarksFit {
  bool solved = false; /* else too few presses at too few marks */
  std::vector<FoundSensor> sensors;
  std::vector<FoundPress> presses;     /* as measured */
  double hand_sd_mm = 0.0;             /* of a press from its mark, each way */
  double width_mm = 0.0;               /* S0 */
  double peak_Pa = 0.0;                /* A */
  double slope_x = 0.0, slope_y = 0.0; /* w: the width grows by this share from middle to end */
  double slope_x_sd = 0.0, slope_y_sd = 0.0;
  double shift_x_mm = 0.0, shift_y_mm = 0.0, turn_rad = 0.0; /* of the print on the pad */
};

constexpr double FELT_SHARE = 0.2;
/* A sensor that is left out is loose if its scatter_share is more: up to 0.025 where it is not loose,
 * with a dead neighbour too, 0.069 at least where it is (seeds as assess.hpp has them). */
constexpr double LOOSE_SCATTER = 0.04;
constexpr double FEELS_NOTHING = 0.2; /* less gain than this counts in no mean */
constexpr double SWAPPED_PITCHES = 0.5;
constexpr std::size_t MARKS_MIN = 6;

/* without: bitmap of sensors whose readings teach nothing; their gain and their residual are
 * against what the others teach. */
MarksFit fit_marks(const Measured &measured, std::uint32_t without = 0);

} // namespace fingertip::validating
