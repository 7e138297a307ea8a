#include "simulation/cell/trial.hpp"

#include "simulation/cell/arrivals.hpp"

#include <algorithm>
#include <cmath>

namespace fingertip::cell {
namespace {

enum Stream : std::uint64_t { FINGER = 821, LINE, FAULT };

constexpr double NEVER_s = std::numeric_limits<double>::infinity();
constexpr double MOVES_s = 2.5e-4, RESTS_s = 1e-3; // between two samples of the gripper
constexpr double PATIENCE_s = 8.0;                 // until the controller holds
constexpr double STEPS_s = 0.01;                   // without any input
constexpr double BEGINS_s = 12.0;                  // a fault, at the latest
constexpr double APART_mm = 1e3, FREE_mm = 0.5;
constexpr double LIFTS_AFTER_s = 0.8, POURS_AFTER_s = 1.2, POURS_s = 0.4, POURED = 1.0;
constexpr double SLICK_s = 0.05, SLICK_SHARE = 0.9;
constexpr double LOST_N = 0.01, TOUCHED_N = 0.05;
constexpr double SAMPLED_s = 2e-3, NEAR = 0.1;
constexpr double SWINGS_mm = 0.02; // a move that counts

std::int64_t in_us(double s) { return std::llround(1e6 * s); }

// Begins in no state.
Fault never() {
  Fault fault;
  fault.state = GRIP_STATES;
  return fault;
}

bool holds(const GripReport &report) { return report.state == GRIP_HOLDING || report.state == GRIP_SLIPPING; }

// A force that is to be held.
class SetPoint {
public:
  explicit SetPoint(const Trial &trial) : trial_(trial) {}
  // closed_mm: since the touch
  void sample(double t_s, double sensed_N, double width_mm, double touched_s, double closed_mm) {
    const double off = sensed_N / trial_.set_N - 1.0;
    if (std::abs(off) > NEAR && !settle_s_) {
      near_s_ = NEVER_s;
    } else if (!settle_s_) {
      near_s_ = std::min(near_s_, t_s);
      if (t_s - near_s_ >= SETTLED_s) {
        settle_s_ = near_s_ - touched_s;
      }
    }
    if (settle_s_) {
      squares_ += off * off;
      samples_++;
      // Rounding, uniform over a step; rubber's force grows as its indentation to the 1.6.
      const double step = 1.6 * trial_.gripper.traits.step_mm / std::max(closed_mm, 0.1);
      step_squares_ += step * step / 12.0;
    }
    if (t_s - touched_s < 0.5 * trial_.still_s) {
      width_mm_ = width_mm;
    } else if (std::abs(width_mm - width_mm_) > SWINGS_mm) {
      const int direction = width_mm > width_mm_ ? 1 : -1;
      reversals_ += direction_ == -direction;
      direction_ = direction;
      width_mm_ = width_mm;
    }
  }
  void fill(Outcome &outcome) const {
    outcome.settle_s = settle_s_;
    outcome.rms = samples_ > 0 ? std::sqrt(squares_ / samples_) : 0.0;
    outcome.rms_of_steps = samples_ > 0 ? std::sqrt(step_squares_ / samples_) : 0.0;
    outcome.reversals = reversals_;
  }

private:
  const Trial &trial_;
  double near_s_ = NEVER_s, width_mm_ = 0.0, squares_ = 0.0, step_squares_ = 0.0;
  std::optional<double> settle_s_;
  int samples_ = 0, direction_ = 0, reversals_ = 0;
};

double median(std::vector<double> &values) {
  if (values.empty()) {
    return 0.0;
  }
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

class Run {
public:
  Run(const Trial &trial, const Face &face, Controller &controller, const std::function<void(const Moment &)> &trace)
      : trial_(trial), controller_(controller), trace_(trace), cell_(face, trial.scene.object, trial.scene.grasp),
        gripper_(trial.gripper,
                 trial.activates ? trial.gripper.traits.stroke_mm : trial.scene.object.width_mm + trial.scene.opens_mm,
                 Random(trial.seed, LINE, 0)),
        fingers_{SimulatedFingertip(face, trial.rubber[0], trial.sensing, Random(trial.seed, FINGER, 0)),
                 SimulatedFingertip(face, trial.rubber[1], trial.sensing, Random(trial.seed, FINGER, 1))},
        set_point_(trial), faults_(trial.fault.value_or(never()), Random(trial.seed, FAULT, 0)) {
    if (trial.activates) {
      gripper_.motion().power_off();
    } else {
      put_between();
    }
  }

  Outcome go() {
    while (!over_) {
      const double next_s = std::min({fingers_[0].next_s(), fingers_[1].next_s(), gripper_.next_s(), sample_s_,
                                      stepped_s_ + STEPS_s, faults_.has_begun(t_s_) ? NEVER_s : faults_.begins_s(),
                                      t_s_ + (gripper_.motion().moving() || cell_.slips() ? MOVES_s : RESTS_s)});
      advance(std::min(next_s, arrivals_.next_s()));
      fail();
      deliver();
      if (stepped_s_ + STEPS_s <= t_s_) {
        step_controller();
      }
      for (std::size_t f = 0; f < fingers_.size(); f++) {
        if (fingers_[f].next_s() <= t_s_) {
          const double measured_s = fingers_[f].next_s();
          if (const auto frame = faults_.frame(f, fingers_[f].measure(touch(f)), measured_s)) {
            arrivals_.touch(frame->known_s, f, frame->touch);
          }
        }
      }
      if (gripper_.next_s() <= t_s_) {
        exchange();
      }
      if (sample_s_ <= t_s_) {
        sample();
      }
    }
    return outcome();
  }

private:
  double since_lift_s(double t_s) const { return t_s - lift_s_; }

  void put_between() {
    gripper_.press(cell_);
    is_between_ = true;
  }

  void take_away() {
    gripper_.motion().blocked_at = nullptr;
    is_between_ = false;
    is_taken_ = true;
  }

  double force_N() const { return is_between_ ? cell_.force_N() : 0.0; }

  twin::Touch touch(std::size_t finger) const { return is_between_ ? cell_.touch(finger) : twin::Touch{}; }

  // What the trial adds to its scene.
  void disturb(Drive &drive, double t_s) {
    if (trial_.slick_after_s && since_lift_s(t_s) >= *trial_.slick_after_s) {
      if (slick_s_ == NEVER_s) {
        slick_s_ = t_s;
        slick_share_ =
            std::min(1.0, SLICK_SHARE * trial_.scene.least_N(since_lift_s(t_s)) / std::max(cell_.force_N(), LOST_N));
      }
      const double gone = std::min(1.0, (t_s - slick_s_) / SLICK_s);
      drive.friction_share *= 1.0 - gone * (1.0 - slick_share_);
    }
    if (trial_.fault && lift_s_ < NEVER_s) {
      const double poured = (t_s - faults_.begins_s() - POURS_AFTER_s) / POURS_s;
      drive.mass_kg += POURED * trial_.scene.object.mass_kg * std::clamp(poured, 0.0, 1.0);
    }
    drive.width_mm = is_between_ ? gripper_.motion().width_mm() : APART_mm;
  }

  void fail() {
    if (!faults_.has_begun(t_s_)) {
      return;
    }
    const double width_mm = gripper_.motion().width_mm();
    if (!outcome_.failed.begun) {
      outcome_.failed.begun = true;
      began_mm_ = width_mm;
      if (is_between_) {
        lift_at_s_ = std::min(lift_at_s_, t_s_ + LIFTS_AFTER_s);
      }
      if (faults_.is(Fault::Kind::power, t_s_)) {
        gripper_.motion().power_off();
      } else if (faults_.is(Fault::Kind::fault, t_s_)) {
        gripper_.motion().stop();
      } else if (faults_.is(Fault::Kind::taken, t_s_)) {
        take_away();
      }
    }
    if (is_between_) {
      outcome_.failed.opened_mm = std::max(outcome_.failed.opened_mm, width_mm - began_mm_);
    }
    outcome_.failed.peak_N = std::max(outcome_.failed.peak_N, force_N());
  }

  void advance(double to_s) {
    const double seconds = to_s - t_s_;
    if (seconds <= 0.0) {
      return;
    }
    gripper_.motion().step(seconds);
    // Before the lift, whenever it is.
    const double since_s = lift_s_ < NEVER_s ? since_lift_s(t_s_ + 0.5 * seconds) : -1.0;
    Drive drive = trial_.scene.drive(since_s);
    disturb(drive, t_s_ + 0.5 * seconds);
    cell_.run(seconds, drive);
    t_s_ = to_s;
    if (!is_between_ && !is_taken_ && gripper_.motion().active() &&
        gripper_.motion().width_mm() > trial_.scene.object.width_mm + FREE_mm) {
      put_between();
    }
    outcome_.peak_N = std::max(outcome_.peak_N, force_N());
    if (force_N() > TOUCHED_N && touched_s_ == NEVER_s) {
      touched_s_ = t_s_;
      touched_mm_ = gripper_.motion().width_mm();
    }
    if (lift_s_ < NEVER_s) {
      slips_.look(since_lift_s(t_s_), cell_);
      if (since_lift_s(t_s_) <= trial_.scene.lift_s) {
        outcome_.lift_slip_mm = cell_.slid_mm();
      }
    }
    const Vector way = cell_.way_mm();
    outcome_.dropped = std::hypot(way.x, way.y) >= DROP_mm || (lift_s_ < NEVER_s && !drive.table && force_N() < LOST_N);
    if (trial_.fault) {
      if (outcome_.dropped && is_between_) {
        take_away();
      }
      over_ = faults_.has_begun(t_s_) ? t_s_ >= faults_.begins_s() + trial_.fault->watched_s : t_s_ >= BEGINS_s;
      return;
    }
    const bool lifted = lift_s_ < NEVER_s && since_lift_s(t_s_) >= trial_.scene.ends_s;
    const bool waited = trial_.still_s > 0.0 && t_s_ - touched_s_ >= trial_.still_s;
    outcome_.never_held = lift_s_ == NEVER_s && trial_.still_s == 0.0 && t_s_ > PATIENCE_s;
    over_ = outcome_.dropped || outcome_.never_held || lifted || waited ||
            (trial_.still_s > 0.0 && t_s_ > trial_.still_s + PATIENCE_s);
  }

  void step_controller() {
    report_ = controller_.step(t_s_, command_);
    stepped_s_ = t_s_;
    faults_.watch(t_s_, report_.state);
    if (faults_.has_begun(t_s_)) {
      outcome_.failed.trouble |= report_.trouble;
      outcome_.failed.state = report_.state;
      outcome_.failed.gripper_fault = report_.gripper_fault;
    }
    if (trial_.asked && !has_asked_ && t_s_ >= held_s_ + trial_.asked_after_s) {
      has_asked_ = true;
      controller_.ask(*trial_.asked);
    }
    if (holds(report_)) {
      outcome_.trouble |= report_.trouble;
      if (held_s_ == NEVER_s) {
        held_s_ = t_s_;
        if (trial_.still_s == 0.0) {
          lift_at_s_ = t_s_ + trial_.scene.waits_s;
        }
      }
    }
    if (lift_s_ == NEVER_s && t_s_ >= lift_at_s_) {
      lift_s_ = t_s_;
    }
  }

  void deliver() {
    arrivals_.deliver(
        t_s_, controller_,
        [this](std::size_t finger, const GripTouch &touch) {
          touches_[finger] = touch;
          step_controller();
        },
        [this] { step_controller(); });
  }

  void exchange() {
    const Faults::Line line = faults_.line(t_s_);
    const bool waits = t_s_ < answered_s_;
    const bool commands = line.commands && !waits;
    GripperLine::Answer answer = gripper_.exchange(commands ? command_ : gripper_.sent());
    if (waits || !line.answers) {
      return;
    }
    if (line.late_s > 0.0) {
      answered_s_ = answer.known_s + line.late_s;
      answer.known_s = answered_s_;
      answer.status.host_us += in_us(0.5 * line.late_s); /* the exchange's middle */
    }
    answer.status.fault = faults_.is(Fault::Kind::fault, t_s_) ? 9 : answer.status.fault;
    arrivals_.status(answer.known_s, answer.status);
  }

  void sample() {
    sample_s_ += SAMPLED_s;
    const double sensed_N = 0.5 * (touches_[0].force_N + touches_[1].force_N);
    if (trial_.still_s > 0.0 && touched_s_ < NEVER_s) {
      const double smaller_N = std::min(touches_[0].force_N, touches_[1].force_N);
      set_point_.sample(t_s_, trial_.set_of_smaller ? smaller_N : sensed_N, gripper_.sent().width_mm, touched_s_,
                        touched_mm_ - gripper_.motion().width_mm());
    }
    const double since_s = lift_s_ < NEVER_s ? since_lift_s(t_s_) : -1.0;
    if (since_s >= trial_.scene.lift_s) {
      margins_.push_back(cell_.force_N() / trial_.scene.least_N(since_s));
      if (force_N() > LOST_N) {
        reported_.push_back(sensed_N / force_N());
        taken_.push_back(report_.force_N / force_N());
      }
    }
    if (trace_) {
      const twin::Touch one = cell_.touch(0), other = cell_.touch(1);
      const Vector way = cell_.way_mm();
      Moment moment{};
      moment.t_s = t_s_;
      moment.lift_s = since_s;
      moment.width_mm = gripper_.motion().width_mm();
      moment.force_N = cell_.force_N();
      moment.least_N = trial_.scene.least_N(since_s);
      moment.load_N = 0.5 * (std::hypot(one.pull_x_N, one.pull_y_N) + std::hypot(other.pull_x_N, other.pull_y_N));
      moment.way_mm = way.dot(cell_.down());
      moment.slid_mm = cell_.slid_mm();
      moment.turned_rad = cell_.turned_rad();
      moment.friction = 0.5 * (cell_.friction(0) + cell_.friction(1));
      moment.slips = cell_.slips();
      moment.sensed_N = sensed_N;
      moment.sensed_load_N = report_.load_N;
      moment.wanted_N = report_.wanted_N;
      moment.state = report_.state;
      moment.trouble = report_.trouble;
      trace_(moment);
    }
  }

  Outcome outcome() {
    slips_.end();
    outcome_.held = !outcome_.dropped && !outcome_.never_held;
    outcome_.crushed = outcome_.peak_N > trial_.scene.object.crushes_N;
    outcome_.slid_mm = cell_.slid_mm();
    outcome_.turned_rad = cell_.turned_rad();
    outcome_.disturbance_slip_mm = outcome_.slid_mm - outcome_.lift_slip_mm;
    outcome_.margin = median(margins_);
    outcome_.force_reported = median(reported_);
    outcome_.force_taken = median(taken_);
    outcome_.holding_s = held_s_ < NEVER_s && touched_s_ < NEVER_s ? held_s_ - touched_s_ : 0.0;
    outcome_.slips = slips_.slips;
    if (trial_.still_s > 0.0) {
      set_point_.fill(outcome_);
    }
    return outcome_;
  }

  const Trial &trial_;
  Controller &controller_;
  const std::function<void(const Moment &)> &trace_;
  Cell cell_;
  GripperLine gripper_;
  std::array<SimulatedFingertip, 2> fingers_;
  Arrivals arrivals_;
  std::array<GripTouch, 2> touches_{};
  GripCommand command_{};
  GripReport report_{};
  Outcome outcome_;
  Slips slips_;
  SetPoint set_point_;
  Faults faults_;
  std::vector<double> margins_, reported_, taken_;
  bool over_ = false, is_between_ = false, is_taken_ = false, has_asked_ = false;
  double began_mm_ = 0.0, stepped_s_ = 0.0, answered_s_ = 0.0;
  double slick_s_ = NEVER_s, slick_share_ = 1.0;
  double t_s_ = 0.0, sample_s_ = 0.0;
  double touched_mm_ = 0.0, touched_s_ = NEVER_s, held_s_ = NEVER_s, lift_at_s_ = NEVER_s, lift_s_ = NEVER_s;
};

} // namespace

CoreController::CoreController(const GripSettings &settings, const GripperTraits &traits) : core_(settings, traits) {
  core_.request(GRIP_REQUEST_GRASP);
}

Outcome run_trial(const Trial &trial, const Face &face, Controller &controller,
                  const std::function<void(const Moment &)> &trace) {
  return Run(trial, face, controller, trace).go();
}

} // namespace fingertip::cell
