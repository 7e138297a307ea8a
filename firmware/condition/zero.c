#include "condition/zero.h"

#include "port/divide.h"

#define ZERO_MAX (INT32_C(1) << 30) /* 1 MPa; the part ends near 0.5 */

#define TARE_SLOW_ms SECONDS(1)
#define TARE_FEWEST 3

#define SETTLE_ms MS(500)
#define SETTLE_LONGEST_ms ((uint32_t)SECONDS(15))
#define SETTLED_Pa 8 /* and a sigma */
#define SETTLE_SLOW 3

/* Of real sensors at rest: 130 to 210 Pa in 16 min, 0.22 Pa/s at most (strips of MPL3115A2). At
 * 0.31 Pa/s the level is too slow to know the drift after a minute. */
#define SLEW_SHIFT 1 /* 512 / 1024 Pa in a second */
#define FOLLOW_ms SECONDS(2)
#define KEEP_DOWN_SHIFT 2      /* less of a remainder downward: what dipped comes back */
#define DRIFT_FASTEST_q12 1280 /* 0.31 Pa/s */

#define BELOW_ms SECONDS(ZERO_BELOW_s) /* dips come back within it */
#define FAR_BELOW_Pa 1000
#define FAR_BELOW_ms MS(500)

#define SNAPSHOT_ms ((uint32_t)SECONDS(4))
#define SNAPSHOT_LONGEST_ms ((uint32_t)SECONDS(64))
#define DRIFT_LEAST_s 8
#define DRIFT_LONGEST_s 512
#define DRIFT_CHANGE_MAX_Pa 300
/* A drift seen for T s weighs T^2 / (T^2 + 16): its sd is 1 Pa / T, that of drifts 0.2 Pa/s. */
#define DRIFT_HALF_s2 16

void zero_begin_tare(struct zero *zero, uint32_t now_ms, int32_t spread_Pa_q10) {
  zero->spread_Pa_q10 = spread_Pa_q10;
  zero->drift_q16 = 0;
  zero->below_ms = 0;
  zero->tare_sum = 0;
  zero->tare_min = INT32_MAX;
  zero->tare_max = INT32_MIN;
  zero->tare_begun_ms = now_ms;
  zero->tare_left = ZERO_TARE_FRAMES;
}

/* By halves of 32 bits: |sum| < 2^47, and a remainder is less than the count. */
static int32_t mean_of(int64_t sum, int32_t count) {
  int32_t high = (int32_t)(sum >> 16);
  int32_t quotient = port_divide(high, count);
  int32_t rest = (high - quotient * count) * (1 << 16) + (int32_t)(sum & 0xFFFF);
  return quotient * (1 << 16) + port_divide(rest, count);
}

bool zero_take(struct zero *zero, uint32_t now_ms, int32_t reading_Pa_q10) {
  if (zero->tare_left == ZERO_TARE_FRAMES) {
    zero->tare_begun_ms = now_ms;
  }
  zero->tare_sum += reading_Pa_q10;
  if (reading_Pa_q10 < zero->tare_min) {
    zero->tare_min = reading_Pa_q10;
  }
  if (reading_Pa_q10 > zero->tare_max) {
    zero->tare_max = reading_Pa_q10;
  }
  zero->tare_left--;
  int32_t taken = ZERO_TARE_FRAMES - zero->tare_left;
  bool slow = now_ms - zero->tare_begun_ms >= (uint32_t)TARE_SLOW_ms;
  if (zero->tare_left > 0 && !(slow && taken >= TARE_FEWEST)) {
    return false;
  }
  int64_t sum = zero->tare_sum - zero->tare_min - zero->tare_max;
  zero->level_Pa_q10 = clamp(mean_of(sum, taken - 2), -ZERO_MAX, ZERO_MAX);
  return true;
}

bool zero_settle(struct zero *zero, const struct step *step) {
  int32_t left = zero->spread_Pa_q10;
  if (left <= size_of(step->above_Pa_q10)) {
    return false;
  }
  zero->level_Pa_q10 += step->above_Pa_q10;
  int32_t goal = SETTLE_SLOW * size_of(step->slow_Pa_q10);
  if (goal > left) {
    goal = left;
  }
  left += part_of(goal - left, share_in(step->ms, SETTLE_ms));
  bool settled =
      left < Pa_q10(SETTLED_Pa) + step->noise_Pa_q10 || step->now_ms - zero->tare_begun_ms > SETTLE_LONGEST_ms;
  zero->spread_Pa_q10 = settled ? 0 : left;
  return true;
}

int32_t zero_follow(struct zero *zero, const struct step *step, const struct zero_pace *pace,
                    int32_t *remainder_Pa_q10) {
  int32_t slew = step->ms >> SLEW_SHIFT;
  int32_t share = share_in(step->ms, FOLLOW_ms);
  int32_t most = slew + in_step(pace->above_Pa_q10, step->ms);
  int32_t crept = clamp(part_of(step->above_Pa_q10, share), -most, most);
  most = pace->keeps ? slew + in_step(pace->remainder_Pa_q10, step->ms) : 0;
  int32_t kept = clamp(part_of(*remainder_Pa_q10, share), -(most >> KEEP_DOWN_SHIFT), most);
  *remainder_Pa_q10 -= kept;
  zero->level_Pa_q10 += crept + kept;
  return crept + kept;
}

int32_t zero_drift_on(struct zero *zero, int32_t ms) {
  int32_t drift_q16 = zero->drift_rest_q16 + zero->drift_q16 * ms;
  zero->drift_rest_q16 = (uint16_t)drift_q16;
  zero->level_Pa_q10 += drift_q16 >> 16;
  return drift_q16 >> 16;
}

bool zero_is_below(struct zero *zero, int32_t ms, int32_t under_Pa_q10, bool *far) {
  *far = under_Pa_q10 > Pa_q10(FAR_BELOW_Pa);
  zero->below_ms = under_Pa_q10 > 0 ? (uint16_t)(zero->below_ms + ms) : 0;
  return zero->below_ms >= (*far ? FAR_BELOW_ms : BELOW_ms);
}

void zero_unsettle(struct zero *zero, bool gives_in) {
  zero->spread_Pa_q10 = larger(zero->spread_Pa_q10, Pa_q10(ZERO_WARM_Pa));
  if (gives_in) {
    zero->below_ms = BELOW_ms;
  }
}

/* When the room is full every other one goes, and the next come half as often; at last the oldest
 * goes. */
bool zero_snapshot_due(struct zero_calm *calm, uint32_t now_ms, struct zero_snapshot *snapshot) {
  if (calm->snapshots == 0) {
    calm->interval_ms = SNAPSHOT_ms;
  } else if (now_ms - calm->snapshot_ms[calm->snapshots - 1] < calm->interval_ms) {
    return false;
  }
  snapshot->every = 0;
  if (calm->snapshots == ZERO_SNAPSHOTS) {
    bool oldest_goes = calm->interval_ms >= SNAPSHOT_LONGEST_ms;
    snapshot->first = oldest_goes ? 1 : 0;
    snapshot->every = oldest_goes ? 1 : 2;
    calm->snapshots = oldest_goes ? ZERO_SNAPSHOTS - 1 : ZERO_SNAPSHOTS / 2;
    calm->interval_ms *= snapshot->every;
    for (uint8_t i = 0; i < calm->snapshots; i++) {
      calm->snapshot_ms[i] = calm->snapshot_ms[snapshot->first + snapshot->every * i];
    }
  }
  snapshot->slot = calm->snapshots++;
  calm->snapshot_ms[snapshot->slot] = now_ms;
  snapshot->span_ms = (int32_t)(now_ms - calm->snapshot_ms[0]);
  return true;
}

/* From the oldest level to this one, once that is long enough to see a drift. */
static void see_drift(struct zero *zero, int32_t span_ms) {
  int32_t span_s = span_ms >> 10;
  if (span_s < DRIFT_LEAST_s) {
    return;
  }
  span_s = span_s < DRIFT_LONGEST_s ? span_s : DRIFT_LONGEST_s;
  int32_t weight_q12 = port_divide((span_s * span_s) << 12, span_s * span_s + DRIFT_HALF_s2);
  int32_t change = clamped_difference(zero->level_Pa_q10, zero->snapshot_Pa_q10[0]);
  change = clamp(change, -Pa_q10(DRIFT_CHANGE_MAX_Pa), Pa_q10(DRIFT_CHANGE_MAX_Pa));
  int32_t drift_q12 = port_divide(change * (1 << 12), span_ms);
  bool is_drift = drift_q12 < DRIFT_FASTEST_q12 && drift_q12 > -DRIFT_FASTEST_q12;
  zero->drift_q16 = is_drift ? (drift_q12 * weight_q12) >> 8 : 0;
}

void zero_take_snapshot(struct zero *zero, const struct zero_snapshot *snapshot) {
  for (uint8_t i = 0; snapshot->every != 0 && i < snapshot->slot; i++) {
    zero->snapshot_Pa_q10[i] = zero->snapshot_Pa_q10[snapshot->first + snapshot->every * i];
  }
  zero->snapshot_Pa_q10[snapshot->slot] = zero->level_Pa_q10;
  see_drift(zero, snapshot->span_ms);
}
