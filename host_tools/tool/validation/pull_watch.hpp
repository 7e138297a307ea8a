/* One pull of a validation, from readings alone: something stands on the pad, is left alone, then
 * it is pulled along the rubber and left alone again. So it is seen whether or not the fingertip
 * estimates a tangential load.
 *
 * A pull changes the shape of the readings over the sensors: they rise ahead of the contact and
 * fall behind it. What they all lose as the rubber relaxes changes no shape. The difference of two
 * shapes is the norm of what the better scale of one leaves of the other, over the other's norm.
 */
#pragma once

#include "libfingertip/wire.hpp"
#include "tool/calibration/placements.hpp"

#include <deque>
#include <vector>

namespace fingertip::validating {

using Contacts = std::deque<wire_packet>; /* contact packets, in order of time */

/* What the fingertip estimated in a span: medians over frames with a fit; 0 frames: nothing. */
struct Estimate {
  std::size_t frames = 0;
  double x_mm = 0.0, y_mm = 0.0, force_N = 0.0;
  bool warned = false;         /* most of these frames */
  std::size_t pull_frames = 0; /* of them, those with a tangential load; 0: the rest is zero */
  double qx_N = 0.0, qy_N = 0.0, q_sd_N = 0.0;
};
Estimate estimate_of(const Contacts &contacts, double from_s, double to_s);

/* On simulated pads of 12 mm that relax as real ones (newcomer_validated --pull 45 and 100, seeds 1
 * to 3 and 301) shapes differ by up to 0.016 within the first two seconds of a rest, and by 0.11 at
 * least under a pull of PULL_SHARE_MIN. */
constexpr double STILL_SHAPE = 0.025, PULLED_SHAPE = 0.06;

class PullWatch {
public:
  enum class State {
    free,     /* nothing touches */
    settling, /* something does, and is not at rest */
    resting,  /* its rest is known: pull */
    pulled,   /* it is pulled, and not yet still */
    taken,    /* lift it */
  };

  /* is_free: nothing touches the pad. contacts: of the last three seconds. True: this frame
   * completes the pull. */
  bool take(const calibrating::Frame &frame, bool is_free, const Contacts &contacts);

  State state() const { return state_; }
  const Estimate &rest() const { return rest_; } /* half a second, a second or more before */
  const Estimate &pull() const { return pull_; } /* its last second */

private:
  std::vector<double> above(double from_s, double to_s) const; /* [sensor], the readings before */
  void look_for_rest(double t_s, const Contacts &contacts);

  State state_ = State::free;
  std::deque<calibrating::Frame> frames_;
  std::vector<double> before_Pa_, rest_Pa_; /* [sensor]; empty: not known */
  double touched_s_ = 0.0, pulled_s_ = 0.0;
  Estimate rest_, pull_;
};

} // namespace fingertip::validating
