/* Finds placements in a stream of frames: a weight was set down, rested, and was lifted again.
 *
 * Frames of any rate from 12 a second and any oversampling; all times are the frames' own. What touches the pad is
 * decided against the readings just before, so neither the firmware's gate nor the level of its zero matters. The zero's drift is taken
 * off.
 *
 * A contact begins where a reading rises by TOUCH_Pa within a second. It is a placement once it has rested for a second: then the mean of
 * the readings from 0.5 to 1 s is taken, above the mean of the half second before the contact. To rest means that over that time the
 * readings only decay steadily, as rubber relaxes (the limits below, noise allowed for). A finger is not as
 * still: it sways by tenths of a millimetre, each of which is 1.7 % on the flank of a contact, and its force trembles
 * by percents. A contact that rests for the first time more than LATE_s after the touch is no placement either. */
#pragma once

#include "tool/calibration/solver.hpp"

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

namespace fingertip::calibrating {

constexpr double TOUCH_Pa = 400.0;  /* above what drift does in a second, and rubber after a release */
constexpr double LIGHT_Pa = 1500.0; /* peak: with less, zeros weigh too much */
constexpr double DECAY_MAX = 0.08;  /* of all readings in half a second: 26 % in 8 s is 0.05 at 0.75 s */
constexpr double SHIFT_MAX = 0.025; /* of a sensor against the others, of the peak: 9 to 26 % in 8 s
                                       differ by 0.015 */
constexpr double SWAY_MAX = 0.005;  /* about a steady change, rms, of the peak */
constexpr double LATE_s = 5.0;
constexpr double FRAME_RATE_MIN_Hz = 12.0;

struct Frame {
  double t_s = 0.0;
  sensor_map valid = 0;                     /* bitmap: measured, and within the sensor's range */
  std::vector<double> pressure_Pa, zero_Pa; /* [sensor] absolute; the firmware's zero */
};

class PlacementFinder {
public:
  enum class State {
    resting,  /* nothing touches */
    settling, /* something touches */
    taken,    /* it was a placement, and is to be lifted */
    refused,  /* it was none, and is to be lifted */
  };
  enum class Refusal { none, unsteady, light };

  explicit PlacementFinder(std::size_t sensors);

  /* The placement that this frame completes. Frames whose time does not rise, or after a gap of
   * half a second, begin again; the times of placements go on when a fingertip restarted. */
  std::optional<Placement> take(const Frame &frame);

  State state() const { return state_; }
  /* Why the last contact was none: of State::refused, and where it was light, of State::resting. */
  Refusal refusal() const { return refusal_; }
  /* Readings above those before the contact, [sensor], of the last twentieth of a second. */
  const std::vector<double> &above_Pa() const { return above_Pa_; }

private:
  struct Slot { /* a twentieth of a second, or one frame where they are rarer */
    double begin_s = 0.0;
    int frames = 0;
    std::vector<int> counts; /* [sensor] */
    std::vector<double> means;
  };

  void restart();
  std::optional<Placement> close(const Slot &slot);
  std::vector<double> mean_of(double begin_s, double end_s, sensor_map *seen) const;
  void find_rest(double t_s);
  std::optional<Placement> settled(double t_s);

  std::size_t sensors_;
  State state_ = State::resting;
  Refusal refusal_ = Refusal::none;
  bool begun_ = false;
  double last_s_ = 0.0, ahead_s_ = 0.0; /* ahead_s_: of the frames' own time, since a restart */
  Slot open_;
  std::deque<Slot> slots_; /* of the last seconds, oldest first */
  std::vector<double> rest_Pa_, zero_Pa_, above_Pa_;
  double touch_s_ = 0.0, moved_s_ = 0.0, rest_from_s_ = 0.0, peak_Pa_ = 0.0;
};

} // namespace fingertip::calibrating
