// What a grasp is to be like.
#pragma once

#include "grasp/gripper/gripper.hpp"

#include <cstdint>

namespace fingertip {

enum GripMode : std::uint8_t { GRIP_MODE_FIXED, GRIP_MODE_HOLD };

// Of eq. (6): dP = kp e + ki integral(e) + kd de/dt, closing from the width at which both
// fingertips touched.
struct GripGains {
  double kp_mm_N = 0.06, ki_mm_Ns = 1.0, kd_mm_s_N = 0.0;
};

// settings.cpp has the ranges.
struct GripSettings {
  std::uint8_t mode = GRIP_MODE_HOLD; // GripMode
  // Both modes
  double touch_N = 0.15;                              // of a fingertip: contact
  double approach_mm_s = 8.0;                         // of the width, at most; slower where frames come late
  double cap_N = 20.0;                                // the true force stays below, errors of the fingertips included
  double travel_cap_mm = 12.0;                        // never closed further since the touch
  double release_mm_s = 10.0, release_width_mm = 0.0; // opening: how fast, until where
  double stale_s = 0.05;                              // a fingertip without a new frame for so long is ignored
  double late_s = 0.05;                               // frames that are older when they come are said to be late
  double silent_s = 0.5;                              // a gripper without an answer for so long is silent
  double differ = 0.3;                                // of the larger force: GRIP_FINGERS_DIFFER above it
  // fixed
  double set_N = 5.0; // F_des
  GripGains gains;
  double control_s = 0.01; // between two steps of eq. (6)
  // hold
  double start_N = 3.0;   // grip before anything pulls
  double floor_N = 1.0;   // and the least once the load is known; with late frames more (hold.cpp)
  double blind_N = 12.0;  // grip where no load can be estimated, reached before anything pulls
  double friction = 0.5;  // until a slide, or a load that does not slide, shows better
  double margin = 1.3;    // grip over load / friction; with late frames more,
  double slid = 1.05;     // and so much of that since it has slid: it will again
  double decay_1_s = 5.0; // decay of a grip that is too large, share of it a second
  double rest_s = 0.3;    // no sooner after a slide
  // The same grip at the start, later and without a load: a set force. As long as nothing pulls,
  // the nearest that the gripper reaches is held, and not the least that is enough.
  bool sets_force() const { return start_N == floor_N && start_N == blind_N; }
};

GripSettings default_settings(const GripperTraits &traits);

} // namespace fingertip
