/* The rings of the USB port: main writes and reads, the controller's interrupts take and bring
 * packets, close the port and open it. */
#include "explore.h"
#include "unity.h"
#include "usb_host.h"

void setUp(void) {}
void tearDown(void) {}

static void write_some(void) {
  explore_begin();
  usb_write();
  usb_write();
  explore_end();
  usb_take_all();
  usb_judge_session();
}

static void read_some(void) {
  explore_begin();
  for (int i = 0; i < 3; i++) {
    usb_read();
  }
  explore_end();
  usb_judge_reads();
}

static void tell(const char *what, unsigned most, unsigned long runs, unsigned long points) {
  printf("%s: up to %u interrupts, %lu runs, %lu points\n", what, most, runs, points);
}

static void test_what_main_writes_is_whole(void) {
  static const struct explore_interrupt interrupts[] = {{usb_take_packet, 1, 3}, {usb_reopen, 1, 2}};
  unsigned long points;
  usb_open_port();
  unsigned long runs = explore(write_some, interrupts, 2, 3, &points);
  tell("writing", 3, runs, points);
  TEST_ASSERT_GREATER_THAN(10000, runs);
}

static void test_what_main_reads_is_whole(void) {
  static const struct explore_interrupt interrupts[] = {{usb_bring_packet, 1, 4}};
  unsigned long points;
  usb_open_port();
  for (int i = 0; i < 4; i++) {
    usb_bring_packet(); /* the ring is full */
  }
  unsigned long runs = explore(read_some, interrupts, 1, 4, &points);
  tell("reading", 4, runs, points);
  TEST_ASSERT_GREATER_THAN(10000, runs);
}

int main(void) {
  UNITY_BEGIN();
  RUN_TEST(test_what_main_writes_is_whole);
  RUN_TEST(test_what_main_reads_is_whole);
  return UNITY_END();
}
