/* Integer division with whatever the core has for it. For the main context and the worker's only (worker/worker.h): a
 * divider that is a peripheral, as the RP2040's, one for each processor, is not saved by interrupts. */
#pragma once

#ifdef PORT_DIVIDE_HEADER
#include PORT_DIVIDE_HEADER
#else
#include <stdint.h>

/* numerator / denominator, towards zero. denominator is not 0, and not -1 with INT32_MIN. */
static inline int32_t port_divide(int32_t numerator, int32_t denominator) {
  /* NOLINTNEXTLINE(clang-analyzer-core.DivideZero): see above */
  return numerator / denominator;
}
#endif
