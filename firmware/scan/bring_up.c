#include "scan/bring_up.h"

#include <string.h>

/* From one admission to the next, doubled while they follow each other. Supplies that dip once do so again. While a sensor is left out: */
#define INTERVAL_us 16000u
#define INTERVAL_LEFT_OUT_us 1000000u
#define INTERVAL_MAX_us 8000000u
#define PASSES 3

void bring_up_init(struct bring_up *bring_up, uint8_t sensor_count) {
  memset(bring_up, 0, sizeof *bring_up);
  bring_up->sensor_count = sensor_count;
}

void bring_up_begin(struct bring_up *bring_up, bool of_suspects, uint64_t now_us) {
  bring_up->of_suspects = of_suspects;
  bring_up->interval_us = (uint32_t)(now_us - bring_up->began_us) > 2 * INTERVAL_MAX_us ? 0 : bring_up->interval_us;
  bring_up->began_us = now_us;
  bring_up->pass = 0;
  bring_up->word = 0;
  bring_up->heard = 0;
  bring_up->good = 0;
}

void bring_up_take_reset(struct bring_up *bring_up, sensor_map acknowledged) {
  bring_up->heard = acknowledged & first_sensors(bring_up->sensor_count);
  bring_up->answered = bring_up->heard;
}

/* Another PROM is another sensor: nothing that was known of this one holds. */
static void use_prom(struct bring_up *bring_up, uint8_t k) {
  if (memcmp(&bring_up->prom[k], &bring_up->read[k], sizeof bring_up->prom[k]) != 0) {
    bring_up->prom[k] = bring_up->read[k];
    bring_up->changed |= sensor_bit(k);
  }
}

/* Of one complete reading of all PROMs. What is good is kept. */
static void judge_pass(struct bring_up *bring_up) {
  bring_up->differs = 0;
  bring_up->blank = 0;
  for (uint8_t k = 0; k < bring_up->sensor_count; k++) {
    sensor_map bit = sensor_bit(k);
    if (!(bring_up->answered & bit) || (bring_up->good & bit)) {
      continue;
    }
    switch (ms58xx_check_prom(&bring_up->read[k])) {
    case MS58XX_PROM_GOOD:
      bring_up->good |= bit;
      use_prom(bring_up, k);
      break;
    case MS58XX_PROM_CRC_DIFFERS: bring_up->differs |= bit; break;
    case MS58XX_PROM_BLANK: bring_up->blank |= bit; break;
    }
  }
}

bool bring_up_take_word(struct bring_up *bring_up, const struct array_bus_result *result) {
  for (uint8_t k = 0; k < bring_up->sensor_count; k++) {
    const uint8_t *bytes = result->bytes[k];
    bring_up->read[k].word[bring_up->word] = (uint16_t)(bytes[0] << 8 | bytes[1]);
  }
  bring_up->answered &= result->acknowledged;
  bring_up->word++;
  if (bring_up->word < MS58XX_PROM_WORDS) {
    return true;
  }
  judge_pass(bring_up);
  bring_up->pass++;
  bring_up->word = 0;
  if (bring_up->good == first_sensors(bring_up->sensor_count) || bring_up->pass >= PASSES) {
    return false;
  }
  bring_up->answered = bring_up->heard;
  return true;
}

struct bring_up_result bring_up_end(struct bring_up *bring_up) {
  for (uint8_t k = 0; k < bring_up->sensor_count; k++) {
    if (bring_up->differs >> k & 1u) {
      use_prom(bring_up, k);
    }
  }
  const sensor_map admitted = bring_up->good | bring_up->differs;
  bring_up->rechecks = bring_up->differs == 0 ? 0 : (uint8_t)(bring_up->rechecks + (bring_up->rechecks <= BRING_UP_RECHECKS));
  const bool all = admitted == first_sensors(bring_up->sensor_count) && !bring_up_wants_recheck(bring_up);
  const uint32_t least_us = all ? INTERVAL_us : INTERVAL_LEFT_OUT_us, twice_us = 2 * bring_up->interval_us;
  const uint32_t most_us = all && !bring_up->of_suspects ? INTERVAL_LEFT_OUT_us : INTERVAL_MAX_us;
  bring_up->interval_us = twice_us > most_us ? most_us : twice_us < least_us ? least_us : twice_us;
  bring_up->next_us = bring_up->began_us + bring_up->interval_us;
  return (struct bring_up_result){admitted, bring_up->differs | bring_up->blank};
}
