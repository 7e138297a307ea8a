/* The drift of each sensor's baseline in idle time, in which nothing touches and every baseline keeps up: from snapshots of the
 * baselines of all sensors. In a contact, where the baseline cannot follow, it goes on. */
#pragma once

#include "condition/constants.h"

#include <stdbool.h>
#include <stdint.h>

/* When the snapshots were taken, of all sensors at once. */
struct snapshot_times {
  uint32_t snapshot_ms[SNAPSHOTS];
  uint32_t interval_ms;
  uint8_t count;
};

/* Of one sensor. */
struct drift {
  int32_t drift_q16; /* of the baseline, 1/1024 Pa in 1.024 ms */
  uint16_t rest_q16;
  int32_t snapshot_Pa_q10[SNAPSHOTS]; /* of the baseline */
};

struct snapshot {
  uint8_t slot;    /* it goes there, */
  uint8_t first;   /* after the older ones have moved up: of these the first, */
  uint8_t every;   /* and each one that is this far behind the one before; 0: none has to move */
  int32_t span_ms; /* from the oldest that is left */
};

/* Whether a snapshot of all baselines is due, and which. */
bool drift_snapshot_is_due(struct snapshot_times *taken, uint32_t now_ms, struct snapshot *snapshot);

/* Takes it of one sensor, and sets its drift. */
void drift_take(struct drift *drift, int32_t baseline_Pa_q10, const struct snapshot *snapshot);

/* By how much the baseline has drifted in this time. */
static inline int32_t drift_in(struct drift *drift, int32_t ms) {
  const int32_t drift_q16 = drift->rest_q16 + drift->drift_q16 * ms;
  drift->rest_q16 = (uint16_t)drift_q16;
  return drift_q16 >> 16;
}
