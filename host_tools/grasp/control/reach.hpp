// From a wanted force to a width: where the gripper is, how the rubber's force follows it, and the
// least move whose predicted force is enough.
#pragma once

#include "grasp/control/finger.hpp"
#include "grasp/gripper/gripper.hpp"

#include <array>
#include <cstdint>

namespace fingertip {

// Force over width. The shape is a power of the indentation; how steep it is, closing and opening,
// is learnt from the moves themselves.
class GripRubber {
public:
  // One fingertip touches; both do.
  void begin(double width_mm);
  void both_touch(double width_mm) { both_mm_ = width_mm; }
  double both_mm() const { return both_mm_; }
  // The force at another width, from what it is at this one.
  double force_at(double to_mm, double force_N, double from_mm) const;
  // The width for another force.
  double width_for(double wanted_N, double force_N, double from_mm) const;
  // A pair of force and width, both at rest.
  void learn(double force_N, double width_mm);

private:
  double both_mm_ = 0.0;
  double closing_ = 1.0, opening_ = 1.3; // steeper than the power law by so much
  bool has_pair_ = false;
  double pair_N_ = 0.0, pair_mm_ = 0.0;
};

// The most force that a move may make, on the stiffest contact that what has been seen allows. No
// touch has to be known for it: of two power laws, a flat and a steep one, the stiffer counts.
class GripBound {
public:
  // Force of one pad at 1 mm of indentation before a move of both has shown it: round objects on
  // 12 mm of rubber make 2 to 5 N, and one pad of two may be a tenth stiffer.
  static constexpr double EXPECTED_N = 5.5;
  static constexpr std::array<double, 2> EXPONENTS = {1.3, 1.9};

  // The most that a first move makes of both pads from where they touch.
  static double first_N(double way_mm);

  // The least width at which a fingertip stays below the cap, whether or not the other touches: a
  // pad takes half of the way, or less where the object gives.
  double width_below(double cap_N, double force_N, double from_mm) const;
  // Force and width at rest, while both fingertips touch. A move that begins before they do shows a
  // contact softer than it is.
  void learn(double force_N, double width_mm);
  void forget_pair() { pair_N_ = 0.0; }

private:
  std::array<double, 2> at_1_mm_N_ = {EXPECTED_N, EXPECTED_N};
  double pair_N_ = 0.0, pair_mm_ = 0.0; // 0: none
};

// What a gripper is to reach.
struct GripAim {
  enum class Haste {
    patient, // closes only, by short moves, each after the last one shows
    usual,
    slides, // at once
  };
  double wanted_N; // of a fingertip
  Haste haste;
  bool nearest = false; // as near to it as moves come: a set force. Else enough of it
};

class GripReach {
public:
  using Haste = GripAim::Haste;
  // Of the cap: the gripper's own limit.
  static constexpr double LIMIT = 0.97;

  explicit GripReach(const GripperTraits &traits) : traits_(traits) {}

  void take(const GripperStatus &status, double silent_s);
  // The gripper had this width then; false: not known.
  bool knows(double t_s) const;
  double width_at(double t_s) const;
  double poll_s() const { return poll_s_; } // between two answers, the mean of some
  // Where it was last sent.
  double target_mm() const { return target_mm_; }
  void send(double width_mm) { target_mm_ = width_mm; }
  void stop() {
    target_mm_ = status_.width_mm;
    goes_round_ = false;
  }
  // What was sent last has been made, and a frame since then tells of it.
  bool has_come(double now_s, double frame_s) const;
  // And the gripper's own answers say that it stood when the frame was measured.
  bool rests(double now_s, double frame_s) const;
  bool stands(double now_s) const;

  // One fingertip touches; both do. t_s: of the frames that tell it.
  void first_touch(double t_s);
  void both_touch(double t_s) { rubber_.both_touch(width_at(t_s)); }
  void approach_ends(double now_s) { aimed_s_ = now_s; } // it is still under way
  double touch_width_mm() const { return rubber_.both_mm(); }
  // A gripper makes no shorter move than this when it stands.
  double least_mm() const;
  // What that makes of this force, at where the gripper was last sent.
  double least_move_N(double force_N) const;
  // The grip once it is where it was last sent.
  double coming_N(const GripFelts &felt, double now_s) const;
  // The last whole step from where it was last sent that keeps the fingertip that feels more below
  // the cap.
  double last_below_cap_mm(const GripFelts &felt, const GripSettings &settings) const;
  // A width that no cap forbids.
  double allowed(double width_mm, const GripFelts &felt, const GripSettings &settings, std::uint32_t &trouble) const;

  // Sends it to where the force is what is wanted. Troubles: which cap keeps it from that.
  std::uint32_t aim(const GripAim &aim, const GripFelts &felt, const GripSettings &settings, double now_s);

  // Going round: a gripper whose least move is several steps gets one step further by two moves,
  // back and on again. Only while nothing pulls. True: it does.
  // Closer, where only the fingertips keep the cap, and it has room for the step.
  bool goes_round_closer(const GripFelts &felt, const GripSettings &settings, double now_s);
  // Either way, where that is nearer to this force. On the way it keeps some of it.
  bool goes_round_to(double set_N, const GripFelts &felt, const GripSettings &settings, double now_s);
  bool goes_round() const { return goes_round_; }
  void leave_round() { goes_round_ = false; }
  // Goes on with it; true once it stands there.
  bool comes_round(double now_s, double frame_s);

private:
  double coming_mm(double now_s) const;
  // Steps to this force, more are closing; force_N is that of from_mm.
  double steps_off(double wanted_N, double force_N, double from_mm, double coming_mm) const;
  bool may_go_round(const GripFelts &felt) const;
  void go_round(double to_mm, double now_s);
  double room_mm(const GripFelts &felt, const GripSettings &settings, double coming_mm) const;
  double nearest_steps(double off, double least_mm, bool may_round) const;
  // Its own limit of force can be set to the cap.
  bool limits_itself(const GripSettings &settings) const;

  GripperTraits traits_;
  GripperStatus status_;
  GripRubber rubber_;
  GripBound bound_;
  bool is_heard_ = false;
  double target_mm_ = 0.0;
  double aimed_s_ = 0.0; // when it last changed for a force
  double poll_s_ = 0.0;
  double stood_s_ = 0.0; // of the first answer that it stands, since it last moved
  bool goes_round_ = false;
  double round_mm_ = 0.0; // where to
  int rounds_ = 0;
  struct Width {
    double t_s, width_mm;
  };
  std::array<Width, 64> widths_{}; // ring
  std::size_t newest_ = 0, count_ = 0;
};

} // namespace fingertip
