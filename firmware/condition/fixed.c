#include "condition/fixed.h"

#include "port/divide.h"

int32_t clamped_difference(int32_t a, int32_t b) {
  int32_t difference = (int32_t)((uint32_t)a - (uint32_t)b);
  bool overflows = ((a ^ b) & (a ^ difference)) < 0;
  if (!overflows) {
    return difference;
  }
  return a < 0 ? INT32_MIN : INT32_MAX;
}

int32_t part_of(int32_t value, int32_t share_q16) {
  uint32_t low = ((uint32_t)value & 0xFFFF) * (uint32_t)share_q16;
  return (value >> 16) * share_q16 + (int32_t)((low + 0x8000) >> 16);
}

int32_t share_in(int32_t ms, int32_t time_constant_ms) { return port_divide(ms << 16, time_constant_ms + ms); }

int32_t in_step(int32_t each_second, int32_t ms) { return (each_second >> 4) * ms >> 6; }
