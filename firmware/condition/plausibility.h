/* Whether a sensor's readings are plausible beside those of the others while nothing touches.
 *
 * A PROM whose CRC-4 is right by chance makes pressures that are wrong by up to 65 kPa, always by the same. A tare
 * hides that, but not the wrong sensitivity behind it. At rest all sensors of a pad measure the same air: one that
 * reads apart from the others (common/apart.h), or what no air has, is doubtful, from the first frame after a tare on
 * and for as long as it does so. So is one that was tared under a press, and an array of parts of another range. */
#pragma once

#include "condition/condition.h"
#include "frame/frame.h"

#include <stdbool.h>
#include <stdint.h>

struct plausibility {
  int32_t apart_Pa;    /* the floor, set by the caller */
  sensor_map apart;    /* bitmap: when nothing last touched the pad */
  sensor_map compared; /* bitmap */
  uint64_t next_us;    /* the next comparison not before */
};

bool plausibility_compare(struct plausibility *plausibility, const struct frame *frame, const struct conditioned *conditioned);

/* Call with each frame that is not held. Returns whether .apart may have changed: not while readings are unsettled. Cost: 10 Cortex-M0+
 * cycles in a contact, else as of apart_find(), once in two seconds. */
static inline bool plausibility_follow(struct plausibility *plausibility, const struct frame *frame,
                                       const struct conditioned *conditioned) {
  return !conditioned->contact && !frame->unsettled && plausibility_compare(plausibility, frame, conditioned);
}
