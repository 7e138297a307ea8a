// The force that holds an object: from its load, its friction and its slides.
#pragma once

#include "grasp/control/finger.hpp"

#include <cstdint>

namespace fingertip {

// The friction coefficient: the largest ratio of tangential to normal force that held since a slide, and the least that slid.
class GripFriction {
public:
  void held(double ratio);
  // lately: the ratio that lasts. The present one counts until the slide is over.
  void slid(double ratio, double lately);
  void rests() { now_ = MOST; }
  // The coefficient to use. assumed: its value if nothing is known.
  double value(double assumed) const;

private:
  static constexpr double MOST = 1.5;
  double held_ = 0.0, slid_ = 0.0; // 0: unknown
  double now_ = MOST;
};

// The load that the grip carries. A sliding contact does not show it: its tangential force is its friction.
class GripLoad {
public:
  // Updates from a contact that rests. sd_N: less is no rise. swings: it was caught, and swings on the rubber.
  void rests(double load_N, double sd_N, double passed_s, bool swings);
  // Updates from a contact that slides and does not slow down: its load is at least its friction, and stopping it takes more.
  void slides_at(double load_N, double speed_mm_s, double passed_s);

  double now_N() const { return load_N_; }
  double ahead_N(double seconds) const; // predicted load
  bool is_steady() const;

private:
  double load_N_ = 0.0, slow_N_ = 0.0, peak_N_ = 0.0, rate_N_s_ = 0.0;
  double swings_s_ = 0.0;
};

class GripHold {
public:
  // The wanted force. coming_N: the grip after the moves under way. dead_s: from a motion of the object to the motion of the gripper.
  double wants(const GripReadings &readings, double coming_N, const GripSettings &settings, double now_s, double dead_s);
  double friction(const GripSettings &settings) const;
  bool is_set() const { return is_set_; } // a set force without a load
  double load_N() const { return load_.now_N(); }
  bool is_loaded() const { return load_.now_N() > LOADED_N; } // enough for a margin to have a meaning
  bool has_seen_load() const { return has_seen_load_; }
  bool is_by_place() const { return by_place_; } // the newest load
  bool is_sliding() const { return sliding_; }
  bool goes_on() const { return goes_on_; } // slides and does not slow down
  std::uint32_t slides() const { return slides_; }

private:
  static constexpr double LOADED_N = 0.15;

  void update(const GripReadings &readings, const GripSettings &settings, double now_s);
  double need_N(const GripSettings &settings, double delay_s, double dead_s) const;

  GripFriction friction_;
  GripLoad load_;
  double wanted_N_ = 0.0, place_N_ = 0.0; // place_N_: the most that a load by the place has needed
  double now_s_ = 0.0, updated_s_ = 0.0;
  double slid_s_ = 0.0; // time of the last frame of a slide
  double fastest_mm_s_ = 0.0;
  double still_s_ = 0.0;  // time of the last frame without a slide
  double steady_s_ = 0.0; // the load has been steady since
  double was_N_ = 0.0;    // largest recent load; it decays over REMEMBERS_s
  double ratio_ = 0.0;    // smoothed tangential over normal force at rest
  double lately_ = 0.0;   // largest ratio within LATELY_s
  double moved_mm_ = 0.0; // length of the present reported slide
  double most_N_ = 0.0;   // largest grip within LATELY_s
  bool begun_ = false, sliding_ = false, goes_on_ = false, has_seen_load_ = false, was_loaded_ = false, is_set_ = false, by_place_ = false;
  std::uint32_t slides_ = 0;
};

} // namespace fingertip
