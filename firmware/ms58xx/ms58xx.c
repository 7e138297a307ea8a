#include "ms58xx/ms58xx.h"

#include <stddef.h>

#define ROW(ratio, bits, max_us, noise_Pa, noise_degC)                                                                                     \
  {                                                                                                                                        \
    .osr = (ratio), .convert_pressure = 0x40 | (bits), .convert_temperature = 0x50 | (bits), .conversion_us = (max_us)*105u / 100u,        \
    .maximum_us = (max_us), .noise_Pa_q10 = (int32_t)((noise_Pa)*1024.0f)                                                                  \
  }
static const struct ms58xx_osr osr_table[] = {MS58XX_OSR_TABLE(ROW)};

const struct ms58xx_osr *ms58xx_find_osr(uint16_t osr) {
  for (size_t i = 0; i < sizeof osr_table / sizeof osr_table[0]; i++) {
    if (osr_table[i].osr == osr) {
      return &osr_table[i];
    }
  }
  return NULL;
}

uint8_t ms58xx_crc4_bytes(const uint8_t bytes[16]) {
  uint16_t remainder = 0;
  for (int i = 0; i < 16; i++) {
    remainder ^= bytes[i];
    for (int bit = 0; bit < 8; bit++) {
      remainder = (uint16_t)((remainder & 0x8000u) ? (uint16_t)(remainder << 1) ^ 0x3000u : (uint16_t)(remainder << 1));
    }
  }
  return (uint8_t)(remainder >> 12);
}

uint8_t ms58xx_prom_crc4(const struct ms58xx_prom *prom) {
  uint8_t bytes[16] = {0};
  for (int i = 0; i < MS58XX_PROM_WORDS; i++) {
    bytes[2 * i] = (uint8_t)(prom->word[i] >> 8);
    bytes[2 * i + 1] = (uint8_t)prom->word[i];
  }
  bytes[0] &= 0x0F;
  return ms58xx_crc4_bytes(bytes);
}

enum ms58xx_prom_state ms58xx_check_prom(const struct ms58xx_prom *prom) {
  for (int i = 1; i < MS58XX_PROM_WORDS; i++) {
    if (prom->word[i] == 0 || prom->word[i] == 0xFFFF) {
      return MS58XX_PROM_BLANK;
    }
  }
  return ms58xx_prom_crc4(prom) == prom->word[0] >> 12 ? MS58XX_PROM_GOOD : MS58XX_PROM_CRC_DIFFERS;
}

enum ms58xx_branch ms58xx_branch_of(enum ms58xx_branch previous, int32_t temperature_cC) {
  int32_t warm_edge_cC = 2000;
  int32_t very_cold_edge_cC = MS58XX_VERY_COLD_cC;
  switch (previous) {
  case MS58XX_BRANCH_WARM: warm_edge_cC -= MS58XX_BRANCH_HYSTERESIS_cC; break;
  case MS58XX_BRANCH_COLD:
    warm_edge_cC += MS58XX_BRANCH_HYSTERESIS_cC;
    very_cold_edge_cC -= MS58XX_BRANCH_HYSTERESIS_cC;
    break;
  case MS58XX_BRANCH_VERY_COLD: very_cold_edge_cC += MS58XX_BRANCH_HYSTERESIS_cC; break;
  case MS58XX_BRANCH_UNKNOWN: break;
  }
  if (temperature_cC >= warm_edge_cC) {
    return MS58XX_BRANCH_WARM;
  }
  return temperature_cC >= very_cold_edge_cC ? MS58XX_BRANCH_COLD : MS58XX_BRANCH_VERY_COLD;
}

static int32_t first_order_cC(int32_t dT, uint16_t c6) { return 2000 + (int32_t)(((int64_t)dT * c6) >> 23); }

static int32_t difference_from(const struct ms58xx_prom *prom, uint32_t d2) { return (int32_t)d2 - ((int32_t)prom->word[5] << 8); }

int32_t ms58xx_first_order_cC(const struct ms58xx_prom *prom, uint32_t d2) {
  return first_order_cC(difference_from(prom, d2), prom->word[6]);
}

/* The terms of a branch (sensors.h), as statements. */
#define SQUARE_DT dT_squared
#define SQUARE_X below_squared
#define BEYOND (below + (2000 - MS58XX_VERY_COLD_cC))
#define SQUARE_Y (BEYOND * BEYOND)
#define SUBTRACT_T(term) temperature_cC -= (int32_t)(term)
#define SUBTRACT_OFF(term) offset -= (term)
#define SUBTRACT_SENS(term) sensitivity -= (term)
#define TERM(from, times, square, shift) SUBTRACT_##from(((times)*SQUARE_##square) >> (shift));

void ms58xx_compensate_temperature(const struct ms58xx_prom *prom, uint32_t d2, enum ms58xx_branch previous,
                                   struct ms58xx_thermal *thermal) {
  const uint16_t *c = prom->word;
  int32_t dT = difference_from(prom, d2);
  int32_t temperature_cC = first_order_cC(dT, c[6]);
  int64_t offset = ((int64_t)c[2] << MS58XX_OFF_T1) + (((int64_t)c[4] * dT) >> MS58XX_TCO);
  int64_t sensitivity = ((int64_t)c[1] << MS58XX_SENS_T1) + (((int64_t)c[3] * dT) >> MS58XX_TCS);

  thermal->branch = ms58xx_branch_of(previous, temperature_cC);
  thermal->dT = dT;
  thermal->first_order_cC = temperature_cC;

  int64_t dT_squared = (int64_t)dT * dT;
  int64_t below = temperature_cC - 2000;
  int64_t below_squared = below * below;
  switch (thermal->branch) {
  case MS58XX_BRANCH_COLD: MS58XX_COLD(TERM) break;
  case MS58XX_BRANCH_VERY_COLD: MS58XX_VERY_COLD(TERM) break;
  case MS58XX_BRANCH_WARM:
  case MS58XX_BRANCH_UNKNOWN: /* which no temperature is */ MS58XX_WARM(TERM) break;
  }
  thermal->temperature_cC = temperature_cC;
  thermal->offset = offset;
  thermal->sensitivity = sensitivity;
}

/* The product of a 24-bit code. Sensitivities of 35 bits, all that make sense, take four 32-bit products and half the time. */
static int64_t multiply(uint32_t code, int64_t sensitivity) {
  int32_t top = (int32_t)(sensitivity >> 32);
  if (top < -4 || top > 3) {
    return (int64_t)code * sensitivity;
  }
  int32_t high = (int32_t)(sensitivity >> 16);
  uint32_t low = (uint16_t)sensitivity;
  uint32_t code_high = code >> 12, code_low = code & 0xFFFu;
  int64_t upper = (int64_t)((int32_t)code_high * high) * (1 << 12) + (int32_t)code_low * high;
  return upper * (1 << 16) + ((int64_t)(code_high * low) << 12) + code_low * low;
}

int32_t ms58xx_compensate_pressure(const struct ms58xx_thermal *thermal, uint32_t d1) {
  int64_t pressure = (multiply(d1, thermal->sensitivity) >> 21) - thermal->offset;
  int64_t pressure_Pa_q10 = (pressure * MS58XX_Q10_TIMES) >> MS58XX_Q10_SHIFT;
  if (pressure_Pa_q10 > INT32_MAX) {
    return INT32_MAX;
  }
  if (pressure_Pa_q10 < INT32_MIN) {
    return INT32_MIN;
  }
  return (int32_t)pressure_Pa_q10;
}
