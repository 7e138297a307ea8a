#include "simulation/cell/gripper_motion.hpp"

#include <algorithm>
#include <cmath>

namespace fingertip {

constexpr double LEAST_FORCE_N = 1e-3; // that takes up the backlash

// The servo's: one degree on a jaw of 100 mm, as users of such arms report.
constexpr double SERVO_BACKLASH_mm = 1.75;
// From the reset to gSTA 3 with both ends searched for; no figure is public.
constexpr double ROBOTIQ_ACTIVATION_s = 2.0;

GripperMechanics gripper_mechanics(const std::string &model) {
  if (model == "ideal") {
    return {{{85.0, 0.01, 0.0, 0.1, 250.0, 0.0, 200.0, 0.003, 0.001}, model}};
  }
  const GripperTraits &traits = gripper_traits(model);
  const bool is_servo = traits.driver == GripperDriver::feetech;
  return {traits, is_servo ? SERVO_BACKLASH_mm : 0.0, is_servo ? 0.0 : ROBOTIQ_ACTIVATION_s};
}

GripperMotion::GripperMotion(const GripperMechanics &mechanics, std::optional<double> active_mm)
    : mechanics_(mechanics), phase_(active_mm ? Phase::active : Phase::off),
      drive_mm_(nearest_step_mm(active_mm.value_or(mechanics.traits.stroke_mm))), fingers_mm_(drive_mm_), target_mm_(drive_mm_),
      speed_mm_s_(mechanics.traits.speed_max_mm_s), force_N_(mechanics.traits.force_max_N) {}

double GripperMotion::nearest_step_mm(double width_mm) const {
  const GripperTraits &traits = mechanics_.traits;
  width_mm = std::clamp(width_mm, 0.0, traits.stroke_mm);
  if (traits.step_mm <= 0) {
    return width_mm;
  }
  /* Steps are counted from closed. */
  return std::clamp(std::round(width_mm / traits.step_mm) * traits.step_mm, 0.0, traits.stroke_mm);
}

void GripperMotion::activate() {
  power_off();
  phase_ = mechanics_.activation_s > 0 ? Phase::opening : Phase::active;
  phase_began_s_ = time_s_;
  target_mm_ = drive_mm_;
}

void GripperMotion::power_off() {
  commands_.clear();
  asked_.reset();
  phase_ = Phase::off;
  moving_ = false;
  blocked_ = 0;
}

void GripperMotion::move(const GripCommand &move) {
  const bool same = asked_ && asked_->width_mm == move.width_mm && asked_->speed_mm_s == move.speed_mm_s && asked_->force_N == move.force_N;
  if (active() && !same) {
    asked_ = move;
    commands_.push_back({time_s_ + mechanics_.traits.latency_s, false, move});
  }
}

void GripperMotion::stop() {
  if (active()) {
    asked_.reset();
    commands_.push_back({time_s_ + mechanics_.traits.latency_s, true, {}});
  }
}

void GripperMotion::take(const Command &command) {
  const GripperTraits &traits = mechanics_.traits;
  target_mm_ = nearest_step_mm(command.move.width_mm);
  moving_ = !command.stop && std::abs(target_mm_ - drive_mm_) >= traits.deadband_mm;
  target_mm_ = moving_ ? target_mm_ : drive_mm_;
  if (!command.stop) {
    speed_mm_s_ = std::clamp(command.move.speed_mm_s, traits.speed_min_mm_s, traits.speed_max_mm_s);
    force_N_ = std::clamp(command.move.force_N, traits.force_min_N, traits.force_max_N);
  }
}

void GripperMotion::follow() {
  const double half_mm = mechanics_.backlash_mm / 2;
  fingers_mm_ = std::clamp(fingers_mm_, drive_mm_ - half_mm, drive_mm_ + half_mm);
  if (half_mm > 0 && blocks(fingers_mm_, LEAST_FORCE_N)) {
    fingers_mm_ = drive_mm_ + half_mm;
  }
  fingers_mm_ = std::clamp(fingers_mm_, 0.0, mechanics_.traits.stroke_mm);
}

void GripperMotion::drive_to(double target_mm, double speed_mm_s, double force_N, double seconds) {
  const double way_mm = std::min(speed_mm_s * seconds, std::abs(target_mm - drive_mm_));
  const int direction = target_mm > drive_mm_ ? 1 : -1;
  const double from_mm = drive_mm_;
  /* Where the fingers will be, the drive having gone so far: an object pushes them apart. */
  const double play_mm = direction < 0 ? mechanics_.backlash_mm / 2 : -mechanics_.backlash_mm / 2;
  const auto is_blocked = [&](double gone_mm) { return blocks(from_mm + direction * gone_mm + play_mm, -direction * force_N); };
  blocked_ = 0;
  if (way_mm == 0.0) {
    return;
  }
  if (!is_blocked(way_mm)) {
    drive_mm_ = way_mm < std::abs(target_mm - from_mm) ? from_mm + direction * way_mm : target_mm;
    return;
  }
  double free_mm = 0.0, stuck_mm = way_mm;
  while (stuck_mm - free_mm > 1e-3) {
    const double middle_mm = (free_mm + stuck_mm) / 2;
    (is_blocked(middle_mm) ? stuck_mm : free_mm) = middle_mm;
  }
  drive_mm_ = from_mm + direction * free_mm;
  blocked_ = direction;
}

void GripperMotion::run(double seconds) {
  const GripperTraits &traits = mechanics_.traits;
  if (activating()) {
    /* Each search takes its share of the time, however far it has to go. */
    const double share_s = mechanics_.activation_s / 3;
    const double target_mm = phase_ == Phase::closing ? 0.0 : traits.stroke_mm;
    drive_to(target_mm, 1.5 * traits.stroke_mm / share_s, traits.force_max_N, seconds);
    follow();
    if (time_s_ - phase_began_s_ >= share_s - 1e-9) {
      phase_ = static_cast<Phase>(static_cast<int>(phase_) + 1);
      phase_began_s_ = time_s_;
      blocked_ = 0;
      target_mm_ = drive_mm_;
    }
    return;
  }
  if (moving_ || blocked_ != 0) {
    drive_to(target_mm_, speed_mm_s_, force_N_, seconds);
    moving_ = blocked_ == 0 && drive_mm_ != target_mm_;
  }
  follow();
}

void GripperMotion::step(double seconds) {
  const double end_s = time_s_ + seconds;
  while (!commands_.empty() && commands_.front().due_s <= end_s) {
    const Command command = commands_.front();
    commands_.pop_front();
    const double before_s = std::max(time_s_, command.due_s) - time_s_;
    time_s_ = std::max(time_s_, command.due_s);
    run(before_s);
    blocked_ = 0;
    take(command);
  }
  const double rest_s = end_s - time_s_;
  time_s_ = end_s;
  run(rest_s);
}

double GripperMotion::effort() const {
  if (blocked_ != 0) {
    return force_N_ / std::max(mechanics_.traits.force_max_N, 1e-9);
  }
  const double full = 0.3; // of the largest, while nothing is in the way
  return activating() ? full : moving_ ? full * speed_mm_s_ / mechanics_.traits.speed_max_mm_s : 0.0;
}

GripperStatus GripperMotion::status() const {
  const std::optional<bool> object = moving() ? std::nullopt : std::optional(blocked_ != 0);
  return {.active = active(), .moving = moving(), .object = object, .width_mm = reported_width_mm()};
}

GripperLine::GripperLine(const GripperMechanics &mechanics, double width_mm, Random random)
    : motion_(mechanics, width_mm), next_s_(random.uniform(0.0, mechanics.traits.poll_s)) {}

GripperLine::Answer GripperLine::exchange(const GripCommand &command) {
  const double t_s = next_s_, poll_s = motion_.mechanics().traits.poll_s;
  if (command.motion == GRIP_ACTIVATE && sent_.motion != GRIP_ACTIVATE) {
    motion_.activate();
    sent_ = command;
  } else if (command.motion == GRIP_MOVE && (command.width_mm != sent_.width_mm || command.speed_mm_s != sent_.speed_mm_s)) {
    motion_.move(command);
    sent_ = command;
  }
  next_s_ += poll_s;
  GripperStatus status = motion_.status();
  status.host_us = std::llround(1e6 * t_s);
  return {t_s + 0.5 * poll_s, status};
}

} // namespace fingertip
