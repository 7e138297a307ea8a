/* What every USB device owes: USB 2.0 chapter 9. */
#include "enumerate.h"
#include "fake_controller.h"
#include "support/unit.h"
#include "usb/cdc.h"

#include <stdio.h>
#include <string.h>

enum {
  GET_STATUS = 0,
  CLEAR_FEATURE = 1,
  SET_FEATURE = 3,
  SET_ADDRESS = 5,
  GET_DESCRIPTOR = 6,
  SET_DESCRIPTOR = 7,
  GET_CONFIGURATION = 8,
  SET_CONFIGURATION = 9,
  GET_INTERFACE = 10,
  SET_INTERFACE = 11,
  SYNCH_FRAME = 12,
};
enum { DEVICE = 0x100, CONFIGURATION = 0x200, STRING = 0x300, QUALIFIER = 0x600 };

static uint8_t answer[512];

void setUp(void) {
  memset(answer, 0xee, sizeof answer);
  plug_in();
}

static int get_descriptor(uint16_t type_and_index, uint16_t length) {
  return host_control_in(0x80, GET_DESCRIPTOR, type_and_index, 0, length, answer);
}

TEST(test_enumeration_as_linux_does) {
  TEST_ASSERT_EQUAL(18, get_descriptor(DEVICE, 64));
  host_bus_reset();
  TEST_ASSERT_EQUAL(0, host_control_out(0x00, SET_ADDRESS, 42, 0, NULL, 0));
  TEST_ASSERT_EQUAL(HOST_NO_ANSWER, get_descriptor(DEVICE, 18));
  host_address(42);
  TEST_ASSERT_EQUAL(18, get_descriptor(DEVICE, 18));
  for (int i = 0; i < 3; i++)
    TEST_ASSERT_EQUAL(HOST_STALL, get_descriptor(QUALIFIER, 10));
  TEST_ASSERT_EQUAL(9, get_descriptor(CONFIGURATION, 9));
  int total = answer[2] | answer[3] << 8;
  TEST_ASSERT_EQUAL(75, total);
  TEST_ASSERT_EQUAL(75, get_descriptor(CONFIGURATION, (uint16_t)total));
  TEST_ASSERT_EQUAL(4, get_descriptor(STRING | 0, 255));
  TEST_ASSERT_EQUAL(64, get_descriptor(STRING | 2, 255));
  TEST_ASSERT_EQUAL(12, get_descriptor(STRING | 1, 255));
  TEST_ASSERT_EQUAL_HEX8_ARRAY("\x0c\x03M\0a\0k\0e\0r\0", answer, 12);
  TEST_ASSERT_EQUAL(34, get_descriptor(STRING | 3, 255));
  TEST_ASSERT_EQUAL(0, host_control_out(0x00, SET_CONFIGURATION, 1, 0, NULL, 0));
  host_reset_toggles();
  TEST_ASSERT_EQUAL(1, host_control_in(0x80, GET_CONFIGURATION, 0, 0, 1, answer));
  TEST_ASSERT_EQUAL(1, answer[0]);
  set_baud(9600);
  TEST_ASSERT_FALSE(cdc_is_open());
  set_dtr(1);
  TEST_ASSERT_TRUE(cdc_is_open());
  TEST_ASSERT_EQUAL(HOST_NAK, host_in(0x81, answer));
  TEST_ASSERT_EQUAL(HOST_NAK, host_in(0x82, answer));
}

/* Byte by byte: USB 2.0 tables 9-8 to 9-13, CDC 1.20 tables 15 and 16, PSTN 1.2 tables 3 and 4. */
TEST(test_descriptors_are_these) {
  static const uint8_t device[] = {18, 1, 0, 2, 0xEF, 2, 1, 64, 0x09, 0x12, 0x01, 0x00, 0x23, 0x01, 1, 2, 3, 1};
  static const uint8_t configuration[] = {
      9, 2,    75,   0,    2,  1,  0,  0x80, 50, /* configuration, 100 mA from the bus */
      8, 0x0B, 0,    2,    2,  2,  0,  0,        /* association: abstract control model */
      9, 4,    0,    0,    1,  2,  2,  0,    0,  /* control interface, one endpoint */
      5, 0x24, 0,    0x20, 1,                    /* header: CDC 1.20 */
      5, 0x24, 1,    0,    1,                    /* call management: none */
      4, 0x24, 2,    6,                          /* line coding, control lines, break */
      5, 0x24, 6,    0,    1,                    /* union */
      7, 5,    0x81, 3,    16, 0,  16,           /* notifications: interrupt, each 16 ms */
      9, 4,    1,    0,    2,  10, 0,  0,    0,  /* data interface, two endpoints */
      7, 5,    0x02, 2,    64, 0,  0,            /* bulk out */
      7, 5,    0x82, 2,    64, 0,  0,            /* bulk in */
  };
  static const uint8_t languages[] = {4, 3, 0x09, 0x04};
  TEST_ASSERT_EQUAL((int)sizeof device, get_descriptor(DEVICE, 255));
  TEST_ASSERT_EQUAL_HEX8_ARRAY(device, answer, sizeof device);
  TEST_ASSERT_EQUAL((int)sizeof configuration, get_descriptor(CONFIGURATION, 255));
  TEST_ASSERT_EQUAL_HEX8_ARRAY(configuration, answer, sizeof configuration);
  TEST_ASSERT_EQUAL((int)sizeof languages, get_descriptor(STRING, 255));
  TEST_ASSERT_EQUAL_HEX8_ARRAY(languages, answer, sizeof languages);
}

TEST(test_answer_of_whole_packets_ends_with_an_empty_one_when_shorter_than_asked) {
  uint8_t packet[64];
  host_setup(0x80, GET_DESCRIPTOR, STRING | 2, 0x0409, 255);
  TEST_ASSERT_EQUAL(64, host_in(0x80, packet));
  TEST_ASSERT_EQUAL(0, host_in(0x80, packet));
  TEST_ASSERT_EQUAL(HOST_NAK, host_in(0x80, packet));
  TEST_ASSERT_EQUAL(0, host_out(0, NULL, 0));

  host_setup(0x80, GET_DESCRIPTOR, STRING | 2, 0x0409, 64);
  TEST_ASSERT_EQUAL(64, host_in(0x80, packet));
  TEST_ASSERT_EQUAL(HOST_NAK, host_in(0x80, packet));
  TEST_ASSERT_EQUAL(0, host_out(0, NULL, 0));
}

TEST(test_host_may_end_the_data_stage_early) {
  host_setup(0x80, GET_DESCRIPTOR, CONFIGURATION, 0, 75);
  TEST_ASSERT_EQUAL(64, host_in(0x80, answer));
  TEST_ASSERT_EQUAL(0, host_out(0, NULL, 0));
  TEST_ASSERT_EQUAL(HOST_NAK, host_in(0x80, answer));
  TEST_ASSERT_EQUAL(18, get_descriptor(DEVICE, 64));
}

TEST(test_status_stage_with_data_stalls) {
  host_setup(0x80, GET_DESCRIPTOR, DEVICE, 0, 18);
  TEST_ASSERT_EQUAL(18, host_in(0x80, answer));
  TEST_ASSERT_EQUAL(0, host_out(0, "x", 1));
  TEST_ASSERT_EQUAL(HOST_STALL, host_out(0, NULL, 0));
  TEST_ASSERT_EQUAL(18, get_descriptor(DEVICE, 64));
}

struct refused {
  uint8_t type, request;
  uint16_t value, index, length;
};

static void assert_refused(const struct refused *r, size_t count) {
  for (size_t i = 0; i < count; i++) {
    char message[80];
    snprintf(message, sizeof message, "%02x %02x %04x %04x %04x", r[i].type, r[i].request, r[i].value, r[i].index, r[i].length);
    host_setup(r[i].type, r[i].request, r[i].value, r[i].index, r[i].length);
    TEST_ASSERT_EQUAL_MESSAGE(HOST_STALL, host_in(0x80, answer), message);
    TEST_ASSERT_EQUAL_MESSAGE(HOST_STALL, host_out(0, NULL, 0), message);
  }
}

TEST(test_refused_in_any_state) {
  static const struct refused always[] = {
      {0x80, GET_DESCRIPTOR, QUALIFIER, 0, 10},
      {0x80, GET_DESCRIPTOR, 0x700, 0, 9},  /* other speed */
      {0x80, GET_DESCRIPTOR, 0x0f00, 0, 5}, /* BOS */
      {0x80, GET_DESCRIPTOR, 0x201, 0, 9},  /* second configuration */
      {0x80, GET_DESCRIPTOR, STRING | 4, 0x0409, 255},
      {0x80, GET_DESCRIPTOR, STRING | 0xee, 0, 255},
      {0x81, GET_DESCRIPTOR, 0x2200, 0, 64}, /* HID report */
      {0x00, GET_DESCRIPTOR, DEVICE, 0, 18}, /* wrong direction */
      {0x80, SET_ADDRESS, 5, 0, 0},
      {0x00, SET_ADDRESS, 128, 0, 0},
      {0x00, SET_ADDRESS, 5, 0, 8},
      {0x00, SET_DESCRIPTOR, DEVICE, 0, 18},
      {0x00, SET_CONFIGURATION, 2, 0, 0},
      {0x00, SET_FEATURE, 1, 0, 0},      /* remote wake-up */
      {0x00, SET_FEATURE, 2, 0x0100, 0}, /* test mode */
      {0x00, CLEAR_FEATURE, 1, 0, 0},
      {0x02, SET_FEATURE, 0, 0x00, 0}, /* halt of endpoint 0 */
      {0x02, SET_FEATURE, 0, 0x83, 0},
      {0x02, SET_FEATURE, 1, 0x82, 0},
      {0x82, SYNCH_FRAME, 0, 0x82, 2},
      {0x82, GET_STATUS, 0, 0x83, 2},
      {0x81, GET_STATUS, 0, 2, 2},
      {0x81, GET_INTERFACE, 0, 2, 1},
      {0x01, SET_INTERFACE, 1, 1, 0},
      {0x01, SET_INTERFACE, 0, 2, 0},
      {0x80, 2, 0, 0, 2},
      {0x80, 0xff, 0, 0, 2},
      {0x83, GET_STATUS, 0, 0, 2},
      {0xc0, 0x01, 0, 0, 8}, /* vendor */
      {0xa1, 0x21, 0, 1, 7}, /* class request to the data interface */
      {0x21, 0x21, 0, 0, 0},
      {0xa1, 0x20, 0, 0, 7},
      {0x21, 0x20, 0, 0, 6},
      {0x21, 0x20, 0, 0, 64},
      {0x21, 0x22, 1, 0, 2},
      {0x21, 0x02, 0, 0, 0},
  };
  assert_refused(always, sizeof always / sizeof always[0]);
  enumerate();
  assert_refused(always, sizeof always / sizeof always[0]);
  TEST_ASSERT_EQUAL(18, get_descriptor(DEVICE, 64));
}

TEST(test_status_and_interface_questions) {
  enumerate();
  static const struct refused questions[] = {
      {0x80, GET_STATUS, 0, 0, 2},    {0x81, GET_STATUS, 0, 0, 2},    {0x81, GET_STATUS, 0, 1, 2},    {0x82, GET_STATUS, 0, 0, 2},
      {0x82, GET_STATUS, 0, 0x80, 2}, {0x82, GET_STATUS, 0, 0x81, 2}, {0x82, GET_STATUS, 0, 0x02, 2}, {0x82, GET_STATUS, 0, 0x82, 2},
  };
  for (size_t i = 0; i < sizeof questions / sizeof questions[0]; i++) {
    const struct refused *q = &questions[i];
    TEST_ASSERT_EQUAL(2, host_control_in(q->type, q->request, q->value, q->index, 2, answer));
    TEST_ASSERT_EQUAL_HEX8_ARRAY("\0\0", answer, 2);
  }
  TEST_ASSERT_EQUAL(1, host_control_in(0x81, GET_INTERFACE, 0, 1, 1, answer));
  TEST_ASSERT_EQUAL(0, answer[0]);
}

TEST(test_halted_endpoint_stalls_until_cleared_and_starts_at_data0) {
  static const uint8_t all[] = {0x81, 0x82, 0x02};
  enumerate();
  open_port();
  TEST_ASSERT_EQUAL(0, host_out(0x02, "a", 1)); /* leaves DATA1 */
  TEST_ASSERT_EQUAL(FT_OK, cdc_write((const uint8_t *)"b", 1));
  TEST_ASSERT_EQUAL(1, host_in(0x82, answer));
  for (size_t i = 0; i < sizeof all; i++) {
    TEST_ASSERT_EQUAL(0, host_control_out(0x02, SET_FEATURE, 0, all[i], NULL, 0));
    TEST_ASSERT_EQUAL(2, host_control_in(0x82, GET_STATUS, 0, all[i], 2, answer));
    TEST_ASSERT_EQUAL_HEX8_ARRAY("\1\0", answer, 2);
    TEST_ASSERT_EQUAL(HOST_STALL, all[i] & 0x80 ? host_in(all[i], answer) : host_out(all[i], "x", 1));
    TEST_ASSERT_EQUAL(0, host_control_out(0x02, CLEAR_FEATURE, 0, all[i], NULL, 0));
    host_reset_toggle(all[i]);
    TEST_ASSERT_EQUAL(2, host_control_in(0x82, GET_STATUS, 0, all[i], 2, answer));
    TEST_ASSERT_EQUAL_HEX8_ARRAY("\0\0", answer, 2);
  }
  TEST_ASSERT_EQUAL(0, host_out(0x02, "c", 1));
  TEST_ASSERT_EQUAL(FT_OK, cdc_write((const uint8_t *)"d", 1));
  TEST_ASSERT_EQUAL(1, host_in(0x82, answer));
  TEST_ASSERT_EQUAL('d', answer[0]);
  TEST_ASSERT_EQUAL(2, cdc_read(answer, sizeof answer));
  TEST_ASSERT_EQUAL_MEMORY("ac", answer, 2);
}

TEST(test_configuration_may_be_set_again_and_again) {
  enumerate();
  for (int i = 0; i < 3; i++) {
    set_dtr(1);
    TEST_ASSERT_EQUAL(0, host_out(0x02, "abc", 3));
    TEST_ASSERT_EQUAL(FT_OK, cdc_write((const uint8_t *)"xyz", 3));
    TEST_ASSERT_EQUAL(0, host_control_out(0x02, SET_FEATURE, 0, 0x82, NULL, 0)); /* it ends halts */
    TEST_ASSERT_EQUAL(0, host_control_out(0x00, SET_CONFIGURATION, 1, 0, NULL, 0));
    host_reset_toggles();
    TEST_ASSERT_EQUAL(2, host_control_in(0x82, GET_STATUS, 0, 0x82, 2, answer));
    TEST_ASSERT_EQUAL_HEX8_ARRAY("\0\0", answer, 2);
    TEST_ASSERT_FALSE(cdc_is_open());
    TEST_ASSERT_EQUAL(HOST_NAK, host_in(0x82, answer));
    TEST_ASSERT_EQUAL(0, cdc_read(answer, sizeof answer)); /* it has been closed */
  }
  TEST_ASSERT_EQUAL(0, host_control_out(0x00, SET_CONFIGURATION, 0, 0, NULL, 0));
  TEST_ASSERT_EQUAL(HOST_NO_ANSWER, host_in(0x82, answer));
  TEST_ASSERT_EQUAL(1, host_control_in(0x80, GET_CONFIGURATION, 0, 0, 1, answer));
  TEST_ASSERT_EQUAL(0, answer[0]);
  TEST_ASSERT_EQUAL(0, host_control_out(0x00, SET_CONFIGURATION, 1, 0, NULL, 0));
}

TEST(test_interface_set_empties_the_data_endpoints) {
  enumerate();
  open_port();
  TEST_ASSERT_EQUAL(FT_OK, cdc_write((const uint8_t *)"old", 3));
  TEST_ASSERT_EQUAL(0, host_control_out(0x01, SET_INTERFACE, 0, 1, NULL, 0));
  host_reset_toggles();
  TEST_ASSERT_EQUAL(HOST_NAK, host_in(0x82, answer));
  TEST_ASSERT_EQUAL(FT_OK, cdc_write((const uint8_t *)"new", 3));
  TEST_ASSERT_EQUAL(7, host_in(0x82, answer));
  TEST_ASSERT_EQUAL_MEMORY("\0\0\0\0new", answer, 7);
  TEST_ASSERT_EQUAL(0, host_out(0x02, "in", 2));
  TEST_ASSERT_EQUAL(FT_OK, cdc_write((const uint8_t *)"kept", 4));
  TEST_ASSERT_EQUAL(0, host_control_out(0x01, SET_INTERFACE, 0, 0, NULL, 0));
  TEST_ASSERT_EQUAL(4, host_in(0x82, answer));
}

TEST(test_bus_reset_in_mid_transfer) {
  enumerate();
  set_dtr(1);
  uint32_t closes = cdc_close_count();
  TEST_ASSERT_EQUAL(FT_OK, cdc_write(answer, 200));
  TEST_ASSERT_EQUAL(64, host_in(0x82, answer));
  host_setup(0x80, GET_DESCRIPTOR, CONFIGURATION, 0, 75);
  TEST_ASSERT_EQUAL(64, host_in(0x80, answer));
  host_bus_reset();
  TEST_ASSERT_FALSE(cdc_is_open());
  TEST_ASSERT_EQUAL(closes + 1, cdc_close_count());
  TEST_ASSERT_EQUAL(HOST_NAK, host_in(0x80, answer));
  TEST_ASSERT_EQUAL(HOST_NO_ANSWER, host_in(0x82, answer));
  test_enumeration_as_linux_does();
  TEST_ASSERT_EQUAL(closes + 1, cdc_close_count());
}
