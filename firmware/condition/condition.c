#include "condition/condition.h"

#include "condition/update.h"
#include "port/divide.h"

#include <stddef.h>
#include <string.h>

/* warm: bitmap of the sensors that were steady just now. */
static void begin(struct condition *condition, sensor_map warm) {
  memset(condition, 0, offsetof(struct condition, sensor));
  condition->begins = true;
  condition->gate.released_ms = AGE_MAX_ms;
  for (uint8_t k = 0; k < FT_MAX_SENSORS; k++, warm >>= 1) {
    update_begin_tare(condition, k, warm & 1u ? Pa_q10(ZERO_WARM_Pa) : Pa_q10(ZERO_COLD_Pa));
  }
}

void condition_start(struct condition *condition) {
  memset(condition, 0, sizeof *condition);
  begin(condition, 0);
}

void condition_resume(struct condition *condition, uint32_t asleep_ms) {
  struct gate *gate = &condition->gate;
  if (!gate->pressed || condition->unsure) {
    begin(condition, 0);
  } else {
    gate->pressed_ms = asleep_ms < AGE_MAX_ms - gate->pressed_ms ? gate->pressed_ms + asleep_ms : AGE_MAX_ms;
  }
}

void condition_tare(struct condition *condition) {
  sensor_map warm = ~condition->taring;
  for (uint8_t k = 0; k < FT_MAX_SENSORS; k++) {
    if (condition->sensor[k].spread_Pa_q10 > Pa_q10(ZERO_WARM_Pa)) {
      warm &= ~sensor_bit(k);
    }
  }
  begin(condition, warm);
}

/* By halves of 32 bits: |sum| < 2^47, and a remainder is less than the count. */
static int32_t mean_of(int64_t sum, int32_t count) {
  const int32_t high = (int32_t)(sum >> 16);
  const int32_t quotient = port_divide(high, count);
  const int32_t rest = (high - quotient * count) * (1 << 16) + (int32_t)(sum & 0xFFFF);
  return quotient * (1 << 16) + port_divide(rest, count);
}

/* Adds a reading to the tare of sensor k, and ends it with the last. */
static void take(struct condition *condition, uint8_t k, int32_t reading_Pa_q10) {
  struct condition_sensor *sensor = &condition->sensor[k];
  if (sensor->tare_left == ZERO_TARE_FRAMES) {
    sensor->tare_begun_ms = condition->now_ms;
  }
  sensor->tare_sum += reading_Pa_q10;
  if (reading_Pa_q10 < sensor->tare_min) {
    sensor->tare_min = reading_Pa_q10;
  }
  if (reading_Pa_q10 > sensor->tare_max) {
    sensor->tare_max = reading_Pa_q10;
  }
  sensor->tare_left--;
  const int32_t taken = ZERO_TARE_FRAMES - sensor->tare_left;
  const bool slow = condition->now_ms - sensor->tare_begun_ms >= (uint32_t)TARE_SLOW_ms;
  if (sensor->tare_left > 0 && !(slow && taken >= TARE_FEWEST)) {
    return;
  }
  const int32_t mean = mean_of(sensor->tare_sum - sensor->tare_min - sensor->tare_max, taken - 2);
  const int32_t baseline = clamp(mean, -BASELINE_MAX, BASELINE_MAX);
  sensor->baseline_Pa_q10 = sensor->rests_Pa_q10 = sensor->before_Pa_q10 = sensor->slow_Pa_q10 = baseline;
  sensor->updated_ms = condition->now_ms;
  condition->taring &= ~sensor_bit(k);
  condition->zero_Pa_q10[k] = baseline;
  condition->margin_Pa_q10[k] = sensor->spread_Pa_q10;
  condition->tared_ms = 0;
  condition->snapshot_times.count = 0;
}

/* Takes the readings of sensors that are tared now, and returns the bitmap of those that were. In a contact that others measure it waits,
 * but not for ever, for wrong zeros may make it: what is taken then is a guess until the contact ends. */
static sensor_map tare_sensors(struct condition *condition, const struct frame *frame, sensor_map readable) {
  sensor_map ready = readable;
  sensor_map guesses = condition->gate.pressed ? 0 : condition->guessed;
  bool is_shared = condition->gate.pressed && !condition->unsure && (readable & ~condition->taring) != 0;
  for (uint8_t k = 0; k < frame->sensor_count; k++) {
    sensor_map bit = sensor_bit(k);
    const uint32_t age_ms = condition->now_ms - condition->sensor[k].tare_begun_ms;
    if (frame->renewed & bit || (frame->restored & bit && age_ms < FOUND_OUT_ms)) {
      update_begin_tare(condition, k, Pa_q10(ZERO_COLD_Pa));
    } else if (guesses & bit) {
      update_begin_tare(condition, k, Pa_q10(ZERO_WARM_Pa));
    }
    if (condition->taring & readable & bit) {
      ready &= ~bit;
      if (!is_shared) {
        take(condition, k, frame->pressure_Pa_q10[k]);
      } else if (condition->now_ms - condition->sensor[k].tare_begun_ms >= TARE_WAITS_ms) {
        condition->guessed |= bit;
      }
    }
  }
  return ready;
}

/* value / gain, |value| <= 2^29 and 1 / gain <= 4, to 1/1024 Pa below. */
static int32_t scaled_by(int32_t value, uint32_t inverse_q16) {
  uint32_t low = (uint32_t)value & 0xFFFF;
  return (value >> 16) * (int32_t)inverse_q16 + (int32_t)(low * (inverse_q16 >> 16)) + (int32_t)(low * (inverse_q16 & 0xFFFF) >> 16);
}

/* Fills in pressures, peak and lowest. Returns the index of the strongest sensor. */
static uint8_t read_sensors(const struct condition *condition, const struct frame *frame, const struct condition_gains *gains,
                            struct conditioned *conditioned) {
  int32_t peak = 0, lowest = 0;
  uint8_t strongest = 0;
  sensor_map ready = conditioned->usable;
  for (uint8_t k = 0; k < frame->sensor_count; k++, ready >>= 1) {
    if (!(ready & 1u)) {
      conditioned->pressure_Pa_q10[k] = 0;
      continue;
    }
    int32_t above = clamped_difference(frame->pressure_Pa_q10[k], condition->zero_Pa_q10[k] - condition->faded_Pa_q10[k]);
    if (gains) {
      above = scaled_by(clamp(above, -PRESSURE_MAX, PRESSURE_MAX - 1), gains->inverse_q16[k]);
    }
    conditioned->pressure_Pa_q10[k] = above;
    if (above > peak) {
      peak = above;
      strongest = k;
    } else if (above < lowest) {
      lowest = above;
    }
  }
  conditioned->peak_Pa_q10 = peak;
  conditioned->lowest_Pa_q10 = lowest;
  return strongest;
}

/* For the means that the zeros follow while nothing touches. */
static void sum_up(struct condition *condition, const struct frame *frame, sensor_map usable) {
  for (uint8_t k = 0; usable != 0; k++, usable >>= 1) {
    if (usable & 1u && condition->summed[k] < UINT8_MAX) {
      int32_t above = clamped_difference(frame->pressure_Pa_q10[k], condition->zero_Pa_q10[k]);
      condition->sum_Pa_q10[k] += clamp(above, -SUM_RANGE, SUM_RANGE);
      condition->summed[k]++;
    }
  }
}

/* By how much a zero may be off: what it has taken without a proof, or has not settled yet. The zeros do not move in a
 * contact, and so neither does this. */
static int32_t taken_into_zeros(const struct condition *condition, sensor_map usable, uint8_t count) {
  int32_t most = 0;
  for (uint8_t k = 0; k < count; k++, usable >>= 1) {
    const struct condition_sensor *sensor = &condition->sensor[k];
    const int32_t taken = larger(size_of(sensor->taken_Pa_q10), sensor->spread_Pa_q10);
    most = usable & 1u ? larger(taken, most) : most;
  }
  return most;
}

static void begin_contact(struct condition *condition, const struct conditioned *conditioned, uint8_t count) {
  for (uint8_t k = 0; k < count; k++) {
    update_compare(condition, k, clamped_difference(conditioned->pressure_Pa_q10[k], condition->faded_Pa_q10[k]));
    condition->sensor[k].reached_Pa_q10 = 0;
    condition->margin_Pa_q10[k] = 0;
  }
  /* What the zeros took of this contact itself, while it was within the band, counts twice: where it then moves they are off as before. */
  const int32_t taken = taken_into_zeros(condition, conditioned->usable, count);
  const int32_t of_this = condition->touched ? larger(taken - condition->taken_before_Pa_q10, 0) : 0;
  condition->strong_Pa_q10 = TAKEN_FACTOR * (taken + of_this);
  condition->strongest_Pa_q10 = 0;
  condition->reached_Pa_q10 = 0;
  condition->snapshot_times.count = 0;
}

static void end_contact(struct condition *condition) {
  condition->to_learn = ~(sensor_map)0;
  condition->drifted_Pa_q10 = larger(condition->drifted_Pa_q10, update_drift_in(condition->gate.pressed_ms));
}

static void watch_idle(struct condition *condition, const struct conditioned *conditioned, uint8_t count) {
  struct snapshot snapshot;
  const bool idle = !condition->gate.pressed && conditioned->tared && (condition->restless & conditioned->usable) == 0 &&
                    condition->tared_ms >= IDLE_AFTER_TARE_ms && condition->gate.released_ms >= IDLE_AFTER_RELEASE_ms;
  if (idle && drift_snapshot_is_due(&condition->snapshot_times, condition->now_ms, &snapshot)) {
    for (uint8_t k = 0; k < count; k++) {
      drift_take(&condition->sensor[k].drift, condition->sensor[k].baseline_Pa_q10, &snapshot);
    }
  }
}

void condition_follow(struct condition *condition, const struct frame *frame, const struct conditioned *conditioned) {
  for (; condition->due_ms >= UPDATE_ms; condition->due_ms -= UPDATE_ms) {
    const uint8_t k = condition->next < frame->sensor_count ? condition->next : 0;
    condition->next = (uint8_t)(k + 1);
    update_sensor(condition, frame, conditioned, k);
  }
}

static uint32_t older(uint32_t age_ms, int32_t ms) { return age_ms < AGE_MAX_ms ? age_ms + (uint32_t)ms : age_ms; }

/* Moves all ages on. */
static void begin_frame(struct condition *condition, const struct frame *frame) {
  const uint32_t now_ms = (uint32_t)(frame->t_us >> 10), gap_ms = condition->begins ? 0 : now_ms - condition->now_ms;
  for (uint8_t k = 0; condition->begins && k < FT_MAX_SENSORS; k++) {
    condition->sensor[k].tare_begun_ms = now_ms;
  }
  condition->begins = false;
  const int32_t step_ms = gap_ms < STEP_MAX_ms ? (int32_t)gap_ms : STEP_MAX_ms;
  const int32_t most_ms = frame->sensor_count * UPDATE_ms, due_ms = condition->due_ms + step_ms * frame->sensor_count;
  condition->now_ms = now_ms;
  condition->tared_ms = older(condition->tared_ms, step_ms);
  condition->due_ms = due_ms < most_ms ? due_ms : most_ms;
  struct gate *gate = &condition->gate;
  gate->pressed_ms = older(gate->pressed_ms, step_ms);
  gate->released_ms = older(gate->released_ms, step_ms);
  gate->open_Pa_q10 = Pa_q10(GATE_OPEN_Pa) + GATE_OPEN_SIGMA * frame->noise_Pa_q10;
  gate->close_Pa_q10 = Pa_q10(GATE_CLOSE_Pa) + GATE_CLOSE_SIGMA * frame->noise_Pa_q10;
}

/* The strongest decides, except where its own margin is larger than that of others. */
static bool is_over(const struct condition *condition, const struct frame *frame, const struct conditioned *conditioned, uint8_t strongest,
                    int32_t limit, bool saturated) {
  const int32_t *margin = condition->margin_Pa_q10;
  if (saturated || conditioned->peak_Pa_q10 > limit + margin[strongest]) {
    return true;
  }
  bool over = false;
  for (uint8_t k = 0; conditioned->peak_Pa_q10 > limit && k < frame->sensor_count; k++) {
    over = over || conditioned->pressure_Pa_q10[k] > limit + margin[k];
  }
  return over;
}

/* Returns whether a contact begins or ends with this frame. */
static bool move_gate(struct condition *condition, const struct frame *frame, const struct conditioned *conditioned, uint8_t strongest,
                      bool saturated) {
  struct gate *gate = &condition->gate;
  const bool over = is_over(condition, frame, conditioned, strongest, gate->pressed ? gate->close_Pa_q10 : gate->open_Pa_q10, saturated);
  if (over == gate->pressed) {
    return false;
  }
  gate->pressed = over;
  *(over ? &gate->pressed_ms : &gate->released_ms) = 0;
  return true;
}

/* Whether the zero follows this contact as if nothing touched. */
static bool is_unsure(const struct condition *condition, const struct conditioned *conditioned, int32_t peak, bool saturated) {
  return condition->gate.pressed && !saturated &&
         (condition->guessed != 0 || (condition->firm & conditioned->usable) == 0 || peak < update_drift_in(condition->gate.pressed_ms));
}

/* Sets .sure, and returns whether a force and a zero that has moved look alike. After the updates of this frame. */
static bool is_doubtful(struct condition *condition, const struct conditioned *conditioned, int32_t peak, bool saturated) {
  const sensor_map usable = conditioned->usable;
  if (!condition->gate.pressed) {
    condition->sure = false;
    return conditioned->contact || (condition->zero_risen & usable) != 0;
  }
  const int32_t most = larger(larger(peak, condition->memory_Pa_q10), condition->reached_Pa_q10) >> DIP_SHIFT;
  const bool is_clear = !condition->unsure && conditioned->lowest_Pa_q10 >= -most - condition->gate.open_Pa_q10 &&
                        (condition->sudden & usable) != 0 && peak >= condition->strong_Pa_q10 &&
                        peak > condition->strongest_Pa_q10 >> BAND_SHIFT;
  condition->sure = is_clear && !saturated;
  return !is_clear && !saturated;
}

void condition_frame(struct condition *condition, const struct frame *frame, const struct condition_gains *gains,
                     struct conditioned *conditioned) {
  const uint8_t count = frame->sensor_count;
  begin_frame(condition, frame);

  const sensor_map readable = frame->valid & ~frame->saturated;
  conditioned->usable = readable;
  if (condition->taring & readable || frame->renewed || frame->restored || condition->guessed) {
    conditioned->usable = tare_sensors(condition, frame, readable);
  }
  const uint8_t strongest = read_sensors(condition, frame, gains, conditioned);
  /* Others measure a press beyond the range of a sensor too. If none does it is the sensor, which touches nothing. */
  const bool saturated = frame->saturated != 0 && (readable == 0 || conditioned->peak_Pa_q10 > Pa_q10(SATURATED_Pa) >> BESIDE_SHIFT);

  /* A contact is judged with the whole remainder, since it leaves one too; its pressures are without what has faded. */
  const int32_t peak = (int32_t)((uint32_t)conditioned->peak_Pa_q10 - (uint32_t)condition->faded_Pa_q10[strongest]);
  const bool changes = move_gate(condition, frame, conditioned, strongest, saturated);
  const bool pressed = condition->gate.pressed;
  if (changes && pressed) {
    begin_contact(condition, conditioned, count);
  } else if (changes) {
    end_contact(condition);
  }
  if (!pressed) {
    sum_up(condition, frame, conditioned->usable);
  }
  conditioned->contact = pressed || conditioned->peak_Pa_q10 > condition->gate.open_Pa_q10;
  condition->unsure = is_unsure(condition, conditioned, peak, saturated);
  if (!pressed || condition->unsure) { /* what is updated is part of the answer */
    condition_follow(condition, frame, conditioned);
  }
  if (conditioned->contact && !condition->touched && !pressed) {
    condition->taken_before_Pa_q10 = taken_into_zeros(condition, conditioned->usable, count);
  }
  condition->touched = conditioned->contact;
  conditioned->tared = readable != 0 && conditioned->usable == readable && (condition->below & conditioned->usable) == 0;
  watch_idle(condition, conditioned, count);
  conditioned->zero_doubtful = is_doubtful(condition, conditioned, peak, saturated);
}
