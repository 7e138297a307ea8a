// The controller of a grasp: frames of two fingertips and a gripper's status in, one command out.
//
//   Grip grip(default_settings(traits), traits);
//   grip.request(GRIP_REQUEST_GRASP);
//   for (;;) {
//     grip.take(finger, touch);         for every frame of either fingertip
//     grip.take(status);                for every answer of the gripper
//     grip.step(now_s, command);
//   }
//
// Two modes. `fixed` holds a set force: De Clercq et al., RA-L 2022, eq. (5) and (6). `hold` holds
// an object of unknown weight by its load: grip force = margin x tangential force / friction. The
// grip rises at once where the object slides, and falls slowly while it rests. CONTROL.md has the
// reasons.
//
// No clock, no allocation, deterministic. Times are the caller's, in s, on one clock for all
// inputs. Forces are N, lengths mm, of one fingertip: its normal force is the grip force.
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

// The motion that the gripper is asked for.
enum GripMotion : std::uint8_t {
  GRIP_STAY,     // hold the position: only keep the line alive
  GRIP_ACTIVATE, // only while nothing is gripped
  GRIP_MOVE,
};
struct GripCommand : GripperMove {
  std::uint8_t motion = GRIP_STAY; // GripMotion
};

// The phases of a grasp follow Romano et al., "Human-inspired robotic grasp control with tactile
// sensing", IEEE Trans. Robotics 27, 2011.
enum GripState : std::uint8_t {
  GRIP_IDLE, // no request yet
  GRIP_ACTIVATING,
  GRIP_APPROACH, // closing until both fingertips have contact
  GRIP_SQUEEZE,  // closing until the start force is reached
  GRIP_READY,    // the start force is reached; the zero of the load is measured
  GRIP_HOLDING,
  GRIP_SLIPPING, // as HOLDING, while the object slides
  GRIP_PLACING,  // as HOLDING, until a table has taken the load: then RELEASE
  GRIP_HANDING,  // as HOLDING, until someone pulls: then RELEASE
  GRIP_STILL,    // the width stays, on request
  GRIP_RELEASE,  // opening, on request
  GRIP_OPEN,     // opened
  GRIP_DROPPED,  // the object is gone; the width stays
  GRIP_MISSED,   // closed without an object
  GRIP_FAULT,    // the width stays
  GRIP_STATES,
};

enum GripRequest {
  GRIP_REQUEST_GRASP,
  GRIP_REQUEST_HOLD,
  GRIP_REQUEST_RELEASE,
  GRIP_REQUEST_PLACE,
  GRIP_REQUEST_HAND_OVER,
};

struct GripReport {
  std::uint8_t state = GRIP_IDLE;              // GripState
  std::uint32_t trouble = 0;                   // GripTrouble
  std::uint8_t gripper_fault = 0;              // the gripper's own code; in FAULT the last one stays
  double wanted_N = 0.0;                       // grip force that the controller aims at
  double force_N = 0.0;                        // grip force, from both fingertips
  std::array<double, GRIP_FINGERS> finger_N{}; // force of each fingertip
  double load_N = 0.0;                         // tangential force at one fingertip since READY; 0: unknown
  double margin = 0.0;                         // force x friction / load; 0: no load
  double friction = 0.0;
  double width_mm = 0.0;
  double delay_s = 0.0;     // from a fingertip's measurement to the controller
  std::uint32_t slides = 0; // slides since GRASP
};

class Grip {
public:
  Grip(const GripSettings &settings, const GripperTraits &traits);

  // Ignores a frame or an answer that is no newer than the last.
  void take(std::size_t finger, const GripTouch &touch);
  void take(const GripperStatus &status);

  // GRASP: from IDLE, OPEN, DROPPED, MISSED, STILL. HOLD: the width stays, from every state but
  // FAULT. RELEASE: opens, from every state but a FAULT of the gripper itself. False: not from this
  // state. PLACE and HAND_OVER: from HOLDING in mode hold, PLACE with a load of 0.15 N and more: until it opens, a
  // load against the present one, or a pull, does not raise the grip. HOLD ends them.
  bool request(GripRequest request);

  // Computes the command. Call it after every input, and every 10 ms without one.
  GripReport step(double now_s, GripCommand &command);

private:
  void enter(GripState state);
  bool is_grasping() const;
  void sample();
  bool is_gone();
  std::uint32_t gripper_trouble();
  std::uint32_t go_on();
  void approach();
  std::uint32_t squeeze();
  std::uint32_t make_ready();
  std::uint32_t hold();
  bool is_taken();
  std::uint32_t aim(const GripAim &aim);
  void ramp(double to_mm, double speed_mm_s);
  double dead_s() const;
  double start_force() const;
  void fill(GripCommand &command) const;
  GripReport report() const;

  GripSettings settings_;
  GripperTraits traits_;
  std::array<GripFinger, GRIP_FINGERS> fingers_;
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
