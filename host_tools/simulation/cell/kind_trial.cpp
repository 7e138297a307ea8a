#include "simulation/cell/kind_trial.hpp"

#include "libfingertip/random.hpp"
#include "library/pad/profile.hpp"
#include "simulation/cell/cell.hpp"
#include "simulation/player/native_stages.h"
#include "simulation/twin/effects.hpp"

extern "C" {
#include "common/contact_flags.h"
}

#include <algorithm>
#include <cmath>
#include <deque>
#include <memory>

namespace fingertip::cell {
namespace {

enum Stream : std::uint64_t { TIP = 871, LINE, FAULT };

constexpr double NEVER_s = std::numeric_limits<double>::infinity();
// A frame takes its conversion, of which the middle is its time; then it is read, fitted and sent. The
// stages of the emulated chip at 410 Hz add up to some 1.6 ms after the conversion.
constexpr double CONVERSION_s = 2.3e-3, PROCESSING_s = 1.6e-3;
constexpr double NOISE_Pa = 5.0, STARTS_s = 2.0; // of a sensor; until it has a zero
constexpr double STEPS_s = 0.01, PATIENCE_s = 12.0, SAMPLED_s = 2e-3;
constexpr double NEAR = 0.1, SETTLED_s = 0.5; // of a set force
constexpr double APART_mm = 1e3, FREE_mm = 0.5, TOUCHED_N = 0.05, LOST_N = 0.01;
constexpr double BEGINS_s = 12.0; // a fault, at the latest
constexpr double LIFTS_AFTER_s = 0.8, POURS_AFTER_s = 1.2, POURS_s = 0.4;
constexpr double SLICK_s = 0.05, SLICK_SHARE = 0.9;
constexpr double SWINGS_mm = 0.05; // a width that turns by less makes no difference
constexpr double HUNTS_s = 0.5;

std::uint64_t in_us(double s) { return static_cast<std::uint64_t>(std::llround(1e6 * s)); }

// The reports of one fingertip: a pad with the errors of real ones, calibrated, and the firmware's own code.
class Tip {
public:
  Tip(const GraspTrial &trial, const Face &face, std::size_t finger)
      : kind_(trial.grasp.pads[finger]), face_(face), period_s_(1.0 / trial.rate_Hz), random_(trial.seed, TIP, finger),
        rubber_(twin::parse_effects("gain=8,memory,aftereffect"), SENSORS, LAYER_mm, AIR_Pa, random_.next()),
        firmware_(nullptr, native_stages_free), sensed_Pa_(SENSORS), next_s_(random_.uniform(0.0, period_s_)) {
    const pad_profile profile = pad::profile_over_own_sensors({LAYER_mm, 0.0, false});
    Pressures gain = rubber_.gain_errors();
    std::for_each(gain.begin(), gain.end(), [](double &each) { each += 1.0; });
    const calibration stored = calibrated(gain, GAIN_SD, kind_.gain, profile, random_);
    firmware_.reset(native_stages_new(&stored, trial.estimates_load ? &profile : nullptr));
    for (double t_s = 0.0; t_s < STARTS_s; t_s += period_s_) {
      frame(t_s, {});
    }
  }
  double next_s() const { return next_s_; }
  void skip() { next_s_ += period_s_; }
  bool is_lost(double share) { return random_.uniform(0.0, 1.0) < share; }
  // From next_s on its way.
  double known_s(double jitter_s, double later_s) {
    known_s_ = std::max(known_s_, next_s_ + 0.5 * std::min(CONVERSION_s, period_s_) + std::min(PROCESSING_s, period_s_) + kind_.delay_s +
                                      later_s + jitter_s * std::abs(random_.normal()));
    return known_s_;
  }

  GripTouch measure(const Patch &patch) { return touch_from_packet(frame(STARTS_s + next_s_, patch), 1e6 * next_s_); }

private:
  wire_packet frame(double t_s, const Patch &patch) {
    rubber_.report(t_s, face_.base_Pa(patch), sensed_Pa_);
    std::array<std::int32_t, FT_MAX_SENSORS> q10{};
    for (std::size_t k = 0; k < SENSORS; k++) {
      q10[k] = static_cast<std::int32_t>(std::lround(1024.0 * (AIR_Pa + sensed_Pa_[k] + NOISE_Pa * random_.normal())));
    }
    wire_packet packet{};
    native_stages_frame(firmware_.get(), in_us(t_s), q10.data(), static_cast<std::int32_t>(1024.0 * NOISE_Pa), &packet);
    return packet;
  }

  const PadProperties &kind_;
  const Face &face_;
  double period_s_;
  Random random_;
  twin::Pad rubber_;
  std::unique_ptr<native_stages, void (*)(native_stages *)> firmware_;
  Pressures sensed_Pa_;
  double next_s_, known_s_ = 0.0;
};

// How often a commanded width turns.
struct Reversals {
  int count = 0, direction = 0;
  double mm = 0.0;
  void sample(double to_mm, bool counts) {
    if (!counts || (direction != 0 && direction * (to_mm - mm) >= 0.0)) {
      mm = to_mm; // goes on
    } else if (std::abs(to_mm - mm) >= SWINGS_mm) {
      count += direction != 0;
      direction = to_mm > mm ? 1 : -1;
      mm = to_mm;
    }
  }
};

// A force that is to be held.
class SetPoint {
public:
  explicit SetPoint(const GraspTrial &trial) : trial_(trial) {}
  void sample(double t_s, double sensed_N, double width_mm, double touched_s) {
    const double off = sensed_N / trial_.set_N - 1.0;
    if (!settle_s_) {
      near_s_ = std::abs(off) > NEAR ? NEVER_s : std::min(near_s_, t_s);
      if (t_s - near_s_ >= SETTLED_s) {
        settle_s_ = near_s_ - touched_s;
      }
    }
    if (settle_s_) {
      squares_ += off * off;
      samples_++;
    }
    turns_.sample(width_mm, t_s - touched_s >= 0.5 * trial_.still_s);
  }
  void fill(TrialOutcome &outcome) const {
    outcome.settle_s = settle_s_;
    outcome.rms = samples_ > 0 ? std::sqrt(squares_ / samples_) : 0.0;
    outcome.reversals = turns_.count;
  }

private:
  const GraspTrial &trial_;
  double near_s_ = NEVER_s, squares_ = 0.0;
  Reversals turns_;
  std::optional<double> settle_s_;
  int samples_ = 0;
};

class TrialRun {
public:
  TrialRun(const GraspTrial &trial, const Face &face, Controller &controller, const TrialTrace &trace)
      : trial_(trial), grasp_(trial.grasp), controller_(controller), trace_(trace), cell_(make_cell(grasp_)),
        gripper_(slowed(trial), trial.activates ? trial.gripper.traits.stroke_mm : grasp_.width_mm + grasp_.opens_mm,
                 Random(trial.seed, LINE, 0)),
        tips_{Tip(trial, face, 0), Tip(trial, face, 1)}, faults_(trial.fault.value_or(Fault()), Random(trial.seed, FAULT, 0)),
        set_point_(trial), is_between_(!trial.activates) {
    if (trial.activates) {
      gripper_.motion().power_off();
    }
    gripper_.motion().blocked_at = [this](double width_mm, double force_N) {
      return is_between_ && force_N > 0.0 && cell_->force_at_N(width_mm) >= force_N;
    };
  }

  TrialOutcome go() {
    while (!over_) {
      t_s_ += Cell::STEP_s;
      gripper_.motion().step(Cell::STEP_s);
      cell_->run(Cell::STEP_s, is_between_ ? width_mm() : APART_mm, inputs());
      observe();
      deliver();
      if (t_s_ - stepped_s_ >= STEPS_s) {
        step_controller();
      }
      measure();
      if (gripper_.next_s() <= t_s_) {
        exchange();
      }
      if (t_s_ >= sample_s_) {
        sample();
      }
    }
    return outcome();
  }

private:
  static GripperMechanics slowed(const GraspTrial &trial) {
    GripperMechanics mechanics = trial.gripper;
    mechanics.traits.poll_s *= trial.grasp.poll_factor;
    return mechanics;
  }

  double since_lift_s() const { return t_s_ - lift_s_; }
  double width_mm() const { return gripper_.motion().width_mm(); }

  // Those of the grasp, and what the trial adds.
  GraspScenario::Inputs inputs() {
    GraspScenario::Inputs inputs = grasp_.inputs(since_lift_s());
    if (trial_.slick_after_s && since_lift_s() >= *trial_.slick_after_s) {
      if (slick_s_ == NEVER_s) {
        slick_s_ = t_s_;
        slick_share_ = std::min(1.0, SLICK_SHARE * least_N_ / std::max(cell_->mean_N(), LOST_N));
      }
      inputs.friction_share *= 1.0 - std::min(1.0, (t_s_ - slick_s_) / SLICK_s) * (1.0 - slick_share_);
    }
    if (trial_.fault && trial_.fault->is_followed_by_pouring && lift_s_ < NEVER_s) {
      const double poured = (t_s_ - faults_.begins_s() - POURS_AFTER_s) / POURS_s;
      inputs.mass_kg += grasp_.mass_kg * std::clamp(poured, 0.0, 1.0);
    }
    return inputs;
  }

  void measure() {
    for (std::size_t i = 0; i < tips_.size(); i++) {
      Tip &tip = tips_[i];
      if (tip.next_s() > t_s_) {
        continue;
      }
      const auto touch = faults_.frame(i, tip.measure(is_between_ ? cell_->patch(i) : Patch()));
      const bool gone = static_cast<int>(i) == grasp_.gone && lift_s_ < NEVER_s && since_lift_s() >= grasp_.gone_s;
      if (!tip.is_lost(grasp_.lost_share) && !gone && touch) {
        arrivals_.push_back(
            {tip.known_s(grasp_.jitter_s, trial_.later_s), [this, i, touch = *touch] { controller_.take_touch(i, touch); }});
      }
      tip.skip();
    }
  }

  // In the order in which it was sent; after each the controller may step.
  void deliver() {
    for (auto arrival = arrivals_.begin(); arrival != arrivals_.end();) {
      if (arrival->at_s > t_s_) {
        ++arrival;
        continue;
      }
      arrival->take();
      arrival = arrivals_.erase(arrival);
      step_controller();
    }
  }

  void exchange() {
    const Faults::Line line = faults_.line(t_s_);
    const bool waits = t_s_ < answered_s_;
    GripperLine::Answer answer = gripper_.exchange(line.commands && !waits ? command_ : gripper_.sent());
    if (waits || !line.answers) {
      return;
    }
    if (line.late_s > 0.0) {
      answer.known_s = answered_s_ = answer.known_s + line.late_s;
      answer.status.host_us += std::llround(0.5e6 * line.late_s); // the exchange's middle
    }
    answer.status.fault = faults_.is(Fault::Kind::fault, t_s_) ? 9 : answer.status.fault;
    arrivals_.push_back({answer.known_s, [this, status = answer.status] { controller_.take_status(status); }});
  }

  void step_controller() {
    report_ = controller_.step(t_s_, command_);
    stepped_s_ = t_s_;
    faults_.watch(t_s_, report_.state);
    if (faults_.has_begun(t_s_)) {
      outcome_.failed.trouble |= report_.trouble;
      outcome_.failed.state = report_.state;
      outcome_.failed.gripper_fault = report_.gripper_fault;
      if (report_.state == GRIP_RELEASE && !outcome_.failed.released_s) {
        outcome_.failed.released_s = since_lift_s();
      }
    }
    if (trial_.asked && !has_asked_ && t_s_ >= held_s_ + trial_.asked_after_s) {
      has_asked_ = true;
      controller_.ask(*trial_.asked);
    }
    const bool holds = report_.state == GRIP_HOLDING || report_.state == GRIP_SLIPPING;
    if (holds && held_s_ == NEVER_s) {
      held_s_ = t_s_;
      if (trial_.still_s == 0.0) {
        lift_s_ = std::min(lift_s_, t_s_ + grasp_.waits_s);
      }
    }
  }

  // Of a fault, when it begins and from then on.
  void fail() {
    if (!faults_.has_begun(t_s_)) {
      over_ = t_s_ >= BEGINS_s;
      return;
    }
    FaultOutcome &failed = outcome_.failed;
    if (!failed.begun) {
      failed.begun = true;
      began_mm_ = width_mm();
      failed.before_N = outcome_.dropped ? 0.0 : cell_->mean_N();
      if (is_between_) {
        lift_s_ = std::min(lift_s_, t_s_ + LIFTS_AFTER_s);
      }
      if (faults_.is(Fault::Kind::power, t_s_)) {
        gripper_.motion().power_off();
      } else if (faults_.is(Fault::Kind::fault, t_s_)) {
        gripper_.motion().stop();
      }
      is_taken_ = is_taken_ || faults_.is(Fault::Kind::taken, t_s_);
    }
    failed.after_N = std::max(failed.after_N, cell_->mean_N());
    is_taken_ = is_taken_ || outcome_.dropped;
    is_between_ = is_between_ && !is_taken_;
    if (is_between_) {
      failed.opened_mm = std::max(failed.opened_mm, width_mm() - began_mm_);
    }
    over_ = t_s_ >= faults_.begins_s() + trial_.fault->watched_s;
  }

  void observe() {
    const double since_s = since_lift_s(), force_N = cell_->mean_N();
    const bool lifts = since_s >= 0.0;
    outcome_.peak_N = std::max({outcome_.peak_N, cell_->force_N(0), cell_->force_N(1)});
    touched_s_ = force_N > TOUCHED_N ? std::min(touched_s_, t_s_) : touched_s_;
    if (!is_between_ && !is_taken_) {
      is_between_ = gripper_.motion().active() && width_mm() > grasp_.width_mm + FREE_mm;
    }
    if (!lifts) {
      outcome_.first_N = std::max(outcome_.first_N, force_N);
      outcome_.never_held = t_s_ > PATIENCE_s && lift_s_ == NEVER_s && trial_.still_s == 0.0;
    } else {
      least_N_ = grasp_.least_N(since_s);
      slips_.sample(since_s, cell_->slips(), force_N, cell_->slid_mm(), since_s >= grasp_.lift_s ? least_N_ : 0.0);
      outcome_.turned_deg = std::max(outcome_.turned_deg, std::abs(cell_->turned_rad()) * 180.0 / M_PI);
      const Vector way = cell_->way_mm();
      outcome_.dropped = cell_->slid_mm() >= DROP_mm || std::hypot(way.x, way.y) >= DROP_mm;
    }
    const bool waited = trial_.still_s > 0.0 && (t_s_ >= touched_s_ + trial_.still_s || t_s_ > trial_.still_s + PATIENCE_s);
    over_ = outcome_.dropped || outcome_.never_held || waited || (lifts && since_s >= grasp_.ends_s);
    if (trial_.fault) {
      fail();
    }
  }

  void sample() {
    sample_s_ += SAMPLED_s;
    const double since_s = since_lift_s();
    if (since_s >= grasp_.lift_s) {
      margins_.push_back(cell_->mean_N() / least_N_);
    }
    const double sent_mm = gripper_.sent().width_mm;
    if (trial_.still_s > 0.0 && touched_s_ < NEVER_s) {
      const auto [low_N, high_N] = std::minmax(report_.finger_N[0], report_.finger_N[1]);
      set_point_.sample(t_s_, trial_.set_of_smaller ? low_N : 0.5 * (low_N + high_N), sent_mm, touched_s_);
    }
    turns_.sample(sent_mm, since_s >= grasp_.steady_s);
    if (trace_) {
      const Vector one = cell_->load_N(0), other = cell_->load_N(1);
      trace_({{"t_s", t_s_},
              {"lift_s", std::max(since_s, -1.0)},
              {"width_mm", width_mm()},
              {"force_N", cell_->mean_N()},
              {"least_N", since_s >= 0.0 ? least_N_ : 0.0},
              {"load_N", 0.5 * (std::hypot(one.x, one.y) + std::hypot(other.x, other.y))},
              {"way_mm", -cell_->way_mm().y},
              {"slid_mm", cell_->slid_mm()},
              {"slips", cell_->slips()},
              {"sensed_N", report_.force_N}});
    }
  }

  TrialOutcome outcome() {
    outcome_.slides = report_.slides;
    outcome_.friction = 2.0 * report_.friction / (cell_->friction(0) + cell_->friction(1));
    outcome_.slid_mm = cell_->slid_mm();
    outcome_.crushed = outcome_.peak_N > grasp_.crushes_N;
    outcome_.catches = slips_.slips;
    outcome_.hunts = !outcome_.dropped && turns_.count / (grasp_.ends_s - grasp_.steady_s) >= HUNTS_s;
    if (!margins_.empty()) {
      const auto middle = margins_.begin() + static_cast<std::ptrdiff_t>(margins_.size() / 2);
      std::nth_element(margins_.begin(), middle, margins_.end());
      outcome_.margin = *middle;
    }
    if (trial_.still_s > 0.0) {
      set_point_.fill(outcome_);
    }
    return outcome_;
  }

  const GraspTrial &trial_;
  const GraspScenario &grasp_;
  Controller &controller_;
  const TrialTrace &trace_;
  std::unique_ptr<Cell> cell_;
  GripperLine gripper_;
  std::array<Tip, 2> tips_;
  struct Arrival { // of a touch or of the gripper's answer at the controller
    double at_s;
    std::function<void()> take;
  };
  std::deque<Arrival> arrivals_;
  Faults faults_;
  SetPoint set_point_;
  GripCommand command_{};
  GripReport report_{};
  TrialOutcome outcome_;
  Slips slips_;
  std::vector<double> margins_;
  bool over_ = false, is_between_, is_taken_ = false, has_asked_ = false;
  double t_s_ = 0.0, stepped_s_ = 0.0, sample_s_ = 0.0, answered_s_ = 0.0, touched_s_ = NEVER_s;
  double held_s_ = NEVER_s, lift_s_ = NEVER_s, slick_s_ = NEVER_s, slick_share_ = 1.0;
  double least_N_ = 0.0, began_mm_ = 0.0;
  Reversals turns_;
};

} // namespace

TrialOutcome run_trial(const GraspTrial &trial, const Face &face, Controller &controller, const TrialTrace &trace) {
  return TrialRun(trial, face, controller, trace).go();
}

} // namespace fingertip::cell
