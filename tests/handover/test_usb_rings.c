/* The rings of the USB port: main writes and reads, the controller's interrupts take and bring packets, close the port
 * and open it. What a host gets is whole writes in their order from some one on, cut off where the port was closed;
 * what it sends arrives, each byte once and in order: else the test fails. */
#include "enumerate.h"
#include "explore.h"
#include "fake_controller.h"
#include "support/unit.h"
#include "usb/cdc.h"
#include "usb/descriptors.h"

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

static void judge_session(void) {
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

/* Interrupts: the host takes a packet, brings one, closes the port and opens it again. */
static void take_packet(void) {
  serve();
  int length = host_in(CDC_ENDPOINT_IN, host.got + host.got_bytes);
  host.got_bytes += length > 0 ? (size_t)length : 0;
}

static void bring_packet(void) {
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

static void reopen(void) {
  judge_session();
  host.got_bytes = 0;
  host.reopened = true;
  set_dtr(0);
  set_dtr(1);
}

static void take_all(void) {
  for (int i = 0; i < 8; i++) {
    take_packet();
  }
}

/* Main context: writes some bytes. */
static void write_bytes(void) {
  uint8_t bytes[WRITE_BYTES];
  for (unsigned i = 0; i < WRITE_BYTES; i++) {
    bytes[i] = byte_of(host.written, i);
  }
  TEST_ASSERT_EQUAL(FT_OK, cdc_write(bytes, sizeof bytes));
  host.written++;
}

/* Reads some and returns how many. */
static size_t read_bytes(void) {
  uint8_t bytes[100];
  const size_t length = cdc_read(bytes, sizeof bytes);
  judge_read(bytes, length);
  return length;
}

static void judge_reads(void) {
  while (read_bytes() > 0) {
  }
  TEST_ASSERT_EQUAL_MESSAGE(host.sent, host.read, "bytes lost");
}

/* A port whose transmit ring is about to turn over. */
static void open_written_port(void) {
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

static void write_some(void) {
  explore_begin();
  write_bytes();
  write_bytes();
  explore_end();
  take_all();
  judge_session();
}

static void read_some(void) {
  explore_begin();
  for (int i = 0; i < 3; i++) {
    read_bytes();
  }
  explore_end();
  judge_reads();
}

static void tell(const char *what, unsigned most, unsigned long runs, unsigned long points) {
  printf("%s: up to %u interrupts, %lu runs, %lu points\n", what, most, runs, points);
}

TEST(test_what_main_writes_is_whole) {
  static const struct explore_interrupt interrupts[] = {{take_packet, 1, 3}, {reopen, 1, 2}};
  unsigned long points;
  open_written_port();
  unsigned long runs = explore(write_some, interrupts, 2, 3, &points);
  tell("writing", 3, runs, points);
  TEST_ASSERT_GREATER_THAN(10000, runs);
}

TEST(test_what_main_reads_is_whole) {
  static const struct explore_interrupt interrupts[] = {{bring_packet, 1, 4}};
  unsigned long points;
  open_written_port();
  for (int i = 0; i < 4; i++) {
    bring_packet(); /* the ring is full */
  }
  unsigned long runs = explore(read_some, interrupts, 1, 4, &points);
  tell("reading", 4, runs, points);
  TEST_ASSERT_GREATER_THAN(10000, runs);
}
