#include "grip_world.hpp"
#include "libfingertip/error.hpp"

using namespace fingertip;
using test::fine_gripper;
using test::GripWorld;

namespace {

void expect_share(double expected, double found, double share) {
  EXPECT_NEAR(found, expected, share * expected);
}

} // namespace

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

TEST(Grip, ApproachesAtItsSpeedAndSlowerWhereFramesComeLate) {
  for (const double delay_s : {0.0, 0.15}) {
    GripWorld world;
    world.delay_s = delay_s;
    world.grip.request(GRIP_REQUEST_GRASP);
    world.run(1.0 + delay_s);
    ASSERT_EQ(world.report.state, GRIP_APPROACH);
    const double gone_mm = 60.0 - world.width_mm;
    if (delay_s == 0.0) {
      EXPECT_NEAR(gone_mm, 8.0, 0.4);
    } else {
      EXPECT_LT(gone_mm, 4.0);
    }
  }
}

TEST(Grip, ApproachEndsWhereNothingIs) {
  GripWorld world;
  world.object_mm = 0.0;
  world.grip.request(GRIP_REQUEST_GRASP);
  world.run_to(GRIP_MISSED, 9.0);
  EXPECT_EQ(world.command.motion, GRIP_STAY);
}

// One fingertip's touch is no grasp: the other has to feel the object too.
TEST(Grip, OneFingertipsTouchIsNoGrasp) {
  GripWorld world;
  world.off_mm = 0.15;
  world.grasp();
  EXPECT_GT(world.report.felt_N[1], world.settings.touch_N);
  EXPECT_LT(world.report.felt_N[0], 2.0 * world.settings.start_N);
}

TEST(Grip, NoJumpWhileItSqueezes) {
  for (const double stiffness : {1.5, 3.0, 6.0}) {
    GripWorld world({}, gripper_traits("2f85"));
    world.stiffness = stiffness;
    world.grasp();
    EXPECT_LT(world.peak_N, 2.0 * world.settings.start_N) << stiffness;
  }
}

TEST(Grip, FollowsTheLoadAndFallsToTheFloorThen) {
  GripWorld world;
  world.grasp();
  world.pull(3.0, 0.3);
  world.run(1.5);
  const double needed_N = world.settings.margin * 3.0 / world.report.friction;
  expect_share(needed_N, world.force_N, 0.08);
  expect_share(3.0, world.report.load_N, 0.05);
  expect_share(world.settings.margin, world.report.margin, 0.12);
  world.pull(0.3, 0.5);
  world.run(2.5);
  expect_share(world.settings.floor_N, world.force_N, 0.15);
}

TEST(Grip, AMarginIsToldOnlyWhereThereIsALoad) {
  GripWorld world;
  world.grasp();
  world.load_N = 0.05;
  world.run(0.5);
  EXPECT_EQ(world.report.margin, 0.0);
}

TEST(Grip, WhatPullsBeforeCountsAsNone) {
  GripWorld world;
  world.load_N = 0.4;
  world.grasp();
  world.run(1.0);
  EXPECT_LT(world.report.load_N, 0.05);
}

// A slide is learnt from as it goes on: its friction is that of motion, not the larger one of rest.
TEST(Grip, LearnsFrictionWhileItSlides) {
  GripWorld world;
  world.grasp();
  world.pull(2.5, 0.3);
  world.run(0.5);
  const double held = world.load_N / world.force_N;
  world.slide(0.95 * held, 10.0, 0.01);
  world.slide(0.7 * held, 40.0, 0.06);
  EXPECT_EQ(world.report.slides, 1u);
  expect_share(0.7 * held, world.report.friction, 0.05);
}

// What slides carries more as its grip grows. What carries less has been caught, though the slide is
// still reported: its ratio is no friction.
TEST(GripHold, WhatHasBeenCaughtTeachesNoFriction) {
  for (const double load_N : {1.5, 4.0}) {
    const GripSettings settings;
    GripHold hold;
    hold.begin();
    GripFelts felt;
    felt.fresh = felt.tells_load = true;
    double now_s = 1.0;
    const auto frames = [&](double grip_N, double carries_N, double speed_mm_s) {
      felt.slides = speed_mm_s > 0.0;
      felt.speed_mm_s = speed_mm_s;
      felt.grip_N = grip_N;
      felt.load_N = carries_N;
      felt.ratio = carries_N / grip_N;
      for (int i = 0; i < 20; i++) {
        now_s += 2.4e-3;
        hold.wants(felt, grip_N, settings, now_s, 0.04);
      }
    };
    frames(5.0, 1.5, 0.0);
    frames(5.0, 2.0, 40.0);
    ASSERT_NEAR(hold.friction(settings), 0.4, 1e-9);
    frames(12.0, load_N, 50.0);
    EXPECT_NEAR(hold.friction(settings), load_N < 2.0 ? 0.4 : load_N / 12.0, 1e-9) << load_N;
  }
}

TEST(Grip, ASlideRaisesTheGripAtOnceAndEndsAtItsMargin) {
  GripWorld world;
  world.grasp();
  world.pull(2.0, 0.3);
  world.run(1.0);
  const double before_N = world.force_N, friction = 0.8 * 2.0 / before_N;
  world.slide(friction, 20.0, 0.03);
  EXPECT_EQ(world.report.state, GRIP_SLIPPING);
  EXPECT_GT(world.force_N, 1.05 * before_N);
  world.load_N = 2.0;
  world.run(2.0);
  EXPECT_EQ(world.report.state, GRIP_HOLDING);
  expect_share(friction, world.report.friction, 0.1);
  const double needed_N = world.settings.margin * world.settings.slid * 2.0 / world.report.friction;
  expect_share(needed_N, world.force_N, 0.05);
}

// A load that stood still before a slide may have grown since: what slides and does not slow down
// carries its friction at least, however small the load was before.
TEST(Grip, ASlideThatGoesOnTellsALargerLoad) {
  GripWorld world;
  world.grasp();
  world.pull(0.8, 0.3);
  world.run(1.0);
  const double before_N = world.force_N;
  for (double speed_mm_s = 20.0; speed_mm_s < 60.0; speed_mm_s += 1.0) {
    world.slide(0.6, speed_mm_s, 0.01);
  }
  EXPECT_GT(world.force_N, 2.5 * before_N);
}

// A load that rises fast is expected to go on. Where it does not, the grip that was wanted for it
// is given up before the gripper has made it.
TEST(Grip, WhatWasExpectedAndHasNotComeIsNotPursued) {
  GripperTraits slow = fine_gripper();
  slow.latency_s = 0.025;
  GripWorld world({{"cap", 15.0}}, slow); // each move shows before the next
  world.grasp();
  world.pull(2.0, 0.03);
  const double expected_N = world.report.wanted_N;
  world.run(0.1);
  const double needed_N = world.settings.margin * 2.0 / world.report.friction;
  ASSERT_GT(expected_N, 1.4 * needed_N);
  EXPECT_LT(world.report.wanted_N, 1.1 * needed_N);
  EXPECT_LT(world.peak_N, 0.85 * expected_N);
}

// The tangential force of a sliding contact is its friction, no load: it does not feed itself.
TEST(Grip, ASteadyLoadIsNotWhatSlides) {
  GripWorld world;
  world.grasp();
  world.pull(2.0, 0.3);
  world.run(1.0);
  const double friction = 0.7 * 2.0 / world.force_N;
  const double needed_N = world.settings.margin * world.settings.slid * 2.0 / friction;
  world.slide(friction, 30.0, 0.02);
  world.load_N = 2.0;
  world.run(0.05);
  EXPECT_LT(world.peak_N, 1.3 * needed_N);
}

// Nor does one that slows down: it is caught already.
TEST(Grip, WhatSlidesInALiftDoesNotFeedItself) {
  GripWorld world;
  world.grasp();
  world.pull(1.5, 0.05);
  const double friction = world.load_N / world.force_N, before_N = world.force_N;
  world.slide(friction, 30.0, 0.015);
  for (double speed_mm_s = 28.0; speed_mm_s > 10.0; speed_mm_s *= 0.9) {
    world.slide(friction, speed_mm_s, 0.005); // and the slide slows down
  }
  EXPECT_GT(world.force_N, 1.2 * before_N);
  EXPECT_LT(world.force_N, 1.65 * before_N);
}

// A slide is still reported when the object has been caught already. What it asked for and is not
// under way is given up then.
TEST(Grip, ASlideThatSlowsDownIsNotPursued) {
  GripperTraits slow = fine_gripper();
  slow.latency_s = 0.05;
  GripWorld world({{"cap", 15.0}}, slow); // each move shows before the next
  world.grasp();
  world.pull(2.5, 0.03);
  const double expected_N = world.report.wanted_N;
  world.slides = {true, true};
  for (world.slide_mm_s = 30.0; world.slide_mm_s > 5.0; world.slide_mm_s *= 0.8) {
    world.run(0.005);
  }
  world.run(0.05);
  EXPECT_EQ(world.report.state, GRIP_SLIPPING);
  EXPECT_LT(world.report.wanted_N, 0.9 * expected_N);
}

// Squeezed rubber moves a contact by less than a millimetre, far below what it holds.
TEST(Grip, AShortMotionFarBelowWhatHoldsIsNoSlide) {
  GripWorld world;
  world.grasp();
  world.pull(2.0, 0.3);
  world.run(1.0);
  const double held = world.load_N / world.force_N;
  world.slide(0.4 * held, 9.0, 0.07);
  EXPECT_EQ(world.report.slides, 0u);
  world.load_N = 2.0;
  world.run(0.3);
  world.slide(0.4 * held, 9.0, 0.13);
  EXPECT_EQ(world.report.slides, 1u);
}

// What has held more a moment ago does not slide at less, unless it moves far.
TEST(Grip, WhatHeldMoreAMomentAgoTeachesNothing) {
  GripWorld world;
  world.grasp();
  world.pull(3.5, 0.2);
  const double before = world.report.friction;
  world.slide(0.3 * before, 6.0, 0.02);
  EXPECT_GE(world.report.friction, before);
}

TEST(Grip, NoHuntingWhileTheWantedForceFalls) {
  for (const char *model : {"2f85", "sts3215"}) {
    GripWorld world({}, gripper_traits(model));
    world.grasp();
    world.pull(4.0, 0.3);
    world.run(1.0);
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
      world.grasp();
      world.pull(9.0, 0.2);
      world.run(2.0);
      EXPECT_LE(world.peak_N, 10.0) << model << " " << power;
      EXPECT_GT(world.peak_N, 5.0) << model << " " << power;
      EXPECT_NE(world.report.trouble & GRIP_AT_CAP, 0u);
    }
  }
}

TEST(Grip, OneThatIsFrozenInTheAirNeverLeadsBeyondTheCap) {
  for (const char *model : {"2f85", "sts3215"}) {
    for (const bool fixed : {false, true}) {
      GripWorld world(fixed ? std::map<std::string, double>{{"cap", 4}, {"fixed", 3.5}}
                            : std::map<std::string, double>{{"cap", 4}},
                      gripper_traits(model));
      world.gain[0] = 0.0;
      ASSERT_TRUE(world.grip.request(GRIP_REQUEST_GRASP));
      world.run(6.0);
      EXPECT_GT(world.peak_N, 1.0) << model;
      EXPECT_LT(world.peak_N, 4.0) << model << (fixed ? ", fixed" : "");
      EXPECT_NE(world.report.trouble & GRIP_FINGERS_DIFFER, 0u) << model;
    }
  }
}

TEST(Grip, AnUncertainForceIsHeldFirmlyEnough) {
  GripWorld world({{"cap", 20}}); // below the gripper's own least limit
  world.sd_share = 0.45;
  world.drop_flags = {CONTACT_FLAG_TANGENTIAL_VALID, CONTACT_FLAG_TANGENTIAL_VALID};
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

// What tells no load will tell no slide either.
TEST(Grip, NothingIsMissingWhereNoLoadIsTold) {
  for (double stiffness = 4.0; stiffness < 12.0; stiffness += 0.5) {
    GripWorld world({}, gripper_traits("2f85"));
    world.keeps_limit = true;
    world.stiffness = stiffness;
    world.drop_flags = {CONTACT_FLAG_TANGENTIAL_VALID, CONTACT_FLAG_TANGENTIAL_VALID};
    world.grasp();
    EXPECT_GT(world.force_N, 0.97 * world.settings.blind_N) << stiffness;
    EXPECT_LT(world.peak_N, world.settings.cap_N) << stiffness;
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

TEST(Grip, NeverTravelsBeyondItsCap) {
  GripWorld world({{"travel-cap", 2.0}});
  world.stiffness = 0.5;
  world.grip.request(GRIP_REQUEST_GRASP);
  world.run(8.0);
  EXPECT_GE(world.width_mm, 37.0);
  EXPECT_NE(world.report.trouble & GRIP_AT_TRAVEL_CAP, 0u);
}

TEST(Grip, NeverTightensASaturatedFingertip) {
  GripWorld world;
  world.grasp();
  world.add_flags[0] = CONTACT_FLAG_SATURATED;
  world.run(0.1);
  const double before_mm = world.width_mm;
  world.pull(5.0, 0.2);
  world.run(0.5);
  EXPECT_GE(world.width_mm, before_mm);
  EXPECT_NE(world.report.trouble & GRIP_FINGER_0_OVER, 0u);
}

TEST(Grip, GripsForTheBlindWithoutALoad) {
  GripWorld world({{"blind", 9}});
  world.drop_flags = {CONTACT_FLAG_TANGENTIAL_VALID, CONTACT_FLAG_TANGENTIAL_VALID};
  world.grasp();
  world.run(0.1);
  expect_share(9.0, world.force_N, 0.2);
  EXPECT_NE(world.report.trouble & GRIP_NO_LOAD, 0u);
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
  world.mute = {true, true};
  world.run(0.2);
  EXPECT_NE(world.report.trouble & GRIP_FINGER_0_STALE, 0u);
}

TEST(Grip, GoesOnWithOneFingertipAndStaysWithoutAny) {
  GripWorld world;
  world.grasp();
  world.mute[0] = true;
  world.run(0.1);
  EXPECT_EQ(world.report.trouble, GRIP_FINGER_0_STALE);
  world.pull(2.0, 0.3);
  world.run(0.5);
  EXPECT_GT(world.force_N, 2.0 / world.settings.friction);
  world.mute[1] = true;
  world.run(0.1);
  const double before_mm = world.width_mm;
  world.run(1.0);
  EXPECT_EQ(world.width_mm, before_mm);
}

TEST(Grip, DoesNotBelieveAFrozenFingertip) {
  GripWorld world;
  world.grasp();
  world.frozen[1] = true;
  world.run(0.2);
  EXPECT_NE(world.report.trouble & GRIP_FINGER_1_FROZEN, 0u);
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
  world.run(1.0);
  EXPECT_NE(world.report.trouble & GRIP_FINGERS_DIFFER, 0u);
  EXPECT_GT(world.report.felt_N[0], 1.8 * world.report.felt_N[1]);
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

TEST(Grip, KeepsStillWhileTheGripperIsSilent) {
  GripWorld world;
  world.grasp();
  world.gripper_mute = true;
  world.run(0.6);
  EXPECT_NE(world.report.trouble & GRIP_GRIPPER_SILENT, 0u);
  EXPECT_EQ(world.command.motion, GRIP_STAY);
  world.gripper_mute = false;
  world.run(0.1);
  EXPECT_EQ(world.report.state, GRIP_HOLDING);
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
  world.stiffness = 5.0;
  world.off_mm = 0.3;
  ASSERT_TRUE(world.grip.request(GRIP_REQUEST_GRASP));
  world.run_to(GRIP_SQUEEZE);
  world.object_mm = 38.0;
  world.off_mm = 0.0;
  for (int i = 0; i < 4000 && world.report.state != GRIP_HOLDING; i++) {
    world.run(1e-3);
    ASSERT_NE(world.report.state, GRIP_DROPPED);
  }
  EXPECT_EQ(world.report.state, GRIP_HOLDING);
}

// A slide does not hurry a gripper that cannot keep the cap itself: each move shows before the
// next.
TEST(Grip, ASlideNeverLeadsBeyondALowCap) {
  for (const double stiffness : {2.0, 2.5}) {
    GripWorld world({{"cap", 4.0}, {"start", 0.6}, {"floor", 0.5}}, gripper_traits("2f85"));
    world.stiffness = stiffness;
    world.power = 1.85;
    world.delay_s = 0.04;
    world.grasp();
    world.pull(0.4, 0.1);
    world.slide(0.6, 30.0, 0.5);
    world.run(0.3);
    EXPECT_LT(world.peak_N, 4.0) << stiffness;
  }
}

// A gripper of which the least move is two steps, and the cap has no room for two: it goes back by
// those and on by three. Before that the grip is far too weak.
TEST(Grip, GoesRoundWhereTheCapHasRoomForAStepAndNotForTheLeastMove) {
  GripWorld world({{"cap", 2.4}, {"start", 1.0}, {"floor", 0.75}}, gripper_traits("2f85"));
  const double count_mm = world.traits.step_mm;
  world.stiffness = 4.0;
  // Pressed in by 0.3 mm a pad at a count: 0.58 N; a count more makes 1.3 N, two 2.2 N.
  world.object_mm = 107.0 * count_mm + 0.6;
  world.grasp();
  EXPECT_NEAR(world.width_mm, 106.0 * count_mm, 1e-6);
  EXPECT_GT(world.force_N, 0.8 * world.settings.start_N);
  EXPECT_LT(world.peak_N, 0.7 * world.settings.cap_N);
}

// How stiff the contact is, moves show that begin and end with both fingertips on the object.
TEST(Grip, NoMoveExceedsALowCapWhereverTheFirstTouchIs) {
  for (const double off_mm : {0.0, 0.1}) {
    for (const double stiffness : {2.0, 3.5, 5.5}) {
      for (const double power : {1.3, 1.6, 1.9}) {
        for (double touch_mm = 0.0; touch_mm < 0.75; touch_mm += 0.05) {
          GripWorld world({{"cap", 2.4}, {"start", 1.0}, {"floor", 0.75}}, gripper_traits("2f85"));
          world.stiffness = stiffness;
          world.power = power;
          world.off_mm = off_mm;
          world.delay_s = 0.02;
          world.gain = {0.93, 0.93};
          world.object_mm = 40.0 + touch_mm;
          ASSERT_TRUE(world.grip.request(GRIP_REQUEST_GRASP));
          world.run(5.0);
          world.pull(world.report.state == GRIP_HOLDING ? 0.6 : 0.0, 0.3);
          world.run(0.5);
          const auto about = std::to_string(stiffness) + " " + std::to_string(power) + " " +
                             std::to_string(touch_mm) + " " + std::to_string(off_mm);
          EXPECT_LE(world.peak_N, 2.4) << about;
          if (off_mm == 0.0) { // one that does not give may leave no room for the other pad
            EXPECT_EQ(world.report.state, GRIP_HOLDING) << about;
            EXPECT_GE(world.force_N, 0.75) << about;
          }
        }
      }
    }
  }
}

TEST(Grip, SaysThatTheObjectIsGone) {
  GripWorld world;
  world.grasp();
  world.object_mm = 0.0;
  world.run_to(GRIP_DROPPED, 0.5);
  const double before_mm = world.width_mm;
  world.run(0.5);
  EXPECT_EQ(world.width_mm, before_mm);
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
    expect_share(6.0, 0.5 * (world.report.felt_N[0] + world.report.felt_N[1]), 0.03);
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

// Anything that may come: the numbers stay numbers, and the widths within the gripper's stroke.
TEST(Grip, NothingWrongComesOfAnything) {
  std::uint64_t state = 12345;
  const auto draw = [&](double low, double high) {
    state = state * 6364136223846793005u + 1442695040888963407u;
    return low + (high - low) * static_cast<double>(state >> 11) * 0x1p-53;
  };
  for (int grasp = 0; grasp < 60; grasp++) {
    const GripperTraits traits = gripper_traits(grasp % 2 == 0 ? "2f85" : "sts3215");
    Grip grip(default_settings(traits), traits);
    double t_s = 1.0;
    for (int i = 0; i < 2000; i++) {
      t_s += draw(0.0, 0.01);
      GripTouch touch;
      touch.t_s = t_s - draw(-0.01, 0.1);
      touch.flags = static_cast<std::uint32_t>(draw(0.0, 0x2000000));
      touch.force_N = draw(-1.0, 30.0);
      touch.force_sd_N = draw(0.0, 5.0);
      touch.sigma_mm = draw(0.0, 30.0);
      touch.qx_N = draw(-20.0, 20.0);
      touch.speed_mm_s = draw(0.0, 100.0);
      grip.take(static_cast<std::size_t>(draw(0.0, 3.0)), touch);
      GripperStatus status;
      status.host_us = std::llround(1e6 * (t_s - draw(0.0, 0.01)));
      status.active = draw(0.0, 1.0) > 0.01;
      status.moving = draw(0.0, 1.0) > 0.5;
      status.width_mm = draw(0.0, traits.stroke_mm);
      grip.take(status);
      if (draw(0.0, 1.0) > 0.98) {
        grip.request(static_cast<GripRequest>(draw(0.0, 3.0)));
      }
      GripCommand command;
      const GripReport report = grip.step(t_s, command);
      for (const double value : {command.width_mm, command.speed_mm_s, command.force_N,
                                 report.wanted_N, report.load_N, report.margin, report.friction}) {
        ASSERT_TRUE(std::isfinite(value));
      }
      ASSERT_GE(command.width_mm, 0.0);
      ASSERT_LE(command.width_mm, traits.stroke_mm + 1e-9);
      ASSERT_LE(report.wanted_N, default_settings(traits).cap_N);
    }
  }
}

// A gripper of which the least move is two steps goes round to a step alone.
TEST(Grip, ASetForceIsHeldAsNearAsAStep) {
  const double set_N = 8.0;
  for (double stiffness = 2.0; stiffness < 6.0; stiffness += 0.1) {
    GripWorld world({{"start", set_N}, {"floor", set_N}, {"blind", set_N}}, gripper_traits("2f85"));
    world.keeps_limit = true;
    world.stiffness = stiffness;
    world.grasp();
    world.run(2.0);
    const double deep_mm = 0.5 * (world.object_mm - world.width_mm);
    const double step_N = world.power * world.force_N / deep_mm * 0.5 * world.traits.step_mm;
    EXPECT_LT(std::abs(world.force_N - set_N), 0.75 * step_N) << stiffness;
  }
}

// The same where the rubber relaxes; only there does the gripper open on the way.
TEST(Grip, ASetForceIsFollowedRoundOnlyWhereALoadWouldBeFelt) {
  for (const bool tells : {true, false}) {
    GripWorld world({{"start", 8.0}, {"floor", 8.0}, {"blind", 8.0}}, gripper_traits("2f85"));
    world.keeps_limit = true;
    world.stiffness = 4.0;
    if (!tells) {
      world.drop_flags = {CONTACT_FLAG_TANGENTIAL_VALID, CONTACT_FLAG_TANGENTIAL_VALID};
    }
    world.grasp();
    double before_mm = world.width_mm, opened_mm = 0.0;
    for (int i = 0; i < 6000; i++) {
      world.stiffness -= 0.8 / 6000;
      world.run(1e-3);
      opened_mm = std::max(opened_mm, world.width_mm - before_mm);
      before_mm = world.width_mm;
    }
    EXPECT_EQ(opened_mm > 0.0, tells);
    EXPECT_EQ(world.report.state, GRIP_HOLDING);
    EXPECT_GT(world.force_N, tells ? 7.0 : 6.0);
  }
}

// What pulls on the way round ends it: the gripper closes at once.
TEST(Grip, ALoadEndsGoingRound) {
  GripWorld world({{"start", 8.0}, {"floor", 8.0}, {"blind", 8.0}}, gripper_traits("2f85"));
  world.keeps_limit = true;
  world.stiffness = 4.0;
  world.grasp();
  const double held_mm = world.width_mm + 0.5 * world.traits.step_mm;
  for (int i = 0; i < 8000 && world.command.width_mm < held_mm; i++) {
    world.stiffness -= 1e-4;
    world.run(1e-3);
  }
  ASSERT_GT(world.command.width_mm, held_mm);
  world.pull(1.0, 0.005);
  world.run(0.03);
  EXPECT_LT(world.command.width_mm, held_mm);
}

// A set force that going round would take away for a moment is not gone round to.
TEST(Grip, GoingRoundNeverLosesTheObject) {
  for (double stiffness = 4.0; stiffness < 12.0; stiffness += 0.25) {
    GripWorld world({{"start", 2.0}, {"floor", 2.0}, {"blind", 2.0}}, gripper_traits("2f85"));
    world.keeps_limit = true;
    world.stiffness = stiffness;
    world.grasp();
    for (int i = 0; i < 4000; i++) {
      world.stiffness *= 1.0 - 0.3 / 4000;
      world.run(1e-3);
      ASSERT_GT(world.force_N, 0.2) << stiffness;
    }
    EXPECT_EQ(world.report.state, GRIP_HOLDING) << stiffness;
  }
}

// A load that rises fast is believed to become four fifths larger before the gripper moves, no
// more.
TEST(Grip, ALoadIsExpectedToRiseByNoMoreThanAShareOfIt) {
  GripWorld world({{"cap", 60.0}, {"start", 25.0}});
  world.stiffness = 12.0;
  world.delay_s = 0.03;
  world.grasp();
  double most = 0.0;
  for (int i = 0; i < 60; i++) {
    world.pull(0.3 * (i + 1), 1e-3);
    if (world.report.load_N > 7.0) {
      const double steady_N = world.settings.margin * world.report.load_N / world.report.friction;
      most = std::max(most, world.report.wanted_N / steady_N);
    }
  }
  EXPECT_LT(most, 1.85);
  EXPECT_GT(most, 1.7);
}
