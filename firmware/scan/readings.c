#include "scan/readings.h"

#define MAX_Pa_q10 (MS58XX_MAX_PRESSURE_Pa * 1024)

/* Noise is no step. That of many sensors together may be a jolt: then every frame is searched. */
_Static_assert(READINGS_STILL_NOISES *MS58XX_NOISE_MAX_Pa < MS58XX_STEP_Pa, "MS58XX_STEP_Pa is too small for the noise of this sensor");

/* Less one if the value is negative. */
static uint32_t size_of(int32_t value) { return (uint32_t)(value ^ -(value < 0)); }

static int32_t difference(int32_t a, int32_t b) { return (int32_t)((uint32_t)a - (uint32_t)b); }

/* The sensor whose reading has stepped while all others of these did not move; all that have fallen, or risen faster
 * than presses do. Bitmaps. */
static sensor_map find_alone(const struct frame *frame, sensor_map sensors, const int32_t last_Pa_q10[], bool is_fast, sensor_map *jolted) {
  sensor_map stepped = 0;
  uint32_t largest = 0;
  uint32_t second = 0;
  for (uint8_t k = 0; k < frame->sensor_count; k++) {
    if (!(sensors >> k & 1u)) {
      continue;
    }
    const int32_t step = difference(frame->pressure_Pa_q10[k], last_Pa_q10[k]);
    *jolted |= step < -READINGS_JOLT_Pa_q10 || (is_fast && step > READINGS_JOLT_Pa_q10) ? sensor_bit(k) : 0;
    uint32_t size = size_of(step);
    if (size > largest) {
      second = largest;
      largest = size;
      stepped = sensor_bit(k);
    } else if (size > second) {
      second = size;
    }
  }
  const uint32_t noises = READINGS_STILL_NOISES * (uint32_t)frame->noise_Pa_q10;
  const bool others_rest = second < noises || second < largest / READINGS_ALONE;
  return largest > READINGS_STEP_Pa_q10 && others_rest ? stepped : 0;
}

/* alone: the sensor whose reading has just stepped alone, or 0. */
static void judge_alone(struct readings *readings, sensor_map alone, const struct frame *frame, const int32_t last_Pa_q10[]) {
  if (alone) {
    const unsigned k = count_sensors(alone - 1);
    const int32_t to_Pa_q10 = frame->pressure_Pa_q10[k];
    const int32_t step = difference(to_Pa_q10, last_Pa_q10[k]);
    const int32_t change = difference(to_Pa_q10, readings->alone_to_Pa_q10);
    if (alone == readings->alone && size_of(change) <= size_of(step) / 2) {
      readings->suspects |= alone;
    }
    readings->alone_to_Pa_q10 = to_Pa_q10;
  }
  readings->alone = alone;
}

/* Of a sensor without a reading that counts the last one is kept, to hold the next against. */
static void keep(struct readings *readings, sensor_map usable, sensor_map left_out, const int32_t last_Pa_q10[], int32_t kept_Pa_q10[]) {
  sensor_map bit = 1;
  for (uint8_t k = 0; k < FT_MAX_SENSORS; k++, bit <<= 1) {
    if (!(usable & ~left_out & bit)) {
      kept_Pa_q10[k] = last_Pa_q10[k];
    }
    readings->left_out += (left_out & bit) != 0;
  }
  readings->has_last |= usable & ~left_out;
}

/* For frames that are not like most. Returns the bitmap of readings that do not count. */
static __attribute__((noinline, cold)) sensor_map look_closer(struct readings *readings, struct frame *frame, sensor_map usable,
                                                              const int32_t last_Pa_q10[], int32_t kept_Pa_q10[]) {
  const bool all = usable == first_sensors(frame->sensor_count);
  const sensor_map seen = usable & (readings->has_last | readings->awaited);
  sensor_map jolted = 0;
  const bool is_fast = frame->t_us - readings->t_us < READINGS_FAST_us;
  sensor_map stepped = find_alone(frame, seen, last_Pa_q10, is_fast, &jolted);
  stepped = readings->presses_are_shared ? stepped : 0;
  const sensor_map alone = all ? stepped & readings->has_last : 0;
  readings->restored |= alone | (stepped & readings->awaited);
  readings->awaited &= ~usable;
  judge_alone(readings, alone, frame, last_Pa_q10);
  readings->jolted |= alone ? 0 : jolted & readings->has_last;
  sensor_map low = 0;
  sensor_map bit = 1;
  for (uint8_t k = 0; k < frame->sensor_count; k++, bit <<= 1) {
    if (!(usable & bit)) {
      continue;
    }
    if (frame->pressure_Pa_q10[k] < 0) {
      low |= bit;
    } else if (frame->pressure_Pa_q10[k] > MAX_Pa_q10) {
      frame->saturated |= bit;
    }
  }
  readings->suspects |= low & readings->was_low;
  readings->was_low = low | (readings->was_low & ~usable);
  const sensor_map left_out = low | alone;
  keep(readings, usable, left_out, last_Pa_q10, kept_Pa_q10);
  return left_out;
}

/* Whether nothing else needs to be checked, as in most frames. */
struct glance {
  uint32_t sum;
  uint32_t signs; /* the highest bit: a reading is outside the sensor's range */
};

/* Keeps the readings on the way. */
static struct glance compensate(const struct readings *readings, const uint32_t code[], sensor_map usable, struct frame *frame,
                                int32_t kept_Pa_q10[]) {
  struct glance glance = {0, 0};
  const struct ms58xx_thermal *thermal = readings->thermal;
  int32_t *pressure_Pa_q10 = frame->pressure_Pa_q10;
  const int32_t *end = pressure_Pa_q10 + frame->sensor_count;
  for (; pressure_Pa_q10 != end; usable >>= 1, code++, thermal++) {
    const int32_t value = usable & 1u ? ms58xx_compensate_pressure(thermal, *code) : 0;
    *pressure_Pa_q10++ = value;
    *kept_Pa_q10++ = value;
    glance.sum += (uint32_t)value;
    glance.signs |= (uint32_t)value | (MAX_Pa_q10 - (uint32_t)value);
  }
  return glance;
}

bool readings_take_pressures(struct readings *readings, const uint32_t code[], sensor_map good, struct frame *frame) {
  const sensor_map usable = good & readings->has_thermal & ~(readings->suspects | (readings->jolted & readings->zero));
  const int32_t *last_Pa_q10 = readings->last_Pa_q10[readings->newest];
  readings->newest ^= 1;
  int32_t *kept_Pa_q10 = readings->last_Pa_q10[readings->newest];
  const struct glance glance = compensate(readings, code, usable, frame, kept_Pa_q10);

  /* What steps or falls alone does so in the sum. */
  const uint32_t step = size_of((int32_t)(glance.sum - readings->last_sum));
  const uint32_t noises = READINGS_STILL_NOISES * (uint32_t)frame->noise_Pa_q10;
  sensor_map left_out = 0;
  frame->saturated = 0;
  if (usable != first_sensors(frame->sensor_count) || usable != readings->counted || (int32_t)glance.signs < 0 ||
      step + frame->sensor_count * noises >= READINGS_JOLT_Pa_q10) {
    left_out = look_closer(readings, frame, usable, last_Pa_q10, kept_Pa_q10);
  }
  readings->last_sum = glance.sum;
  readings->t_us = frame->t_us;
  readings->counted = usable & ~left_out;

  const sensor_map valid = readings->counted & ~readings->unproven;
  if (valid != usable) {
    for (uint8_t k = 0; k < frame->sensor_count; k++) {
      frame->pressure_Pa_q10[k] = valid >> k & 1u ? frame->pressure_Pa_q10[k] : 0;
    }
  }
  frame->valid = valid;
  frame->saturated &= valid;
  frame->doubtful = valid & (readings->doubtful | readings->jolted);
  frame->unsettled = valid & (readings->doubted | readings->jolted);
  frame->renewed = readings->renewed;
  readings->renewed = 0;
  frame->restored = readings->restored;
  readings->restored = 0;
  return left_out != 0;
}
