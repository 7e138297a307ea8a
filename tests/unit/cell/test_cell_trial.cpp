// Grasps as they are drawn, and the trials that run them.
#include "simulation/cell/cell.hpp"
#include "simulation/cell/kind_trial.hpp"

extern "C" {
#include "common/contact_flags.h"
}

#include <cmath>
#include <gtest/gtest.h>
#include <set>

using namespace fingertip;
using namespace fingertip::cell;

TEST(Kinds, EventsAddUp) {
  GraspScenario grasp;
  grasp.lift_s = 0.4;
  grasp.lift_mm = 8.0;
  grasp.mass_kg = 0.5;
  using Kind = Event::Kind;
  grasp.events = {{Kind::pour, 1.0, 1.0, 0.8},
                  {Kind::slick, 3.0, 0.5, 0.25},
                  {Kind::vibrate, 4.0, 0.4, 6.0, 0.0, 2.5},
                  {Kind::knock, 5.0, 0.02, 0.1},
                  {Kind::lower, 6.0, 0.5, 0.5}};
  EXPECT_NEAR(grasp.least_N(0.9), 0.5 * 9.81, 1e-9);
  EXPECT_NEAR(grasp.least_N(2.5), 0.9 * 9.81, 1e-9);
  EXPECT_NEAR(grasp.least_N(3.8), 0.9 * 9.81 / 0.75, 1e-9);
  // Up first: a quarter of the way heavier by 6 m/s2, then lighter.
  EXPECT_NEAR(grasp.least_N(4.1), 0.9 * (9.81 + 6.0) / 0.75, 1e-6);
  EXPECT_NEAR(grasp.least_N(4.3), 0.9 * (9.81 - 6.0) / 0.75, 1e-6);
  EXPECT_NEAR(grasp.inputs(0.4).lifted_mm, 8.0, 1e-9);
  EXPECT_TRUE(grasp.inputs(0.39).table);
  EXPECT_FALSE(grasp.inputs(0.41).table || grasp.inputs(5.99).table);
  EXPECT_TRUE(grasp.inputs(6.01).table);
  EXPECT_NEAR(grasp.inputs(6.25).lifted_mm, 4.0, 1e-9);
  EXPECT_NEAR(grasp.inputs(6.5).lifted_mm, 0.0, 1e-9);
  // What the knock gives, and that the hand's way is what its acceleration makes.
  double impulse_Ns = 0.0, speed_mm_s = 0.0, way_mm = 0.0;
  constexpr double STEP_s = 1e-5;
  for (double t_s = 0.5 * STEP_s; t_s < 6.0; t_s += STEP_s) {
    const GraspScenario::Inputs now = grasp.inputs(t_s);
    impulse_Ns += now.push_N.y * STEP_s;
    if (t_s < 0.4) {
      speed_mm_s += 1e3 * now.hand_m_s2.y * STEP_s;
      way_mm += speed_mm_s * STEP_s;
    }
  }
  EXPECT_NEAR(impulse_Ns, 0.5 * 0.1, 1e-4);
  EXPECT_NEAR(way_mm, 8.0, 0.01);
}

TEST(Kinds, AreDrawnOverShapes) {
  std::set<std::string> drawn;
  for (const Kind kind : KINDS) {
    for (std::uint64_t n = 0; n < 40; n++) {
      const GraspScenario grasp = draw_grasp(kind, 77, n);
      EXPECT_EQ(grasp.mass_kg, draw_grasp(kind, 77, n).mass_kg);
      drawn.insert(name_of(grasp.shape));
      const bool flat = grasp.shape == Shape::box || grasp.shape == Shape::plate;
      EXPECT_GT(grasp.pads[0].at_1_mm_N, flat ? 14.0 : 1.7);
      EXPECT_LT(std::hypot(grasp.com_mm.x, grasp.com_mm.y), 0.15 * grasp.depth_mm + 1e-9);
      EXPECT_TRUE(kind == Kind::fragile || grasp.shape != Shape::cup);
    }
    EXPECT_NE(draw_grasp(kind, 77, 3).mass_kg, draw_grasp(kind, 77, 4).mass_kg);
  }
  EXPECT_EQ(drawn.size(), SHAPES.size());
  EXPECT_THROW(kind_of("banana"), std::runtime_error);
}

// A smooth lift of an object at rest, on rubber that does not relax.
static GraspTrial calm(double mass_kg) {
  GraspTrial trial;
  trial.grasp.mass_kg = mass_kg;
  trial.grasp.lift_mm = 5.0;
  trial.grasp.lift_s = 1.0;
  trial.grasp.steady_s = 1.0;
  trial.grasp.ends_s = 2.5;
  for (PadProperties &pad : trial.grasp.pads) {
    pad.relaxation = 0.0;
  }
  trial.gripper = gripper_mechanics("ideal");
  return trial;
}

static double width_mm(const GraspTrial &trial, double force_N) {
  const GraspScenario &grasp = trial.grasp;
  const double each_mm = std::pow(force_N / grasp.pads[0].at_1_mm_N, 1.0 / grasp.exponent);
  return grasp.width_mm - 2.0 * each_mm - force_N / Cell::FINGERS_N_mm;
}

static const Face &ball() {
  static const Face face("sphere15", FINGERTIP_TEST_TABLES);
  return face;
}

// Closes to a width, and reports that it holds after 1.5 s.
class ClosesTo : public Controller {
public:
  explicit ClosesTo(double width_mm) : width_mm_(width_mm) {}
  void take_touch(std::size_t finger, const GripTouch &touch) override { touches[finger].push_back(touch); }
  void take_status(const GripperStatus &) override {}
  GripReport step(double now_s, GripCommand &command) override {
    command = {width_mm_, 20.0, 0.0, GRIP_MOVE};
    GripReport report{};
    report.state = now_s > 1.5 ? GRIP_HOLDING : GRIP_SQUEEZE;
    return report;
  }
  std::array<std::vector<GripTouch>, 2> touches;

private:
  double width_mm_;
};

TEST(Trial, WhatDoesNothingDropsWhatPhysicsSays) {
  // What the lift adds to the weight takes 1 % of it.
  for (const double margin : {0.8, 0.95, 1.06, 1.5}) {
    GraspTrial one = calm(0.4);
    const double least_N = 0.4 * GRAVITY_m_s2 / (2.0 * 0.5);
    one.grasp.crushes_N = 1.3 * least_N;
    ClosesTo controller(width_mm(one, margin * least_N));
    const TrialOutcome outcome = run_trial(one, ball(), controller);
    EXPECT_EQ(outcome.dropped, margin < 1.0) << margin;
    EXPECT_FALSE(outcome.never_held);
    EXPECT_EQ(outcome.crushed, margin > 1.3) << margin;
    if (margin < 1.0) {
      EXPECT_GT(outcome.slid_mm, 0.85 * DROP_mm); // the rest of the way the rubber gives
    } else {
      EXPECT_NEAR(outcome.margin, margin, 0.02 * margin);
      EXPECT_LT(outcome.slid_mm, SLIP_mm);
      EXPECT_TRUE(outcome.catches.empty());
    }
  }
}

TEST(Trial, FramesComeAtTheirRateAndReportTheLoad) {
  for (const double rate_Hz : {20.0, 410.0, 1308.0}) {
    for (const bool estimates : {true, false}) {
      GraspTrial one = calm(0.2);
      one.rate_Hz = rate_Hz;
      one.estimates_load = estimates;
      ClosesTo controller(width_mm(one, 6.0));
      run_trial(one, ball(), controller);
      const auto &touches = controller.touches[0];
      ASSERT_GT(touches.size(), 2U);
      const double span_s = touches.back().t_s - touches.front().t_s;
      EXPECT_NEAR(static_cast<double>(touches.size() - 1) / span_s, rate_Hz, 0.01 * rate_Hz);
      const GripTouch &held = touches.back();
      EXPECT_EQ((held.flags & CONTACT_FLAG_TANGENTIAL_VALID) != 0, estimates);
      EXPECT_NEAR(held.force_N, 6.0, 0.2);
      EXPECT_NEAR(std::hypot(held.qx_N, held.qy_N), estimates ? 0.5 * 0.2 * 9.81 : 0.0, 0.2);
    }
  }
}
