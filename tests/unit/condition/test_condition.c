#include "condition_bench.h"

#include <string.h>

TEST(test_gate_has_a_hysteresis_in_pascals_and_sigmas) {
  static const int32_t noises[] = {0, 16 * Pa / 10, 4 * Pa, 11 * Pa};
  for (size_t n = 0; n < sizeof noises / sizeof noises[0]; n++) {
    begin_idle(4854);
    frame.noise_Pa_q10 = noises[n];
    int32_t open = 132 * Pa + 6 * noises[n], close = 90 * Pa + 4 * noises[n];
    const struct {
      int32_t above;
      bool contact;
    } steps[] = {{open - 2 * Pa, false},  {open + 2 * Pa, true},  {close + 2 * Pa, true}, {close - 2 * Pa, false},
                 {close + 2 * Pa, false}, {open - 2 * Pa, false}, {2 * open, true},       {0, false}};
    for (size_t i = 0; i < sizeof steps / sizeof steps[0]; i++) {
      frame.pressure_Pa_q10[7] = condition.zero_Pa_q10[7] + steps[i].above;
      run(1);
      TEST_ASSERT_INT32_WITHIN(Pa, steps[i].above, conditioned.peak_Pa_q10);
      TEST_ASSERT_EQUAL(steps[i].contact, conditioned.contact);
      TEST_ASSERT_FALSE(conditioned.zero_doubtful && steps[i].above >= open);
    }
  }
}

TEST(test_invalid_sensors_are_left_out) {
  frame.valid = ALL & ~4u;
  frame.pressure_Pa_q10[2] = 0;
  run(17);
  TEST_ASSERT_TRUE(conditioned.tared);
  TEST_ASSERT_EQUAL_HEX32(ALL & ~4u, conditioned.usable);
  TEST_ASSERT_EQUAL_INT32(0, conditioned.pressure_Pa_q10[2]);
  /* It comes late: its own sixteen readings, while the others go on. */
  fill(AMBIENT);
  frame.valid = ALL;
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
  frame.pressure_Pa_q10[2] = 0;
  run(1000);
  frame.valid = ALL;
  frame.pressure_Pa_q10[2] = AMBIENT + 777;
  run(1);
  TEST_ASSERT_EQUAL_INT32(AMBIENT + 777, condition.zero_Pa_q10[2]);
}

TEST(test_unsettled_readings_move_no_zero) {
  begin_idle(4854);
  frame.doubtful = frame.unsettled = 1u << 7;
  frame.pressure_Pa_q10[7] += 100 * Pa;
  run_s(60);
  TEST_ASSERT_INT32_WITHIN(Pa, AMBIENT, condition.zero_Pa_q10[7]);
  frame.doubtful = frame.unsettled = 0;
  run_s(400);
  TEST_ASSERT_INT32_WITHIN(Pa, AMBIENT + 100 * Pa, condition.zero_Pa_q10[7]);
}

/* It is a press only where others measure it too: one that is broken must not stop the others. */
TEST(test_saturated_sensor_means_contact_and_is_left_out) {
  begin_idle(4854);
  frame.saturated = 8;
  frame.pressure_Pa_q10[3] = INT32_MAX;
  run_s(10);
  TEST_ASSERT_FALSE(conditioned.contact || conditioned.zero_doubtful);
  fill(AMBIENT + 1000 * Pa);
  frame.pressure_Pa_q10[3] = INT32_MAX;
  run(1);
  TEST_ASSERT_TRUE(conditioned.contact);
  TEST_ASSERT_EQUAL_HEX32(ALL & ~8u, conditioned.usable);
  TEST_ASSERT_EQUAL_INT32(0, conditioned.pressure_Pa_q10[3]);
  run_s(2);
  TEST_ASSERT_INT32_WITHIN(Pa, AMBIENT, condition.zero_Pa_q10[3]);
  /* What remains of it is that of a strong press. */
  frame.saturated = 0;
  fill(AMBIENT);
  frame.pressure_Pa_q10[3] = AMBIENT + 8000 * Pa;
  run_s(0.1f);
  TEST_ASSERT_TRUE(conditioned.zero_doubtful);
  /* Nor does it enter a tare. */
  condition_tare(&condition);
  frame.saturated = 8;
  run(17);
  TEST_ASSERT_EQUAL_HEX32(ALL & ~8u, conditioned.usable);
  frame.saturated = 0;
  fill(AMBIENT);
  run(17);
  TEST_ASSERT_EQUAL_INT32(AMBIENT, condition.zero_Pa_q10[3]);
}

TEST(test_gains_act_on_what_is_above_zero) {
  struct condition_gains gains;
  static const uint32_t inverses_q16[] = {16384, 50000, 65535, 65536, 65537, 80000, 131072, 262144};
  for (size_t i = 0; i < sizeof inverses_q16 / sizeof inverses_q16[0]; i++) {
    for (int k = 0; k < FT_MAX_SENSORS; k++) {
      gains.inverse_q16[k] = k == 7 ? inverses_q16[i] : 65536;
    }
    static const int32_t above[] = {0, 1, -1, 1023, -1025, 12345678, -98765432, 200000 * Pa, -90000 * Pa, 524288 * Pa - 1};
    for (size_t j = 0; j < sizeof above / sizeof above[0]; j++) {
      setUp();
      run(17);
      frame.pressure_Pa_q10[7] = AMBIENT + above[j];
      frame.pressure_Pa_q10[8] = AMBIENT + above[j];
      condition_frame(&condition, &frame, &gains, &conditioned);
      condition_follow(&condition, &frame, &conditioned);
      int64_t wanted = (int64_t)above[j] * inverses_q16[i];
      wanted = (wanted - (wanted & 0xFFFF)) / 65536;
      TEST_ASSERT_INT32_WITHIN(1, (int32_t)wanted, conditioned.pressure_Pa_q10[7]);
      TEST_ASSERT_EQUAL_INT32(above[j], conditioned.pressure_Pa_q10[8]);
      TEST_ASSERT_EQUAL_INT32(AMBIENT, condition.zero_Pa_q10[7]);
    }
    /* More is as much. */
    frame.pressure_Pa_q10[7] = INT32_MAX;
    int32_t most = conditioned.pressure_Pa_q10[7];
    condition_frame(&condition, &frame, &gains, &conditioned);
    TEST_ASSERT_EQUAL_INT32(most, conditioned.pressure_Pa_q10[7]);
  }
}

static void assert_condition_is(const struct condition *expected) { TEST_ASSERT_EQUAL_MEMORY(expected, &condition, sizeof condition); }

/* The zeros that an answer is sent with are those it was measured from. */
TEST(test_what_the_answer_does_not_need_can_wait) {
  struct condition before;
  begin_idle(1000);
  memcpy(&before, &condition, sizeof before);
  condition_follow(&condition, &frame, &conditioned);
  assert_condition_is(&before);
  press(20000 * Pa);
  int32_t reached = 0;
  for (int i = 0; i < 200; i++) {
    memcpy(&before, &condition, sizeof before);
    frame.t_us += period_us;
    condition_frame(&condition, &frame, NULL, &conditioned);
    TEST_ASSERT_TRUE(conditioned.contact && !conditioned.zero_doubtful);
    TEST_ASSERT_EQUAL_INT32_ARRAY(before.zero_Pa_q10, condition.zero_Pa_q10, SENSORS);
    TEST_ASSERT_EQUAL_MEMORY(before.sensor, condition.sensor, sizeof condition.sensor);
    condition_follow(&condition, &frame, &conditioned);
    if (condition.sensor[7].memory_Pa_q10 > reached) {
      reached = condition.sensor[7].memory_Pa_q10;
    }
    memcpy(&before, &condition, sizeof before);
    condition_follow(&condition, &frame, &conditioned);
    assert_condition_is(&before);
  }
  TEST_ASSERT_INT32_WITHIN(500 * Pa, 20000 * Pa, reached);
  for (int k = 0; k < SENSORS; k++) {
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(70, condition.now_ms - condition.sensor[k].updated_ms);
  }
}
