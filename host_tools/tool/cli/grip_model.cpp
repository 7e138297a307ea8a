#include "tool/cli/grip_model.hpp"

#include "grasp/words.hpp"
#include "libfingertip/text.hpp"

namespace fingertip {

namespace {

/* The head's keys for what a view shows. */
constexpr const char *CAP_KEY = "grasp_cap", *GRIPPER_KEY = "grasp_gripper";

bool is_controlled(std::uint8_t state) {
  return state == GRIP_SQUEEZE || state == GRIP_READY || state == GRIP_HOLDING || state == GRIP_SLIPPING;
}

} // namespace

void GripModel::take(const GripRow &row) {
  if (!row_ || row_->report.state != row.report.state) {
    state_since_us_ = row.time_us;
  }
  row_ = row;
  const GripReport &report = row.report;
  Sample &last = samples_.at(row.time_us);
  last.controlled = is_controlled(report.state);
  last.wanted_N = static_cast<float>(report.wanted_N);
  last.loaded = last.controlled && (report.load_N > 0);
  last.load_N = static_cast<float>(report.load_N);
  last.slipping = last.slipping || report.state == GRIP_SLIPPING;
  last.answered = row.status.has_value();
  last.width_mm = row.status ? static_cast<float>(row.status->width_mm) : 0;
}

void GripModel::take(const Metadata &head) {
  for (const auto &[key, value] : head) {
    if (key == CAP_KEY) {
      cap_N_ = to_float(split(value, ' ')[0]).value_or(0);
    } else if (key == GRIPPER_KEY) {
      gripper_ = value;
    }
  }
}

std::string grip_line(const GripModel &grip) {
  if (!grip.row()) {
    return "nothing known of the gripper";
  }
  const GripRow &row = *grip.row();
  const GripReport &report = row.report;
  std::string text = fixed(grip.seconds(), 1) + " s  " + state_name(report.state) + "  width " +
                     (row.status ? fixed(row.status->width_mm, 1) : "-") + " mm  force " + fixed(report.force_N, 2) +
                     " N  wanted " + fixed(report.wanted_N, 2) + " N  load " + fixed(report.load_N, 2) + " N";
  if (report.margin > 0) {
    text += "  margin " + fixed(report.margin, 2);
  }
  text += "  delay " + fixed(1e3 * report.delay_s, 0) + " ms  slides " + std::to_string(report.slides);
  for (const std::string &trouble : trouble_texts(report)) {
    text += "  " + trouble;
  }
  return text;
}

} // namespace fingertip
