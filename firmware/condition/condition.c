#include "condition/condition.h"

#include "port/divide.h"

#include <string.h>

/* Units of 1.024 ms, which a shift makes of microseconds. */
#define MS(ms) ((int32_t)((ms)*INT64_C(1000) / 1024))
#define SECONDS(s) MS(INT64_C(1000) * (s))
#define Pa_q10(Pa) (1024 * (Pa))

#define STEP_MAX_ms 16383 /* a longer gap counts as this */
#define TRACK_ms 64       /* each sensor is tracked so often; at lower rates with every frame */
#define AGE_MAX_ms ((uint32_t)SECONDS(86400))

#define TARE_SLOW_ms SECONDS(1)
#define TARE_FEWEST 3

/* Of real sensors at rest: 130 to 210 Pa in 16 min, 0.22 Pa/s at most (source as in condition.h).
 * The zero may follow at 0.5 Pa/s, 512 / 1024 in a second: at 0.31 it is too slow to know the drift
 * after a minute. What drifted in a contact is taken to be up to 0.24 Pa/s of it, 900 Pa at most.
 */
#define DRIFT_SLEW_SHIFT 1
#define DRIFT_IN_CONTACT_SHIFT 2
#define DRIFT_IN_CONTACT_MAX_Pa 900
#define DRIFT_FASTEST_q12 1280 /* 0.31 Pa/s */
#define DRIFT_GOES_ON_ms ((uint32_t)SECONDS(3600))

#define IDLE_ms SECONDS(2)     /* time constants of the level, */
#define FOLLOW_ms MS(700)      /* of the remainder, */
#define FOLLOW_DOWN_ms MS(100) /* when a force goes at last, */
/* In TRACK_ms a remainder rises by less than so much noise, and falls by less than so much and a
 * quarter of it. */
#define STILL_SIGMA 3
#define FALL_SHIFT 2
#define WANDER_ms SECONDS(120) /* and of what it counts as risen lately */
/* What a reading rises by less than 16 Pa/s, 2^4, may be a drift: some real sensors crept by 2 kPa
 * in minutes. Seen through a low pass, or the noise would be clipped too. */
#define CREEPING_SHIFT 4
#define CREEPING_ms SECONDS(1)
#define CREPT_MAX_Pa 2500
/* A contact so many times what its zeros have taken lately is off by a fifth at most. What they
 * took of it itself counts twice, for where it then moves they are off as before. At 5 holds of the
 * real strips are in doubt. */
#define TAKEN_FACTOR 4
#define WARM_ms SECONDS(8)
#define WARM_SHIFT 3 /* share of what may have moved that does in a second */
#define MEMORY_ms SECONDS(CONDITION_MEMORY_s)
#define FRESH_ms ((uint32_t)SECONDS(CONDITION_FRESH_s))
#define WARM_FRESH_ms ((uint32_t)SECONDS(6)) /* sensors rise by 130 Pa in the first 5 s */

#define BAND_SHIFT 3   /* of the memory: the remainder, and what closes the gate, */
#define DIP_SHIFT 2    /* the remainder below zero, */
#define REOPEN_SHIFT 4 /* and what a sudden press must exceed later */
/* Share of the strongest sensor's memory that counts for all: far sensors stand off by 2 % of a
 * peak that they hardly felt. */
#define CROSS_SHIFT 1
#define KEEP_SHIFT 8 /* share of the memory that the level takes of the remainder in a second */
#define KEEP_DOWN_SHIFT 2 /* less of it downward: what dipped comes back */
#define CREEP_SHIFT 10    /* and of what the remainder does not follow */

#define BELOW_ms SECONDS(CONDITION_BELOW_s) /* dips come back within it */
#define FAR_BELOW_Pa 1000
#define FAR_BELOW_ms MS(500)
#define RETURN_MAX_Pa 600 /* a sensor tared after being below may come back by this, in doubt */

#define SATURATED_Pa 100000

/* A sensor that has lost its state, or a wrong temperature, is found out within so long; a zero
 * taken meanwhile is not its own. */
#define FOUND_OUT_ms ((uint32_t)SECONDS(5))
#define TARE_WAITS_ms ((uint32_t)SECONDS(8))

#define CALM_AFTER_TARE_ms ((uint32_t)SECONDS(3))
#define CALM_AFTER_RELEASE_ms ((uint32_t)SECONDS(60)) /* what rubber keeps goes slowly */
#define CALM_LAG_Pa 2 /* and half a sigma: three sigmas of a mean at the least rate */
#define SNAPSHOT_ms ((uint32_t)SECONDS(4))
#define SNAPSHOT_LONGEST_ms ((uint32_t)SECONDS(64))
#define DRIFT_LEAST_s 8
#define DRIFT_LONGEST_s 512
#define DRIFT_CHANGE_MAX_Pa 300
/* A drift seen for T s weighs T^2 / (T^2 + 16): its sd is 1 Pa / T, that of drifts 0.2 Pa/s. */
#define DRIFT_HALF_s2 16

#define SUM_RANGE (INT32_C(1) << 23)  /* of a reading in a mean: 8 kPa */
#define ZERO_MAX (INT32_C(1) << 30)   /* 1 MPa; the part ends near 0.5 */
#define GAINED_MAX (INT32_C(1) << 29) /* before the gain */

static int32_t clamp(int32_t value, int32_t lowest, int32_t highest) {
  return value < lowest ? lowest : value > highest ? highest : value;
}

static void begin_tare(struct condition *condition, uint8_t k) {
  condition->tare_sum[k] = 0;
  condition->tare_min[k] = INT32_MAX;
  condition->tare_max[k] = INT32_MIN;
  condition->tare_left[k] = CONDITION_TARE_FRAMES;
  condition->tare_begun_ms[k] = condition->now_ms;
  condition->taring |= UINT32_C(1) << k;
  condition->guessed &= ~(UINT32_C(1) << k);
  condition->memory_Pa_q10[k] = 0;
  condition->reached_Pa_q10[k] = 0;
  condition->margin_Pa_q10[k] = 0;
  condition->risen_Pa_q10[k] = 0;
  condition->crept_Pa_q10[k] = 0;
  condition->sum_Pa_q10[k] = 0;
  condition->drift_q16[k] = 0;
  condition->below_ms[k] = 0;
  condition->summed[k] = 0;
  uint32_t others = ~(UINT32_C(1) << k);
  condition->restless &= others;
  condition->stands_off &= others;
  condition->below &= others;
}

void condition_tare(struct condition *condition) {
  memset(condition, 0, sizeof *condition);
  condition->released_ms = AGE_MAX_ms;
  for (uint8_t k = 0; k < FT_MAX_SENSORS; k++) {
    begin_tare(condition, k);
  }
}

/* By halves of 32 bits: |sum| < 2^47, and a remainder is less than the count. */
static int32_t mean_of(int64_t sum, int32_t count) {
  int32_t high = (int32_t)(sum >> 16);
  int32_t quotient = port_divide(high, count);
  int32_t rest = (high - quotient * count) * (1 << 16) + (int32_t)(sum & 0xFFFF);
  return quotient * (1 << 16) + port_divide(rest, count);
}

static void tare_step(struct condition *condition, uint8_t k, int32_t pressure_Pa_q10) {
  if (condition->tare_left[k] == CONDITION_TARE_FRAMES) {
    condition->tare_begun_ms[k] = condition->now_ms;
  }
  condition->tare_sum[k] += pressure_Pa_q10;
  if (pressure_Pa_q10 < condition->tare_min[k]) {
    condition->tare_min[k] = pressure_Pa_q10;
  }
  if (pressure_Pa_q10 > condition->tare_max[k]) {
    condition->tare_max[k] = pressure_Pa_q10;
  }
  condition->tare_left[k]--;
  int32_t taken = CONDITION_TARE_FRAMES - condition->tare_left[k];
  bool slow = condition->now_ms - condition->tare_begun_ms[k] >= (uint32_t)TARE_SLOW_ms;
  if (condition->tare_left[k] > 0 && !(slow && taken >= TARE_FEWEST)) {
    return;
  }
  condition->taring &= ~(UINT32_C(1) << k);
  int64_t sum = condition->tare_sum[k] - condition->tare_min[k] - condition->tare_max[k];
  condition->level_Pa_q10[k] = condition->zero_Pa_q10[k] =
      clamp(mean_of(sum, taken - 2), -ZERO_MAX, ZERO_MAX);
  condition->before_Pa_q10[k] = condition->slow_Pa_q10[k] = condition->zero_Pa_q10[k];
  condition->tracked_ms[k] = condition->now_ms;
  condition->tared_ms = 0;
  condition->snapshots = 0;
  condition->warm_Pa_q10 = Pa_q10(CONDITION_WARM_Pa);
}

static int32_t clamped_difference(int32_t a, int32_t b) {
  int32_t difference = (int32_t)((uint32_t)a - (uint32_t)b);
  bool overflows = ((a ^ b) & (a ^ difference)) < 0;
  if (!overflows) {
    return difference;
  }
  return a < 0 ? INT32_MIN : INT32_MAX;
}

/* value times a share below 1, to the nearest. */
static int32_t part_of(int32_t value, int32_t share_q16) {
  uint32_t low = ((uint32_t)value & 0xFFFF) * (uint32_t)share_q16;
  return (value >> 16) * share_q16 + (int32_t)((low + 0x8000) >> 16);
}

/* What a low pass takes of a difference in this time. */
static int32_t share_in(int32_t step_ms, int32_t time_constant_ms) {
  return port_divide(step_ms << 16, time_constant_ms + step_ms);
}

static int32_t faded(int32_t value, int32_t step_ms, int32_t time_constant_ms) {
  return value - part_of(value, share_in(step_ms, time_constant_ms));
}

/* value / gain, |value| <= 2^29 and 1 / gain <= 4, to 1/1024 Pa below. */
static int32_t scaled_by(int32_t value, uint32_t inverse_q16) {
  uint32_t low = (uint32_t)value & 0xFFFF;
  return (value >> 16) * (int32_t)inverse_q16 + (int32_t)(low * (inverse_q16 >> 16)) +
         (int32_t)(low * (inverse_q16 & 0xFFFF) >> 16);
}

/* So much a second makes so much in this time. */
static int32_t in_step(int32_t each_second, int32_t step_ms) {
  return (each_second >> 4) * step_ms >> 6;
}

static uint32_t older(uint32_t age_ms, int32_t step_ms) {
  return age_ms < AGE_MAX_ms ? age_ms + (uint32_t)step_ms : age_ms;
}

static void set_bit(uint32_t *bitmap, uint8_t k, bool set) {
  *bitmap = (*bitmap & ~(UINT32_C(1) << k)) | (uint32_t)set << k;
}

static int32_t drift_in_contact(const struct condition *condition) {
  uint32_t drift = condition->pressed_ms >> DRIFT_IN_CONTACT_SHIFT;
  return drift < Pa_q10(DRIFT_IN_CONTACT_MAX_Pa) ? (int32_t)drift : Pa_q10(DRIFT_IN_CONTACT_MAX_Pa);
}

/* Of the memory, or of that of the whole pad. */
static int32_t in_all(int32_t memory, int32_t of_pad) {
  int32_t crossed = of_pad >> CROSS_SHIFT;
  return memory > crossed ? memory : crossed;
}

static void track_pressed(struct condition *condition, uint8_t k, int32_t step_ms, int32_t steady) {
  int32_t reached = faded(condition->reached_Pa_q10[k], step_ms, MEMORY_ms);
  reached = steady > reached ? steady : reached;
  condition->reached_Pa_q10[k] = reached;
  if (reached > condition->pad_reached_Pa_q10) {
    condition->pad_reached_Pa_q10 = reached;
  }
  condition->margin_Pa_q10[k] = in_all(reached, condition->pad_reached_Pa_q10) >> BAND_SHIFT;
  condition->risen_Pa_q10[k] = faded(condition->risen_Pa_q10[k], step_ms, WANDER_ms);
  condition->below_ms[k] = 0;
  condition->sum_Pa_q10[k] = 0;
  condition->summed[k] = 0;
  set_bit(&condition->below, k, false);
  if (condition->pressed_ms < DRIFT_GOES_ON_ms) {
    int32_t drift_q16 = condition->drift_rest_q16[k] + condition->drift_q16[k] * step_ms;
    condition->drift_rest_q16[k] = (uint16_t)drift_q16;
    condition->level_Pa_q10[k] += drift_q16 >> 16;
    condition->zero_Pa_q10[k] += drift_q16 >> 16;
  }
}

static void watch_below(struct condition *condition, uint8_t k, int32_t step_ms,
                        int32_t above_level, int32_t lowest) {
  int32_t under = lowest - above_level;
  bool below = under > 0;
  set_bit(&condition->below, k, below);
  if (!below) {
    condition->below_ms[k] = 0;
    return;
  }
  condition->below_ms[k] = (uint16_t)(condition->below_ms[k] + step_ms);
  bool far = under > Pa_q10(FAR_BELOW_Pa);
  if (condition->below_ms[k] >= (far ? FAR_BELOW_ms : BELOW_ms)) {
    /* It was tared under a press, and so were the others that are below now. */
    uint32_t others = far ? condition->below : 0;
    for (uint8_t j = 0; others != 0; j++, others >>= 1) {
      condition->below_ms[j] = others & 1u ? BELOW_ms : condition->below_ms[j];
    }
    begin_tare(condition, k);
    condition->memory_Pa_q10[k] = clamp(-above_level, 0, Pa_q10(RETURN_MAX_Pa)) << BAND_SHIFT;
  }
}

/* Of one sensor, when it is tracked. */
struct look {
  int32_t step_ms;
  int32_t above_zero;
  int32_t calm_lag; /* so far the level may lag in a calm */
  bool moves;       /* as a press or a release does, since it was looked at last */
};

/* While nothing touches for certain, or a touch looks like a drift (unsure). */
static void track_free(struct condition *condition, uint8_t k, const struct look *look) {
  bool unsure = condition->unsure;
  int32_t memory = in_all(condition->memory_Pa_q10[k], condition->pad_memory_Pa_q10);
  int32_t warm = condition->warm_Pa_q10;
  bool fresh = condition->released_ms < FRESH_ms || condition->tared_ms < WARM_FRESH_ms;
  int32_t step_ms = look->step_ms;
  int32_t above_zero = look->above_zero;
  if (condition->summed[k] > 0) {
    above_zero = port_divide(condition->sum_Pa_q10[k], condition->summed[k]);
  }
  condition->sum_Pa_q10[k] = 0;
  condition->summed[k] = 0;
  int32_t remainder = condition->zero_Pa_q10[k] - condition->level_Pa_q10[k];
  int32_t above_level = above_zero + remainder;
  int32_t deepest = -((memory >> DIP_SHIFT) + warm);

  int32_t slew = step_ms >> DRIFT_SLEW_SHIFT;
  int32_t creep = slew, keep = 0;
  if (!unsure) {
    int32_t goal = clamp(above_level, deepest, (memory >> BAND_SHIFT) + warm);
    int32_t highest = remainder > 0 ? remainder : 0;
    if ((!fresh || look->moves) && goal > highest) {
      goal = highest;
    }
    int32_t follow_ms = goal > remainder || remainder < 0 ? FOLLOW_ms : FOLLOW_DOWN_ms;
    remainder += part_of(goal - remainder, share_in(step_ms, follow_ms));
    int32_t warming = in_step(warm >> WARM_SHIFT, step_ms);
    creep += in_step(memory >> CREEP_SHIFT, step_ms) + warming;
    keep = slew + (fresh ? 0 : in_step(memory >> KEEP_SHIFT, step_ms)) + warming;
  }
  int32_t idle_share = share_in(step_ms, IDLE_ms);
  int32_t crept = clamp(part_of(above_zero, idle_share), -creep, creep);
  int32_t kept = clamp(part_of(remainder, idle_share), -(keep >> KEEP_DOWN_SHIFT), keep);
  condition->level_Pa_q10[k] += crept + kept;
  condition->zero_Pa_q10[k] = condition->level_Pa_q10[k] + remainder - kept;
  int32_t risen = faded(condition->risen_Pa_q10[k], step_ms, WANDER_ms) + crept + kept;
  condition->risen_Pa_q10[k] = risen;

  condition->margin_Pa_q10[k] = unsure  ? 0
                                : fresh ? (memory >> BAND_SHIFT) + warm
                                        : (memory >> REOPEN_SHIFT) + (warm >> 2);
  set_bit(&condition->restless, k, above_level > look->calm_lag || above_level < -look->calm_lag);
  set_bit(&condition->stands_off, k, remainder + risen > Pa_q10(CONDITION_OPEN_Pa));
  watch_below(condition, k, step_ms, above_level, deepest - condition->open_Pa_q10);
}

/* The drift of each sensor from the oldest to the latest level, while there is a calm to see it. */
static void see_drift(struct condition *condition, uint8_t count) {
  uint8_t latest = (uint8_t)(condition->snapshots - 1);
  int32_t span_ms = (int32_t)(condition->snapshot_ms[latest] - condition->snapshot_ms[0]);
  int32_t span_s = span_ms >> 10;
  if (span_s < DRIFT_LEAST_s) {
    return;
  }
  span_s = span_s < DRIFT_LONGEST_s ? span_s : DRIFT_LONGEST_s;
  int32_t weight_q12 = port_divide((span_s * span_s) << 12, span_s * span_s + DRIFT_HALF_s2);
  for (uint8_t k = 0; k < count; k++) {
    int32_t change =
        clamped_difference(condition->snapshot_Pa_q10[latest][k], condition->snapshot_Pa_q10[0][k]);
    change = clamp(change, -Pa_q10(DRIFT_CHANGE_MAX_Pa), Pa_q10(DRIFT_CHANGE_MAX_Pa));
    int32_t drift_q12 = port_divide(change * (1 << 12), span_ms);
    bool is_drift = drift_q12 < DRIFT_FASTEST_q12 && drift_q12 > -DRIFT_FASTEST_q12;
    condition->drift_q16[k] = is_drift ? (drift_q12 * weight_q12) >> 8 : 0;
  }
}

/* When the room is full every other one goes, and the next come half as often; at last the oldest
 * goes. */
static void take_snapshot(struct condition *condition, uint8_t count) {
  if (condition->snapshots == CONDITION_SNAPSHOTS) {
    bool oldest_goes = condition->snapshot_interval_ms >= SNAPSHOT_LONGEST_ms;
    uint8_t left = oldest_goes ? CONDITION_SNAPSHOTS - 1 : CONDITION_SNAPSHOTS / 2;
    for (uint8_t i = 0; i < left; i++) {
      uint8_t from = oldest_goes ? (uint8_t)(i + 1) : (uint8_t)(2 * i);
      memmove(condition->snapshot_Pa_q10[i], condition->snapshot_Pa_q10[from],
              count * sizeof condition->level_Pa_q10[0]);
      condition->snapshot_ms[i] = condition->snapshot_ms[from];
    }
    condition->snapshots = left;
    condition->snapshot_interval_ms *= oldest_goes ? 1u : 2u;
  }
  memcpy(condition->snapshot_Pa_q10[condition->snapshots], condition->level_Pa_q10,
         count * sizeof condition->level_Pa_q10[0]);
  condition->snapshot_ms[condition->snapshots] = condition->now_ms;
  condition->snapshots++;
  see_drift(condition, count);
}

static void watch_calm(struct condition *condition, const struct conditioned *conditioned,
                       uint8_t count) {
  bool calm = !condition->pressed && conditioned->tared &&
              (condition->restless & conditioned->usable) == 0 &&
              condition->tared_ms >= CALM_AFTER_TARE_ms &&
              condition->released_ms >= CALM_AFTER_RELEASE_ms;
  if (!calm) {
    return;
  }
  if (condition->snapshots == 0) {
    condition->snapshot_interval_ms = SNAPSHOT_ms;
  } else if (condition->now_ms - condition->snapshot_ms[condition->snapshots - 1] <
             condition->snapshot_interval_ms) {
    return;
  }
  take_snapshot(condition, count);
}

/* Adds up what it creeps, but for a sure press on it: that relaxes. */
static void watch_creep(struct condition *condition, uint8_t k, int32_t step_ms, int32_t reading) {
  int32_t change = clamped_difference(reading, condition->slow_Pa_q10[k]);
  change = part_of(clamp(change, -GAINED_MAX, GAINED_MAX), share_in(step_ms, CREEPING_ms));
  condition->slow_Pa_q10[k] += change;
  int32_t crept = condition->crept_Pa_q10[k];
  crept = condition->pressed ? crept : faded(crept, step_ms, WANDER_ms);
  int32_t most = step_ms << CREEPING_SHIFT;
  condition->crept_Pa_q10[k] = clamp(crept + clamp(change, -most, most), 0, Pa_q10(CREPT_MAX_Pa));
}

/* Whether it feels more than its zero has wandered, or it has crept. */
static void look_how_firm(struct condition *condition, const struct conditioned *conditioned,
                          uint8_t k) {
  int32_t risen = condition->risen_Pa_q10[k];
  int32_t wandered = risen < 0 ? -risen : risen;
  set_bit(&condition->firm, k,
          conditioned->pressure_Pa_q10[k] > condition->open_Pa_q10 + 3 * wandered / 2);
  int32_t crept = condition->crept_Pa_q10[k];
  set_bit(&condition->sudden, k,
          conditioned->pressure_Pa_q10[k] > condition->open_Pa_q10 + 3 * crept / 2);
}

/* By so much a zero may be off: what it took of a touch that came on within the band, or was left
 * there. The zeros stand in a contact, and with them this. */
static int32_t taken_into_zeros(const struct condition *condition, uint32_t usable, uint8_t count) {
  int32_t most = 0;
  for (uint8_t k = 0; k < count; k++, usable >>= 1) {
    int32_t taken =
        condition->zero_Pa_q10[k] - condition->level_Pa_q10[k] + condition->risen_Pa_q10[k];
    taken = taken < 0 ? -taken : taken;
    most = usable & 1u && taken > most ? taken : most;
  }
  return most;
}

static void press_or_release(struct condition *condition, const struct conditioned *conditioned,
                             uint8_t count, bool over) {
  if (over == condition->pressed) {
    return;
  }
  condition->pressed = over;
  if (over) {
    condition->pressed_ms = 0;
    for (uint8_t k = 0; k < count; k++) {
      look_how_firm(condition, conditioned, k);
    }
    int32_t taken = taken_into_zeros(condition, conditioned->usable, count);
    int32_t of_this = taken - condition->taken_before_Pa_q10;
    condition->strong_Pa_q10 = TAKEN_FACTOR * (of_this > 0 ? taken + of_this : taken);
    condition->snapshots = 0;
    condition->pad_reached_Pa_q10 = 0;
    memset(condition->reached_Pa_q10, 0, sizeof condition->reached_Pa_q10);
    memset(condition->margin_Pa_q10, 0, sizeof condition->margin_Pa_q10);
    return;
  }
  condition->released_ms = 0;
  int32_t drift = drift_in_contact(condition);
  if (drift > condition->warm_Pa_q10) {
    condition->warm_Pa_q10 = drift;
  }
}

static void track_sensor(struct condition *condition, const struct frame *frame,
                         const struct conditioned *conditioned, uint8_t k) {
  uint32_t bit = UINT32_C(1) << k;
  uint32_t gap_ms = condition->now_ms - condition->tracked_ms[k];
  int32_t step_ms = gap_ms < STEP_MAX_ms ? (int32_t)gap_ms : STEP_MAX_ms;
  condition->tracked_ms[k] = condition->now_ms;
  if (k == 0) {
    condition->pad_memory_Pa_q10 = faded(condition->pad_memory_Pa_q10, step_ms, MEMORY_ms);
    condition->pad_reached_Pa_q10 = faded(condition->pad_reached_Pa_q10, step_ms, MEMORY_ms);
    if (!condition->pressed) {
      condition->warm_Pa_q10 = faded(condition->warm_Pa_q10, step_ms, WARM_ms);
    }
  }
  if (frame->saturated & bit) {
    condition->memory_Pa_q10[k] = condition->reached_Pa_q10[k] = Pa_q10(SATURATED_Pa);
    condition->margin_Pa_q10[k] = Pa_q10(SATURATED_Pa) >> BAND_SHIFT;
  }
  if (!(conditioned->usable & bit) || frame->unsettled & bit) {
    return;
  }
  /* One disturbed reading is no pressure to remember. */
  int32_t reading = frame->pressure_Pa_q10[k];
  int32_t before = condition->before_Pa_q10[k];
  condition->before_Pa_q10[k] = reading;
  int32_t steady =
      clamped_difference(reading < before ? reading : before, condition->zero_Pa_q10[k]);
  steady = steady < Pa_q10(SATURATED_Pa) ? steady : Pa_q10(SATURATED_Pa);
  int32_t memory = faded(condition->memory_Pa_q10[k], step_ms, MEMORY_ms);
  if (condition->pressed && steady > memory) {
    memory = steady;
  }
  condition->memory_Pa_q10[k] = memory;
  if (memory > condition->pad_memory_Pa_q10) {
    condition->pad_memory_Pa_q10 = memory;
  }
  watch_creep(condition, k, step_ms, reading);
  look_how_firm(condition, conditioned, k);
  if (condition->pressed && !condition->unsure) {
    track_pressed(condition, k, step_ms, steady);
  } else {
    int32_t above = clamped_difference(reading, condition->zero_Pa_q10[k]);
    int32_t rise = clamp(clamped_difference(reading, before), -GAINED_MAX, GAINED_MAX);
    int32_t still = STILL_SIGMA * frame->noise_Pa_q10;
    const struct look look = {
        .step_ms = step_ms,
        .above_zero = clamp(above, -SUM_RANGE, SUM_RANGE),
        .calm_lag = Pa_q10(CALM_LAG_Pa) + frame->noise_Pa_q10 / 2,
        .moves = rise > still || rise < -still - (above > 0 ? above >> FALL_SHIFT : 0),
    };
    track_free(condition, k, &look);
  }
}

/* Takes the readings of sensors that are tared now, and leaves the bitmap of those that were. In a
 * contact that others feel it waits, but not for ever, for wrong zeros may make it: what is taken
 * then is a guess until the contact ends. */
static uint32_t tare_sensors(struct condition *condition, const struct frame *frame,
                             uint32_t readable) {
  uint32_t ready = readable;
  uint32_t guesses = condition->pressed ? 0 : condition->guessed;
  bool is_felt = condition->pressed && !condition->unsure && (readable & ~condition->taring) != 0;
  for (uint8_t k = 0; k < frame->sensor_count; k++) {
    uint32_t bit = UINT32_C(1) << k;
    bool tared_lately = condition->now_ms - condition->tare_begun_ms[k] < FOUND_OUT_ms;
    if ((frame->renewed | guesses) & bit || (frame->restored & bit && tared_lately)) {
      begin_tare(condition, k);
    }
    if (condition->taring & readable & bit) {
      ready &= ~bit;
      if (!is_felt) {
        tare_step(condition, k, frame->pressure_Pa_q10[k]);
      } else if (condition->now_ms - condition->tare_begun_ms[k] >= TARE_WAITS_ms) {
        condition->guessed |= bit;
      }
    }
  }
  return ready;
}

/* Fills in pressures and peak; the strongest sensor is the answer. */
static uint8_t read_sensors(const struct condition *condition, const struct frame *frame,
                            const struct condition_gains *gains, struct conditioned *conditioned) {
  int32_t peak = 0;
  uint8_t strongest = 0;
  uint32_t ready = conditioned->usable;
  for (uint8_t k = 0; k < frame->sensor_count; k++, ready >>= 1) {
    if (!(ready & 1u)) {
      conditioned->pressure_Pa_q10[k] = 0;
      continue;
    }
    int32_t above = clamped_difference(frame->pressure_Pa_q10[k], condition->zero_Pa_q10[k]);
    if (gains) {
      above = scaled_by(clamp(above, -GAINED_MAX, GAINED_MAX - 1), gains->inverse_q16[k]);
    }
    conditioned->pressure_Pa_q10[k] = above;
    if (above > peak) {
      peak = above;
      strongest = k;
    }
  }
  conditioned->peak_Pa_q10 = peak;
  return strongest;
}

/* Whether a reading is over the gate and its margin: the strongest, mostly. */
static bool is_over(const struct condition *condition, const struct frame *frame,
                    const struct conditioned *conditioned, uint8_t strongest, int32_t limit) {
  if (frame->saturated != 0 ||
      conditioned->peak_Pa_q10 > limit + condition->margin_Pa_q10[strongest]) {
    return true;
  }
  if (conditioned->peak_Pa_q10 <= limit) {
    return false;
  }
  for (uint8_t k = 0; k < frame->sensor_count; k++) {
    if (conditioned->pressure_Pa_q10[k] > limit + condition->margin_Pa_q10[k]) {
      return true;
    }
  }
  return false;
}

/* For the means that the zeros follow while nothing touches. */
static void sum_up(struct condition *condition, const struct frame *frame, uint32_t usable) {
  for (uint8_t k = 0; k < frame->sensor_count; k++) {
    if (usable >> k & 1u && condition->summed[k] < UINT8_MAX) {
      int32_t above = clamped_difference(frame->pressure_Pa_q10[k], condition->zero_Pa_q10[k]);
      condition->sum_Pa_q10[k] += clamp(above, -SUM_RANGE, SUM_RANGE);
      condition->summed[k]++;
    }
  }
}

void condition_follow(struct condition *condition, const struct frame *frame,
                      const struct conditioned *conditioned) {
  for (; condition->due_ms >= TRACK_ms; condition->due_ms -= TRACK_ms) {
    uint8_t k = condition->next < frame->sensor_count ? condition->next : 0;
    condition->next = (uint8_t)(k + 1);
    track_sensor(condition, frame, conditioned, k);
  }
}

void condition_frame(struct condition *condition, const struct frame *frame,
                     const struct condition_gains *gains, struct conditioned *conditioned) {
  uint32_t now_ms = (uint32_t)(frame->t_us >> 10);
  uint32_t gap_ms = now_ms - condition->now_ms;
  int32_t step_ms = gap_ms < STEP_MAX_ms ? (int32_t)gap_ms : STEP_MAX_ms;
  condition->now_ms = now_ms;
  condition->pressed_ms = older(condition->pressed_ms, step_ms);
  condition->released_ms = older(condition->released_ms, step_ms);
  condition->tared_ms = older(condition->tared_ms, step_ms);

  int32_t open = Pa_q10(CONDITION_OPEN_Pa) + CONDITION_OPEN_SIGMA * frame->noise_Pa_q10;
  condition->open_Pa_q10 = open;
  int32_t close = Pa_q10(CONDITION_CLOSE_Pa) + CONDITION_CLOSE_SIGMA * frame->noise_Pa_q10;
  uint32_t readable = frame->valid & ~frame->saturated;
  conditioned->usable = readable;
  if (condition->taring & readable || frame->renewed || frame->restored || condition->guessed) {
    conditioned->usable = tare_sensors(condition, frame, readable);
  }
  uint8_t strongest = read_sensors(condition, frame, gains, conditioned);
  bool over = is_over(condition, frame, conditioned, strongest, condition->pressed ? close : open);
  press_or_release(condition, conditioned, frame->sensor_count, over);
  if (!condition->pressed) {
    sum_up(condition, frame, conditioned->usable);
  }
  condition->unsure = condition->pressed && frame->saturated == 0 &&
                      (condition->guessed != 0 || (condition->firm & conditioned->usable) == 0 ||
                       conditioned->peak_Pa_q10 < drift_in_contact(condition));
  int32_t most = frame->sensor_count * TRACK_ms;
  int32_t due = condition->due_ms + step_ms * frame->sensor_count;
  condition->due_ms = due < most ? due : most;
  if (!condition->pressed || condition->unsure) { /* what is tracked is part of the answer */
    condition_follow(condition, frame, conditioned);
  }

  conditioned->contact = condition->pressed || conditioned->peak_Pa_q10 > open;
  if (conditioned->contact && !condition->touched && !condition->pressed) {
    condition->taken_before_Pa_q10 =
        taken_into_zeros(condition, conditioned->usable, frame->sensor_count);
  }
  condition->touched = conditioned->contact;
  conditioned->tared = readable != 0 && conditioned->usable == readable &&
                       (condition->below & conditioned->usable) == 0;
  watch_calm(condition, conditioned, frame->sensor_count);
  bool stands_off = (condition->stands_off & conditioned->usable) != 0;
  bool sure = frame->saturated != 0 ||
              (!condition->unsure && (condition->sudden & conditioned->usable) != 0 &&
               conditioned->peak_Pa_q10 >= condition->strong_Pa_q10);
  conditioned->zero_doubtful = condition->pressed ? !sure : conditioned->contact || stands_off;
}
