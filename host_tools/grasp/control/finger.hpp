// The readings of each fingertip, whether they are trusted, and how late they are.
#pragma once

#include "grasp/control/settings.hpp"
#include "grasp/fingertip_grip.h"
#include "libfingertip/wire.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace fingertip {

constexpr std::size_t GRIP_FINGERS = 2;

// Assumed friction of a contact whose load shows by its place alone: what has moved further has slid, and its zero with it.
constexpr double PLACE_FRICTION = 0.2, PLACE_STICKS = 1.3 * PLACE_FRICTION;

// One frame of a fingertip. A value whose VALID flag is off is 0.
struct GripTouch {
  double t_s = 0.0;        // when it was measured
  std::uint32_t flags = 0; // enum contact_flag
  double force_N = 0.0, force_sd_N = 0.0;
  double x_mm = 0.0, y_mm = 0.0, sigma_mm = 0.0;
  double qx_N = 0.0, qy_N = 0.0, q_sd_N = 0.0;   // tangential force of the object on the rubber
  double speed_x_mm_s = 0.0, speed_y_mm_s = 0.0; // of the contact on the rubber
};
// host_us: when the frame was measured. What is no number counts as 0.
GripTouch touch_from_packet(const wire_packet &contact, double host_us);

using GripTrouble = fingertip_grip_trouble;
constexpr std::uint32_t GRIP_GRIPPER_FAULTS = GRIP_GRIPPER_FAULT | GRIP_GRIPPER_INACTIVE;

// The present reading of one fingertip.
struct GripReading {
  std::uint32_t trouble = 0; // GripTrouble, as bits of finger 0
  bool fresh = false;        // a frame has come since the last sample
  bool counts = false;       // frames arrive, and their values change
  bool has_force = false, has_load = false;
  bool contact = false, over = false, slides = false;
  bool is_left_out = false; // contradicts the other fingertip
  double t_s = 0.0;         // time of the measured force
  double load_x_N = 0.0, load_y_N = 0.0;
  double moved_x_N = 0.0, moved_y_N = 0.0; // the same, with what has slid where it is by_place
  double force_N = 0.0, sd_N = 0.0, load_N = 0.0, load_sd_N = 0.0, speed_mm_s = 0.0;
  bool by_place = false; // has_load is by how far the contact has moved since end_zero; pulled: tangential over normal force, of it alone
  double pulled_x = 0.0, pulled_y = 0.0;
};

class GripReach;

// One fingertip. A force that the gripper's motion does not explain is doubted (CONTROL.md, "Safety").
class GripFinger {
public:
  void take(const GripTouch &touch);
  GripReading sample(double now_s, const GripSettings &settings);
  // The load of both, from that of this one alone.
  double load_of_both_N(double load_N) const { return load_N * of_both_; }
  void shares(double load_N, double of_both_N) { of_both_ = of_both_N / load_N; }
  double delay_s() const { return delay_s_; } // moving average of the delay of its frames
  const GripReading &believed() const { return believed_; }
  void believe(const GripReading &reading) {
    believed_ = reading;
    is_doubted_ = false;
  }
  void doubt(const GripReading &reading) {
    doubted_s_ = is_doubted_ ? doubted_s_ : reading.t_s;
    is_doubted_ = true;
  }
  bool is_doubted() const { return is_doubted_; }
  // Since the first frame that was doubted.
  double doubted_for_s(const GripReading &reading) const { return is_doubted_ ? reading.t_s - doubted_s_ : 0.0; }

  // keeps and pull_N are of the present load from now on. False: it is smaller than this. is_marked: it was not, and frames come.
  bool mark(double least_N) {
    mark_x_N_ = believed_.moved_x_N, mark_y_N_ = believed_.moved_y_N, mark_N_ = believed_.load_N;
    return is_marked_ = believed_.has_load && mark_N_ >= least_N;
  }
  bool is_marked(const GripReading &reading) const { return is_marked_ && reading.counts; }
  // Share of the marked load that this one has, along it, and how far it is from it. Without a load now: all, and 0.
  double keeps(const GripReading &reading) const {
    const double mark_N = std::hypot(mark_x_N_, mark_y_N_);
    const double less = mark_x_N_ * (mark_x_N_ - reading.moved_x_N) + mark_y_N_ * (mark_y_N_ - reading.moved_y_N);
    return reading.has_load && mark_N > 0.0 ? 1.0 - less / (mark_N * mark_N_) : 1.0;
  }
  double pull_N(const GripReading &reading) const {
    return reading.has_load ? std::hypot(reading.moved_x_N - mark_x_N_, reading.moved_y_N - mark_y_N_) : 0.0;
  }

  // Sets the zeros of tangential force and place to their means between begin and end.
  void begin_zero() {
    of_both_ = 1.0; // another object
    load_zero_ = place_zero_ = {};
    is_zeroed_ = false;
  }
  void end_zero() {
    load_zero_.end();
    place_zero_.end();
    is_zeroed_ = true;
  }
  bool has_zero() const; // enough frames for end_zero, or no tangential force at all

private:
  bool has_load() const;
  void follow_place();

  GripTouch came_, touch_; // as it came, and what the pad bears of it
  bool is_heard_ = false, is_new_ = false, has_delay_ = false;
  double heard_s_ = 0.0, force_s_ = 0.0; // arrival of a frame, of a force
  double delay_s_ = 0.0;
  double force_t_s_ = 0.0, force_N_ = 0.0, sd_N_ = 0.0;
  GripReading believed_;
  double doubted_s_ = 0.0, of_both_ = 1.0, mark_x_N_ = 0.0, mark_y_N_ = 0.0, mark_N_ = 0.0;
  bool is_doubted_ = false, is_marked_ = false;
  int unchanged_ = 0; // frames whose values are those of the one before
  struct Zero {       // the mean, once it has ended
    double x = 0.0, y = 0.0, sum_x = 0.0, sum_y = 0.0;
    int frames = 0;
    bool is_known = false;
    void take(double at_x, double at_y) { sum_x += at_x, sum_y += at_y, frames++; }
    void end() {
      is_known = frames > 0;
      x = is_known ? sum_x / frames : 0.0;
      y = is_known ? sum_y / frames : 0.0;
    }
  };
  Zero load_zero_, place_zero_;
  double place_t_s_ = -1.0, place_N_ = 0.0; // of the last place: when, and under which force
  double pulled_x_ = 0.0, pulled_y_ = 0.0;  // tangential over normal force, by the place
  bool is_zeroed_ = false;                  // end_zero since begin_zero
};

// Tangential over normal force by how far the contacts have moved. What has moved further than friction holds has slid.
struct GripPlaceLoad {
  void take(double t_s, double to_x, double to_y, double force_N, double sticks);
  // Of one place. A load moves it less as the force grows, so only what it moves further adds to alone_N.
  void take_alone(double to_x, double to_y, double force_N) {
    const double moved = std::max(std::hypot(to_x - slid_x, to_y - slid_y) - alone, 0.0);
    alone += moved, alone_N += moved * force_N;
  }
  double alone = 0.0, alone_N = 0.0; // the furthest of one place, and the load that it would be
  double t_s = 0.0, x = 0.0, y = 0.0, slid_x = 0.0, slid_y = 0.0;
  double held_x_N = 0.0, held_y_N = 0.0; // the load that moved it so far: what else moves it slowly is drift
  double speed_mm_s = 0.0;               // of a slide
  double apart_x = 0.0, apart_y = 0.0;   // the first fingertip's own less this, when both were last there
  bool is_known = false;                 // both were there
};

// The combined reading of both fingertips; a reading that is not trusted is left out.
struct GripReadings {
  std::uint32_t trouble = 0;
  int fingers = 0, touches = 0;                               // fingertips with a force; with a contact
  double low_N = 0.0, high_N = 0.0, mean_N = 0.0, sd_N = 0.0; // 0 if fingers is 0
  double grip_N = 0.0;                                        // force that holds the object
  double t_s = 0.0;                                           // time of the older of the two forces
  double delay_s = 0.0;
  bool fresh = false, over = false, has_load = false, slides = false;
  double load_N = 0.0; // tangential force at one fingertip, less its zero
  double load_sd_N = 0.0;
  double keeps = 1.0, pull_N = 0.0; // GripFinger::mark: the most and the least of the marked fingertips; of none: all, and 0
  bool by_place = false;            // the load
  double ratio = 0.0;               // tangential over normal force, of the fingertips that have both
  double speed_mm_s = 0.0;          // along the load, at the slower fingertip; below 0: one springs back, or the object rolls
  std::array<double, GRIP_FINGERS> force_N{};
  bool is_alone() const { return low_N < 0.5 * high_N; } // one fingertip carries most of the force
};

// held: what moves an object that both fingertips hold; none: their forces are believed as they come.
GripReadings combine_readings(std::array<GripFinger, GRIP_FINGERS> &fingers, double now_s, const GripSettings &settings,
                              const GripReach *held, GripPlaceLoad &place);

} // namespace fingertip
