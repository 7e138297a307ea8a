#include "condition_bench.h"

/* Where a strong press was meanwhile, it may be what remains of that. */
TEST(test_a_weak_contact_that_outlasts_a_strong_one_is_in_doubt) {
  for (size_t i = 0; i < FAST_PERIODS; i++) {
    begin_idle(periods_us[i]);
    frame.pressure_Pa_q10[3] += 3000 * Pa;
    watch_s(60, 0, 0);
    TEST_ASSERT_EQUAL_FLOAT(contact_s, unflagged_s);
    frame.pressure_Pa_q10[11] += 30000 * Pa;
    watch_s(5, 0, 0);
    TEST_ASSERT_EQUAL_FLOAT(contact_s, unflagged_s);
    frame.pressure_Pa_q10[11] -= 30000 * Pa;
    watch_s(120, 0, 0);
    TEST_ASSERT_FLOAT_WITHIN(0.5f, 120, contact_s);
    TEST_ASSERT_EQUAL_FLOAT(0, unflagged_s);
    frame.pressure_Pa_q10[3] += 3000 * Pa;
    watch_s(5, 0, 0);
    TEST_ASSERT_EQUAL_FLOAT(contact_s, unflagged_s);
  }
}

/* No release leaves a sensor so far below its zero. */
TEST(test_a_contact_beside_a_sensor_far_below_its_zero_is_in_doubt) {
  begin_idle(periods_us[0]);
  press(20000 * Pa);
  run_s(1);
  frame.pressure_Pa_q10[14] -= 4500 * Pa;
  run(1);
  TEST_ASSERT_FALSE(conditioned.zero_doubtful);
  frame.pressure_Pa_q10[14] -= 1000 * Pa;
  run(1);
  TEST_ASSERT_TRUE(conditioned.zero_doubtful);
}

static void press_in_steps(int32_t from, int32_t to, float seconds, float then_s) {
  int count = frames_in(seconds);
  for (int i = 1; i <= count; i++) {
    press(from + (to - from) / count * i);
    run(1);
  }
  run_s(then_s);
}

/* Held, a touch that the band lets in part into the zero comes out of the band: what the zero took
 * stays in doubt, and a strong press on it is none. */
TEST(test_a_touch_that_a_zero_took_part_of_stays_in_doubt) {
  for (size_t i = 0; i < FAST_PERIODS; i++) {
    begin_idle(periods_us[i]);
    press_in_steps(0, 47000 * Pa, 0.2f, 4);
    press_in_steps(47000 * Pa, 0, 0.1f, 1.2f);
    press_in_steps(0, 5100 * Pa, 0.15f, 0);
    watch_s(0.7f, 0, 0);
    TEST_ASSERT_EQUAL_FLOAT(0, unflagged_s);
    watch_s(6, 0, 0);
    TEST_ASSERT_TRUE(conditioned.contact);
    TEST_ASSERT_LESS_THAN_INT32(4200 * Pa, conditioned.peak_Pa_q10);
    TEST_ASSERT_EQUAL_FLOAT(0, unflagged_s);
    press_in_steps(5100 * Pa, 15000 * Pa, 0.2f, 1);
    TEST_ASSERT_TRUE(conditioned.zero_doubtful);
    press_in_steps(15000 * Pa, 47000 * Pa, 0.2f, 1);
    TEST_ASSERT_FALSE(conditioned.zero_doubtful);
    press_in_steps(47000 * Pa, 5100 * Pa, 0.2f, 0.1f);
    TEST_ASSERT_TRUE(conditioned.zero_doubtful);
    hold(0, 5);
    press_in_steps(0, 20000 * Pa, 0.1f, 1);
    TEST_ASSERT_FALSE(conditioned.zero_doubtful);
  }
}

/* What the end of a release feels is no remainder. */
TEST(test_presses_in_quick_succession_move_no_zero) {
  static const float falls_s[] = {0.05f, 0.1f, 0.2f, 0.4f};
  for (size_t i = 0; i < FAST_PERIODS; i++) {
    for (size_t j = 0; j < sizeof falls_s / sizeof falls_s[0]; j++) {
      begin_idle(periods_us[i]);
      int32_t worst = 0;
      for (int touches = 0; touches < 10; touches++) {
        press_in_steps(0, 20000 * Pa, 0.1f, 0.2f);
        press_in_steps(20000 * Pa, 0, falls_s[j], 0.1f);
        int32_t off = condition.zero_Pa_q10[7] - AMBIENT;
        worst = off > worst ? off : worst;
      }
      TEST_ASSERT_LESS_THAN_INT32(20 * Pa, worst);
    }
  }
}

/* Sensors that felt nothing stand off by a share of what others felt. */
TEST(test_far_sensors_stand_off_too) {
  begin_idle(4854);
  frame.pressure_Pa_q10[7] = AMBIENT + 20000 * Pa;
  run_s(5);
  fill(AMBIENT);
  frame.pressure_Pa_q10[12] = AMBIENT + 1400 * Pa;
  watch_s(60, 0, 0);
  TEST_ASSERT_EQUAL_FLOAT(0, unflagged_s);
  TEST_ASSERT_FALSE(conditioned.contact);
}

/* A contact that is no stronger than the drift of its time is in doubt, and followed slowly. */
TEST(test_weak_contact_for_long_is_in_doubt) {
  begin_idle(17544);
  frame.pressure_Pa_q10[7] += 300 * Pa;
  watch_s(600, 0, 0);
  TEST_ASSERT_EQUAL_FLOAT(contact_s, unflagged_s);
  run_s(900);
  TEST_ASSERT_TRUE(conditioned.contact);
  TEST_ASSERT_TRUE(conditioned.zero_doubtful);
  run_s(1000);
  TEST_ASSERT_FALSE(conditioned.contact);
  TEST_ASSERT_INT32_WITHIN(Pa, AMBIENT + 300 * Pa, condition.zero_Pa_q10[7]);
}

/* A zero that wanders makes a weak contact on it doubtful. */
TEST(test_contact_on_a_wandering_zero_is_in_doubt) {
  for (int wanders = 0; wanders <= 1; wanders++) {
    begin_idle(17544);
    for (int i = 0; i < 3; i++) {
      frame.pressure_Pa_q10[7] += 20000 * Pa;
      run_s(5);
      frame.pressure_Pa_q10[7] -= (wanders ? 19700 : 20000) * Pa;
      run_s(15);
    }
    run_s(60);
    frame.pressure_Pa_q10[7] += 350 * Pa;
    run(1);
    TEST_ASSERT_TRUE(conditioned.contact);
    TEST_ASSERT_EQUAL(wanders, conditioned.zero_doubtful);
    run_s(1);
    TEST_ASSERT_TRUE(conditioned.contact);
    TEST_ASSERT_EQUAL(wanders, conditioned.zero_doubtful);
  }
}

/* Some real sensors creep by 10 Pa/s for minutes: more than the zero may follow. */
TEST(test_what_crept_up_is_in_doubt_and_what_is_sudden_is_not) {
  for (int p = 0; p < FAST_PERIODS; p++) {
    begin_idle(periods_us[p]);
    watch_s(60, 10.0f, 1 << 3);
    TEST_ASSERT_GREATER_THAN(30.0f, contact_s);
    TEST_ASSERT_FLOAT_WITHIN(0.5f, 0.0f, unflagged_s);
    watch_s(60, 0.0f, 0);
    TEST_ASSERT_TRUE(conditioned.contact);
    TEST_ASSERT_FLOAT_WITHIN(0.5f, 0.0f, unflagged_s);
    int32_t crept = frame.pressure_Pa_q10[3];
    press(3000 * 1024);
    frame.pressure_Pa_q10[3] += crept - AMBIENT;
    run_s(0.2f);
    TEST_ASSERT_TRUE(conditioned.contact);
    run_s((float)SENSORS * 0.064f);
    TEST_ASSERT_FALSE(conditioned.zero_doubtful);

    begin_idle(periods_us[p]);
    watch_s(30, 100.0f, 1 << 7); /* 0.02 N/s on 12 mm of rubber */
    TEST_ASSERT_GREATER_THAN(25.0f, contact_s);
    TEST_ASSERT_FLOAT_WITHIN(1.5f, 0.0f, unflagged_s - contact_s);
    TEST_ASSERT_FALSE(conditioned.zero_doubtful);
  }
}

/* A zero taken under a press would be off by it. Wrong zeros may make a contact, so the wait has an end. */
TEST(test_one_sensor_is_not_tared_in_a_contact_unless_that_lasts) {
  for (int lasts = 0; lasts < 2; lasts++) {
    begin_idle(4854);
    hold(20000 * Pa, 0.5f);
    frame.renewed = 1u << 8;
    run(1);
    frame.renewed = 0;
    run_s(lasts ? 9.5f : 5);
    TEST_ASSERT_EQUAL_HEX32(lasts ? ALL : ALL & ~(1u << 8), conditioned.usable);
    TEST_ASSERT_TRUE(conditioned.contact);
    if (lasts) {
      watch_s(5, 0, 0);
      TEST_ASSERT_TRUE(conditioned.contact);
      TEST_ASSERT_EQUAL_FLOAT(0, unflagged_s);
    } else {
      TEST_ASSERT_FALSE(conditioned.tared);
    }
    press(0);
    run(2 + ZERO_TARE_FRAMES);
    TEST_ASSERT_EQUAL_HEX32(ALL, conditioned.usable);
    TEST_ASSERT_EQUAL_INT32(AMBIENT, condition.zero_Pa_q10[8]);
    TEST_ASSERT_TRUE(lasts || conditioned.tared);
    hold(20000 * Pa, 0.5f);
    TEST_ASSERT_TRUE(conditioned.tared);
    TEST_ASSERT_FALSE(conditioned.zero_doubtful);
  }
}
