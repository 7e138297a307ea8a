/* The serial port: line state, and the two byte streams. */
#include "enumerate.h"
#include "fake_controller.h"
#include "support/unit.h"
#include "usb/cdc.h"

#include <string.h>

enum { QUEUE_BYTES = 4096 };

static uint8_t packet[64];
static uint8_t bytes[QUEUE_BYTES + 256];
static uint8_t got[QUEUE_BYTES + 256];

void setUp(void) {
  for (size_t i = 0; i < sizeof bytes; i++)
    bytes[i] = (uint8_t)(i * 7 + i / 256);
  plug_in();
  enumerate();
}

/* Reads as cdc_acm does: a transfer of 128 bytes ends when full or with a short packet. Returns its
 * bytes, or -1 if it does not end, with what has come so far in *so_far. */
static int read_transfer(uint8_t *to, int *so_far) {
  int total = 0;
  while (total < 128) {
    int n = host_in(0x82, packet);
    if (n == HOST_NAK) {
      *so_far = total;
      return -1;
    }
    TEST_ASSERT_LESS_OR_EQUAL(64, n);
    TEST_ASSERT_GREATER_OR_EQUAL(0, n);
    memcpy(to + total, packet, (size_t)n);
    total += n;
    if (n < 64)
      break;
  }
  return total;
}

/* Whatever is written arrives at once, whole, whatever its length. */
TEST(test_every_length_arrives_without_waiting_for_more) {
  open_port();
  for (size_t length = 1; length <= 300; length++) {
    TEST_ASSERT_EQUAL(FT_OK, cdc_write(bytes + length, length));
    size_t total = 0;
    int so_far = 0;
    for (int n = read_transfer(got, &so_far); n >= 0; n = read_transfer(got + total, &so_far))
      total += (size_t)n;
    TEST_ASSERT_EQUAL_MESSAGE(0, so_far, "bytes wait in an unfinished transfer of the host");
    TEST_ASSERT_EQUAL(length, total);
    TEST_ASSERT_EQUAL_MEMORY(bytes + length, got, length);
  }
}

TEST(test_write_takes_all_or_nothing) {
  open_port();
  TEST_ASSERT_EQUAL(FT_ERR_ARGUMENT, cdc_write(bytes, QUEUE_BYTES + 1));
  TEST_ASSERT_EQUAL(FT_OK, cdc_write(bytes, QUEUE_BYTES - 100));
  TEST_ASSERT_EQUAL(FT_OK, cdc_write(bytes + QUEUE_BYTES - 100, 164)); /* 64 are on their way */
  TEST_ASSERT_EQUAL(FT_ERR_SPACE, cdc_write(bytes, 1));
  TEST_ASSERT_EQUAL(64, host_in(0x82, got));
  TEST_ASSERT_EQUAL(FT_ERR_SPACE, cdc_write(bytes, 65));
  TEST_ASSERT_EQUAL(FT_OK, cdc_write((const uint8_t *)"!", 1));
  size_t total = 64;
  for (int n; (n = host_in(0x82, packet)) >= 0; total += (size_t)n) {
    TEST_ASSERT_LESS_OR_EQUAL(sizeof got, total + (size_t)n);
    memcpy(got + total, packet, (size_t)n);
  }
  TEST_ASSERT_EQUAL(QUEUE_BYTES + 64 + 1, total);
  TEST_ASSERT_EQUAL_MEMORY(bytes, got, QUEUE_BYTES + 64);
  TEST_ASSERT_EQUAL('!', got[QUEUE_BYTES + 64]);
}

TEST(test_closed_port_swallows_writes) {
  fake_hold_interrupts();
  TEST_ASSERT_EQUAL(FT_OK, cdc_write(bytes, QUEUE_BYTES));
  TEST_ASSERT_EQUAL(FT_OK, cdc_write(bytes, QUEUE_BYTES));
  fake_run_interrupts();
  TEST_ASSERT_EQUAL(HOST_NAK, host_in(0x82, packet));
  set_dtr(1);
  TEST_ASSERT_EQUAL(HOST_NAK, host_in(0x82, packet));
}

TEST(test_close_discards_what_waits) {
  open_port();
  uint32_t closes = cdc_close_count();
  TEST_ASSERT_EQUAL(FT_OK, cdc_write(bytes, 64));
  set_dtr(0);
  TEST_ASSERT_EQUAL(closes + 1, cdc_close_count());
  set_dtr(0);
  TEST_ASSERT_EQUAL(closes + 1, cdc_close_count());
  TEST_ASSERT_EQUAL(HOST_NAK, host_in(0x82, packet));
  set_dtr(1);
  TEST_ASSERT_EQUAL(FT_OK, cdc_write(bytes, 0));
  TEST_ASSERT_EQUAL(HOST_NAK, host_in(0x82, packet));
  TEST_ASSERT_EQUAL(FT_OK, cdc_write((const uint8_t *)"new", 3));
  TEST_ASSERT_EQUAL(7, host_in(0x82, packet));
  TEST_ASSERT_EQUAL_MEMORY("\0\0\0\0new", packet, 7);
  TEST_ASSERT_EQUAL(HOST_NAK, host_in(0x82, packet));
}

TEST(test_close_drops_what_was_not_read) {
  open_port();
  TEST_ASSERT_EQUAL(0, host_out(2, (const uint8_t *)"old", 3));
  set_dtr(0);
  set_dtr(1);
  TEST_ASSERT_EQUAL(0, host_out(2, (const uint8_t *)"new", 3));
  TEST_ASSERT_EQUAL(3, cdc_read(got, sizeof got));
  TEST_ASSERT_EQUAL_MEMORY("new", got, 3);
}

TEST(test_suspended_port_is_closed) {
  set_dtr(1);
  uint32_t closes = cdc_close_count();
  TEST_ASSERT_EQUAL(FT_OK, cdc_write(bytes, 100));
  host_suspend();
  TEST_ASSERT_FALSE(cdc_is_open());
  TEST_ASSERT_EQUAL(closes + 1, cdc_close_count());
  host_resume();
  TEST_ASSERT_TRUE(cdc_is_open());
  TEST_ASSERT_EQUAL(HOST_NAK, host_in(0x82, packet));
  host_suspend();
  host_bus_reset();
  TEST_ASSERT_FALSE(cdc_is_open());
  TEST_ASSERT_EQUAL(closes + 2, cdc_close_count());
  enumerate();
  set_dtr(1);
  TEST_ASSERT_TRUE(cdc_is_open());
  enumerate();
  host_suspend();
  host_resume();
  TEST_ASSERT_FALSE(cdc_is_open());
}

TEST(test_halt_keeps_the_packet_that_the_host_has_not_got) {
  open_port();
  TEST_ASSERT_EQUAL(FT_OK, cdc_write(bytes, 80));
  TEST_ASSERT_EQUAL(0, host_control_out(0x02, 3, 0, 0x82, NULL, 0));
  TEST_ASSERT_EQUAL(HOST_STALL, host_in(0x82, packet));
  TEST_ASSERT_EQUAL(FT_OK, cdc_write(bytes + 80, 10));
  TEST_ASSERT_EQUAL(HOST_STALL, host_in(0x82, packet));
  TEST_ASSERT_EQUAL(0, host_control_out(0x02, 1, 0, 0x82, NULL, 0));
  host_reset_toggle(0x82);
  TEST_ASSERT_EQUAL(64, host_in(0x82, got));
  TEST_ASSERT_EQUAL(26, host_in(0x82, got + 64));
  TEST_ASSERT_EQUAL_MEMORY(bytes, got, 90);
}

TEST(test_halt_does_not_repeat_a_packet_that_the_host_has_got) {
  open_port();
  TEST_ASSERT_EQUAL(FT_OK, cdc_write(bytes, 80));
  fake_take_at_next_withdrawal();
  TEST_ASSERT_EQUAL(0, host_control_out(0x02, 1, 0, 0x82, NULL, 0));
  host_reset_toggle(0x82);
  TEST_ASSERT_EQUAL(16, host_in(0x82, packet));
  TEST_ASSERT_EQUAL_MEMORY(bytes + 64, packet, 16);
}

TEST(test_host_waits_while_nobody_reads) {
  for (int i = 0; i < 4; i++)
    TEST_ASSERT_EQUAL(0, host_out(0x02, bytes + 64 * i, 64));
  TEST_ASSERT_EQUAL(HOST_NAK, host_out(0x02, "x", 1));
  TEST_ASSERT_EQUAL(63, cdc_read(got, 63));
  TEST_ASSERT_EQUAL(HOST_NAK, host_out(0x02, "x", 1));
  TEST_ASSERT_EQUAL(1, cdc_read(got + 63, 1));
  TEST_ASSERT_EQUAL(0, host_out(0x02, bytes + 256, 64));
  TEST_ASSERT_EQUAL(256, cdc_read(got + 64, 1000));
  TEST_ASSERT_EQUAL(0, cdc_read(got, sizeof got));
  TEST_ASSERT_EQUAL_MEMORY(bytes, got, 320);
}

TEST(test_line_coding_is_kept) {
  static const uint8_t initial[7] = {0x00, 0xc2, 0x01, 0, 0, 0, 8};
  static const uint8_t coding[7] = {0x80, 0x25, 0, 0, 2, 1, 7};
  TEST_ASSERT_EQUAL(7, host_control_in(0xa1, 0x21, 0, 0, 7, got));
  TEST_ASSERT_EQUAL_HEX8_ARRAY(initial, got, 7);
  TEST_ASSERT_EQUAL(0, host_control_out(0x21, 0x20, 0, 0, coding, 7));
  TEST_ASSERT_EQUAL(7, host_control_in(0xa1, 0x21, 0, 0, 64, got));
  TEST_ASSERT_EQUAL_HEX8_ARRAY(coding, got, 7);
  enumerate();
  TEST_ASSERT_EQUAL(7, host_control_in(0xa1, 0x21, 0, 0, 7, got));
  TEST_ASSERT_EQUAL_HEX8_ARRAY(initial, got, 7);
  TEST_ASSERT_EQUAL(0, host_control_out(0x21, 0x23, 0xffff, 0, NULL, 0));
}

TEST(test_line_coding_of_another_length_than_announced_stalls) {
  static const size_t lengths[] = {0, 2, 6, 8, 64};
  for (size_t i = 0; i < sizeof lengths / sizeof lengths[0]; i++) {
    host_setup(0x21, 0x20, 0, 0, 7);
    TEST_ASSERT_EQUAL(0, host_out(0, bytes, lengths[i]));
    TEST_ASSERT_EQUAL(HOST_STALL, host_in(0x80, packet));
  }
}

/* Last, as the request cannot be taken back. */
TEST(test_1200_baud_asks_for_the_loader) {
  set_baud(9600);
  set_dtr(1);
  set_dtr(0);
  set_dtr(1);
  set_baud(1200);
  TEST_ASSERT_FALSE(cdc_loader_requested());
  set_baud(115200);
  set_dtr(0);
  TEST_ASSERT_FALSE(cdc_loader_requested());
  set_baud(1200);
  set_dtr(0);
  TEST_ASSERT_FALSE(cdc_loader_requested());
  set_dtr(1);
  TEST_ASSERT_TRUE(cdc_loader_requested());
}

/* Whether anybody is there or not. */
TEST(test_each_service_is_a_sign_of_life) {
  const unsigned before = fake_signs_of_life();
  fake_service();
  TEST_ASSERT_EQUAL(before + 1, fake_signs_of_life());
  host_suspend();
  fake_service();
  TEST_ASSERT_EQUAL(before + 2, fake_signs_of_life());
}
