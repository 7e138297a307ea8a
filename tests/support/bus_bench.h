/* Operations of an array bus, polled as the event handler does: at every event and alarm. Whoever includes it defines NOW_us before. */
#pragma once

#include "array_bus/array_bus.h"
#include "support/unit.h"

static struct array_bus bus;
static struct array_bus_result result;
static unsigned polls;

/* Time passes until this wake-up or an event, whichever comes first. */
static void sleep_until(uint64_t wake_us);

/* No operation takes 20 ms. */
static enum ft_status finish(void) {
  const uint64_t give_up_us = NOW_us + 20000;
  for (;;) {
    uint64_t wake_us = 0;
    polls++;
    const enum ft_status status = bus.poll(bus.context, NOW_us, &result, &wake_us);
    if (status != FT_PENDING) {
      return status;
    }
    TEST_ASSERT_TRUE_MESSAGE(wake_us > NOW_us, "asks to be woken in the past");
    sleep_until(wake_us);
    TEST_ASSERT_TRUE_MESSAGE(NOW_us < give_up_us, "the operation does not end");
  }
}

static enum ft_status command(uint8_t byte) {
  TEST_ASSERT_EQUAL_INT(FT_OK, bus.start_command(bus.context, byte, NOW_us));
  return finish();
}

static enum ft_status read_back(uint8_t byte, uint8_t count) {
  TEST_ASSERT_EQUAL_INT(FT_OK, bus.start_read(bus.context, byte, count, NOW_us));
  return finish();
}

static enum ft_status recover(void) {
  TEST_ASSERT_EQUAL_INT(FT_OK, bus.start_recovery(bus.context, NOW_us));
  return finish();
}

TEST(test_arguments_and_order_of_calls) {
  uint64_t wake_us;
  TEST_ASSERT_EQUAL_INT(FT_ERR_ARGUMENT, bus.poll(bus.context, NOW_us, &result, &wake_us));
  TEST_ASSERT_EQUAL_INT(FT_ERR_ARGUMENT, bus.start_read(bus.context, 0, 0, NOW_us));
  TEST_ASSERT_EQUAL_INT(FT_ERR_ARGUMENT, bus.start_read(bus.context, 0, 4, NOW_us));
  TEST_ASSERT_EQUAL_INT(FT_OK, bus.start_command(bus.context, 0x40, NOW_us));
  TEST_ASSERT_EQUAL_INT(FT_ERR_BUSY, bus.start_command(bus.context, 0x40, NOW_us));
  TEST_ASSERT_EQUAL_INT(FT_ERR_BUSY, bus.start_read(bus.context, 0, 3, NOW_us));
  TEST_ASSERT_EQUAL_INT(FT_OK, finish());
  TEST_ASSERT_EQUAL_INT(FT_ERR_ARGUMENT, bus.poll(bus.context, NOW_us, &result, &wake_us));
}
