/* Whether a calibration may be used, and if not, why, and what would help.
 *
 * Good: the calibration helps, and nothing in the session speaks against it. It helps if every gain is known to SHAPE_SD_WANTED, or after
 * PLACEMENTS_ENOUGH to HELPS_SHARE of how much they differ, and if the gains from half of the placements make the firmware's fit of the
 * other half better. Where placements all over the pad do not determine every gain, and more would not either, but what one half found
 * brings the other's forces nearer to each other, the part that helps is kept: the gains, with readings as uncertain as without them, or
 * width and dip alone. It is good then, and reason states what is not known. Refused: what speaks against it does not go away with more
 * placements. More: neither yet.
 *
 * The bounds on evidence lie between what good and bad sessions show: simulated pads of 12 mm, alike and as uneven as
 * real ones (report truth, part calibration, tables evidence_p1_p50_p99; chosen on seeds 5000 to 5011, judged from
 * 20000 on), and the real pad that chooses (host_tools/report/real). */
#pragma once

#include "tool/calibration/solver.hpp"

#include <optional>
#include <string>

struct fit_deviation;

namespace fingertip::calibrating {

constexpr double SHAPE_SD_WANTED = 0.015;     /* largest sd of a gain outside the gauge */
constexpr double GAUGE_SD_WANTED = 0.02;      /* rms sd of the gains within it */
constexpr double HELPS_SHARE = 0.7;           /* of the gains' spread: half of its square is known */
constexpr double RESIDUAL_MAX = 0.008;        /* rms, of the peak; the recording of
                                                 host_tools/report/real that chooses: 0.0065 at most */
constexpr double KEPT_MIN = 0.7;              /* share of the placements */
constexpr double HALVES_SHAPE_MAX = 0.025;    /* odd and even placements: largest difference of a gain
                                                 outside the gauge, beyond two sds of it */
constexpr double HALVES_GAUGE_MAX = 0.04;     /* and within */
constexpr double FORCE_SPREAD_MAX = 0.065;    /* rms of e within the array: one weight */
constexpr double ELLIPSE_MAX = 0.05;          /* rms of q1, q2 beyond their sds: a round foot. Lying
                                                 cylinders of 6 by 12 mm have 0.053 and more, balls
                                                 0.031 at most (report truth, part calibration, seed 20000) */
constexpr double OFFSET_MAX = 0.012;          /* rms over the sensors, of the peak: zeros */
constexpr double DRIFT_MAX = 0.006;           /* the same, moving from the rest before a placement to it */
constexpr double SLOPE_MAX = 0.3;             /* 3 sds of Assumptions::pull */
constexpr double MEASURED_MIN = 0.25;         /* of what a usual sensor would read: less counts as nothing */
constexpr double THIN_PITCHES = 0.36;         /* sigma; on thinner rubber so few sensors measure a placement that gains
                                                 with their own sds leave 0.2 to 2 % of the presses off by 1 mm without
                                                 a warning (the twin's pads of 6 mm, 0.33 to 0.34, seed 7000; of 12 mm
                                                 none; the real pad that chooses, 0.375, 0.1 %) */
constexpr double POSITION_MAX_mm = 0.5;       /* rms: distance of sensors from the layout */
constexpr std::size_t PLACEMENTS_WANTED = 12; /* at least, so that the halves mean something */
constexpr std::size_t PLACEMENTS_ENOUGH = 20; /* more hardly make gains surer that are not by then */
constexpr std::size_t PLACEMENTS_MAX = 60;    /* who is not done by then never will be */

enum class Reason {
  none,
  too_few,   /* placements */
  cluster,   /* all near one place */
  one_end,   /* an end of the pad has none */
  unsure,    /* spread out, and still some gain is not known: thin rubber */
  weights,   /* not the same force every time */
  elongated, /* no round foot */
  offsets,   /* zeros were off */
  drift,     /* zeros move */
  slope,     /* of the pad or of the hand */
  stray,     /* too many placements do not fit the others */
  residual,  /* no such profile */
  halves,    /* odd and even placements give different gains */
  useless,   /* the gains from half of the placements make the other half no better than width and dip alone do */
  layout,    /* sensors are not where the firmware's layout has them */
  silent,    /* a sensor has no reading in any placement, or measures nothing */
};

/* A word for programs: "too_few", "cluster", ... */
const char *name_of(Reason reason);

struct Judgement {
  enum class State { more, good, refused } state = State::more;
  Reason reason = Reason::too_few;               /* none if good in full */
  std::string text;                              /* a sentence: why, and what to do */
  Solution solution;                             /* as solved */
  Solution kept;                                 /* what is to be stored: all of it, or the part that helps */
  double halves_shape = 0.0, halves_gauge = 0.0; /* 0 unless the halves were compared */
  bool helps = false;                            /* what one half found helps the other; as halves_shape */
  bool gains_help = false;                       /* and more than width and dip alone */
  double kept_share = 0.0, force_share = 0.0;    /* the latter: rms of e, of placements within the
                                                    array */
  double ellipse = 0.0;                          /* rms of q1, q2 beyond their sds */
  double offset_share = 0.0, drift_share = 0.0;  /* rms over the sensors, of the peak; offsets beyond what is
                                                    by chance */
  double slope = 0.0;                            /* the weight's tangential force over its normal one */
  double wanted_sd = 0.0;                        /* of the gains outside the gauge, to be good */
  std::vector<std::size_t> unsure;               /* sensors whose gain is not known well enough yet */
  std::vector<std::size_t> silent;               /* those without a reading in any placement, or that measure nothing */
};

/* placements: all of the session, in the order of time. last: there will be no more, so what is not good is refused. */
Judgement judge(const Array &array, std::vector<Placement> placements, bool last);

/* How far a sensor is from its place, and the log of the width of its response over that of the others. */
struct Deviation {
  double off_x_mm = 0.0, off_y_mm = 0.0, wider = 0.0;
};
/* What the fingertip's fit gets of the pad's response, see fit.h; zeros: nothing. */
struct Shape {
  double sigma_mm = 0.0, sigma_sd_mm = 0.0; /* a prior */
  double dip_share = 0.0, dip_sd_mm = 0.0;
  std::vector<Deviation> deviations = {}; /* [sensor] */
};
Shape shape_of(const Solution &solution);
/* The part of it that the firmware's fit uses with a pad profile: no width. */
Shape without_width(Shape shape);
/* The shape in the form of the fit: [sensor], or nothing. */
std::vector<fit_deviation> deviations_of(const Array &array, const Shape &shape);

/* Force over 2 pi p0 sigma^2 of the firmware's own fit to the readings over their gains, half a
 * second to a second after the weight was down. Rubber that relaxes reads more before and less
 * after: sd includes that, from the readings' fading in that time. */
struct ForceScale {
  double scale = 1.0, sd = 0.0;
};
std::optional<ForceScale> force_scale(const Array &array, const std::vector<Placement> &placements, const Solution &solution,
                                      double force_N, const Shape &shape);

/* What a calibration is for: how far the firmware's fit scatters over the placements, with these gains and this shape.
 * Median and rms of the distance of its locations from those of the solution, less what all have in common; median of the force's
 * deviation from its median, relative, and the mean of its log's, in which the few that are far off count. */
struct Scatter {
  double location_mm = 0.0, location_rms_mm = 0.0, force = 0.0, force_mean = 0.0;
};
Scatter scatter(const Array &array, const std::vector<Placement> &placements, const Solution &solution, const std::vector<double> &gain,
                const Shape &shape);

} // namespace fingertip::calibrating
