#include "simulation/cell/cell.hpp"

#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <stdexcept>

using namespace fingertip::cell;

// On rubber that does not relax, of an object that does not move along the pads by itself.
static GraspScenario held(Shape shape, double mass_kg, double friction) {
  GraspScenario grasp;
  grasp.shape = shape;
  grasp.mass_kg = mass_kg;
  grasp.kinetic_share = 1.0;
  for (PadProperties &pad : grasp.pads) {
    pad.friction = friction;
    pad.relaxation = 0.0;
  }
  stiffen(grasp);
  return grasp;
}

// That squeezes with this force.
static double width_mm(const GraspScenario &grasp, double force_N) {
  const double each_mm = std::pow(force_N / grasp.pads[0].at_1_mm_N, 1.0 / grasp.exponent) + 0.5 * force_N / Cell::FINGERS_N_mm;
  return grasp.width_mm - 2.0 * each_mm;
}

using Inputs = GraspScenario::Inputs;

// Squeezed on the table for 0.5 s, and then as asked for.
static void run(
    const std::unique_ptr<Cell> &cell, const GraspScenario &grasp, double width_mm, double seconds,
    const std::function<void(double, Inputs &)> &then = [](double, Inputs &now) { now.table = false; }) {
  for (double t_s = -0.5; t_s < seconds; t_s += Cell::STEP_s) {
    Inputs now = grasp.inputs(-1.0);
    if (t_s >= 0.0) {
      then(t_s, now);
    }
    cell->run(Cell::STEP_s, width_mm, now);
  }
}

TEST(Cell, BothPadsCarryTheForceOfTheirIndentation) {
  for (const Shape shape : SHAPES) {
    for (const double force_N : {1.0, 5.0, 15.0}) {
      const GraspScenario grasp = held(shape, 0.2, 0.5);
      const double closed_mm = width_mm(grasp, force_N);
      const auto cell = make_cell(grasp);
      EXPECT_NEAR(cell->force_at_N(closed_mm), force_N, 0.01 * force_N);
      run(cell, grasp, closed_mm, 0.0);
      for (const std::size_t finger : {0U, 1U}) {
        // Contacts give by some hundredths of a millimetre.
        EXPECT_NEAR(cell->force_N(finger), force_N, 0.02 + 0.03 * force_N) << name_of(shape);
        EXPECT_NEAR(cell->patch(finger).force_N, cell->force_N(finger), 1e-9);
      }
    }
  }
}

TEST(Cell, FingersAndObjectsThatGiveAreHeldByLess) {
  GraspScenario soft = held(Shape::ball, 0.2, 0.5);
  soft.stiffness_N_mm = 2.0;
  const auto cell = make_cell(soft);
  const double force_N = cell->force_at_N(36.0);
  EXPECT_NEAR(4.0, 40.0 - width_mm(soft, force_N) + force_N / 2.0, 1e-3);
}

TEST(Cell, AHoldRelaxesByItsShare) {
  GraspScenario grasp = held(Shape::ball, 0.2, 0.5);
  grasp.pads[0].relaxation = grasp.pads[1].relaxation = 0.2;
  const auto cell = make_cell(grasp);
  // The press of 1.3 s to which the twin's share refers is one whose force is a ramp.
  for (double t_s = 0.0; t_s < 1.3; t_s += Cell::STEP_s) {
    cell->run(Cell::STEP_s, width_mm(grasp, 6.0 * t_s / 1.3), grasp.inputs(-1.0));
  }
  const double peak_N = cell->mean_N();
  run(cell, grasp, width_mm(grasp, 6.0), 7.5, [](double, Inputs &) {});
  EXPECT_NEAR(cell->mean_N() / peak_N, 0.8, 0.004);
}

TEST(Cell, FallsFreelyWhereNothingHolds) {
  const GraspScenario grasp = held(Shape::box, 0.3, 0.5);
  const auto cell = make_cell(grasp);
  run(cell, grasp, 60.0, 0.06);
  EXPECT_NEAR(-cell->way_mm().y, 0.5 * 9810.0 * 0.06 * 0.06, 0.15);
  EXPECT_EQ(cell->force_N(0), 0.0);
  EXPECT_TRUE(cell->slips());
  GraspScenario beside = held(Shape::ball, 0.03, 0.5);
  beside.off_mm = 3.5;
  const auto open = make_cell(beside);
  for (int i = 0; i < 250; i++) {
    open->run(Cell::STEP_s, 48.0, beside.inputs(-1.0));
    ASSERT_EQ(open->mean_N(), 0.0);
  }
}

TEST(Cell, ThrowsWhenItDiverges) {
  const GraspScenario grasp = held(Shape::ball, 0.2, 0.5);
  const auto cell = make_cell(grasp);
  EXPECT_THROW(run(cell, grasp, 38.0, 0.1, [](double, Inputs &now) { now.push_N.x = 1e30; }), std::runtime_error);
}

TEST(Cell, SlipsAtFrictionAndNotBefore) {
  for (const Shape shape : SHAPES) {
    for (const double share : {0.9, 1.1}) {
      constexpr double FORCE_N = 5.0, FRICTION = 0.4;
      GraspScenario grasp = held(shape, share * 2.0 * FRICTION * FORCE_N / GRAVITY_m_s2, FRICTION);
      const auto cell = make_cell(grasp);
      // The weight comes slowly: nothing rings.
      run(cell, grasp, width_mm(grasp, FORCE_N), 2.5, [&](double t_s, Inputs &now) {
        now.table = false;
        now.mass_kg *= std::min(1.0, 0.05 + t_s / 1.5);
      });
      EXPECT_EQ(cell->slid_mm() > 1.0, share > 1.0) << name_of(shape) << " " << share << ": " << cell->slid_mm();
      if (share < 1.0) { // held, and all of it carried
        EXPECT_NEAR(cell->load_N(0).y + cell->load_N(1).y, -grasp.mass_kg * GRAVITY_m_s2, 0.02);
      }
    }
  }
}

TEST(Cell, FrictionFallsWhereItSlides) {
  GraspScenario grasp = held(Shape::ball, 0.3, 0.5);
  grasp.kinetic_share = 0.7;
  const auto cell = make_cell(grasp);
  run(cell, grasp, width_mm(grasp, 3.5), 0.0);
  EXPECT_NEAR(cell->friction(0), 0.5, 1e-6);
  run(cell, grasp, width_mm(grasp, 3.5), 0.1, [](double, Inputs &now) {
    now.table = false;
    now.friction_share = 0.8;
  });
  EXPECT_TRUE(cell->slips());
  EXPECT_NEAR(cell->friction(0), 0.7 * 0.8 * 0.5, 0.01);
}

TEST(Cell, AFastSlideStaysInContactAndIsStopped) {
  for (const Shape shape : {Shape::ball, Shape::plate}) {
    const GraspScenario grasp = held(shape, 0.7 * 2.0 * 0.7 * 12.0 / GRAVITY_m_s2, 0.7);
    const auto cell = make_cell(grasp);
    run(cell, grasp, width_mm(grasp, 12.0), 0.2, [&](double t_s, Inputs &now) {
      now.table = false;
      now.friction_share = t_s < 0.015 ? 0.02 : 1.0;
      ASSERT_GT(cell->mean_N(), 11.4);
    });
    EXPECT_NEAR(cell->slid_mm(), 1.1 / 0.3, 0.4) << name_of(shape); // it fell by 1.1 mm; then 0.7 of the friction carried it
  }
}

TEST(Cell, FacingFingertipsFeelAMirroredPull) {
  GraspScenario grasp = held(Shape::ball, 0.3, 0.8);
  grasp.down_rad = 0.4;
  grasp.place_mm = {2.0, -3.0};
  const auto cell = make_cell(grasp);
  run(cell, grasp, width_mm(grasp, 8.0), 0.5);
  const Patch one = cell->patch(0), other = cell->patch(1);
  EXPECT_NEAR(one.pull_x_N, 0.15 * GRAVITY_m_s2 * std::cos(0.4), 0.02);
  EXPECT_NEAR(one.pull_y_N, 0.15 * GRAVITY_m_s2 * std::sin(0.4), 0.02);
  EXPECT_NEAR(other.pull_x_N, -one.pull_x_N, 1e-3);
  EXPECT_NEAR(other.pull_y_N, one.pull_y_N, 1e-3);
  EXPECT_NEAR(other.x_mm, -one.x_mm, 1e-2);
  EXPECT_NEAR(one.x_mm, 2.0, 0.1); // the face goes along with what pulls it
  EXPECT_NEAR(one.y_mm, -3.0, 0.1);
  EXPECT_GT(one.stuck_N, 0.0);
  EXPECT_LT(one.stuck_N, one.force_N);
}

TEST(Cell, TouchesInAPointALineOrAnArea) {
  struct Case {
    Shape shape;
    double length_mm, width_mm; // level, upwards; pads are 36 by 54 mm
  };
  for (const Case &one : {Case{Shape::ball, 0, 0}, Case{Shape::egg, 0, 0}, Case{Shape::lying, 30, 0}, Case{Shape::upright, 0, 30},
                          Case{Shape::cup, 0, 30}, Case{Shape::box, 24, 30}}) {
    GraspScenario grasp = held(one.shape, 0.1, 0.5);
    grasp.height_mm = 30.0;
    grasp.depth_mm = 24.0;
    const auto cell = make_cell(grasp);
    run(cell, grasp, width_mm(grasp, 5.0), 0.0);
    const Patch patch = cell->patch(0);
    EXPECT_NEAR(patch.length_mm, one.length_mm, 0.1) << name_of(one.shape);
    EXPECT_NEAR(patch.width_mm, one.width_mm, 0.1) << name_of(one.shape);
    EXPECT_NEAR(patch.off_length_mm, 0.0, 0.1);
  }
}

TEST(Cell, AWeightBesideTheAxisTurnsABall) {
  GraspScenario grasp = held(Shape::ball, 0.3, 0.5);
  grasp.com_mm = {8.0, 0.0};
  const auto cell = make_cell(grasp);
  run(cell, grasp, width_mm(grasp, 8.0), 1.0);
  EXPECT_GT(std::abs(cell->turned_rad()), 0.5);
}

TEST(Cell, ABoxTurnsBeyondTheTorqueOfItsArea) {
  for (const double share : {0.9, 1.1}) {
    // From the middle of the faces, 36 by 54 mm: their area, and the weight.
    constexpr double FRICTION = 0.5, MEAN_mm = 17.4, BESIDE_mm = 60.0;
    GraspScenario grasp = held(Shape::box, 0.01, FRICTION);
    grasp.height_mm = grasp.depth_mm = 200.0;
    grasp.com_mm = {BESIDE_mm, 0.0};
    const auto cell = make_cell(grasp);
    run(cell, grasp, width_mm(grasp, 20.0), 2.5, [&](double t_s, Inputs &now) {
      const double most_N = 2.0 * FRICTION * cell->mean_N() / std::hypot(1.0, BESIDE_mm / MEAN_mm);
      now.table = false;
      now.mass_kg = std::max(now.mass_kg, share * most_N / GRAVITY_m_s2 * std::min(1.0, t_s / 2.0));
    });
    EXPECT_EQ(std::abs(cell->turned_rad()) > 0.4, share > 1.0) << share << ": " << cell->turned_rad();
    EXPECT_GT(cell->mean_N(), 15.0); // still held, and not thrown out
  }
}

TEST(Cell, LightObjectsRestInAFirmGrip) {
  for (const Shape shape : {Shape::plate, Shape::ball}) {
    GraspScenario grasp = held(shape, shape == Shape::ball ? 0.005 : 0.02, 0.8);
    grasp.width_mm = shape == Shape::ball ? 10.0 : 4.0;
    grasp.shear_N_mm = 18.0;
    const auto cell = make_cell(grasp);
    run(cell, grasp, width_mm(grasp, 20.0), 0.5);
    const double before = cell->turned_rad() + cell->way_mm().y;
    run(cell, grasp, width_mm(grasp, 20.0), 0.01);
    EXPECT_NEAR(cell->turned_rad() + cell->way_mm().y, before, 1e-3) << name_of(shape);
  }
}
