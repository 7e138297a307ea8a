#include "condition/drift.h"

#include "port/divide.h"

/* The weight of a drift that was measured for T s is T^2 / (T^2 + this): its standard deviation is BASELINE_SD / T, that
 * of all drifts is DRIFT_SD. */
#define DRIFT_HALF_s2 ((BASELINE_SD_mPa / DRIFT_SD_mPa_s) * (BASELINE_SD_mPa / DRIFT_SD_mPa_s))

/* When all slots are in use every other one goes, and the next come half as often; at last the oldest goes. */
bool drift_snapshot_is_due(struct snapshot_times *taken, uint32_t now_ms, struct snapshot *snapshot) {
  if (taken->count == 0) {
    taken->interval_ms = SNAPSHOT_ms;
  } else if (now_ms - taken->snapshot_ms[taken->count - 1] < taken->interval_ms) {
    return false;
  }
  snapshot->every = 0;
  if (taken->count == SNAPSHOTS) {
    const bool oldest_goes = taken->interval_ms >= SNAPSHOT_LONGEST_ms;
    snapshot->first = oldest_goes ? 1 : 0;
    snapshot->every = oldest_goes ? 1 : 2;
    taken->count = oldest_goes ? SNAPSHOTS - 1 : SNAPSHOTS / 2;
    taken->interval_ms *= snapshot->every;
    for (uint8_t i = 0; i < taken->count; i++) {
      taken->snapshot_ms[i] = taken->snapshot_ms[snapshot->first + snapshot->every * i];
    }
  }
  snapshot->slot = taken->count++;
  taken->snapshot_ms[snapshot->slot] = now_ms;
  snapshot->span_ms = (int32_t)(now_ms - taken->snapshot_ms[0]);
  return true;
}

/* From the oldest baseline to this one, once that is long enough to show a drift. */
static void set_drift(struct drift *drift, int32_t baseline_Pa_q10, int32_t span_ms) {
  int32_t span_s = span_ms >> 10;
  if (span_s < DRIFT_LEAST_s) {
    return;
  }
  span_s = span_s < DRIFT_LONGEST_s ? span_s : DRIFT_LONGEST_s;
  const int32_t weight_q12 = port_divide((span_s * span_s) << 12, span_s * span_s + DRIFT_HALF_s2);
  int32_t change = clamped_difference(baseline_Pa_q10, drift->snapshot_Pa_q10[0]);
  change = clamp(change, -Pa_q10(DRIFT_CHANGE_MAX_Pa), Pa_q10(DRIFT_CHANGE_MAX_Pa));
  const int32_t drift_q12 = port_divide(change * (1 << 12), span_ms);
  const bool is_drift = drift_q12 < DRIFT_FASTEST_q12 && drift_q12 > -DRIFT_FASTEST_q12;
  drift->drift_q16 = is_drift ? (drift_q12 * weight_q12) >> 8 : 0;
}

void drift_take(struct drift *drift, int32_t baseline_Pa_q10, const struct snapshot *snapshot) {
  for (uint8_t i = 0; snapshot->every != 0 && i < snapshot->slot; i++) {
    drift->snapshot_Pa_q10[i] = drift->snapshot_Pa_q10[snapshot->first + snapshot->every * i];
  }
  drift->snapshot_Pa_q10[snapshot->slot] = baseline_Pa_q10;
  set_drift(drift, baseline_Pa_q10, snapshot->span_ms);
}
