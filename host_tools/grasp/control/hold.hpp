// The force that holds an object: its load, its friction, and what a slide asks for.
#pragma once

#include "grasp/control/finger.hpp"

#include <cstdint>

namespace fingertip {

// An interval: the largest ratio of tangential to normal force that held, and the least that slid.
class GripFriction {
public:
  void held(double ratio);
  void slid(double ratio);
  // What is to be reckoned with; assumed: without a slide.
  double value(double assumed) const;

private:
  double held_ = 0.0, slid_ = 0.0; // 0: nothing known
};

// What is carried. A sliding contact does not tell it: its tangential force is its friction.
class GripLoad {
public:
  // Of a contact that rests. swings: it has been caught, and does so on the rubber.
  void rests(double load_N, double passed_s, bool swings);
  // Of one that slides and does not slow down: it carries no less, and is to be stopped.
  void slides_at(double load_N, double speed_mm_s, double passed_s);

  double now_N() const { return load_N_; }
  double ahead_N(double seconds) const; // from now
  bool is_steady() const;

private:
  double load_N_ = 0.0, slow_N_ = 0.0, peak_N_ = 0.0, rate_N_s_ = 0.0;
  double swings_s_ = 0.0;
};

class GripHold {
public:
  void begin();
  // The force that is wanted now. coming_N: what the moves under way make. dead_s: from a motion of
  // the object until the gripper moves.
  double wants(const GripFelts &felt, double coming_N, const GripSettings &settings, double now_s, double dead_s);
  double friction(const GripSettings &settings) const { return friction_.value(settings.friction); }
  bool is_set() const { return is_set_; } // nothing pulls at a set force
  double load_N() const { return load_.now_N(); }
  bool is_loaded() const { return load_.now_N() > LOADED_N; } // enough to speak of a margin
  bool is_sliding() const { return sliding_; }
  bool goes_on() const { return goes_on_; } // it slides and does not slow down
  std::uint32_t slides() const { return slides_; }

private:
  static constexpr double LOADED_N = 0.15;

  void look(const GripFelts &felt, const GripSettings &settings, double now_s);
  double need_N(const GripSettings &settings, double delay_s, double dead_s) const;

  GripFriction friction_;
  GripLoad load_;
  double wanted_N_ = 0.0;
  double now_s_ = 0.0, looked_s_ = 0.0;
  double slid_s_ = 0.0; // the last frame of a slide
  double fastest_mm_s_ = 0.0;
  double going_N_ = 0.0, going_load_N_ = 0.0; // grip and load of a slide, as its friction was seen
  double still_s_ = 0.0;                      // the last frame that told no slide
  double steady_s_ = 0.0;                     // since when the load is steady
  double was_N_ = 0.0;                        // the load, as far as it is remembered
  double ratio_ = 0.0;                        // smoothed, of what rests
  double lately_ = 0.0;                       // the largest within LATELY_s
  double moved_mm_ = 0.0;                     // of what is reported as one slide
  bool begun_ = false, sliding_ = false, goes_on_ = false, has_told_ = false, was_loaded_ = false, is_set_ = false;
  std::uint32_t slides_ = 0;
};

} // namespace fingertip
