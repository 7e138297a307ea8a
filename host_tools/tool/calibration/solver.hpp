/* Gains of the sensors from placements of one weight.
 *
 * The same weight on the same rounded foot is set down at places that are not measured. Then every placement presses with the same force
 * and, on a pad of one thickness, with the same profile; what differs between a reading and that profile at its distance is the sensor's.
 * With placement i at (x, y), its squared distance R from sensor k and c = NARROW,
 *
 *   reading = g_k A exp(e - 2 w) [(1 - m) exp(-R / 2 S^2) + m exp(-R / 2 c^2 S^2)
 *                                 - h exp(-R / 2 B^2 S^2) + (t1 u + t2 v) / S P(R / S^2)] + o_k - r_k M_k,
 *   S = s exp(w + b_k),   R = u^2 + v^2 - 2 q1 (u^2 - v^2) - 4 q2 u v
 *
 * One profile for all: peak A, width s, the dip's over it B and mixing m are fitted along, so nothing need be known of the pad or the foot.
 * The mixture of two Gaussians is within 0.33 % of the peak of the pressure under spheres and flat ends on 6, 9 and 12 mm of bonded rubber
 * (the twin's tables, 3 and 10 N), where one Gaussian is off by up to 3.4 %. Widths per placement (w) keep the force, 2 pi A s^2. Cast
 * rubber has a dip (h, of the width B S) around that: -1 to -2 % of the peak three to five widths away, on every pad of
 * host_tools/report/real; bonded rubber in the twin has none.
 *
 * A touch of unknown strength and width cannot determine a tilt and a bowl of the gains over the
 * pad: they move and widen the Gaussian. Only the equal force of all placements (e, up to Assumptions::force) determines them, less surely
 * than the rest. They are the gauge: the subspace of log gains that 1, x, y and x^2 + y^2 span over the sensors.
 *
 * All else that a session may hold is in the model with a prior around nothing, so that it neither passes for a gain nor stays unseen:
 * where the sensors sit (they are soldered by hand), sensors whose response is wider or narrower than that of the others (b), zeros that
 * were off (o), contacts that are not round (q, of all and of each), a pad or a hand aslant (t: tangential force of all placements over
 * their normal force, P as PULL has it). The posterior of each is in the Solution; judge.hpp has the limits. Zeros that move are not in the
 * readings, which are above those just before. What a sensor alone keeps of a press is: of this one it is a constant share, and so part of
 * its gain. Of those before (r) it fades between the rest and the readings, and a press takes it back (firmware/condition/ZERO.md). It is
 * not much, but without it the dip passes for what it would be elsewhere.
 *
 * How large the spreads of b, e, w, q and of the places are, and the model's own error, is learnt from the session
 * itself (expectation and maximisation, from the Assumptions as the start): sensors that are where they should be
 * determine the gains better than others, with smaller standard deviations.
 *
 * Robust least squares (Huber) by Levenberg-Marquardt, the placements' own unknowns eliminated; a placement that does not fit the others is
 * dropped as a whole. The same input gives the same bits. Thirty placements of fifteen sensors take some 10 ms. */
#pragma once

#include "common/limits.h"

#include <cstdint>
#include <vector>

namespace fingertip::calibrating {

struct Array {
  double pitch_mm = 0.0;
  std::vector<double> x_mm, y_mm; /* [sensor] */
  std::size_t sensors() const { return x_mm.size(); }
};

/* Throws Error where they lie nowhere, or far apart, or the pitch is none. */
void check_places(const Array &array);

/* One settled placement. */
struct Placement {
  double t_s = 0.0;               /* of the readings, on any clock that goes on */
  std::vector<double> reading_Pa; /* [sensor] above zero, mean over the frames */
  sensor_map usable = 0;          /* bitmap of the sensors whose reading is a measurement */
  std::vector<double> rest_Pa;    /* [sensor] just before it, of any origin; empty: not known */
  std::vector<double> earlier_Pa; /* [sensor] M: by how much less is released than at rest (set_earlier); empty: none */
  double noise_Pa = 0.0;          /* sd of a mean */
  double fading = 0.0;            /* share of them that the readings together lose in the half second */
};

/* As in firmware/condition: the pressure that was released, more than is pressed now, fades with it. */
constexpr double RELEASED_s = 2.0;
/* Sets earlier_Pa of all placements of a session, in the order of time. judge() does. */
void set_earlier(std::vector<Placement> &placements);

/* From the middle of the rest before a contact, 0.1 to 0.6 s, over the 0.3 s in which a hand sets a weight down, to the
 * middle of the readings. */
constexpr double RESTED_BEFORE_s = 1.4;

/* The upper one of an even number; of none undefined. */
double median(std::vector<double> values);

/* Standard gravity: the force of a weight. */
constexpr double GRAVITY_N_PER_g = 9.80665e-3;

/* Standard deviations of the priors that a session shows: as they are expected, and then as it has them. */
struct Spread {
  double position_mm = 0.1; /* of a sensor from its place in the layout, each way */
  double force = 0.025;     /* of the force between placements of one weight */
  double width = 0.01;      /* of the width between places: a pad cast a little aslant */
  double ellipse = 0.007;   /* of q1 and q2 from placement to placement; axes differ by 2 q */
  double own_width = 0.01;  /* of b: 0.035 to 0.07 on real pads */
};

/* What a session is expected to hold: standard deviations of the priors. */
struct Assumptions {
  Spread spread;
  double gain = 0.2;                    /* of the log gains: real pads spread by 12 to 22 % */
  double offset_share = 0.0075;         /* of the peak: zeros that were off. A wide dip and such zeros look alike:
                                           with more, gains of real pads suffer; with less, sessions of the
                                           twin pass whose zeros were off (report truth, part calibration, seed 20000) */
  double ellipse_of_all = 0.03;         /* of their means: a foot is a foot, but its shape is not known */
  double pull = 0.1;                    /* of t1 and t2: the tangent of the slope */
  double memory = 0.03;                 /* of r: of a press 1 to 9 % remain after it, either sign */
  double model_share = 0.002;           /* of the peak: what the profile leaves (above, and 0.13 % rms) */
  double reading_share = 0.003;         /* of a reading: what rubber does between 0.5 and 1 s */
  double mixing = 0.2, mixing_sd = 0.1; /* of m: 0.05 to 0.23 on the twin's tables */
  double dip = 0.05;                    /* of h: 0.05 on real pads, 0 on the twin's */
  /* Of log B / S. With 0.1 and more, places and forces on the recording of host_tools/report/real that chooses are
   * worse: zeros and model errors look like another width where the readings contain little. */
  double dip_log_sd = 0.05;
  /* Sd of log A around the reading of a strong placement, which was near a sensor: without it a
   * narrow peak that is far from every sensor explains a few placements as well. */
  double peak = 0.15;
};

/* Width of the narrow part of the profile over that of the wide one. */
constexpr double NARROW = 0.64;
/* m of the profile of a bonded layer of 12 mm under a foot of 15 mm (pad/profile.hpp). */
constexpr double LAYER_MIXING = 0.22;
/* P(x) = sum of strength exp(-x / 2 ratio^2): what a tangential force presses on the base, as pad/profile.cpp has it in
 * thicknesses, of which S is .478. */
constexpr struct { double strength, ratio; } PULL[] = {{0.357, 0.846}, {0.1743, 1.393}, {0.00568, 3.554}};
/* B / S that is expected: about as wide as the array of the recording of host_tools/report/real that chooses can still
 * distinguish from zeros that were off. */
constexpr double DIP_WIDTHS = 5.0;
/* An own width b takes b R / S^2 of a reading, a place that is off by d along u takes u d / S^2. The readings that
 * locate a contact have R / S^2 of 1 to 2. */
constexpr double OWN_WIDTH_SQUARE = 1.5;
/* In residual standard deviations: where a reading's weight begins to fall. */
constexpr double HUBER = 2.5;

struct Fitted { /* one placement */
  bool kept = false;
  double x_mm = 0.0, y_mm = 0.0;
  double force = 0.0;             /* e: log of its force over the common one */
  double width = 0.0;             /* w */
  double ellipse[2] = {0.0, 0.0}; /* q1, q2, beside those of all */
  double residual_share = 0.0;    /* rms over its sensors, of the peak */
  double misfit = 0.0;            /* rms of residuals over their sd; large: does not belong */
};

struct Solution {
  bool solved = false;                         /* else too few placements or readings for any of it */
  std::vector<double> gain;                    /* [sensor] relative to their mean */
  std::vector<double> gain_sd;                 /* relative */
  std::vector<double> reading_sd;              /* of a reading after this: gain_sd, and what of the
                                                  own width (OWN_WIDTH_SQUARE) is not known */
  std::vector<double> shape_sd;                /* the part of gain_sd outside the gauge */
  std::vector<double> offset_Pa, offset_sd_Pa; /* o */
  std::vector<double> dx_mm, dy_mm;            /* of the sensors from the layout */
  std::vector<double> own_width;               /* b: log */
  std::vector<double> memory;                  /* r */
  std::vector<double> misfit_share;            /* rms of what the model leaves of a sensor's readings, of the peak */
  double ellipse_of_all[2] = {0.0, 0.0}, ellipse_of_all_sd[2] = {0.0, 0.0};
  double peak_Pa = 0.0; /* A, of a sensor of mean gain */
  double width_mm = 0.0, mixing = 0.0;
  double pull[2] = {0.0, 0.0};    /* t1, t2 */
  double dip = 0.0, dip_sd = 0.0; /* h */
  double dip_widths = 0.0;        /* B / s */
  /* The firmware's model that is nearest to the profile: one Gaussian less a dip. */
  double sigma_mm = 0.0, sigma_sd_mm = 0.0, dip_share = 0.0, dip_sd_mm = 0.0;
  std::vector<Fitted> placements; /* as given */
  std::size_t kept = 0;
  double residual_share = 0.0; /* rms over all readings kept, of the peak */
  double excess = 1.0;         /* of the model's own error over what was assumed */
  Spread spread;
  double cost = 0.0; /* 1/2 sum of the robust squares and of the priors' */

  /* Most of shape_sd, and the sd of the gains within the gauge, rms over the sensors. */
  double worst_shape_sd() const;
  double gauge_sd = 0.0;
};

/* Fewer can not be solved. */
constexpr std::size_t PLACEMENTS_MIN = 3;

/* Throws std::invalid_argument if a placement has another number of readings than the array has
 * sensors. keep_all: drop none, to compare with another solver. */
Solution solve(const Array &array, const std::vector<Placement> &placements, bool keep_all = false);

/* The solution of some placements of a session, with the spreads of all of it, beginning where
 * all of it ended; from.placements are theirs. A few placements alone may have a second optimum. */
Solution solve_from(const Array &array, const std::vector<Placement> &placements, const Solution &from);

/* The log gains with their mean, tilt and bowl taken out. */
std::vector<double> outside_gauge(const Array &array, const std::vector<double> &gain);

/* How far inside the outer sensors a place is asked for: right above them a foot may be where the rubber ends. Of
 * pads that end 6 mm beyond, calibrations with such places made 4 of 60 worse (report truth, part calibration, seed
 * 31000). The price is 8 % more location error on 6 mm of rubber. */
constexpr double INSET_PITCHES = 0.5;

/* Where a placement more would lower the largest shape_sd most: a place on the array, in steps of half a pitch. */
struct Wanted {
  double x_mm, y_mm;
  double worst_shape_sd; /* then */
};
Wanted next_place(const Array &array, const std::vector<Placement> &placements, const Solution &solution);

} // namespace fingertip::calibrating
