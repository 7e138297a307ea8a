#include "simulation/cell/cell.hpp"

#include <cmath>
#include <functional>
#include <gtest/gtest.h>

namespace {

using namespace fingertip::cell;
using fingertip::cell::Object;

const Face &face() {
  static const Face made("sphere15", 12.0, FINGERTIP_TEST_TABLES);
  return made;
}

// Does not relax, and neither fingers nor object give.
Grasp stiff() {
  Grasp grasp;
  grasp.relaxation = 0.0;
  grasp.fingers_N_mm = 1e9;
  return grasp;
}

Object object(double mass_kg, double friction) {
  Object made;
  made.mass_kg = mass_kg;
  made.friction = friction;
  made.kinetic_share = 1.0;
  return made;
}

// That squeezes with this force.
double width_mm(const Object &what, const Grasp &grasp, double force_N) {
  return what.width_mm - 2.0 * face().indentation_mm(force_N) - force_N / grasp.fingers_N_mm;
}

Drive drive(const Object &what, double width_mm) {
  Drive made;
  made.width_mm = width_mm;
  made.mass_kg = what.mass_kg;
  return made;
}

void run(Cell &cell, double seconds, const std::function<Drive(double)> &at, double chunk_s = 1e-3) {
  for (long i = 0; i < std::lround(seconds / chunk_s); i++) {
    cell.run(chunk_s, at((static_cast<double>(i) + 0.5) * chunk_s));
  }
}

TEST(Cell, BothPadsCarryTheForceOfTheirIndentation) {
  for (const double fingers_N_mm : {1e9, 50.0, 5.0}) {
    for (const double force_N : {0.1, 1.0, 5.0, 20.0, 45.0}) {
      const Object what = object(0.2, 0.5);
      Grasp grasp = stiff();
      grasp.fingers_N_mm = fingers_N_mm;
      Cell cell(face(), what, grasp);
      EXPECT_NEAR(cell.force_at_N(width_mm(what, grasp, force_N)), force_N, 0.002 + 1e-3 * force_N);
      cell.run(0.01, drive(what, width_mm(what, grasp, force_N)));
      EXPECT_NEAR(cell.force_N(), force_N, 0.002 + 1e-3 * force_N);
    }
  }
  Cell cell(face(), object(0.2, 0.5), stiff());
  cell.run(0.01, drive(object(0.2, 0.5), 40.0));
  EXPECT_EQ(cell.force_N(), 0.0);
}

TEST(Cell, AnObjectThatGivesIsHeldByLess) {
  Object soft = object(0.2, 0.5);
  soft.stiffness_N_mm = 2.0;
  Cell cell(face(), soft, stiff());
  const double force_N = cell.force_at_N(36.0);
  EXPECT_NEAR(4.0, 2.0 * face().indentation_mm(force_N) + force_N / 2.0, 1e-3);
}

TEST(Cell, AHoldRelaxesByItsShare) {
  const Object what = object(0.2, 0.5);
  Grasp grasp = stiff();
  grasp.relaxation = 0.2;
  Cell cell(face(), what, grasp);
  const double closed_mm = width_mm(what, grasp, 6.0);
  // The press of 1.3 s to which the twin's share refers is one whose force is a ramp.
  run(cell, 1.3, [&](double t_s) { return drive(what, width_mm(what, grasp, 6.0 * t_s / 1.3)); });
  const double peak_N = cell.force_N();
  run(cell, 8.0, [&](double) { return drive(what, closed_mm); });
  EXPECT_NEAR(cell.force_N() / peak_N, 0.8, 0.003);
}

TEST(Cell, FallsFreelyWhereNothingHolds) {
  const Object what = object(0.3, 0.5);
  Cell cell(face(), what, stiff());
  Drive falls = drive(what, 60.0);
  falls.table = false;
  run(cell, 0.06, [&](double) { return falls; });
  EXPECT_NEAR(cell.way_mm().dot(cell.down()), 0.5 * 9810.0 * 0.06 * 0.06, 0.05);
  EXPECT_EQ(cell.turned_rad(), 0.0);
}

TEST(Cell, StandsOnTheTableUntilItIsLifted) {
  const Object what = object(0.5, 0.8);
  const Grasp grasp = stiff();
  Cell cell(face(), what, grasp);
  const double closed_mm = width_mm(what, grasp, 6.0);
  run(cell, 1.0, [&](double) { return drive(what, closed_mm); });
  EXPECT_NEAR(cell.table_N(), 0.5 * 9.81, 0.01);
  EXPECT_NEAR(std::hypot(cell.touch(0).pull_x_N, cell.touch(0).pull_y_N), 0.0, 0.01);
  run(cell, 2.0, [&](double t_s) {
    Drive lifts = drive(what, closed_mm);
    lifts.lifted_mm = 5.0 * std::min(t_s, 1.0);
    lifts.lift_mm_s = t_s < 1.0 ? 5.0 : 0.0;
    return lifts;
  });
  EXPECT_EQ(cell.table_N(), 0.0);
  for (const std::size_t finger : {0U, 1U}) {
    EXPECT_NEAR(std::hypot(cell.touch(finger).pull_x_N, cell.touch(finger).pull_y_N), 0.25 * 9.81, 0.02);
  }
  EXPECT_EQ(cell.slid_mm(), 0.0);
}

TEST(Cell, SlipsAtFrictionAndNotBefore) {
  for (const double share : {0.93, 0.99, 1.01, 1.1}) {
    constexpr double FORCE_N = 5.0, FRICTION = 0.4;
    const double mass_kg = share * 2.0 * FRICTION * FORCE_N / GRAVITY_m_s2;
    const Object what = object(mass_kg, FRICTION);
    Cell cell(face(), what, stiff());
    const double closed_mm = width_mm(what, stiff(), FORCE_N);
    Drive light = drive(what, closed_mm);
    light.table = false;
    // The weight comes slowly: nothing rings.
    run(cell, 4.0, [&](double t_s) {
      light.mass_kg = mass_kg * std::min(1.0, 0.05 + t_s / 3.0);
      return light;
    });
    EXPECT_EQ(cell.slid_mm() > 1.0, share > 1.0) << share;
  }
}

TEST(Cell, FacingFingertipsFeelAMirroredPull) {
  const Object what = object(0.3, 0.8);
  Grasp grasp = stiff();
  grasp.down_rad = 0.4;
  grasp.place_mm = {2.0, -3.0};
  Cell cell(face(), what, grasp);
  Drive hangs = drive(what, width_mm(what, grasp, 8.0));
  hangs.table = false;
  run(cell, 1.5, [&](double) { return hangs; });
  const auto one = cell.touch(0), other = cell.touch(1);
  EXPECT_NEAR(one.pull_x_N, 0.15 * 9.81 * std::cos(0.4), 0.02);
  EXPECT_NEAR(one.pull_y_N, 0.15 * 9.81 * std::sin(0.4), 0.02);
  EXPECT_EQ(other.pull_x_N, -one.pull_x_N);
  EXPECT_EQ(other.pull_y_N, one.pull_y_N);
  EXPECT_EQ(other.x_mm, -one.x_mm);
  EXPECT_GT(one.x_mm, 2.0);
  EXPECT_GT(one.y_mm, -3.0);
  EXPECT_GT(one.stuck_N, 0.0);
  EXPECT_LT(one.stuck_N, one.force_N);
}

TEST(Cell, AWeightBesideTheAxisWindsTheRubberUp) {
  Object what = object(0.05, 1.0);
  what.com_mm = {0.0, 4.0}; // gravity is along x
  Cell cell(face(), what, stiff());
  constexpr double FORCE_N = 12.0;
  Drive hangs = drive(what, width_mm(what, stiff(), FORCE_N));
  hangs.table = false;
  run(cell, 6.0, [&](double) { return hangs; });
  const double radius_mm = face().radius_mm(FORCE_N);
  const double lever_mm = Bundle::LEVER * radius_mm;
  const double stiffness_Nmm = 2.0 * Bundle::TURN_STIFFNESS * stiff().shear_N_mm2 * radius_mm * lever_mm * lever_mm;
  EXPECT_NEAR(-cell.turned_rad(), 0.05 * 9.81 * 4.0 / stiffness_Nmm, 0.07 * std::abs(cell.turned_rad()));
}

TEST(Cell, ATorqueBeyondFrictionTurnsItUntilItHangs) {
  Object what = object(0.3, 0.3);
  what.com_mm = {0.0, 12.0};
  Cell cell(face(), what, stiff());
  constexpr double FORCE_N = 12.0;
  Drive hangs = drive(what, width_mm(what, stiff(), FORCE_N));
  hangs.table = false;
  run(cell, 12.0, [&](double) { return hangs; });
  // Friction stops it before it hangs straight, where the torque is less than what both hold.
  const double torque_Nmm = 0.3 * 9.81 * 12.0 * std::cos(cell.turned_rad());
  const double holds_Nmm = 2.0 * 0.3 * FORCE_N * Bundle::LEVER * face().radius_mm(FORCE_N);
  EXPECT_GT(0.3 * 9.81 * 12.0, 1.2 * holds_Nmm);
  EXPECT_LT(cell.turned_rad(), -0.3);
  EXPECT_LE(std::abs(torque_Nmm), holds_Nmm);
  EXPECT_NEAR(cell.turning_rad_s(), 0.0, 0.5);
}

TEST(Cell, EnergyBalances) {
  Object what = object(0.3, 0.4);
  what.kinetic_share = 0.75;
  what.com_mm = {6.0, 3.0};
  Grasp grasp = stiff();
  grasp.down_rad = 1.0;
  const double closed_mm = width_mm(what, grasp, 6.0);
  Cell cell(face(), what, grasp);
  // The press alone does no work along the rubber.
  run(cell, 0.5, [&](double) { return drive(what, closed_mm); });
  const Cell::Energy before = cell.energy();
  double most = 0.0;
  run(cell, 2.0, [&](double t_s) {
    Drive shaken = drive(what, closed_mm);
    shaken.table = false;
    shaken.hand_m_s2 = {8.0 * std::sin(20.0 * t_s), -6.0 * std::sin(13.0 * t_s)};
    if (t_s > 1.0 && t_s < 1.02) {
      shaken.knock_N = {0.0, 4.0};
    }
    return shaken;
  });
  const Cell::Energy after = cell.energy();
  most = std::max(most, after.work - before.work);
  const double became = after.kinetic + after.elastic + after.lost - (before.kinetic + before.elastic + before.lost);
  EXPECT_GT(cell.slid_mm(), 2.0);
  EXPECT_NEAR(after.work - before.work, became, 0.01 * most);
}

TEST(Cell, ShorterStepsEndAlike) {
  Object what = object(0.4, 0.4);
  what.kinetic_share = 0.8;
  const double closed_mm = width_mm(what, stiff(), 5.2);
  const auto slides = [&](double chunk_s) {
    Cell cell(face(), what, stiff());
    run(
        cell, 0.9,
        [&](double t_s) {
          Drive hangs = drive(what, closed_mm);
          hangs.table = false;
          hangs.hand_m_s2 = {-5.0 * std::exp(-0.5 * std::pow((t_s - 0.5) / 0.04, 2.0)), 0.0};
          return hangs;
        },
        chunk_s);
    return cell.slid_mm();
  };
  const double usual_mm = slides(1e-3), fine_mm = slides(5e-6);
  EXPECT_GT(fine_mm, 1.0);
  EXPECT_NEAR(usual_mm, fine_mm, 0.03 * fine_mm);
}

TEST(Cell, AKnockThatTheGripCannotTakeMovesItByItsEnergy) {
  // Weightless: the hand falls, too.
  const Object what = object(0.3, 0.5);
  constexpr double FORCE_N = 4.0, SPEED_mm_s = 500.0;
  Cell cell(face(), what, stiff());
  const double closed_mm = width_mm(what, stiff(), FORCE_N);
  run(cell, 1.0, [&](double t_s) {
    Drive knocked = drive(what, closed_mm);
    knocked.table = false;
    knocked.hand_m_s2 = {GRAVITY_m_s2, 0.0};
    if (t_s < 0.002) {
      knocked.knock_N = {0.0, 0.3 * SPEED_mm_s * 1e-3 / 0.002};
    }
    return knocked;
  });
  // m v^2 / 2 is rubbed off by 2 mu F, but for what the rubber takes and gives back.
  const double way_mm = 0.5 * 0.3 * SPEED_mm_s * SPEED_mm_s * 1e-3 / (2.0 * 0.5 * FORCE_N);
  EXPECT_NEAR(cell.slid_mm(), way_mm, 0.12 * way_mm);
}

} // namespace
