/* How far gains are apart, learnt from touches. */
#include "common/contact_flags.h"
#include "fit/fit_gains.h"
#include "support/grid.h"
#include "support/random.h"
#include "support/unit.h"

#define SENSORS GRID_SENSORS
#define ASSUMED 0.105f

static struct fit_array array;
static struct random random;
static struct fit_settings settings;
static double gain[SENSORS];
static struct fit_gains gains;
static int32_t readings[SENSORS];
static struct fit_result result;

static void spread_gains(double spread) {
  for (int k = 0; k < SENSORS; k++) {
    gain[k] = 1.0 + (spread > 0.0 ? spread * random_normal(&random) : 0.0);
  }
}

/* Every other one that. */
static void alternate_gains(double odd, double even) {
  for (int k = 0; k < SENSORS; k++) {
    gain[k] = k % 2 ? odd : even;
  }
}

void setUp(void) {
  make_grid_of_15(&array);
  random = (struct random){UINT64_C(20221015)};
  spread_gains(0.0);
  settings = (struct fit_settings){.iterations = 4, .noise_Pa_q10 = 4096};
  fit_set_errors(&settings, ASSUMED, 0.0f);
  fit_gains_begin(&gains, ASSUMED);
}

struct touch {
  double p0_Pa, sigma_mm, x_mm, y_mm;
};

static const struct touch good = {14000.0, 5.6, 1.0, 2.0};

static struct touch anywhere(double sigma_mm) {
  const double x_mm = random_between(&random, -9.0, 9.0);
  return (struct touch){14000.0, sigma_mm, x_mm, random_between(&random, -18.0, 18.0)};
}

/* On the present array, of as many sensors. */
static void measure(struct touch touch) {
  for (int k = 0; k < array.sensor_count; k++) {
    const double dx = (double)(array.x[k] * array.pitch_mm) - touch.x_mm;
    const double dy = (double)(array.y[k] * array.pitch_mm) - touch.y_mm;
    const double pressure_Pa = touch.p0_Pa * exp(-(dx * dx + dy * dy) / (2.0 * touch.sigma_mm * touch.sigma_mm));
    readings[k] = (int32_t)lround(1024.0 * (gain[k] * pressure_Pa + 4.0 * random_normal(&random)));
  }
  fit_gaussian(&array, readings, UINT32_MAX, &settings, &result);
}

static bool learn(void) { return fit_gains_learn(&gains, &array, readings, &settings, &result); }

/* Two frames. Whether it counts. */
static bool hold(struct touch touch) {
  fit_gains_end_touch(&gains);
  measure(touch);
  TEST_ASSERT_FALSE(learn());
  measure(touch);
  return learn();
}

TEST(test_touches_show_how_far_gains_are_apart) {
  static const double spreads[] = {0.1, 0.15, 0.2};
  for (int s = 0; s < 3; s++) {
    double squares = 0.0;
    for (int pad = 0; pad < 100; pad++) {
      fit_gains_begin(&gains, ASSUMED);
      spread_gains(spreads[s]);
      for (int i = 0; i < 60; i++) {
        hold(anywhere(random_between(&random, 5.2, 6.2)));
      }
      const double sd = (double)fit_gains_sd(&gains);
      squares += sd * sd / 100.0;
    }
    /* of 64 touches four stay what was assumed */
    const double expected = sqrt((60.0 * spreads[s] * spreads[s] + 4.0 * 0.105 * 0.105) / 64.0);
    CHECK(fabs(expected - sqrt(squares)) < 0.12 * expected + 0.002, "gains apart by %.2f: learnt %.4f", spreads[s], sqrt(squares));
  }
}

TEST(test_a_touch_counts_once_and_when_it_rests) {
  TEST_ASSERT_FLOAT_WITHIN(1e-5f, ASSUMED, fit_gains_sd(&gains));
  struct touch touch = {5000.0, 5.6, 1.0, 2.0};
  for (int i = 0; i < 10; i++) { /* it still grows */
    touch.p0_Pa *= 1.05;
    measure(touch);
    TEST_ASSERT_FALSE(learn());
  }
  measure(touch);
  TEST_ASSERT_TRUE(learn());
  const float sd = fit_gains_sd(&gains);
  TEST_ASSERT_TRUE(sd < 0.97f * ASSUMED);
  for (int i = 0; i < 10; i++) {
    measure(touch);
    TEST_ASSERT_FALSE(learn());
  }
  TEST_ASSERT_EQUAL_FLOAT(sd, fit_gains_sd(&gains));
  TEST_ASSERT_TRUE(hold(touch));
}

TEST(test_what_shows_nothing_does_not_count) {
  const float before = gains.residual;
  TEST_ASSERT_FALSE(hold((struct touch){300.0, 5.6, 1.0, 2.0}));     /* noise */
  TEST_ASSERT_FALSE(hold((struct touch){900000.0, 3.0, 1.0, 2.0}));  /* thin rubber */
  TEST_ASSERT_FALSE(hold((struct touch){14000.0, 5.6, 30.0, 2.0}));  /* beside the array */
  TEST_ASSERT_FALSE(hold((struct touch){14000.0, 200.0, 1.0, 2.0})); /* flat */
  TEST_ASSERT_FALSE(hold((struct touch){0.0, 5.6, 1.0, 2.0}));
  TEST_ASSERT_EQUAL_FLOAT(before, gains.residual);
  /* Without a sensor; and at a limit: nothing of the model is wrong in the residual, and the place is. */
  static const uint32_t limits[] = {0, CONTACT_FLAG_AT_BOUND, CONTACT_FLAG_FLAT};
  for (int i = 0; i < 6; i++) {
    measure(good);
    if (i < 2) {
      fit_gaussian(&array, readings, 0x7FFE, &settings, &result);
    }
    result.flags |= limits[i / 2];
    TEST_ASSERT_FALSE(learn());
  }
}

TEST(test_an_odd_touch_shows_little) {
  alternate_gains(0.5, 1.5);
  TEST_ASSERT_TRUE(hold((struct touch){14000.0, 6.0, 1.0, 2.0}));
  TEST_ASSERT_TRUE(fit_gains_sd(&gains) > 0.12f && fit_gains_sd(&gains) < 0.22f);
}

/* The law is one of rectangles, of nine sensors and more. */
TEST(test_eight_sensors_or_a_strip_learn_nothing) {
  for (int strip = 0; strip < 2; strip++) {
    const uint8_t count = strip ? SENSORS : 8;
    float x_mm[SENSORS], y_mm[SENSORS];
    for (int k = 0; k < count; k++) {
      x_mm[k] = strip ? 0.0f : 9.0f * (float)(k / 4);
      y_mm[k] = 9.0f * (float)(strip ? k - 7 : k % 4);
    }
    TEST_ASSERT_EQUAL(FT_OK, fit_array_init(&array, count, x_mm, y_mm, 9.0f));
    fit_gains_end_touch(&gains);
    for (int frame = 0; frame < 2; frame++) {
      measure(strip ? (struct touch){14000.0, 5.6, 0.0, 0.0} : (struct touch){14000.0, 5.6, 5.0, 14.0});
      TEST_ASSERT_BITS_HIGH(CONTACT_FLAG_FIT_VALID, result.flags);
      TEST_ASSERT_FALSE(learn());
    }
  }
}

/* A skin is changed: what sixty touches showed of the old one fades. */
TEST(test_another_pad_is_learnt) {
  for (int i = 0; i < 300; i++) {
    hold(anywhere(5.6));
  }
  TEST_ASSERT_EQUAL_FLOAT(0.08f, fit_gains_sd(&gains)); /* a tilt may hide */
  spread_gains(0.2);
  for (int i = 0; i < 100; i++) {
    hold(anywhere(5.6));
  }
  TEST_ASSERT_TRUE(fit_gains_sd(&gains) > 0.12f);
}

/* One wild touch is one touch. */
TEST(test_an_sd_has_limits) {
  alternate_gains(0.1, 3.0);
  for (int i = 0; i < 300; i++) {
    hold(anywhere(6.5));
  }
  TEST_ASSERT_TRUE(fit_gains_sd(&gains) <= 0.5f);
  fit_gains_begin(&gains, 0.0f);
  TEST_ASSERT_EQUAL_FLOAT(0.08f, fit_gains_sd(&gains));
}
