#include "scan/readings.h"

#define MAX_Pa_q10 (MS58XX_MAX_PRESSURE_Pa * 1024)

/* Noise is no step. That of many sensors together may be a jolt: then every frame is searched. */
_Static_assert(READINGS_STILL_NOISES *MS58XX_NOISE_MAX_Pa < MS58XX_STEP_Pa, "MS58XX_STEP_Pa is too small for the noise of this sensor");

/* Less one if the value is negative. */
static uint32_t size_of(int32_t value) { return (uint32_t)(value ^ -(value < 0)); }

static int32_t difference(int32_t a, int32_t b) { return (int32_t)((uint32_t)a - (uint32_t)b); }

/* Bitmap of the sensor whose reading has stepped while all others of these did not move. */
static sensor_map find_alone(const struct frame *frame, sensor_map sensors, const int32_t last_Pa_q10[], bool *jolted) {
  sensor_map stepped = 0;
  uint32_t largest = 0;
  uint32_t second = 0;
  for (uint8_t k = 0; k < frame->sensor_count; k++) {
    if (!(sensors >> k & 1u)) {
      continue;
    }
    const uint32_t size = size_of(difference(frame->pressure_Pa_q10[k], last_Pa_q10[k]));
    if (size > largest) {
      second = largest;
      largest = size;
      stepped = sensor_bit(k);
    } else if (size > second) {
      second = size;
    }
  }
  *jolted = largest > READINGS_JOLT_Pa_q10;
  const uint32_t noises = READINGS_STILL_NOISES * (uint32_t)frame->noise_Pa_q10;
  const bool others_rest = second < noises || second < largest / READINGS_ALONE;
  return largest > READINGS_STEP_Pa_q10 && others_rest ? stepped : 0;
}

/* Of a sensor without a reading that counts the last one is kept, to hold the next against. What none was kept of has not moved. */
static void keep(struct readings *readings, sensor_map usable, sensor_map left_out, const int32_t last_Pa_q10[], int32_t kept_Pa_q10[]) {
  const sensor_map fresh = usable & ~(readings->has_last | readings->awaited);
  sensor_map bit = 1;
  for (uint8_t k = 0; k < FT_MAX_SENSORS; k++, bit <<= 1) {
    if (!(usable & ~left_out & bit)) {
      kept_Pa_q10[k] = last_Pa_q10[k];
    }
    if (fresh & bit) {
      readings->vouched_Pa_q10[k] = kept_Pa_q10[k];
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
  bool jolted;
  sensor_map stepped = find_alone(frame, seen, last_Pa_q10, &jolted);
  stepped = readings->presses_are_shared ? stepped : 0;
  const sensor_map alone = all ? stepped & readings->has_last : 0;
  readings->restored |= alone | (stepped & readings->awaited);
  readings->suspects |= alone & readings->alone;
  readings->alone = alone;
  readings->jolted = readings->jolted || (jolted && !alone);
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
  readings->awaited &= ~usable;
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

static __attribute__((noinline, cold)) void follow_moves(struct readings *readings, const int32_t kept_Pa_q10[], uint8_t sensor_count) {
  uint32_t sum_Pa = 0;
  for (uint8_t k = 0; k < sensor_count; k++) {
    sum_Pa += size_of(difference(kept_Pa_q10[k], readings->vouched_Pa_q10[k])) >> 10;
  }
  readings->moved = readings->moved || readings->jolted || (sum_Pa > READINGS_MOVED_Pa && readings->frames >= READINGS_MOVED_FRAMES);
  readings->asks |= readings->moved || (sum_Pa > READINGS_MOVED_Pa / 2 && readings->frames >= READINGS_ASK_FRAMES);
  if (readings->frames < READINGS_FRAMES_MAX) {
    readings->frames++;
  }
}

bool readings_take_pressures(struct readings *readings, const uint32_t code[], sensor_map good, struct frame *frame) {
  const sensor_map usable = good & readings->has_thermal & ~readings->suspects;
  const int32_t *last_Pa_q10 = readings->last_Pa_q10[readings->newest];
  readings->newest ^= 1;
  int32_t *kept_Pa_q10 = readings->last_Pa_q10[readings->newest];
  const struct glance glance = compensate(readings, code, usable, frame, kept_Pa_q10);

  /* What steps or falls alone does so in the sum. */
  const uint32_t step = size_of((int32_t)(glance.sum - readings->last_sum));
  const uint32_t noises = READINGS_STILL_NOISES * (uint32_t)frame->noise_Pa_q10;
  sensor_map left_out = 0;
  frame->saturated = 0;
  readings->last_sum = glance.sum;
  if (usable != first_sensors(frame->sensor_count) || usable != readings->counted || (int32_t)glance.signs < 0 ||
      step + frame->sensor_count * noises >= READINGS_JOLT_Pa_q10) {
    left_out = look_closer(readings, frame, usable, last_Pa_q10, kept_Pa_q10);
  }
  follow_moves(readings, kept_Pa_q10, frame->sensor_count);
  readings->counted = usable & ~left_out;

  const sensor_map valid = readings->counted & ~readings->unproven;
  if (valid != usable) {
    for (uint8_t k = 0; k < frame->sensor_count; k++) {
      frame->pressure_Pa_q10[k] = valid >> k & 1u ? frame->pressure_Pa_q10[k] : 0;
    }
  }
  const sensor_map doubt = readings->moved ? ~(sensor_map)0 : readings->still & (frame->unsettled | ~frame->valid);
  frame->valid = valid;
  frame->saturated &= valid;
  frame->doubtful = valid & (readings->doubtful | doubt);
  frame->unsettled = valid & (readings->doubted | doubt);
  frame->renewed = readings->renewed;
  readings->renewed = 0;
  frame->restored = readings->restored;
  readings->restored = 0;
  return left_out != 0;
}
