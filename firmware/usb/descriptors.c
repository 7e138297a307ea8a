#include "usb/descriptors.h"

#include "common/bytes.h"
#include "port/usb_controller.h"

enum descriptor_type { DESCRIPTOR_DEVICE = 1, DESCRIPTOR_CONFIGURATION = 2, DESCRIPTOR_STRING = 3 };

enum string_index { STRING_LANGUAGES, STRING_MANUFACTURER, STRING_PRODUCT, STRING_SERIAL };

#define U16(value) (uint8_t)((value)&0xff), (uint8_t)((value) >> 8)

/* USB 2.0; class, subclass and protocol of the interface association; vendor, product and version come from the
 * identity; one configuration. */
static const uint8_t device_descriptor[] = {
    18,     DESCRIPTOR_DEVICE,   U16(0x0200),    0xef,          0x02, 0x01, USB_MAX_PACKET_BYTES, U16(0), U16(0),
    U16(0), STRING_MANUFACTURER, STRING_PRODUCT, STRING_SERIAL, 1};
_Static_assert(sizeof device_descriptor == 18, "USB 2.0 table 9-8");

enum { CONFIGURATION_BYTES = 75 };
/* One row for each descriptor: its length, its type, its fields (descriptors.h has interfaces and endpoints). */
static const uint8_t configuration_descriptor[] = {
    9, 2,    75,   0,    2,  1,  0,  0x80, 50, /* configuration 1: powered by the bus, no remote wake-up, 100 mA */
    8, 0x0B, 0,    2,    2,  2,  0,  0,        /* interface association: communications, abstract control model */
    9, 4,    0,    0,    1,  2,  2,  0,    0,  /* control interface with one endpoint */
    5, 0x24, 0,    0x20, 1,                    /* header: CDC 1.20 */
    5, 0x24, 1,    0,    1,                    /* call management: none */
    4, 0x24, 2,    6,                          /* abstract control management: line coding, control lines, break */
    5, 0x24, 6,    0,    1,                    /* union */
    7, 5,    0x81, 3,    16, 0,  16,           /* notifications: interrupt, each 16 ms */
    9, 4,    1,    0,    2,  10, 0,  0,    0,  /* data interface with two endpoints */
    7, 5,    0x02, 2,    64, 0,  0,            /* bulk, from the host */
    7, 5,    0x82, 2,    64, 0,  0,            /* bulk, to the host */
};
_Static_assert(CDC_ENDPOINT_NOTIFY == 0x81 && CDC_ENDPOINT_OUT == 0x02 && CDC_ENDPOINT_IN == 0x82 && CDC_INTERFACES == 2 &&
                   CDC_INTERFACE_CONTROL == 0 && USB_MAX_PACKET_BYTES == 64,
               "the table has them as numbers");
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

size_t descriptor_write(const struct cdc_identity *identity, uint16_t type_and_index, uint8_t to[DESCRIPTOR_MAX_BYTES]) {
  switch (type_and_index) {
  case DESCRIPTOR_DEVICE << 8:
    write_bytes(to, device_descriptor, sizeof device_descriptor);
    bytes_put_u16(to + 8, identity->vendor_id);
    bytes_put_u16(to + 10, identity->product_id);
    bytes_put_u16(to + 12, identity->device_version_bcd);
    return sizeof device_descriptor;
  case DESCRIPTOR_CONFIGURATION << 8: return write_bytes(to, configuration_descriptor, sizeof configuration_descriptor);
  case DESCRIPTOR_STRING << 8 | STRING_LANGUAGES: return write_bytes(to, languages_descriptor, sizeof languages_descriptor);
  case DESCRIPTOR_STRING << 8 | STRING_MANUFACTURER: return write_string(to, identity->manufacturer);
  case DESCRIPTOR_STRING << 8 | STRING_PRODUCT: return write_string(to, identity->product);
  case DESCRIPTOR_STRING << 8 | STRING_SERIAL: return write_string(to, identity->serial);
  default: return 0;
  }
}
