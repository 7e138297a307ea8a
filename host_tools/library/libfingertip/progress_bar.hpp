/* The progress of a long job, on stderr: a bar that is redrawn on a terminal; elsewhere a line each tenth, or nothing. */
#pragma once

#include <string>

namespace fingertip {

class ProgressBar {
public:
  enum class Lines { tenths, none }; /* where there is no terminal */

  ProgressBar(const std::string &what, Lines lines);
  ~ProgressBar(); /* the bar goes, so that the next message has the line for itself */
  ProgressBar(const ProgressBar &) = delete;
  ProgressBar &operator=(const ProgressBar &) = delete;

  void show(double share); /* 0..1 */

private:
  std::string what_;
  bool terminal_;
  int step_percent_;
  int shown_percent_ = -1;
};

} // namespace fingertip
