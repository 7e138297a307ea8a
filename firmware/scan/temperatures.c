#include "common/apart.h"
#include "port/divide.h"
#include "scan/readings.h"

#include <string.h>

/* No change between two readings: 15 Pa, and 3.5 standard deviations of the noise at OSR 256. */
#define TEMPERATURE_STILL_cC 6
/* MS5837-02BA datasheet, page 7: the range of the calculation. */
#define TEMPERATURE_MIN_cC (-4000)
#define TEMPERATURE_MAX_cC 8500
/* Fewer cannot outvote one. */
#define VOTERS_MIN 3
#define NO_MIDDLE INT32_MIN
/* A sensor that is in doubt for ever must not cost a frame in ten. */
#define HASTY_DOUBTS_MAX 4

static bool within(int32_t value, int32_t limit) { return value >= -limit && value <= limit; }

/* Of the temperatures of the array now, or NO_MIDDLE. */
static int32_t find_middle(const struct readings *readings, uint8_t sensor_count, sensor_map good, const int32_t now_cC[]) {
  int32_t values[FT_MAX_SENSORS];
  int count = 0;
  for (uint8_t k = 0; k < sensor_count; k++) {
    if (readings->has_thermal & sensor_bit(k)) {
      values[count++] = readings->thermal[k].first_order_cC;
    } else if (good & sensor_bit(k)) {
      values[count++] = now_cC[k];
    }
  }
  return count >= VOTERS_MIN ? apart_median(values, count) : NO_MIDDLE;
}

/* Whether to use a temperature that something speaks against. */
static bool settle(struct readings *readings, uint8_t k, int32_t now_cC, int32_t middle_cC, int32_t most_cC) {
  sensor_map bit = sensor_bit(k);
  bool possible = now_cC >= TEMPERATURE_MIN_cC && now_cC <= TEMPERATURE_MAX_cC;
  bool near = possible && (middle_cC == NO_MIDDLE || within(now_cC - middle_cC, READINGS_TEMPERATURE_NEAR_cC));
  bool agrees = (readings->doubted & bit) && within(now_cC - readings->doubted_cC[k], READINGS_TEMPERATURE_STEP_MAX_cC);
  bool use;
  bool insists; /* reports it again, and it cannot be */
  if (!(readings->has_thermal & bit)) {
    const bool pardoned = readings->pardoned & bit, known = readings->known & bit;
    const bool kept = known ? within(now_cC - readings->thermal[k].first_order_cC, READINGS_TEMPERATURE_STEP_MAX_cC) : near;
    use = possible && (kept || (agrees && pardoned));
    insists = !use && (agrees || (known && !pardoned));
  } else {
    use = within(now_cC - readings->thermal[k].first_order_cC, most_cC);
    insists = !use && (agrees || readings->jolted);
    readings->has_last &= insists && readings->moved ? ~bit : ~(sensor_map)0; /* no evidence any more */
  }
  if (!use) {
    readings->suspects |= insists ? bit : 0;
    readings->doubted |= bit;
    readings->doubted_cC[k] = now_cC;
    return false;
  }
  readings->strange = near ? readings->strange & ~bit : readings->strange | bit;
  return true;
}

static void forget(struct readings *readings, const struct readings_temperature *taken) {
  const sensor_map sensors = taken->prom_changed | taken->returned | ~taken->admitted;
  const sensor_map reset = readings->suspects & sensors;
  readings->restored |= reset & readings->has_thermal & readings->has_last; /* the others had their state until they moved */
  readings->pardoned = (readings->pardoned & ~sensors) | (taken->is_patient ? reset & ~readings->has_thermal : 0);
  readings->known = (readings->known | readings->has_thermal) & ~(taken->prom_changed | readings->strange);
  readings->known &= taken->is_soon ? ~(sensor_map)0 : taken->admitted;
  readings->has_thermal &= ~sensors;
  readings->doubted &= ~sensors;
  readings->strange &= ~sensors;
  readings->was_near &= ~sensors;
  readings->awaited |= readings->has_last & sensors;
  readings->has_last &= ~sensors;
  readings->counted &= ~sensors;
  readings->was_low &= ~sensors;
  readings->alone &= ~sensors;
  readings->suspects &= ~sensors;
}

/* Sensors whose PROM has a wrong CRC against the middle of all. */
static void prove(struct readings *readings, uint8_t sensor_count) {
  const int32_t *last_Pa_q10 = readings->last_Pa_q10[readings->newest];
  int32_t values[FT_MAX_SENSORS];
  int count = 0;
  for (uint8_t k = 0; k < sensor_count; k++) {
    if (readings->has_last & sensor_bit(k)) {
      values[count++] = last_Pa_q10[k] / 2;
    }
  }
  sensor_map near = 0;
  const int32_t middle = count > 0 ? apart_median(values, count) : 0;
  for (uint8_t k = 0; k < sensor_count; k++) {
    const sensor_map bit = readings->unproven & readings->has_last & sensor_bit(k);
    if (bit && within(last_Pa_q10[k] / 2 - middle, READINGS_APART_Pa_q10 / 2)) {
      near |= bit;
    }
  }
  readings->unproven &= ~(near & readings->was_near);
  readings->was_near = near;
}

/* Returns the bitmap of those apart that have not read like the others yet. Later they may be apart, as something warm may touch some. */
static sensor_map compare(struct readings *readings, uint8_t sensor_count) {
  if ((readings->has_thermal & ~readings->alike) == 0) {
    return 0;
  }
  int32_t values[FT_MAX_SENSORS];
  for (uint8_t k = 0; k < sensor_count; k++) {
    values[k] = readings->thermal[k].first_order_cC;
  }
  const sensor_map apart = apart_find(values, readings->has_thermal, sensor_count, READINGS_TEMPERATURE_APART_cC);
  const sensor_map like = readings->has_thermal & ~apart;
  readings->alike |= like & readings->was_alike;
  readings->was_alike = like;
  return apart & ~readings->alike;
}

static void average(struct readings *readings, uint8_t sensor_count, sensor_map admitted) {
  int32_t sum_cC = 0;
  int32_t sensors = 0;
  for (uint8_t k = 0; k < sensor_count; k++) {
    if (readings->has_thermal & admitted & sensor_bit(k)) {
      sum_cC += readings->thermal[k].temperature_cC;
      sensors++;
    }
  }
  if (sensors > 0) {
    readings->temperature_cC = (int16_t)port_divide(sum_cC, sensors);
  }
}

uint32_t readings_take_temperature(struct readings *readings, uint8_t sensor_count, const struct readings_temperature *taken) {
  forget(readings, taken);
  readings->renewed |= taken->prom_changed;
  readings->unproven = (readings->unproven | taken->prom_changed | taken->returned) & taken->prom_bad;
  if (readings->unproven) {
    prove(readings, sensor_count);
  }

  int32_t now_cC[FT_MAX_SENSORS] = {0};
  for (uint8_t k = 0; k < sensor_count; k++) {
    now_cC[k] = ms58xx_first_order_cC(&taken->prom[k], taken->code[k]);
  }
  const bool moved = readings->moved;
  const int32_t step_max_cC = taken->step_max_cC; /* more than usual after long */
  const bool is_less = moved && step_max_cC > READINGS_MOVED_cC && step_max_cC <= READINGS_TEMPERATURE_STEP_MAX_cC;
  const int32_t most_cC = is_less ? READINGS_MOVED_cC : step_max_cC;
  const int32_t middle_cC = find_middle(readings, sensor_count, taken->good, now_cC);
  uint32_t news = 0;
  sensor_map left = readings->counted & (readings->still | ~taken->good); /* in doubt as before */
  for (uint8_t k = 0; k < sensor_count; k++) {
    const sensor_map bit = sensor_bit(k);
    if (!(taken->good & bit)) {
      continue;
    }
    if (!settle(readings, k, now_cC[k], middle_cC, most_cC)) {
      news |= READINGS_ASK_AGAIN;
      left |= bit;
      continue;
    }
    struct ms58xx_thermal *thermal = &readings->thermal[k];
    const bool had = readings->has_thermal & bit;
    const bool still = within(now_cC[k] - thermal->first_order_cC, TEMPERATURE_STILL_cC);
    news |= had && still ? 0 : READINGS_MOVED;
    left |= had && !still ? bit : 0;
    ms58xx_compensate_temperature(&taken->prom[k], taken->code[k], had ? thermal->branch : MS58XX_BRANCH_UNKNOWN, thermal);
    readings->doubted &= ~bit;
    readings->has_thermal |= bit;
  }
  readings->alike &= taken->admitted & ~taken->prom_changed;
  readings->jolted = false;
  readings->moved = moved && left && readings->doubts_in_a_row < HASTY_DOUBTS_MAX;
  readings->doubtful = taken->prom_bad | readings->doubted | readings->strange | readings->apart | compare(readings, sensor_count);
  readings->doubtful |= readings->moved ? ~(sensor_map)0 : 0;
  average(readings, sensor_count, taken->admitted);
  memcpy(readings->vouched_Pa_q10, readings->last_Pa_q10[readings->newest], sizeof readings->vouched_Pa_q10);
  readings->frames = 0;
  news |= readings->moved ? READINGS_ASK_AGAIN : 0;
  if (!(news & READINGS_ASK_AGAIN)) {
    readings->doubts_in_a_row = 0;
  } else if (readings->doubts_in_a_row < HASTY_DOUBTS_MAX) {
    readings->doubts_in_a_row++;
  } else {
    news = READINGS_MOVED;
  }
  return news;
}

void readings_doubt(struct readings *readings, sensor_map apart) {
  readings->apart = apart;
  readings->doubtful |= apart;
}
