/* A USB CDC ACM device: the byte stream between the fingertip and its host.
 *
 * Sources: Universal Serial Bus Specification 2.0 chapter 9; USB Class Definitions for Communications Devices 1.2 and its PSTN subclass 1.2
 * (ACM). The controller is the board's, behind port/usb_controller.h. Exactly one exists per image.
 *
 * Interrupt context serves the controller; the functions below are for the main context. Between the two are
 * single-producer single-consumer rings, so nothing here locks or waits. */
#pragma once

#include "common/status.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct cdc_identity {
  uint16_t vendor_id;
  uint16_t product_id;
  uint16_t device_version_bcd;
  const char *manufacturer; /* ASCII, 63 characters at most; must outlive the device */
  const char *product;
  const char *serial;
};

/* Prepares the device and attaches it to the bus. */
void cdc_start(const struct cdc_identity *identity);

/* The device is configured and not suspended, and the host has raised DTR. */
bool cdc_is_open(void);

/* The bus is suspended: what hangs on it may draw 2.5 mA (USB 2.0, 7.2.3). */
bool cdc_is_suspended(void);

/* Counts what the main loop has to handle: bytes to read, the port closed, the bus suspended or resumed, the loader requested. */
uint32_t cdc_event_count(void);

/* Counts the times the port was closed (DTR dropped, suspended, bus reset, unplugged): streams end
 * then, and a host that comes back must ask for them again. */
uint32_t cdc_close_count(void);

/* Queues all of the bytes or none; those of whole words cost less. FT_ERR_SPACE: the queue is too full. FT_ERR_ARGUMENT: longer than the
 * queue will ever hold. Bytes queued while the port is closed are discarded at once. The first bytes after an opening, or after queued
 * bytes were discarded, follow four zero bytes: whatever the host has got of the stream before ends there (PROTOCOL.md). Nothing is sent
 * before, as a terminal that still echoes would send it back. */
enum ft_status cdc_write(const uint8_t *bytes, size_t length);

/* Takes what has arrived, at most capacity bytes; returns how many. What had arrived before the port was closed is dropped. */
size_t cdc_read(uint8_t *bytes, size_t capacity);

/* The host has set 1200 baud and closed the port, or opened it at 1200: it asks for the loader. */
bool cdc_loader_requested(void);
