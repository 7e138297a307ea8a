#include "native/native_cdc.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct bytes {
  uint8_t *data;
  size_t length, capacity;
};

static struct {
  const struct cdc_identity *identity;
  bool wanted, suspended, stalled, loader_requested; /* wanted: the host has the port open */
  uint32_t close_count, news;
  struct bytes queued;   /* device to host, not read by the host */
  struct bytes received; /* by the host */
  struct bytes sent;     /* host to device, not read by the device */
} cdc;

static void append(struct bytes *to, const uint8_t *data, size_t length) {
  if (to->length + length > to->capacity) {
    to->capacity = 2 * (to->length + length);
    to->data = realloc(to->data, to->capacity);
    if (!to->data) {
      (void)fputs("native_cdc: out of memory\n", stderr);
      abort();
    }
  }
  memcpy(to->data + to->length, data, length);
  to->length += length;
}

static size_t take(struct bytes *from, uint8_t *data, size_t capacity) {
  const size_t length = from->length < capacity ? from->length : capacity;
  if (length == 0) {
    return 0;
  }
  memcpy(data, from->data, length);
  from->length -= length;
  memmove(from->data, from->data + length, from->length);
  return length;
}

void native_cdc_reset(void) {
  free(cdc.queued.data);
  free(cdc.received.data);
  free(cdc.sent.data);
  memset(&cdc, 0, sizeof cdc);
}

const struct cdc_identity *native_cdc_identity(void) { return cdc.identity; }

static void deliver(void) {
  if (cdc.stalled || cdc.queued.length == 0) {
    return;
  }
  append(&cdc.received, cdc.queued.data, cdc.queued.length);
  cdc.queued.length = 0;
}

static void lose_what_is_queued(bool was_open) {
  if (was_open) {
    cdc.close_count++;
    cdc.news++;
  }
  cdc.queued.length = 0;
  cdc.sent.length = 0;
}

void native_cdc_open(void) { cdc.wanted = cdc.identity != NULL; }

void native_cdc_close(void) {
  const bool was_open = cdc_is_open();
  cdc.wanted = false;
  lose_what_is_queued(was_open);
}

void native_cdc_suspend(bool suspended) {
  if (suspended == cdc.suspended) {
    return;
  }
  const bool was_open = cdc_is_open();
  cdc.suspended = suspended;
  cdc.news++;
  if (suspended) {
    lose_what_is_queued(was_open);
  }
}

void native_cdc_stall(bool stalled) {
  cdc.stalled = stalled;
  deliver();
}

enum ft_status native_cdc_send(const uint8_t *bytes, size_t length) {
  if (cdc.sent.length + length > NATIVE_CDC_RECEIVE_BYTES) {
    return FT_ERR_SPACE;
  }
  append(&cdc.sent, bytes, length);
  cdc.news++;
  return FT_OK;
}

void native_cdc_request_loader(void) {
  cdc.loader_requested = true;
  cdc.news++;
}

size_t native_cdc_receive(uint8_t *bytes, size_t capacity) { return take(&cdc.received, bytes, capacity); }

void cdc_start(const struct cdc_identity *identity) { cdc.identity = identity; }

bool cdc_is_open(void) { return cdc.wanted && !cdc.suspended; }

bool cdc_is_suspended(void) { return cdc.suspended; }

uint32_t cdc_event_count(void) { return cdc.news; }

uint32_t cdc_close_count(void) { return cdc.close_count; }

enum ft_status cdc_write(const uint8_t *bytes, size_t length) {
  if (length > NATIVE_CDC_TRANSMIT_BYTES) {
    return FT_ERR_ARGUMENT;
  }
  if (!cdc_is_open()) {
    return FT_OK;
  }
  if (cdc.queued.length + length > NATIVE_CDC_TRANSMIT_BYTES) {
    return FT_ERR_SPACE;
  }
  append(&cdc.queued, bytes, length);
  deliver();
  return FT_OK;
}

size_t cdc_read(uint8_t *bytes, size_t capacity) { return take(&cdc.sent, bytes, capacity); }

bool cdc_loader_requested(void) { return cdc.loader_requested; }
