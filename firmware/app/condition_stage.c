#include "app/condition_stage.h"

#include "config/geometry.h"

#include <string.h>

void condition_stage_process(struct condition_stage *own, struct findings *found) {
  condition_frame(&own->condition, &found->frame, own->has_gains ? &own->gains : NULL, &found->conditioned);
}

void condition_stage_follow(struct condition_stage *own, const struct findings *found) {
  condition_follow(&own->condition, &found->frame, &found->conditioned);
}

void condition_stage_put(const struct condition_stage *own, const struct findings *found, struct wire_raw *packet) {
  const struct frame *frame = &found->frame;
  packet->frame = frame->number;
  packet->flags = found->contact.flags;
  packet->valid = frame->held ? 0 : frame->valid;
  packet->saturated = frame->saturated;
  packet->doubtful = frame->held ? 0 : frame->doubtful;
  packet->temperature_cC = frame->temperature_cC;
  packet->sensor_count = frame->sensor_count;
  const size_t length = frame->sensor_count * sizeof packet->pressure_Pa_q10[0];
  memcpy(packet->pressure_Pa_q10, frame->pressure_Pa_q10, length);
  memcpy(packet->baseline_Pa_q10, own->condition.zero_Pa_q10, length);
}

void condition_stage_use_calibration(struct condition_stage *own, const struct calibration *calibration) {
  own->has_gains = calibration != NULL;
  for (unsigned k = 0; calibration && k < geometry.sensor_count; k++) {
    own->gains.inverse_q16[k] = (uint32_t)(65536.0f / calibration->sensors[k].gain + 0.5f);
  }
}
