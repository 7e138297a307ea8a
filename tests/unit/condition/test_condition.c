#include "condition/condition.h"
#include "support/random.h"

#include <string.h>
#include <unity.h>

enum { SENSORS = 15 };
#define ALL 0x7FFFu
#define AMBIENT (100000 * 1024)
#define NOISE 4000

static struct condition condition;
static struct conditioned conditioned;
static struct frame frame;

static void fill(int32_t pressure_Pa_q10) {
  memset(&frame, 0, sizeof frame);
  frame.sensor_count = SENSORS;
  frame.noise_Pa_q10 = NOISE;
  frame.valid = ALL;
  for (int k = 0; k < SENSORS; k++) {
    frame.pressure_Pa_q10[k] = pressure_Pa_q10;
  }
}

static void run(int count) {
  for (int i = 0; i < count; i++) {
    condition_frame(&condition, &frame, NULL, &conditioned);
  }
}

void setUp(void) {
  condition_tare(&condition);
  fill(AMBIENT);
}

void tearDown(void) {}

static void test_tare_is_the_mean_without_the_extremes(void) {
  struct random random = {41};
  int64_t sum[SENSORS] = {0};
  for (int i = 0; i < CONDITION_TARE_FRAMES; i++) {
    for (int k = 0; k < SENSORS; k++) {
      bool extreme = i == k || i == (k + 5) % CONDITION_TARE_FRAMES;
      int32_t reading = AMBIENT + 5000 * k + (int32_t)random_below(&random, 20000);
      frame.pressure_Pa_q10[k] = !extreme ? reading : i == k ? INT32_MAX : INT32_MIN;
      sum[k] += extreme ? 0 : reading;
    }
    run(1);
    TEST_ASSERT_FALSE(conditioned.tared);
    TEST_ASSERT_EQUAL_HEX32(0, conditioned.usable);
    TEST_ASSERT_FALSE(conditioned.contact);
  }
  for (int k = 0; k < SENSORS; k++) {
    TEST_ASSERT_EQUAL_INT32(sum[k] / 14, condition.zero_Pa_q10[k]);
    frame.pressure_Pa_q10[k] = (int32_t)(sum[k] / 14) + 100 * k;
  }
  run(1);
  TEST_ASSERT_TRUE(conditioned.tared);
  TEST_ASSERT_EQUAL_HEX32(ALL, conditioned.usable);
  TEST_ASSERT_EQUAL_INT32(1400, conditioned.peak_Pa_q10);
  for (int k = 0; k < SENSORS; k++) {
    TEST_ASSERT_EQUAL_INT32(100 * k, conditioned.pressure_Pa_q10[k]);
  }
}

static void test_gate_opens_above_twenty_sigma_and_closes_at_twelve(void) {
  run(16);
  static const struct {
    int32_t above;
    bool contact;
  } steps[] = {
      {20 * NOISE, false},     {20 * NOISE + 1, true}, {12 * NOISE + 1, true}, {12 * NOISE, false},
      {12 * NOISE + 1, false}, {20 * NOISE, false},    {30 * NOISE, true},     {0, false}};
  for (size_t i = 0; i < sizeof steps / sizeof steps[0]; i++) {
    /* Tracking has moved the zero by less than what one frame was above it. */
    frame.pressure_Pa_q10[7] = condition.zero_Pa_q10[7] + steps[i].above;
    run(1);
    TEST_ASSERT_EQUAL_INT32(steps[i].above, conditioned.peak_Pa_q10);
    TEST_ASSERT_EQUAL(steps[i].contact, conditioned.contact);
  }
}

/* A flipped bit must not become a false touch that lasts. */
static void test_one_disturbed_reading_moves_no_zero(void) {
  static const int32_t readings[] = {INT32_MIN, 0, AMBIENT - 21 * NOISE, AMBIENT + 21 * NOISE,
                                     INT32_MAX};
  run(16);
  for (size_t i = 0; i < sizeof readings / sizeof readings[0]; i++) {
    frame.pressure_Pa_q10[7] = readings[i];
    run(1);
    TEST_ASSERT_EQUAL(readings[i] > AMBIENT, conditioned.contact);
    TEST_ASSERT_EQUAL(readings[i] > AMBIENT, conditioned.tared);
    TEST_ASSERT_EQUAL_INT32(AMBIENT, condition.zero_Pa_q10[7]);
    fill(AMBIENT);
    run(1);
    TEST_ASSERT_FALSE(conditioned.contact);
    TEST_ASSERT_TRUE(conditioned.tared);
  }
}

/* A step of the ambient pressure: after CONDITION_TRACK_FRAMES frames 1/e of it is left. */
static void test_zero_follows_with_its_time_constant(void) {
  static const int32_t drifts[] = {10 * NOISE, -10 * NOISE, -20 * NOISE};
  for (size_t i = 0; i < 3; i++) {
    setUp();
    run(16);
    fill(AMBIENT + drifts[i]);
    run(1);
    TEST_ASSERT_EQUAL_INT32(drifts[i], conditioned.pressure_Pa_q10[0]);
    run(CONDITION_TRACK_FRAMES);
    float left = (float)conditioned.pressure_Pa_q10[0] / (float)drifts[i];
    TEST_ASSERT_FLOAT_WITHIN(0.005f, 0.3679f, left);
    run(20 * CONDITION_TRACK_FRAMES);
    TEST_ASSERT_INT32_WITHIN(1, 0, conditioned.pressure_Pa_q10[0]);
  }
}

/* Even 1/1024 Pa is followed: what one frame adds is less than the zero can show, and is kept. */
static void test_zero_follows_the_smallest_drift(void) {
  run(16);
  fill(AMBIENT + 3);
  run(2 * CONDITION_TRACK_FRAMES);
  TEST_ASSERT_INT32_WITHIN(1, AMBIENT + 3, condition.zero_Pa_q10[0]);
  fill(AMBIENT - 3);
  run(4 * CONDITION_TRACK_FRAMES);
  TEST_ASSERT_INT32_WITHIN(1, AMBIENT - 3, condition.zero_Pa_q10[0]);
}

static void test_zero_stands_still_during_contact(void) {
  run(16);
  frame.pressure_Pa_q10[7] += 100 * NOISE;
  run(10000);
  TEST_ASSERT_TRUE(conditioned.contact);
  for (int k = 0; k < SENSORS; k++) {
    TEST_ASSERT_EQUAL_INT32(AMBIENT, condition.zero_Pa_q10[k]);
  }
}

static void test_invalid_sensors_are_left_out(void) {
  frame.valid = ALL & ~4u;
  frame.pressure_Pa_q10[2] = 0;
  run(17);
  TEST_ASSERT_TRUE(conditioned.tared);
  TEST_ASSERT_EQUAL_HEX32(ALL & ~4u, conditioned.usable);
  TEST_ASSERT_EQUAL_INT32(0, conditioned.pressure_Pa_q10[2]);
  /* It comes late: its own sixteen readings, while the others go on. */
  fill(AMBIENT);
  frame.pressure_Pa_q10[2] = AMBIENT + 777;
  for (int i = 0; i < 16; i++) {
    run(1);
    TEST_ASSERT_FALSE(conditioned.tared);
    TEST_ASSERT_EQUAL_HEX32(ALL & ~4u, conditioned.usable);
  }
  run(1);
  TEST_ASSERT_TRUE(conditioned.tared);
  TEST_ASSERT_EQUAL_HEX32(ALL, conditioned.usable);
  TEST_ASSERT_EQUAL_INT32(0, conditioned.pressure_Pa_q10[2]);
  /* A gap later on changes nothing of its zero. */
  frame.valid = ALL & ~4u;
  run(100);
  frame.valid = ALL;
  run(1);
  TEST_ASSERT_EQUAL_INT32(AMBIENT + 777, condition.zero_Pa_q10[2]);
}

static void test_saturated_sensor_means_contact_and_is_left_out(void) {
  run(16);
  frame.saturated = 8;
  frame.pressure_Pa_q10[3] = INT32_MAX;
  run(1);
  TEST_ASSERT_TRUE(conditioned.contact);
  TEST_ASSERT_EQUAL_HEX32(ALL & ~8u, conditioned.usable);
  TEST_ASSERT_EQUAL_INT32(0, conditioned.pressure_Pa_q10[3]);
  TEST_ASSERT_EQUAL_INT32(0, conditioned.peak_Pa_q10);
  TEST_ASSERT_EQUAL_INT32(AMBIENT, condition.zero_Pa_q10[3]);
  /* Nor does it enter a tare. */
  condition_tare(&condition);
  run(17);
  TEST_ASSERT_EQUAL_HEX32(ALL & ~8u, conditioned.usable);
  fill(AMBIENT);
  run(17);
  TEST_ASSERT_EQUAL_INT32(AMBIENT, condition.zero_Pa_q10[3]);
}

/* The press becomes the zero; after it the pad reads negative, says so, and is tared anew. */
static void test_tare_during_contact(void) {
  run(16);
  frame.pressure_Pa_q10[7] += 1000 * NOISE;
  run(5);
  TEST_ASSERT_TRUE(conditioned.contact);
  condition_tare(&condition);
  run(16);
  TEST_ASSERT_FALSE(conditioned.tared);
  TEST_ASSERT_FALSE(conditioned.contact);
  run(1);
  TEST_ASSERT_TRUE(conditioned.tared);
  TEST_ASSERT_FALSE(conditioned.contact);
  TEST_ASSERT_EQUAL_INT32(0, conditioned.peak_Pa_q10);
  fill(AMBIENT);
  run(1);
  TEST_ASSERT_EQUAL_INT32(-1000 * NOISE, conditioned.pressure_Pa_q10[7]);
  TEST_ASSERT_FALSE(conditioned.contact);
  TEST_ASSERT_FALSE(conditioned.tared);
  run(CONDITION_BELOW_FRAMES - 1);
  TEST_ASSERT_FALSE(conditioned.tared);
  TEST_ASSERT_EQUAL_HEX32(ALL, conditioned.usable);
  run(CONDITION_TARE_FRAMES);
  TEST_ASSERT_FALSE(conditioned.tared);
  TEST_ASSERT_EQUAL_HEX32(ALL & ~128u, conditioned.usable);
  run(1);
  TEST_ASSERT_TRUE(conditioned.tared);
  TEST_ASSERT_EQUAL_INT32(AMBIENT, condition.zero_Pa_q10[7]);
}

static void test_extremes(void) {
  static const int32_t extremes[] = {INT32_MIN, INT32_MIN + 1, -1, 0, 1, INT32_MAX - 1, INT32_MAX};
  for (size_t tare = 0; tare < 7; tare++) {
    for (size_t now = 0; now < 7; now++) {
      setUp();
      fill(extremes[tare]);
      run(16);
      TEST_ASSERT_EQUAL_INT32(extremes[tare], condition.zero_Pa_q10[0]);
      fill(extremes[now]);
      run(1);
      int64_t above = (int64_t)extremes[now] - extremes[tare];
      above = above > INT32_MAX ? INT32_MAX : above < INT32_MIN ? INT32_MIN : above;
      TEST_ASSERT_EQUAL_INT32((int32_t)above, conditioned.pressure_Pa_q10[0]);
      TEST_ASSERT_EQUAL(above > 20 * NOISE, conditioned.contact);
      run(30 * CONDITION_TRACK_FRAMES);
      if (!conditioned.contact) {
        TEST_ASSERT_INT32_WITHIN(1, 0, conditioned.pressure_Pa_q10[0]);
      }
    }
  }
}

static void test_random_frames(void) {
  struct random random = {42};
  for (int i = 0; i < 200000; i++) {
    if (random_below(&random, 200) == 0) {
      condition_tare(&condition);
    }
    frame.sensor_count = (uint8_t)(1 + random_below(&random, 32));
    uint32_t all = UINT32_MAX >> (32 - frame.sensor_count);
    frame.valid = random_u32(&random) & all;
    frame.saturated = random_u32(&random) & random_u32(&random) & random_u32(&random) & all;
    frame.noise_Pa_q10 = (int32_t)(1 + random_below(&random, 20000));
    for (int k = 0; k < frame.sensor_count; k++) {
      frame.pressure_Pa_q10[k] = (int32_t)random_u32(&random) >> random_below(&random, 32);
    }
    run(1);
    TEST_ASSERT_EQUAL_HEX32(0, conditioned.usable & ~(frame.valid & ~frame.saturated));
    int32_t peak = 0;
    for (int k = 0; k < FT_MAX_SENSORS; k++) {
      bool usable = conditioned.usable >> k & 1u;
      TEST_ASSERT_TRUE(usable || conditioned.pressure_Pa_q10[k] == 0);
      peak = conditioned.pressure_Pa_q10[k] > peak ? conditioned.pressure_Pa_q10[k] : peak;
    }
    TEST_ASSERT_EQUAL_INT32(peak, conditioned.peak_Pa_q10);
  }
}

/* A sensor that took another's place has another zero; the others keep theirs. */
static void test_another_sensor_is_tared_anew(void) {
  run(CONDITION_TARE_FRAMES + 1);
  TEST_ASSERT_TRUE(conditioned.tared);
  frame.pressure_Pa_q10[4] += 300 * 1024;
  frame.renewed = 1u << 4;
  run(1);
  frame.renewed = 0;
  TEST_ASSERT_FALSE(conditioned.tared);
  TEST_ASSERT_FALSE(conditioned.contact);
  TEST_ASSERT_EQUAL_HEX32(ALL & ~(1u << 4), conditioned.usable);
  run(CONDITION_TARE_FRAMES);
  TEST_ASSERT_TRUE(conditioned.tared);
  TEST_ASSERT_FALSE(conditioned.contact);
  TEST_ASSERT_EQUAL_INT32(0, conditioned.pressure_Pa_q10[4]);
}

int main(void) {
  UNITY_BEGIN();
  RUN_TEST(test_tare_is_the_mean_without_the_extremes);
  RUN_TEST(test_one_disturbed_reading_moves_no_zero);
  RUN_TEST(test_gate_opens_above_twenty_sigma_and_closes_at_twelve);
  RUN_TEST(test_zero_follows_with_its_time_constant);
  RUN_TEST(test_zero_follows_the_smallest_drift);
  RUN_TEST(test_zero_stands_still_during_contact);
  RUN_TEST(test_invalid_sensors_are_left_out);
  RUN_TEST(test_saturated_sensor_means_contact_and_is_left_out);
  RUN_TEST(test_tare_during_contact);
  RUN_TEST(test_extremes);
  RUN_TEST(test_random_frames);
  RUN_TEST(test_another_sensor_is_tared_anew);
  return UNITY_END();
}
