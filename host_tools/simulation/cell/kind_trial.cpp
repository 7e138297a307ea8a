#include "simulation/cell/kind_trial.hpp"

#include "libfingertip/random.hpp"
#include "simulation/cell/arrivals.hpp"
#include "simulation/cell/gripper_line.hpp"
#include "simulation/cell/pinch.hpp"
#include "simulation/cell/simulated_fingertip.hpp"
#include "simulation/cell/slips.hpp"
#include "simulation/cell/trial.hpp"

extern "C" {
#include "common/contact_flags.h"
#include "contact/motion.h"
}

#include <algorithm>
#include <cmath>

namespace fingertip::cell {
namespace {

enum Stream : std::uint64_t { TIP = 871, LINE };

constexpr double NEVER_s = std::numeric_limits<double>::infinity();
constexpr double RATE_Hz = 410.0, CONVERSION_s = 2.3e-3;
constexpr double FORCE_NOISE = 0.004, FORCE_NOISE_N = 0.01, LOAD_NOISE_N = 0.015, PLACE_NOISE_mm = 0.012;
constexpr double GATE_N = 0.05; // less is no contact
constexpr double STEPS_s = 0.01, PATIENCE_s = 12.0, SAMPLED_s = 2e-3;
constexpr double JOINED_s = 0.03, MORE_FORCE = 1.05, AFTER_s = 1.0;
constexpr double SWINGS_mm = 0.05; // a width that turns by less makes no difference
constexpr double HUNTS_s = 0.5;

std::uint64_t in_us(double s) { return static_cast<std::uint64_t>(std::llround(1e6 * s)); }

// The reports of one fingertip.
class Tip {
public:
  Tip(const KindOfPad &pad, double mirror, Random random)
      : pad_(pad), mirror_(mirror), random_(random), next_s_(random_.uniform(0.0, 1.0 / RATE_Hz)) {
    settings_.force_scale = settings_.tangential_scale = 1.0F;
  }
  double next_s() const { return next_s_; }
  void skip() { next_s_ += 1.0 / RATE_Hz; }
  bool is_lost(double share) { return random_.uniform(0.0, 1.0) < share; }
  // From next_s on its way.
  double known_s(double jitter_s, double later_s) {
    known_s_ = std::max(known_s_, next_s_ + 0.5 * CONVERSION_s + PROCESSING_s + pad_.delay_s + later_s +
                                      jitter_s * std::abs(random_.normal()));
    return known_s_;
  }

  GripTouch measure(double force_N, const Vector &load_N, const Vector &way_mm) {
    GripTouch touch{};
    touch.t_s = next_s_;
    const double sensed_N =
        pad_.gain * force_N * (1.0 + FORCE_NOISE * random_.normal()) + FORCE_NOISE_N * random_.normal();
    contact_input input{};
    input.t_us = in_us(next_s_);
    input.contact = sensed_N > GATE_N;
    fit_result fitted{};
    fitted.used = 0x7fff;
    input.fit = &fitted;
    fit_tangential found{};
    contact_result result{};
    ::motion moved{};
    if (input.contact) {
      const double share = 1.0 / std::max(force_N, GATE_N);
      const auto noise = [&](double sd) { return sd * random_.normal(); };
      found.valid = true;
      found.force_N = static_cast<float>(sensed_N);
      found.qx_N = static_cast<float>(mirror_ * (pad_.gain * load_N.x + pad_.ratio.x * sensed_N) + noise(LOAD_NOISE_N));
      found.qy_N = static_cast<float>(pad_.gain * load_N.y + pad_.ratio.y * sensed_N + noise(LOAD_NOISE_N));
      found.x_mm = static_cast<float>(mirror_ * (way_mm.x + pad_.crosstalk * load_N.x * share) + noise(PLACE_NOISE_mm));
      found.y_mm = static_cast<float>(way_mm.y + pad_.crosstalk * load_N.y * share + noise(PLACE_NOISE_mm));
      found.location_noise_mm = static_cast<float>(PLACE_NOISE_mm);
      found.location_sd_mm = 0.1F;
      input.tangential = &found;
      result.flags = CONTACT_FLAG_CONTACT | CONTACT_FLAG_FIT_VALID | CONTACT_FLAG_UNCERTAINTY_VALID |
                     CONTACT_FLAG_TARED | CONTACT_FLAG_CALIBRATED | CONTACT_FLAG_TANGENTIAL_VALID;
    }
    motion_update(&history_, &settings_, &input, &result, &moved);
    touch.flags = result.flags;
    if (input.contact) {
      touch.force_N = sensed_N;
      touch.force_sd_N = 0.05 * sensed_N;
      touch.x_mm = static_cast<double>(found.x_mm);
      touch.y_mm = static_cast<double>(found.y_mm);
      touch.sigma_mm = 6.0;
      touch.qx_N = static_cast<double>(found.qx_N);
      touch.qy_N = static_cast<double>(found.qy_N);
      touch.q_sd_N = 0.05 * sensed_N;
      touch.speed_mm_s = speed_of(moved);
    }
    return touch;
  }

private:
  KindOfPad pad_;
  double mirror_;
  Random random_;
  tangential_settings settings_{};
  motion_history history_{};
  double next_s_, known_s_ = 0.0;
};

// Slides and what came of them.
class CatchBook {
public:
  void look(double t_s, const Pinch &pinch, double least_N) {
    if (pinch.slips()) {
      if (t_s - last_s_ > JOINED_s) {
        end();
        now_ = Catch{t_s, 0.0, {}, 0.0, 0.0};
        begin_N_ = pinch.mean_N();
        begin_mm_ = pinch.slid_mm();
      }
      last_s_ = t_s;
    }
    if (now_ && t_s - last_s_ <= JOINED_s) {
      now_->way_mm = pinch.slid_mm() - begin_mm_;
      if (!now_->reaction_s && pinch.mean_N() >= MORE_FORCE * begin_N_) {
        now_->reaction_s = t_s - now_->begin_s;
      }
    }
    if (now_ && t_s - last_s_ > JOINED_s) {
      end();
    }
    const auto follow = [&](Catch &one) {
      one.peak_N = std::max(one.peak_N, pinch.mean_N());
      one.least_N = std::max(one.least_N, least_N);
    };
    if (now_) {
      follow(*now_);
    }
    if (!catches.empty() && t_s - ended_s_ < AFTER_s) {
      follow(catches.back());
    }
  }
  std::vector<Catch> catches;

private:
  void end() {
    if (now_ && now_->way_mm >= SLIP_mm) {
      catches.push_back(*now_);
      ended_s_ = last_s_;
    }
    now_.reset();
  }
  std::optional<Catch> now_;
  double begin_N_ = 0.0, begin_mm_ = 0.0, last_s_ = -NEVER_s, ended_s_ = -NEVER_s;
};

class KindRun {
public:
  KindRun(const KindTrial &trial, Controller &controller, const std::function<void(const KindMoment &)> &trace)
      : grasp_(trial.grasp), later_s_(trial.later_s), controller_(controller), trace_(trace), pinch_(grasp_),
        gripper_(slowed(trial), grasp_.width_mm + grasp_.opens_mm, Random(trial.seed, LINE, 0)),
        tips_{Tip(grasp_.pads[0], 1.0, Random(trial.seed, TIP, 0)),
              Tip(grasp_.pads[1], -1.0, Random(trial.seed, TIP, 1))} {
    gripper_.motion().blocked_at = [this](double width_mm, double force_N) {
      return force_N > 0.0 && pinch_.force_at_N(width_mm) >= force_N;
    };
  }

  KindOutcome go() {
    while (!over_) {
      t_s_ += Pinch::STEP_s;
      gripper_.motion().step(Pinch::STEP_s);
      const KindOfGrasp::Inputs inputs = grasp_.inputs(since_lift_s());
      pinch_.step(Pinch::STEP_s, gripper_.motion().width_mm(), inputs);
      look();
      deliver();
      if (t_s_ - stepped_s_ >= STEPS_s) {
        step_controller();
      }
      measure();
      if (gripper_.next_s() <= t_s_) {
        const GripperLine::Answer answer = gripper_.exchange(command_);
        arrivals_.status(answer.known_s, answer.status);
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

  void measure() {
    for (std::size_t i = 0; i < tips_.size(); i++) {
      Tip &tip = tips_[i];
      if (tip.next_s() > t_s_) {
        continue;
      }
      const GripTouch touch = tip.measure(pinch_.force_N(i), pinch_.load_N(i), pinch_.way_mm());
      const bool gone = static_cast<int>(i) == grasp_.gone && lift_s_ < NEVER_s && since_lift_s() >= grasp_.gone_s;
      if (!tip.is_lost(grasp_.lost_share) && !gone) {
        arrivals_.touch(tip.known_s(grasp_.jitter_s, later_s_), i, touch);
      }
      tip.skip();
    }
  }

  void deliver() {
    arrivals_.deliver(
        t_s_, controller_, [this](std::size_t, const GripTouch &) { step_controller(); },
        [this] { step_controller(); });
  }

  void step_controller() {
    report_ = controller_.step(t_s_, command_);
    stepped_s_ = t_s_;
    const bool holds = report_.state == GRIP_HOLDING || report_.state == GRIP_SLIPPING;
    if (holds && lift_s_ == NEVER_s) {
      outcome_.held_s = t_s_;
      lift_s_ = t_s_ + grasp_.waits_s;
    }
  }

  void look() {
    const double since_s = since_lift_s(), force_N = pinch_.mean_N();
    const bool lifts = since_s >= 0.0;
    outcome_.peak_N = std::max({outcome_.peak_N, pinch_.force_N(0), pinch_.force_N(1)});
    if (!lifts) {
      outcome_.first_N = std::max(outcome_.first_N, force_N);
      outcome_.never_held = t_s_ > PATIENCE_s && lift_s_ == NEVER_s;
    } else {
      least_N_ = grasp_.least_N(since_s);
      book_.look(since_s, pinch_, since_s >= grasp_.lift_s ? least_N_ : 0.0);
      const Vector way = pinch_.way_mm();
      outcome_.dropped = pinch_.slid_mm() >= DROP_mm || std::hypot(way.x, way.y) >= DROP_mm;
    }
    over_ = outcome_.dropped || outcome_.never_held || (lifts && since_s >= grasp_.ends_s);
  }

  void sample() {
    sample_s_ += SAMPLED_s;
    const double since_s = since_lift_s();
    if (since_s >= grasp_.lift_s) {
      margins_.push_back(pinch_.mean_N() / least_N_);
    }
    const double sent_mm = gripper_.sent().width_mm;
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
      const Vector one = pinch_.load_N(0), other = pinch_.load_N(1);
      trace_({t_s_, since_s, gripper_.motion().width_mm(), sent_mm, pinch_.force_N(0), pinch_.force_N(1),
              since_s >= 0.0 ? least_N_ : 0.0, 0.5 * (std::hypot(one.x, one.y) + std::hypot(other.x, other.y)),
              pinch_.slid_mm(), pinch_.slips(), report_});
    }
  }

  KindOutcome outcome() {
    outcome_.slid_mm = pinch_.slid_mm();
    outcome_.crushed = outcome_.peak_N > grasp_.crushes_N;
    outcome_.catches = book_.catches;
    outcome_.reversals_s = reversals_ / (grasp_.ends_s - grasp_.steady_s);
    outcome_.hunts = !outcome_.dropped && outcome_.reversals_s >= HUNTS_s;
    if (!margins_.empty()) {
      const auto middle = margins_.begin() + static_cast<std::ptrdiff_t>(margins_.size() / 2);
      std::nth_element(margins_.begin(), middle, margins_.end());
      outcome_.margin = *middle;
    }
    return outcome_;
  }

  const KindOfGrasp &grasp_;
  double later_s_;
  Controller &controller_;
  const std::function<void(const KindMoment &)> &trace_;
  Pinch pinch_;
  GripperLine gripper_;
  std::array<Tip, 2> tips_;
  Arrivals arrivals_;
  GripCommand command_{};
  GripReport report_{};
  KindOutcome outcome_;
  CatchBook book_;
  std::vector<double> margins_;
  bool over_ = false;
  double t_s_ = 0.0, stepped_s_ = 0.0, sample_s_ = 0.0, lift_s_ = NEVER_s;
  double least_N_ = 0.0, turned_mm_ = 0.0;
  int reversals_ = 0, direction_ = 0;
};

} // namespace

KindOutcome run_kind(const KindTrial &trial, Controller &controller,
                     const std::function<void(const KindMoment &)> &trace) {
  return KindRun(trial, controller, trace).go();
}

} // namespace fingertip::cell
