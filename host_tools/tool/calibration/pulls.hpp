/* One scale of the tangential force from pulls of one known force: an object is on the pad, is
 * left alone for a moment, then a string pulls it level along the rubber and holds.
 *
 * Of each contact counts what changed between the rest and the pull, so a zero that gains or the pad's edges spoil does
 * not matter. Both are means of half a second and of a second in which nothing moves; an object that slides is pulled
 * by friction and not by what hangs on the string, and is none. */
#pragma once

#include "libfingertip/wire.hpp"

#include <cstddef>
#include <deque>
#include <optional>
#include <string>
#include <vector>

namespace fingertip::calibrating {

constexpr double REST_s = 0.5, PULL_s = 1.0;
constexpr double SETTLED_s = 0.5;  /* still for this time before, so that no rise is in the mean */
constexpr double TOUCHED_s = 0.3;  /* a hand lets go; its contact is none yet */
constexpr double PULLED_MIN = 0.2; /* of the known force: a pull, whatever the scale */
/* Between the halves of a span that is still, of the known force and of the normal force. What is
 * by chance, four standard deviations of the difference, is allowed for besides. */
constexpr double DRIFT_PULL_MAX = 0.03, DRIFT_FORCE_MAX = 0.02;
constexpr double DRIFT_PLACE_MAX_mm = 0.15;
constexpr double PULL_RATE_MIN_Hz = 10.0; /* of frames: five make the mean of a rest */
/* From rest to pull: rubber shears by tenths of a millimetre, what goes farther has slid. */
constexpr double MOVED_MAX_mm = 1.5;
constexpr double PULL_SDS_MIN = 4.0; /* the known force, in standard deviations at rest */

struct PullFrame {
  double t_s = 0.0;
  bool contact = false;
  bool good = false; /* holds a load, without a warning that speaks against it */
  double qx_N = 0.0, qy_N = 0.0, q_sd_N = 0.0, force_N = 0.0, x_mm = 0.0, y_mm = 0.0;
};

/* What changed from rest to pull; as the fingertip's present scale has it. */
struct Pull {
  double t_s = 0.0;
  double qx_N = 0.0, qy_N = 0.0;
  double force_N = 0.0, x_mm = 0.0, y_mm = 0.0; /* in the pull */
};

class PullFinder {
public:
  enum class State {
    free,     /* nothing touches */
    settling, /* something touches */
    resting,  /* its rest is known: pull */
    pulled,   /* hold on */
    taken,    /* it was a pull, and is to be taken off */
    refused,  /* it was none, and is to be taken off */
  };
  enum class Refusal { none, slid, weak };

  /* known_N: what pulls. */
  explicit PullFinder(double known_N) : known_N_(known_N) {}

  /* The pull that this frame completes. Frames whose time does not rise begin again. */
  std::optional<Pull> take(const PullFrame &frame);

  State state() const { return state_; }
  /* Why the last contact was none: State::refused. weak: the known force is less than PULL_SDS_MIN standard deviations. */
  Refusal refusal() const { return refusal_; }
  double sd_N() const { return rest_.q_sd_N; } /* at rest */

private:
  std::optional<PullFrame> still(double span_s, double mean_s) const;
  std::optional<Pull> refuse(Refusal why);

  double known_N_;
  State state_ = State::free;
  Refusal refusal_ = Refusal::none;
  double touch_s_ = 0.0;
  std::deque<PullFrame> frames_; /* good ones in a row, of SETTLED_s + PULL_s at most */
  PullFrame rest_;
};

/* Bounds, chosen on simulated pads of 12 mm whose sensors' gains are right within 2 % (twin, drags of 120 s by 0.15 to 0.45 of the normal
 * force, seeds 1 to 40): a pull differs from its session's median by 3 % rms, one in a hundred by 10 %, none by more than 16 %; the ways'
 * means differ by 3.5 % in the median and at most by 11 %. On seeds 41 to 60 none of 59 is refused, and their scales scatter by 0.7 % and
 * claim 1.3. Where gains are off by 10 % pulls differ by 9 % rms. */
constexpr std::size_t PULLS_WANTED = 8;
constexpr std::size_t PULLS_OF_AN_AXIS = 3; /* within 45 degrees of x, and of y */
constexpr double PULL_STRAY_MAX = 0.2;      /* from the median, of it: what is farther is left out */
constexpr double PULLS_KEPT_MIN = 0.75;     /* share */
/* Between the means of the ways +x, +y, -x, -y that have two pulls at least, beyond two standard deviations of the difference. */
constexpr double WAYS_MAX = 0.1;
/* What no scatter shows: a string 8 degrees from level pulls 1 % less. */
constexpr double KNOWN_SD = 0.01;

struct PullJudgement {
  enum class State { more, good, refused } state = State::more;
  std::string text; /* a sentence: why, and what to do */
  std::size_t kept = 0;
  double reading = 1.0;    /* what the fingertip reads of the known force, over it */
  double reading_sd = 0.0; /* relative */
};

/* last: there will be no more pulls, so what is not good is refused. */
PullJudgement judge_pulls(const std::vector<Pull> &pulls, double known_N, bool last);

/* What a fingertip must be able to do, and know. what: it, for the message. Throws Error. */
void check_pad(const wire_info &info, const std::string &what);

/* One session: a fingertip's packets in, pulls, what to do next, and the pad's profile in the end. For every program that calibrates. */
class PullSession {
public:
  /* known_N: what pulls. */
  PullSession(const wire_info &info, double known_N);

  /* True if it completed a pull; judge then. Packets but contacts are nothing to it. */
  bool take(const wire_packet &packet);
  void judge(bool last) { judgement_ = judge_pulls(pulls_, known_N_, last); }

  /* "release it, and leave it alone": what to do now. */
  std::string advice() const;
  /* "pull 3 at x ... reads ..."; not before the first. */
  std::string last_pull_text() const;
  /* The message for a fingertip that hardly knows such forces. */
  std::string weak_text() const;

  /* pad with the scale with which the known force would have been read as what it was. Of a good
   * judgement. Throws Error where the readings are not those of the known force. */
  pad_profile scaled(pad_profile pad) const;

  const PullFinder &finder() const { return finder_; }
  const PullJudgement &judgement() const { return judgement_; }
  const std::vector<Pull> &pulls() const { return pulls_; }

private:
  pad_profile pad_;
  double known_N_;
  PullFinder finder_;
  std::vector<Pull> pulls_;
  PullJudgement judgement_;
};

} // namespace fingertip::calibrating
