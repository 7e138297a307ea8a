/* usb/cdc.h on the host: a byte stream in memory whose far end is the test. Linked in place of the USB device. */
#pragma once

#include "usb/cdc.h"

/* What cdc_write() holds while the host does not read, and what of the host's waits for cdc_read(); as in the device. */
enum { NATIVE_CDC_TRANSMIT_BYTES = 4096, NATIVE_CDC_RECEIVE_BYTES = 256 };

/* Detached, closed, nothing sent, nothing received, no closings counted. */
void native_cdc_reset(void);

/* The identity given to cdc_start(); NULL before it. */
const struct cdc_identity *native_cdc_identity(void);

/* The host opens or closes the port. Closing loses what is queued in either direction. */
void native_cdc_open(void);
void native_cdc_close(void);

/* A stalled host has the port open and reads nothing; cdc_write() fills the queue. When it goes on, it gets the queue. */
void native_cdc_stall(bool stalled);

/* The bus falls asleep or wakes up: asleep the port is closed. It keeps what the host wants of it: one that was open is so again. */
void native_cdc_suspend(bool suspended);

/* The host writes; the device gets the bytes at its next reads. FT_ERR_SPACE: the device would hold off the host, none was taken. */
enum ft_status native_cdc_send(const uint8_t *bytes, size_t length);

/* The host asks for the loader, as by 1200 baud. */
void native_cdc_request_loader(void);

/* Takes what the host has received, at most capacity bytes; returns how many. */
size_t native_cdc_receive(uint8_t *bytes, size_t capacity);
