/* Admits sensors: all are reset, and their calibration PROMs are read and judged. Event context; scan.c moves the bytes.
 *
 * A sensor is admitted when it has acknowledged the reset and its whole PROM. PROMs are read up to three times, until
 * all of them are good. One whose CRC still differs is used and reported. A blank one is not used.
 *
 * That costs 5 ms of frames with a data line for each sensor, and some 25 ms behind multiplexers. So the next ones come
 * after 16, 32 ms and so on up to a second, and to 8 s where they are for suspects. While one leaves a sensor out they
 * come after 1, 2, 4 and then 8 s. A sensor that does not answer at all costs no admission. One whose CRC differs costs
 * BRING_UP_RECHECKS, since the bus may have been disturbed. */
#pragma once

#include "array_bus/array_bus.h"
#include "common/limits.h"
#include "ms58xx/ms58xx.h"

#include <stdbool.h>
#include <stdint.h>

#define BRING_UP_RECHECKS 3

struct bring_up {
  uint8_t sensor_count;
  uint8_t word, pass;  /* of the PROM, to be read next */
  bool of_suspects;    /* this one was asked for by the main context */
  sensor_map heard;    /* bitmap: the reset was acknowledged, by the sensor or its branch */
  sensor_map answered; /* bitmap: every word of this pass */
  sensor_map good;     /* bitmap: in some pass of this one */
  sensor_map differs;  /* bitmap: the CRC does, in the last pass */
  sensor_map blank;    /* bitmap: the PROM is blank, in the last pass */
  uint8_t rechecks;    /* admissions in a row after which a CRC differed */
  sensor_map changed;  /* bitmap: another PROM than before; cleared once reported */
  uint64_t began_us;
  uint32_t interval_us;                    /* from this one to the next at least */
  uint64_t next_us;                        /* the next one not before */
  struct ms58xx_prom read[FT_MAX_SENSORS]; /* in this pass */
  struct ms58xx_prom prom[FT_MAX_SENSORS]; /* [sensor] in use */
};

struct bring_up_result {
  sensor_map admitted; /* bitmap */
  sensor_map bad;      /* bitmap: the CRC differs, or the PROM is blank */
};

void bring_up_init(struct bring_up *bring_up, uint8_t sensor_count);

/* After it a reset of all sensors, then word 0 of their PROMs. */
void bring_up_begin(struct bring_up *bring_up, bool of_suspects, uint64_t now_us);

/* Bitmap of the sensors that acknowledged the reset. One that did not may still be in its bad state. */
void bring_up_take_reset(struct bring_up *bring_up, sensor_map acknowledged);

/* Takes the result of the last word. True: read .word next. False: that was the last; see
 * bring_up_end. The last word of a pass costs some 20 000 Cortex-M0+ cycles. */
bool bring_up_take_word(struct bring_up *bring_up, const struct array_bus_result *result);

/* Whether a PROM should be read again though all sensors are admitted. */
static inline bool bring_up_wants_recheck(const struct bring_up *bring_up) {
  return bring_up->differs != 0 && bring_up->rechecks <= BRING_UP_RECHECKS;
}

struct bring_up_result bring_up_end(struct bring_up *bring_up);
