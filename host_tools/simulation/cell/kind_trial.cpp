#include "simulation/cell/kind_trial.hpp"

#include "libfingertip/clock.hpp"
#include "libfingertip/random.hpp"
#include "simulation/cell/cell.hpp"
#include "simulation/cell/gripper_line.hpp"

extern "C" {
#include "common/contact_flags.h"
#include "contact/motion.h"
#include "contact/slip.h"
}

#include <algorithm>
#include <cmath>
#include <deque>

namespace fingertip::cell {
namespace {

enum Stream : std::uint64_t { TIP = 871, LINE, FAULT };

constexpr double NEVER_s = std::numeric_limits<double>::infinity();
// A frame takes its conversion, of which the middle is its time; then it is read, fitted and sent. The
// stages of the emulated chip at 410 Hz add up to some 1.6 ms after the conversion.
constexpr double CONVERSION_s = 2.3e-3, PROCESSING_s = 1.6e-3;
constexpr double FORCE_NOISE = 0.004, FORCE_NOISE_N = 0.01, LOAD_NOISE_N = 0.015, PLACE_NOISE_mm = 0.012;
constexpr double GATE_N = 0.05; // less is no contact
// The twin's Gaussians on 12 mm of rubber: their sigma, and how far a tangential force as large as the normal one moves them.
constexpr double POINT_mm = 6.0, LINE_mm = 7.2, AREA_mm = 14.0, PULLED = 0.55, PULLED_mm = 3.9;
constexpr std::uint32_t SLIP_WINDOW_us = 100000;
constexpr float SLIP_mm = 0.75F;
constexpr double STEPS_s = 0.01, PATIENCE_s = 12.0, SAMPLED_s = 2e-3;
constexpr double NEAR = 0.1, SETTLED_s = 0.5; // of a set force
constexpr double APART_mm = 1e3, FREE_mm = 0.5, TOUCHED_N = 0.05, LOST_N = 0.01;
constexpr double BEGINS_s = 12.0; // a fault, at the latest
constexpr double LIFTS_AFTER_s = 0.8, POURS_AFTER_s = 1.2, POURS_s = 0.4;
constexpr double SLICK_s = 0.05, SLICK_SHARE = 0.9;
constexpr double SWINGS_mm = 0.05; // a width that turns by less makes no difference
constexpr double HUNTS_s = 0.5;

std::uint64_t in_us(double s) { return static_cast<std::uint64_t>(std::llround(1e6 * s)); }

// The reports of one fingertip.
class Tip {
public:
  Tip(const KindTrial &trial, std::size_t finger)
      : pad_(trial.grasp.pads[finger]), mirror_(finger == 0 ? 1.0 : -1.0), load_share_(trial.load_share),
        sigma_mm_(sigma_of(trial.grasp.shape)), noise_(trial.noise), period_s_(1.0 / trial.rate_Hz), random_(trial.seed, TIP, finger),
        next_s_(random_.uniform(0.0, period_s_)) {
    settings_.force_scale = settings_.tangential_scale = 1.0F;
  }
  double next_s() const { return next_s_; }
  void skip() { next_s_ += period_s_; }
  bool is_lost(double share) { return random_.uniform(0.0, 1.0) < share; }
  // From next_s on its way.
  double known_s(double jitter_s, double later_s) {
    known_s_ = std::max(known_s_, next_s_ + 0.5 * std::min(CONVERSION_s, period_s_) + std::min(PROCESSING_s, period_s_) + pad_.delay_s +
                                      later_s + jitter_s * std::abs(random_.normal()));
    return known_s_;
  }

  GripTouch measure(double force_N, const Vector &load_N, const Vector &way_mm) {
    GripTouch touch{};
    touch.t_s = next_s_;
    const double sensed_N =
        pad_.gain * force_N * (1.0 + noise_ * FORCE_NOISE * random_.normal()) + noise_ * FORCE_NOISE_N * random_.normal();
    contact_input input{};
    input.t_us = in_us(next_s_);
    input.contact = sensed_N > GATE_N;
    fit_result fitted{};
    fitted.used = 0x7fff;
    input.fit = &fitted;
    fit_tangential found{};
    contact_result result{};
    ::motion moved{};
    const bool has_load = load_share_ > 0.0 && sigma_mm_ == POINT_mm;
    if (input.contact) {
      const double share = 1.0 / std::max(force_N, GATE_N);
      const auto noise = [&](double sd) { return noise_ * sd * random_.normal(); };
      found.valid = true;
      found.force_N = static_cast<float>(sensed_N);
      const double load_gain = load_share_ * pad_.gain;
      found.qx_N = static_cast<float>(mirror_ * (load_gain * load_N.x + pad_.ratio.x * sensed_N) + noise(LOAD_NOISE_N));
      found.qy_N = static_cast<float>(load_gain * load_N.y + pad_.ratio.y * sensed_N + noise(LOAD_NOISE_N));
      const double moved_mm = share * (has_load ? pad_.crosstalk : std::min(PULLED * sigma_mm_, PULLED_mm));
      found.x_mm = static_cast<float>(mirror_ * (way_mm.x + moved_mm * load_N.x) + noise(PLACE_NOISE_mm));
      found.y_mm = static_cast<float>(way_mm.y + moved_mm * load_N.y + noise(PLACE_NOISE_mm));
      found.location_noise_mm = static_cast<float>(PLACE_NOISE_mm);
      found.location_sd_mm = 0.1F;
      input.tangential = has_load ? &found : nullptr;
      result.flags = CONTACT_FLAG_CONTACT | CONTACT_FLAG_FIT_VALID | CONTACT_FLAG_UNCERTAINTY_VALID | CONTACT_FLAG_TARED |
                     CONTACT_FLAG_CALIBRATED | std::uint32_t{has_load ? CONTACT_FLAG_TANGENTIAL_VALID : CONTACT_FLAG_UNCERTAIN};
      float slip_mm = 0.0F;
      if (slip_update(&slips_, input.t_us, found.x_mm, found.y_mm, SLIP_WINDOW_us, &slip_mm) && slip_mm > SLIP_mm) {
        result.flags |= CONTACT_FLAG_SLIP;
      }
    } else {
      slip_reset(&slips_);
    }
    motion_update(&history_, &settings_, &input, &result, &moved);
    touch.flags = result.flags;
    if (input.contact) {
      touch.force_N = sensed_N;
      touch.force_sd_N = 0.05 * sensed_N;
      touch.x_mm = static_cast<double>(found.x_mm);
      touch.y_mm = static_cast<double>(found.y_mm);
      touch.sigma_mm = sigma_mm_;
      touch.qx_N = has_load ? static_cast<double>(found.qx_N) : 0.0;
      touch.qy_N = has_load ? static_cast<double>(found.qy_N) : 0.0;
      touch.q_sd_N = 0.05 * sensed_N;
      touch.speed_x_mm_s = static_cast<double>(moved.vx_mm_s);
      touch.speed_y_mm_s = static_cast<double>(moved.vy_mm_s);
    }
    return touch;
  }

private:
  static double sigma_of(Shape shape) {
    const bool area = shape == Shape::box || shape == Shape::plate;
    return shape == Shape::ball || shape == Shape::egg ? POINT_mm : area ? AREA_mm : LINE_mm;
  }

  KindOfPad pad_;
  double mirror_, load_share_, sigma_mm_, noise_, period_s_;
  Random random_;
  tangential_settings settings_{};
  motion_history history_{};
  slip_history slips_{};
  double next_s_, known_s_ = 0.0;
};

// A force that is to be held.
class SetPoint {
public:
  explicit SetPoint(const KindTrial &trial) : trial_(trial) {}
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
    if (t_s - touched_s < 0.5 * trial_.still_s) {
      width_mm_ = width_mm;
    } else if (std::abs(width_mm - width_mm_) > SWINGS_mm) {
      const int direction = width_mm > width_mm_ ? 1 : -1;
      reversals_ += direction_ == -direction;
      direction_ = direction;
      width_mm_ = width_mm;
    }
  }
  void fill(KindOutcome &outcome) const {
    outcome.settle_s = settle_s_;
    outcome.rms = samples_ > 0 ? std::sqrt(squares_ / samples_) : 0.0;
    outcome.reversals = reversals_;
  }

private:
  const KindTrial &trial_;
  double near_s_ = NEVER_s, width_mm_ = 0.0, squares_ = 0.0;
  std::optional<double> settle_s_;
  int samples_ = 0, direction_ = 0, reversals_ = 0;
};

class KindRun {
public:
  KindRun(const KindTrial &trial, Controller &controller, const KindTrace &trace)
      : trial_(trial), grasp_(trial.grasp), controller_(controller), trace_(trace), cell_(grasp_),
        gripper_(slowed(trial), trial.activates ? trial.gripper.traits.stroke_mm : grasp_.width_mm + grasp_.opens_mm,
                 Random(trial.seed, LINE, 0)),
        tips_{Tip(trial, 0), Tip(trial, 1)}, faults_(trial.fault.value_or(Fault()), Random(trial.seed, FAULT, 0)), set_point_(trial),
        is_between_(!trial.activates) {
    if (trial.activates) {
      gripper_.motion().power_off();
    }
    gripper_.motion().blocked_at = [this](double width_mm, double force_N) {
      return is_between_ && force_N > 0.0 && cell_.force_at_N(width_mm) >= force_N;
    };
  }

  KindOutcome go() {
    while (!over_) {
      t_s_ += Cell::STEP_s;
      gripper_.motion().step(Cell::STEP_s);
      cell_.run(Cell::STEP_s, is_between_ ? width_mm() : APART_mm, inputs());
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
  static GripperMechanics slowed(const KindTrial &trial) {
    GripperMechanics mechanics = trial.gripper;
    mechanics.traits.poll_s *= trial.grasp.poll_factor;
    return mechanics;
  }

  double since_lift_s() const { return t_s_ - lift_s_; }
  double width_mm() const { return gripper_.motion().width_mm(); }

  // Those of the grasp, and what the trial adds.
  KindOfGrasp::Inputs inputs() {
    KindOfGrasp::Inputs inputs = grasp_.inputs(since_lift_s());
    if (trial_.slick_after_s && since_lift_s() >= *trial_.slick_after_s) {
      if (slick_s_ == NEVER_s) {
        slick_s_ = t_s_;
        slick_share_ = std::min(1.0, SLICK_SHARE * least_N_ / std::max(cell_.mean_N(), LOST_N));
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
      const auto touch = faults_.frame(i, tip.measure(cell_.force_N(i), cell_.load_N(i), cell_.way_mm()));
      const bool gone = static_cast<int>(i) == grasp_.gone && lift_s_ < NEVER_s && since_lift_s() >= grasp_.gone_s;
      if (!tip.is_lost(grasp_.lost_share) && !gone && touch) {
        arrivals_.push_back({tip.known_s(grasp_.jitter_s, trial_.later_s), [this, i, touch = *touch] {
                               controller_.take_touch(i, touch);
                               sensed_N_[i] = touch.force_N;
                             }});
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
    const std::int64_t began_us = steady_now_us();
    report_ = controller_.step(t_s_, command_);
    stepping_us_ += static_cast<double>(steady_now_us() - began_us);
    steps_++;
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
    Failed &failed = outcome_.failed;
    if (!failed.begun) {
      failed.begun = true;
      began_mm_ = width_mm();
      failed.before_N = cell_.mean_N();
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
    failed.after_N = std::max(failed.after_N, cell_.mean_N());
    is_taken_ = is_taken_ || outcome_.dropped;
    is_between_ = is_between_ && !is_taken_;
    if (is_between_) {
      failed.opened_mm = std::max(failed.opened_mm, width_mm() - began_mm_);
    }
    over_ = t_s_ >= faults_.begins_s() + trial_.fault->watched_s;
  }

  void observe() {
    const double since_s = since_lift_s(), force_N = cell_.mean_N();
    const bool lifts = since_s >= 0.0;
    outcome_.peak_N = std::max({outcome_.peak_N, cell_.force_N(0), cell_.force_N(1)});
    touched_s_ = force_N > TOUCHED_N ? std::min(touched_s_, t_s_) : touched_s_;
    if (!is_between_ && !is_taken_) {
      is_between_ = gripper_.motion().active() && width_mm() > grasp_.width_mm + FREE_mm;
    }
    if (!lifts) {
      outcome_.first_N = std::max(outcome_.first_N, force_N);
      outcome_.never_held = t_s_ > PATIENCE_s && lift_s_ == NEVER_s && trial_.still_s == 0.0;
    } else {
      least_N_ = grasp_.least_N(since_s);
      slips_.sample(since_s, cell_.slips(), force_N, cell_.slid_mm(), since_s >= grasp_.lift_s ? least_N_ : 0.0);
      outcome_.turned_deg = std::max(outcome_.turned_deg, std::abs(cell_.turned_rad()) * 180.0 / M_PI);
      const Vector way = cell_.way_mm();
      outcome_.dropped = cell_.slid_mm() >= DROP_mm || std::hypot(way.x, way.y) >= DROP_mm;
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
      margins_.push_back(cell_.mean_N() / least_N_);
    }
    const double sent_mm = gripper_.sent().width_mm;
    if (trial_.still_s > 0.0 && touched_s_ < NEVER_s) {
      const auto [low_N, high_N] = std::minmax(sensed_N_[0], sensed_N_[1]);
      set_point_.sample(t_s_, trial_.set_of_smaller ? low_N : 0.5 * (low_N + high_N), sent_mm, touched_s_);
    }
    if (since_s < grasp_.steady_s) {
      turned_mm_ = sent_mm;
    } else if (direction_ * (sent_mm - turned_mm_) >= 0.0 && direction_ != 0) {
      turned_mm_ = sent_mm; // goes on
    } else if (std::abs(sent_mm - turned_mm_) >= SWINGS_mm) {
      reversals_ += direction_ != 0;
      direction_ = sent_mm > turned_mm_ ? 1 : -1;
      turned_mm_ = sent_mm;
    }
    if (trace_) {
      const Vector one = cell_.load_N(0), other = cell_.load_N(1);
      trace_({{"t_s", t_s_},
              {"lift_s", std::max(since_s, -1.0)},
              {"width_mm", width_mm()},
              {"force_N", cell_.mean_N()},
              {"least_N", since_s >= 0.0 ? least_N_ : 0.0},
              {"load_N", 0.5 * (std::hypot(one.x, one.y) + std::hypot(other.x, other.y))},
              {"way_mm", -cell_.way_mm().y},
              {"slid_mm", cell_.slid_mm()},
              {"slips", cell_.slips()},
              {"sensed_N", report_.force_N}});
    }
  }

  KindOutcome outcome() {
    outcome_.step_us = stepping_us_ / std::max(steps_, 1.0);
    outcome_.slides = report_.slides;
    outcome_.friction = 2.0 * report_.friction / (cell_.friction(0) + cell_.friction(1));
    outcome_.slid_mm = cell_.slid_mm();
    outcome_.crushed = outcome_.peak_N > grasp_.crushes_N;
    outcome_.catches = slips_.slips;
    outcome_.hunts = !outcome_.dropped && reversals_ / (grasp_.ends_s - grasp_.steady_s) >= HUNTS_s;
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

  const KindTrial &trial_;
  const KindOfGrasp &grasp_;
  Controller &controller_;
  const KindTrace &trace_;
  Cell cell_;
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
  KindOutcome outcome_;
  Slips slips_;
  std::vector<double> margins_;
  std::array<double, 2> sensed_N_{};
  bool over_ = false, is_between_, is_taken_ = false, has_asked_ = false;
  double t_s_ = 0.0, stepped_s_ = 0.0, sample_s_ = 0.0, answered_s_ = 0.0, touched_s_ = NEVER_s;
  double held_s_ = NEVER_s, lift_s_ = NEVER_s, slick_s_ = NEVER_s, slick_share_ = 1.0;
  double least_N_ = 0.0, turned_mm_ = 0.0, began_mm_ = 0.0;
  double stepping_us_ = 0.0, steps_ = 0.0;
  int reversals_ = 0, direction_ = 0;
};

} // namespace

KindOutcome run_kind(const KindTrial &trial, Controller &controller, const KindTrace &trace) {
  return KindRun(trial, controller, trace).go();
}

} // namespace fingertip::cell
