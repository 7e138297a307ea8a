/* Whether anything touches the pad. The gate opens above GATE_OPEN_Pa + GATE_OPEN_SIGMA standard
 * deviations of the noise, and closes below GATE_CLOSE_Pa + GATE_CLOSE_SIGMA. A sensor's margin
 * comes on top of both. The pascals are for zeros that move without a touch: the compensation steps
 * by 60 Pa at 10 degC, and a temperature half a second old costs 24 to 48 Pa in fast warming. */
#ifndef CONDITION_GATE_H
#define CONDITION_GATE_H

#include "condition/constants.h"

#include <stdbool.h>
#include <stdint.h>

struct gate {
  bool pressed;                      /* a contact that is no remainder */
  uint32_t pressed_ms, released_ms;  /* since it began, and since it ended; at most a day */
  int32_t open_Pa_q10, close_Pa_q10; /* without the margins */
};

/* The readings of a frame: where usable, above the zero; and the strongest, 0 when none. */
struct gate_view {
  const int32_t *pressure_Pa_q10, *margin_Pa_q10; /* [sensor] */
  int32_t peak_Pa_q10;
  uint8_t strongest, count;
  bool saturated; /* any */
};

void gate_age(struct gate *gate, int32_t ms, int32_t noise_Pa_q10);

/* Returns whether a contact begins or ends with this frame. */
bool gate_update(struct gate *gate, const struct gate_view *view);

#endif
