/* All of it together, as main's loop has it: frames are taken, packets written and read, while the
 * event interrupt ends conversions and USB's, of a higher priority, comes in main and in the middle
 * of that one. */
#include "explore.h"
#include "scan_side.h"
#include "unity.h"
#include "usb_host.h"

void setUp(void) {}
void tearDown(void) {}

static void loop(void) {
  explore_begin();
  scan_take_frame();
  usb_write();
  usb_read();
  scan_take_frame();
  explore_end();
  scan_judge();
  usb_take_all();
  usb_judge_session();
  usb_judge_reads();
}

static void test_usb_interrupts_main_and_the_event(void) {
  static const struct explore_interrupt interrupts[] = {
      {scan_finish_conversion, 1, 1}, {usb_take_packet, 2, 1}, {usb_bring_packet, 2, 1}};
  unsigned long points;
  usb_open_port();
  scan_start();
  scan_finish_conversion();
  usb_bring_packet();
  unsigned long runs = explore(loop, interrupts, 3, 2, &points);
  printf("all: up to 2 interrupts, nested, %lu runs, %lu points\n", runs, points);
  TEST_ASSERT_GREATER_THAN(10000, runs);
}

int main(void) {
  UNITY_BEGIN();
  RUN_TEST(test_usb_interrupts_main_and_the_event);
  return UNITY_END();
}
