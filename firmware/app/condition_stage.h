/* Stage: pressure above the zero, and whether anything touches (condition/condition.h). Reads findings.frame. Writes
 * findings.conditioned. */
#pragma once

#include "app/findings.h"
#include "common/calibration.h"
#include "wire/packet.h"

struct condition_stage {
  bool has_gains;
  struct condition condition;
  struct condition_gains gains; /* of the calibration in use */
};

void condition_stage_process(struct condition_stage *stage, struct findings *found);

/* After the frame's packets. */
void condition_stage_after_send(struct condition_stage *stage, const struct findings *found);

/* Fills in a raw packet. */
void condition_stage_fill(const struct condition_stage *stage, const struct findings *found, struct wire_raw *packet);

/* The gains of this calibration are in use from the next frame on; NULL: all sensors are alike. */
void condition_stage_use_calibration(struct condition_stage *stage, const struct calibration *calibration);
