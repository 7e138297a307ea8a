/* A sensor that reads apart from the others at rest is known from the first frame on, and no press changes that. */
#include "condition/plausibility.h"
#include "support/unit.h"

#include <string.h>

enum { SENSORS = 15, ALL = (1 << SENSORS) - 1, ODD = 4 };

static struct plausibility plausibility;
static struct frame frame;
static struct conditioned conditioned;

static void read_all(int32_t pressure_Pa) {
  for (int k = 0; k < SENSORS; k++) {
    frame.pressure_Pa_q10[k] = (pressure_Pa + 10 * (k % 3)) * 1024;
  }
}

static void next_frame(uint64_t later_us) {
  frame.t_us += later_us;
  plausibility_follow(&plausibility, &frame, &conditioned);
}

static void expect_next(uint64_t later_us, uint32_t apart) {
  next_frame(later_us);
  TEST_ASSERT_EQUAL_HEX32(apart, plausibility.apart);
}

void setUp(void) {
  plausibility = (struct plausibility){.apart_Pa = 1000};
  memset(&conditioned, 0, sizeof conditioned);
  frame = (struct frame){.t_us = 1000, .sensor_count = SENSORS, .valid = ALL};
  conditioned.usable = ALL;
  read_all(100000);
}

TEST(test_one_apart_is_known_from_the_first_frame_on) {
  frame.pressure_Pa_q10[ODD] += 1200 * 1024;
  expect_next(0, 1u << ODD);
  frame.pressure_Pa_q10[ODD] -= 2400 * 1024;
  expect_next(2000000, 1u << ODD);
  read_all(25000); /* no air has that */
  frame.unsettled = 1u << ODD;
  expect_next(2000000, 1u << ODD);
  frame.unsettled = 0;
  expect_next(2000000, ALL);
}

TEST(test_moulded_sensors_that_differ_by_kilopascals_are_not_apart) {
  for (int k = 0; k < SENSORS; k++) {
    frame.pressure_Pa_q10[k] += 1500 * (k % 4) * 1024;
  }
  frame.pressure_Pa_q10[ODD] += 10700 * 1024;
  expect_next(0, 0);
  frame.pressure_Pa_q10[ODD] += 10000 * 1024;
  expect_next(2000000, 1u << ODD);
}

TEST(test_a_press_changes_nothing) {
  frame.pressure_Pa_q10[ODD] += 5000 * 1024;
  next_frame(0);
  conditioned.contact = true;
  conditioned.peak_Pa_q10 = 30000 * 1024;
  frame.pressure_Pa_q10[1] += 30000 * 1024;
  frame.saturated = 1;
  conditioned.usable = ALL & ~1;
  expect_next(3000000, 1u << ODD);
}

TEST(test_comparisons_are_rare_unless_others_are_used) {
  expect_next(0, 0);
  frame.pressure_Pa_q10[ODD] += 5000 * 1024;
  expect_next(1000, 0);
  conditioned.usable = ALL & ~1;
  expect_next(1000, 1u << ODD);
}

TEST(test_few_sensors_cannot_tell) {
  conditioned.usable = 7 << ODD;
  frame.pressure_Pa_q10[ODD] += 5000 * 1024;
  expect_next(0, 0);
}
