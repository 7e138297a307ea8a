/* The tangential estimate against readings of its own model, and at the limits of its input.
 * tests/accuracy compares it with a separate estimator in double precision. */
#include "fit/fit_tangential.h"
#include "pad_press.h"

enum { SENSORS = GRID_SENSORS, ALL = (1 << SENSORS) - 1 };
#define SEED UINT64_C(0x7461676E)
#define TURN 6.283185307179586

static struct fit_array array;
static struct fit_pad pad;
static struct pad_press rubber;
static struct fit_settings settings;
static struct random random;

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
  rubber.profile = profile_of(thickness_mm);
  TEST_ASSERT_EQUAL(FT_OK, fit_pad_init(&pad, &array, &rubber.profile));
}

void setUp(void) {
  random = (struct random){SEED};
  rubber = (struct pad_press){.dip_sd_mm = 15.0};
  make_grid_of_15(&array);
  use_pad(12.0);
  settings = (struct fit_settings){.iterations = 4, .noise_Pa_q10 = 2048};
  fit_set_errors(&settings, 0.005f, 0.0065f);
}

static double any(double low, double high) { return random_between(&random, low, high); }

static void read_contact(const struct contact *contact, int32_t *readings) {
  for (int k = 0; k < SENSORS; k++) {
    readings[k] = (int32_t)lround(1024.0 * pad_press_Pa(&rubber, contact, k));
  }
}

static struct contact draw_contact(double ratio) {
  struct contact contact = {.x_mm = any(-7, 7)};
  contact.y_mm = any(-16, 16);
  contact.force_N = any(1, 10);
  double q_N = ratio * contact.force_N, angle = any(0, TURN);
  contact.qx_N = q_N * cos(angle);
  contact.qy_N = q_N * sin(angle);
  contact.spread_mm2 = any(2, 6);
  return contact;
}

/* Of a contact that is drawn. */
static struct contact read_any(double ratio, int32_t *readings) {
  const struct contact contact = draw_contact(ratio);
  read_contact(&contact, readings);
  return contact;
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

static bool is_zero(const struct fit_tangential *result) {
  struct fit_tangential zero;
  memset(&zero, 0, sizeof zero);
  return memcmp(&zero, result, sizeof zero) == 0;
}

static double off_mm(const struct fit_tangential *a, const struct fit_tangential *b) {
  return hypot((double)(a->x_mm - b->x_mm), (double)(a->y_mm - b->y_mm));
}

static double off_ratio(const struct fit_tangential *a, const struct fit_tangential *b) {
  return hypot((double)(a->qx_N / a->force_N - b->qx_N / b->force_N), (double)(a->qy_N / a->force_N - b->qy_N / b->force_N));
}

/* Of 300 contacts: the least number of valid ones, and of those the most that may be further off
 * than mm or share of the force and a standard deviation. */
static void judge_pad(double thickness_mm, uint32_t usable, double mm, double share, int least, int most_off) {
  use_pad(thickness_mm);
  random = (struct random){SEED};
  int valid = 0, outside = 0;
  for (int i = 0; i < 300; i++) {
    int32_t readings[SENSORS];
    const struct contact contact = read_any(0.1 * (i % 4), readings);
    struct fit_tangential found = estimate(readings, usable);
    if (!found.valid) {
      TEST_ASSERT_TRUE(is_zero(&found));
      continue;
    }
    valid++;
    double far_mm = hypot((double)found.x_mm - contact.x_mm, (double)found.y_mm - contact.y_mm);
    double off = hypot((double)found.qx_N - contact.qx_N, (double)found.qy_N - contact.qy_N);
    double sd_mm = (double)found.location_sd_mm, sd_N = (double)found.q_sd_N;
    /* What is determined loosely is drawn towards the priors. */
    outside += far_mm > mm + sd_mm || off > share * contact.force_N + sd_N;
    CHECK(outside <= most_off, "%g mm, press %d at %.1f %.1f: off by %.4f mm (sd %.4f), %.4f of %.3f N (sd %.4f)", thickness_mm, i,
          contact.x_mm, contact.y_mm, far_mm, sd_mm, off, contact.force_N, sd_N);
  }
  TEST_ASSERT_GREATER_OR_EQUAL_INT(least, valid);
}

/* On thin pads a contact is narrower than the pitch: a tenth is further off than its standard deviation. */
TEST(test_contacts_of_the_model_are_found) {
  judge_pad(12.0, ALL, 0.02, 0.002, 285, 0);
  judge_pad(5.0, ALL, 0.1, 0.01, 180, 30);
  judge_pad(6.0, ALL, 0.1, 0.01, 240, 40);
  judge_pad(20.0, ALL, 0.02, 0.002, 290, 0);
  judge_pad(12.0, ALL & ~(1 << 7), 0.05, 0.005, 290, 0);
  judge_pad(12.0, ALL & ~(1 << 0 | 1 << 13), 0.05, 0.005, 290, 0);
}

TEST(test_a_dip_that_is_known_is_in_the_model) {
  rubber.dip_share = 0.05;
  settings.dip_share = 0.05f;
  settings.dip_sd_mm = 15.0f;
  judge_pad(12.0, ALL, 0.03, 0.003, 280, 0);
  judge_pad(12.0, ALL & ~(1 << 7), 0.05, 0.005, 280, 0);
}

TEST(test_what_is_the_sensors_own_is_taken_out) {
  random = (struct random){UINT64_C(7)};
  pad_press_draw_deviations(&rubber, 600, 1600, &random); /* 0.16 mm, 5 % */
  settings.deviations = rubber.deviations;
  judge_pad(12.0, ALL, 0.08, 0.01, 260, 0);
  judge_pad(12.0, ALL & ~(1 << 7), 0.1, 0.015, 260, 0);
}

static const struct contact usual = {2.0, 3.0, 5.0, 0.5, -0.3, 4.0};

/* shift_q20_mm: noise that makes a load seem larger moves the place by so much. */
TEST(test_place_and_load_err_together_as_is_said) {
  enum { TIMES = 1000 };
  int32_t exact[SENSORS], readings[SENSORS];
  fit_set_errors(&settings, 0.0f, 0.0065f);
  read_contact(&usual, exact);
  struct fit_tangential at = estimate(exact, ALL);
  double by[2][2] = {{0}}, square[2] = {0}; /* sums over q_i x_j, and over q_i^2 */
  for (int n = 0; n < TIMES; n++) {
    for (int k = 0; k < SENSORS; k++) {
      readings[k] = exact[k] + (int32_t)any(-60000, 60000);
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
    double said_mm = at.shift_q20_mm[i] / 1048576.0;
    TEST_ASSERT_DOUBLE_WITHIN(0.3, by[i][i] / square[i], said_mm);
    TEST_ASSERT_TRUE(fabs(said_mm) > 2.0);
    TEST_ASSERT_DOUBLE_WITHIN(0.5, 0.0, by[i][1 - i] / square[i]);
  }
}

static void assert_none(const int32_t *readings, uint32_t usable) {
  struct fit_tangential found = estimate(readings, usable);
  TEST_ASSERT_TRUE(is_zero(&found));
}

TEST(test_what_is_no_single_contact_on_the_array_gives_nothing) {
  const struct contact two[] = {{2.0, 6.0, 4.0, 0.0, 0.0, 4.0}, {-1.0, -7.0, 5.0, 0.0, 0.0, 4.0}};
  const struct contact outside = {22.0, 28.0, 5.0, 0.0, 0.0, 4.0};
  const uint32_t seven = 0x1C7 | 1 << 12;
  int32_t readings[SENSORS] = {0}, more[SENSORS], largest = 0;
  assert_none(readings, ALL);
  read_contact(&outside, readings);
  assert_none(readings, ALL);
  read_contact(&two[0], readings);
  read_contact(&two[1], more);
  for (int k = 0; k < SENSORS; k++) {
    readings[k] += more[k];
  }
  assert_none(readings, ALL);
  read_contact(&usual, readings);
  TEST_ASSERT_TRUE(estimate(readings, ALL).valid);
  TEST_ASSERT_EQUAL_INT(FIT_TANGENTIAL_SENSORS - 1, __builtin_popcount(seven));
  assert_none(readings, seven);
  /* Far sensors that read what one contact does not make: the pull would be determined well without. */
  for (int k = 0; k < SENSORS; k++) {
    largest = readings[k] > largest ? readings[k] : largest;
  }
  for (int k = 0; k < 4; k++) {
    readings[(const int[]){0, 4, 10, 14}[k]] += (k == 0 || k == 3 ? 1 : -1) * (largest / 56);
  }
  for (int ends = 0; ends < 2; ends++) { /* each has its limit of chi^2, without which these are contacts */
    rubber.profile.overhang_mm = ends ? 9.0f : 0.0f;
    TEST_ASSERT_EQUAL(FT_OK, fit_pad_init(&pad, &array, &rubber.profile));
    assert_none(readings, ALL);
  }
}

TEST(test_noise_that_hides_the_force_gives_nothing) {
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

TEST(test_twice_the_pressure_is_twice_the_force_to_the_bit) {
  for (int i = 0; i < 200; i++) {
    int32_t readings[SENSORS], scaled[SENSORS];
    read_any(0.2, readings);
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

TEST(test_a_mirrored_contact_has_a_mirrored_result) {
  for (int i = 0; i < 200; i++) {
    int32_t readings[SENSORS], mirrored[SENSORS];
    read_any(0.2, readings);
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

TEST(test_nothing_stays_from_another_frame) {
  int32_t readings[SENSORS], other[SENSORS];
  read_contact(&usual, readings);
  struct fit_tangential found = estimate(readings, ALL);
  for (int i = 0; i < 100; i++) {
    read_any(0.3, other);
    estimate(other, ALL & ~(1u << random_below(&random, SENSORS)));
    memset(&pad.work, (int)random_below(&random, 256), sizeof pad.work);
    struct fit_tangential again = estimate(readings, ALL);
    TEST_ASSERT_EQUAL_MEMORY(&found, &again, sizeof found);
  }
}

TEST(test_the_first_frame_of_a_contact_is_not_told) {
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
TEST(test_a_contact_that_moves_is_followed) {
  int told = 0;
  for (int i = 0; i < 30; i++) {
    struct contact contact = draw_contact(0.2);
    contact.x_mm /= 2.0;
    contact.y_mm /= 2.0;
    double angle = any(0, TURN);
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

/* Without an end between them: what is reported on the way is near the optimum, and soon at it. */
TEST(test_another_contact_is_found_at_once) {
  for (int i = 0; i < 300; i++) {
    struct fit_tangential_state state = {0};
    int32_t readings[SENSORS];
    read_any(0.3, readings);
    for (int frame = 0; frame < 5; frame++) {
      go_on(&state, readings, ALL);
    }
    read_any(0.1, readings);
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
TEST(test_it_begins_again_where_it_reports_nothing) {
  int begun = 0;
  for (int i = 0; i < 1000; i++) {
    struct fit_tangential_state state = {0};
    int32_t readings[SENSORS], more[SENSORS];
    read_any(0.1, readings);
    struct fit_tangential held = estimate(readings, ALL);
    read_any(0.3, more);
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

/* Two halves 6 mm apart are a contact longer than wide; a pad that ends near makes round ones look so. */
TEST(test_long_contacts_are_reported_only_where_the_pad_ends_near) {
  struct contact contact = {1.0, 2.0, 5.0, 0.0, 0.0, 4.0};
  for (int near = 0; near < 2; near++) {
    for (int apart = 0; apart < 2; apart++) {
      int32_t readings[SENSORS], beside[SENSORS];
      rubber.profile = profile_of(12.0);
      rubber.profile.overhang_mm = near ? 6.0f : 12.0f;
      TEST_ASSERT_EQUAL(FT_OK, fit_pad_init(&pad, &array, &rubber.profile));
      contact.x_mm = 1.0 - 3.0 * apart;
      read_contact(&contact, readings);
      contact.x_mm = 1.0 + 3.0 * apart;
      read_contact(&contact, beside);
      for (int k = 0; k < SENSORS; k++) {
        readings[k] = readings[k] / 2 + beside[k] / 2;
      }
      struct fit_tangential found = estimate(readings, ALL);
      TEST_ASSERT_EQUAL(!apart || near, found.valid);
      TEST_ASSERT_EQUAL(apart && near, found.elongated);
    }
  }
}

TEST(test_contacts_at_corners_are_marked) {
  for (int i = 0; i < 4; i++) {
    int32_t readings[SENSORS];
    read_contact(&(struct contact){i & 1 ? 7.2 : -6.3, i & 2 ? -16.2 : 15.3, 5.0, 0.0, 0.0, 4.0}, readings);
    TEST_ASSERT_EQUAL(i == 3, estimate(readings, ALL).at_corner);
  }
}

TEST(test_profiles_that_no_layer_has_are_refused) {
  const struct pad_profile good = profile_of(12.0);
  struct pad_profile wrong[] = {good, good, good, good, good};
  wrong[0].thickness_mm = 0.0f;
  wrong[1].normal[0].sd_mm = 0.6f;                            /* pressure without bound where the contact is */
  wrong[2].normal[0].sd_mm = wrong[2].normal[1].sd_mm = 1.0f; /* a pitch of many units */
  wrong[3].tangential[2].sd_mm = 100.0f;
  wrong[4].tangential[0].moment_mm = 40.0f;
  for (int i = 0; i < 5; i++) {
    TEST_ASSERT_EQUAL(FT_ERR_ARGUMENT, fit_pad_init(&pad, &array, &wrong[i]));
  }
  const float x_mm[8] = {0, 9, 18, 27, 0, 9, 18, 28}, y_mm[8] = {0, 0, 0, 0, 9, 9, 9, 9}; /* one off its node */
  struct fit_array other;
  TEST_ASSERT_EQUAL(FT_OK, fit_array_init(&other, 8, x_mm, y_mm, 9.0f));
  TEST_ASSERT_EQUAL(FT_ERR_ARGUMENT, fit_pad_init(&pad, &other, &good));
}
