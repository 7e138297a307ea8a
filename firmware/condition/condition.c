#include "condition/condition.h"

#include "port/divide.h"

#include <string.h>

#define STEP_MAX_ms 16383 /* a longer gap counts as this */
#define LOOK_ms 64

#define SLOW_ms SECONDS(1)

/* In a look a remainder rises by less than so much noise, and falls by less than so much and a
 * quarter of it. */
#define STILL_SIGMA 3
#define FALL_SHIFT 2

/* A sensor that has lost its state, or a wrong temperature, is found out within so long; a zero
 * taken meanwhile is not its own. */
#define FOUND_OUT_ms ((uint32_t)SECONDS(5))
#define TARE_WAITS_ms ((uint32_t)SECONDS(8))

#define FRESH_ms ((uint32_t)SECONDS(AFTER_EFFECT_FRESH_s))
#define DRIFT_GOES_ON_ms ((uint32_t)SECONDS(3600))
#define CALM_AFTER_TARE_ms ((uint32_t)SECONDS(3))
#define CALM_AFTER_RELEASE_ms ((uint32_t)SECONDS(60)) /* what rubber keeps goes slowly */
#define CALM_LAG_Pa 2                                 /* and half a sigma: three sigmas of a mean at the least rate */

#define SUM_RANGE (INT32_C(1) << 23) /* of a reading in a mean: 8 kPa */

static void begin_tare(struct condition *condition, uint8_t k, int32_t spread_Pa_q10) {
  struct condition_sensor *sensor = &condition->sensor[k];
  zero_begin_tare(&sensor->zero, condition->now_ms, spread_Pa_q10);
  memset(&sensor->after, 0, sizeof sensor->after);
  doubt_forget(&sensor->doubt, &condition->doubt, k);
  condition->margin_Pa_q10[k] = 0;
  condition->sum_Pa_q10[k] = 0;
  condition->summed[k] = 0;
  condition->taring |= UINT32_C(1) << k;
  uint32_t others = ~(UINT32_C(1) << k);
  condition->guessed &= others;
  condition->restless &= others;
  condition->below &= others;
}

/* warm: bitmap of the sensors that were calm just now. */
static void begin(struct condition *condition, uint32_t warm) {
  memset(condition, 0, sizeof *condition);
  condition->gate.released_ms = AGE_MAX_ms;
  for (uint8_t k = 0; k < FT_MAX_SENSORS; k++, warm >>= 1) {
    begin_tare(condition, k, warm & 1u ? Pa_q10(ZERO_WARM_Pa) : Pa_q10(ZERO_COLD_Pa));
  }
}

void condition_start(struct condition *condition) {
  begin(condition, 0);
}

void condition_tare(struct condition *condition) {
  uint32_t warm = ~condition->taring;
  for (uint8_t k = 0; k < FT_MAX_SENSORS; k++) {
    if (condition->sensor[k].zero.spread_Pa_q10 > Pa_q10(ZERO_WARM_Pa)) {
      warm &= ~(UINT32_C(1) << k);
    }
  }
  begin(condition, warm);
}

static void take(struct condition *condition, uint8_t k, int32_t reading) {
  struct condition_sensor *sensor = &condition->sensor[k];
  if (zero_take(&sensor->zero, condition->now_ms, reading)) {
    condition->taring &= ~(UINT32_C(1) << k);
    condition->zero_Pa_q10[k] = sensor->zero.level_Pa_q10;
    condition->margin_Pa_q10[k] = sensor->zero.spread_Pa_q10;
    sensor->before_Pa_q10 = sensor->slow_Pa_q10 = sensor->zero.level_Pa_q10;
    sensor->looked_ms = condition->now_ms;
    condition->tared_ms = 0;
    condition->calm.snapshots = 0;
  }
}

/* Takes the readings of sensors that are tared now, and leaves the bitmap of those that were. In a
 * contact that others feel it waits, but not for ever, for wrong zeros may make it: what is taken
 * then is a guess until the contact ends. */
static uint32_t tare_sensors(struct condition *condition, const struct frame *frame, uint32_t readable) {
  uint32_t ready = readable;
  uint32_t guesses = condition->gate.pressed ? 0 : condition->guessed;
  bool is_felt = condition->gate.pressed && !condition->doubt.unsure && (readable & ~condition->taring) != 0;
  for (uint8_t k = 0; k < frame->sensor_count; k++) {
    uint32_t bit = UINT32_C(1) << k;
    const struct zero *zero = &condition->sensor[k].zero;
    bool tared_lately = condition->now_ms - zero->tare_begun_ms < FOUND_OUT_ms;
    if (frame->renewed & bit || (frame->restored & bit && tared_lately)) {
      begin_tare(condition, k, Pa_q10(ZERO_COLD_Pa));
    } else if (guesses & bit) {
      begin_tare(condition, k, Pa_q10(ZERO_WARM_Pa));
    }
    if (condition->taring & readable & bit) {
      ready &= ~bit;
      if (!is_felt) {
        take(condition, k, frame->pressure_Pa_q10[k]);
      } else if (condition->now_ms - zero->tare_begun_ms >= TARE_WAITS_ms) {
        condition->guessed |= bit;
      }
    }
  }
  return ready;
}

/* value / gain, |value| <= 2^29 and 1 / gain <= 4, to 1/1024 Pa below. */
static int32_t scaled_by(int32_t value, uint32_t inverse_q16) {
  uint32_t low = (uint32_t)value & 0xFFFF;
  return (value >> 16) * (int32_t)inverse_q16 + (int32_t)(low * (inverse_q16 >> 16)) +
         (int32_t)(low * (inverse_q16 & 0xFFFF) >> 16);
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
      above = scaled_by(clamp(above, -STEP_PRESSURE_MAX, STEP_PRESSURE_MAX - 1), gains->inverse_q16[k]);
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

/* For the means that the zeros follow while nothing touches. */
static void sum_up(struct condition *condition, const struct frame *frame, uint32_t usable) {
  for (uint8_t k = 0; usable != 0; k++, usable >>= 1) {
    if (usable & 1u && condition->summed[k] < UINT8_MAX) {
      int32_t above = clamped_difference(frame->pressure_Pa_q10[k], condition->zero_Pa_q10[k]);
      condition->sum_Pa_q10[k] += clamp(above, -SUM_RANGE, SUM_RANGE);
      condition->summed[k]++;
    }
  }
}

/* By so much a zero may be off: what it has taken without a proof, or has not settled yet. The
 * zeros stand in a contact, and with them this. */
static int32_t taken_into_zeros(const struct condition *condition, uint32_t usable, uint8_t count) {
  int32_t most = 0;
  for (uint8_t k = 0; k < count; k++, usable >>= 1) {
    const struct condition_sensor *sensor = &condition->sensor[k];
    int32_t taken = larger(size_of(sensor->doubt.taken_Pa_q10), sensor->zero.spread_Pa_q10);
    most = usable & 1u ? larger(taken, most) : most;
  }
  return most;
}

static void press_or_release(struct condition *condition, const struct conditioned *conditioned, uint8_t count) {
  if (!condition->gate.pressed) {
    after_effect_release(&condition->after, condition->gate.pressed_ms);
    return;
  }
  for (uint8_t k = 0; k < count; k++) {
    doubt_compare(&condition->sensor[k].doubt, &condition->doubt, k, conditioned->pressure_Pa_q10[k],
                  condition->gate.open_Pa_q10);
    condition->sensor[k].after.reached_Pa_q10 = 0;
    condition->margin_Pa_q10[k] = 0;
  }
  after_effect_press(&condition->after);
  doubt_press(&condition->doubt, !condition->touched, taken_into_zeros(condition, conditioned->usable, count));
  condition->calm.snapshots = 0;
}

static void look_in_contact(struct condition *condition, uint8_t k, int32_t ms, int32_t steady) {
  struct condition_sensor *sensor = &condition->sensor[k];
  condition->margin_Pa_q10[k] = after_effect_hold(&sensor->after, &condition->after, ms, steady);
  doubt_hold(&sensor->doubt, &condition->doubt, ms, steady);
  sensor->zero.below_ms = 0;
  set_bit(&condition->below, k, false);
  if (condition->gate.pressed_ms < DRIFT_GOES_ON_ms) {
    condition->zero_Pa_q10[k] += zero_drift_on(&sensor->zero, ms);
  }
}

/* A sensor that has been below was tared under a press, and so were all others: those that are far
 * below now give in with it, and those on its flanks settle. */
static void watch_below(struct condition *condition, uint8_t k, int32_t ms, int32_t above_level, int32_t lowest) {
  bool far;
  bool gives_in = zero_is_below(&condition->sensor[k].zero, ms, lowest - above_level, &far);
  set_bit(&condition->below, k, above_level < lowest);
  if (!gives_in) {
    return;
  }
  for (uint8_t j = 0; j < FT_MAX_SENSORS; j++) {
    zero_unsettle(&condition->sensor[j].zero, far && condition->below >> j & 1u);
  }
  begin_tare(condition, k, condition->sensor[k].zero.spread_Pa_q10);
  doubt_return(&condition->sensor[k].doubt, above_level);
}

/* While nothing touches for certain, or a touch looks like a drift. */
static void look_free(struct condition *condition, uint8_t k, const struct step *step) {
  struct condition_sensor *sensor = &condition->sensor[k];
  struct zero *zero = &sensor->zero;
  bool unsure = condition->doubt.unsure;
  int32_t before = condition->zero_Pa_q10[k];
  if (!unsure && zero_settle(zero, step)) {
    condition->zero_Pa_q10[k] = zero->level_Pa_q10;
    doubt_follow(&sensor->doubt, &condition->doubt, k, step->ms, 0, 0, zero->spread_Pa_q10);
    condition->margin_Pa_q10[k] = zero->spread_Pa_q10;
    set_bit(&condition->restless, k, true);
    set_bit(&condition->below, k, false);
    return;
  }
  struct after_effect_band band;
  after_effect_look(&sensor->after, &condition->after, condition->gate.released_ms < FRESH_ms, &band);
  int32_t remainder = before - zero->level_Pa_q10;
  int32_t above_level = step->above_Pa_q10 + remainder;
  if (unsure) {
    band.pace = (struct zero_pace){0};
    band.margin_Pa_q10 = 0;
  } else {
    remainder = after_effect_follow(&band, step, remainder);
  }
  int32_t moved = zero_follow(zero, step, &band.pace, &remainder);
  condition->zero_Pa_q10[k] = zero->level_Pa_q10 + remainder;
  doubt_follow(&sensor->doubt, &condition->doubt, k, step->ms, moved, condition->zero_Pa_q10[k] - before,
               zero->spread_Pa_q10);
  condition->margin_Pa_q10[k] = band.margin_Pa_q10 + zero->spread_Pa_q10;
  set_bit(&condition->restless, k, size_of(above_level) > Pa_q10(CALM_LAG_Pa) + step->noise_Pa_q10 / 2);
  watch_below(condition, k, step->ms, above_level, band.lowest_Pa_q10 - condition->gate.open_Pa_q10);
}

static int32_t mean_above(struct condition *condition, uint8_t k, int32_t reading) {
  int32_t above = clamped_difference(reading, condition->zero_Pa_q10[k]);
  above = clamp(above, -SUM_RANGE, SUM_RANGE);
  if (condition->summed[k] > 0) {
    above = port_divide(condition->sum_Pa_q10[k], condition->summed[k]);
  }
  condition->sum_Pa_q10[k] = 0;
  condition->summed[k] = 0;
  return above;
}

static void look_at(struct condition *condition, const struct frame *frame, const struct conditioned *conditioned,
                    uint8_t k) {
  struct condition_sensor *sensor = &condition->sensor[k];
  uint32_t bit = UINT32_C(1) << k;
  uint32_t gap_ms = condition->now_ms - sensor->looked_ms;
  int32_t ms = gap_ms < STEP_MAX_ms ? (int32_t)gap_ms : STEP_MAX_ms;
  bool pressed = condition->gate.pressed;
  sensor->looked_ms = condition->now_ms;
  if (k == 0) {
    after_effect_fade(&condition->after, ms, pressed);
  }
  if (frame->saturated & bit) {
    condition->margin_Pa_q10[k] = after_effect_saturate(&sensor->after);
  }
  if (!(conditioned->usable & bit) || frame->unsettled & bit) {
    return;
  }
  int32_t reading = frame->pressure_Pa_q10[k];
  int32_t before = sensor->before_Pa_q10;
  int32_t slow = clamped_difference(reading, sensor->slow_Pa_q10);
  slow = clamp(slow, -STEP_PRESSURE_MAX, STEP_PRESSURE_MAX);
  struct step step = {
      .ms = ms,
      .now_ms = condition->now_ms,
      .noise_Pa_q10 = frame->noise_Pa_q10,
      .reading_Pa_q10 = reading,
      .slow_Pa_q10 = slow,
      .rise_Pa_q10 = part_of(slow, share_in(ms, SLOW_ms)),
  };
  sensor->before_Pa_q10 = reading;
  sensor->slow_Pa_q10 += step.rise_Pa_q10;
  /* One disturbed reading is no pressure to remember. */
  int32_t steady = clamped_difference(reading < before ? reading : before, condition->zero_Pa_q10[k]);
  after_effect_remember(&sensor->after, &condition->after, ms, steady, pressed);
  doubt_creep(&sensor->doubt, &step, pressed);
  doubt_compare(&sensor->doubt, &condition->doubt, k, conditioned->pressure_Pa_q10[k], condition->gate.open_Pa_q10);
  step.above_Pa_q10 = mean_above(condition, k, reading);
  if (pressed && !condition->doubt.unsure) {
    look_in_contact(condition, k, ms, steady);
    return;
  }
  int32_t rise = clamp(clamped_difference(reading, before), -STEP_PRESSURE_MAX, STEP_PRESSURE_MAX);
  int32_t still = STILL_SIGMA * frame->noise_Pa_q10;
  int32_t above = clamped_difference(reading, condition->zero_Pa_q10[k]);
  step.moves = rise > still || rise < -still - (larger(above, 0) >> FALL_SHIFT);
  look_free(condition, k, &step);
}

static void watch_calm(struct condition *condition, const struct conditioned *conditioned, uint8_t count) {
  struct zero_snapshot snapshot;
  bool calm = !condition->gate.pressed && conditioned->tared && (condition->restless & conditioned->usable) == 0 &&
              condition->tared_ms >= CALM_AFTER_TARE_ms && condition->gate.released_ms >= CALM_AFTER_RELEASE_ms;
  if (calm && zero_snapshot_due(&condition->calm, condition->now_ms, &snapshot)) {
    for (uint8_t k = 0; k < count; k++) {
      zero_take_snapshot(&condition->sensor[k].zero, &snapshot);
    }
  }
}

void condition_follow(struct condition *condition, const struct frame *frame, const struct conditioned *conditioned) {
  for (; condition->due_ms >= LOOK_ms; condition->due_ms -= LOOK_ms) {
    uint8_t k = condition->next < frame->sensor_count ? condition->next : 0;
    condition->next = (uint8_t)(k + 1);
    look_at(condition, frame, conditioned, k);
  }
}

void condition_frame(struct condition *condition, const struct frame *frame, const struct condition_gains *gains,
                     struct conditioned *conditioned) {
  uint32_t now_ms = (uint32_t)(frame->t_us >> 10);
  uint32_t gap_ms = now_ms - condition->now_ms;
  int32_t step_ms = gap_ms < STEP_MAX_ms ? (int32_t)gap_ms : STEP_MAX_ms;
  condition->now_ms = now_ms;
  condition->tared_ms += condition->tared_ms < AGE_MAX_ms ? (uint32_t)step_ms : 0;
  gate_age(&condition->gate, step_ms, frame->noise_Pa_q10);

  uint32_t readable = frame->valid & ~frame->saturated;
  conditioned->usable = readable;
  if (condition->taring & readable || frame->renewed || frame->restored || condition->guessed) {
    conditioned->usable = tare_sensors(condition, frame, readable);
  }
  uint8_t strongest = read_sensors(condition, frame, gains, conditioned);
  const struct gate_view view = {
      .strongest = strongest,
      .peak_Pa_q10 = conditioned->peak_Pa_q10,
      .pressure_Pa_q10 = conditioned->pressure_Pa_q10,
      .margin_Pa_q10 = condition->margin_Pa_q10,
      .count = frame->sensor_count,
      .saturated = frame->saturated != 0,
  };
  if (gate_look(&condition->gate, &view)) {
    press_or_release(condition, conditioned, frame->sensor_count);
  }
  bool pressed = condition->gate.pressed;
  if (!pressed) {
    sum_up(condition, frame, conditioned->usable);
  }
  conditioned->contact = pressed || conditioned->peak_Pa_q10 > condition->gate.open_Pa_q10;
  const struct doubt_view doubt = {
      .usable = conditioned->usable,
      .peak_Pa_q10 = conditioned->peak_Pa_q10,
      .drift_Pa_q10 = after_effect_drift(condition->gate.pressed_ms),
      .pressed = pressed,
      .contact = conditioned->contact,
      .saturated = view.saturated,
      .guessed = condition->guessed != 0,
  };
  bool unsure = doubt_is_unsure(&condition->doubt, &doubt);
  int32_t most = frame->sensor_count * LOOK_ms;
  int32_t due = condition->due_ms + step_ms * frame->sensor_count;
  condition->due_ms = due < most ? due : most;
  if (!pressed || unsure) { /* what is looked at is part of the answer */
    condition_follow(condition, frame, conditioned);
  }
  if (conditioned->contact && !condition->touched && !pressed) {
    condition->doubt.before_Pa_q10 = taken_into_zeros(condition, conditioned->usable, frame->sensor_count);
  }
  condition->touched = conditioned->contact;
  conditioned->tared =
      readable != 0 && conditioned->usable == readable && (condition->below & conditioned->usable) == 0;
  watch_calm(condition, conditioned, frame->sensor_count);
  conditioned->zero_doubtful = doubt_is_due(&condition->doubt, &doubt);
}
