// The moves of the gripper: below its cap, without hunting, as near as its steps come.
#include "grip_world.hpp"

using namespace fingertip;
using test::GripWorld;

TEST(Grip, NoHuntingWhileTheWantedForceFalls) {
  for (const char *model : {"2f85", "sts3215"}) {
    GripWorld world({}, gripper_traits(model));
    world.carry(4.0, 0.3, 1.0);
    world.pull(1.0, 0.3);
    world.turns = 0;
    world.run(4.0);
    EXPECT_LE(world.turns, 1) << model;
  }
}

TEST(Grip, TheTrueForceStaysBelowTheCap) {
  for (const double power : {1.3, 1.6, 1.9}) {
    for (const char *model : {"2f85", "sts3215"}) {
      GripWorld world({{"cap", 10}}, gripper_traits(model));
      world.power = power;
      world.gain = {0.92, 0.92};
      world.carry(16.0, 0.2, 2.0);
      EXPECT_LE(world.peak_N, 10.0) << model << " " << power;
      EXPECT_GT(world.peak_N, 5.0) << model << " " << power;
      EXPECT_LE(world.report.wanted_N, 10.0);
      EXPECT_NE(world.report.trouble & GRIP_AT_CAP, 0u);
    }
  }
}

TEST(Grip, OneThatIsFrozenInTheAirNeverLeadsBeyondTheCap) {
  for (const char *model : {"2f85", "sts3215"}) {
    for (const bool fixed : {false, true}) {
      GripWorld world(fixed ? std::map<std::string, double>{{"cap", 4}, {"fixed", 3.5}} : std::map<std::string, double>{{"cap", 4}},
                      gripper_traits(model));
      world.gain[0] = 0.0;
      world.object_mm = 55.0;
      ASSERT_TRUE(world.grip.request(GRIP_REQUEST_GRASP));
      world.run(6.0);
      EXPECT_GT(world.peak_N, fixed ? 0.5 : 1.0) << model;
      EXPECT_LT(world.peak_N, 4.0) << model << (fixed ? ", fixed" : "");
      EXPECT_NE(world.report.trouble & (GRIP_FINGERS_DIFFER | GRIP_NO_GRIP), 0u) << model;
    }
  }
}

TEST(Grip, AnUncertainForceIsHeldFirmlyEnough) {
  GripWorld world({{"cap", 20}}); // below the gripper's own least limit
  world.sd_share = 0.45;
  world.add_flags = {CONTACT_FLAG_FLAT, CONTACT_FLAG_FLAT};
  world.grasp();
  world.run(1.0);
  EXPECT_GT(world.force_N, 0.9 * world.settings.blind_N);
  EXPECT_LT(world.peak_N, world.settings.cap_N);
}

// One more move may exceed the cap, as far as the controller knows.
TEST(Grip, WhatSlidesNearTheCapIsHeldByTheGrippersOwnLimit) {
  GripWorld world({}, gripper_traits("2f85"));
  world.keeps_limit = true;
  world.stiffness = 12.0;
  world.grasp();
  world.pull(5.0, 0.5);
  world.slide(0.3, 30.0, 0.3);
  world.run(0.3);
  EXPECT_GT(world.force_N, 0.8 * world.settings.cap_N);
  EXPECT_LT(world.peak_N, world.settings.cap_N);
  EXPECT_NE(world.report.trouble & GRIP_AT_CAP, 0u);
}

TEST(Grip, NeverTravelsBeyondItsCap) {
  GripWorld world({{"travel-cap", 2.0}});
  world.stiffness = 0.5;
  world.grip.request(GRIP_REQUEST_GRASP);
  world.run(8.0);
  EXPECT_GE(world.width_mm, 37.0);
  EXPECT_NE(world.report.trouble & GRIP_AT_TRAVEL_CAP, 0u);
}

TEST(Grip, NeverTightensASaturatedFingertipNorWithoutFrames) {
  for (const bool mute : {false, true}) {
    GripWorld world;
    world.grasp();
    world.add_flags[0] = mute ? 0u : std::uint32_t{CONTACT_FLAG_SATURATED};
    world.mute = {mute, mute};
    world.run(0.1);
    const double before_mm = world.width_mm;
    world.pull(5.0, 0.2);
    world.run(0.5);
    EXPECT_GE(world.width_mm, before_mm);
    EXPECT_NE(world.report.trouble & (mute ? GRIP_FINGER_0_STALE : GRIP_FINGER_0_OVER), 0u);
  }
}

// A slide does not hurry a gripper that cannot keep the cap itself: each move shows before the next.
TEST(Grip, ASlideNeverLeadsBeyondALowCap) {
  GripperTraits limitless = test::fine_gripper();
  limitless.force_min_N = limitless.force_max_N = 0.0;
  for (const GripperTraits &gripper : {gripper_traits("2f85"), limitless}) {
    for (const double stiffness : {2.0, 2.5}) {
      GripWorld world({{"cap", 4.0}, {"start", 0.6}, {"floor", 0.5}}, gripper);
      world.stiffness = stiffness;
      world.power = 1.85, world.delay_s = 0.04;
      world.object_mm = 55.0;
      world.grasp();
      world.pull(0.4, 0.1);
      world.slide(0.6, 30.0, 0.5);
      world.run(0.3);
      EXPECT_LT(world.peak_N, 4.0) << stiffness;
    }
  }
}

// How stiff the contact is, moves show that begin and end with both fingertips on the object.
TEST(Grip, NoMoveExceedsALowCapWhereverTheFirstTouchIs) {
  for (const double off_mm : {0.0, 0.1}) {
    for (const double stiffness : {2.0, 3.5, off_mm == 0.0 ? 12.0 : 5.5}) {
      for (const double power : {1.3, 1.6, 1.9}) {
        for (double touch_mm = 0.0; touch_mm < 0.75; touch_mm += 0.05) {
          GripWorld world({{"cap", 2.4}, {"start", 1.0}, {"floor", 0.75}}, gripper_traits("2f85"));
          world.stiffness = stiffness;
          world.power = power;
          world.off_mm = off_mm;
          world.delay_s = 0.02;
          world.gain = {0.93, 0.93};
          world.object_mm = 55.0 + touch_mm;
          ASSERT_TRUE(world.grip.request(GRIP_REQUEST_GRASP));
          world.run(5.0);
          world.pull(world.report.state == GRIP_HOLDING ? 0.6 : 0.0, 0.3);
          world.run(0.5);
          const std::string about = testing::PrintToString(std::array{stiffness, power, touch_mm, off_mm});
          EXPECT_LE(world.peak_N, 2.4) << about;
          if (off_mm == 0.0) { // one that does not give may leave no room for the other pad
            EXPECT_EQ(world.report.state, GRIP_HOLDING) << about;
            EXPECT_GE(world.force_N, (world.report.trouble & GRIP_AT_CAP) != 0 ? 0.4 : 0.55) << about; // what is weaker says why
          }
        }
      }
    }
  }
}

// A gripper whose least move is two steps holds a set force within one of them.
TEST(Grip, ASetForceIsHeldAsNearAsItsLeastMove) {
  const double set_N = 8.0;
  for (double stiffness = 2.0; stiffness < 6.0; stiffness += 0.1) {
    GripWorld world({{"start", set_N}, {"floor", set_N}, {"blind", set_N}}, gripper_traits("2f85"));
    world.keeps_limit = true;
    world.stiffness = stiffness;
    world.grasp();
    world.run(2.0);
    const double deep_mm = 0.5 * (world.object_mm - world.width_mm);
    const double step_N = world.power * world.force_N / deep_mm * 0.5 * world.traits.step_mm;
    EXPECT_LT(std::abs(world.force_N - set_N), 1.6 * step_N) << stiffness;
  }
}
