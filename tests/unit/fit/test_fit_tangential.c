/* The tangential estimate against readings that its own model makes, at the edges of what it takes,
 * and on any bits. tests/accuracy holds it to an estimator of its own in double precision. */
#include "common/contact_flags.h"
#include "fit/fit_tangential.h"
#include "support/pad.h"
#include "support/random.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>
#include <unity.h>

enum { SENSORS = 15, ALL = (1 << SENSORS) - 1 };
#define PITCH_mm 9.0f
#define RANDOM_INPUTS 1000000
#define SEED UINT64_C(0x7461676E)
#define SDS 1

static struct fit_array array;
static struct fit_pad pad;
static struct pad_profile profile;
static struct fit_settings settings;
static double dip_share; /* of the rubber */
static struct fit_own own[15];
#define DIP_SD_mm 15.0

struct contact {
  double x_mm, y_mm, force_N, qx_N, qy_N, spread_mm2;
};

static struct pad_profile profile_of(double thickness_mm) {
  struct pad_profile scaled = pad_of_12_mm();
  float by = (float)(thickness_mm / 12.0);
  scaled.thickness_mm *= by;
  for (int j = 0; j < PAD_NORMAL_TERMS; j++) {
    scaled.normal[j].sd_mm *= by;
  }
  for (int j = 0; j < PAD_TANGENTIAL_TERMS; j++) {
    scaled.tangential[j].sd_mm *= by;
    scaled.tangential[j].moment_mm *= by;
  }
  return scaled;
}

static void use_pad(double thickness_mm) {
  profile = profile_of(thickness_mm);
  TEST_ASSERT_EQUAL(FT_OK, fit_pad_init(&pad, &array, &profile));
}

void setUp(void) {
  float x_mm[SENSORS], y_mm[SENSORS];
  for (int k = 0; k < SENSORS; k++) {
    x_mm[k] = PITCH_mm * (float)(k / 5 - 1);
    y_mm[k] = PITCH_mm * (float)(k % 5 - 2);
  }
  TEST_ASSERT_EQUAL(FT_OK, fit_array_init(&array, SENSORS, x_mm, y_mm, PITCH_mm));
  use_pad(12.0);
  memset(&settings, 0, sizeof settings);
  settings.iterations = 4;
  settings.noise_Pa_q10 = 2048;
  fit_set_errors(&settings, 0.005f, 0.0065f);
  dip_share = 0.0;
  memset(own, 0, sizeof own);
}

void tearDown(void) {}

/* As pad_profile.h has it. */
static double pressure_Pa(const struct contact *contact, double x_mm, double y_mm) {
  double dx = x_mm - contact->x_mm, dy = y_mm - contact->y_mm, sum = 0.0;
  for (int j = 0; j < PAD_NORMAL_TERMS; j++) {
    double v = pow((double)profile.normal[j].sd_mm, 2) + contact->spread_mm2;
    sum += contact->force_N * (double)profile.normal[j].share / v * exp(-(dx * dx + dy * dy) / (2 * v));
  }
  for (int j = 0; j < PAD_TANGENTIAL_TERMS; j++) {
    double v = pow((double)profile.tangential[j].sd_mm, 2) + 1.3 * contact->spread_mm2;
    sum += (contact->qx_N * dx + contact->qy_N * dy) * (double)profile.tangential[j].moment_mm / (v * v) *
           exp(-(dx * dx + dy * dy) / (2 * v));
  }
  double middle = 0.0, r2 = dx * dx + dy * dy;
  for (int j = 0; j < PAD_NORMAL_TERMS; j++) {
    double v = pow((double)profile.normal[j].sd_mm, 2) + contact->spread_mm2;
    middle += contact->force_N * (double)profile.normal[j].share / v;
  }
  sum -= dip_share * middle * exp(-r2 / (2 * DIP_SD_mm * DIP_SD_mm));
  return 1e6 * sum / 6.283185307179586;
}

/* A sensor that feels all wider by a factor reads what is nearer by it. */
static void read_contact(const struct contact *contact, int32_t *readings) {
  for (int k = 0; k < SENSORS; k++) {
    double x_mm = (double)(array.x[k] * PITCH_mm), y_mm = (double)(array.y[k] * PITCH_mm);
    double nearer = exp(-own[k].wider_q15 / 32768.0);
    x_mm += (double)PITCH_mm * own[k].off_x_q15 / 32768.0;
    y_mm += (double)PITCH_mm * own[k].off_y_q15 / 32768.0;
    double p_Pa = pressure_Pa(contact, contact->x_mm + nearer * (x_mm - contact->x_mm),
                              contact->y_mm + nearer * (y_mm - contact->y_mm));
    readings[k] = (int32_t)lround(1024.0 * p_Pa);
  }
}

static struct fit_tangential go_on(struct fit_tangential_state *state, const int32_t *readings, uint32_t usable) {
  struct fit_result fit;
  fit_gaussian(&array, readings, usable, &settings, &fit);
  struct fit_tangential result;
  memset(&result, 0xFF, sizeof result);
  fit_tangential_estimate(&array, &pad, readings, &settings, &fit, state, &result);
  return result;
}

/* Of a contact that is held. */
static struct fit_tangential estimate(const int32_t *readings, uint32_t usable) {
  struct fit_tangential_state state = {0};
  struct fit_tangential result;
  for (int frame = 0; frame < FIT_TANGENTIAL_FRAMES; frame++) {
    result = go_on(&state, readings, usable);
  }
  return result;
}

static struct contact draw_contact(struct random *random, double ratio) {
  struct contact contact;
  contact.x_mm = random_between(random, -7, 7);
  contact.y_mm = random_between(random, -16, 16);
  contact.force_N = random_between(random, 1, 10);
  double q_N = ratio * contact.force_N, angle = random_between(random, 0, 6.283185307179586);
  contact.qx_N = q_N * cos(angle);
  contact.qy_N = q_N * sin(angle);
  contact.spread_mm2 = random_between(random, 2, 6);
  return contact;
}

static bool is_zero(const struct fit_tangential *result) {
  struct fit_tangential zero;
  memset(&zero, 0, sizeof zero);
  return memcmp(&zero, result, sizeof zero) == 0;
}

/* Of 300 contacts: the least number of valid ones, and of those the most that may be further off
 * than mm or share of the force and SDS standard deviations. */
static void judge_pad(double thickness_mm, uint32_t usable, double mm, double share, int least, int most_off) {
  use_pad(thickness_mm);
  struct random random = {SEED};
  int valid = 0, outside = 0;
  char text[200] = "";
  for (int i = 0; i < 300; i++) {
    struct contact contact = draw_contact(&random, 0.1 * (i % 4));
    int32_t readings[SENSORS];
    read_contact(&contact, readings);
    struct fit_tangential found = estimate(readings, usable);
    if (!found.valid) {
      TEST_ASSERT_TRUE(is_zero(&found));
      continue;
    }
    valid++;
    double off_mm = hypot((double)found.x_mm - contact.x_mm, (double)found.y_mm - contact.y_mm);
    double off = hypot((double)found.qx_N - contact.qx_N, (double)found.qy_N - contact.qy_N);
    double sd_mm = (double)found.location_sd_mm, sd_N = (double)found.q_sd_N;
    /* What is told loosely is drawn towards the priors. */
    if (off_mm > mm + SDS * sd_mm || off > share * contact.force_N + SDS * sd_N) {
      outside++;
      snprintf(text, sizeof text, "%g mm, press %d at %.1f %.1f: off by %.4f mm (sd %.4f), %.4f of %.3f N (sd %.4f)",
               thickness_mm, i, contact.x_mm, contact.y_mm, off_mm, sd_mm, off, contact.force_N, sd_N);
    }
  }
  TEST_ASSERT_TRUE_MESSAGE(outside <= most_off, text);
  TEST_ASSERT_GREATER_OR_EQUAL_INT(least, valid);
}

static void test_contacts_of_the_model_are_found(void) { judge_pad(12.0, ALL, 0.02, 0.002, 285, 0); }

/* On thin pads a contact is narrower than the pitch: a tenth is off by more than it says. */
static void test_pads_of_5_to_20_mm(void) {
  judge_pad(5.0, ALL, 0.1, 0.01, 180, 30);
  judge_pad(6.0, ALL, 0.1, 0.01, 240, 40);
  judge_pad(20.0, ALL, 0.02, 0.002, 290, 0);
}

static void test_sensors_missing(void) {
  judge_pad(12.0, ALL & ~(1 << 7), 0.05, 0.005, 290, 0);
  judge_pad(12.0, ALL & ~(1 << 0 | 1 << 13), 0.05, 0.005, 290, 0);
}

static void test_a_dip_that_is_known_is_in_the_model(void) {
  dip_share = 0.05;
  settings.dip_share = 0.05f;
  settings.dip_sd_mm = (float)DIP_SD_mm;
  judge_pad(12.0, ALL, 0.03, 0.003, 280, 0);
  judge_pad(12.0, ALL & ~(1 << 7), 0.05, 0.005, 280, 0);
}

static void test_what_is_the_sensors_own_is_taken_out(void) {
  struct random random = {UINT64_C(7)};
  for (int k = 0; k < SENSORS; k++) {
    own[k].off_x_q15 = (int32_t)random_between(&random, -600, 600); /* 0.16 mm */
    own[k].off_y_q15 = (int32_t)random_between(&random, -600, 600);
    own[k].wider_q15 = (int32_t)random_between(&random, -1600, 1600); /* 5 % */
  }
  settings.own = own;
  judge_pad(12.0, ALL, 0.08, 0.01, 260, 0);
  judge_pad(12.0, ALL & ~(1 << 7), 0.1, 0.015, 260, 0);
}

static const struct contact usual = {2.0, 3.0, 5.0, 0.5, -0.3, 4.0};

/* moved_q20_mm: noise that makes a load seem larger moves the place by so much. */
static void test_place_and_load_err_together_as_is_said(void) {
  enum { TIMES = 1000 };
  struct random random = {SEED};
  int32_t exact[SENSORS], readings[SENSORS];
  fit_set_errors(&settings, 0.0f, 0.0065f);
  read_contact(&usual, exact);
  struct fit_tangential at = estimate(exact, ALL);
  double by[2][2] = {{0}}, square[2] = {0}; /* sums over q_i x_j, and over q_i^2 */
  for (int n = 0; n < TIMES; n++) {
    for (int k = 0; k < SENSORS; k++) {
      readings[k] = exact[k] + (int32_t)random_between(&random, -60000, 60000);
    }
    struct fit_tangential found = estimate(readings, ALL);
    TEST_ASSERT_TRUE(found.valid);
    double q[2] = {(double)((found.qx_N - at.qx_N) / at.force_N), (double)((found.qy_N - at.qy_N) / at.force_N)};
    double moved[2] = {(double)(found.x_mm - at.x_mm), (double)(found.y_mm - at.y_mm)};
    for (int i = 0; i < 2; i++) {
      square[i] += q[i] * q[i];
      by[i][0] += q[i] * moved[0];
      by[i][1] += q[i] * moved[1];
    }
  }
  for (int i = 0; i < 2; i++) {
    double said_mm = at.moved_q20_mm[i] / 1048576.0;
    TEST_ASSERT_DOUBLE_WITHIN(0.3, by[i][i] / square[i], said_mm);
    TEST_ASSERT_TRUE(fabs(said_mm) > 2.0);
    TEST_ASSERT_DOUBLE_WITHIN(0.5, 0.0, by[i][1 - i] / square[i]);
  }
}

static void expect_none(const int32_t *readings, uint32_t usable) {
  struct fit_tangential found = estimate(readings, usable);
  TEST_ASSERT_TRUE(is_zero(&found));
}

static void test_too_few_sensors_give_nothing(void) {
  int32_t readings[SENSORS];
  read_contact(&usual, readings);
  uint32_t seven = 0x1C7 | 1 << 12;
  TEST_ASSERT_EQUAL_INT(FIT_TANGENTIAL_SENSORS - 1, __builtin_popcount(seven));
  expect_none(readings, seven);
  TEST_ASSERT_TRUE(estimate(readings, ALL).valid);
}

static void test_no_fit_gives_nothing(void) {
  int32_t readings[SENSORS] = {0};
  expect_none(readings, ALL);
  read_contact(&usual, readings);
  struct fit_result start;
  fit_gaussian(&array, readings, ALL, &settings, &start);
  start.flags &= ~(uint32_t)CONTACT_FLAG_FIT_VALID;
  struct fit_tangential_state state = {0};
  struct fit_tangential found;
  memset(&found, 0xFF, sizeof found);
  fit_tangential_estimate(&array, &pad, readings, &settings, &start, &state, &found);
  TEST_ASSERT_TRUE(is_zero(&found));
}

static void test_two_contacts_give_nothing(void) {
  struct contact other = {-1.0, -7.0, 5.0, 0.0, 0.0, 4.0}, one = {2.0, 6.0, 4.0, 0.0, 0.0, 4.0};
  int32_t readings[SENSORS], more[SENSORS];
  read_contact(&one, readings);
  read_contact(&other, more);
  for (int k = 0; k < SENSORS; k++) {
    readings[k] += more[k];
  }
  expect_none(readings, ALL);
}

/* Far sensors that read what one contact does not make: the pull would be told well without. */
static void test_readings_that_no_contact_makes_give_nothing(void) {
  int32_t readings[SENSORS], largest = 0;
  read_contact(&usual, readings);
  for (int k = 0; k < SENSORS; k++) {
    largest = readings[k] > largest ? readings[k] : largest;
  }
  readings[0] += largest / 28;
  readings[4] -= largest / 28;
  readings[10] -= largest / 28;
  readings[14] += largest / 28;
  expect_none(readings, ALL);
}

static void test_a_contact_far_outside_gives_nothing(void) {
  struct contact far = {22.0, 28.0, 5.0, 0.0, 0.0, 4.0};
  int32_t readings[SENSORS];
  read_contact(&far, readings);
  expect_none(readings, ALL);
}

static void test_noise_that_hides_the_force_gives_nothing(void) {
  int32_t readings[SENSORS];
  read_contact(&usual, readings);
  float least = 0.0f;
  for (int shift = 10; shift < 24; shift++) {
    settings.noise_Pa_q10 = 1 << shift;
    struct fit_tangential found = estimate(readings, ALL);
    if (!found.valid) {
      TEST_ASSERT_TRUE(least > 0.0f);
      return;
    }
    TEST_ASSERT_TRUE(found.q_sd_N <= FIT_TANGENTIAL_SD_MAX * 1.001f * found.force_N);
    TEST_ASSERT_TRUE(found.q_sd_N >= least);
    least = found.q_sd_N;
  }
  TEST_FAIL_MESSAGE("valid whatever the noise");
}

static void test_twice_the_pressure_is_twice_the_force_to_the_bit(void) {
  struct random random = {SEED};
  for (int i = 0; i < 200; i++) {
    struct contact contact = draw_contact(&random, 0.2);
    int32_t readings[SENSORS], scaled[SENSORS];
    read_contact(&contact, readings);
    settings.noise_Pa_q10 = 2048;
    struct fit_tangential found = estimate(readings, ALL);
    for (int k = 0; k < SENSORS; k++) {
      scaled[k] = readings[k] * 4;
    }
    settings.noise_Pa_q10 = 8192;
    struct fit_tangential other = estimate(scaled, ALL);
    TEST_ASSERT_EQUAL(found.valid, other.valid);
    TEST_ASSERT_TRUE(found.x_mm == other.x_mm && found.y_mm == other.y_mm);
    TEST_ASSERT_TRUE(found.location_sd_mm == other.location_sd_mm);
    TEST_ASSERT_TRUE(4.0f * found.force_N == other.force_N);
    TEST_ASSERT_TRUE(4.0f * found.qx_N == other.qx_N && 4.0f * found.qy_N == other.qy_N);
    TEST_ASSERT_TRUE(4.0f * found.q_sd_N == other.q_sd_N);
  }
}

static void test_a_mirrored_contact_has_a_mirrored_result(void) {
  struct random random = {SEED};
  for (int i = 0; i < 200; i++) {
    struct contact contact = draw_contact(&random, 0.2);
    int32_t readings[SENSORS], mirrored[SENSORS];
    read_contact(&contact, readings);
    struct fit_tangential found = estimate(readings, ALL);
    for (int axis = 0; axis < 2; axis++) {
      for (int k = 0; k < SENSORS; k++) {
        int column = k / 5, row = k % 5;
        mirrored[k] = axis ? readings[column * 5 + 4 - row] : readings[(2 - column) * 5 + row];
      }
      struct fit_tangential other = estimate(mirrored, ALL);
      TEST_ASSERT_EQUAL(found.valid, other.valid);
      float x = axis ? 1.0f : -1.0f, y = -x;
      TEST_ASSERT_FLOAT_WITHIN(0.01f, found.x_mm, x * other.x_mm);
      TEST_ASSERT_FLOAT_WITHIN(0.01f, found.y_mm, y * other.y_mm);
      TEST_ASSERT_FLOAT_WITHIN(0.001f * found.force_N, found.qx_N, x * other.qx_N);
      TEST_ASSERT_FLOAT_WITHIN(0.001f * found.force_N, found.qy_N, y * other.qy_N);
    }
  }
}

static void test_nothing_stays_from_another_frame(void) {
  struct random random = {SEED};
  int32_t readings[SENSORS], other[SENSORS];
  read_contact(&usual, readings);
  struct fit_tangential found = estimate(readings, ALL);
  for (int i = 0; i < 100; i++) {
    struct contact contact = draw_contact(&random, 0.3);
    read_contact(&contact, other);
    estimate(other, ALL & ~(1u << random_below(&random, SENSORS)));
    memset(&pad.room, (int)random_below(&random, 256), sizeof pad.room);
    struct fit_tangential again = estimate(readings, ALL);
    TEST_ASSERT_EQUAL_MEMORY(&found, &again, sizeof found);
  }
}

static double off_mm(const struct fit_tangential *a, const struct fit_tangential *b) {
  return hypot((double)(a->x_mm - b->x_mm), (double)(a->y_mm - b->y_mm));
}

static double off_ratio(const struct fit_tangential *a, const struct fit_tangential *b) {
  return hypot((double)(a->qx_N / a->force_N - b->qx_N / b->force_N),
               (double)(a->qy_N / a->force_N - b->qy_N / b->force_N));
}

static void test_the_first_frame_of_a_contact_is_not_told(void) {
  int32_t readings[SENSORS];
  read_contact(&usual, readings);
  struct fit_tangential_state state = {0};
  struct fit_tangential first = go_on(&state, readings, ALL);
  TEST_ASSERT_TRUE(is_zero(&first));
  int frames = 2;
  while (!go_on(&state, readings, ALL).valid) {
    frames++;
  }
  TEST_ASSERT_LESS_OR_EQUAL_INT(3, frames);
}

/* At 100 mm/s and 1300 frames a second, force and load changing by a tenth in ten frames. */
static void test_a_contact_that_moves_is_followed(void) {
  struct random random = {SEED};
  int told = 0;
  for (int i = 0; i < 30; i++) {
    struct contact contact = draw_contact(&random, 0.2);
    contact.x_mm /= 2.0;
    contact.y_mm /= 2.0;
    double angle = random_between(&random, 0, 6.283185307179586);
    struct fit_tangential_state state = {0};
    for (int frame = 0; frame < 40; frame++) {
      int32_t readings[SENSORS];
      read_contact(&contact, readings);
      struct fit_tangential found = go_on(&state, readings, ALL);
      struct fit_tangential held = estimate(readings, ALL);
      TEST_ASSERT_TRUE(held.valid);
      if (frame >= 3) {
        TEST_ASSERT_TRUE(found.valid);
        TEST_ASSERT_TRUE(off_mm(&found, &held) < 0.005);
        TEST_ASSERT_TRUE(off_ratio(&found, &held) < 0.001);
        told++;
      }
      contact.x_mm += 0.077 * cos(angle);
      contact.y_mm += 0.077 * sin(angle);
      contact.force_N *= 1.01;
      contact.qy_N *= 0.99;
    }
  }
  TEST_ASSERT_EQUAL_INT(30 * 37, told);
}

/* Without an end between them: what is told on the way is near the optimum, and soon at it. */
static void test_another_contact_is_found_at_once(void) {
  struct random random = {SEED};
  for (int i = 0; i < 300; i++) {
    struct fit_tangential_state state = {0};
    int32_t readings[SENSORS];
    struct contact before = draw_contact(&random, 0.3), contact = draw_contact(&random, 0.1);
    read_contact(&before, readings);
    for (int frame = 0; frame < 5; frame++) {
      go_on(&state, readings, ALL);
    }
    read_contact(&contact, readings);
    struct fit_tangential held = estimate(readings, ALL), found = held;
    for (int frame = 0; frame < 6 && held.valid; frame++) {
      found = go_on(&state, readings, ALL);
      if (found.valid) {
        TEST_ASSERT_TRUE(off_mm(&found, &held) < 0.25);
        TEST_ASSERT_TRUE(off_ratio(&found, &held) < 0.05);
      }
    }
    TEST_ASSERT_EQUAL(held.valid, found.valid);
    TEST_ASSERT_TRUE(!held.valid || off_mm(&found, &held) < 0.002);
  }
}

/* What two contacts leave is no beginning for one. */
static void test_it_begins_anew_where_it_says_nothing(void) {
  struct random random = {SEED};
  int begun = 0;
  for (int i = 0; i < 1000; i++) {
    struct fit_tangential_state state = {0};
    int32_t readings[SENSORS], more[SENSORS];
    struct contact contact = draw_contact(&random, 0.1), other = draw_contact(&random, 0.3);
    read_contact(&contact, readings);
    struct fit_tangential held = estimate(readings, ALL);
    read_contact(&other, more);
    for (int k = 0; k < SENSORS; k++) {
      more[k] += readings[k];
    }
    for (int frame = 0; frame < 20; frame++) {
      go_on(&state, more, ALL);
    }
    struct fit_tangential_state stuck = state;
    struct fit_tangential found = held;
    for (int frame = 0; frame < 16; frame++) {
      found = go_on(&state, readings, ALL);
      stuck.unreported = 0;
      go_on(&stuck, readings, ALL);
    }
    TEST_ASSERT_EQUAL(held.valid, found.valid);
    TEST_ASSERT_TRUE(!held.valid || off_mm(&found, &held) < 0.01);
    begun += held.valid && !go_on(&stuck, readings, ALL).valid;
  }
  TEST_ASSERT_GREATER_THAN_INT(0, begun);
}

/* Two halves 6 mm apart are a contact longer than wide; a pad that ends near makes round ones look
 * so.
 */
static void test_long_contacts_are_not_told_but_where_the_pad_ends_near(void) {
  int32_t readings[SENSORS], beside[SENSORS];
  struct contact contact = usual;
  contact.qx_N = contact.qy_N = 0.0;
  contact.x_mm = 1.0;
  contact.y_mm = 2.0;
  int told[2] = {0, 0};
  for (int near = 0; near < 2; near++) {
    for (int apart = 0; apart < 2; apart++) { /* two halves of the contact, 0 and 6 mm apart */
      use_pad(12.0);
      profile.overhang_mm = near ? 6.0f : 12.0f;
      TEST_ASSERT_EQUAL(FT_OK, fit_pad_init(&pad, &array, &profile));
      contact.x_mm = 1.0 - 3.0 * apart;
      read_contact(&contact, readings);
      contact.x_mm = 1.0 + 3.0 * apart;
      read_contact(&contact, beside);
      for (int k = 0; k < SENSORS; k++) {
        readings[k] = readings[k] / 2 + beside[k] / 2;
      }
      struct fit_tangential found = estimate(readings, ALL);
      if (apart == 0) {
        TEST_ASSERT_TRUE(found.valid && !found.elongated);
      } else {
        told[near] = found.valid;
        TEST_ASSERT_EQUAL(found.valid, found.elongated);
      }
    }
  }
  TEST_ASSERT_EQUAL(0, told[0]);
  TEST_ASSERT_EQUAL(1, told[1]);
}

static void test_profiles_that_no_layer_has_are_refused(void) {
  struct pad_profile wrong = profile_of(12.0);
  wrong.thickness_mm = 0.0f;
  TEST_ASSERT_EQUAL(FT_ERR_ARGUMENT, fit_pad_init(&pad, &array, &wrong));
  wrong = profile_of(12.0);
  wrong.normal[0].sd_mm = 0.6f; /* pressure without bound where the contact is */
  TEST_ASSERT_EQUAL(FT_ERR_ARGUMENT, fit_pad_init(&pad, &array, &wrong));
  wrong = profile_of(12.0);
  wrong.normal[0].sd_mm = wrong.normal[1].sd_mm = 1.0f; /* a pitch of many units */
  TEST_ASSERT_EQUAL(FT_ERR_ARGUMENT, fit_pad_init(&pad, &array, &wrong));
  wrong = profile_of(12.0);
  wrong.tangential[2].sd_mm = 100.0f;
  TEST_ASSERT_EQUAL(FT_ERR_ARGUMENT, fit_pad_init(&pad, &array, &wrong));
  wrong = profile_of(12.0);
  wrong.tangential[0].moment_mm = 40.0f;
  TEST_ASSERT_EQUAL(FT_ERR_ARGUMENT, fit_pad_init(&pad, &array, &wrong));
  float x_mm[8] = {0, 9, 18, 27, 0, 9, 18, 27}, y_mm[8] = {0, 0, 0, 0, 9, 9, 9, 9};
  struct fit_array other;
  TEST_ASSERT_EQUAL(FT_OK, fit_array_init(&other, 8, x_mm, y_mm, 9.0f));
  wrong = profile_of(12.0);
  TEST_ASSERT_EQUAL(FT_ERR_ARGUMENT, fit_pad_init(&pad, &other, &wrong));
}

static int32_t any_bits(struct random *random) { return (int32_t)(random_u32(random) - UINT32_C(0x80000000)); }

/* Of any profile that is valid and taken. */
static void draw_pad(struct random *random) {
  do {
    profile = profile_of(random_between(random, 5.0, 20.0));
    for (int j = 0; j < PAD_NORMAL_TERMS && random_below(random, 2); j++) {
      profile.normal[j].share *= (float)exp(random_between(random, -2, 1));
      profile.normal[j].sd_mm *= (float)exp(random_between(random, -0.5, 0.5));
    }
    for (int j = 0; j < PAD_TANGENTIAL_TERMS && random_below(random, 2); j++) {
      profile.tangential[j].moment_mm *= (float)exp(random_between(random, -2, 1));
      profile.tangential[j].sd_mm *= (float)exp(random_between(random, -0.5, 0.5));
    }
    profile.spread_mm2 = (float)random_between(random, 0, 100);
    profile.spread_sd_mm2 = (float)exp(random_between(random, log(0.11), log(99)));
  } while (fit_pad_init(&pad, &array, &profile) != FT_OK);
}

static void draw_readings(struct random *random, int32_t *readings) {
  uint32_t kind = random_below(random, 6), shift = random_below(random, 31);
  struct contact contact = draw_contact(random, random_between(random, 0, 4));
  contact.x_mm *= random_between(random, 0, 4);
  contact.y_mm *= random_between(random, 0, 2);
  contact.force_N = exp(random_between(random, -6, 5));
  contact.spread_mm2 *= random_between(random, 0, 10);
  if (kind >= 2) {
    read_contact(&contact, readings);
  }
  for (int k = 0; k < SENSORS; k++) {
    if (kind == 0) {
      readings[k] = any_bits(random);
    } else if (kind == 1) {
      readings[k] = any_bits(random) >> shift;
    } else if (kind == 2) {
      readings[k] = random_below(random, 4) ? readings[k] : any_bits(random);
    } else if (kind == 3) {
      readings[k] = (int32_t)(readings[k] * random_between(random, 0.7, 1.3));
    }
  }
}

/* The build's sanitizer finds what is undefined. */
static void test_any_bits_give_finite_results(void) {
  struct random random = {SEED};
  uint32_t valid = 0;
  struct fit_tangential_state state = {0};
  for (uint32_t i = 0; i < RANDOM_INPUTS; i++) {
    if (i % 64 == 0) {
      draw_pad(&random);
      memset(&state, 0, sizeof state);
    }
    int32_t readings[SENSORS];
    draw_readings(&random, readings);
    settings.noise_Pa_q10 = (int32_t)(random_u32(&random) >> (1 + random_below(&random, 31))) | 1;
    for (int k = 0; k < SENSORS; k++) {
      settings.gain_sd_q16[k] = (uint16_t)(random_u32(&random) >> random_below(&random, 32));
    }
    uint32_t usable = random_below(&random, 2) ? ALL : random_u32(&random) | random_u32(&random);
    struct fit_tangential found = i % 2 ? go_on(&state, readings, usable) : estimate(readings, usable);
    const float values[] = {found.x_mm,    found.y_mm,       found.location_sd_mm, found.location_noise_mm,
                            found.force_N, found.force_sd_N, found.qx_N,           found.qy_N,
                            found.q_sd_N};
    bool good = found.valid || is_zero(&found);
    for (size_t k = 0; k < sizeof values / sizeof *values; k++) {
      good = good && isfinite(values[k]);
    }
    good = good &&
           (!found.valid || (found.force_N > 0.0f && found.q_sd_N > 0.0f && found.force_sd_N > 0.0f &&
                             found.location_sd_mm > 0.0f && fabsf(found.x_mm) < 26.0f && fabsf(found.y_mm) < 35.0f));
    if (!good) {
      char text[200];
      snprintf(text, sizeof text, "input %u: x %g y %g sd %g force %g sd %g q %g %g sd %g", (unsigned)i,
               (double)found.x_mm, (double)found.y_mm, (double)found.location_sd_mm, (double)found.force_N,
               (double)found.force_sd_N, (double)found.qx_N, (double)found.qy_N, (double)found.q_sd_N);
      TEST_FAIL_MESSAGE(text);
    }
    valid += found.valid;
  }
  TEST_ASSERT_GREATER_THAN_UINT32(RANDOM_INPUTS / 60, valid);
}

int main(void) {
  UNITY_BEGIN();
  RUN_TEST(test_contacts_of_the_model_are_found);
  RUN_TEST(test_pads_of_5_to_20_mm);
  RUN_TEST(test_sensors_missing);
  RUN_TEST(test_a_dip_that_is_known_is_in_the_model);
  RUN_TEST(test_what_is_the_sensors_own_is_taken_out);
  RUN_TEST(test_place_and_load_err_together_as_is_said);
  RUN_TEST(test_too_few_sensors_give_nothing);
  RUN_TEST(test_no_fit_gives_nothing);
  RUN_TEST(test_two_contacts_give_nothing);
  RUN_TEST(test_readings_that_no_contact_makes_give_nothing);
  RUN_TEST(test_a_contact_far_outside_gives_nothing);
  RUN_TEST(test_noise_that_hides_the_force_gives_nothing);
  RUN_TEST(test_twice_the_pressure_is_twice_the_force_to_the_bit);
  RUN_TEST(test_a_mirrored_contact_has_a_mirrored_result);
  RUN_TEST(test_nothing_stays_from_another_frame);
  RUN_TEST(test_the_first_frame_of_a_contact_is_not_told);
  RUN_TEST(test_a_contact_that_moves_is_followed);
  RUN_TEST(test_another_contact_is_found_at_once);
  RUN_TEST(test_it_begins_anew_where_it_says_nothing);
  RUN_TEST(test_long_contacts_are_not_told_but_where_the_pad_ends_near);
  RUN_TEST(test_profiles_that_no_layer_has_are_refused);
  RUN_TEST(test_any_bits_give_finite_results);
  return UNITY_END();
}
