#include "common/contact_flags.h"
#include "contact/motion.h"
#include "support/random.h"
#include "support/unit.h"

#include <string.h>

#define SAYS (CONTACT_FLAG_VELOCITY_VALID | CONTACT_FLAG_MOVING | CONTACT_FLAG_SLIDING)

static struct tangential_settings settings;
static struct motion_history history;
static struct fit_tangential found;
static struct fit_result fit;
static struct contact_input input;
static struct motion motion;
static uint32_t interval_us;

void setUp(void) {
  settings = (struct tangential_settings){.force_scale = 1.0f, .tangential_scale = 1.0f};
  memset(&history, 0, sizeof history);
  found = (struct fit_tangential){
      .valid = true, .x_mm = 2.5f, .y_mm = -7.0f, .location_sd_mm = 0.1f, .location_noise_mm = 0.01f, .force_N = 4.0f};
  fit = (struct fit_result){.used = 0x7FFF};
  input = (struct contact_input){.t_us = 5000000, .contact = true, .fit = &fit, .tangential = &found};
  interval_us = 2439;
}

/* Of a frame, an interval after the one before. */
static uint32_t update(void) {
  struct contact_result result = {.flags = CONTACT_FLAG_CONTACT, .slip_mm = 0.25f};
  memset(&motion, 0xA5, sizeof motion);
  motion_update(&history, &settings, &input, &result, &motion);
  TEST_ASSERT_EQUAL_FLOAT(0.25f, result.slip_mm);
  TEST_ASSERT_EQUAL_HEX32(CONTACT_FLAG_CONTACT, result.flags & ~(uint32_t)SAYS);
  if (!(result.flags & CONTACT_FLAG_VELOCITY_VALID)) {
    TEST_ASSERT_EQUAL_FLOAT(0.0f, motion.vx_mm_s);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, motion.vy_mm_s);
  }
  input.t_us += interval_us;
  return result.flags & SAYS;
}

/* All that is said meanwhile. */
static uint32_t go(float seconds, float vx_mm_s, float vy_mm_s, float load_per_s) {
  uint32_t said = 0;
  const int frames = (int)(1e6f * seconds / (float)interval_us);
  const float step_s = 1e-6f * (float)interval_us;
  for (int i = 0; i < frames; i++) {
    found.x_mm += vx_mm_s * step_s;
    found.y_mm += vy_mm_s * step_s;
    found.qx_N += load_per_s * found.force_N * step_s;
    said |= update();
  }
  return said;
}

static void rest(float seconds) { TEST_ASSERT_EQUAL_HEX32(CONTACT_FLAG_VELOCITY_VALID, go(seconds, 0, 0, 0)); }

TEST(a_steady_velocity_is_told_at_any_rate) {
  static const uint32_t intervals_us[] = {50000, 10000, 5000, 2439, 765, 700};
  for (unsigned i = 0; i < sizeof intervals_us / sizeof intervals_us[0]; i++) {
    setUp();
    interval_us = intervals_us[i];
    TEST_ASSERT_EQUAL_HEX32(SAYS, go(0.4f, 12.0f, -9.0f, 0));
    /* Half a micrometre of each of the places, 64 us of each of the times. */
    TEST_ASSERT_FLOAT_WITHIN(0.06f, 12.0f, motion.vx_mm_s);
    TEST_ASSERT_FLOAT_WITHIN(0.06f, -9.0f, motion.vy_mm_s);
  }
}

TEST(the_velocity_is_as_uncertain_as_least_squares_are) {
  struct random random = {1};
  double squares = 0;
  const int runs = 4000, frames = 13; /* 30 ms */
  for (int k = 0; k < runs; k++) {
    setUp();
    for (int i = 0; i < frames + 1; i++) { /* one of them is older than that */
      found.x_mm = 2.5f + 0.01f * (float)random_normal(&random);
      update();
    }
    squares += (double)motion.vx_mm_s * (double)motion.vx_mm_s;
  }
  double step_s = 1e-6 * interval_us;
  double expected_mm_s = 0.01 / (step_s * sqrt((double)(frames * (frames * frames - 1)) / 12.0));
  TEST_ASSERT_DOUBLE_WITHIN(0.05 * expected_mm_s, expected_mm_s, sqrt(squares / runs));
}

/* As the estimate's noise is: what the location says ahead, the load says back, by 4 mm per Q / F. */
TEST(noise_alone_never_speaks) {
  static const float noises_mm[] = {0.005f, 0.02f, 0.1f, 0.35f};
  struct random random = {7};
  for (unsigned k = 0; k < sizeof noises_mm / sizeof noises_mm[0]; k++) {
    setUp();
    found.location_noise_mm = noises_mm[k];
    for (int i = 0; i < 100000; i++) {
      const float x_mm = 0.7071f * noises_mm[k] * (float)random_normal(&random);
      const float y_mm = 0.7071f * noises_mm[k] * (float)random_normal(&random);
      found.x_mm = 2.5f + x_mm;
      found.y_mm = -7.0f + y_mm;
      found.qx_N = -0.25f * x_mm * found.force_N;
      found.qy_N = -0.25f * y_mm * found.force_N;
      TEST_ASSERT_EQUAL_HEX32(0, update() & ~(uint32_t)CONTACT_FLAG_VELOCITY_VALID);
    }
  }
}

/* 5 mm of creep go with each unit of Q / F. */
TEST(a_slide_is_what_the_load_does_not_explain) {
  static const struct {
    float qx_N, scale;
    struct {
      float seconds, vx_mm_s, load_per_s;
      uint32_t slides;
    } phases[3];
  } cases[] = {
      {0, 1.0f, {{0.1f, 20.0f, 4.0f, 0}, {0.5f, 0, 0, 0}, {0.1f, -20.0f, -4.0f, 0}}}, /* creeping, and back */
      {0, 0.4f, {{0.1f, 20.0f, 4.0f, 1}}},                                            /* the load is less than it seems */
      {2.0f, 1.0f, {{0.007f, 20.0f, 0, 0}, {0.02f, 20.0f, 0, 1}}},                    /* moving on under a steady load */
      {2.0f, 1.0f, {{0.013f, 10.0f, -4.0f, 1}}},                                      /* sooner as friction falls */
      {0, 1.0f, {{0.06f, 40.0f, 8.0f, 0}, {0.02f, 20.0f, 0, 1}}},                     /* after a lift */
      {2.0f, 1.0f, {{0.08f, 2.0f, 0, 0}, {0.2f, 2.0f, 0, 1}}},                        /* slowly */
  };
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    setUp();
    found.qx_N = cases[i].qx_N;
    settings.tangential_scale = cases[i].scale;
    rest(0.4f);
    for (size_t k = 0; k < 3; k++) {
      const uint32_t said = go(cases[i].phases[k].seconds, cases[i].phases[k].vx_mm_s, 0, cases[i].phases[k].load_per_s);
      TEST_ASSERT_EQUAL(cases[i].phases[k].slides, (said & CONTACT_FLAG_SLIDING) != 0);
      TEST_ASSERT_TRUE(i + k > 0 || said == (CONTACT_FLAG_VELOCITY_VALID | CONTACT_FLAG_MOVING));
    }
  }
}

TEST(a_slide_ends_soon_and_once) {
  rest(0.4f);
  go(0.1f, 100.0f, 0, 0);
  TEST_ASSERT_EQUAL_HEX32(SAYS, go(0.07f, 0, 0, 0));
  for (int i = 0; i < 200; i++) {
    TEST_ASSERT_EQUAL_HEX32(CONTACT_FLAG_VELOCITY_VALID, update());
  }
}

TEST(what_rings_after_a_slide_is_none) {
  rest(0.4f);
  go(0.1f, 50.0f, 0, 0);
  go(0.06f, 0, 0, 0);
  /* 0.6 mm to and fro, 5 mm for each unit of Q / F. */
  for (int i = 0; i < 4; i++) {
    TEST_ASSERT_EQUAL_HEX32(0, go(0.08f, 8.0f, 0, 1.6f) & CONTACT_FLAG_SLIDING);
    TEST_ASSERT_EQUAL_HEX32(0, go(0.08f, -8.0f, 0, -1.6f) & CONTACT_FLAG_SLIDING);
  }
}

/* At five times what least squares over three frames leave of 0.4 mm, a speed needs 140 mm/s. */
TEST(a_fast_slide_is_seen_through_much_noise) {
  interval_us = 10100;
  found.location_noise_mm = 0.001f * MOTION_NOISE_MAX_um;
  TEST_ASSERT_BITS_HIGH(CONTACT_FLAG_MOVING, go(0.1f, 200.0f, 0, 0));
  setUp();
  interval_us = 10100;
  found.location_noise_mm = 0.001f * MOTION_NOISE_MAX_um;
  TEST_ASSERT_BITS_LOW(CONTACT_FLAG_MOVING, go(0.1f, 120.0f, 0, 0));
}

TEST(hours_leave_no_trace) {
  interval_us = 1000;
  go(0.5f, 0.02f, 0, 0);
  const struct motion early = motion;
  /* As after 40 days of frames: the totals have gone round. */
  input.t_us += UINT64_C(3456000000000) - 64 * 7;
  found.x_mm = 30.0f;
  found.y_mm = -30.0f;
  motion_reset(&history);
  for (int i = 0; i < 3000000; i++) {
    update();
  }
  TEST_ASSERT_EQUAL_FLOAT(0.0f, motion.vx_mm_s);
  TEST_ASSERT_EQUAL_FLOAT(0.0f, motion.vy_mm_s);
  go(0.5f, 0.02f, 0, 0);
  TEST_ASSERT_FLOAT_WITHIN(0.003f, early.vx_mm_s, motion.vx_mm_s);
}

TEST(what_interrupts_a_contact_starts_anew) {
  for (int what = 0; what < 6; what++) {
    setUp();
    rest(0.4f);
    switch (what) {
    case 0:
      input.contact = false;
      input.fit = NULL;
      TEST_ASSERT_EQUAL_HEX32(0, update());
      input.contact = true;
      input.fit = &fit;
      break;
    case 1:
      input.zero_doubtful = true;
      TEST_ASSERT_EQUAL_HEX32(0, update());
      input.zero_doubtful = false;
      break;
    case 2: input.t_us += MOTION_PAUSE_us; break;
    case 3: /* time goes back */ input.t_us -= 10 * interval_us; break;
    case 4: /* or stands */ input.t_us -= interval_us; break;
    default: fit.used = 0x7FFE;
    }
    found.x_mm += 3.0f; /* elsewhere */
    TEST_ASSERT_EQUAL_HEX32(0, update());
    TEST_ASSERT_EQUAL_HEX32(CONTACT_FLAG_VELOCITY_VALID, go(0.4f, 0, 0, 0));
  }
}

TEST(frames_without_an_estimate_say_nothing_and_are_passed_over) {
  rest(0.4f);
  for (int i = 0; i < 5; i++) {
    found.valid = false;
    TEST_ASSERT_EQUAL_HEX32(0, update());
    found.valid = true;
    found.force_N = 0.0f;
    TEST_ASSERT_EQUAL_HEX32(0, update());
    found.force_N = 4.0f;
    found.location_noise_mm = 0.00101f * MOTION_NOISE_MAX_um + 0.002f;
    TEST_ASSERT_EQUAL_HEX32(0, update());
    found.location_noise_mm = 0.01f;
    input.tangential = NULL;
    TEST_ASSERT_EQUAL_HEX32(0, update());
    input.tangential = &found;
    TEST_ASSERT_EQUAL_HEX32(CONTACT_FLAG_VELOCITY_VALID, update());
  }
}
