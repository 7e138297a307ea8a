// Converts a wanted force to a width: the gripper's width, the rubber's force over width, and the
// least move whose predicted force is enough.
#pragma once

#include "grasp/control/finger.hpp"
#include "grasp/gripper/gripper.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

namespace fingertip {

// Force over width: a power of the indentation. The slopes of closing and opening are learnt from the moves themselves.
class GripRubber {
public:
  // One fingertip touches at this width; both do.
  void begin(double width_mm) {
    *this = GripRubber();
    both_mm_ = width_mm;
  }
  void both_touch(double width_mm) { both_mm_ = width_mm; }
  double both_mm() const { return both_mm_; }
  // The force at another width, from the force at this one; the width for another force.
  double force_at(double to_mm, double force_N, double from_mm) const;
  double width_for(double wanted_N, double force_N, double from_mm) const;
  // The furthest width that a force at this one justifies: it doubles the indentation.
  double furthest_mm(double from_mm) const;
  // Learns from force and width at rest.
  void learn(double force_N, double width_mm);

private:
  double both_mm_ = 0.0;
  double closing_ = 1.0, opening_ = 1.3; // slopes, relative to the power law
  bool has_pair_ = false;
  double pair_N_ = 0.0, pair_mm_ = 0.0;
};

// An upper bound of the force after a move, on the stiffest contact that the earlier moves allow (CONTROL.md, "The cap").
class GripBound {
public:
  // Force of one pad at 1 mm of indentation, assumed before a move of both pads has shown it. Round
  // objects on 12 mm of rubber make 2 to 5 N, lines of 30 mm three times that.
  static constexpr double EXPECTED_N = 12.0;
  static constexpr std::array<double, 2> EXPONENTS = {1.3, 1.9};

  // Upper bound of the force after a first move from where both pads touch.
  static double first_N(double way_mm);

  // The least width at which a fingertip stays below the cap, whether or not the other touches. A pad
  // takes half of the travel, or less if the object gives way.
  double width_below(double cap_N, double force_N, double from_mm) const;
  // Of force and width at rest, while both fingertips touch.
  void learn(double force_N, double width_mm);
  void forget_pair() { pair_N_ = 0.0; }

private:
  std::array<double, 2> at_1_mm_N_ = {EXPECTED_N, EXPECTED_N};
  double pair_N_ = 0.0, pair_mm_ = 0.0; // 0: none
};

// What the gripper is to reach.
struct GripAim {
  enum class Haste {
    patient, // only closes, by short moves, each after the effect of the last one is measured
    usual,
    slides, // as soon as possible
  };
  double wanted_N; // force of a fingertip
  Haste haste;
  bool nearest = false; // true: a set force, as near as moves come. false: at least the wanted force
  bool opens = true;    // false: only closes
  bool exact = false;   // no force may be missing
};

class GripReach {
public:
  using Haste = GripAim::Haste;
  // The gripper's own force limit, as a share of the cap.
  static constexpr double LIMIT = 0.97;

  explicit GripReach(const GripperTraits &traits) : traits_(traits) {}

  void take(const GripperStatus &status, double silent_s);
  // Whether the width at this time is known.
  bool knows(double t_s) const {
    const std::size_t oldest = (newest_ + widths_.size() + 1 - count_) % widths_.size();
    return count_ > 0 && widths_[oldest].t_s <= t_s;
  }
  double width_at(double t_s) const;
  double poll_s() const { return poll_s_; }       // moving average of the time between two answers
  double target_mm() const { return target_mm_; } // where the last move ends
  double command_mm() const { return backs_ ? target_mm_ + 2.0 * least_mm() - traits_.step_mm : target_mm_; }
  void send(double width_mm) { move_to(width_mm, aimed_s_, false); }
  // may_back: it closes by less than the least move too, and opens before that.
  void move_to(double width_mm, double now_s, bool may_back) {
    target_mm_ = width_mm;
    aimed_s_ = now_s;
    backs_ = may_back && status_.width_mm - width_mm < traits_.deadband_mm && can_back();
  }
  void stop() { send(status_.width_mm); }
  // The last move is complete, and this frame was measured after it.
  bool has_come(double now_s, double frame_s) const;
  // In addition, the gripper's own answers state that it was not moving when the frame was measured.
  bool rests(double now_s, double frame_s) const { return has_come(now_s, frame_s) && frame_s > stopped_s_; }
  // The last move is complete.
  bool has_stopped(double now_s) const {
    const double late_s = std::max(now_s - status_.t_s(), 0.0);
    return !status_.moving && !backs_ && status_.t_s() > aimed_s_ + traits_.latency_s + late_s + poll_s_;
  }

  // One fingertip touches at this width; both do. t_s: time of the frames that report it.
  void first_touch(double t_s) {
    rubber_.begin(width_at(t_s));
    bound_ = GripBound();
  }
  void both_touch(double t_s) { rubber_.both_touch(width_at(t_s)); }
  void approach_ends(double now_s) { aimed_s_ = now_s; } // the gripper is still moving
  double touch_width_mm() const { return rubber_.both_mm(); }
  // The shortest move that a gripper at rest makes.
  double least_mm() const { return traits_.step_mm * std::max(1.0, std::ceil(traits_.deadband_mm / traits_.step_mm - 1e-9)); }
  // The change of this force by that move, from the width that was last sent.
  double least_move_N(double force_N) const { return rubber_.force_at(target_mm_ - least_mm(), force_N, target_mm_) - force_N; }
  // The predicted grip at the width that was last sent.
  double coming_N(const GripReadings &readings, double now_s) const {
    return rubber_.force_at(coming_mm(now_s), readings.grip_N, width_at(readings.t_s));
  }
  // The furthest whole step from the width last sent that keeps the larger of both forces below the cap.
  double last_below_cap_mm(const GripReadings &readings, const GripSettings &settings) const;
  // The nearest width within all caps.
  double allowed(double width_mm, const GripReadings &readings, const GripSettings &settings, std::uint32_t &trouble) const;

  // Whether the gripper's motion, as known and as commanded, makes one force of the other, both of a fingertip in a hold.
  bool explains(double from_N, double from_s, double to_N, double to_s, const GripSettings &settings) const;

  // Sends the gripper to the width of the wanted force. Returns the caps that prevent it.
  std::uint32_t aim(const GripAim &aim, const GripReadings &readings, const GripSettings &settings, double now_s);

private:
  bool can_back() const { return target_mm_ + 2.0 * least_mm() <= traits_.stroke_mm; }
  // The width at which the gripper will stop. At rest it makes no move shorter than its deadband.
  double coming_mm(double now_s) const {
    const bool stays = has_stopped(now_s) && std::abs(status_.width_mm - target_mm_) <= traits_.deadband_mm + 1e-9;
    return stays ? status_.width_mm : target_mm_;
  }
  double nearest_steps(double off, double least_mm) const;

  // What one call of aim() decides by.
  struct Outlook {
    double force_N = 0.0, width_mm = 0.0;   // measured force, and the width when it was measured
    double coming_N = 0.0, coming_mm = 0.0; // predicted force, and the width at which the gripper will stop
    double least_mm = 0.0;                  // shortest move that is possible now
    double near_N = 0.0, misses_N = 0.0;    // errors that are near enough; that may be missing
    double nearest_steps = 0.0;             // steps to a set force, closing positive
    bool come = false;                      // the effect of the last move is measured
    bool exact = false;                     // no force may be missing
  };
  void learn(const GripReadings &readings, const GripSettings &settings, double now_s);
  Outlook predict(const GripAim &aim, const GripReadings &readings, double now_s) const;
  double force_at(const Outlook &outlook, double width_mm) const { return rubber_.force_at(width_mm, outlook.force_N, outlook.width_mm); }
  // Steps to this force, closing positive.
  double steps_to(const Outlook &outlook, double wanted_N) const {
    return (outlook.coming_mm - rubber_.width_for(wanted_N, outlook.force_N, outlook.width_mm)) / traits_.step_mm;
  }
  double whole_steps(double mm) const { return traits_.step_mm * std::floor(mm / traits_.step_mm); } // rounded down, in mm
  // The widths to close and to open to. closed_mm reports a cap that shortens the move.
  double closed_mm(const Outlook &outlook, const GripAim &aim, const GripReadings &readings, const GripSettings &settings,
                   std::uint32_t &trouble) const;
  double opened_mm(const Outlook &outlook, const GripAim &aim) const;
  // Whether the gripper's own force limit can be set as low as the cap.
  bool limits_itself(const GripSettings &settings) const;

  GripperTraits traits_;
  GripperStatus status_;
  GripRubber rubber_;
  GripBound bound_;
  bool is_heard_ = false;
  double target_mm_ = 0.0;
  double aimed_s_ = 0.0; // last change of target_mm_ for a force
  double poll_s_ = 0.0;
  bool backs_ = false;     // opens before it closes to target_mm_
  double stopped_s_ = 0.0; // time of the first answer without motion since the last move
  struct Width {
    double t_s, width_mm;
  };
  std::array<Width, 64> widths_{}; // ring
  std::size_t newest_ = 0, count_ = 0;
};

} // namespace fingertip
