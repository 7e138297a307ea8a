#include "condition/condition.h"

#include "port/divide.h"

#include <string.h>

static void begin_tare(struct condition *condition, uint8_t k) {
  condition->zero_sum[k] = 0;
  condition->zero_min[k] = INT32_MAX;
  condition->zero_max[k] = INT32_MIN;
  condition->tare_left[k] = CONDITION_TARE_FRAMES;
  condition->below[k] = 0;
}

void condition_tare(struct condition *condition) {
  memset(condition, 0, sizeof *condition);
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
  condition->zero_sum[k] += pressure_Pa_q10;
  if (pressure_Pa_q10 < condition->zero_min[k]) {
    condition->zero_min[k] = pressure_Pa_q10;
  }
  if (pressure_Pa_q10 > condition->zero_max[k]) {
    condition->zero_max[k] = pressure_Pa_q10;
  }
  condition->tare_left[k]--;
  if (condition->tare_left[k] == 0) {
    int64_t sum = condition->zero_sum[k] - condition->zero_min[k] - condition->zero_max[k];
    condition->zero_Pa_q10[k] = mean_of(sum, CONDITION_TARE_FRAMES - 2);
    condition->zero_rest[k] = 0;
  }
}

static void track_step(struct condition *condition, uint8_t k, int32_t above_Pa_q10) {
  int32_t rest = condition->zero_rest[k] + above_Pa_q10;
  int32_t whole = rest / CONDITION_TRACK_FRAMES;
  condition->zero_Pa_q10[k] += whole;
  condition->zero_rest[k] = rest - whole * CONDITION_TRACK_FRAMES;
}

static int32_t clamped_difference(int32_t a, int32_t b) {
  int32_t difference = (int32_t)((uint32_t)a - (uint32_t)b);
  bool overflows = ((a ^ b) & (a ^ difference)) < 0;
  if (!overflows) {
    return difference;
  }
  return a < 0 ? INT32_MIN : INT32_MAX;
}

/* value * factor / 2^16, saturated; by halves of 16 bits. */
static int32_t scaled_by(int32_t value, uint32_t factor_q16) {
  uint32_t size = value < 0 ? 0u - (uint32_t)value : (uint32_t)value;
  uint32_t whole = (size >> 16) * factor_q16;
  uint32_t rest_high = (size & 0xFFFF) * (factor_q16 >> 16);
  uint32_t rest_low = ((size & 0xFFFF) * (factor_q16 & 0xFFFF)) >> 16;
  uint32_t sum = whole + rest_high + rest_low;
  bool overflows = (size >> 16) > (INT32_MAX >> 1) / factor_q16 || sum > INT32_MAX;
  int32_t result = overflows ? INT32_MAX : (int32_t)sum;
  return value < 0 ? -result : result;
}

void condition_frame(struct condition *condition, const struct frame *frame,
                     const struct condition_gains *gains, struct conditioned *conditioned) {
  memset(conditioned, 0, sizeof *conditioned);
  uint32_t readable = frame->valid & ~frame->saturated;
  conditioned->tared = readable != 0;
  for (uint8_t k = 0; k < frame->sensor_count; k++) {
    uint32_t bit = UINT32_C(1) << k;
    if (frame->renewed & bit) {
      begin_tare(condition, k);
    }
    if (!(readable & bit)) {
      continue;
    }
    if (condition->tare_left[k] > 0) {
      conditioned->tared = false;
      tare_step(condition, k, frame->pressure_Pa_q10[k]);
      continue;
    }
    int32_t above = clamped_difference(frame->pressure_Pa_q10[k], condition->zero_Pa_q10[k]);
    if (gains) {
      above = scaled_by(above, gains->inverse_q16[k]);
    }
    conditioned->pressure_Pa_q10[k] = above;
    conditioned->usable |= bit;
    if (above > conditioned->peak_Pa_q10) {
      conditioned->peak_Pa_q10 = above;
    }
  }
  int32_t sigmas = condition->contact ? CONDITION_CLOSE_SIGMA : CONDITION_OPEN_SIGMA;
  condition->contact =
      frame->saturated != 0 || conditioned->peak_Pa_q10 > sigmas * frame->noise_Pa_q10;
  conditioned->contact = condition->contact;
  if (condition->contact) {
    return;
  }
  for (uint8_t k = 0; k < frame->sensor_count; k++) {
    if (!(conditioned->usable & (UINT32_C(1) << k))) {
      continue;
    }
    if (conditioned->pressure_Pa_q10[k] >= -CONDITION_OPEN_SIGMA * frame->noise_Pa_q10) {
      condition->below[k] = 0;
      track_step(condition, k, conditioned->pressure_Pa_q10[k]);
      continue;
    }
    conditioned->tared = false;
    condition->below[k]++;
    if (condition->below[k] == CONDITION_BELOW_FRAMES) {
      begin_tare(condition, k);
    }
  }
}
