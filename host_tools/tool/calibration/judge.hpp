/* Whether a calibration may be used, and if not, why, and what would help.
 *
 * Good: the gains are known well enough and nothing in the session speaks against them. Refused:
 * what speaks against them does not go away with more placements. More: neither yet.
 *
 * Bounds. The first three are where prototypes on an independent model accepted no pad that got
 * worse; the others lie between what good and bad sessions show on simulated pads of 12 mm (program
 * truth_calibration, tables evidence_p1_p50_p99; chosen on seeds 5000 to 5059, judged from 20000
 * on).
 */
#pragma once

#include "tool/calibration/solver.hpp"

#include <optional>
#include <string>

namespace fingertip::calibrating {

constexpr double SHAPE_SD_MAX = 0.015;     /* largest sd of a gain outside the gauge */
constexpr double GAUGE_SD_MAX = 0.02;      /* rms sd of the gains within it */
constexpr double RESIDUAL_MAX = 0.005;     /* rms, of the peak */
constexpr double KEPT_MIN = 0.7;           /* share of the placements */
constexpr double HALVES_SHAPE_MAX = 0.025; /* odd and even placements: largest difference of a gain
                                              outside the gauge, beyond two sds of it */
constexpr double HALVES_GAUGE_MAX = 0.04;  /* and within */
constexpr double FORCE_SPREAD_MAX = 0.025; /* rms of e: one weight */
constexpr double ELLIPSE_MAX = 0.03;       /* rms of q1, q2: a round foot */
constexpr double OFFSET_MAX = 0.012;       /* rms over the sensors, of the peak: zeros */
constexpr double DRIFT_MAX = 0.0075;       /* the same, from first to last placement */
constexpr double POSITION_MAX_mm = 0.35;   /* rms: sensors where the layout says */
constexpr std::size_t PLACEMENTS_WANTED = 12; /* at least, so that the halves mean something */
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
  drift,     /* zeros moved */
  stray,     /* too many placements do not fit the others */
  residual,  /* no such profile */
  halves,    /* odd and even placements say different gains */
  layout,    /* sensors are not where the firmware says */
  silent,    /* a sensor has no reading in any placement */
};

/* A word for programs: "too_few", "cluster", ... */
const char *name_of(Reason reason);

struct Judgement {
  enum class State { more, good, refused } state = State::more;
  Reason reason = Reason::too_few; /* none if good */
  std::string text;                /* a sentence: why, and what to do */
  Solution solution;
  double halves_shape = 0.0, halves_gauge = 0.0; /* 0 before there are PLACEMENTS_WANTED */
  double kept_share = 0.0;
  double ellipse = 0.0;                         /* rms of q1, q2 */
  double offset_share = 0.0, drift_share = 0.0; /* rms over the sensors beyond what is by chance, of
                                                   the peak */
  std::vector<std::size_t> unsure; /* sensors whose gain is not known well enough yet */
  std::vector<std::size_t> silent; /* of those, the ones without a reading in any placement */
};

/* last: there will be no more placements, so what is not good is refused. */
Judgement judge(const Array &array, const std::vector<Placement> &placements, bool last);

/* Force over 2 pi p0 sigma^2 of the firmware's own fit to the readings over their gains, half a
 * second to a second after the weight was down. Rubber that relaxes reads more before and less
 * after: sd holds what the readings' fading in that time says of it. */
struct ForceScale {
  double scale = 1.0, sd = 0.0;
};
/* That the fingertip's fit has, see fit.h; none by default. It moves forces by percents where the
 * contact is of another width. */
struct Prior {
  double sigma_mm = 0.0, width_mm = 0.0;
};
std::optional<ForceScale> force_scale(const Array &array, const std::vector<Placement> &placements,
                                      const Solution &solution, double force_N,
                                      const Prior &prior = {});

/* What a calibration is for: how far the firmware's fit scatters over the placements without and
 * with the gains. Medians: of the distance of its locations from those of the solution, of the
 * force's deviation from its median, relative. */
struct Scatter {
  double location_mm = 0.0, force = 0.0;
};
Scatter scatter(const Array &array, const std::vector<Placement> &placements,
                const Solution &solution, bool with_gains, const Prior &prior = {});

} // namespace fingertip::calibrating
