/* The device's description of itself: USB 2.0 section 9.6, CDC 1.2 section 5, PSTN 1.2 section 5.3.
 *
 * One configuration, one CDC function of two interfaces, grouped by an interface association. */
#pragma once

#include "usb/cdc.h"

#include <stddef.h>
#include <stdint.h>

enum {
  CDC_INTERFACE_CONTROL = 0,
  CDC_INTERFACE_DATA = 1,
  CDC_INTERFACES = 2,

  CDC_ENDPOINT_NOTIFY = 0x81,
  CDC_ENDPOINT_IN = 0x82,
  CDC_ENDPOINT_OUT = 0x02,

  /* No answer is longer; a string of more than 63 characters is cut. */
  DESCRIPTOR_MAX_BYTES = 128,
};

/* Writes the descriptor and returns its length; 0: the device has no such descriptor. type_and_index is wValue of GET_DESCRIPTOR. */
size_t descriptor_write(const struct cdc_identity *identity, uint16_t type_and_index, uint8_t to[DESCRIPTOR_MAX_BYTES]);
