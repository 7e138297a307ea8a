/* TE Connectivity's MS58xx family, of which the build chooses one (sensors.h): commands, calibration PROM and
 * compensation. Pure functions: no bus, no time, no state but what the caller owns.
 *
 * Sources: the data sheets that sensors.h names; Application Note AN520 for the CRC-4. */
#pragma once

#include "common/status.h"
#include "ms58xx/sensors.h"

#include <stdint.h>

enum {
  MS58XX_CMD_RESET = 0x1E,
  MS58XX_CMD_READ_ADC = 0x00,  /* 3 bytes, MSB first; 0 = no finished conversion */
  MS58XX_CMD_READ_PROM = 0xA0, /* + 2 * word, 2 bytes, MSB first */
  MS58XX_PROM_WORDS = 7,       /* an eighth is refused by some parts */
};

/* PROM reload after reset: 2.8 ms (recalled from the sensor family; public drivers wait 3 ms). */
#define MS58XX_RESET_us 4000u

/* One row per oversampling ratio: the commands and the time they take cannot disagree. */
struct ms58xx_osr {
  uint16_t osr;
  uint8_t convert_pressure;    /* D1 */
  uint8_t convert_temperature; /* D2 */
  uint16_t conversion_us;      /* the maximum plus 5 % for the sensor's own oscillator. An earlier
                                  read returns 0 and spoils the conversion */
  uint16_t maximum_us;         /* of the conversion, from the datasheet */
  int32_t noise_Pa_q10;        /* rms of one reading, 1/1024 Pa */
};

/* NULL for anything but 256, 512, 1024, 2048, 4096, 8192. */
const struct ms58xx_osr *ms58xx_find_osr(uint16_t osr);

/* W0: CRC-4, type, factory bits. W1..W6: C1..C6. */
struct ms58xx_prom {
  uint16_t word[MS58XX_PROM_WORDS];
};

/* CRC-4 of the seven words with the CRC nibble itself taken as 0. All sixteen values occur. */
uint8_t ms58xx_prom_crc4(const struct ms58xx_prom *prom);

/* The core of the check: 16 bytes, MSB first; for the test vector of AN520. */
uint8_t ms58xx_crc4_bytes(const uint8_t bytes[16]);

enum ms58xx_prom_state {
  MS58XX_PROM_GOOD,
  MS58XX_PROM_CRC_DIFFERS, /* usable: one genuine part is known with a wrong nibble */
  MS58XX_PROM_BLANK,       /* a coefficient of 0 or all ones: what an unloaded sensor or a silent
                              line gives, and the CRC lets one such PROM in sixteen pass */
};
enum ms58xx_prom_state ms58xx_check_prom(const struct ms58xx_prom *prom);

/* The second-order corrections come in three branches of the first-order temperature. Where those of the MS5840 meet at 10 degC the
 * pressure steps by some 60 Pa at 1 bar, so a branch is left only when the temperature is MS58XX_BRANCH_HYSTERESIS_cC beyond its edge. */
enum ms58xx_branch {
  MS58XX_BRANCH_UNKNOWN = 0,
  MS58XX_BRANCH_WARM,      /* >= 20 degC */
  MS58XX_BRANCH_COLD,      /* MS58XX_VERY_COLD_cC..20 degC */
  MS58XX_BRANCH_VERY_COLD, /* below */
};
#define MS58XX_BRANCH_HYSTERESIS_cC 30
enum ms58xx_branch ms58xx_branch_of(enum ms58xx_branch previous, int32_t temperature_cC);

/* What a temperature conversion yields: the coefficients of the following pressures. */
struct ms58xx_thermal {
  enum ms58xx_branch branch;
  int32_t dT;             /* D2 - C5 * 2^8 */
  int32_t first_order_cC; /* TEMP before the second-order term, 0.01 degC */
  int32_t temperature_cC; /* TEMP */
  int64_t offset;         /* OFF, 41 bit */
  int64_t sensitivity;    /* SENS, 41 bit */
};

/* first_order_cC alone. */
int32_t ms58xx_first_order_cC(const struct ms58xx_prom *prom, uint32_t d2);

/* d2: 24-bit code of a temperature conversion. previous: branch of the last call for this sensor,
 * or MS58XX_BRANCH_UNKNOWN. About 700 Cortex-M0+ cycles. */
void ms58xx_compensate_temperature(const struct ms58xx_prom *prom, uint32_t d2, enum ms58xx_branch previous,
                                   struct ms58xx_thermal *thermal);

/* d1: 24-bit code of a pressure conversion. Absolute pressure in 1/1024 Pa, saturated to int32;
 * shifted right by 10 it is the pressure in Pa. About 130 Cortex-M0+ cycles. */
int32_t ms58xx_compensate_pressure(const struct ms58xx_thermal *thermal, uint32_t d1);
