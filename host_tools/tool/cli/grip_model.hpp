/* What is known of a grasp at this moment beside its fingertips, gathered from the rows of a
 * recording, for views to show. */
#pragma once

#include "grasp/grip_row.hpp"
#include "libfingertip/packet_fields.hpp"
#include "tool/cli/model.hpp"

#include <optional>
#include <string>

namespace fingertip {

class GripModel {
public:
  /* The last values of an interval, and whether a flag was ever on. */
  struct Sample {
    bool controlled = false; /* wanted_N holds */
    bool loaded = false;     /* load_N holds */
    bool answered = false;   /* width_mm holds */
    bool slipping = false;
    float wanted_N = 0, load_N = 0, width_mm = 0;
  };

  void take(const GripRow &row);
  /* Takes gripper and cap from the recording's head. */
  void take(const Metadata &head);
  void set_gripper(const std::string &gripper) { gripper_ = gripper; }
  void set_cap_N(float cap_N) { cap_N_ = cap_N; }

  const std::optional<GripRow> &row() const { return row_; }
  const std::string &gripper() const { return gripper_; }
  float cap_N() const { return cap_N_; }
  double seconds() const { return row_ ? row_->time_us / 1e6 : 0; }
  /* The last of before this grasp's newest state: for how long it has been. */
  double state_seconds() const { return row_ ? (row_->time_us - state_since_us_) / 1e6 : 0; }

  const History<Sample> &samples() const { return samples_; } /* of the recording's time */

private:
  std::string gripper_;
  float cap_N_ = 0;
  std::optional<GripRow> row_;
  double state_since_us_ = 0;
  History<Sample> samples_;
};

/* "left 4.02 N" and so on, for a line of text. */
std::string grip_line(const GripModel &grip);

} // namespace fingertip
