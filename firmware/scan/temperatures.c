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

/* The median, or NO_MIDDLE. */
static int32_t find_middle(const int32_t value[], sensor_map which) {
  int32_t values[FT_MAX_SENSORS];
  int count = 0;
  for (; which; which >>= 1, value++) {
    if (which & 1u) {
      values[count++] = *value;
    }
  }
  return count >= VOTERS_MIN ? apart_median(values, count) : NO_MIDDLE;
}

/* Whether to use a temperature. */
static bool settle(struct readings *readings, uint8_t k, int32_t now_cC, int32_t middle_cC, int32_t warmed_cC) {
  sensor_map bit = sensor_bit(k);
  bool possible = now_cC >= TEMPERATURE_MIN_cC && now_cC <= TEMPERATURE_MAX_cC;
  bool near = possible && (middle_cC == NO_MIDDLE || within(now_cC - middle_cC, READINGS_TEMPERATURE_NEAR_cC));
  bool agrees = (readings->doubted & bit) && within(now_cC - readings->doubted_cC[k], READINGS_TEMPERATURE_SAME_cC);
  bool use, insists; /* reports it again, and it cannot be */
  if (!(readings->has_thermal & bit)) {
    const bool pardoned = readings->pardoned & bit, known = readings->known & bit;
    const bool kept = known ? within(now_cC - readings->thermal[k].first_order_cC, READINGS_TEMPERATURE_SAME_cC) : near;
    use = possible && (kept || (agrees && pardoned));
    insists = !use && (agrees || (known && !pardoned));
  } else {
    const int32_t off_cC = now_cC - readings->steady_cC[k];
    const int32_t beyond_cC = within(off_cC, warmed_cC) ? 0 : off_cC < 0 ? off_cC + warmed_cC : off_cC - warmed_cC;
    use = within(beyond_cC, READINGS_MOVED_cC);
    readings->steady_cC[k] = use ? now_cC - beyond_cC : readings->steady_cC[k];
    insists = !use && (agrees || readings->jolted);
    readings->has_last &= insists && readings->asks ? ~bit : ~(sensor_map)0; /* no evidence any more */
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
  sensor_map near = 0;
  const int32_t middle_Pa_q10 = find_middle(last_Pa_q10, readings->has_last);
  for (uint8_t k = 0; k < sensor_count; k++) {
    if (middle_Pa_q10 == NO_MIDDLE || within(last_Pa_q10[k] - middle_Pa_q10, READINGS_APART_Pa_q10)) {
      near |= readings->unproven & readings->has_last & sensor_bit(k);
    }
  }
  readings->unproven &= ~(near & readings->was_near);
  readings->was_near = near;
}

/* Returns the bitmap of those apart that have not read like the others yet. Later they may be apart, as something warm may touch some. */
static sensor_map compare(struct readings *readings, uint8_t sensor_count, sensor_map used, const int32_t now_cC[]) {
  if ((used & ~readings->alike) == 0) {
    return 0;
  }
  const sensor_map apart = apart_find(now_cC, used, sensor_count, READINGS_TEMPERATURE_APART_cC);
  const sensor_map like = used & ~apart;
  readings->alike |= like & readings->was_alike;
  readings->was_alike = like;
  return apart & ~readings->alike;
}

uint32_t readings_take_temperature(struct readings *readings, uint8_t sensor_count, const struct readings_temperature *taken) {
  forget(readings, taken);
  readings->renewed |= taken->prom_changed;
  readings->unproven = (readings->unproven | taken->prom_changed | taken->returned) & taken->prom_bad;
  if (readings->unproven) {
    prove(readings, sensor_count);
  }

  int32_t now_cC[FT_MAX_SENSORS] = {0}; /* at first those in use, where there are */
  for (uint8_t k = 0; k < sensor_count; k++) {
    const bool has = readings->has_thermal & sensor_bit(k);
    now_cC[k] = has ? readings->thermal[k].first_order_cC : ms58xx_first_order_cC(&taken->prom[k], taken->code[k]);
  }
  const int32_t middle_cC = find_middle(now_cC, readings->has_thermal | taken->good);
  uint32_t news = 0;
  int32_t sum_cC = 0, used = 0;
  sensor_map left = readings->counted & ~taken->good; /* in doubt as before */
  for (uint8_t k = 0; k < sensor_count; k++) {
    const sensor_map bit = sensor_bit(k);
    if (!(taken->good & bit)) {
      continue;
    }
    now_cC[k] = ms58xx_first_order_cC(&taken->prom[k], taken->code[k]);
    if (!settle(readings, k, now_cC[k], middle_cC, taken->warmed_cC)) {
      news |= READINGS_ASK_AGAIN;
      left |= bit;
      continue;
    }
    struct ms58xx_thermal *thermal = &readings->thermal[k];
    const bool had = readings->has_thermal & bit;
    readings->steady_cC[k] = had ? readings->steady_cC[k] : now_cC[k];
    const bool still = within(now_cC[k] - thermal->first_order_cC, TEMPERATURE_STILL_cC);
    news |= had && still ? 0 : READINGS_MOVED;
    left |= had && !within(now_cC[k] - readings->steady_cC[k], READINGS_MOVED_cC / 2) ? bit : 0;
    ms58xx_compensate_temperature(&taken->prom[k], taken->code[k], had ? thermal->branch : MS58XX_BRANCH_UNKNOWN, thermal);
    readings->doubted &= ~bit;
    readings->has_thermal |= bit;
    sum_cC += thermal->temperature_cC;
    used++;
  }
  readings->alike &= taken->admitted & ~taken->prom_changed;
  readings->jolted = false;
  readings->moved = readings->asks = readings->asks && left && readings->doubts_in_a_row < HASTY_DOUBTS_MAX;
  readings->doubtful = taken->prom_bad | readings->doubted | readings->strange | readings->apart |
                       compare(readings, sensor_count, readings->has_thermal & taken->good & ~readings->doubted, now_cC);
  readings->temperature_cC = (int16_t)(used > 0 ? port_divide(sum_cC, used) : readings->temperature_cC);
  memcpy(readings->vouched_Pa_q10, readings->last_Pa_q10[readings->newest], sizeof readings->vouched_Pa_q10);
  readings->frames = readings->frames > READINGS_MOVED_FRAMES ? (uint8_t)(readings->frames - READINGS_MOVED_FRAMES) : 0;
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
