#include "usb/descriptors.h"

#include "common/bytes.h"
#include "port/usb_controller.h"

enum descriptor_type {
  DESCRIPTOR_DEVICE = 1,
  DESCRIPTOR_CONFIGURATION = 2,
  DESCRIPTOR_STRING = 3,
};

enum string_index { STRING_LANGUAGES, STRING_MANUFACTURER, STRING_PRODUCT, STRING_SERIAL };

#define U16(value) (uint8_t)((value)&0xff), (uint8_t)((value) >> 8)

static const uint8_t device_descriptor[] = {
    18,
    DESCRIPTOR_DEVICE,
    U16(0x0200), /* USB 2.0 */
    0xef,        /* class, subclass, protocol: by interface association */
    0x02,
    0x01,
    USB_MAX_PACKET_BYTES,
    U16(0), /* vendor, product and version: from the identity */
    U16(0),
    U16(0),
    STRING_MANUFACTURER,
    STRING_PRODUCT,
    STRING_SERIAL,
    1, /* configurations */
};
_Static_assert(sizeof device_descriptor == 18, "USB 2.0 table 9-8");

enum { CONFIGURATION_BYTES = 75 };
static const uint8_t configuration_descriptor[] = {
    9,
    DESCRIPTOR_CONFIGURATION,
    U16(CONFIGURATION_BYTES),
    CDC_INTERFACES,
    1,    /* value */
    0,    /* no string */
    0x80, /* powered by the bus, no remote wake-up */
    50,   /* 100 mA */

    8, /* interface association */
    0x0b,
    CDC_INTERFACE_CONTROL,
    CDC_INTERFACES,
    0x02, /* communications, abstract control model, no specific protocol */
    0x02,
    0x00,
    0,

    9, /* interface */
    0x04,
    CDC_INTERFACE_CONTROL,
    0,
    1, /* endpoints */
    0x02,
    0x02,
    0x00,
    0,

    5, /* header: CDC 1.20 */
    0x24,
    0x00,
    U16(0x0120),

    5, /* call management: none */
    0x24,
    0x01,
    0x00,
    CDC_INTERFACE_DATA,

    4, /* abstract control management: line coding, control lines, break */
    0x24,
    0x02,
    0x06,

    5, /* union */
    0x24,
    0x06,
    CDC_INTERFACE_CONTROL,
    CDC_INTERFACE_DATA,

    7, /* endpoint */
    0x05,
    CDC_ENDPOINT_NOTIFY,
    USB_ENDPOINT_INTERRUPT,
    U16(16),
    16, /* ms */

    9, /* interface */
    0x04,
    CDC_INTERFACE_DATA,
    0,
    2, /* endpoints */
    0x0a,
    0x00,
    0x00,
    0,

    7, /* endpoint */
    0x05,
    CDC_ENDPOINT_OUT,
    USB_ENDPOINT_BULK,
    U16(USB_MAX_PACKET_BYTES),
    0,

    7, /* endpoint */
    0x05,
    CDC_ENDPOINT_IN,
    USB_ENDPOINT_BULK,
    U16(USB_MAX_PACKET_BYTES),
    0,
};
_Static_assert(sizeof configuration_descriptor == CONFIGURATION_BYTES, "wTotalLength");
_Static_assert(sizeof configuration_descriptor <= DESCRIPTOR_MAX_BYTES, "buffer of an answer");

static const uint8_t languages_descriptor[] = {4, DESCRIPTOR_STRING, U16(0x0409)};

static size_t write_bytes(uint8_t *to, const uint8_t *from, size_t length) {
  memcpy(to, from, length);
  return length;
}

static size_t write_string(uint8_t to[DESCRIPTOR_MAX_BYTES], const char *text) {
  size_t length = 2;
  for (; *text && length + 2 <= DESCRIPTOR_MAX_BYTES; text++, length += 2)
    bytes_put_u16(to + length, (uint8_t)*text);
  to[0] = (uint8_t)length;
  to[1] = DESCRIPTOR_STRING;
  return length;
}

size_t descriptor_write(const struct cdc_identity *identity, uint16_t type_and_index,
                        uint8_t to[DESCRIPTOR_MAX_BYTES]) {
  switch (type_and_index) {
  case DESCRIPTOR_DEVICE << 8:
    write_bytes(to, device_descriptor, sizeof device_descriptor);
    bytes_put_u16(to + 8, identity->vendor_id);
    bytes_put_u16(to + 10, identity->product_id);
    bytes_put_u16(to + 12, identity->device_version_bcd);
    return sizeof device_descriptor;
  case DESCRIPTOR_CONFIGURATION << 8:
    return write_bytes(to, configuration_descriptor, sizeof configuration_descriptor);
  case DESCRIPTOR_STRING << 8 | STRING_LANGUAGES:
    return write_bytes(to, languages_descriptor, sizeof languages_descriptor);
  case DESCRIPTOR_STRING << 8 | STRING_MANUFACTURER:
    return write_string(to, identity->manufacturer);
  case DESCRIPTOR_STRING << 8 | STRING_PRODUCT:
    return write_string(to, identity->product);
  case DESCRIPTOR_STRING << 8 | STRING_SERIAL:
    return write_string(to, identity->serial);
  default:
    return 0;
  }
}
