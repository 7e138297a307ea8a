#include "native/native_cdc.h"
#include "native/native_port.h"
#include "port/port.h"
#include "support/unit.h"

#include <string.h>

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
  native_cdc_reset();
  handled = rounds = 0;
  source_us = UINT64_MAX;
  port_set_event_handler(handler, &handled);
  native_set_event_source(next_us, &source_us);
}

void tearDown(void) { native_cdc_reset(); }

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
}

TEST(test_an_alarm_in_the_past_strikes_at_once) {
  native_run_until(1000, NULL, NULL);
  TEST_ASSERT_EQUAL_UINT(0, handled);
  port_alarm_at_us(10);
  native_run_until(1001, NULL, NULL);
  TEST_ASSERT_EQUAL_UINT(1, handled);
  TEST_ASSERT_EQUAL_UINT64(1000, handled_at_us[0]);
}

TEST(test_sleep_lasts_until_the_next_event) {
  port_alarm_at_us(250);
  port_sleep();
  TEST_ASSERT_EQUAL_UINT64(250, port_now_us());
  TEST_ASSERT_EQUAL_UINT(1, handled);
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
    port_alive(PORT_PART_USB);
  }
}

TEST(test_it_is_fed_in_vain_while_a_part_is_not_alive) {
  native_run_until(10 * PORT_WATCHDOG_PERIOD_us, alive_round, NULL);
  TEST_ASSERT_FALSE(native_watchdog_expired());
  native_run_until(13 * PORT_WATCHDOG_PERIOD_us, alive_round, NULL);
  TEST_ASSERT_TRUE(native_watchdog_expired());
}

static void to_loader(void *context) {
  (void)context;
  port_reboot_to_loader();
}

static void to_panic(void *context) {
  (void)context;
  port_panic();
}

TEST(test_ends_of_the_program) {
  TEST_ASSERT_EQUAL_INT(NATIVE_LOADER, native_run_until(1000, to_loader, NULL));
  TEST_ASSERT_EQUAL_INT(NATIVE_PANIC, native_run_until(1000, to_panic, NULL));
}

static const struct cdc_identity IDENTITY = {.product = "test"};

TEST(test_stream_to_the_host) {
  uint8_t received[8];
  cdc_start(&IDENTITY);
  TEST_ASSERT_EQUAL_PTR(&IDENTITY, native_cdc_identity());
  TEST_ASSERT_FALSE(cdc_is_open());
  TEST_ASSERT_EQUAL_INT(FT_OK, cdc_write((const uint8_t *)"lost", 4));
  native_cdc_open();
  TEST_ASSERT_TRUE(cdc_is_open());
  TEST_ASSERT_EQUAL_INT(FT_OK, cdc_write((const uint8_t *)"abcdef", 6));
  TEST_ASSERT_EQUAL_size_t(4, native_cdc_receive(received, 4));
  TEST_ASSERT_EQUAL_MEMORY("abcd", received, 4);
  TEST_ASSERT_EQUAL_size_t(2, native_cdc_receive(received, 8));
  TEST_ASSERT_EQUAL_MEMORY("ef", received, 2);
}

TEST(test_a_stalled_host_fills_the_queue) {
  uint8_t block[1000] = {0};
  cdc_start(&IDENTITY);
  native_cdc_open();
  native_cdc_stall(true);
  for (int n = 0; n < 4; n++) {
    TEST_ASSERT_EQUAL_INT(FT_OK, cdc_write(block, sizeof block));
  }
  TEST_ASSERT_EQUAL_INT(FT_ERR_SPACE, cdc_write(block, sizeof block));
  uint8_t received[NATIVE_CDC_TRANSMIT_BYTES];
  TEST_ASSERT_EQUAL_size_t(0, native_cdc_receive(received, sizeof received));
  native_cdc_stall(false);
  TEST_ASSERT_EQUAL_size_t(4000, native_cdc_receive(received, sizeof received));
  TEST_ASSERT_EQUAL_INT(FT_OK, cdc_write(block, sizeof block));
}

TEST(test_closing_loses_what_is_queued_and_is_counted) {
  uint8_t byte;
  cdc_start(&IDENTITY);
  native_cdc_open();
  native_cdc_stall(true);
  TEST_ASSERT_EQUAL_INT(FT_OK, cdc_write((const uint8_t *)"x", 1));
  native_cdc_close();
  TEST_ASSERT_EQUAL_UINT32(1, cdc_close_count());
  native_cdc_open();
  native_cdc_stall(false);
  TEST_ASSERT_EQUAL_size_t(0, native_cdc_receive(&byte, 1));
}

TEST(test_asleep_the_port_is_closed_and_it_wakes_up_open) {
  uint8_t bytes[8];
  cdc_start(&IDENTITY);
  native_cdc_open();
  native_cdc_stall(true);
  cdc_write((const uint8_t *)"lost", 4);
  const uint32_t news = cdc_news();
  native_cdc_suspend(true);
  native_cdc_suspend(true);
  TEST_ASSERT_TRUE(cdc_is_suspended());
  TEST_ASSERT_FALSE(cdc_is_open());
  TEST_ASSERT_EQUAL_UINT32(1, cdc_close_count());
  TEST_ASSERT_NOT_EQUAL_UINT32(news, cdc_news());
  native_cdc_suspend(false);
  native_cdc_stall(false);
  TEST_ASSERT_FALSE(cdc_is_suspended());
  TEST_ASSERT_TRUE(cdc_is_open());
  TEST_ASSERT_EQUAL_UINT32(1, cdc_close_count());
  TEST_ASSERT_EQUAL_size_t(0, native_cdc_receive(bytes, sizeof bytes));
}

TEST(test_stream_from_the_host) {
  uint8_t got[4];
  uint8_t much[NATIVE_CDC_RECEIVE_BYTES] = {0};
  cdc_start(&IDENTITY);
  native_cdc_open();
  TEST_ASSERT_EQUAL_INT(FT_OK, native_cdc_send((const uint8_t *)"hello", 5));
  TEST_ASSERT_EQUAL_INT(FT_ERR_SPACE, native_cdc_send(much, sizeof much));
  TEST_ASSERT_EQUAL_size_t(4, cdc_read(got, 4));
  TEST_ASSERT_EQUAL_MEMORY("hell", got, 4);
  TEST_ASSERT_EQUAL_size_t(1, cdc_read(got, 4));
  TEST_ASSERT_EQUAL_size_t(0, cdc_read(got, 4));
  TEST_ASSERT_FALSE(cdc_loader_requested());
  native_cdc_request_loader();
  TEST_ASSERT_TRUE(cdc_loader_requested());
}
