#include "contact/slip.h"
#include "support/random.h"
#include "support/unit.h"

/* Positions are cut off towards zero at 1/16 um: two coordinates, two points. */
#define ROUNDING_mm 1.9e-4f
#define WINDOW_us 100000u

static struct slip_history history;

void setUp(void) { slip_reset(&history); }
/* Eq. (7) of the paper as it stands. */
static double eq7(const double (*r)[2], int i, int n) {
  double mean[2] = {0.0, 0.0};
  for (int j = 1; j <= n; j++) {
    mean[0] += r[i - j][0] / n;
    mean[1] += r[i - j][1] / n;
  }
  return hypot(r[i][0] - mean[0], r[i][1] - mean[1]);
}

static void compare_with_eq7(uint64_t (*time_us)(struct random *, int), int n, uint32_t window_us) {
  enum { FRAMES = 2000 };
  static double r[FRAMES][2];
  struct random random = {51};
  slip_reset(&history);
  for (int i = 0; i < FRAMES; i++) {
    r[i][0] = (float)random_between(&random, -13.0, 13.0);
    r[i][1] = (float)random_between(&random, -22.0, 22.0);
    float distance_mm = -1.0f;
    bool full = slip_update(&history, time_us(&random, i), (float)r[i][0], (float)r[i][1], window_us, &distance_mm);
    TEST_ASSERT_EQUAL(i >= n, full);
    if (full) {
      TEST_ASSERT_FLOAT_WITHIN(ROUNDING_mm, (float)eq7((const double(*)[2])r, i, n), distance_mm);
    } else {
      TEST_ASSERT_EQUAL_FLOAT(-1.0f, distance_mm);
    }
  }
}

static uint64_t at_20_Hz(struct random *random, int i) {
  (void)random;
  return 7000000u + 50000u * (uint64_t)i;
}

/* +-8 ms about a regular grid. */
static uint64_t at_20_Hz_with_jitter(struct random *random, int i) {
  return 7000000u + 50000u * (uint64_t)i - 8000u + random_below(random, 16001);
}

static uint64_t at_200_Hz_with_jitter(struct random *random, int i) { return 5000u * (uint64_t)i + random_below(random, 1000); }

static uint64_t at_5_Hz(struct random *random, int i) {
  (void)random;
  return 200000u * (uint64_t)i;
}

TEST(test_twenty_hertz_is_the_papers_metric) { compare_with_eq7(at_20_Hz, 2, WINDOW_us); }

TEST(test_jitter_does_not_change_n) {
  compare_with_eq7(at_20_Hz_with_jitter, 2, WINDOW_us);
  compare_with_eq7(at_200_Hz_with_jitter, 20, WINDOW_us);
}

TEST(test_window_shorter_than_the_interval_compares_with_the_frame_before) {
  compare_with_eq7(at_5_Hz, 1, WINDOW_us);
  compare_with_eq7(at_20_Hz, 1, 5000);
  compare_with_eq7(at_20_Hz, 1, 0);
}

/* At 3 kHz the window holds more than the memory: the newest SLIP_CAPACITY count. */
TEST(test_window_beyond_the_capacity) {
  const uint64_t interval_us = 333;
  const float step_mm = 0.01f;
  float distance_mm = 0.0f;
  for (int i = 0; i < 1000; i++) {
    bool full = slip_update(&history, interval_us * (uint64_t)i, step_mm * (float)i, 0.0f, WINDOW_us, &distance_mm);
    TEST_ASSERT_EQUAL(i >= SLIP_CAPACITY, full);
    if (full) {
      TEST_ASSERT_FLOAT_WITHIN(ROUNDING_mm, step_mm * (SLIP_CAPACITY + 1) / 2.0f, distance_mm);
    }
    TEST_ASSERT_LESS_OR_EQUAL_UINT16(SLIP_CAPACITY, history.count);
  }
}

/* After a pause without a reset the frame before is all there is; then the window fills again. */
TEST(test_pause) {
  float distance_mm = -1.0f;
  for (uint64_t i = 0; i < 100; i++) {
    slip_update(&history, 5000 * i, 1.0f, 0.0f, WINDOW_us, &distance_mm);
  }
  TEST_ASSERT_TRUE(slip_update(&history, 10000000, 3.0f, 0.0f, WINDOW_us, &distance_mm));
  TEST_ASSERT_FLOAT_WITHIN(ROUNDING_mm, 2.0f, distance_mm);
  for (uint64_t i = 1; i < 20; i++) {
    TEST_ASSERT_FALSE(slip_update(&history, 10000000 + 5000 * i, 3.0f, 0.0f, WINDOW_us, &distance_mm));
  }
  TEST_ASSERT_TRUE(slip_update(&history, 10100000, 3.0f, 0.0f, WINDOW_us, &distance_mm));
  TEST_ASSERT_FLOAT_WITHIN(1e-9f, 0.0f, distance_mm);
}

/* Running sums in integers do not drift: after a million updates they are those of the ring. */
TEST(test_sums_stay_exact) {
  struct random random = {52};
  uint64_t t_us = 0;
  float distance_mm;
  for (int i = 0; i < 1200000; i++) {
    t_us += 300 + random_below(&random, 3000);
    slip_update(&history, t_us, (float)random_between(&random, -800.0, 800.0), (float)random_between(&random, -800.0, 800.0), WINDOW_us,
                &distance_mm);
  }
  int64_t x_sum = 0;
  int64_t y_sum = 0;
  for (uint16_t i = 0; i < history.count; i++) {
    uint16_t at = (uint16_t)((history.oldest + i) % SLIP_CAPACITY);
    x_sum += history.x_16th_um[at];
    y_sum += history.y_16th_um[at];
  }
  TEST_ASSERT_EQUAL_INT64(x_sum, history.x_sum);
  TEST_ASSERT_EQUAL_INT64(y_sum, history.y_sum);
}

/* The farthest positions in a full memory must not overflow the sums. */
TEST(test_farthest_positions) {
  float distance_mm = -1.0f;
  for (uint64_t i = 0; i <= SLIP_CAPACITY; i++) {
    slip_update(&history, 300 * i, 800.0f, -800.0f, WINDOW_us, &distance_mm);
  }
  TEST_ASSERT_FLOAT_WITHIN(1e-3f, 0.0f, distance_mm);
  TEST_ASSERT_TRUE(slip_update(&history, 300 * (SLIP_CAPACITY + 1), -800.0f, 800.0f, WINDOW_us, &distance_mm));
  TEST_ASSERT_FLOAT_WITHIN(1e-2f, 2262.742f, distance_mm);
}

/* A temperature conversion takes the place of a frame every 64: the interval doubles once. */
TEST(test_a_missing_frame_does_not_void_the_window) {
  uint64_t t_us = 0;
  int full_frames = 0;
  for (int i = 0; i < 400; i++) {
    t_us += i % 64 == 63 ? 11600 : 5800;
    float distance_mm = 0.0f;
    bool full = slip_update(&history, t_us, 40e-6f * (float)t_us, 0.0f, WINDOW_us, &distance_mm);
    TEST_ASSERT_TRUE(full || i < 17);
    if (full && full_frames++ > 20) {
      /* v (window + interval) / 2, with either interval */
      TEST_ASSERT_FLOAT_WITHIN(0.25f, 40e-3f * (100.0f + 8.7f) / 2.0f, distance_mm);
    }
  }
  TEST_ASSERT_GREATER_THAN_INT(380, full_frames);
}
