/* Which part of the firmware the watchdog does not wait for: boards/rp2040/progress.h. */
#include "rp2040/progress.h"
#include "support/unit.h"

enum { LIMIT_us = 400000 };

TEST(a_part_is_overdue_after_its_limit) {
  static const uint32_t begins_us[] = {0, 1000000, UINT32_MAX - 1000, UINT32_MAX};
  for (unsigned i = 0; i < 4; i++) {
    TEST_ASSERT_FALSE(is_overdue(begins_us[i], begins_us[i], LIMIT_us));
    TEST_ASSERT_FALSE(is_overdue(begins_us[i] + LIMIT_us, begins_us[i], LIMIT_us));
    TEST_ASSERT_TRUE(is_overdue(begins_us[i] + LIMIT_us + 1, begins_us[i], LIMIT_us));
  }
}

TEST(progress_in_an_interrupt_after_the_time_was_read_counts) {
  TEST_ASSERT_FALSE(is_overdue(1000000, 1000001, LIMIT_us));
  TEST_ASSERT_FALSE(is_overdue(UINT32_MAX, 3, LIMIT_us));
}
