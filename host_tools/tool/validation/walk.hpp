/* Leads a person through a validation: a fingertip's packets in, the steps as they are done, what
 * to do now. For every program that validates. */
#pragma once

#include "tool/validation/gather.hpp"

#include <string>
#include <vector>

namespace fingertip::validating {

class Walk {
public:
  Walk(const wire_info &info, double weight_g, double skin_mm, const Pulling &pulling = {});

  /* The steps that begin after this packet, in order, for the recording. */
  std::vector<Step> take(const wire_packet &packet);
  /* The last press or pull does not count, and is asked for again; none: there is none to take
   * back. */
  std::vector<Step> take_back();

  bool is_done() const { return next_ == steps_.size(); }
  /* "press mark 7, for the 2nd time": what to do now, and for how long. */
  std::string advice() const;
  double progress() const { return double(next_) / double(steps_.size()); } /* 0 to 1 */
  Measured finish() { return gatherer_.finish(); }

private:
  void begin(std::vector<Step> &begun);
  std::string pull_advice() const;
  const Step &now() const { return steps_[next_ - 1]; }

  std::vector<Step> steps_;
  std::size_t next_ = 0, marks_;
  bool is_taken_ = false; /* the present step's press or pull was */
  Gatherer gatherer_;
};

} // namespace fingertip::validating
