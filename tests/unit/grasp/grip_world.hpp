// A gripper, an object and two fingertips in a few lines, for tests of the controller.
#pragma once

#include "grasp/control/grip.hpp"
#include "grasp/settings.hpp"

extern "C" {
#include "common/contact_flags.h"
}

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <gtest/gtest.h>

namespace fingertip::test {

// A gripper of fine steps that answers soon.
inline GripperTraits fine_gripper(double latency_s = 0.003) {
  return {{85.0, 0.01, 0.0, 1.0, 150.0, 20.0, 235.0, latency_s, 0.001}, "fine"};
}

class GripWorld {
public:
  explicit GripWorld(const std::map<std::string, double> &wanted = {}, const GripperTraits &gripper = fine_gripper())
      : traits(gripper), settings(settings_for(gripper, wanted)), grip(settings, gripper) {
    sent_before_.assign(64, width_mm);
  }

  void run(double seconds) {
    for (int i = 0; i < std::lround(1e3 * seconds); i++) {
      millisecond();
    }
  }
  void run_to(GripState state, double most_s = 6.0) {
    for (int i = 0; i < std::lround(1e3 * most_s) && report.state != state; i++) {
      millisecond();
    }
    ASSERT_EQ(report.state, state);
  }
  void grasp() {
    ASSERT_TRUE(grip.request(GRIP_REQUEST_GRASP));
    run_to(GRIP_HOLDING);
  }
  // The load becomes this within so long.
  void pull(double to_N, double seconds) {
    const double from_N = load_N;
    const long steps = std::lround(1e3 * seconds);
    for (long i = 1; i <= steps; i++) {
      load_N = from_N + (to_N - from_N) * static_cast<double>(i) / static_cast<double>(steps);
      millisecond();
    }
  }
  // Grasps it, which pulls so hard within this time, and holds it for a while.
  void carry(double to_N, double within_s, double then_s) {
    grasp();
    pull(to_N, within_s);
    run(then_s);
  }
  // It slides at this ratio of tangential to normal force, so fast, for so long.
  void slide(double ratio, double speed_mm_s, double seconds) {
    for (int i = 0; i < std::lround(1e3 * seconds); i++) {
      load_N = ratio * force_N;
      slides = {true, true};
      slide_mm_s = speed_mm_s;
      millisecond();
    }
    slides = {false, false};
    slide_mm_s = 0.0;
  }

  GripperTraits traits;
  GripSettings settings;
  Grip grip;
  GripCommand command;
  GripReport report{};
  double t_s = 1.0, width_mm = 60.0, force_N = 0.0, load_N = 0.0, slide_mm_s = 0.0;
  double object_mm = 40.0, stiffness = 3.0, power = 1.6; // of a pad at 1 mm; 0 mm: nothing there
  double off_mm = 0.0;                                   // the object presses fingertip 0 by so much more, fingertip 1 less
  double delay_s = 0.0;                                  // of frames
  double frame_s = 1.0 / 410.0;
  std::array<double, 2> gain{1.0, 1.0}, load_share{1.0, 1.0};
  double sd_share = 0.05;                 // of a force, as reported
  double sigma_mm = 6.0, pulled_mm = 0.0; // the latter: of the place, for each unit of tangential over normal force
  std::array<double, 2> moved_mm{};       // of the place, besides
  std::array<bool, 2> slides{}, mute{}, frozen{};
  std::array<std::uint32_t, 2> add_flags{}, drop_flags{};
  bool active = true, gripper_mute = false, activated = false;
  bool keeps_limit = false; // the gripper stops at the force that it was told
  std::uint8_t fault = 0;
  double peak_N = 0.0;
  int turns = 0; // of the commanded width

private:
  struct Frame {
    double known_s;
    std::size_t finger;
    GripTouch touch;
  };

  double pad_N(std::size_t finger) const {
    const double deep_mm = 0.5 * (object_mm - width_mm) + (finger == 0 ? off_mm : -off_mm);
    return object_mm > 0.0 && deep_mm > 0.0 ? stiffness * std::pow(deep_mm, power) : 0.0;
  }

  GripTouch feel(std::size_t finger) {
    GripTouch touch;
    touch.t_s = t_s;
    const double sensed_N = gain[finger] * pad_N(finger);
    if (sensed_N < 0.02) {
      return touch;
    }
    touch.flags = (CONTACT_FLAG_CONTACT | CONTACT_FLAG_FIT_VALID | CONTACT_FLAG_UNCERTAINTY_VALID | CONTACT_FLAG_TANGENTIAL_VALID |
                   CONTACT_FLAG_VELOCITY_VALID | (slides[finger] ? std::uint32_t{CONTACT_FLAG_SLIDING} : 0u) | add_flags[finger]) &
                  ~drop_flags[finger];
    touch.force_N = sensed_N;
    touch.force_sd_N = sd_share * sensed_N;
    touch.sigma_mm = sigma_mm;
    touch.x_mm = frozen[finger] ? 0.0 : 1e-3 * (frames_ % 7);
    touch.y_mm = pulled_mm * load_share[finger] * load_N / sensed_N + moved_mm[finger];
    touch.qy_N = (touch.flags & CONTACT_FLAG_TANGENTIAL_VALID) != 0 ? load_share[finger] * load_N : 0.0;
    touch.speed_y_mm_s = slide_mm_s;
    return touch;
  }

  void millisecond() {
    t_s += 1e-3;
    const auto late = static_cast<std::size_t>(std::lround(1e3 * traits.latency_s));
    sent_before_.push_front(sent_mm_);
    sent_before_.pop_back();
    const double step_mm = traits.step_mm;
    const double target_mm = std::round(sent_before_[late] / step_mm) * step_mm;
    const bool stands = std::abs(target_mm - width_mm) < 1e-9;
    // A gripper at rest makes no move that is shorter than its deadband.
    if (stands || std::abs(target_mm - width_mm) >= traits.deadband_mm || moves_) {
      const double most_mm = 1e-3 * command.speed_mm_s, before_mm = width_mm;
      width_mm += std::clamp(target_mm - width_mm, -most_mm, most_mm);
      const double pressed_N = std::max(pad_N(0), pad_N(1));
      const bool blocked = keeps_limit && width_mm < before_mm && pressed_N >= command.force_N;
      width_mm = blocked ? before_mm : width_mm;
      moves_ = !blocked && std::abs(target_mm - width_mm) > 1e-9;
    }
    force_N = 0.5 * (pad_N(0) + pad_N(1));
    peak_N = std::max({peak_N, pad_N(0), pad_N(1)});
    while (frames_ * frame_s < t_s) {
      frames_++;
      for (std::size_t i = 0; i < 2; i++) {
        if (!mute[i]) {
          line_.push_back({t_s + delay_s, i, feel(i)});
        }
      }
    }
    while (!line_.empty() && line_.front().known_s <= t_s + 1e-9) {
      grip.take(line_.front().finger, line_.front().touch);
      line_.pop_front();
    }
    if (!gripper_mute) {
      GripperStatus status;
      status.host_us = std::llround(1e6 * t_s);
      status.active = active;
      status.moving = moves_ || std::abs(sent_mm_ - sent_before_[late]) > 1e-9;
      status.width_mm = std::round(width_mm / step_mm) * step_mm;
      status.fault = fault;
      grip.take(status);
    }
    report = grip.step(t_s, command);
    activated = activated || command.motion == GRIP_ACTIVATE;
    if (command.motion == GRIP_MOVE && command.width_mm != sent_mm_) {
      const int way = command.width_mm > sent_mm_ ? 1 : -1;
      turns += way_ == -way;
      way_ = way;
      sent_mm_ = command.width_mm;
    }
  }

  double sent_mm_ = 60.0;
  std::deque<double> sent_before_;
  std::deque<Frame> line_;
  int frames_ = 410, way_ = 0;
  bool moves_ = false;
};

inline void expect_share(double expected, double found, double share) { EXPECT_NEAR(found, expected, share * expected); }

} // namespace fingertip::test
