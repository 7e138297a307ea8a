/* The pin by which a fingertip shares its clock with cameras and other fingertips. Provided by the board at link time,
 * in images with capability sync. Main context, unless stated otherwise. */
#pragma once

#include <stdbool.h>
#include <stdint.h>

enum port_sync {
  PORT_SYNC_OFF,    /* an input that is not read */
  PORT_SYNC_IN,     /* an input, pulled down; its edges are stamped */
  PORT_SYNC_FRAME,  /* an output, of port_sync_write() */
  PORT_SYNC_SECOND, /* an output, high for 0.1 s from each full second on; its edges are stamped */
};

/* From now on the pin is this, and the numbers of its edges begin again. While the processor saves
 * power it must be off. Before the first call it is off. */
void port_sync_set(enum port_sync mode);

/* In mode frame: the level. Any context; some 20 cycles. */
void port_sync_write(bool high);

struct port_sync_edge {
  uint64_t t_us;   /* when the pin changed, rounded; within 1 us of port_now_us() */
  uint32_t number; /* since the pin was set, from 1, modulo 2^32. An odd one rises */
};

/* The oldest edge that was not taken yet; false: there is none. It keeps PORT_SYNC_CAPACITY of them, and
 * what is older has left a gap in the numbers. Some 300 cycles, however fast edges come. */
#define PORT_SYNC_CAPACITY 48u
bool port_sync_take(struct port_sync_edge *edge);
