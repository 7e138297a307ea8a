#include "support/random.h"
#include "world.h"

#include <math.h>
#include <string.h>
#include <unity.h>

static struct world world;
static struct grip_settings settings;

void setUp(void) {
  world_begin(&world);
  settings = world.grip.settings;
}

void tearDown(void) {}

static void grasp(void) {
  TEST_ASSERT_TRUE(grip_request(&world.grip, GRIP_REQUEST_GRASP));
  world_run_to(&world, GRIP_HOLDING, 6000);
}

/* Loads rise in so many ms. */
static void pull(int32_t load_mN, uint32_t ms) {
  int32_t from_mN = world.load_mN;
  for (uint32_t i = 1; i <= ms; i++) {
    world.load_mN = from_mN + (load_mN - from_mN) * (int32_t)i / (int32_t)ms;
    world_run(&world, 1);
  }
}

/* The object slides at so much of Q / F for so many ms. */
static void slide(int32_t share_permille, uint32_t ms) {
  world.add_flags[1] |= CONTACT_FLAG_SLIDING;
  for (uint32_t i = 0; i < ms; i++) {
    world.load_mN = (int32_t)(1e-3 * share_permille * world.force_mN);
    world_run(&world, 1);
  }
  world.add_flags[1] &= ~(uint32_t)CONTACT_FLAG_SLIDING;
}

static void assert_within(double share, double expected, double found) {
  TEST_ASSERT_DOUBLE_WITHIN(share * expected, expected, found);
}

static void grasps_with_the_first_force(void) {
  grasp();
  assert_within(0.05, settings.first_mN, world.force_mN);
  TEST_ASSERT_EQUAL(0, world.report.trouble);
  world_run(&world, 2000);
  assert_within(0.05, settings.first_mN, world.force_mN);
  TEST_ASSERT_EQUAL(0, world.report.load_mN);
}

static void approaches_at_its_speed(void) {
  grip_request(&world.grip, GRIP_REQUEST_GRASP);
  world_run(&world, 1000);
  TEST_ASSERT_EQUAL(GRIP_APPROACH, world.report.state);
  TEST_ASSERT_DOUBLE_WITHIN(300.0, 60000.0 - 8000.0, world.width_um);
}

static void approach_ends_where_nothing_is(void) {
  world.object_um = 0.0;
  grip_request(&world.grip, GRIP_REQUEST_GRASP);
  world_run_to(&world, GRIP_MISSED, 9000);
  TEST_ASSERT_EQUAL(GRIP_STAY, world.command.motion);
}

static void follows_the_load(void) {
  grasp();
  pull(1500, 300);
  world_run(&world, 300);
  double needed = 1500.0 * settings.margin_permille / settings.friction_permille;
  assert_within(0.06, needed, world.force_mN);
  assert_within(0.05, 1500, world.report.load_mN);
  assert_within(0.10, settings.margin_permille, world.report.margin_permille);
}

static void counts_what_pulls_before_as_none(void) {
  world.load_mN = 400;
  grasp();
  world_run(&world, 1000);
  assert_within(0.05, settings.first_mN, world.force_mN);
  pull(1900, 300);
  world_run(&world, 300);
  assert_within(0.06, 1500.0 * settings.margin_permille / settings.friction_permille,
                world.force_mN);
}

static void takes_the_larger_of_loads_that_differ(void) {
  grasp();
  world.drop_flags[1] = CONTACT_FLAG_TANGENTIAL_VALID;
  pull(1000, 200);
  world_run(&world, 800);
  assert_within(0.06, 1000.0 * settings.margin_permille / settings.friction_permille,
                world.force_mN);
}

static void raises_the_grip_where_the_object_slides(void) {
  grasp();
  pull(1000, 300);
  world_run(&world, 300);
  double before_mN = world.force_mN;
  int32_t share_permille = (int32_t)(1e3 * world.load_mN / before_mN);
  slide(share_permille, 15);
  TEST_ASSERT_EQUAL(GRIP_SLIPPING, world.report.state);
  TEST_ASSERT_GREATER_THAN(before_mN * 1.05, world.force_mN);
  TEST_ASSERT_EQUAL(1, world.report.slides);
  slide(share_permille, 200);
  TEST_ASSERT_GREATER_THAN(before_mN * 2.0, world.force_mN);
  TEST_ASSERT_LESS_OR_EQUAL(1.02 * settings.force_cap_mN, world.force_mN);
  world.load_mN = 1000;
  world_run(&world, 20);
  TEST_ASSERT_EQUAL(GRIP_HOLDING, world.report.state);
  double caught_mN = world.report.wanted_mN;
  world_run(&world, settings.rest_us / 1000 - 100);
  TEST_ASSERT_EQUAL((int32_t)caught_mN, world.report.wanted_mN);
}

/* Q stays as the grip grows: what is squeezed moves, and does not slide. */
static void a_squeeze_does_not_feed_itself(void) {
  grasp();
  pull(1000, 300);
  world_run(&world, 300);
  double needed_mN = 1000.0 * settings.margin_permille / world.report.friction_permille;
  world.add_flags[0] = CONTACT_FLAG_SLIDING;
  world_run(&world, 400);
  TEST_ASSERT_EQUAL(1, world.report.slides);
  double learned = world.report.friction_permille;
  TEST_ASSERT_LESS_OR_EQUAL(2.1 * needed_mN, world.force_mN);
  double slid_mN = 1e-3 * settings.slid_permille * 1000.0 * settings.margin_permille / learned;
  TEST_ASSERT_LESS_OR_EQUAL(1.05 * slid_mN, world.force_mN);
}

static void a_late_gripper_is_asked_for_no_more_than_twice_what_is_felt(void) {
  grasp();
  pull(1000, 300);
  world_run(&world, 300);
  world.grip.traits.speed_max_um_s = world.grip.traits.speed_min_um_s;
  int32_t share_permille = (int32_t)(1e3 * world.load_mN / world.force_mN);
  for (int i = 0; i < 300; i++) {
    slide(share_permille, 1);
    TEST_ASSERT_LESS_OR_EQUAL(2.02 * world.force_mN, world.report.wanted_mN);
  }
  TEST_ASSERT_GREATER_THAN(1.5 * world.force_mN, world.report.wanted_mN);
}

static void what_held_more_a_moment_ago_does_not_slide(void) {
  grasp();
  pull(1500, 60);
  int32_t friction = world.report.friction_permille;
  world.load_mN = 700; /* as the grip grows for what pulled */
  world_run(&world, 10);
  world.add_flags[0] = CONTACT_FLAG_SLIDING;
  world_run(&world, 30);
  TEST_ASSERT_EQUAL(GRIP_HOLDING, world.report.state);
  TEST_ASSERT_EQUAL(0, world.report.slides);
  TEST_ASSERT_EQUAL(friction, world.report.friction_permille);
  world_run(&world, 300); /* but what goes on to say so does */
  TEST_ASSERT_EQUAL(1, world.report.slides);
}

static void told_to_slide_at(int32_t one_um_s, int32_t other_um_s, uint32_t ms) {
  world.speed_um_s[0] = one_um_s;
  world.speed_um_s[1] = other_um_s;
  world.add_flags[0] = CONTACT_FLAG_SLIDING;
  world_run(&world, ms);
}

static void what_settles_is_held_a_little_harder_and_teaches_nothing(void) {
  static const int32_t others_um_s[] = {3000, 10000};
  for (size_t i = 0; i < sizeof others_um_s / sizeof *others_um_s; i++) {
    setUp();
    grasp();
    pull(1000, 300);
    world_run(&world, 300);
    double before_mN = world.force_mN;
    int32_t friction = world.report.friction_permille;
    told_to_slide_at(3000, others_um_s[i], 100);
    assert_within(0.1, 1.15 * before_mN, world.force_mN);
    TEST_ASSERT_EQUAL(GRIP_HOLDING, world.report.state);
    TEST_ASSERT_EQUAL(0, world.report.slides);
    TEST_ASSERT_EQUAL(friction, world.report.friction_permille);
    told_to_slide_at(3000, others_um_s[i], 200); /* but what goes on for long slides */
    TEST_ASSERT_EQUAL(1, world.report.slides);
  }
  setUp();
  grasp();
  pull(1000, 300);
  world_run(&world, 300);
  told_to_slide_at(6000, 6000, 10);
  TEST_ASSERT_EQUAL(1, world.report.slides);
}

/* Of friction that falls while the grip grows, load over force falls far. */
static void what_runs_slides_whatever_its_load_over_force(void) {
  grasp();
  pull(3000, 300);
  world_run(&world, 100);
  world.load_mN = 1200;
  world_run(&world, 10);
  told_to_slide_at(10000, 10000, 10);
  TEST_ASSERT_EQUAL(0, world.report.slides);
  told_to_slide_at(10000, 60000, 10); /* of the one that is told to slide */
  TEST_ASSERT_EQUAL(0, world.report.slides);
  double before_mN = world.force_mN;
  told_to_slide_at(60000, 60000, 10);
  TEST_ASSERT_EQUAL(1, world.report.slides);
  world.load_mN = 600;
  world_run(&world, 200);
  TEST_ASSERT_GREATER_THAN(2.0 * before_mN, world.force_mN);
}

/* More pulls than is told. */
static void what_slides_without_a_load_is_caught_by_doubling(void) {
  grasp();
  double before_mN = world.force_mN;
  world.add_flags[0] = CONTACT_FLAG_SLIDING;
  world_run(&world, 20);
  assert_within(0.1, 1.5 * before_mN, world.force_mN);
  world_run(&world, 50);
  assert_within(0.1, 3.0 * before_mN, world.force_mN);
}

static void does_not_loosen_what_is_told_to_slide(void) {
  grasp();
  pull(3000, 300);
  world_run(&world, 100);
  world.load_mN = 500;
  world_run(&world, 5);
  told_to_slide_at(10000, 10000, 5);
  double before_mN = world.force_mN;
  told_to_slide_at(10000, 10000, 40);
  TEST_ASSERT_EQUAL(0, world.report.slides);
  assert_within(0.02, before_mN, world.force_mN);
}

static void holds_more_once_it_has_slid(void) {
  grasp();
  pull(1000, 300);
  world_run(&world, 300);
  slide((int32_t)(1e3 * world.load_mN / world.force_mN), 30);
  world.load_mN = 1000;
  world_run(&world, 6000);
  double needed_mN = 1000.0 * settings.margin_permille / world.report.friction_permille;
  assert_within(0.06, 1e-3 * settings.slid_permille * needed_mN, world.force_mN);
}

/* Half as much again as what tells its load; and a location off the middle is none. */
static void a_load_that_can_only_be_guessed_is_gripped_harder(void) {
  world.drop_flags[0] = world.drop_flags[1] = CONTACT_FLAG_TANGENTIAL_VALID;
  world.place_um = 5000;
  world.take_turns = true;
  grasp();
  world_run(&world, 1000);
  assert_within(0.05, 1.5 * settings.first_mN, world.force_mN);
  TEST_ASSERT_EQUAL(0, world.report.slides);
  TEST_ASSERT_LESS_OR_EQUAL(20, world.report.load_mN);
}

static void learns_friction_from_a_slide(void) {
  grasp();
  pull(1000, 300);
  world_run(&world, 300);
  world.load_mN = (int32_t)(0.25 * world.force_mN);
  world_run(&world, 180);
  int32_t share = (int32_t)(1000 * world.load_mN / world.force_mN);
  world.add_flags[0] = CONTACT_FLAG_SLIDING;
  world_run(&world, 5);
  TEST_ASSERT_INT_WITHIN(40, share, world.report.friction_permille);
}

static void loosens_slowly(void) {
  grasp();
  pull(2000, 300);
  world_run(&world, 300);
  double before_mN = world.force_mN;
  pull(1000, 10);
  double needed = 1000.0 * settings.margin_permille / settings.friction_permille;
  world_run(&world, 300);
  double share = exp(-0.3e-3 * settings.decay_permille_s);
  assert_within(0.08, needed + (before_mN - needed) * share, world.force_mN);
  world_run(&world, 5000);
  assert_within(0.06, needed, world.force_mN);
}

static void grips_for_the_blind_without_a_load_told(void) {
  world.drop_flags[0] = world.drop_flags[1] = CONTACT_FLAG_TANGENTIAL_VALID;
  world.add_flags[0] = world.add_flags[1] = CONTACT_FLAG_FLAT;
  grasp(); /* squeezed to it: nothing pulls before */
  assert_within(0.05, settings.blind_mN, world.force_mN);
  world_run(&world, 1000);
  assert_within(0.05, settings.blind_mN, world.force_mN);
  TEST_ASSERT_BITS_HIGH(GRIP_NO_LOAD, world.report.trouble);
}

/* A plate's Gaussian holds 2.75 times what the pad takes, and its location stays under a load. */
static void a_plate_is_gripped_for_the_blind_with_the_force_on_the_pad(void) {
  world.drop_flags[0] = world.drop_flags[1] = CONTACT_FLAG_TANGENTIAL_VALID;
  world.sigma_um = 21400;
  world.gain[0] = world.gain[1] = 2.75;
  grasp();
  assert_within(0.05, settings.blind_mN, world.force_mN);
  assert_within(0.05, settings.blind_mN, world.report.force_mN);
  world_run(&world, 20);
  TEST_ASSERT_BITS_HIGH(GRIP_NO_LOAD, world.report.trouble);
}

static void one_fingertip_that_tells_a_load_is_enough(void) {
  world.drop_flags[0] = CONTACT_FLAG_TANGENTIAL_VALID;
  world.add_flags[0] = CONTACT_FLAG_FLAT;
  grasp();
  assert_within(0.05, settings.first_mN, world.force_mN);
}

static void never_loosens_while_no_load_is_told(void) {
  grasp();
  pull(1000, 300);
  world_run(&world, 300);
  double before_mN = world.force_mN;
  world.drop_flags[0] = world.drop_flags[1] = CONTACT_FLAG_TANGENTIAL_VALID;
  world.add_flags[0] = world.add_flags[1] = CONTACT_FLAG_FLAT;
  world_run(&world, 5000);
  assert_within(0.02, before_mN, world.force_mN);
}

static void a_guessed_load_keeps_more_than_it_needs(void) {
  grasp();
  pull(1000, 300);
  slide(300, 250);
  world.load_mN = 1000;
  world_run(&world, 20);
  world.drop_flags[0] = world.drop_flags[1] = CONTACT_FLAG_TANGENTIAL_VALID;
  world_run(&world, 8000);
  double needed_mN = 1e-3 * settings.slid_permille * 1000.0 * settings.margin_permille /
                     world.report.friction_permille;
  assert_within(0.05, 1.3 * needed_mN, world.force_mN);
}

/* Rubber that has given way stays so as the force grows, and is no more load for that. */
static void a_guess_does_not_feed_itself(void) {
  world.drop_flags[0] = world.drop_flags[1] = CONTACT_FLAG_TANGENTIAL_VALID;
  grasp();
  pull(1000, 300);
  world_run(&world, 300);
  assert_within(0.05, 1000, world.report.load_mN);
  double needed_mN = 1300.0 * settings.margin_permille / settings.friction_permille;
  assert_within(0.06, needed_mN, world.force_mN);
  pull(3000, 300);
  world_run(&world, 300);
  assert_within(0.05, 3000, world.report.load_mN);
  pull(1000, 300);
  world_run(&world, 2000);
  assert_within(0.08, 1000, world.report.load_mN);
}

/* Its zero is what was guessed. */
static void a_load_that_is_told_late_goes_on_from_the_guess(void) {
  world.drop_flags[0] = world.drop_flags[1] = CONTACT_FLAG_TANGENTIAL_VALID;
  grasp();
  pull(1500, 300);
  world_run(&world, 300);
  int32_t guessed_mN = world.report.load_mN;
  world.drop_flags[0] = world.drop_flags[1] = 0;
  world.load_mN += 700; /* what was told before the grasp, had it been told */
  world_run(&world, 10);
  assert_within(0.03, guessed_mN, world.report.load_mN);
  pull(2700, 300);
  assert_within(0.05, guessed_mN + 500, world.report.load_mN);
}

static void never_exceeds_the_cap(void) {
  settings.force_cap_mN = 6000;
  settings.set_mN = settings.blind_mN = 5000;
  world_set(&world, &settings);
  grasp();
  pull(9000, 200);
  world_run(&world, 2000);
  assert_within(0.05, 6000, world.force_mN);
  TEST_ASSERT_BITS_HIGH(GRIP_AT_CAP, world.report.trouble);
  world.add_flags[0] = CONTACT_FLAG_SLIDING;
  world_run(&world, 1000);
  TEST_ASSERT_LESS_OR_EQUAL(6100, world.force_mN);
}

static void the_larger_force_counts_at_the_cap(void) {
  settings.force_cap_mN = 6000;
  settings.set_mN = settings.blind_mN = 5000;
  world_set(&world, &settings);
  world.gain[1] = 1.5;
  grasp();
  TEST_ASSERT_BITS_HIGH(GRIP_FINGERS_DIFFER, world.report.trouble);
  pull(9000, 200);
  world_run(&world, 2000);
  TEST_ASSERT_LESS_OR_EQUAL(6100, 1.5 * world.force_mN);
}

static void never_travels_beyond_its_cap(void) {
  settings.travel_cap_um = 2000;
  world_set(&world, &settings);
  grasp();
  pull(9000, 200);
  world_run(&world, 1000);
  TEST_ASSERT_BITS_HIGH(GRIP_AT_TRAVEL_CAP, world.report.trouble);
  TEST_ASSERT_GREATER_OR_EQUAL(world.grip.touch_width_um - 2000, (int32_t)world.least_sent_um);
}

static void never_tightens_a_saturated_fingertip(void) {
  grasp();
  world.add_flags[0] = CONTACT_FLAG_SATURATED;
  double before_um = world.sent_um;
  pull(4000, 100);
  world_run(&world, 500);
  TEST_ASSERT_EQUAL((int32_t)before_um, (int32_t)world.sent_um);
  TEST_ASSERT_BITS_HIGH(GRIP_FINGER_0_OVER, world.report.trouble);
}

static void goes_on_with_one_fingertip(void) {
  grasp();
  world.is_mute[0] = true;
  world_run(&world, 100);
  TEST_ASSERT_BITS(GRIP_FINGER_0_STALE | GRIP_FINGER_1_STALE, GRIP_FINGER_0_STALE,
                   world.report.trouble);
  pull(1000, 200);
  world_run(&world, 800);
  assert_within(0.06, 1000.0 * settings.margin_permille / settings.friction_permille,
                world.force_mN);
}

static void stays_without_fingertips(void) {
  grasp();
  pull(1000, 200);
  world_run(&world, 800);
  double before_um = world.sent_um;
  world.is_mute[0] = world.is_mute[1] = true;
  world.load_mN = 3000;
  world_run(&world, 3000);
  TEST_ASSERT_EQUAL(GRIP_HOLDING, world.report.state);
  TEST_ASSERT_BITS_HIGH(GRIP_FINGER_0_STALE | GRIP_FINGER_1_STALE, world.report.trouble);
  TEST_ASSERT_EQUAL((int32_t)before_um, (int32_t)world.sent_um);
  world.is_mute[0] = world.is_mute[1] = false;
  world_run(&world, 500);
  TEST_ASSERT_EQUAL(0, world.report.trouble);
  TEST_ASSERT_LESS_THAN(before_um, world.sent_um);
}

/* No call of the controller, and no input, for so long. */
static void pass_us(uint64_t us) {
  world.t_us += us;
  world.frames = (uint32_t)(world.t_us / world.frame_us);
}

static void pauses_are_not_made_up_for(void) {
  static const uint64_t pauses_us[] = {3000000, 2500000000, 5000000000};
  for (size_t i = 0; i < sizeof pauses_us / sizeof pauses_us[0]; i++) {
    setUp();
    grip_request(&world.grip, GRIP_REQUEST_GRASP);
    world_run_to(&world, GRIP_APPROACH, 1000);
    world_run(&world, 500);
    double before_um = world.sent_um;
    pass_us(pauses_us[i]);
    world_run(&world, 100);
    TEST_ASSERT_EQUAL(GRIP_APPROACH, world.report.state);
    TEST_ASSERT_DOUBLE_WITHIN(20.0, 1600.0, before_um - world.sent_um);
    world_run_to(&world, GRIP_SQUEEZE, 3000);
    pass_us(pauses_us[i]);
    world_run(&world, 1);
    TEST_ASSERT_GREATER_OR_EQUAL(settings.touch_mN, world.report.wanted_mN);
    world_run_to(&world, GRIP_HOLDING, 3000);
    assert_within(0.15, settings.first_mN, world.force_mN);
  }
}

static void does_not_believe_a_frozen_fingertip(void) {
  grasp();
  world.is_frozen[0] = world.is_frozen[1] = true;
  world_run(&world, 200);
  TEST_ASSERT_BITS_HIGH(GRIP_FINGER_0_FROZEN | GRIP_FINGER_1_FROZEN, world.report.trouble);
}

static void keeps_still_while_the_gripper_is_silent(void) {
  grasp();
  world.gripper_is_mute = true;
  world_run(&world, settings.silent_us / 1000 + 50);
  TEST_ASSERT_BITS_HIGH(GRIP_GRIPPER_SILENT, world.report.trouble);
  TEST_ASSERT_EQUAL(GRIP_STAY, world.command.motion);
  world.gripper_is_mute = false;
  pull(1000, 200);
  world_run(&world, 800);
  TEST_ASSERT_EQUAL(GRIP_HOLDING, world.report.state);
  assert_within(0.06, 1000.0 * settings.margin_permille / settings.friction_permille,
                world.force_mN);
}

static void a_gripper_fault_ends_it(void) {
  grasp();
  double before_um = world.sent_um;
  world.fault = 9;
  world_run(&world, 10);
  TEST_ASSERT_EQUAL(GRIP_FAULT, world.report.state);
  TEST_ASSERT_EQUAL(9, world.report.gripper_fault);
  TEST_ASSERT_FALSE(grip_request(&world.grip, GRIP_REQUEST_GRASP));
  TEST_ASSERT_FALSE(grip_request(&world.grip, GRIP_REQUEST_RELEASE));
  world.fault = 0;
  world_run(&world, 3000);
  TEST_ASSERT_EQUAL(GRIP_FAULT, world.report.state);
  TEST_ASSERT_BITS_HIGH(GRIP_GRIPPER_FAULT, world.report.trouble);
  TEST_ASSERT_EQUAL_MESSAGE(9, world.report.gripper_fault, "what led there is not told any more");
  TEST_ASSERT_EQUAL((int32_t)before_um, (int32_t)world.sent_um);
  TEST_ASSERT_FALSE(world.is_activated);
}

static void a_gripper_that_lost_its_activation_is_not_activated(void) {
  grasp();
  world.is_active = false;
  world_run(&world, 100);
  TEST_ASSERT_EQUAL(GRIP_FAULT, world.report.state);
  TEST_ASSERT_BITS_HIGH(GRIP_GRIPPER_INACTIVE, world.report.trouble);
  TEST_ASSERT_FALSE(world.is_activated);
}

static void activates_only_what_holds_nothing(void) {
  world.is_active = false;
  grip_request(&world.grip, GRIP_REQUEST_GRASP);
  world_run(&world, 10);
  TEST_ASSERT_TRUE(world.is_activated);
  world_begin(&world);
  world.is_active = false;
  world.object_um = 62000.0;
  grip_request(&world.grip, GRIP_REQUEST_GRASP);
  world_run(&world, 100);
  TEST_ASSERT_FALSE(world.is_activated);
  TEST_ASSERT_BITS_HIGH(GRIP_GRIPPER_INACTIVE, world.report.trouble);
}

static void says_that_the_object_is_gone(void) {
  grasp();
  double before_um = world.sent_um;
  world.object_um = 0.0;
  world_run(&world, 40);
  TEST_ASSERT_EQUAL(GRIP_HOLDING, world.report.state);
  world_run(&world, 100);
  TEST_ASSERT_EQUAL(GRIP_DROPPED, world.report.state);
  TEST_ASSERT_EQUAL(GRIP_STAY, world.command.motion);
  TEST_ASSERT_GREATER_OR_EQUAL(before_um - 1500.0, world.sent_um);
}

static void holds_and_opens_when_asked(void) {
  grasp();
  pull(1000, 100);
  TEST_ASSERT_TRUE(grip_request(&world.grip, GRIP_REQUEST_HOLD));
  double before_um = world.width_um;
  world_run(&world, 1000);
  TEST_ASSERT_EQUAL(GRIP_STAY, world.command.motion);
  TEST_ASSERT_EQUAL(GRIP_STILL, world.report.state);
  TEST_ASSERT_TRUE(grip_request(&world.grip, GRIP_REQUEST_RELEASE));
  world_run(&world, 1000);
  TEST_ASSERT_DOUBLE_WITHIN(600.0, before_um + settings.release_um_s, world.width_um);
  world_run_to(&world, GRIP_OPEN, 9000);
}

/* Eq. (5) and (6), by hand: the second step after 20 ms with kp 100, ki 1000, kd 1. */
static void fixed_is_a_pid_of_the_mean_force(void) {
  settings.mode = GRIP_MODE_FIXED;
  settings.gains = (struct grip_gains){100, 1000, 1};
  settings.control_us = 20000;
  settings.set_mN = 5000;
  world.traits.step_um = 1;
  world_set(&world, &settings);
  struct grip *grip = &world.grip;
  grip->state = GRIP_HOLDING;
  grip->touch_width_um = grip->target_um = 40000;
  struct grip_status status = {.t_us = 1000, .width_um = 40000, .is_active = true};
  grip_take_status(grip, &status);
  struct grip_touch touch = {
      .t_us = 1000, .flags = CONTACT_FLAG_CONTACT | CONTACT_FLAG_FIT_VALID, .force_mN = 3000};
  grip_take_touch(grip, 0, &touch);
  touch.force_mN = 4000;
  grip_take_touch(grip, 1, &touch);
  grip_step(grip, 1000, &world.command, &world.report); /* e = 1.5 N */
  TEST_ASSERT_EQUAL(40000 - 150, world.command.width_um);
  touch.t_us = 20900;
  touch.force_mN = 4500;
  grip_take_touch(grip, 0, &touch);
  grip_take_touch(grip, 1, &touch);
  grip_step(grip, 20900, &world.command, &world.report); /* too soon */
  TEST_ASSERT_EQUAL(40000 - 150, world.command.width_um);
  grip_step(grip, 21000, &world.command, &world.report);
  /* e = 0.5 N: 50 um; its integral 0.01 Ns: 10 um; its derivative -50 N/s: -50 um */
  TEST_ASSERT_EQUAL(40000 - (50 + 10 - 50), world.command.width_um);
}

static void fixed_holds_its_force(void) {
  settings.mode = GRIP_MODE_FIXED;
  world_set(&world, &settings);
  grasp();
  world_run(&world, 1000);
  assert_within(0.02, settings.set_mN, world.force_mN);
  world.stiffness *= 0.8; /* relaxed */
  world_run(&world, 1500);
  assert_within(0.02, settings.set_mN, world.force_mN);
}

static void fixed_does_not_hunt_on_coarse_steps(void) {
  settings.mode = GRIP_MODE_FIXED;
  world.traits.step_um = 374;
  world_set(&world, &settings);
  grasp();
  world_run(&world, 3000);
  double before_um = world.sent_um;
  for (int i = 0; i < 60; i++) {
    world_run(&world, 1000);
    TEST_ASSERT_EQUAL((int32_t)before_um, (int32_t)world.sent_um);
  }
}

/* Nor where the force is noisy, on rubber that has settled: opening makes more than closing. */
static void fixed_does_not_hunt_on_noise(void) {
  static const int32_t steps_um[] = {374, 153};
  for (size_t i = 0; i < sizeof steps_um / sizeof *steps_um; i++) {
    struct random random = {20221015};
    setUp();
    settings.mode = GRIP_MODE_FIXED;
    world.traits.step_um = steps_um[i];
    world.traits.deadband_um = steps_um[i] + 20;
    world.traits.latency_us = 25000;
    world_set(&world, &settings);
    grasp();
    int turns = 0, way = 0;
    double before_um = world.sent_um;
    for (int ms = 0; ms < 20000; ms++) {
      world.gain[0] = 0.97 + 1e-5 * random_below(&random, 6000);
      world_run(&world, 1);
      int moved = (world.sent_um > before_um) - (world.sent_um < before_um);
      turns += moved != 0 && moved == -way;
      way = moved != 0 ? moved : way;
      before_um = world.sent_um;
    }
    TEST_ASSERT_LESS_OR_EQUAL(1, turns);
  }
}

static void hold_moves_by_what_a_gripper_moves(void) {
  world.traits.step_um = 374;
  world.traits.deadband_um = 400;
  world.traits.latency_us = 25000;
  world_set(&world, &settings);
  grasp();
  pull(1500, 300);
  world_run(&world, 500);
  double needed = 1500.0 * settings.margin_permille / settings.friction_permille;
  TEST_ASSERT_GREATER_THAN(0.95 * needed, world.force_mN);
  TEST_ASSERT_LESS_THAN(needed + 4000.0, world.force_mN);
}

/* What it loosened too far it would have to take back. */
static void a_coarse_gripper_only_opens_while_the_load_falls(void) {
  world.traits.step_um = 374;
  world.traits.deadband_um = 400;
  world.traits.latency_us = 25000;
  world_set(&world, &settings);
  grasp();
  pull(3500, 600);
  world_run(&world, 1000);
  double before_mN = world.force_mN;
  for (world.load_mN = 3500; world.load_mN >= 1000; world.load_mN -= 25) {
    double width_um = world.width_um;
    world_run(&world, 300);
    TEST_ASSERT_GREATER_OR_EQUAL((int32_t)width_um - 10, (int32_t)world.width_um);
    double needed_mN =
        (double)world.load_mN * settings.margin_permille / settings.friction_permille;
    TEST_ASSERT_GREATER_THAN(needed_mN, world.force_mN);
  }
  TEST_ASSERT_LESS_THAN(0.5 * before_mN, world.force_mN);
}

static void refuses_what_is_out_of_range(void) {
  struct grip_settings bad = settings;
  bad.force_cap_mN = 0;
  TEST_ASSERT_EQUAL(FT_ERR_ARGUMENT, grip_init(&world.grip, &bad, &world.traits));
  bad = settings;
  bad.approach_um_s = 8001;
  TEST_ASSERT_EQUAL(FT_ERR_ARGUMENT, grip_init(&world.grip, &bad, &world.traits));
  bad = settings;
  bad.blind_mN = bad.force_cap_mN + 1;
  TEST_ASSERT_EQUAL(FT_ERR_ARGUMENT, grip_init(&world.grip, &bad, &world.traits));
  bad = settings;
  bad.control_us = 499;
  TEST_ASSERT_EQUAL(FT_ERR_ARGUMENT, grip_init(&world.grip, &bad, &world.traits));
  bad.control_us = 500;
  bad.slid_permille = 999;
  TEST_ASSERT_EQUAL(FT_ERR_ARGUMENT, grip_init(&world.grip, &bad, &world.traits));
  bad.slid_permille = 1000;
  TEST_ASSERT_EQUAL(FT_OK, grip_init(&world.grip, &bad, &world.traits));
  struct grip_traits traits = world.traits;
  traits.step_um = 0;
  TEST_ASSERT_EQUAL(FT_ERR_ARGUMENT, grip_init(&world.grip, &settings, &traits));
}

/* Whatever comes in: no opening that was not asked for, no activation of what is held, no width
 * beyond the caps. */
static void nothing_wrong_comes_of_anything(void) {
  struct random random = {20221015};
  for (int run = 0; run < 300; run++) {
    world_begin(&world);
    grasp();
    for (int i = 0; i < 400; i++) {
      struct grip_touch touch;
      for (unsigned finger = 0; finger < GRIP_FINGERS; finger++) {
        touch = (struct grip_touch){.t_us = world.t_us + random_below(&random, 4000),
                                    .flags = random_u32(&random),
                                    .force_mN = (int32_t)random_u32(&random),
                                    .force_sd_mN = (int32_t)random_u32(&random),
                                    .qx_mN = (int32_t)random_u32(&random),
                                    .qy_mN = (int32_t)random_u32(&random)};
        grip_take_touch(&world.grip, finger, &touch);
      }
      world.t_us += 1000;
      struct grip_status status = {
          .t_us = world.t_us, .width_um = (int32_t)world.width_um, .is_active = true};
      grip_take_status(&world.grip, &status);
      grip_step(&world.grip, world.t_us, &world.command, &world.report);
      TEST_ASSERT_NOT_EQUAL(GRIP_ACTIVATE, world.command.motion);
      TEST_ASSERT_TRUE(world.report.state != GRIP_RELEASE && world.report.state != GRIP_OPEN);
      if (world.command.motion == GRIP_MOVE) {
        TEST_ASSERT_GREATER_OR_EQUAL(world.grip.touch_width_um - settings.travel_cap_um,
                                     world.command.width_um);
        TEST_ASSERT_LESS_OR_EQUAL(world.grip.touch_width_um, world.command.width_um);
      }
      TEST_ASSERT_LESS_OR_EQUAL(settings.force_cap_mN, world.report.wanted_mN);
    }
  }
}

int main(void) {
  UNITY_BEGIN();
  RUN_TEST(grasps_with_the_first_force);
  RUN_TEST(approaches_at_its_speed);
  RUN_TEST(approach_ends_where_nothing_is);
  RUN_TEST(follows_the_load);
  RUN_TEST(counts_what_pulls_before_as_none);
  RUN_TEST(takes_the_larger_of_loads_that_differ);
  RUN_TEST(raises_the_grip_where_the_object_slides);
  RUN_TEST(a_squeeze_does_not_feed_itself);
  RUN_TEST(a_late_gripper_is_asked_for_no_more_than_twice_what_is_felt);
  RUN_TEST(what_held_more_a_moment_ago_does_not_slide);
  RUN_TEST(what_settles_is_held_a_little_harder_and_teaches_nothing);
  RUN_TEST(what_runs_slides_whatever_its_load_over_force);
  RUN_TEST(what_slides_without_a_load_is_caught_by_doubling);
  RUN_TEST(does_not_loosen_what_is_told_to_slide);
  RUN_TEST(holds_more_once_it_has_slid);
  RUN_TEST(a_load_that_can_only_be_guessed_is_gripped_harder);
  RUN_TEST(learns_friction_from_a_slide);
  RUN_TEST(loosens_slowly);
  RUN_TEST(grips_for_the_blind_without_a_load_told);
  RUN_TEST(a_plate_is_gripped_for_the_blind_with_the_force_on_the_pad);
  RUN_TEST(one_fingertip_that_tells_a_load_is_enough);
  RUN_TEST(never_loosens_while_no_load_is_told);
  RUN_TEST(a_guessed_load_keeps_more_than_it_needs);
  RUN_TEST(a_guess_does_not_feed_itself);
  RUN_TEST(a_load_that_is_told_late_goes_on_from_the_guess);
  RUN_TEST(never_exceeds_the_cap);
  RUN_TEST(the_larger_force_counts_at_the_cap);
  RUN_TEST(never_travels_beyond_its_cap);
  RUN_TEST(never_tightens_a_saturated_fingertip);
  RUN_TEST(goes_on_with_one_fingertip);
  RUN_TEST(stays_without_fingertips);
  RUN_TEST(pauses_are_not_made_up_for);
  RUN_TEST(does_not_believe_a_frozen_fingertip);
  RUN_TEST(keeps_still_while_the_gripper_is_silent);
  RUN_TEST(a_gripper_fault_ends_it);
  RUN_TEST(a_gripper_that_lost_its_activation_is_not_activated);
  RUN_TEST(activates_only_what_holds_nothing);
  RUN_TEST(says_that_the_object_is_gone);
  RUN_TEST(holds_and_opens_when_asked);
  RUN_TEST(fixed_is_a_pid_of_the_mean_force);
  RUN_TEST(fixed_holds_its_force);
  RUN_TEST(fixed_does_not_hunt_on_coarse_steps);
  RUN_TEST(fixed_does_not_hunt_on_noise);
  RUN_TEST(hold_moves_by_what_a_gripper_moves);
  RUN_TEST(a_coarse_gripper_only_opens_while_the_load_falls);
  RUN_TEST(refuses_what_is_out_of_range);
  RUN_TEST(nothing_wrong_comes_of_anything);
  return UNITY_END();
}
