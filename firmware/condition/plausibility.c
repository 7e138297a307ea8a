#include "condition/plausibility.h"

#include "common/apart.h"
#include "common/limits.h"

#define INTERVAL_us 2000000u /* between two comparisons */

bool plausibility_compare(struct plausibility *plausibility, const struct frame *frame, const struct conditioned *conditioned) {
  const sensor_map usable = conditioned->usable;
  if (usable == plausibility->compared && frame->t_us < plausibility->next_us) {
    return false;
  }
  int32_t pressure_Pa[FT_MAX_SENSORS];
  sensor_map no_air = 0;
  for (uint8_t k = 0; k < frame->sensor_count; k++) {
    pressure_Pa[k] = frame->pressure_Pa_q10[k] / 1024;
    no_air |= pressure_Pa[k] < FT_AIR_MIN_Pa || pressure_Pa[k] > FT_AIR_MAX_Pa ? usable & sensor_bit(k) : 0;
  }
  plausibility->apart = no_air | apart_find(pressure_Pa, usable, frame->sensor_count, plausibility->apart_Pa);
  plausibility->compared = usable;
  plausibility->next_us = frame->t_us + INTERVAL_us;
  return true;
}
