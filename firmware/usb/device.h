/* The two halves of the USB device: device.c has what every device must do (USB 2.0 chapter 9: the control endpoint,
 * addresses, configurations, halted endpoints), cdc.c is the function.
 *
 * All of it runs in the interrupt context of the controller, but for device_start(). */
#pragma once

#include "usb/cdc.h"
#include "usb/descriptors.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct usb_setup {
  uint8_t type;
  uint8_t request;
  uint16_t value;
  uint16_t index;
  uint16_t length;
};

enum control_answer {
  CONTROL_STALL,   /* not a request of this device in this state */
  CONTROL_DONE,    /* nothing to send: status stage */
  CONTROL_SEND,    /* data is filled, *length bytes */
  CONTROL_RECEIVE, /* the host sends setup->length bytes into data */
};

/* device.c */
void device_start(const struct cdc_identity *identity);
bool device_endpoint_is_halted(uint8_t endpoint);

/* cdc.c: the function's own requests. A request answered with CONTROL_RECEIVE comes back with its
 * data; setup->length was at most DESCRIPTOR_MAX_BYTES. */
enum control_answer cdc_on_request(const struct usb_setup *setup, uint8_t *data, size_t *length);
void cdc_on_request_data(const struct usb_setup *setup, const uint8_t *data);

/* cdc.c: the endpoints have been opened again and are empty, or (false) are closed. */
void cdc_on_configured(bool configured);

/* cdc.c: the data endpoints have been opened again, without a new configuration. */
void cdc_on_interface_set(void);

/* cdc.c: before the endpoint is halted or its halt is cleared, and after that. */
void cdc_before_halt_change(uint8_t endpoint);
void cdc_after_halt_change(void);

void cdc_on_suspended(bool suspended);
void cdc_on_sent(uint8_t endpoint);
void cdc_on_received(uint8_t endpoint, const uint8_t *bytes, size_t length);
void cdc_on_service(void);
