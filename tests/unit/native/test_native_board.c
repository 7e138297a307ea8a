#include "native/native_port.h"
#include "port/port.h"
#include "support/unit.h"

static unsigned handled, rounds;
static uint64_t handled_at_us[8];
static uint64_t source_us;

static void handler(void *context) {
  TEST_ASSERT_EQUAL_PTR(&handled, context);
  if (handled < 8) {
    handled_at_us[handled] = port_now_us();
  }
  handled++;
  if (source_us <= port_now_us()) {
    source_us = UINT64_MAX;
  }
}

static void round_of_main(void *context) {
  (void)context;
  rounds++;
  port_sleep();
}

static uint64_t next_us(const void *context) { return *(const uint64_t *)context; }

void setUp(void) {
  native_start(false);
  handled = rounds = 0;
  source_us = UINT64_MAX;
  port_set_event_handler(handler, &handled);
  native_set_event_source(next_us, &source_us);
}

TEST(test_time_passes_from_event_to_event) {
  port_alarm_at_us(700);
  source_us = 300;
  TEST_ASSERT_EQUAL_INT(NATIVE_TIME_UP, native_run_until(600, round_of_main, NULL));
  TEST_ASSERT_EQUAL_UINT64(600, port_now_us());
  TEST_ASSERT_EQUAL_UINT(2, rounds);
  TEST_ASSERT_EQUAL_INT(NATIVE_TIME_UP, native_run_until(700, round_of_main, NULL));
  TEST_ASSERT_EQUAL_UINT64(700, port_now_us());
  TEST_ASSERT_EQUAL_UINT(2, handled);
  TEST_ASSERT_EQUAL_UINT64(300, handled_at_us[0]);
  TEST_ASSERT_EQUAL_UINT64(700, handled_at_us[1]);
  TEST_ASSERT_EQUAL_UINT(3, rounds);
}

TEST(test_an_alarm_strikes_once_and_a_new_one_replaces_it) {
  port_alarm_at_us(100);
  port_alarm_at_us(200);
  native_run_until(1000, NULL, NULL);
  TEST_ASSERT_EQUAL_UINT(1, handled);
  TEST_ASSERT_EQUAL_UINT64(200, handled_at_us[0]);
  port_alarm_at_us(10); /* at once */
  native_run_until(1001, NULL, NULL);
  TEST_ASSERT_EQUAL_UINT(2, handled);
  TEST_ASSERT_EQUAL_UINT64(1000, handled_at_us[1]);
}

static void fed_round(void *context) {
  (void)context;
  port_watchdog_feed();
  port_alarm_at_us(port_now_us() + PORT_WATCHDOG_PERIOD_us / 2);
  port_sleep();
}

TEST(test_the_watchdog_strikes_if_it_is_not_fed) {
  native_run_until(5 * PORT_WATCHDOG_PERIOD_us, fed_round, NULL);
  TEST_ASSERT_FALSE(native_watchdog_expired());
  native_run_until(7 * PORT_WATCHDOG_PERIOD_us, NULL, NULL);
  TEST_ASSERT_TRUE(native_watchdog_expired());
}

static void alive_round(void *context) {
  fed_round(context);
  if (port_now_us() < 10 * PORT_WATCHDOG_PERIOD_us) {
    port_report_alive(PORT_PART_USB);
  }
}

TEST(test_it_is_fed_in_vain_while_a_part_is_not_alive) {
  native_run_until(10 * PORT_WATCHDOG_PERIOD_us, alive_round, NULL);
  TEST_ASSERT_FALSE(native_watchdog_expired());
  native_run_until(13 * PORT_WATCHDOG_PERIOD_us, alive_round, NULL);
  TEST_ASSERT_TRUE(native_watchdog_expired());
}

static void to_panic(void *context) {
  (void)context;
  port_panic();
}

TEST(test_a_panic_ends_the_program) { TEST_ASSERT_EQUAL_INT(NATIVE_PANIC, native_run_until(1000, to_panic, NULL)); }
