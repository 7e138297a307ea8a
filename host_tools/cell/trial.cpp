#include "cell/trial.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <stdexcept>

namespace fingertip::cell {
namespace {

enum Stream : std::uint64_t { FINGER = 821, LINE };

constexpr double NEVER_s = std::numeric_limits<double>::infinity();
constexpr double MOVES_s = 2.5e-4, STANDS_s = 1e-3; // between two looks at the gripper
constexpr double PATIENCE_s = 8.0;                  // until the controller holds
constexpr double LOST_N = 0.01, TOUCHED_N = 0.05, MORE_FORCE = 1.05;
constexpr double JOINED_s = 0.03; // what goes on after less rest is one slip
constexpr double SAMPLED_s = 2e-3, NEAR = 0.1;

std::int32_t in_um(double mm) {
  return static_cast<std::int32_t>(std::lround(1e3 * mm));
}

std::uint64_t in_us(double s) {
  return static_cast<std::uint64_t>(std::llround(1e6 * s));
}

grip_status status_of(const GripperMotion &motion, double t_s) {
  const GripperStatus said = motion.status();
  grip_status status{};
  status.t_us = in_us(t_s);
  status.width_um = in_um(said.width_mm);
  status.is_active = said.active;
  status.is_moving = said.moving;
  status.object = static_cast<std::uint8_t>(!said.object   ? GRIP_OBJECT_UNKNOWN
                                            : *said.object ? GRIP_OBJECT_HELD
                                                           : GRIP_OBJECT_NONE);
  status.fault = said.fault;
  return status;
}

bool holds(const grip_report &report) {
  return report.state == GRIP_HOLDING || report.state == GRIP_SLIPPING;
}

// Slips, and what the grip did about each.
class Slips {
public:
  void look(double t_s, const Cell &cell) {
    if (cell.slips()) {
      if (t_s - last_s_ > JOINED_s) {
        end();
        slip_ = Slip{t_s, 0.0, {}};
        begin_N_ = cell.force_N();
        begin_mm_ = cell.slid_mm();
      }
      last_s_ = t_s;
    }
    if (slip_) {
      slip_->way_mm = cell.slid_mm() - begin_mm_;
      if (!slip_->reaction_s && cell.force_N() >= MORE_FORCE * begin_N_) {
        slip_->reaction_s = t_s - slip_->begin_s;
      }
    }
  }
  void end() {
    if (slip_ && slip_->way_mm >= SLIP_mm) {
      slips.push_back(*slip_);
    }
    slip_.reset();
  }
  std::vector<Slip> slips;

private:
  std::optional<Slip> slip_;
  double begin_N_ = 0.0, begin_mm_ = 0.0, last_s_ = -NEVER_s;
};

// A force that is to be held.
class SetPoint {
public:
  explicit SetPoint(const Trial &trial) : trial_(trial) {}
  void look(double t_s, double felt_N, double width_mm, double touched_s) {
    const double off = felt_N / trial_.set_N - 1.0;
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
    }
    if (t_s - touched_s > 0.5 * trial_.still_s && width_mm != width_mm_) {
      const int direction = width_mm > width_mm_ ? 1 : -1;
      reversals_ += direction_ == -direction;
      direction_ = direction;
    }
    width_mm_ = width_mm;
  }
  void tell(Outcome &outcome) const {
    outcome.settle_s = settle_s_;
    outcome.rms = samples_ > 0 ? std::sqrt(squares_ / samples_) : 0.0;
    outcome.reversals = reversals_;
  }

private:
  const Trial &trial_;
  double near_s_ = NEVER_s, width_mm_ = 0.0, squares_ = 0.0;
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
  Run(const Trial &trial, const Face &face, Controller &controller,
      const std::function<void(const Moment &)> &trace)
      : trial_(trial), controller_(controller), trace_(trace),
        cell_(face, trial.scene.object, trial.scene.grasp),
        motion_(trial.gripper), fingers_{FeltFinger(face, trial.rubber[0], trial.sensing,
                                                    Random(trial.seed, FINGER, 0)),
                                         FeltFinger(face, trial.rubber[1], trial.sensing,
                                                    Random(trial.seed, FINGER, 1))},
        set_point_(trial) {
    motion_.blocked_at = [this](double width_mm, double force_N) {
      return force_N > 0.0 && cell_.force_at_N(width_mm) >= force_N;
    };
    stand_open();
    Random random(trial.seed, LINE, 0);
    exchange_s_ = random.uniform(0.0, trial.gripper.traits.poll_s);
  }

  Outcome go() {
    while (!over_) {
      double next_s = std::min({fingers_[0].next_s(), fingers_[1].next_s(), exchange_s_, sample_s_,
                                t_s_ + (motion_.moving() || cell_.slips() ? MOVES_s : STANDS_s)});
      for (const Known &known : line_) {
        next_s = std::min(next_s, known.at_s);
      }
      advance(next_s);
      deliver();
      for (std::size_t f = 0; f < fingers_.size(); f++) {
        if (fingers_[f].next_s() <= t_s_) {
          const FeltFinger::Frame frame = fingers_[f].feel(cell_.touch(f));
          line_.push_back({frame.known_s, f, frame.touch, {}});
        }
      }
      if (exchange_s_ <= t_s_) {
        exchange();
      }
      if (sample_s_ <= t_s_) {
        sample();
      }
    }
    return tell();
  }

private:
  static constexpr std::size_t STATUS = 2; // comes from the gripper

  struct Known { // on its way
    double at_s;
    std::size_t from;
    grip_touch touch;
    grip_status status;
  };

  // Ready for this object, before the time begins.
  void stand_open() {
    constexpr double STEP_s = 0.01, LONGEST_s = 30.0;
    motion_.activate();
    while (!motion_.active() && motion_.time_s() < LONGEST_s) {
      motion_.step(STEP_s);
    }
    GripperMove move;
    move.width_mm = trial_.scene.object.width_mm + trial_.scene.opens_mm;
    move.speed_mm_s = motion_.mechanics().traits.speed_max_mm_s;
    motion_.move(move);
    motion_.step(motion_.mechanics().traits.latency_s + STEP_s);
    while (motion_.moving() && motion_.time_s() < LONGEST_s) {
      motion_.step(STEP_s);
    }
  }

  double since_lift_s(double t_s) const { return t_s - lift_s_; }

  void advance(double to_s) {
    const double seconds = to_s - t_s_;
    if (seconds <= 0.0) {
      return;
    }
    motion_.step(seconds);
    // Before the lift, whenever it is.
    const double since_s = lift_s_ < NEVER_s ? since_lift_s(t_s_ + 0.5 * seconds) : -1.0;
    Drive drive = trial_.scene.drive(since_s);
    drive.width_mm = motion_.width_mm();
    cell_.run(seconds, drive);
    t_s_ = to_s;
    const double force_N = cell_.force_N();
    outcome_.peak_N = std::max(outcome_.peak_N, force_N);
    if (force_N > TOUCHED_N) {
      touched_s_ = std::min(touched_s_, t_s_);
    }
    if (lift_s_ < NEVER_s) {
      slips_.look(since_lift_s(t_s_), cell_);
      if (since_lift_s(t_s_) <= trial_.scene.lift_s) {
        outcome_.lift_slip_mm = cell_.slid_mm();
      }
    }
    const Vector way = cell_.way_mm();
    outcome_.dropped = std::hypot(way.x, way.y) >= DROP_mm ||
                       (lift_s_ < NEVER_s && !drive.table && force_N < LOST_N);
    const bool lifted = lift_s_ < NEVER_s && since_lift_s(t_s_) >= trial_.scene.ends_s;
    const bool stood = trial_.still_s > 0.0 && t_s_ - touched_s_ >= trial_.still_s;
    outcome_.never_held = lift_s_ == NEVER_s && trial_.still_s == 0.0 && t_s_ > PATIENCE_s;
    over_ = outcome_.dropped || outcome_.never_held || lifted || stood ||
            (trial_.still_s > 0.0 && t_s_ > trial_.still_s + PATIENCE_s);
  }

  void step_controller() {
    report_ = controller_.step(in_us(t_s_), command_);
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
    for (auto known = line_.begin(); known != line_.end();) {
      if (known->at_s > t_s_) {
        ++known;
        continue;
      }
      if (known->from == STATUS) {
        controller_.take_status(known->status);
      } else {
        controller_.take_touch(static_cast<unsigned>(known->from), known->touch);
        felt_[known->from] = known->touch;
      }
      known = line_.erase(known);
      step_controller();
    }
  }

  void exchange() {
    const double poll_s = trial_.gripper.traits.poll_s;
    if (command_.motion == GRIP_ACTIVATE) {
      motion_.activate();
    } else if (command_.motion == GRIP_MOVE &&
               (command_.width_um != sent_.width_um || command_.speed_um_s != sent_.speed_um_s)) {
      motion_.move({.width_mm = 1e-3 * command_.width_um,
                    .speed_mm_s = 1e-3 * command_.speed_um_s,
                    .force_N = 1e-3 * command_.force_mN});
      sent_ = command_;
    }
    line_.push_back({t_s_ + 0.5 * poll_s, STATUS, {}, status_of(motion_, t_s_)});
    exchange_s_ += poll_s;
  }

  void sample() {
    sample_s_ += SAMPLED_s;
    const double felt_N = 5e-4 * (felt_[0].force_mN + felt_[1].force_mN);
    if (trial_.still_s > 0.0 && touched_s_ < NEVER_s) {
      set_point_.look(t_s_, felt_N, 1e-3 * sent_.width_um, touched_s_);
    }
    const double since_s = lift_s_ < NEVER_s ? since_lift_s(t_s_) : -1.0;
    if (since_s >= trial_.scene.lift_s) {
      margins_.push_back(cell_.force_N() / trial_.scene.least_N(since_s));
    }
    if (trace_) {
      const twin::Touch one = cell_.touch(0), other = cell_.touch(1);
      const Vector way = cell_.way_mm();
      Moment moment{};
      moment.t_s = t_s_;
      moment.lift_s = since_s;
      moment.width_mm = motion_.width_mm();
      moment.force_N = cell_.force_N();
      moment.least_N = trial_.scene.least_N(since_s);
      moment.load_N = 0.5 * (std::hypot(one.pull_x_N, one.pull_y_N) +
                             std::hypot(other.pull_x_N, other.pull_y_N));
      moment.way_mm = way.dot(cell_.down());
      moment.slid_mm = cell_.slid_mm();
      moment.turned_rad = cell_.turned_rad();
      moment.friction = 0.5 * (cell_.friction(0) + cell_.friction(1));
      moment.slips = cell_.slips();
      moment.felt_N = felt_N;
      moment.felt_load_N = 1e-3 * report_.load_mN;
      moment.wanted_N = 1e-3 * report_.wanted_mN;
      moment.state = report_.state;
      moment.trouble = report_.trouble;
      trace_(moment);
    }
  }

  Outcome tell() {
    slips_.end();
    outcome_.held = !outcome_.dropped && !outcome_.never_held;
    outcome_.crushed = outcome_.peak_N > trial_.scene.object.crushes_N;
    outcome_.slid_mm = cell_.slid_mm();
    outcome_.turned_rad = cell_.turned_rad();
    outcome_.disturbance_slip_mm = outcome_.slid_mm - outcome_.lift_slip_mm;
    outcome_.margin = median(margins_);
    outcome_.holding_s = held_s_ < NEVER_s && touched_s_ < NEVER_s ? held_s_ - touched_s_ : 0.0;
    outcome_.slips = slips_.slips;
    if (trial_.still_s > 0.0) {
      set_point_.tell(outcome_);
    }
    return outcome_;
  }

  const Trial &trial_;
  Controller &controller_;
  const std::function<void(const Moment &)> &trace_;
  Cell cell_;
  GripperMotion motion_;
  std::array<FeltFinger, 2> fingers_;
  std::deque<Known> line_;
  std::array<grip_touch, 2> felt_{};
  grip_command command_{}, sent_{};
  grip_report report_{};
  Outcome outcome_;
  Slips slips_;
  SetPoint set_point_;
  std::vector<double> margins_;
  bool over_ = false;
  double t_s_ = 0.0, exchange_s_ = 0.0, sample_s_ = 0.0;
  double touched_s_ = NEVER_s, held_s_ = NEVER_s, lift_at_s_ = NEVER_s, lift_s_ = NEVER_s;
};

} // namespace

CoreController::CoreController(const grip_settings &settings, const grip_traits &traits) {
  if (grip_init(&core_, &settings, &traits) != FT_OK) {
    throw std::runtime_error("the controller refuses its settings");
  }
  grip_request(&core_, GRIP_REQUEST_GRASP);
}

void CoreController::take_touch(unsigned finger, const grip_touch &touch) {
  grip_take_touch(&core_, finger, &touch);
}

void CoreController::take_status(const grip_status &status) {
  grip_take_status(&core_, &status);
}

grip_report CoreController::step(std::uint64_t now_us, grip_command &command) {
  grip_report report;
  grip_step(&core_, now_us, &command, &report);
  return report;
}

grip_traits traits_of(const GripperTraits &traits) {
  grip_traits told{};
  told.stroke_um = in_um(traits.stroke_mm);
  told.step_um = in_um(traits.step_mm);
  told.deadband_um = in_um(traits.deadband_mm);
  told.speed_min_um_s = in_um(traits.speed_min_mm_s);
  told.speed_max_um_s = in_um(traits.speed_max_mm_s);
  told.force_min_mN = in_um(traits.force_min_N);
  told.force_max_mN = in_um(traits.force_max_N);
  told.latency_us = static_cast<std::int32_t>(std::lround(1e6 * traits.latency_s));
  told.poll_us = static_cast<std::int32_t>(std::lround(1e6 * traits.poll_s));
  return told;
}

Outcome run_trial(const Trial &trial, const Face &face, Controller &controller,
                  const std::function<void(const Moment &)> &trace) {
  return Run(trial, face, controller, trace).go();
}

} // namespace fingertip::cell
