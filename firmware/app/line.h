/* The connection to the host: packets in and out, one at a time. */
#pragma once

#include "common/status.h"
#include "wire/packet.h"

#include <stdint.h>

struct line {
  uint16_t sequence;
  uint32_t sent, dropped;                            /* packets */
  struct wire_packet packet;                         /* the command that has come, or what is to be sent */
  _Alignas(4) uint8_t out[WIRE_MAX_FRAME_BYTES + 3]; /* filled up to whole words */
  struct wire_receiver receiver;
};

/* Sends .packet.body, or drops it where the queue is full: a sequence number is used all the same, so that the host sees the gap. */
void line_send(struct line *line, const struct wire_layout *layout, uint64_t t_us);
