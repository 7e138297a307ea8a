#include "fake_bus.h"

#include <string.h>

/* Reset to the first PROM reading: 2.8 ms, recalled from the sensor family. */
#define RELOAD_us 2800u

uint32_t fake_conversion_us(uint8_t command) {
  static const uint32_t longest_us[] = {560, 1100, 2170, 4320, 8610, 17200};
  return longest_us[(command & 0x0F) / 2];
}

static bool misused_if(struct fake_bus *fake, bool misused, const char *how) {
  fake->misuses += misused;
  fake->misuse = misused ? how : fake->misuse;
  return misused;
}

static enum ft_status start(struct fake_bus *fake, enum fake_operation operation, uint8_t command, uint8_t byte_count, uint64_t now_us) {
  if (misused_if(fake, fake->running && operation != FAKE_RECOVERY, "two operations at once")) {
    return FT_ERR_BUSY;
  }
  if (fake->refuse_starts && operation != FAKE_RECOVERY) {
    return FT_ERR_BUSY;
  }
  if (misused_if(fake, fake->logged == FAKE_LOG, "the log is full")) {
    return FT_ERR_SPACE;
  }
  const uint32_t duration_us[] = {FAKE_COMMAND_us, fake->read_us, FAKE_RECOVERY_us};
  const bool sends = operation != FAKE_RECOVERY;
  misused_if(fake, sends && now_us < fake->ready_us, "something was sent during a conversion");
  misused_if(fake, sends && now_us < fake->powered_us, "something was sent before the PROM was loaded");
  fake->log[fake->logged++] = (struct fake_entry){operation, command, byte_count, now_us, now_us + duration_us[operation], FT_PENDING};
  fake->running = true;
  return FT_OK;
}

static enum ft_status start_command(void *context, uint8_t command, uint64_t now_us) {
  return start(context, FAKE_COMMAND, command, 0, now_us);
}

static enum ft_status start_read(void *context, uint8_t command, uint8_t byte_count, uint64_t now_us) {
  return start(context, FAKE_READ, command, byte_count, now_us);
}

static enum ft_status start_recovery(void *context, uint64_t now_us) { return start(context, FAKE_RECOVERY, 0, 0, now_us); }

static void answer_prom(struct fake_bus *fake, uint8_t command, struct array_bus_result *result) {
  int word = (command - MS58XX_CMD_READ_PROM) / 2;
  if (misused_if(fake, word >= MS58XX_PROM_WORDS || command % 2, "a PROM word that does not exist")) {
    return;
  }
  for (uint8_t k = 0; k < fake->sensor_count; k++) {
    uint16_t value = fake->prom[k].word[word];
    if (word == 3 && fake->misread_passes > 0 && fake->misread_prom >> k & 1u) {
      value ^= 0x0400;
    }
    result->bytes[k][0] = (uint8_t)(value >> 8);
    result->bytes[k][1] = (uint8_t)value;
  }
  if (word == 3 && fake->misread_passes > 0) {
    fake->misread_passes--;
  }
}

uint32_t fake_d1(const struct fake_bus *fake, uint8_t k) {
  return (fake->d1[k] & 0xFF) == 0xFF || fake->frozen >> k & 1u ? fake->d1[k] : fake->d1[k] + fake->noise;
}

static void answer_adc(struct fake_bus *fake, struct array_bus_result *result) {
  bool temperature = (fake->converted & 0xF0) == 0x50;
  fake->noise ^= !temperature;
  for (uint8_t k = 0; k < fake->sensor_count; k++) {
    uint32_t code = temperature ? fake->d2[k] : fake_d1(fake, k);
    if (!fake->converted || fake->zero_next >> k & 1u) {
      code = 0;
    }
    result->bytes[k][0] = (uint8_t)(code >> 16);
    result->bytes[k][1] = (uint8_t)(code >> 8);
    result->bytes[k][2] = (uint8_t)code;
  }
  fake->zero_next = 0;
  fake->converted = 0;
}

static enum ft_status poll(void *context, uint64_t now_us, struct array_bus_result *result, uint64_t *wake_us) {
  struct fake_bus *fake = context;
  if (misused_if(fake, !fake->running, "polled without an operation")) {
    return FT_ERR_ARGUMENT;
  }
  struct fake_entry *entry = &fake->log[fake->logged - 1];
  if (now_us < entry->end_us) {
    *wake_us = entry->end_us;
    return FT_PENDING;
  }
  fake->running = false;
  entry->end_us = now_us;
  if (entry->operation == FAKE_RECOVERY) {
    return entry->status = fake->recovery_is;
  }
  if (fake->fail_at >= 0 && fake->fail_at-- == 0) {
    return entry->status = fake->fail_with;
  }
  memset(result, 0xA5, sizeof *result);
  result->acknowledged = fake->answering;
  result->nacks = 0;
  for (uint8_t k = 0; k < fake->sensor_count; k++) {
    result->nacks += !(fake->answering >> k & 1u);
  }
  if (entry->operation == FAKE_READ) {
    if (entry->command == MS58XX_CMD_READ_ADC && entry->byte_count == 3) {
      answer_adc(fake, result);
    } else if (entry->command >= MS58XX_CMD_READ_PROM && entry->byte_count == 2) {
      answer_prom(fake, entry->command, result);
    } else {
      misused_if(fake, true, "a reading that no sensor knows");
    }
    for (uint8_t k = 0; k < fake->sensor_count; k++) {
      if (!(fake->answering >> k & 1u)) {
        memset(result->bytes[k], 0xFF, sizeof result->bytes[k]);
      }
    }
  } else if (entry->command == MS58XX_CMD_RESET) {
    fake->powered_us = now_us + RELOAD_us;
    fake->converted = 0;
  } else {
    uint8_t kind = entry->command & 0xF0;
    misused_if(fake, (kind != 0x40 && kind != 0x50) || entry->command & 1 || (entry->command & 0x0F) > 0x0A,
               "a command that no sensor knows");
    fake->converted = entry->command;
    fake->ready_us = now_us + fake_conversion_us(entry->command);
  }
  return entry->status = FT_OK;
}

void fake_bus_init(struct fake_bus *fake, struct array_bus *bus, uint8_t sensor_count) {
  memset(fake, 0, sizeof *fake);
  fake->sensor_count = sensor_count;
  fake->read_us = FAKE_READ_us;
  fake->answering = first_sensors(sensor_count);
  fake->fail_at = -1;
  fake->fail_with = FT_ERR_TIMEOUT;
  fake->recovery_is = FT_OK;
  for (uint8_t k = 0; k < sensor_count; k++) {
    fake->prom[k] =
        (struct ms58xx_prom){{(uint16_t)(0x0040 + k), (uint16_t)(46372 + 31 * k), 43981, 29059, 27842, (uint16_t)(31553 + k), 28165}};
    fake->prom[k].word[0] |= (uint16_t)(ms58xx_prom_crc4(&fake->prom[k]) << 12);
    fake->d1[k] = 6465444u + 1000u * k;
    fake->d2[k] = 8077636u + 150000u;
  }
  *bus = (struct array_bus){.context = fake,
                            .read_lead_us = FAKE_READ_LEAD_us,
                            .start_command = start_command,
                            .start_read = start_read,
                            .start_recovery = start_recovery,
                            .poll = poll};
}
