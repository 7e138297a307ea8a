// A gripper of one Feetech STS3215 that turns one jaw against a fixed one, as an SO-101's.
//
// The width between the pads is that of a chord: 2 jaw sin(angle / 2). The angle counts from where the pads touch.
// Counts of the ends and the jaw's length are options (GripperWay). The defaults are a jaw of 100 mm that touches at
// 2048 and opens by a radian, 652 counts, to 96 mm. The pads are parallel only where they touch.
//
// Its force limit is a share of the stall torque, 1.9 Nm at 7.4 V by the maker's figures, over the
// jaw. This is only a guess of the force in newtons: friction in the gears is at least as large.
#pragma once

#include "grasp/gripper/common.hpp"
#include "grasp/gripper/feetech_table.hpp"

namespace fingertip {

class Jaw {
public:
  Jaw(int closed_count, int open_count, double jaw_mm);
  // The jaw of this way, or the usual one.
  explicit Jaw(const GripperWay &complete);

  double stroke_mm() const { return width_mm(open_); }
  double step_mm() const; // of one count, closed, where it is the largest
  // Below 0 beyond where the pads touch.
  double width_mm(double count) const;
  // The count of a width from 0 to the stroke.
  double count(double width_mm) const;
  // The change of width for one count, at this width.
  double slope_mm(double width_mm) const;

private:
  int closed_, open_;
  double jaw_mm_;
};

// The usual jaw's, and what the servo can do on it.
GripperTraits feetech_traits(const std::string &model, const Jaw &jaw, double jaw_mm);
// GripperWay, completed by the defaults. Throws Error: bad_value.
GripperWay feetech_way(const GripperWay &way);

class FeetechGripper final : public Gripper, AskedLine {
public:
  explicit FeetechGripper(const GripperWay &given);

  const GripperTraits &traits() const override { return traits_; }
  std::string line() const override;
  // Torque on, at the position where it is.
  void activate() override;
  GripperStatus poll() override;
  GripperStatus move(const GripperMove &move) override;
  // Several bits may be set.
  std::string fault_text(std::uint8_t fault) const override;

private:
  Heard take(const Bytes &question, std::size_t length, Bytes *came, std::size_t *noise, Bytes *payload) override;
  std::pair<Bytes, std::size_t> sure_question(int number) const override;
  Bytes question_of(std::uint8_t instruction, const Bytes &parameters) const;
  Bytes read(std::uint8_t address, std::uint8_t length);
  void write(std::uint8_t address, const Bytes &values);
  void command(double count, int speed, int torque);

  Jaw jaw_;
  GripperTraits traits_;
  int servo_model_ = 0;
  bool active_ = false; // by the last status
  std::int64_t commanded_us_ = 0;
  double goal_count_ = -1;
};

} // namespace fingertip
