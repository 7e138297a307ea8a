#include "usb_host.h"

#include "enumerate.h"
#include "fake_controller.h"
#include "unity.h"
#include "usb/cdc.h"
#include "usb/descriptors.h"

#include <stdbool.h>
#include <stdint.h>
#include <string.h>

enum { WRITE_BYTES = 40, RING_BYTES = 4096, SENT_MAX = 512 };

static struct {
  uint8_t got[SENT_MAX]; /* by the host, in this session */
  size_t got_bytes;
  bool reopened;
  unsigned sent; /* by the host */
  unsigned read;
  unsigned written; /* by the device */
} host;

/* Each byte tells its write and its place in it. */
static uint8_t byte_of(unsigned write, unsigned at) { return (uint8_t)(write * WRITE_BYTES + at); }

/* Of what the host sends; no byte of a turn of the ring is that of the turn before. */
static uint8_t sent_byte(unsigned at) { return (uint8_t)(at % 251); }

static void judge_read(const uint8_t *bytes, size_t length) {
  for (size_t i = 0; i < length; i++) {
    TEST_ASSERT_EQUAL_MESSAGE(sent_byte(host.read), bytes[i], "bytes torn, lost or twice");
    host.read++;
  }
}

void usb_judge_session(void) {
  static const uint8_t mark[4];
  if (host.got_bytes == 0) {
    return;
  }
  TEST_ASSERT_GREATER_THAN(sizeof mark, host.got_bytes);
  const bool is_marked = memcmp(mark, host.got, sizeof mark) == 0;
  TEST_ASSERT_TRUE_MESSAGE(is_marked || !host.reopened, "a session begins without its mark");
  const size_t begin = is_marked ? sizeof mark : 0;
  TEST_ASSERT_EQUAL_MESSAGE(0, host.got[begin] % WRITE_BYTES, "a session begins within a write");
  for (size_t i = begin + 1; i < host.got_bytes; i++) {
    TEST_ASSERT_EQUAL_MESSAGE(host.got[begin] + i - begin, host.got[i], "bytes torn, lost or twice");
  }
}

static void serve(void) {
  fake_run_interrupts();
  fake_hold_interrupts();
}

void usb_take_packet(void) {
  serve();
  int length = host_in(CDC_ENDPOINT_IN, host.got + host.got_bytes);
  host.got_bytes += length > 0 ? (size_t)length : 0;
}

void usb_bring_packet(void) {
  serve();
  uint8_t packet[64];
  for (unsigned i = 0; i < sizeof packet; i++) {
    packet[i] = sent_byte(host.sent + i);
  }
  if (fake_accepts(CDC_ENDPOINT_OUT)) {
    TEST_ASSERT_EQUAL(0, host_out(CDC_ENDPOINT_OUT, packet, sizeof packet));
    host.sent += (unsigned)sizeof packet;
  }
}

void usb_reopen(void) {
  usb_judge_session();
  host.got_bytes = 0;
  host.reopened = true;
  set_dtr(0);
  set_dtr(1);
}

void usb_take_all(void) {
  for (int i = 0; i < 8; i++) {
    usb_take_packet();
  }
}

void usb_write(void) {
  uint8_t bytes[WRITE_BYTES];
  for (unsigned i = 0; i < WRITE_BYTES; i++) {
    bytes[i] = byte_of(host.written, i);
  }
  TEST_ASSERT_EQUAL(FT_OK, cdc_write(bytes, sizeof bytes));
  host.written++;
}

size_t usb_read(void) {
  uint8_t bytes[100];
  const size_t length = cdc_read(bytes, sizeof bytes);
  judge_read(bytes, length);
  return length;
}

void usb_judge_reads(void) {
  while (usb_read() > 0) {
  }
  TEST_ASSERT_EQUAL_MESSAGE(host.sent, host.read, "bytes lost");
}

/* A port whose transmit ring is about to turn over. */
void usb_open_port(void) {
  static uint8_t filler[RING_BYTES - WRITE_BYTES / 2];
  plug_in();
  enumerate();
  set_dtr(1);
  TEST_ASSERT_EQUAL(FT_OK, cdc_write(filler, sizeof filler));
  uint8_t packet[64];
  for (size_t i = 0; i <= sizeof filler / sizeof packet; i++) {
    host_in(CDC_ENDPOINT_IN, packet);
  }
  TEST_ASSERT_EQUAL(0, host_in(CDC_ENDPOINT_IN, packet) > 0);
  fake_hold_interrupts();
}
