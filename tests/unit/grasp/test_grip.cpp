// The grasp from approach to opening, and what may go wrong in it.
#include "grip_world.hpp"

using namespace fingertip;
using test::expect_share;
using test::GripWorld;

TEST(Grip, GraspsWithTheStartForce) {
  GripWorld world;
  world.grasp();
  expect_share(world.settings.start_N, world.force_N, 0.06);
  EXPECT_EQ(world.report.trouble, 0u);
  world.run(2.0);
  expect_share(world.settings.start_N, world.force_N, 0.06);
  EXPECT_EQ(world.report.load_N, 0.0);
  EXPECT_LT(world.peak_N, 1.3 * world.settings.start_N);
}

// However long a step takes at that speed.
TEST(Grip, ApproachesAtItsSpeedAndSlowerWhereFramesComeLate) {
  GripperTraits coarse = test::fine_gripper();
  coarse.step_mm = 85.0 / 227;
  coarse.latency_s = 0.025;
  for (const GripperTraits &gripper : {test::fine_gripper(), coarse}) {
    for (const double delay_s : {0.0, 0.08, 0.2}) {
      GripWorld world({}, gripper);
      world.delay_s = delay_s;
      world.grip.request(GRIP_REQUEST_GRASP);
      world.run(2.0 + delay_s);
      ASSERT_EQ(world.report.state, GRIP_APPROACH);
      const double wanted_mm_s = std::min(8.0, 0.4 / (delay_s + gripper.latency_s + gripper.poll_s));
      test::expect_share(wanted_mm_s, (60.0 - world.width_mm) / 2.0, delay_s > 0.0 ? 0.5 : 0.06);
    }
  }
}

// One fingertip's touch is no grasp: the other has to feel the object too.
TEST(Grip, OneFingertipsTouchIsNoGrasp) {
  GripWorld world;
  world.off_mm = 0.15;
  world.grasp();
  EXPECT_GT(world.report.finger_N[1], world.settings.touch_N);
  EXPECT_LT(world.report.finger_N[0], 2.0 * world.settings.start_N);
}

TEST(Grip, NoJumpWhileItSqueezes) {
  for (const double stiffness : {1.5, 3.0, 6.0}) {
    GripWorld world({}, gripper_traits("2f85"));
    world.stiffness = stiffness;
    world.grasp();
    EXPECT_LT(world.peak_N, 2.0 * world.settings.start_N) << stiffness;
  }
}

// The approach goes on until the controller knows of the touch: on hard contacts too far.
TEST(Grip, SqueezingDoesNotOpen) {
  GripWorld world;
  world.stiffness = 60.0;
  world.delay_s = 0.02;
  world.grip.request(GRIP_REQUEST_GRASP);
  world.run_to(GRIP_SQUEEZE);
  double least_mm = world.command.width_mm;
  while (world.report.state == GRIP_SQUEEZE && world.t_s < 9.0) {
    world.run(0.001);
    ASSERT_LE(world.command.width_mm, least_mm + 1e-9);
    least_mm = world.command.width_mm;
  }
  EXPECT_EQ(world.report.state, GRIP_READY);
}

// 55 ms more delay: it still grasps, and says that the frames are late.
TEST(Grip, LateFramesAreLateAndNotMissing) {
  GripWorld world;
  world.delay_s = 0.06;
  world.grasp();
  world.run(0.5);
  EXPECT_EQ(world.report.trouble, GRIP_FINGER_0_LATE | GRIP_FINGER_1_LATE);
  EXPECT_NEAR(world.report.delay_s, 0.06, 0.005);
  EXPECT_LT(world.peak_N, 2.0 * world.settings.start_N);
  world.pull(2.0, 0.3);
  world.run(0.5);
  EXPECT_GT(world.force_N, 2.0 / world.settings.friction);
}

// No frame is believed alone.
TEST(Grip, OneFingertipThatReportsNothingOrLessOrFarMoreMovesNothing) {
  for (const double gain : {0.0, 0.7, 3.0}) {
    for (const double seconds : {0.003, 0.024, 3.0}) {
      GripWorld world;
      world.carry(2.0, 0.3, 2.0);
      const double before_N = world.force_N;
      world.gain[0] = gain;
      world.run(seconds);
      expect_share(before_N, world.force_N, 0.05);
      EXPECT_EQ((world.report.trouble & GRIP_FINGER_0_EMPTY) != 0, seconds > 1.0 && gain == 0.0);
      EXPECT_EQ((world.report.trouble & GRIP_FINGERS_DIFFER) != 0, seconds > 1.0);
      world.gain[0] = 1.0;
      world.run(0.3);
      expect_share(before_N, world.force_N, 0.05);
      EXPECT_EQ(world.report.trouble, 0u);
    }
  }
}

TEST(Grip, ForcesThatDifferAreToldAtRestWithBothNumbers) {
  GripWorld world;
  world.gain = {1.0, 0.5};
  world.grip.request(GRIP_REQUEST_GRASP);
  while (world.report.state != GRIP_HOLDING && world.t_s < 9.0) {
    world.run(0.001);
    if (world.report.state != GRIP_READY && world.report.state != GRIP_HOLDING) {
      ASSERT_EQ(world.report.trouble & GRIP_FINGERS_DIFFER, 0u);
    }
  }
  world.run(2.0);
  EXPECT_NE(world.report.trouble & GRIP_FINGERS_DIFFER, 0u);
  EXPECT_GT(world.report.finger_N[0], 1.8 * world.report.finger_N[1]);
}

// Squeezed without a force is no hold, and says why.
TEST(Grip, SqueezingThatEndsWithoutAForceIsAFault) {
  for (const bool plate : {false, true}) {
    GripWorld world;
    world.sd_share = 3.0;
    world.sigma_mm = plate ? 100.0 : 6.0; // of a plate only the part on the pad counts
    ASSERT_TRUE(world.grip.request(GRIP_REQUEST_GRASP));
    world.run_to(plate ? GRIP_HOLDING : GRIP_FAULT, 12.0);
    EXPECT_EQ((world.report.trouble & GRIP_NO_GRIP) != 0, !plate);
    EXPECT_EQ((world.report.trouble & GRIP_FINGER_0_NO_FORCE) != 0, !plate);
    EXPECT_TRUE(world.grip.request(GRIP_REQUEST_RELEASE));
  }
}

// One bad answer is looked at again.
TEST(Grip, OneBadStatusIsNoFaultAndTwoAre) {
  GripWorld world;
  world.grasp();
  world.fault = 9;
  world.run(0.001);
  world.fault = 0;
  world.run(0.05);
  EXPECT_EQ(world.report.state, GRIP_HOLDING);
  world.active = false;
  world.run(0.001);
  world.active = true;
  world.run(0.05);
  EXPECT_EQ(world.report.state, GRIP_HOLDING);
  world.fault = 9;
  world.run(0.01);
  EXPECT_EQ(world.report.state, GRIP_FAULT);
  world.fault = 0;
  world.run(0.1);
  EXPECT_EQ(world.report.state, GRIP_FAULT);
  EXPECT_EQ(world.report.gripper_fault, 9);
  EXPECT_NE(world.report.trouble & GRIP_GRIPPER_FAULT, 0u);
  EXPECT_FALSE(world.grip.request(GRIP_REQUEST_RELEASE));
}

TEST(Grip, ActivatesOnlyWhatHoldsNothing) {
  GripWorld world;
  world.active = false;
  world.grip.request(GRIP_REQUEST_GRASP);
  world.run(0.1);
  EXPECT_TRUE(world.activated);
  GripWorld full;
  full.active = false;
  full.width_mm = 38.0;
  full.object_mm = 62.0;
  full.grip.request(GRIP_REQUEST_GRASP);
  full.run(0.5);
  EXPECT_FALSE(full.activated);
  EXPECT_NE(full.report.trouble & GRIP_GRIPPER_INACTIVE, 0u);
}

// An object that one fingertip has pushed away was never held, so the approach goes on.
TEST(Grip, WhatOneFingertipPushedAwayIsNotDropped) {
  GripWorld world({{"cap", 2.4}, {"start", 1.0}, {"floor", 0.75}}, gripper_traits("2f85"));
  world.stiffness = 5.0, world.off_mm = 0.3;
  world.object_mm = 56.0;
  ASSERT_TRUE(world.grip.request(GRIP_REQUEST_GRASP));
  world.run_to(GRIP_SQUEEZE);
  world.object_mm = 54.0;
  world.off_mm = 0.0;
  for (int i = 0; i < 4000 && world.report.state != GRIP_HOLDING; i++) {
    world.run(1e-3);
    ASSERT_NE(world.report.state, GRIP_DROPPED);
  }
  EXPECT_EQ(world.report.state, GRIP_HOLDING);
}

TEST(Grip, HoldsAndOpensWhenAsked) {
  GripWorld world({{"open-width", 60}});
  world.grasp();
  EXPECT_TRUE(world.grip.request(GRIP_REQUEST_HOLD));
  const double before_mm = world.width_mm;
  world.pull(5.0, 0.2);
  EXPECT_NEAR(world.width_mm, before_mm, 0.05);
  EXPECT_TRUE(world.grip.request(GRIP_REQUEST_RELEASE));
  world.run(1.0);
  EXPECT_NEAR(world.width_mm, before_mm + 10.0, 1.0);
  world.run_to(GRIP_OPEN);
}

TEST(Grip, PausesAreNotMadeUpFor) {
  GripWorld world;
  world.object_mm = 0.0;
  world.grip.request(GRIP_REQUEST_GRASP);
  world.run(0.5);
  const double before_mm = world.command.width_mm;
  world.t_s += 5.0;
  world.run(0.002);
  EXPECT_GT(world.command.width_mm, before_mm - 1.0);
}

TEST(GripFixed, HoldsItsForceByEquationsFiveAndSix) {
  for (const double gain : {1.0, 0.8}) {
    GripWorld world({{"fixed", 6}});
    world.gain = {gain, 1.0};
    world.grasp();
    world.run(3.0);
    expect_share(6.0, 0.5 * (world.report.finger_N[0] + world.report.finger_N[1]), 0.03);
  }
}

TEST(GripFixed, DoesNotHuntOnCoarseSteps) {
  GripWorld world({{"fixed", 6}}, gripper_traits("2f85"));
  world.grasp();
  world.run(2.0);
  world.turns = 0;
  world.run(5.0);
  EXPECT_LE(world.turns, 1);
}

// A load that rises fast is believed to become two thirds larger before the gripper moves, no more.
TEST(Grip, ALoadIsExpectedToRiseByNoMoreThanAShareOfIt) {
  GripWorld world({{"cap", 60.0}, {"start", 25.0}});
  world.stiffness = 12.0;
  world.delay_s = 0.01;
  world.grasp();
  double most = 0.0;
  for (int i = 0; i < 60; i++) {
    world.pull(0.3 * (i + 1), 1e-3);
    if (world.report.load_N > 7.0) {
      const double steady_N = world.settings.margin * world.report.load_N / world.report.friction;
      most = std::max(most, world.report.wanted_N / steady_N);
    }
  }
  EXPECT_LT(most, 1.7);
  EXPECT_GT(most, 1.4);
}

// Lowered onto a table it opens once the table has the load; pressed down or pulled it grips no harder.
TEST(Grip, PlacesOnATableAndHandsOverToAPull) {
  for (const double to_N : {1.9, 0.0, -3.0, 3.2}) {
    GripWorld world;
    world.grasp();
    EXPECT_FALSE(world.grip.request(GRIP_REQUEST_PLACE)); // there is no load
    world.pull(2.0, 0.3);
    world.run(2.0);
    const double before_N = world.force_N;
    ASSERT_TRUE(world.grip.request(to_N > 2.0 ? GRIP_REQUEST_HAND_OVER : GRIP_REQUEST_PLACE));
    world.run(0.5);
    EXPECT_EQ(world.report.state, to_N > 2.0 ? GRIP_HANDING : GRIP_PLACING);
    world.peak_N = 0.0, world.gain[0] = world.gain[1] = to_N > 2.0 ? 0.9 : 1.0; // a pull changes what is felt
    world.pull(to_N, 0.2);
    world.run(0.1);
    EXPECT_EQ(world.report.state, to_N == 1.9 ? GRIP_PLACING : GRIP_RELEASE) << to_N;
    EXPECT_LT(world.peak_N, 1.03 * before_N) << to_N;
  }
}

// A fingertip without a load is no evidence that a table or a person has it.
TEST(Grip, OpensByWhatEveryFingertipThatHadALoadReports) {
  for (const std::size_t hidden : {0u, 1u}) {
    for (const double to_N : {0.0, 3.2}) {
      GripWorld world;
      world.load_share[1] = 0.5;
      world.carry(2.0, 0.3, 2.0);
      ASSERT_TRUE(world.grip.request(to_N > 2.0 ? GRIP_REQUEST_HAND_OVER : GRIP_REQUEST_PLACE));
      world.drop_flags[hidden] = CONTACT_FLAG_TANGENTIAL_VALID;
      world.run(0.5);
      world.pull(to_N, 0.2);
      world.run(0.3);
      EXPECT_EQ(world.report.state, to_N > 2.0 ? GRIP_HANDING : GRIP_PLACING) << hidden;
      world.drop_flags[hidden] = 0;
      world.run(0.3);
      EXPECT_EQ(world.report.state, GRIP_RELEASE) << hidden << to_N;
    }
  }
}

// One whose frames do not come is none either, and one without a load worth the name never had it. Without any, nothing opens.
TEST(Grip, PlacesAndHandsOverWithoutAFingertipThatIsMuteOrHasHardlyALoad) {
  for (const double to_N : {0.0, 3.2}) {
    for (const int mutes : {0, 1, 2}) {
      GripWorld world;
      world.load_share[1] = mutes == 0 ? 0.04 : 1.0;
      world.carry(2.0, 0.3, 2.0);
      ASSERT_TRUE(world.grip.request(to_N > 2.0 ? GRIP_REQUEST_HAND_OVER : GRIP_REQUEST_PLACE));
      world.mute = {mutes == 2, mutes > 0};
      world.run(0.2);
      world.load_share[1] = mutes == 0 ? 0.0 : 1.0;
      world.drop_flags[1] = mutes == 0 && to_N == 0.0 ? std::uint32_t{CONTACT_FLAG_TANGENTIAL_VALID} : 0u;
      world.pull(to_N, 0.2);
      world.run(0.3);
      const bool waits = mutes == 2 || (mutes == 0 && to_N > 2.0);
      EXPECT_EQ(world.report.state, !waits ? GRIP_RELEASE : to_N > 2.0 ? GRIP_HANDING : GRIP_PLACING) << mutes << " " << to_N;
    }
  }
}

TEST(Grip, HandsOverWhatIsGone) {
  GripWorld world;
  world.carry(2.0, 0.3, 2.0);
  ASSERT_TRUE(world.grip.request(GRIP_REQUEST_HAND_OVER));
  world.object_mm = 0.0;
  world.run(0.2);
  EXPECT_EQ(world.report.state, GRIP_RELEASE);
}

TEST(Grip, SettingsChangeWhileItHolds) {
  GripWorld world;
  world.carry(4.0, 0.3, 1.0);
  EXPECT_GT(world.force_N, 7.0);
  ASSERT_TRUE(world.grip.change(settings_for(world.traits, {{"cap", 5}})));
  world.run(1.0);
  EXPECT_LT(world.force_N, 5.0);
  EXPECT_GT(world.force_N, 4.0);
  EXPECT_TRUE(world.report.trouble & GRIP_AT_CAP);
  EXPECT_FALSE(world.grip.change(settings_for(world.traits, {{"fixed", 5}})));
  ASSERT_TRUE(world.grip.change(world.settings));
  world.pull(5.0, 0.3);
  world.run(0.5);
  EXPECT_GT(world.force_N, 5.2);
  EXPECT_FALSE(world.report.trouble & GRIP_AT_CAP);
}

TEST(Grip, AnExpectedMassDecidesTheFirstGrip) {
  constexpr double MASS_kg = 0.6, LIFT_m_s2 = 2.0;
  for (const bool is_seen : {true, false}) {
    GripWorld world({{"mass", MASS_kg}, {"lift", LIFT_m_s2}, {"blind", 5}});
    world.drop_flags = {is_seen ? 0u : std::uint32_t{CONTACT_FLAG_TANGENTIAL_VALID}};
    world.drop_flags[1] = world.drop_flags[0];
    world.grasp();
    expect_share(world.settings.margin * MASS_kg * (9.81 + LIFT_m_s2) / (2.0 * world.settings.friction), world.force_N, 0.08);
  }
  GripWorld world({{"mass", 0.02}});
  world.grasp();
  expect_share(world.settings.floor_N, world.force_N, 0.15);
  world.pull(0.5, 0.3);
  world.run(2.0);
  const double before_N = world.force_N;
  ASSERT_TRUE(world.grip.change(settings_for(world.traits, {{"mass", 1.0}})));
  world.run(0.5);
  EXPECT_GT(world.force_N, 1.0 * 9.81 / 2.0 / world.report.friction);
  EXPECT_GT(world.force_N, 2.0 * before_N);
}
