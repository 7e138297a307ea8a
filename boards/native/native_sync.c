#include "native/native_sync.h"

#include "port/port.h"

#include <string.h>

static struct {
  enum port_sync mode;
  bool level;
  unsigned pulses;
  uint32_t newest, taken;            /* numbers */
  uint64_t t_us[PORT_SYNC_CAPACITY]; /* of the newest edges */
} native;

void native_sync_reset(void) { memset(&native, 0, sizeof native); }

void native_sync_edge(void) {
  if (native.mode == PORT_SYNC_IN || native.mode == PORT_SYNC_SECOND) {
    native.t_us[native.newest % PORT_SYNC_CAPACITY] = port_now_us();
    native.newest++;
  }
}

enum port_sync native_sync_mode(void) { return native.mode; }

unsigned native_sync_pulses(void) { return native.pulses; }

void port_sync_set(enum port_sync mode) {
  native.mode = mode;
  native.level = false;
  native.newest = native.taken = 0;
}

void port_sync_write(bool high) {
  native.pulses += high && !native.level;
  native.level = high;
}

bool port_sync_take(struct port_sync_edge *edge) {
  if (native.newest - native.taken > PORT_SYNC_CAPACITY) {
    native.taken = native.newest - PORT_SYNC_CAPACITY;
  }
  if (native.newest == native.taken) {
    return false;
  }
  edge->t_us = native.t_us[native.taken % PORT_SYNC_CAPACITY];
  edge->number = ++native.taken;
  return true;
}
