// The controller of a grasp: frames of two fingertips and a gripper's status in, one command out. It is called as fingertip_grip.h shows,
// in the same units and on the same clock; no allocation. CONTROL.md has the reasons.
#pragma once

#include "grasp/control/finger.hpp"
#include "grasp/control/fixed.hpp"
#include "grasp/control/hold.hpp"
#include "grasp/control/reach.hpp"
#include "grasp/control/settings.hpp"
#include "grasp/gripper/gripper.hpp"

#include <array>
#include <cstdint>

namespace fingertip {

using GripState = fingertip_grip_state;
using GripRequest = fingertip_grip_request;
using GripReport = fingertip_grip_report;

class Grip {
public:
  Grip(const GripSettings &settings, const GripperTraits &traits);

  // Ignores a frame or an answer that is no newer than the last.
  void take(std::size_t finger, const GripTouch &touch);
  void take(const GripperStatus &status);

  // False: not from this state (CONTROL.md, "Requests").
  bool request(GripRequest request);

  // Other settings from the next step on, in any state. False: their mode is another; nothing changes.
  bool change(const GripSettings &settings);
  const GripSettings &settings() const { return settings_; }

  // Computes the command. Call it after every input, and every 10 ms without one.
  GripReport step(double now_s, GripCommand &command);

private:
  void enter(GripState state) {
    state_ = state;
    since_s_ = now_s_;
    is_entered_ = true;
  }
  bool is_grasping() const { return (state_ >= GRIP_SQUEEZE && state_ <= GRIP_HANDING) || (state_ == GRIP_STILL && still_grasps_); }
  void sample();
  bool is_gone();
  std::uint32_t gripper_trouble();
  std::uint32_t go_on();
  void approach();
  std::uint32_t squeeze();
  std::uint32_t make_ready();
  std::uint32_t hold();
  bool mark(double least_N) { return fingers_[0].mark(least_N) | fingers_[1].mark(least_N); }
  bool is_taken();
  // A slide in HANDING that goes with a pull.
  bool is_pulled() const { return readings_.pull_N > 0.5 * settings_.pull_N && (readings_.by_place || readings_.load_N > marked_N_); }
  std::uint32_t aim(const GripAim &aim);
  void ramp(double to_mm, double speed_mm_s);
  double dead_s() const { return readings_.delay_s + traits_.latency_s + reach_.poll_s(); }
  double start_force() const {
    return settings_.mode == GRIP_MODE_FIXED ? settings_.set_N : is_blind_ ? settings_.unseen_N() : settings_.first_N();
  }
  void fill(GripCommand &command) const;
  GripReport report() const;

  GripSettings settings_;
  GripperTraits traits_;
  std::array<GripFinger, GRIP_FINGERS> fingers_;
  GripPlaceLoad place_;
  GripReadings readings_;
  GripReach reach_;
  GripHold hold_;
  GripFixed fixed_;
  GripperStatus status_;
  bool hears_status_ = false;
  double now_s_ = 0.0, since_s_ = 0.0;                 // since_s_: the state was entered
  GripState state_ = GRIP_IDLE, holds_ = GRIP_HOLDING; // holds_: while nothing slides
  std::uint32_t trouble_ = 0, fault_trouble_ = 0;      // of the last step; of FAULT
  std::uint8_t fault_code_ = 0;                        // the gripper's own code
  double fault_s_ = 0.0;                               // time of the first bad answer in a row
  double wanted_N_ = 0.0;
  double filled_s_ = 0.0; // last contact of any fingertip
  double moved_s_ = 0.0;  // last motion of an approach
  double ramped_s_ = 0.0; // last step of an approach or a release
  double kept_s_ = 0.0;   // last time that the load was there, or no one pulled
  double marked_N_ = 0.0; // load when PLACE or HAND_OVER was requested
  double even_s_ = 0.0;   // last time that both forces were alike, or the gripper moved
  bool may_activate_ = false, is_entered_ = false;
  bool still_grasps_ = false; // STILL with an object
  bool was_held_ = false;     // both fingertips have had contact
  bool is_blind_ = false;     // squeezed while no fingertip reported a tangential force
};

} // namespace fingertip
