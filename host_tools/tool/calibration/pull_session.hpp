/* One session of finding the tangential force's scale: a fingertip's packets in, pulls, what to do
 * next, and the pad's profile in the end. For every program that calibrates.
 */
#pragma once

#include "libfingertip/wire.hpp"
#include "tool/calibration/pulls.hpp"

#include <string>
#include <vector>

namespace fingertip::calibrating {

/* What a fingertip must be able to do, and know. what: it, for the message. Throws Error. */
void check_pad(const wire_info &info, const std::string &what);

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
