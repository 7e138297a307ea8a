#include "grasp/convert.hpp"
#include "simulation/cell/simulated_fingertip.hpp"
#include "simulation/cell/trial.hpp"

extern "C" {
#include "common/contact_flags.h"
}

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <iterator>
#include <set>

namespace {

using namespace fingertip;
using namespace fingertip::cell;

const Face &face() {
  static const Face made("sphere15", 12.0, FINGERTIP_TEST_TABLES);
  return made;
}

Rubber perfect() {
  Rubber rubber{};
  rubber.gain.fill(1.0);
  return rubber;
}

Trial trial(std::uint64_t n, const std::string &gripper = "ideal") {
  Trial made;
  made.scene = draw_scene({"sphere15"}, 77, n);
  made.gripper = gripper_mechanics(gripper);
  made.rubber = {perfect(), perfect()};
  made.seed = 100 + n;
  return made;
}

// A smooth lift of an object at rest, nothing else.
Trial calm(double mass_kg, double friction) {
  Trial made = trial(0);
  made.scene.object = {};
  made.scene.object.mass_kg = mass_kg;
  made.scene.object.friction = friction;
  made.scene.grasp = {};
  made.scene.grasp.relaxation = 0.0;
  made.scene.lift_mm = 5.0;
  made.scene.lift_s = 1.0;
  made.scene.disturbances.clear();
  made.scene.ends_s = 2.5;
  return made;
}

// Closes to a width and says after a while that it holds; and nothing more.
class ClosesTo : public Controller {
public:
  explicit ClosesTo(double width_mm) : width_mm_(width_mm) {}
  void take_touch(std::size_t finger, const GripTouch &touch) override { touches[finger].push_back(touch); }
  void take_status(const GripperStatus &status) override { told_mm.insert(status.width_mm); }
  GripReport step(double now_s, GripCommand &command) override {
    now_s_ = now_s;
    command = {{width_mm_, 20.0, 0.0}, GRIP_MOVE};
    GripReport report{};
    report.state = now_s > 1.5 ? GRIP_HOLDING : GRIP_SQUEEZE;
    for (const auto &one : touches) {
      if (!one.empty()) {
        latest_s = std::max(latest_s, now_s_ - one.back().t_s);
      }
    }
    return report;
  }
  std::array<std::vector<GripTouch>, 2> touches;
  std::set<double> told_mm;
  double latest_s = 0.0;

private:
  double width_mm_;
  double now_s_ = 0.0;
};

double width_mm(const Trial &trial, double force_N) {
  return trial.scene.object.width_mm - 2.0 * face().indentation_mm(force_N) - force_N / trial.scene.grasp.fingers_N_mm;
}

TEST(Trial, WhatDoesNothingDropsWhatPhysicsSays) {
  // What the lift adds to the weight takes 1 % of it.
  for (const double margin : {0.8, 0.95, 1.06, 1.5}) {
    const Trial one = calm(0.4, 0.5);
    const double least_N = 0.4 * GRAVITY_m_s2 / (2.0 * 0.5);
    ClosesTo controller(width_mm(one, margin * least_N));
    const Outcome outcome = run_trial(one, face(), controller);
    EXPECT_EQ(outcome.dropped, margin < 1.0) << margin;
    EXPECT_EQ(outcome.held, margin > 1.0) << margin;
    EXPECT_NEAR(outcome.margin, margin, 0.02);
    EXPECT_FALSE(outcome.never_held);
    if (margin < 1.0) {
      ASSERT_FALSE(outcome.slips.empty());
      EXPECT_FALSE(outcome.slips.back().reaction_s);
      EXPECT_GT(outcome.slid_mm, 0.9 * DROP_mm);
    } else {
      EXPECT_TRUE(outcome.slips.empty());
      EXPECT_LT(outcome.slid_mm, SLIP_mm);
    }
  }
}

TEST(Trial, CrushesWhatIsWeaker) {
  Trial one = calm(0.1, 0.8);
  one.scene.object.crushes_N = 4.0;
  ClosesTo gentle(width_mm(one, 3.5)), rough(width_mm(one, 4.5));
  EXPECT_FALSE(run_trial(one, face(), gentle).crushed);
  const Outcome outcome = run_trial(one, face(), rough);
  EXPECT_TRUE(outcome.crushed);
  EXPECT_NEAR(outcome.peak_N, 4.5, 0.1);
}

TEST(Trial, NeverHoldsWhereNothingCloses) {
  const Trial one = calm(0.2, 0.5);
  class Idle : public Controller {
  public:
    void take_touch(std::size_t, const GripTouch &) override {}
    void take_status(const GripperStatus &) override {}
    GripReport step(double, GripCommand &) override { return {}; }
  } idle;
  const Outcome outcome = run_trial(one, face(), idle);
  EXPECT_TRUE(outcome.never_held);
  EXPECT_FALSE(outcome.held);
  EXPECT_FALSE(outcome.dropped);
}

TEST(Trial, FramesAndStatusComeAsTheyWould) {
  for (const double rate_Hz : {20.0, 100.0, 410.0, 1308.0}) {
    Trial one = calm(0.2, 0.8);
    one.gripper = gripper_mechanics("2f85");
    one.sensing.rate_Hz = rate_Hz;
    one.sensing.osr = rate_Hz > 600.0 ? 256 : 1024;
    ClosesTo controller(width_mm(one, 6.0));
    run_trial(one, face(), controller);
    const auto &touches = controller.touches[0];
    ASSERT_GT(touches.size(), 2U);
    const double span_s = touches.back().t_s - touches.front().t_s;
    EXPECT_NEAR(static_cast<double>(touches.size() - 1) / span_s, rate_Hz, 0.01 * rate_Hz);
    EXPECT_GE(controller.latest_s, 1.0 / rate_Hz);
    const double step_mm = one.gripper.traits.step_mm;
    for (const double width_mm : controller.told_mm) {
      const double steps = width_mm / step_mm;
      EXPECT_NEAR(steps, std::round(steps), 0.01);
    }
    const GripTouch &held = touches.back();
    EXPECT_NE(held.flags & CONTACT_FLAG_TANGENTIAL_VALID, 0U);
    EXPECT_NEAR(held.force_N, 6.0, 1.5); // a step of the gripper is 1.2 N
    EXPECT_NEAR(std::hypot(held.qx_N, held.qy_N), 0.5 * 0.2 * 9.81, 0.1);
  }
}

TEST(Trial, ALoadsFieldCanBeTakenAway) {
  for (const double share : {1.0, 0.5, 0.0}) {
    Trial one = calm(0.3, 0.8);
    one.sensing.tangential = share;
    ClosesTo controller(width_mm(one, 6.0));
    run_trial(one, face(), controller);
    const GripTouch &held = controller.touches[1].back();
    EXPECT_NEAR(std::hypot(held.qx_N, held.qy_N), share * 0.5 * 0.3 * 9.81, 0.08) << share;
  }
}

TEST(Trial, TheControllersCoreHoldsOnGoodPads) {
  int held = 0;
  for (std::uint64_t n = 0; n < 12; n++) {
    const Trial one = trial(n);
    const GripperTraits &traits = one.gripper.traits;
    CoreController controller(default_settings(traits), traits);
    held += run_trial(one, face(), controller).held ? 1 : 0;
  }
  EXPECT_GE(held, 11);
}

TEST(Trial, TheSameSeedGivesTheSameBits) {
  const auto play = [](const Trial &one) {
    const GripperTraits &traits = one.gripper.traits;
    CoreController controller(default_settings(traits), traits);
    std::vector<double> forces;
    run_trial(one, face(), controller, [&](const Moment &m) { forces.push_back(m.force_N); });
    return forces;
  };
  Trial one = trial(4, "sts3215");
  const std::vector<double> forces = play(one);
  EXPECT_GT(forces.size(), 500U);
  EXPECT_EQ(play(one), forces);
  one.seed++;
  EXPECT_NE(play(one), forces);
}

TEST(Trial, AStillGraspTellsHowItSettles) {
  Trial one = calm(0.2, 0.5);
  one.still_s = 4.0;
  one.set_N = 5.0;
  ClosesTo controller(width_mm(one, 5.1));
  const Outcome outcome = run_trial(one, face(), controller);
  ASSERT_TRUE(outcome.settle_s);
  EXPECT_LT(*outcome.settle_s, 0.5);
  EXPECT_LT(outcome.rms, 0.06);
  EXPECT_EQ(outcome.reversals, 0);
  EXPECT_FALSE(outcome.failed.begun);
  EXPECT_EQ(outcome.margin, 0.0); // never lifted
  one.set_N = 8.0;
  ClosesTo wrong(width_mm(one, 5.1));
  EXPECT_FALSE(run_trial(one, face(), wrong).settle_s);
}

// As ClosesTo, but for what it does from a moment on.
class ThenGoesTo : public ClosesTo {
public:
  ThenGoesTo(double width_mm, double then_mm) : ClosesTo(width_mm), then_mm_(then_mm) {}
  void take_status(const GripperStatus &status) override {
    ClosesTo::take_status(status);
    statuses++;
    fault = status.fault;
    active = status.active;
  }
  GripReport step(double now_s, GripCommand &command) override {
    const GripReport report = ClosesTo::step(now_s, command);
    command.width_mm = now_s > 2.0 ? then_mm_ : command.width_mm;
    return report;
  }
  int statuses = 0, fault = 0;
  bool active = false;

private:
  double then_mm_;
};

// Begins at 1.6 s: a tenth of a second after HOLDING is said.
Trial failing(Fault::Kind kind, bool left, bool right) {
  Trial one = calm(0.1, 0.8);
  Fault fault;
  fault.kind = kind;
  fault.fingers = {left, right};
  fault.after_s = 0.1;
  fault.watched_s = 1.0;
  one.fault = fault;
  return one;
}

TEST(TrialFault, TruthTellsWhatAGripDoes) {
  const Trial one = failing(Fault::Kind::none, false, false);
  const double at_mm = width_mm(one, 4.0);
  ThenGoesTo stays(at_mm, at_mm), opens(at_mm, at_mm + 1.0), crushes(at_mm, width_mm(one, 8.0));
  const Failed stayed = run_trial(one, face(), stays).failed;
  EXPECT_TRUE(stayed.begun);
  EXPECT_LT(stayed.opened_mm, 0.02);
  EXPECT_NEAR(stayed.peak_N, 4.0, 0.1);
  EXPECT_EQ(stayed.state, GRIP_HOLDING);
  EXPECT_NEAR(run_trial(one, face(), opens).failed.opened_mm, 1.0, 0.02);
  EXPECT_NEAR(run_trial(one, face(), crushes).failed.peak_N, 8.0, 0.2);
}

TEST(TrialFault, FingertipsFailFromThenOn) {
  const auto play = [](Fault::Kind kind) {
    const Trial one = failing(kind, true, false);
    ClosesTo controller(width_mm(one, 4.0));
    run_trial(one, face(), controller);
    return controller.touches;
  };
  const auto after = [](const std::vector<GripTouch> &touches) {
    std::vector<GripTouch> late;
    std::copy_if(touches.begin(), touches.end(), std::back_inserter(late),
                 [](const GripTouch &touch) { return touch.t_s > 1.61; });
    return late;
  };
  const auto gone = play(Fault::Kind::gone), frozen = play(Fault::Kind::frozen);
  const auto uncertain = play(Fault::Kind::uncertain), saturated = play(Fault::Kind::saturated);
  EXPECT_TRUE(after(gone[0]).empty());
  EXPECT_GT(gone[0].size(), 500U);
  EXPECT_GT(after(gone[1]).size(), 300U);
  EXPECT_GT(after(frozen[0]).size(), 300U);
  for (const GripTouch &touch : after(frozen[0])) {
    EXPECT_EQ(touch.force_N, after(frozen[0]).front().force_N);
  }
  for (const GripTouch &touch : after(uncertain[0])) {
    EXPECT_NE(touch.flags & CONTACT_FLAG_UNCERTAIN, 0U);
    EXPECT_NEAR(touch.force_N, 2.0, 0.3);
  }
  for (const GripTouch &touch : after(saturated[0])) {
    EXPECT_NE(touch.flags & CONTACT_FLAG_SATURATED, 0U);
    EXPECT_NEAR(touch.force_N, 2.0, 0.3);
  }
  EXPECT_EQ(after(saturated[1]).front().flags & CONTACT_FLAG_SATURATED, 0U);
}

TEST(TrialFault, TheLineFailsFromThenOn) {
  const auto play = [](Fault::Kind kind) {
    const Trial one = failing(kind, false, false);
    const double at_mm = width_mm(one, 4.0);
    ThenGoesTo controller(at_mm, at_mm - 1.0);
    const bool moved = run_trial(one, face(), controller).failed.peak_N > 4.5;
    return std::make_pair(controller, moved);
  };
  const auto [well, well_moved] = play(Fault::Kind::none);
  const auto [silent, silent_moved] = play(Fault::Kind::silent);
  const auto [unanswered, unanswered_moved] = play(Fault::Kind::unanswered);
  const auto [late, late_moved] = play(Fault::Kind::late);
  const auto [faulty, faulty_moved] = play(Fault::Kind::fault);
  const auto [unpowered, unpowered_moved] = play(Fault::Kind::power);
  EXPECT_TRUE(well_moved);
  EXPECT_TRUE(unanswered_moved);
  EXPECT_TRUE(late_moved);
  EXPECT_FALSE(silent_moved);
  EXPECT_FALSE(faulty_moved);
  EXPECT_FALSE(unpowered_moved);
  EXPECT_EQ(silent.statuses, unanswered.statuses);
  EXPECT_LT(silent.statuses, late.statuses);
  EXPECT_NEAR(late.statuses - silent.statuses, 1.0 / 0.031, 3.0); // one each 31 ms
  EXPECT_GT(well.statuses, late.statuses + 900);
  EXPECT_EQ(faulty.fault, 9);
  EXPECT_EQ(well.fault, 0);
  EXPECT_TRUE(well.active);
  EXPECT_FALSE(unpowered.active);
}

TEST(TrialFault, AnObjectThatIsTakenIsFeltNoMore) {
  const Trial one = failing(Fault::Kind::taken, false, false);
  ClosesTo controller(width_mm(one, 4.0));
  run_trial(one, face(), controller);
  EXPECT_NE(controller.touches[0][500].flags & CONTACT_FLAG_CONTACT, 0U);
  EXPECT_EQ(controller.touches[0].back().flags & CONTACT_FLAG_CONTACT, 0U);
}

} // namespace
