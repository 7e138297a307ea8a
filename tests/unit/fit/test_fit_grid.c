/* The fixed-point kernels against the float32 one, which other tests hold to the reference, and all of them on cast
 * rubber: a dip around the contact, sensors off their places and of other widths. Built once for the 3 x 5 grid of the
 * firmware and for others. */
#include "common/contact_flags.h"
#include "fit/fit.h"
#include "fit/fit_fixed.h"
#include "support/random.h"
#include "support/unit.h"

#include <stdbool.h>
#include <stddef.h>
#include <string.h>

enum { COLUMNS = TEST_COLUMNS, ROWS = TEST_ROWS, SENSORS = COLUMNS * ROWS };
#define PITCH_mm 9.0f
#define ALL first_sensors(SENSORS)
#define WITHOUT(sensor) (ALL & ~sensor_bit(sensor))
/* Of a result, without what pads it. */
#define RESULT_BYTES (offsetof(struct fit_result, flags) + sizeof(uint32_t))
#define HALF_X_mm (4.5 * (COLUMNS - 1))
#define HALF_Y_mm (4.5 * (ROWS - 1))

static float x_mm[SENSORS], y_mm[SENSORS];
static struct fit_array array;
static int32_t readings[SENSORS];
static const struct fit_settings usual = {.iterations = 7, .noise_Pa_q10 = 5120};
static struct random random;

/* Not in the order of a grid: rows run from top to bottom, columns are interleaved. */
void setUp(void) {
  for (int k = 0; k < SENSORS; k++) {
    x_mm[k] = PITCH_mm * ((float)(k % COLUMNS) - 0.5f * (COLUMNS - 1)) + 1.5f;
    y_mm[k] = PITCH_mm * (0.5f * (ROWS - 1) - (float)(k / COLUMNS)) - 0.25f;
  }
  random = (struct random){77};
  TEST_ASSERT_EQUAL(FT_OK, fit_array_init(&array, SENSORS, x_mm, y_mm, PITCH_mm));
}

static double any(double low, double high) { return random_between(&random, low, high); }

/* A place on the array. */
static double any_x(void) { return 1.5 + any(-HALF_X_mm, HALF_X_mm); }
static double any_y(void) { return -0.25 + any(-HALF_Y_mm, HALF_Y_mm); }

static void press(double x, double y, double p0_Pa, double sigma_mm, double noise_Pa) {
  for (int k = 0; k < SENSORS; k++) {
    double p = p0_Pa * exp(-pow(hypot((double)x_mm[k] - x, (double)y_mm[k] - y) / sigma_mm, 2.0) / 2.0);
    readings[k] = (int32_t)nearbyint(1024.0 * (p + noise_Pa * random_normal(&random)));
  }
}

static void random_press(double sigma_low_mm, double sigma_high_mm) {
  const double x = any_x(), y = any_y(), p0_Pa = any(2e3, 1e5);
  press(x, y, p0_Pa, any(sigma_low_mm, sigma_high_mm), 5.0);
}

static struct fit_result by_grid(const struct fit_settings *settings) {
  struct fit_result result;
  fit_grid(&array, readings, settings, &result);
  return result;
}

static struct fit_result by_masked(sensor_map usable, const struct fit_settings *settings) {
  struct fit_result result;
  fit_grid_masked(&array, readings, usable, settings, &result);
  return result;
}

static struct fit_result by_general(sensor_map usable, const struct fit_settings *settings) {
  struct fit_result result;
  fit_general(&array, readings, usable, settings, &result);
  return result;
}

static struct fit_result by_gaussian(const struct fit_settings *settings) {
  struct fit_result result;
  fit_gaussian(&array, readings, ALL, settings, &result);
  return result;
}

static float apart_mm(const struct fit_result *a, const struct fit_result *b) { return hypotf(a->x_mm - b->x_mm, a->y_mm - b->y_mm); }

static void assert_columns(uint8_t sensors, float pitch_mm, uint8_t columns) {
  TEST_ASSERT_EQUAL(FT_OK, fit_array_init(&array, sensors, x_mm, y_mm, pitch_mm));
  TEST_ASSERT_EQUAL_UINT8(columns, array.grid.columns);
}

TEST(a_rectangle_is_recognised_in_any_order) {
  assert_columns(SENSORS, PITCH_mm, COLUMNS);
  TEST_ASSERT_EQUAL_UINT8(ROWS, array.grid.rows);
  assert_columns(SENSORS - 1, PITCH_mm, 0);
  assert_columns(SENSORS, PITCH_mm / 2, 0);
  x_mm[0] += 0.1f;
  assert_columns(SENSORS, PITCH_mm, 0);
  x_mm[0] = x_mm[1]; /* two sensors on one node, another node empty */
  assert_columns(SENSORS, PITCH_mm, 0);
}

TEST(the_tables_are_those_of_the_library) {
  for (int k = 0; k < 256; k++) {
    TEST_ASSERT_EQUAL_INT32(lround(ldexp(exp2(-k / 256.0), 30)), fit_exp2_table[k]);
    TEST_ASSERT_EQUAL_INT(k > 0 ? ilogb(k) + 1 : 0, fit_bits_table[k]);
  }
  for (int k = 0; k <= 64; k++) {
    TEST_ASSERT_EQUAL_INT32(lround(32768.0 * log2(1.0 + k / 64.0)), fit_log2_table[k]);
  }
}

/* The kernels agree on presses that neither warns of, once both have settled: without the sensor at
 * the peak that takes some longer. masked: this number of sensors, or -1 for the kernel of full grids. */
static void hold_to_the_general_kernel(int presses, int masked) {
  struct fit_settings settled = {.iterations = masked > 0 ? 14 : 7, .noise_Pa_q10 = 5120};
  int compared = 0;
  for (int i = 0; i < presses; i++) {
    random_press(4.0, 15.0);
    sensor_map usable = ALL;
    for (int k = 0; k < masked; k++) {
      usable &= WITHOUT(random_below(&random, SENSORS));
    }
    for (int k = 0; k < SENSORS; k++) {
      readings[k] = usable >> k & 1 ? readings[k] : (int32_t)random_u32(&random);
      /* where gains alone count, weak sensors lose bits */
      settled.gain_sd_q16[k] = (uint16_t)(i % 3 == 2 ? random_below(&random, 8000) : 0);
    }
    settled.model_sd_q16 = i % 3 ? 400 : 0;
    const struct fit_result grid = masked < 0 ? by_grid(&settled) : by_masked(usable, &settled);
    const struct fit_result general = by_general(usable, &settled);
    TEST_ASSERT_EQUAL_HEX64(usable, grid.used);
    const uint32_t skipped = CONTACT_FLAG_UNCERTAIN | CONTACT_FLAG_LOW_SIGNAL | CONTACT_FLAG_ELONGATED;
    if (((general.flags | grid.flags) & skipped) || general.location_sd_mm > 0.2f) {
      continue; /* what is hardly determined may differ, and one alone has shapes */
    }
    compared++;
    const uint32_t of_shape = CONTACT_FLAG_WIDTHS_VALID | CONTACT_FLAG_ELONGATED;
    TEST_ASSERT_EQUAL_HEX32(general.flags, grid.flags & ~of_shape);
    TEST_ASSERT_TRUE(apart_mm(&grid, &general) < (masked > 0 ? 3e-3f : 1e-3f));
    TEST_ASSERT_FLOAT_WITHIN(masked > 0 ? 5e-4f : 1e-4f, 1.0f, grid.force_N / general.force_N);
    TEST_ASSERT_FLOAT_WITHIN(0.08f, 1.0f, grid.location_sd_mm / general.location_sd_mm);
    TEST_ASSERT_FLOAT_WITHIN(0.04f, 1.0f, grid.force_sd_N / general.force_sd_N);
    TEST_ASSERT_FLOAT_WITHIN(3e-4f * general.p0_Pa, general.p0_Pa, grid.p0_Pa);
    TEST_ASSERT_FLOAT_WITHIN(3e-4f * general.sigma_mm, general.sigma_mm, grid.sigma_mm);
    /* A micrometre on a steep flank is worth some noise. */
    TEST_ASSERT_FLOAT_WITHIN((SENSORS > 30 ? 0.07f : 0.02f) * general.residual_rms_Pa, general.residual_rms_Pa, grid.residual_rms_Pa);
  }
  TEST_ASSERT_GREATER_THAN_INT(presses / 3, compared);
}

TEST(the_kernels_agree) {
  hold_to_the_general_kernel(20000, -1);
  for (int masked = 0; masked <= 4; masked++) {
    hold_to_the_general_kernel(5000, masked);
  }
}

/* One sensor of a clean press reads 10 kPa too much or too little. */
TEST(an_outlier_is_left_out) {
  enum { PRESSES = 2000 };
  for (int general = 0; general < 2; general++) {
    int found = 0, others = 0, unwarned = 0;
    for (int i = 0; i < PRESSES; i++) {
      random_press(4.5, 12.0);
      const struct fit_result clean = by_gaussian(&usual);
      uint32_t wrong = random_below(&random, SENSORS);
      readings[wrong] += (i % 2 ? 1 : -1) * 10000 * 1024;
      const struct fit_result result = general ? by_general(ALL, &usual) : by_gaussian(&usual);
      float moved_mm = apart_mm(&result, &clean);
      bool masked = result.flags & CONTACT_FLAG_SENSOR_MASKED;
      TEST_ASSERT_EQUAL(masked, result.used != ALL);
      found += result.used == WITHOUT(wrong) && moved_mm < 0.2f;
      others += masked && result.used != WITHOUT(wrong);
      const uint32_t warnings =
          CONTACT_FLAG_UNCERTAIN | CONTACT_FLAG_MODEL | CONTACT_FLAG_AT_BOUND | CONTACT_FLAG_FLAT | CONTACT_FLAG_LOW_SIGNAL;
      unwarned += moved_mm > 1.0f && !(result.flags & warnings);
    }
    TEST_ASSERT_GREATER_THAN_INT(PRESSES * 3 / 5, found);
    TEST_ASSERT_LESS_THAN_INT(PRESSES / 20, others);
    TEST_ASSERT_LESS_THAN_INT(PRESSES / 100, unwarned);
  }
  for (int i = 0; i < 5000; i++) { /* and no sensor of a clean press */
    random_press(4.0, 15.0);
    TEST_ASSERT_EQUAL_HEX64(ALL, by_gaussian(&usual).used);
  }
}

TEST(more_iterations_come_nearer) {
  float mean_um[9] = {0};
  for (int i = 0; i < 500; i++) {
    random_press(4.5, 7.0);
    const struct fit_result best = by_general(ALL, &usual);
    for (uint8_t n = 0; n < 9; n++) {
      const struct fit_settings settings = {.iterations = n, .noise_Pa_q10 = 5120};
      const struct fit_result result = by_grid(&settings);
      mean_um[n] += 2.0f * apart_mm(&result, &best);
    }
  }
  TEST_ASSERT_TRUE(mean_um[0] > 20.0f && mean_um[0] < 2000.0f);
  for (int n = 1; n < 5; n++) {
    TEST_ASSERT_TRUE(mean_um[n] < 0.7f * mean_um[n - 1] || mean_um[n] < 0.05f);
  }
  TEST_ASSERT_TRUE(mean_um[7] < 0.05f && mean_um[8] < 0.05f);
}

/* The standard deviation contains the last step. Up to two iterations of the grid kernel are of one kind: one more is one more step. */
TEST(a_fit_that_still_moves_states_how_far) {
  for (int general = 0; general < 2; general++) {
    int moving = 0;
    for (int i = 0; i < 1000; i++) {
      const double x = any_x(), y = any_y();
      press(x, y, 5e4, general ? any(4.0, 12.0) : any(3.5, 7.0), 0.0);
      struct fit_settings settings = {.iterations = 1, .noise_Pa_q10 = 1};
      struct fit_result before, result = general ? by_general(ALL, &settings) : by_grid(&settings);
      for (settings.iterations = 2; settings.iterations <= (general ? 5 : 2); settings.iterations++) {
        before = result;
        result = general ? by_general(ALL, &settings) : by_grid(&settings);
        if (before.used == ALL && result.used == ALL) { /* without a sensor it is another fit */
          float moved_mm = apart_mm(&result, &before);
          TEST_ASSERT_TRUE(result.location_sd_mm > 0.99f * moved_mm - 1e-4f);
          moving += moved_mm > 0.5f * result.location_sd_mm;
        }
      }
    }
    TEST_ASSERT_GREATER_THAN_INT(20, moving);
  }
}

TEST(a_prior_pulls_sigma_alike_in_both) {
  struct fit_settings settings = usual;
  settings.prior_sigma_mm = 4.0f;
  settings.prior_width_mm = 0.5f;
  for (int i = 0; i < 200; i++) {
    random_press(3.2, 3.6);
    const struct fit_result grid = by_grid(&settings), general = by_general(ALL, &settings);
    const struct fit_result free = by_general(ALL, &usual);
    if (!((general.flags | grid.flags | free.flags) & CONTACT_FLAG_UNCERTAIN)) {
      /* the grid kernel takes sigma to 15 bits into the prior */
      TEST_ASSERT_FLOAT_WITHIN(1e-2f, general.sigma_mm, grid.sigma_mm);
      TEST_ASSERT_FLOAT_WITHIN(1e-2f, general.x_mm, grid.x_mm);
      TEST_ASSERT_TRUE(general.sigma_mm > free.sigma_mm - 1e-4f);
    }
  }
}

/* Little but the prior determines the width where one sensor measures something beside noise: what the
 * prior makes of the deviations may be many times what the readings do. */
TEST(a_prior_leaves_what_is_uncertain_so) {
  struct fit_settings settings = usual;
  settings.iterations = 4;
  settings.prior_sigma_mm = 6.5f;
  settings.prior_width_mm = 3.0f;
  fit_set_errors(&settings, 0.01f, 0.0065f);
  int compared = 0;
  for (int i = 0; i < 3000; i++) {
    press(0, 0, 0.0, 1.0, 5.0);
    readings[random_below(&random, SENSORS)] += (int32_t)any(150e3, 4000e3);
    const struct fit_result grid = i % 2 ? by_grid(&settings) : by_masked(WITHOUT(random_below(&random, SENSORS)), &settings);
    if (grid.flags & CONTACT_FLAG_FIT_VALID) {
      const struct fit_result general = by_general(grid.used, &settings);
      if (!((grid.flags | general.flags) & CONTACT_FLAG_AT_BOUND)) {
        TEST_ASSERT_TRUE(grid.flags & CONTACT_FLAG_UNCERTAIN || grid.location_sd_mm > 0.3f * general.location_sd_mm);
        compared++;
      }
    }
  }
  TEST_ASSERT_GREATER_THAN_INT(500, compared);
}

/* The sums over all nodes are never larger. */
TEST(a_press_that_is_alike_everywhere_has_its_peak) {
  press(1.5, -0.25, 131070.0, 1e6, 0.0);
  const struct fit_result found[] = {by_grid(&usual), by_masked(ALL, &usual)};
  for (int each = 0; each < 2; each++) { /* of the widest contact that there is */
    TEST_ASSERT_FLOAT_WITHIN(15000.0f, 140000.0f, found[each].p0_Pa);
  }
}

TEST(readings_below_zero_count_as_zero) {
  const struct fit_settings cut = {.iterations = 4, .noise_Pa_q10 = 5120, .clip_below_sds = 4};
  struct fit_settings whole = cut;
  whole.clip_below_sds = 0;
  for (int i = 0; i < 100; i++) {
    random_press(3.2, 6.0);
    int32_t below[SENSORS];
    int changed = 0;
    for (int k = 0; k < SENSORS; k++) {
      if (readings[k] < 4 * 5120) { /* some as far below zero as is noise, some farther */
        readings[k] = (int32_t)random_below(&random, 2) ? -4 * 5120 : -4 * 5120 - 1 - 40000 * k;
      }
      below[k] = readings[k];
      if (readings[k] < -4 * 5120) {
        readings[k] = 0;
        changed++;
      }
    }
    const struct fit_result expected[] = {by_gaussian(&whole), by_masked(WITHOUT(1), &whole), by_general(ALL, &whole)};
    memcpy(readings, below, sizeof readings);
    const struct fit_result found[] = {by_gaussian(&cut), by_masked(WITHOUT(1), &cut), by_general(ALL, &cut)};
    for (int each = 0; each < 3; each++) {
      TEST_ASSERT_EQUAL_MEMORY(&expected[each], &found[each], RESULT_BYTES);
    }
    const struct fit_result other = by_general(ALL, &whole);
    TEST_ASSERT_EQUAL(changed > 0, memcmp(&expected[2], &other, RESULT_BYTES) != 0);
  }
}

/* The share of the dip of a contact on thin rubber that a sensor has, both so far from the middle of an axis. */
static double share_at_end(double half_mm, double at_mm, double place_mm) {
  double lacking = 0.5 - 0.75 * (half_mm - copysign(at_mm, at_mm * place_mm)) / (double)PITCH_mm;
  return fabs(place_mm) > half_mm - 1.0 ? 1.0 - fmin(fmax(lacking, 0.0), 0.5) : 1.0;
}

/* A contact of 30 kPa on rubber with a dip, measured with 2 Pa of noise by sensors with these deviations. */
static void press_cast(double x, double y, double sigma, double share, double sd, const struct fit_deviation *deviations) {
  for (int k = 0; k < SENSORS; k++) {
    double dx = (double)x_mm[k] + (double)PITCH_mm * deviations[k].off_x_q15 / 32768.0 - x;
    double dy = (double)y_mm[k] + (double)PITCH_mm * deviations[k].off_y_q15 / 32768.0 - y;
    double square = dx * dx + dy * dy, wide = sigma * exp(deviations[k].wider_q15 / 32768.0);
    double there = share_at_end(HALF_X_mm, x - 1.5, (double)x_mm[k] - 1.5) * share_at_end(HALF_Y_mm, y + 0.25, (double)y_mm[k] + 0.25);
    double p = exp(-square / (2 * wide * wide)) - (sigma < 4.95 ? there : 1.0) * share * exp(-square / (2 * sd * sd));
    readings[k] = (int32_t)nearbyint(1024.0 * (3e4 * p + 2.0 * random_normal(&random)));
  }
}
static const struct fit_deviation no_deviations[SENSORS];

/* What a calibration knows of such a pad. */
static struct fit_settings of_cast(double sigma, double share, double sd) {
  return (struct fit_settings){.iterations = 8,
                               .noise_Pa_q10 = 2048,
                               .prior_sigma_mm = (float)sigma,
                               .prior_width_mm = 0.1f,
                               .dip_share = (float)share,
                               .dip_sd_mm = (float)sd};
}

/* Up to 0.16 mm each way, and 5 % of the width. */
static void draw_deviations(struct fit_deviation *deviations) {
  for (int k = 0; k < SENSORS; k++) {
    deviations[k].off_x_q15 = (int32_t)any(-600.0, 600.0);
    deviations[k].off_y_q15 = (int32_t)any(-600.0, 600.0);
    deviations[k].wider_q15 = (int32_t)any(-1638.0, 1638.0);
  }
}

static float off_mm(const struct fit_result *result, double x, double y) {
  return (float)hypot((double)result->x_mm - x, (double)result->y_mm - y);
}

/* How far grid and general kernel are off, and how far the kernels are apart. */
static void judge(const struct fit_settings *settings, double x, double y, float *worst, float *apart) {
  const struct fit_result grid = by_grid(settings), masked = by_masked(ALL, settings), general = by_general(ALL, settings);
  *worst = fmaxf(*worst, fmaxf(off_mm(&grid, x, y), off_mm(&general, x, y)));
  *apart = fmaxf(*apart, fmaxf(apart_mm(&general, &grid), apart_mm(&masked, &grid)));
}

TEST(a_known_dip_is_added_back_alike_in_all) {
  float worst = 0.0f, apart = 0.0f, unknown = 0.0f;
  for (int i = 0; i < 400; i++) {
    const double x = any_x(), y = any_y(), sigma = any(5.2, 6.0), sd = 3.2 * sigma;
    press_cast(x, y, sigma, 0.03, sd, no_deviations);
    struct fit_settings settings = of_cast(sigma, 0.0, sd);
    settings.clip_below_sds = 4;
    const struct fit_result plain = by_grid(&settings);
    settings.dip_share = 0.03f;
    judge(&settings, x, y, &worst, &apart);
    unknown = fmaxf(unknown, off_mm(&plain, x, y));
    TEST_ASSERT_TRUE(by_grid(&settings).location_sd_mm <= plain.location_sd_mm);
  }
  CHECK(unknown > 0.3f && worst < 0.08f && apart < 0.02f, "off %.3f mm, unknown %.3f, kernels apart %.3f", (double)worst, (double)unknown,
        (double)apart);
}

/* Narrow contacts up to a third of a pitch beyond the outer sensors. The kernel for wide contacts,
 * whose derivatives do not have the dip, ends far outside. */
TEST(beyond_the_sensors_the_dip_shows_the_place) {
  enum { PRESSES = 400 };
  int far = 0, far_of_wide = 0, unsure = 0, apart = 0;
  for (int i = 0; i < PRESSES; i++) {
    const double x = 1.5 + (i % 2 ? -1.0 : 1.0) * (HALF_X_mm + any(0.5, 3.0)), y = any_y();
    const double sigma = any(2.8, 3.6), sd = 3.2 * sigma;
    press_cast(x, y, sigma, 0.035, sd, no_deviations);
    const struct fit_settings settings = of_cast(sigma, 0.035, sd);
    const struct fit_result found = by_gaussian(&settings), wide = by_grid(&settings), general = by_general(ALL, &settings);
    far += off_mm(&found, x, y) > 0.5f;
    far_of_wide += off_mm(&wide, x, y) > 0.5f;
    unsure += off_mm(&found, x, y) > 2.5f * found.location_sd_mm;
    apart += apart_mm(&general, &found) > 0.05f;
  }
  CHECK(far_of_wide > PRESSES / 2 && far <= PRESSES / 50 && unsure <= PRESSES / 100 && apart <= PRESSES / 25,
        "of %d off by 0.5 mm: %d, wide kernel %d; beyond 2.5 sd %d; apart %d", PRESSES, far, far_of_wide, unsure, apart);
}

/* Sensors that are off their places and measure a contact wider, on a pad without a dip and with one. */
TEST(what_is_the_sensors_own_is_taken_out_alike_in_all) {
  float worst = 0.0f, apart = 0.0f, unknown = 0.0f;
  int rough = 0;
  for (int i = 0; i < 400; i++) {
    struct fit_deviation deviations[SENSORS];
    draw_deviations(deviations);
    const double x = any_x(), y = any_y(), sigma = any(5.2, 7.0), sd = 3.0 * sigma, share = i % 2 ? 0.02 : 0.0;
    press_cast(x, y, sigma, share, sd, deviations);
    struct fit_settings settings = of_cast(sigma, share, sd);
    const struct fit_result plain = by_grid(&settings);
    settings.deviations = deviations;
    judge(&settings, x, y, &worst, &apart);
    unknown += off_mm(&plain, x, y) / 400.0f;
    rough += by_grid(&settings).residual_rms_Pa > 0.5f * plain.residual_rms_Pa;
    struct fit_result lacking[2]; /* the deviations of a missing sensor change nothing */
    for (int other = 0; other < 2; other++) {
      deviations[0].wider_q15 = 3000 * other;
      lacking[other] = by_masked(WITHOUT(0), &settings);
    }
    TEST_ASSERT_EQUAL_MEMORY(&lacking[0], &lacking[1], RESULT_BYTES);
    settings.iterations = 2; /* too few to know the contact before it */
    const struct fit_result early[] = {by_grid(&settings), by_masked(ALL, &settings), by_general(ALL, &settings)};
    settings.deviations = NULL;
    const struct fit_result without[] = {by_grid(&settings), by_masked(ALL, &settings), by_general(ALL, &settings)};
    for (int each = 0; each < 3; each++) {
      TEST_ASSERT_EQUAL_MEMORY(&early[each], &without[each], RESULT_BYTES);
    }
  }
  CHECK(unknown > 0.1f && worst < 0.08f && apart < 0.03f && rough < 40, "off %.3f mm, unknown %.3f, kernels apart %.3f; %d rough",
        (double)worst, (double)unknown, (double)apart, rough);
}

/* A sensor that measures a contact much wider is no outlier to a fit that knows it. */
TEST(a_sensor_that_is_known_to_differ_is_no_outlier) {
  int left_out[2] = {0};
  for (int i = 0; i < 200; i++) {
    struct fit_deviation deviations[SENSORS] = {{0}};
    deviations[random_below(&random, SENSORS)].wider_q15 = 3277; /* 10 % */
    const double x = 1.5 + any(-4.0, 4.0);
    press_cast(x, -0.25 + any(-4.0, 4.0), 6.0, 0.0, 1.0, deviations);
    struct fit_settings settings = {.iterations = 7, .noise_Pa_q10 = 2048};
    for (int known = 0; known < 2; known++) {
      settings.deviations = known ? deviations : NULL;
      left_out[known] += by_gaussian(&settings).used != ALL;
    }
  }
  CHECK(left_out[0] >= 10 && left_out[1] == 0, "left out %d, known %d", left_out[0], left_out[1]);
}

/* Nor does what is known of all sensors hide one that is an outlier. */
TEST(an_outlier_is_found_among_sensors_that_differ) {
  enum { PRESSES = 400 };
  int found = 0, others = 0;
  for (int i = 0; i < PRESSES; i++) {
    struct fit_deviation deviations[SENSORS];
    draw_deviations(deviations);
    const double x = 1.5 + any(-4.0, 4.0);
    press_cast(x, -0.25 + any(-4.0, 4.0), 6.0, 0.0, 1.0, deviations);
    const uint32_t outlier = random_below(&random, SENSORS);
    readings[outlier] += 5000 * 1024;
    const struct fit_settings settings = {.iterations = 7, .noise_Pa_q10 = 2048, .deviations = deviations};
    const sensor_map used = by_gaussian(&settings).used;
    found += used == WITHOUT(outlier);
    others += used != ALL && (used >> outlier & 1);
  }
  CHECK(found > PRESSES * 6 / 10 && others == 0, "of %d found %d, others %d", PRESSES, found, others);
}
