/* The slots between the scan, which runs in the event interrupt, and the main loop that takes
 * frames. */
#include "explore.h"
#include "scan_side.h"
#include "unity.h"

enum { TAKES = 4 };

void setUp(void) {}
void tearDown(void) {}

static void take_frames(void) {
  explore_begin();
  for (int i = 0; i < TAKES; i++) {
    scan_take_frame();
  }
  explore_end();
  scan_judge();
}

static void explore_from_here(const char *what, unsigned most) {
  static const struct explore_interrupt interrupts[] = {{scan_finish_conversion, 1, 4},
                                                        {scan_finish_before_temperature, 1, 2}};
  unsigned long points;
  unsigned long runs = explore(take_frames, interrupts, 2, most, &points);
  printf("%s: up to %u interrupts, %lu runs, %lu points\n", what, most, runs, points);
  TEST_ASSERT_GREATER_THAN(1000, runs);
}

static void test_frames_are_whole_from_an_empty_slot(void) {
  scan_start();
  explore_from_here("empty", 3);
}

static void test_frames_are_whole_when_one_waits(void) {
  scan_start();
  scan_finish_conversion();
  explore_from_here("one waits", 3);
}

static void test_frames_are_whole_when_a_temperature_waits_too(void) {
  scan_start();
  scan_finish_before_temperature();
  scan_finish_conversion();
  scan_finish_conversion();
  explore_from_here("both wait", 2);
}

int main(void) {
  UNITY_BEGIN();
  RUN_TEST(test_frames_are_whole_from_an_empty_slot);
  RUN_TEST(test_frames_are_whole_when_one_waits);
  RUN_TEST(test_frames_are_whole_when_a_temperature_waits_too);
  return UNITY_END();
}
