#include "enumerate.h"

#include "common/bytes.h"
#include "fake_controller.h"
#include "port/usb_controller.h"
#include "unity.h"
#include "usb/cdc.h"
#include "usb/descriptors.h"

static const struct cdc_identity IDENTITY = {
    .vendor_id = 0x1209,
    .product_id = 0x0001,
    .device_version_bcd = 0x0123,
    .manufacturer = "Maker",
    .product = "A product name of 31 characters",
    .serial = "0123456789ABCDEF",
};

void plug_in(void) {
  fake_power_on();
  cdc_start(&IDENTITY);
  TEST_ASSERT_TRUE(fake_is_attached());
  host_bus_reset();
  uint8_t left_over[256];
  cdc_read(left_over, sizeof left_over);
}

void enumerate(void) {
  host_bus_reset();
  TEST_ASSERT_EQUAL(0, host_control_out(0x00, 5, 7, 0, NULL, 0));
  host_address(7);
  TEST_ASSERT_EQUAL(0, host_control_out(0x00, 9, 1, 0, NULL, 0));
  host_reset_toggles();
}

void set_dtr(int on) { TEST_ASSERT_EQUAL(0, host_control_out(0x21, 0x22, on ? 3 : 0, 0, NULL, 0)); }

void open_port(void) {
  uint8_t packet[USB_MAX_PACKET_BYTES];
  set_dtr(1);
  TEST_ASSERT_EQUAL(FT_OK, cdc_write((const uint8_t *)"open", 4));
  TEST_ASSERT_EQUAL(8, host_in(CDC_ENDPOINT_IN, packet));
  TEST_ASSERT_EQUAL_MEMORY("\0\0\0\0open", packet, 8);
}

void set_baud(uint32_t baud) {
  uint8_t coding[7] = {0, 0, 0, 0, 0, 0, 8};
  bytes_put_u32(coding, baud);
  TEST_ASSERT_EQUAL(0, host_control_out(0x21, 0x20, 0, 0, coding, sizeof coding));
}
