#include "app/condition_stage.h"

#include "config/geometry.h"

#include <string.h>

void condition_stage_process(struct condition_stage *stage, struct findings *found) {
  condition_frame(&stage->condition, &found->frame, stage->has_gains ? &stage->gains : NULL, &found->conditioned);
}

void condition_stage_after_send(struct condition_stage *stage, const struct findings *found) {
  condition_follow(&stage->condition, &found->frame, &found->conditioned);
}

void condition_stage_fill(const struct condition_stage *stage, const struct findings *found, struct wire_raw *packet) {
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
  memcpy(packet->baseline_Pa_q10, stage->condition.zero_Pa_q10, length);
}

void condition_stage_use_calibration(struct condition_stage *stage, const struct calibration *calibration) {
  stage->has_gains = calibration != NULL;
  for (unsigned k = 0; calibration && k < geometry.sensor_count; k++) {
    stage->gains.inverse_q16[k] = (uint32_t)(65536.0f / calibration->sensors[k].gain + 0.5f);
  }
}
