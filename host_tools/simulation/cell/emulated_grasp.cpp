#include "simulation/cell/emulated_grasp.hpp"

#include "grasp/convert.hpp"

extern "C" {
#include "common/contact_flags.h"
}

#include <algorithm>
#include <cmath>
#include <string>

namespace fingertip::cell {
namespace {

using nlohmann::ordered_json;

enum Stream : std::uint64_t { LINE = 841 };

constexpr double NEVER_s = std::numeric_limits<double>::infinity();
constexpr double MOVES_s = 2.5e-4; // between two samples of the gripper
constexpr double LOST_N = 0.01;
constexpr double PAD_SD = 0.08, CALIBRATION_SD = 0.012, FORCE_SCALE_SD = 0.05;
constexpr double MORE_LOAD = 1.1, MORE_LOAD_N = 0.1;

ordered_json in_ms(double s) {
  return std::isfinite(s) ? ordered_json(std::round(1e6 * s) / 1e3) : ordered_json(nullptr);
}

ordered_json to_us(double s) {
  return std::isfinite(s) ? ordered_json(std::round(1e6 * s) / 1e6) : ordered_json(nullptr);
}

} // namespace

CalibratedRubber draw_rubber(const pad_profile &profile, Random &random) {
  CalibratedRubber rubber{};
  rubber.stored.placements = 20;
  rubber.stored.force_scale = 1.0F / profile.force_ratio;
  rubber.stored.force_scale_sd = static_cast<float>(FORCE_SCALE_SD);
  for (std::size_t k = 0; k < SENSORS; k++) {
    const double gain = 1.0 + PAD_SD * std::clamp(random.normal(), -3.0, 3.0);
    rubber.gain[k] = gain;
    rubber.stored.sensors[k].gain = static_cast<float>(gain * (1.0 + CALIBRATION_SD * random.normal()));
    rubber.stored.sensors[k].gain_sd = static_cast<float>(CALIBRATION_SD);
  }
  return rubber;
}

EmulatedGrasp::EmulatedGrasp(const EmulatedTrial &trial, const Face &face, const pad_profile &profile)
    : trial_(trial), face_(face), cell_(face, trial.object, trial.grasp),
      gripper_(trial.gripper, trial.object.width_mm + trial.course.opens_mm, Random(trial.seed, LINE, 0)),
      fingers_{EmulatedFingertip(profile, trial.rubber[0].stored), EmulatedFingertip(profile, trial.rubber[1].stored)},
      holds_s_(NEVER_s), lift_s_(NEVER_s) {
  gripper_.motion().blocked_at = [this](double width_mm, double force_N) {
    return force_N > 0.0 && cell_.force_at_N(width_mm) >= force_N;
  };
}

void EmulatedGrasp::take(std::size_t finger, const std::uint8_t *bytes, std::size_t length, double arrived_s) {
  fingers_[finger].take(
      bytes, length, 1e6 * arrived_s, std::llround(1e6 * t_s_), [&](const EmulatedFingertip::Frame &frame) {
        if (!controller_) {
          return;
        }
        const GripTouch &touch = frame.touch;
        controller_->take_touch(finger, touch);
        reports_.push_back({1e-6 * frame.arrived_us, 1e-6 * frame.measured_us, finger,
                            (touch.flags & CONTACT_FLAG_SLIDING) != 0, std::hypot(touch.qx_N, touch.qy_N)});
        frames_[finger]++;
        loads_[finger] += (touch.flags & CONTACT_FLAG_TANGENTIAL_VALID) != 0;
        step_controller();
      });
}

void EmulatedGrasp::step_controller() {
  const double width_mm = command_.width_mm;
  report_ = controller_->step(t_s_, command_);
  if (command_.width_mm != width_mm) {
    commanded_.push_back({t_s_, command_.width_mm});
  }
  if (report_.state == GRIP_HOLDING || report_.state == GRIP_SLIPPING) {
    trouble_ |= report_.trouble;
    holds_s_ = std::min(holds_s_, t_s_);
  }
}

void EmulatedGrasp::run(double until_s) {
  if (!controller_ && fingers_[0].is_ready() && fingers_[1].is_ready()) {
    const GripperTraits &traits = trial_.gripper.traits;
    controller_ = std::make_unique<CoreController>(default_settings(traits), traits);
    asked_s_ = t_s_;
  }
  while (t_s_ < until_s && !over_) {
    double next_s = std::min({until_s, gripper_.next_s(), t_s_ + MOVES_s});
    if (!line_.empty()) {
      next_s = std::min(next_s, line_.front().known_s);
    }
    advance(next_s);
    if (!line_.empty() && line_.front().known_s <= t_s_) {
      if (controller_) {
        controller_->take_status(line_.front().status);
        step_controller();
      }
      line_.pop_front();
    }
    if (gripper_.next_s() <= t_s_) {
      const double width_mm = gripper_.sent().width_mm;
      line_.push_back(gripper_.exchange(command_));
      if (gripper_.sent().width_mm != width_mm) {
        asked_.push_back({t_s_, gripper_.sent().width_mm});
      }
    }
  }
}

void EmulatedGrasp::advance(double to_s) {
  const double seconds = to_s - t_s_;
  if (seconds <= 0.0) {
    return;
  }
  if (lift_s_ == NEVER_s && t_s_ >= holds_s_ + trial_.course.waits_s) {
    lift_s_ = t_s_;
  }
  const bool lifts = lift_s_ < NEVER_s;
  const double width_mm = gripper_.motion().width_mm();
  gripper_.motion().step(seconds);
  const KindOfGrasp::Inputs inputs = trial_.course.inputs(lifts ? t_s_ + 0.5 * seconds - lift_s_ : -1.0);
  Drive drive = drive_of(inputs, trial_.grasp.down_rad);
  drive.width_mm = gripper_.motion().width_mm();
  cell_.run(seconds, drive);
  t_s_ = to_s;
  if (drive.width_mm != width_mm) {
    moved_.push_back({t_s_, drive.width_mm});
  }
  const double force_N = cell_.force_N();
  if (lifts) {
    slips_.sample(t_s_, cell_.slips(), force_N, cell_.slid_mm());
  }
  const Vector way = cell_.way_mm();
  dropped_ = std::hypot(way.x, way.y) >= DROP_mm || (lifts && !drive.table && force_N < LOST_N);
  over_ = dropped_ || (lifts && t_s_ - lift_s_ >= trial_.course.ends_s);
  if (over_) {
    slips_.end();
  }
}

std::vector<std::uint8_t> EmulatedGrasp::to_send(std::size_t finger) {
  return fingers_[finger].to_send(std::llround(1e6 * t_s_));
}

Pressures EmulatedGrasp::sensed_Pa(std::size_t finger) const {
  Pressures sensed_Pa = face_.base_Pa(cell_.touch(finger));
  for (std::size_t k = 0; k < SENSORS; k++) {
    sensed_Pa[k] *= trial_.rubber[finger].gain[k];
  }
  return sensed_Pa;
}

ordered_json EmulatedGrasp::answer_to(const Slip &slip) const {
  std::array<double, 2> load_N{};
  const Report *first = nullptr;
  for (const Report &report : reports_) {
    if (report.arrived_s < slip.begin_s) {
      load_N[report.finger] = report.load_N;
    } else if (report.slides || report.load_N > MORE_LOAD * load_N[report.finger] + MORE_LOAD_N) {
      first = &report;
      break;
    }
  }
  // The first step that closes further than the width before it.
  const auto closed = [&](const std::vector<Change> &changes) {
    double width_mm = NEVER_s;
    for (const Change &change : changes) {
      if (change.at_s >= slip.begin_s && change.width_mm < width_mm) {
        return change.at_s - slip.begin_s;
      }
      width_mm = change.width_mm;
    }
    return NEVER_s;
  };
  ordered_json out;
  out["begin_s"] = to_us(slip.begin_s);
  out["way_mm"] = slip.way_mm;
  out["reported_by"] = !first ? ordered_json(nullptr) : first->slides ? "SLIDING" : "load";
  out["measured_ms"] = in_ms(first ? first->measured_s - slip.begin_s : NEVER_s);
  out["sent_ms"] = in_ms(first ? first->arrived_s - slip.begin_s : NEVER_s);
  out["answered_ms"] = in_ms(closed(commanded_));
  out["asked_ms"] = in_ms(closed(asked_));
  out["moved_ms"] = in_ms(closed(moved_));
  out["reaction_ms"] = in_ms(slip.reaction_s.value_or(NEVER_s));
  return out;
}

ordered_json EmulatedGrasp::summary() const {
  ordered_json out;
  out["dropped"] = dropped_;
  out["slid_mm"] = cell_.slid_mm();
  out["asked_s"] = to_us(asked_s_);
  out["holding_s"] = to_us(holds_s_);
  out["lift_s"] = to_us(lift_s_);
  out["end_s"] = to_us(t_s_);
  out["trouble"] = trouble_;
  out["slips"] = slips_.slips.size();
  out["slip"] = slips_.slips.empty() ? ordered_json(nullptr) : answer_to(slips_.slips.front());
  for (std::size_t f = 0; f < fingers_.size(); f++) {
    ordered_json one;
    one["frames"] = frames_[f];
    one["loads"] = loads_[f]; // frames that report one
    one["lost_packets"] = fingers_[f].line().dropped_packets;
    one["damaged_packets"] = fingers_[f].line().crc_errors + fingers_[f].line().format_errors;
    one["clock_uncertainty_us"] = fingers_[f].clock_uncertainty_us();
    out["fingers"].push_back(one);
  }
  return out;
}

} // namespace fingertip::cell
