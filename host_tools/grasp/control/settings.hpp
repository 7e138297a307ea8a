// The settings of a grasp.
#pragma once

#include "grasp/gripper/gripper.hpp"

#include <algorithm>
#include <cstdint>

namespace fingertip {

enum GripMode : std::uint8_t { GRIP_MODE_FIXED, GRIP_MODE_HOLD };

// The gains of eq. (6): dP = kp e + ki integral(e) + kd de/dt. dP closes the gripper from the width at which both fingertips touched.
struct GripGains {
  double kp_mm_N = 0.06, ki_mm_Ns = 1.0, kd_mm_s_N = 0.0;
};

// settings.cpp has the ranges.
struct GripSettings {
  std::uint8_t mode = GRIP_MODE_HOLD; // GripMode
  // Both modes
  double touch_N = 0.15;                              // a fingertip with this force has contact
  double approach_mm_s = 8.0;                         // largest speed of the width; slower if frames are late
  double cap_N = 20.0;                                // limit of the true force, sensing errors included
  double travel_cap_mm = 12.0;                        // largest closing travel after the touch
  double release_mm_s = 10.0, release_width_mm = 0.0; // speed and final width of an opening
  double stale_s = 0.05;                              // a fingertip is ignored after this time without a frame
  double late_s = 0.05;                               // frames that arrive older than this are reported as late
  double silent_s = 0.5;                              // a gripper is silent after this time without an answer
  double differ = 0.3;                                // GRIP_FINGERS_DIFFER above this share of the larger force
  // fixed
  double set_N = 5.0; // F_des
  GripGains gains;
  double control_s = 0.01; // period of eq. (6)
  // hold
  double start_N = 3.0;   // grip before there is a load
  double floor_N = 1.0;   // least grip once the load is known; more if frames are late (hold.cpp)
  double blind_N = 12.0;  // grip if no load can be estimated, reached before there is a load
  double friction = 0.5;  // assumed until a slide, or a load that does not slide, shows a better value
  double margin = 1.3;    // grip over load / friction; more if frames are late
  double slid = 1.05;     // factor on the margin after the first slide
  double decay_1_s = 5.0; // share of an excess of grip that decays in a second
  double pull_N = 0.6;    // HAND_OVER: change of a fingertip's load
  double rest_s = 0.3;    // no decay for this time after a slide
  double mass_kg = 0.0;   // expected mass of the object: the load is taken to be its weight at least; 0: unknown
  double lift_m_s2 = 1.0; // acceleration that the expected mass gets before the load is known
  // Load of one fingertip by the expected mass.
  double expected_N(bool is_loaded) const { return 0.5 * mass_kg * (9.81 + (is_loaded ? 0.0 : lift_m_s2)); }
  // Grip before there is a load; grip if none can be estimated.
  double first_N() const { return mass_kg > 0.0 ? std::min(std::max(margin * expected_N(false) / friction, floor_N), cap_N) : start_N; }
  double unseen_N() const { return std::max(blind_N, first_N()); }
  // A set force: the same grip at the start, later and without a load. While there is no load, the controller holds the
  // nearest force that the gripper reaches, not the least that is enough. Forces this far apart are alike.
  double alike_N(double force_N) const { return std::max(differ * force_N, 2.0 * touch_N); }
  bool sets_force() const { return start_N == floor_N && start_N == blind_N && mass_kg == 0.0; }
};

GripSettings default_settings(const GripperTraits &traits);

} // namespace fingertip
