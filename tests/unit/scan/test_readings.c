#include "scan/readings.h"
#include "support/random.h"
#include "support/unit.h"

#include <string.h>

enum { SENSORS = 15, ONE = 7 };
#define ALL 0x7FFFu
#define ONE_BIT (1u << ONE)

/* A public dump of a part at 22.75 degC and 1002.41 mbar. */
static const struct ms58xx_prom PROM = {{0, 41335, 41466, 26840, 27317, 31225, 28780}};
static const uint32_t D1 = 6735203, D2 = 8073757;
/* Of that part. */
static const double CODES_PER_Pa = 25.2, CODES_PER_degC = 29150;

static struct ms58xx_prom prom[FT_MAX_SENSORS];
static uint32_t d1[FT_MAX_SENSORS], d2[FT_MAX_SENSORS];
static struct readings readings;
static struct readings_temperature temperature;
static struct frame frame;

void setUp(void) {
  memset(&readings, 0, sizeof readings);
  readings.presses_are_shared = true;
  frame = (struct frame){.sensor_count = SENSORS, .noise_Pa_q10 = 4000};
  for (int k = 0; k < SENSORS; k++) {
    prom[k] = PROM;
    d1[k] = D1 + (uint32_t)(20000 * k); /* moulding: up to 12 kPa apart */
    d2[k] = D2 + (uint32_t)(700 * k);
  }
  temperature = (struct readings_temperature){.prom = prom, .code = d2, .good = ALL, .returned = ALL, .admitted = ALL, .warmed_cC = 75};
}

static uint32_t take_temperature(void) {
  uint32_t news = readings_take_temperature(&readings, SENSORS, &temperature);
  temperature.returned = 0;
  temperature.prom_changed = 0;
  return news;
}

static void take_pressures(uint32_t good) {
  const uint32_t before = readings.left_out;
  const bool reported = readings_take_pressures(&readings, d1, good, &frame);
  TEST_ASSERT_EQUAL(readings.left_out != before, reported);
  for (int k = 0; k < SENSORS; k++) {
    TEST_ASSERT_TRUE((frame.valid >> k & 1u) || frame.pressure_Pa_q10[k] == 0);
  }
  TEST_ASSERT_EQUAL_HEX32(0, (frame.saturated | frame.doubtful) & ~frame.valid);
}

static void start(void) {
  TEST_ASSERT_EQUAL_HEX32(READINGS_MOVED, take_temperature());
  take_pressures(ALL);
  take_pressures(ALL);
  TEST_ASSERT_EQUAL_HEX32(ALL, frame.valid);
  TEST_ASSERT_EQUAL_HEX32(0, frame.doubtful | frame.saturated);
}

static void next_case(void) {
  setUp();
  start();
}

static void step_by(int k, double Pa) { d1[k] = (uint32_t)(d1[k] + Pa * CODES_PER_Pa); }

static void warm_by(int k, double degC) { d2[k] = (uint32_t)(d2[k] + degC * CODES_PER_degC); }

static double true_Pa(int k, uint32_t true_d2) {
  struct ms58xx_thermal thermal;
  ms58xx_compensate_temperature(&prom[k], true_d2, MS58XX_BRANCH_UNKNOWN, &thermal);
  return ms58xx_compensate_pressure(&thermal, d1[k]) / 1024.0;
}

static void expect(sensor_map valid, uint32_t left_out) {
  TEST_ASSERT_EQUAL_HEX32(valid, frame.valid);
  TEST_ASSERT_EQUAL_UINT32(left_out, readings.left_out);
}

static void take_and_expect(uint32_t good, uint32_t valid, uint32_t left_out) {
  take_pressures(good);
  expect(valid, left_out);
}

static void expect_after_temperature(uint32_t valid) {
  take_temperature();
  take_and_expect(ALL, valid, 0);
}

TEST(test_a_step_of_one_sensor_alone_is_left_out_of_its_frame) {
  static const double steps_Pa[] = {9e3, -9e3, 60e3, -60e3, 150e3};
  for (int i = 0; i < 5 * SENSORS; i++) {
    next_case();
    const int one = i / 5;
    step_by(one, steps_Pa[i % 5]);
    take_and_expect(ALL, ALL & ~(1u << one), 1);
    TEST_ASSERT_EQUAL_HEX32(0, frame.saturated);
    step_by(one, -steps_Pa[i % 5]);
    take_and_expect(ALL, ALL, 1);
    TEST_ASSERT_EQUAL_HEX32(0, readings.suspects);
  }
}

TEST(test_a_sensor_that_steps_alone_twice_is_suspect_until_it_returns) {
  start();
  for (uint32_t i = 1; i <= 2; i++) {
    step_by(ONE, 12e3 * i);
    take_and_expect(ALL, ALL & ~ONE_BIT, i);
    TEST_ASSERT_EQUAL_HEX32(ONE_BIT, frame.restored);
  }
  TEST_ASSERT_EQUAL_HEX32(ONE_BIT, readings.suspects);
  for (int i = 0; i < 10; i++) {
    take_and_expect(ALL, ALL & ~ONE_BIT, 2);
  }
  take_temperature();
  TEST_ASSERT_EQUAL_HEX32(ONE_BIT, readings.suspects);
  temperature.returned = ONE_BIT;
  take_temperature();
  TEST_ASSERT_EQUAL_HEX32(0, readings.suspects);
  take_and_expect(ALL, ALL, 2);
}

/* Also after frames in which it had no reading. */
TEST(test_a_step_behind_a_gap_is_noticed) {
  start();
  take_pressures(ALL & ~ONE_BIT);
  step_by(ONE, 12e3);
  take_pressures(ALL);
  take_pressures(ALL);
  TEST_ASSERT_EQUAL_HEX32(ONE_BIT, readings.suspects);
}

TEST(test_a_step_that_another_measures_counts_at_once) {
  start();
  for (int sign = -1; sign <= 1; sign += 2) {
    step_by(ONE, sign * 6.4e3);
    step_by(ONE + 1, sign * 300);
    take_pressures(ALL); /* as if it had lost its state: its temperature has not */
    TEST_ASSERT_EQUAL_HEX32(ALL, frame.doubtful & frame.unsettled);
    expect_after_temperature(ALL);
    TEST_ASSERT_EQUAL_HEX32(0, frame.doubtful);
  }
}

/* The neighbour that would measure it may be the one that is missing. */
TEST(test_where_presses_are_not_shared_or_a_sensor_is_missing_every_step_counts) {
  for (uint32_t missing = 0; missing < 2; missing++) {
    next_case();
    readings.presses_are_shared = missing != 0;
    step_by(ONE, 60e3);
    take_and_expect(ALL & ~missing, ALL & ~missing, 0);
  }
}

/* Admitted again between two frames, of which it is missing in none: from its first reading on its steps are seen. */
TEST(test_a_step_after_an_admission_between_frames_is_left_out) {
  start();
  temperature.returned = ONE_BIT;
  expect_after_temperature(ALL);
  step_by(ONE, -17000);
  take_and_expect(ALL, ALL & ~ONE_BIT, 1);
}

/* What had lost its state and was reset for another's sake shows it by a step that it makes alone. */
TEST(test_a_step_alone_at_a_reset_is_reported) {
  for (int shared = 0; shared < 2; shared++) {
    setUp();
    start();
    step_by(ONE, 15e3);
    if (shared) {
      step_by(ONE + 1, 500);
    }
    temperature.returned = ALL;
    take_temperature();
    temperature.returned = 0;
    take_and_expect(ALL & ~1u, ALL & ~1u, 0); /* another is still missing */
    TEST_ASSERT_EQUAL_HEX32(shared ? 0 : ONE_BIT, frame.restored);
    take_pressures(ALL);
    TEST_ASSERT_EQUAL_HEX32(0, frame.restored);
  }
}

/* A temperature must vouch for what all have moved. It is asked for in time, so that they are doubtful only if it is late.
 * Whatever the others do, one that has moved farther than a pad warms makes a suspect. */
TEST(test_what_moves_between_two_temperatures_is_doubtful_until_the_next) {
  enum { ASKS = 1, MOVED = 2, LASTS = 4, SUSPECTS = 8 };
  static const struct {
    double step_Pa, warmer_degC;
    int is;
  } cases[] = {{130, 0, 0}, {250, 0, ASKS}, {300, 0.1, ASKS | MOVED}, {300, 0.18, 7}, {-300, 0.3, 15}, {0, -3, SUSPECTS}};
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    next_case();
    readings.frames = 0;
    for (int k = 0; k < SENSORS; k++) {
      step_by(k, cases[i].step_Pa);
      warm_by(k, cases[i].warmer_degC);
    }
    for (int frames = 0; frames < READINGS_MOVED_FRAMES; frames++) {
      TEST_ASSERT_FALSE(readings.asks && frames <= READINGS_ASK_FRAMES);
      take_pressures(ALL);
      TEST_ASSERT_EQUAL_HEX32(0, frame.doubtful);
    }
    TEST_ASSERT_EQUAL(cases[i].is & ASKS, readings.asks);
    take_pressures(ALL);
    TEST_ASSERT_EQUAL_HEX32(cases[i].is & MOVED ? ALL : 0, frame.doubtful & frame.unsettled);
    temperature.warmed_cC = 0;
    take_temperature();
    TEST_ASSERT_EQUAL((cases[i].is & LASTS) != 0, readings.moved);
    take_temperature();
    TEST_ASSERT_EQUAL_HEX32(cases[i].is & SUSPECTS ? ALL : 0, readings.suspects);
    temperature.returned = readings.suspects;
    take_temperature();
    take_pressures(ALL);
    TEST_ASSERT_EQUAL_HEX32(cases[i].is == SUSPECTS ? ALL : 0, frame.restored); /* the others had their state until they moved */
    take_pressures(ALL);
    TEST_ASSERT_EQUAL_HEX32(0, frame.restored);
  }
}

TEST(test_one_temperature_after_a_jolt_makes_a_suspect) {
  for (int jolts = 0; jolts < 2; jolts++) {
    next_case();
    step_by(ONE, 6.4e3 * jolts);
    step_by(ONE + 1, 6.4e3 * jolts);
    take_pressures(ALL);
    warm_by(ONE, 2);
    take_temperature();
    TEST_ASSERT_EQUAL_HEX32(jolts ? ONE_BIT : 0, readings.suspects);
  }
}

/* The others are held against what is in use, not against what came. */
TEST(test_most_temperatures_that_are_off_leave_the_others_trusted) {
  start();
  for (int k = 0; k < 8; k++) {
    warm_by(k, -16);
  }
  expect_after_temperature(ALL);
  TEST_ASSERT_EQUAL_HEX32(0xFF, frame.doubtful);
}

TEST(test_after_a_rest_temperatures_follow_each_other) {
  start();
  for (int frames = 0; frames < READINGS_FRAMES_MAX; frames++) {
    take_pressures(ALL);
  }
  for (int i = 0; i < 5; i++) {
    step_by(ONE, 3000);
    step_by(ONE + 1, 3000);
    take_pressures(ALL);
    TEST_ASSERT_EQUAL_HEX32(i < 4 ? ALL : 0, frame.doubtful);
    take_temperature();
  }
}

/* A supply that sags takes the temperature along, by less from one to the next than any step. */
TEST(test_a_temperature_that_moves_faster_than_a_pad_is_not_used) {
  start();
  temperature.warmed_cC = 5;
  for (int i = 0; i < 4; i++) {
    warm_by(ONE, 0.15);
    TEST_ASSERT_EQUAL(i > 1, (take_temperature() & READINGS_ASK_AGAIN) != 0);
  }
  TEST_ASSERT_EQUAL_HEX32(ONE_BIT, readings.suspects);
}

/* A temperature that is missing vouches for nothing; but not for ever. A code that stays the same is what it was. */
TEST(test_a_doubt_lasts_while_a_sensor_shows_no_life) {
  start();
  readings.jolted = true;
  temperature.good = ALL & ~ONE_BIT;
  for (int i = 0; i < 13; i++) {
    readings.still = i > 4 && i % 5 != 2 ? ONE_BIT : 0;
    take_pressures(ALL & ~(i == 8 ? ONE_BIT : 0));
    TEST_ASSERT_EQUAL_HEX32(i < 5 ? ALL : frame.valid & readings.still, frame.doubtful & frame.unsettled);
    TEST_ASSERT_EQUAL_HEX32(i < 4 ? READINGS_ASK_AGAIN : 0, i < 5 ? take_temperature() : 0);
  }
}

/* Always, and never without a step. */
TEST(test_steps_alone_amid_the_noise) {
  struct random random = {77};
  for (int i = 0; i < 6; i++) {
    next_case();
    frame.noise_Pa_q10 = ms58xx_find_osr((uint16_t)(256 << i))->noise_Pa_q10;
    const double noise_Pa = frame.noise_Pa_q10 / 1024.0;
    uint32_t rest[FT_MAX_SENSORS];
    memcpy(rest, d1, sizeof rest);
    for (int n = 0; n < 1000; n++) {
      for (int k = 0; k < SENSORS; k++) {
        d1[k] = rest[k];
        step_by(k, noise_Pa * random_normal(&random));
      }
      const uint32_t before = readings.left_out, steps = n % 10 == 9;
      step_by(ONE, 15e3 * steps);
      take_pressures(ALL);
      TEST_ASSERT_EQUAL_UINT32(before + steps, readings.left_out);
    }
    TEST_ASSERT_EQUAL_HEX32(0, readings.suspects);
  }
}

TEST(test_pressures_below_zero_are_left_out_and_the_second_makes_a_suspect) {
  start();
  step_by(ONE, -190e3);
  step_by(ONE + 1, 1000);
  take_and_expect(ALL, ALL & ~ONE_BIT, 1);
  step_by(ONE, 190e3);
  take_and_expect(ALL, ALL, 1);
  step_by(ONE, -190e3);
  step_by(ONE + 1, 1000);
  take_pressures(ALL);
  TEST_ASSERT_EQUAL_HEX32(0, readings.suspects);
  take_pressures(ALL & ~ONE_BIT);
  take_and_expect(ALL, ALL & ~ONE_BIT, 3);
  TEST_ASSERT_EQUAL_HEX32(ONE_BIT, readings.suspects);
}

TEST(test_a_temperature_step_needs_a_second_and_makes_a_suspect) {
  static const struct {
    double first_degC, second_degC;
    bool suspect;
  } cases[] = {{2, 2.1, true}, {-4, -4, true}, {2, -3, false}, {2, 4.5, false}, {-60, -60, true}, {20, 35, false}};
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    next_case();
    const uint32_t rest = d2[ONE];
    const double rest_Pa = true_Pa(ONE, rest);
    warm_by(ONE, cases[i].first_degC);
    TEST_ASSERT_EQUAL_HEX32(READINGS_ASK_AGAIN, take_temperature());
    take_and_expect(ALL, ALL, 0);
    TEST_ASSERT_EQUAL_HEX32(ONE_BIT, frame.doubtful);
    TEST_ASSERT_EQUAL_HEX32(ONE_BIT, frame.unsettled);
    TEST_ASSERT_DOUBLE_WITHIN(0.01, rest_Pa, frame.pressure_Pa_q10[ONE] / 1024.0);
    d2[ONE] = rest;
    warm_by(ONE, cases[i].second_degC);
    take_temperature();
    take_pressures(ALL);
    TEST_ASSERT_EQUAL_HEX32(cases[i].suspect ? ONE_BIT : 0, readings.suspects);
    TEST_ASSERT_EQUAL_HEX32(cases[i].suspect ? 0 : ONE_BIT, frame.doubtful);
    TEST_ASSERT_DOUBLE_WITHIN(0.01, cases[i].suspect ? 0.0 : rest_Pa, frame.pressure_Pa_q10[ONE] / 1024.0);
    d2[ONE] = rest;
    temperature.returned = readings.suspects;
    take_temperature();
    take_pressures(ALL);
    TEST_ASSERT_EQUAL_HEX32(cases[i].suspect ? ONE_BIT : 0, frame.restored); /* the others' zeros are as old as they were */
  }
}

/* Doubt for ever is asked about soon a few times, and then as ever. */
TEST(test_doubt_for_ever_is_not_asked_about_for_ever) {
  start();
  const uint32_t rest = d2[ONE];
  int asked = 0;
  for (int i = 0; i < 50; i++) {
    d2[ONE] = rest;
    warm_by(ONE, 10 + 2 * i);
    asked += (take_temperature() & READINGS_ASK_AGAIN) != 0;
    take_pressures(ALL);
    TEST_ASSERT_EQUAL_HEX32(ONE_BIT, frame.doubtful);
  }
  TEST_ASSERT_LESS_THAN_INT(6, asked);
  d2[ONE] = rest;
  TEST_ASSERT_EQUAL_HEX32(0, take_temperature());
  TEST_ASSERT_EQUAL_HEX32(0, readings.doubtful);
  warm_by(ONE, 10);
  TEST_ASSERT_EQUAL_HEX32(READINGS_ASK_AGAIN, take_temperature());
}

TEST(test_a_first_temperature_far_from_the_others_is_believed_after_two_resets) {
  warm_by(ONE, 12);
  TEST_ASSERT_EQUAL_HEX32(READINGS_MOVED | READINGS_ASK_AGAIN, take_temperature());
  for (int resets = 0; resets < 2; resets++) {
    take_temperature();
    TEST_ASSERT_EQUAL_HEX32(ONE_BIT, readings.suspects);
    temperature.returned = ONE_BIT;
    temperature.is_patient = resets == 1;
    take_temperature();
    TEST_ASSERT_EQUAL_HEX32(0, readings.suspects);
    take_and_expect(ALL, ALL & ~ONE_BIT, 0);
  }
  take_temperature();
  TEST_ASSERT_EQUAL_HEX32(0, readings.suspects);
  take_and_expect(ALL, ALL, 0);
  expect_after_temperature(ALL); /* also for what its new temperature changes */
  TEST_ASSERT_EQUAL_HEX32(ONE_BIT, frame.doubtful);
  TEST_ASSERT_EQUAL_HEX32(0, frame.unsettled);
  warm_by(ONE, -12);
  temperature.returned = ONE_BIT;
  expect_after_temperature(ALL);
  expect_after_temperature(ALL);
  TEST_ASSERT_EQUAL_HEX32(0, frame.doubtful);
}

static void look_again(double warmer_degC, uint32_t doubtful) {
  warm_by(ONE, warmer_degC);
  expect_after_temperature(ALL);
  TEST_ASSERT_EQUAL_HEX32(doubtful, frame.doubtful);
}

/* Until it has been like the others twice in a row. */
TEST(test_a_temperature_apart_from_the_start_is_doubtful) {
  look_again(3.0, ONE_BIT);
  look_again(-0.6, ONE_BIT);
  look_again(0, ONE_BIT);
  look_again(-0.7, ONE_BIT);
  look_again(-0.9, 0);
  look_again(0.95, ONE_BIT);
  look_again(-0.9, 0);
  look_again(0, 0);
  look_again(0.9, 0); /* something warm touches it */
  temperature.returned = ALL;
  look_again(0, 0);
  temperature.prom_changed = ONE_BIT;
  look_again(0, ONE_BIT);
}

TEST(test_a_temperature_at_which_no_sensor_works_is_never_used) {
  warm_by(ONE, 90);
  for (int i = 0; i < 10; i++) {
    expect_after_temperature(ALL & ~ONE_BIT);
    temperature.returned = readings.suspects;
  }
}

TEST(test_one_and_two_sensors_have_no_majority) {
  for (uint8_t count = 1; count <= 2; count++) {
    setUp();
    frame.sensor_count = count;
    temperature.good = temperature.admitted = temperature.returned = (1u << count) - 1;
    readings_take_temperature(&readings, count, &temperature);
    temperature.returned = 0;
    warm_by(0, 20);
    TEST_ASSERT_EQUAL_HEX32(READINGS_ASK_AGAIN, readings_take_temperature(&readings, count, &temperature));
    readings_take_temperature(&readings, count, &temperature);
    TEST_ASSERT_EQUAL_HEX32(1, readings.suspects);
  }
}

TEST(test_a_sensor_with_a_bad_prom_must_read_like_the_others) {
  static const struct {
    double apart_Pa;
    bool used;
  } cases[] = {{0, true}, {15e3, true}, {-15e3, true}, {30e3, false}, {-30e3, false}};
  for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
    setUp();
    temperature.prom_bad = ONE_BIT;
    step_by(ONE, cases[i].apart_Pa);
    for (int n = 0; n < 2; n++) {
      expect_after_temperature(ALL & ~ONE_BIT);
    }
    expect_after_temperature(cases[i].used ? ALL : ALL & ~ONE_BIT);
    TEST_ASSERT_EQUAL_HEX32(cases[i].used ? ONE_BIT : 0, frame.doubtful);
    TEST_ASSERT_EQUAL_HEX32(0, frame.unsettled);
    /* Once it did, presses do not matter. */
    for (int k = 0; k < SENSORS; k++) {
      step_by(k, k == ONE ? 40e3 : 8e3);
    }
    expect_after_temperature(cases[i].used ? ALL : ALL & ~ONE_BIT);
  }
}
