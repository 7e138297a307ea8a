/* A PROM whose CRC-4 is right by chance makes pressures that are wrong by up to 65 kPa, always by the
 * same. A tare hides that, but not the wrong sensitivity behind it. At rest all sensors of a pad
 * feel the same air: one that reads apart from the others (common/apart.h) is doubtful, from the
 * first frame after a tare on and for as long as it does so. So is one that was tared under a
 * press. */
#ifndef CONDITION_REST_H
#define CONDITION_REST_H

#include "condition/condition.h"
#include "frame/frame.h"

#include <stdint.h>

struct rest {
  int32_t apart_Pa;  /* the floor, set by the caller */
  uint32_t apart;    /* bitmap: as of when nothing last touched the pad */
  uint32_t compared; /* bitmap */
  uint64_t next_us;  /* the next comparison not before */
};

/* To be called with each frame that is not held. Cost: as of apart_find(), four times a second while
 * nothing touches. */
void rest_follow(struct rest *rest, const struct frame *frame,
                 const struct conditioned *conditioned);

#endif
