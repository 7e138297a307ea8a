// The settings of a grasp.
#pragma once

#include "grasp/gripper/gripper.hpp"

#include <algorithm>
#include <cstdint>

namespace fingertip {

enum GripMode : std::uint8_t { GRIP_MODE_FIXED, GRIP_MODE_HOLD };

// The table in ../settings.cpp has the meaning and the range of each.
struct GripSettings {
  std::uint8_t mode = GRIP_MODE_HOLD; // GripMode
  // Both modes
  double touch_N = 0.15, cap_N = 20.0, travel_cap_mm = 12.0, differ = 0.3;
  double approach_mm_s = 8.0, release_mm_s = 10.0, release_width_mm = 0.0;
  double stale_s = 0.05, late_s = 0.05, silent_s = 0.5;
  // fixed: F_des and period of eq. (6), dP = kp e + ki integral(e) + kd de/dt. dP closes from the width at which both fingertips touched.
  double set_N = 5.0, control_s = 0.01;
  double kp_mm_N = 0.06, ki_mm_Ns = 1.0, kd_mm_s_N = 0.0;
  // hold
  double start_N = 3.0, floor_N = 1.0, blind_N = 12.0;
  double friction = 0.5, margin = 1.3, slid = 1.05;
  double decay_1_s = 5.0, rest_s = 0.3;
  double pull_N = 0.6, mass_kg = 0.0, lift_m_s2 = 1.0;
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
