#include "condition/rest.h"

#include "common/apart.h"

#define INTERVAL_us 250000u

/* A sensor beyond its range counts as a contact. If no other feels it, it is the sensor. */
static bool is_touched(const struct frame *frame, const struct conditioned *conditioned) {
  return conditioned->contact &&
         (frame->saturated == 0 || conditioned->peak_Pa_q10 >= CONDITION_OPEN_Pa * 1024);
}

void rest_follow(struct rest *rest, const struct frame *frame,
                 const struct conditioned *conditioned) {
  const uint32_t usable = conditioned->usable;
  rest->apart &= frame->valid;
  if (is_touched(frame, conditioned) ||
      (usable == rest->compared && frame->t_us < rest->next_us)) {
    return;
  }
  int32_t pressure_Pa[FT_MAX_SENSORS];
  for (uint8_t k = 0; k < frame->sensor_count; k++) {
    pressure_Pa[k] = frame->pressure_Pa_q10[k] / 1024;
  }
  rest->apart = apart_find(pressure_Pa, usable, frame->sensor_count, rest->apart_Pa);
  rest->compared = usable;
  rest->next_us = frame->t_us + INTERVAL_us;
}
