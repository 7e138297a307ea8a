#include "condition/update.h"

#include "port/divide.h"

/* What one update is about. */
struct step {
  struct condition *condition;
  struct condition_sensor *sensor;
  uint8_t k;
  sensor_map usable;
  int32_t ms; /* since the last update */
  int32_t memory_share, wander_share;
  int32_t noise_Pa_q10;
  int32_t reading_Pa_q10; /* absolute */
  int32_t steady_Pa_q10;  /* above the zero, but for one disturbed reading */
  int32_t slow_Pa_q10;    /* the reading above its low pass */
  int32_t fell_Pa_q10;    /* since the last update; below 0: rose */
  int32_t above_Pa_q10;   /* above the zero: mean of the readings since the last update */
  bool moves;             /* the reading moved as in a press or a release */
};

/* What may remain after a contact, and how fast the baseline takes it over. */
struct band {
  int32_t lowest_Pa_q10, highest_Pa_q10;
  int32_t margin_Pa_q10;    /* by which a press has to be stronger */
  int32_t above_Pa_q10_s;   /* the baseline moves faster by this towards the reading, */
  int32_t remains_Pa_q10_s; /* and towards the remainder; 1/1024 Pa in a second */
};

static int32_t faded(int32_t value, int32_t share) { return value - part_of(value, share); }

#ifdef FT_WITHOUT_HYSTERESIS
static int32_t retained_of(const struct condition_sensor *sensor) { return (void)sensor, 0; }
static int32_t may_remain(const struct condition_sensor *sensor, int32_t of_Pa_q10) {
  (void)sensor;
  return of_Pa_q10 >> BAND_SHIFT;
}
static void follow_hysteresis(const struct step *step) { (void)step; }
static void forget_hysteresis(struct condition_sensor *sensor) { (void)sensor; }
static void follow_rest(const struct step *step) { step->sensor->rests_Pa_q10 = step->sensor->baseline_Pa_q10; }
#else
/* By how much a sensor reads above where it rests and its pressure. */
static int32_t retained_of(const struct condition_sensor *sensor) { return (sensor->released_Pa_q10 >> 10) * sensor->retained_q16 >> 6; }

/* Of a press: an eighth, or twice what this sensor has kept of others. */
static int32_t may_remain(const struct condition_sensor *sensor, int32_t of_Pa_q10) {
  return larger(of_Pa_q10 >> BAND_SHIFT, part_of(of_Pa_q10, 2 * sensor->hysteresis_q16));
}

static void follow_hysteresis(const struct step *step) {
  struct condition_sensor *sensor = step->sensor;
  const int32_t held = step->condition->gate.pressed ? clamp(step->steady_Pa_q10, 0, Pa_q10(SATURATED_Pa)) : 0;
  sensor->held_Pa_q10 += part_of(held - sensor->held_Pa_q10, share_in(step->ms, HOLD_ms));
  const int32_t released = faded(sensor->released_Pa_q10, share_in(step->ms, RELEASED_ms)) + step->fell_Pa_q10;
  sensor->released_Pa_q10 = clamp(released, 0, Pa_q10(SATURATED_Pa));
  const int32_t unsure = larger(HYSTERESIS_MIN, size_of(sensor->retained_q16) >> UNSURE_SHIFT) + (HYSTERESIS_SD >> sensor->learnt);
  step->condition->hysteresis_sd_Pa_q10[step->k] =
      part_of(sensor->held_Pa_q10, sensor->hysteresis_q16) + part_of(sensor->released_Pa_q10, unsure);
}

/* What five and more sensors all keep is a force that is left: rubber keeps unlike shares. Of fewer it may be either. */
static bool is_left_by_force(const struct condition *condition, sensor_map usable) {
  int pressed = 0;
  for (uint8_t k = 0; usable != 0; k++, usable >>= 1) {
    const struct condition_sensor *sensor = &condition->sensor[k];
    if (usable & 1u && sensor->released_Pa_q10 > Pa_q10(HYSTERESIS_LEAST_Pa)) {
      const int32_t off = clamped_difference(sensor->before_Pa_q10, sensor->baseline_Pa_q10);
      if (off <= part_of(sensor->released_Pa_q10, HYSTERESIS_FORCE)) {
        return false;
      }
      pressed++;
    }
  }
  return pressed >= 5;
}

/* What is left after a contact shows how much this sensor's rubber keeps. 1.25 times the mean size is the sd of a hold's own part. */
static void learn_hysteresis(const struct step *step, int32_t retained_Pa_q10) {
  struct condition_sensor *sensor = step->sensor;
  step->condition->to_learn &= ~sensor_bit(step->k);
  const bool shows = sensor->released_Pa_q10 > Pa_q10(HYSTERESIS_LEAST_Pa) && step->condition->gate.released_ms < FRESH_ms;
  if (shows && !is_left_by_force(step->condition, step->usable)) {
    const int32_t most = part_of(sensor->released_Pa_q10, HYSTERESIS_MAX), released = sensor->released_Pa_q10 >> 16;
    const int32_t off = clamp(size_of(retained_Pa_q10) - step->condition->drifted_Pa_q10, 0, most),
                  shown = port_divide(off + off / 4, released);
    sensor->hysteresis_q16 = larger(sensor->hysteresis_q16 + ((shown - sensor->hysteresis_q16) >> LEARN_SHIFT), HYSTERESIS_MIN);
    sensor->learnt += sensor->learnt < RETAINED_LEARNT_MOST;
    sensor->retained_q16 += port_divide(port_divide(clamp(retained_Pa_q10, -most, most), released) - sensor->retained_q16, sensor->learnt);
  }
}

/* While nothing touches, a sensor reads where it comes to rest and the share that it keeps of what is past. The former drifts, and is the
 * zero once little is past. */
static void follow_rest(const struct step *step) {
  struct condition_sensor *sensor = step->sensor;
  const int32_t zero = step->condition->zero_Pa_q10[step->k], retained = step->above_Pa_q10 + zero - sensor->rests_Pa_q10;
  if (step->condition->gate.released_ms >= HYSTERESIS_SHOWS_ms) {
    if (step->condition->to_learn >> step->k & 1u) {
      learn_hysteresis(step, retained);
    }
    const int32_t off = retained - retained_of(sensor);
    const int32_t most = step->ms >> SLEW_SHIFT, hidden = sensor->released_Pa_q10 / Pa_q10(HYSTERESIS_HIDES_Pa);
    sensor->rests_Pa_q10 += clamp(part_of(off, share_in(step->ms, FOLLOW_ms)), -most, most);
    sensor->rests_Pa_q10 += port_divide(zero - sensor->rests_Pa_q10, 1 + hidden * hidden);
  }
}

static void forget_hysteresis(struct condition_sensor *sensor) {
  sensor->held_Pa_q10 = 0;
  sensor->hysteresis_q16 = larger(sensor->hysteresis_q16, HYSTERESIS_SD);
}
#endif

int32_t update_drift_in(uint32_t pressed_ms) {
  const uint32_t drift = pressed_ms >> DRIFT_SHIFT;
  return drift < Pa_q10(DRIFT_MAX_Pa) ? (int32_t)drift : Pa_q10(DRIFT_MAX_Pa);
}

void update_begin_tare(struct condition *condition, uint8_t k, int32_t spread_Pa_q10) {
  struct condition_sensor *sensor = &condition->sensor[k];
  sensor->spread_Pa_q10 = spread_Pa_q10;
  sensor->drift.drift_q16 = 0;
  sensor->below_ms = 0;
  sensor->tare_sum = 0;
  sensor->tare_min = INT32_MAX;
  sensor->tare_max = INT32_MIN;
  sensor->tare_begun_ms = condition->now_ms;
  sensor->tare_left = ZERO_TARE_FRAMES;
  sensor->memory_Pa_q10 = sensor->reached_Pa_q10 = 0;
  forget_hysteresis(sensor);
  sensor->wander_Pa_q10 = sensor->taken_Pa_q10 = sensor->crept_Pa_q10 = 0;
  condition->faded_Pa_q10[k] = condition->margin_Pa_q10[k] = sensor->retained_Pa_q10 = sensor->released_Pa_q10 = 0;
  condition->sum_Pa_q10[k] = 0;
  condition->summed[k] = 0;
  condition->taring |= sensor_bit(k);
  const sensor_map others = ~sensor_bit(k);
  condition->guessed &= others;
  condition->restless &= others;
  condition->below &= others;
  condition->zero_risen &= others;
}

void update_compare(struct condition *condition, uint8_t k, int32_t pressure_Pa_q10) {
  const struct condition_sensor *sensor = &condition->sensor[k];
  const int32_t open = condition->gate.open_Pa_q10;
  set_bit(&condition->firm, k, pressure_Pa_q10 > open + and_half(size_of(sensor->wander_Pa_q10)));
  set_bit(&condition->sudden, k, pressure_Pa_q10 > open + and_half(sensor->crept_Pa_q10));
}

/* The memory of the whole pad, once in a round of updates. */
static void fade_pad(struct condition *condition, int32_t ms) {
  const int32_t share = share_in(ms, MEMORY_ms);
  condition->memory_Pa_q10 = faded(condition->memory_Pa_q10, share);
  condition->reached_Pa_q10 = faded(condition->reached_Pa_q10, share);
  if (!condition->gate.pressed) {
    condition->drifted_Pa_q10 = faded(condition->drifted_Pa_q10, share_in(ms, DRIFTED_ms));
  }
}

/* Mean of the readings above the zero since the last update. */
static int32_t take_mean(struct condition *condition, uint8_t k, int32_t above_Pa_q10) {
  int32_t mean = clamp(above_Pa_q10, -SUM_RANGE, SUM_RANGE);
  if (condition->summed[k] > 0) {
    mean = port_divide(condition->sum_Pa_q10[k], condition->summed[k]);
  }
  condition->sum_Pa_q10[k] = 0;
  condition->summed[k] = 0;
  return mean;
}

/* What depends on the readings alone: the memory of presses, and the creep. */
static void remember(const struct step *step, int32_t rise_Pa_q10) {
  struct condition *condition = step->condition;
  struct condition_sensor *sensor = step->sensor;
  const bool pressed = condition->gate.pressed;
  int32_t memory = faded(sensor->memory_Pa_q10, step->memory_share);
  if (pressed && step->steady_Pa_q10 > memory) {
    memory = step->steady_Pa_q10 < Pa_q10(SATURATED_Pa) ? step->steady_Pa_q10 : Pa_q10(SATURATED_Pa);
  }
  sensor->memory_Pa_q10 = memory;
  condition->memory_Pa_q10 = larger(condition->memory_Pa_q10, memory - (memory >> CROSS_SHIFT));

  follow_hysteresis(step);
  const int32_t crept = pressed ? sensor->crept_Pa_q10 : faded(sensor->crept_Pa_q10, step->wander_share);
  const int32_t most = step->ms << CREEPING_SHIFT;
  sensor->crept_Pa_q10 = clamp(crept + clamp(rise_Pa_q10, -most, most), 0, Pa_q10(CREPT_MAX_Pa));
}

/* In a contact: the zero does not move, but for its drift; the band of this contact grows with it. */
static void hold(const struct step *step) {
  struct condition *condition = step->condition;
  struct condition_sensor *sensor = step->sensor;
  const int32_t steady = step->steady_Pa_q10 < Pa_q10(SATURATED_Pa) ? step->steady_Pa_q10 : Pa_q10(SATURATED_Pa);
  const int32_t reached = larger(faded(sensor->reached_Pa_q10, step->memory_share), steady);
  sensor->reached_Pa_q10 = reached;
  condition->reached_Pa_q10 = larger(condition->reached_Pa_q10, reached - (reached >> CROSS_SHIFT));
  condition->margin_Pa_q10[step->k] = may_remain(sensor, larger(reached, condition->reached_Pa_q10));
  condition->strongest_Pa_q10 = larger(condition->strongest_Pa_q10, step->steady_Pa_q10);
  sensor->wander_Pa_q10 = faded(sensor->wander_Pa_q10, step->wander_share);
  sensor->taken_Pa_q10 = condition->sure ? 0 : faded(sensor->taken_Pa_q10, step->wander_share);
  sensor->below_ms = 0;
  set_bit(&condition->below, step->k, false);
  if (condition->gate.pressed_ms < DRIFT_GOES_ON_ms) {
    const int32_t drifted = drift_in(&sensor->drift, step->ms);
    sensor->baseline_Pa_q10 += drifted;
    sensor->rests_Pa_q10 += drifted;
    condition->zero_Pa_q10[step->k] += drifted;
  }
  const int32_t remainder = condition->zero_Pa_q10[step->k] - sensor->rests_Pa_q10;
  int32_t *off = &condition->faded_Pa_q10[step->k];
  const int32_t gone = *off + sensor->retained_Pa_q10;
  sensor->retained_Pa_q10 = retained_of(sensor);
  *off = gone + part_of(remainder - gone, share_in(step->ms, RELEASED_ms)) - sensor->retained_Pa_q10;
  condition->margin_Pa_q10[step->k] += *off;
}

/* The zero is what baseline and remainder are now: what it may be off by grows by what they have moved. */
static void set_zero(const struct step *step, int32_t remainder_Pa_q10, int32_t baseline_moved_Pa_q10, int32_t moved_Pa_q10) {
  struct condition *condition = step->condition;
  struct condition_sensor *sensor = step->sensor;
  const int32_t spread = sensor->spread_Pa_q10;
  condition->zero_Pa_q10[step->k] = sensor->baseline_Pa_q10 + remainder_Pa_q10;
  sensor->wander_Pa_q10 = faded(sensor->wander_Pa_q10, step->wander_share) + baseline_moved_Pa_q10;
  sensor->taken_Pa_q10 = faded(sensor->taken_Pa_q10, step->wander_share) + moved_Pa_q10;
  sensor->crept_Pa_q10 = spread > 0 ? 0 : sensor->crept_Pa_q10;
  set_bit(&condition->zero_risen, step->k, larger(sensor->taken_Pa_q10, spread) > condition->gate.open_Pa_q10);
}

/* While the baseline may be off by a spread it takes over all readings within it. Returns whether it has: nothing shows hysteresis then. */
static bool settle(const struct step *step) {
  struct condition *condition = step->condition;
  struct condition_sensor *sensor = step->sensor;
  int32_t spread = sensor->spread_Pa_q10;
  if (spread <= size_of(step->above_Pa_q10)) {
    return false;
  }
  condition->to_learn &= ~sensor_bit(step->k);
  sensor->baseline_Pa_q10 += step->above_Pa_q10;
  int32_t goal = SETTLE_SLOW * size_of(step->slow_Pa_q10);
  goal = goal > spread ? spread : goal;
  spread += part_of(goal - spread, share_in(step->ms, SETTLE_ms));
  const bool settled = spread < Pa_q10(SETTLED_Pa) + step->noise_Pa_q10 || condition->now_ms - sensor->tare_begun_ms > SETTLE_LONGEST_ms;
  sensor->spread_Pa_q10 = settled ? 0 : spread;
  set_zero(step, 0, 0, 0);
  follow_rest(step);
  condition->margin_Pa_q10[step->k] = sensor->spread_Pa_q10;
  set_bit(&condition->restless, step->k, true);
  set_bit(&condition->below, step->k, false);
  return true;
}

static struct band band_of(const struct step *step, bool fresh) {
  const struct condition *condition = step->condition;
  const int32_t memory = larger(step->sensor->memory_Pa_q10, condition->memory_Pa_q10);
  const int32_t drifted = condition->drifted_Pa_q10;
  const int32_t highest = may_remain(step->sensor, memory) + drifted;
  return (struct band){
      .lowest_Pa_q10 = -((memory >> DIP_SHIFT) + drifted),
      .highest_Pa_q10 = highest,
      .margin_Pa_q10 = fresh ? highest : (memory >> REOPEN_SHIFT) + (drifted >> 2),
      .above_Pa_q10_s = (memory >> CREEP_SHIFT) + (drifted >> DRIFTED_SHIFT),
      .remains_Pa_q10_s = (fresh ? 0 : memory >> KEEP_SHIFT) + (drifted >> DRIFTED_SHIFT),
  };
}

/* The remainder follows the reading within the band. */
static int32_t follow_remainder(const struct step *step, const struct band *band, bool fresh, int32_t remainder) {
  int32_t goal = clamp(step->above_Pa_q10 + remainder, band->lowest_Pa_q10, band->highest_Pa_q10);
  const int32_t highest = larger(remainder, 0);
  if ((!fresh || step->moves) && goal > highest) {
    goal = highest;
  }
  const bool down = goal <= remainder && remainder >= 0;
  return remainder + part_of(goal - remainder, share_in(step->ms, down ? REMAINDER_DOWN_ms : REMAINDER_ms));
}

/* The baseline follows reading and remainder, at 0.5 Pa/s and what the band allows. Leaves what it has not taken of the
 * remainder. Returns by how much it moved. */
static int32_t follow_baseline(const struct step *step, const struct band *band, bool keeps, int32_t *remainder) {
  const int32_t slew = step->ms >> SLEW_SHIFT, share = share_in(step->ms, FOLLOW_ms);
  int32_t most = slew + in_step(band->above_Pa_q10_s, step->ms);
  const int32_t crept = clamp(part_of(step->above_Pa_q10, share), -most, most);
  most = keeps ? slew + in_step(band->remains_Pa_q10_s, step->ms) : 0;
  const int32_t kept = clamp(part_of(*remainder, share), -(most >> KEEP_DOWN_SHIFT), most);
  *remainder -= kept;
  step->sensor->baseline_Pa_q10 += crept + kept;
  return crept + kept;
}

/* The dip that it was may come back, so it counts as taken. */
static void tare_below(struct condition *condition, uint8_t k, int32_t above_Pa_q10) {
  struct condition_sensor *sensor = &condition->sensor[k];
  update_begin_tare(condition, k, larger(sensor->spread_Pa_q10, Pa_q10(ZERO_WARM_Pa)));
  sensor->wander_Pa_q10 = sensor->taken_Pa_q10 = clamp(above_Pa_q10, -Pa_q10(RETURN_MAX_Pa), 0);
}

/* A sensor that has been below was tared under a press, and so were all others: those that are far below now are tared with it, at their
 * next update, and those beside them settle. */
static void tare_again(struct condition *condition, uint8_t k, bool far, int32_t above_baseline_Pa_q10) {
  for (uint8_t j = 0; j < FT_MAX_SENSORS; j++) {
    struct condition_sensor *other = &condition->sensor[j];
    other->spread_Pa_q10 = larger(other->spread_Pa_q10, Pa_q10(ZERO_WARM_Pa));
    if (far && condition->below >> j & 1u) {
      other->below_ms = BELOW_ms;
    }
  }
  tare_below(condition, k, above_baseline_Pa_q10);
}

/* lowest_Pa_q10: a reading above the baseline that is lower is below all that a release explains. */
static void watch_below(const struct step *step, int32_t above_baseline_Pa_q10, int32_t lowest_Pa_q10) {
  struct condition_sensor *sensor = step->sensor;
  const int32_t under = lowest_Pa_q10 - above_baseline_Pa_q10;
  const bool far = under > Pa_q10(FAR_BELOW_Pa);
  sensor->below_ms = under > 0 ? (uint16_t)(sensor->below_ms + step->ms) : 0;
  set_bit(&step->condition->below, step->k, under > 0);
  if (sensor->below_ms >= (far ? FAR_BELOW_ms : BELOW_ms)) {
    tare_again(step->condition, step->k, far, above_baseline_Pa_q10);
  }
}

/* While nothing touches, or a contact is unsure: the zero follows the readings. */
static void follow(const struct step *step) {
  struct condition *condition = step->condition;
  struct condition_sensor *sensor = step->sensor;
  const bool unsure = condition->unsure;
  condition->faded_Pa_q10[step->k] = 0;
  sensor->retained_Pa_q10 = retained_of(sensor);
  if (!unsure && settle(step)) {
    return;
  }
  const int32_t before = condition->zero_Pa_q10[step->k];
  const bool fresh = condition->gate.released_ms < FRESH_ms;
  const struct band band = band_of(step, fresh);
  int32_t remainder = before - sensor->baseline_Pa_q10;
  const int32_t above_baseline = step->above_Pa_q10 + remainder;
  if (!unsure) {
    follow_rest(step);
    remainder = follow_remainder(step, &band, fresh, remainder);
  }
  const struct band none = {0};
  const int32_t baseline_moved = follow_baseline(step, unsure ? &none : &band, !unsure, &remainder);
  sensor->rests_Pa_q10 += unsure ? baseline_moved : 0;
  set_zero(step, remainder, baseline_moved, sensor->baseline_Pa_q10 + remainder - before);
  condition->margin_Pa_q10[step->k] = (unsure ? 0 : band.margin_Pa_q10) + sensor->spread_Pa_q10;
  set_bit(&condition->restless, step->k, size_of(above_baseline) > Pa_q10(IDLE_LAG_Pa) + step->noise_Pa_q10 / 2);
  watch_below(step, above_baseline, band.lowest_Pa_q10 - condition->gate.open_Pa_q10);
}

/* Whether this is no contact: a press under which the zeros were taken is over, and the rubber that bulged beside it is above them. */
static bool is_release(const struct step *step, int32_t above_Pa_q10, int32_t peak_Pa_q10) {
  const int32_t under = band_of(step, false).lowest_Pa_q10 - Pa_q10(FAR_BELOW_Pa) - clamp(above_Pa_q10, -PRESSURE_MAX, 0);
  return step->condition->gate.pressed && peak_Pa_q10 < under >> BULGE_SHIFT;
}

/* All sensors are tared again after a while. */
static void release(const struct step *step) {
  struct condition *condition = step->condition;
  step->sensor->below_ms = (uint16_t)(step->sensor->below_ms + step->ms);
  const bool over = step->sensor->below_ms >= FAR_BELOW_ms;
  for (uint8_t k = 0; over && k < FT_MAX_SENSORS; k++) {
    tare_below(condition, k, clamped_difference(condition->sensor[k].before_Pa_q10, condition->zero_Pa_q10[k]));
  }
}

/* Whether the reading moved since the last update as in a press or a release, and not as a remainder. */
static bool moves(const struct step *step, int32_t above_Pa_q10) {
  const int32_t still = STILL_SIGMA * step->noise_Pa_q10;
  return step->fell_Pa_q10 < -still || step->fell_Pa_q10 > still + (larger(above_Pa_q10, 0) >> FALL_SHIFT);
}

void update_sensor(struct condition *condition, const struct frame *frame, const struct conditioned *conditioned, uint8_t k) {
  struct condition_sensor *sensor = &condition->sensor[k];
  const sensor_map bit = sensor_bit(k);
  const uint32_t gap_ms = condition->now_ms - sensor->updated_ms;
  const int32_t ms = gap_ms < STEP_MAX_ms ? (int32_t)gap_ms : STEP_MAX_ms;
  sensor->updated_ms = condition->now_ms;
  if (k == 0) {
    fade_pad(condition, ms);
  }
  if (frame->saturated & bit) {
    sensor->memory_Pa_q10 = sensor->reached_Pa_q10 = Pa_q10(SATURATED_Pa);
    condition->margin_Pa_q10[k] = Pa_q10(SATURATED_Pa) >> BAND_SHIFT;
  }
  if (!(conditioned->usable & bit) || frame->unsettled & bit) {
    return;
  }
  const int32_t reading = frame->pressure_Pa_q10[k], before = sensor->before_Pa_q10;
  const int32_t zero = condition->zero_Pa_q10[k], above = clamped_difference(reading, zero);
  const int32_t slow = clamp(clamped_difference(reading, sensor->slow_Pa_q10), -PRESSURE_MAX, PRESSURE_MAX);
  const int32_t rise = part_of(slow, share_in(ms, SLOW_ms));
  sensor->before_Pa_q10 = reading;
  sensor->slow_Pa_q10 += rise;
  struct step step = {
      .condition = condition,
      .sensor = sensor,
      .k = k,
      .usable = conditioned->usable,
      .ms = ms,
      .memory_share = share_in(ms, MEMORY_ms),
      .wander_share = share_in(ms, WANDER_ms),
      .noise_Pa_q10 = frame->noise_Pa_q10,
      .reading_Pa_q10 = reading,
      .fell_Pa_q10 = clamp(clamped_difference(before, reading), -PRESSURE_MAX, PRESSURE_MAX),
      .steady_Pa_q10 = clamped_difference(reading < before ? reading : before, zero),
      .slow_Pa_q10 = slow,
      .above_Pa_q10 = take_mean(condition, k, above),
  };
  remember(&step, rise);
  update_compare(condition, k, clamped_difference(conditioned->pressure_Pa_q10[k], condition->faded_Pa_q10[k]));
  if (is_release(&step, above, conditioned->peak_Pa_q10)) {
    release(&step);
  } else if (condition->gate.pressed && !condition->unsure) {
    hold(&step);
  } else {
    step.moves = moves(&step, above);
    follow(&step);
  }
}
