/* An array_bus for the tests of scan: operations of a fixed duration on sensors that keep the
 * datasheet's times, a log of what was done, and faults on request. */
#pragma once

#include "array_bus/array_bus.h"
#include "ms58xx/ms58xx.h"

#include <stdbool.h>

enum fake_operation { FAKE_COMMAND, FAKE_READ, FAKE_RECOVERY };

struct fake_entry {
  enum fake_operation operation;
  uint8_t command, byte_count;
  uint64_t start_us, end_us;
  enum ft_status status;
};

enum { FAKE_LOG = 65536, FAKE_COMMAND_us = 90, FAKE_READ_us = 2900, FAKE_RECOVERY_us = 200 };

struct fake_bus {
  /* Set by the test. */
  uint8_t sensor_count;
  sensor_map answering; /* bitmap */
  struct ms58xx_prom prom[FT_MAX_SENSORS];
  uint32_t d1[FT_MAX_SENSORS], d2[FT_MAX_SENSORS];
  uint32_t misread_prom;      /* bitmap: one bit of word 3 is flipped ... */
  int misread_passes;         /* ... in this many passes to come */
  uint32_t read_us;           /* of a read */
  uint32_t zero_next;         /* bitmap: the next ADC reading is 0 */
  uint32_t frozen;            /* bitmap: all pressures have the same code */
  int fail_at;                /* operations until one fails; -1: none */
  enum ft_status fail_with;   /* what it answers */
  enum ft_status recovery_is; /* what every recovery answers */
  bool refuse_starts;

  /* Kept by the bus. */
  struct fake_entry log[FAKE_LOG];
  int logged;
  bool running;
  uint64_t powered_us, ready_us; /* sensors reset; conversion over */
  uint8_t converted;             /* command of the last conversion; 0: none */
  uint32_t noise;                /* 0 or 1: of the last pressures */
  int misuses;                   /* what the datasheet forbids */
  const char *misuse;
};

/* Of a read, until the sensors have its command */
#define FAKE_READ_LEAD_us 44u

/* The last code of a pressure. */
uint32_t fake_d1(const struct fake_bus *fake, uint8_t k);

/* A healthy array: sensors with different PROMs at about 1 bar and 25 degC. */
void fake_bus_init(struct fake_bus *fake, struct array_bus *bus, uint8_t sensor_count);

/* Longest conversion by the datasheet, for a convert command of either kind. */
uint32_t fake_conversion_us(uint8_t command);
