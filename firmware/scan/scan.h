/* Drives the array: brings the sensors up, decides when to convert, wait and read, notices failures, and hands over
 * frames.
 *
 * Two contexts meet here. scan_step runs in the event context (interrupt) and only moves bytes. The next conversion
 * begins as soon as the last one was read, before its codes are evaluated. So sensors, bus and processor work at the
 * same time, and the frame clock depends on none of the others. scan_take runs in the main context and does the
 * arithmetic. Between them is one slot that holds the newest frame. A processor that falls behind takes the frames it
 * can. Overwritten frames are counted.
 *
 * Only admitted sensors yield valid readings: see bring_up.h. Where a sensor does not acknowledge, that reading is
 * missing. The next one is missing too unless it is certain that the sensor heard its command, since it might be an old
 * one. The third in a row costs the admission. So does a reading of 0: no conversion had finished, as one is lost in a dip
 * of the supply. Where a branch acknowledges as one, a sensor may have missed the command instead: if it alone reads 0, once, only
 * the next reading is void, and all are doubtful until the temperature, which comes at once. So does the same pressure code SCAN_STILL
 * times more, since the noise of a sensor is 40 codes and more. A reading whose last sixteen bits are ones, far from the sensor's last one,
 * comes from a sensor that lost count of the clocks and stopped sending: see scan.c. readings.h has the other reasons that make a reading
 * or a sensor implausible.
 *
 * Scattered NACKs of single reads leave 0.4, 1.0, 2.8, 10 and 28 % of 186 frames a second incomplete at 0.3, 1, 3, 10
 * and 30 of them a second. That is on a simulated bus that acknowledges commands as one. It is half as much where each
 * sensor answers for itself, and none where the bus asks again.
 *
 * Temperatures are converted twice a second, less often while they are constant. Where the requested rate leaves a
 * pause, that is done in the pause before a frame. Otherwise it takes the place of a frame, at most one in 600 at OSR
 * 256 and one in 25 at OSR 8192, and one in 32 while pressures move (readings.h). That frame goes out at its time too, with the pressures
 * of the one before, and marked as held. All ones are no reading. A sensor's last temperature is forgotten when it is admitted again. Its
 * next temperature is the next conversion. */
#pragma once

#include "array_bus/array_bus.h"
#include "frame/frame.h"
#include "ms58xx/ms58xx.h"
#include "scan/bring_up.h"
#include "scan/readings.h"

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

struct scan_settings {
  uint8_t sensor_count;    /* 1..FT_MAX_SENSORS */
  uint16_t osr;            /* see ms58xx_find_osr */
  uint32_t rate_mHz;       /* 0 = as fast as the sensors allow */
  bool presses_are_shared; /* sensors are so close that no press moves one alone */
};

/* The interval while the temperature changes. While it is constant the interval doubles up to the
 * maximum. At 0.1 degC/s, as in a hand, the pressures stay within some 24 Pa, and within 48 Pa
 * until such a change is noticed. The error is much the same for all sensors. */
#define SCAN_TEMPERATURE_INTERVAL_ms 500u
#define SCAN_TEMPERATURE_INTERVAL_MAX_ms 2000u

/* A counter that the event context writes. */
static inline uint32_t scan_read(const _Atomic uint32_t *value) { return atomic_load_explicit(value, memory_order_relaxed); }

/* A map that one context writes and any reads. A read may come between its words: each bit counts for itself. */
struct scan_map {
  _Atomic uint32_t words[(FT_MAX_SENSORS + 31) / 32];
};

static inline sensor_map scan_read_map(const struct scan_map *map) {
  sensor_map value = 0;
  for (unsigned i = 0; i < sizeof map->words / sizeof map->words[0]; i++) {
    value |= (sensor_map)scan_read(&map->words[i]) << (32 * i);
  }
  return value;
}

/* Since start, modulo 2^32. Readable from any context. */
struct scan_counters {
  _Atomic uint32_t frames;
  _Atomic uint32_t frames_incomplete; /* a sensor was missing or void */
  _Atomic uint32_t frames_skipped;    /* overwritten before the main context took them */
  _Atomic uint32_t bus_nacks;         /* and readings that broke off */
  _Atomic uint32_t bus_timeouts;
  _Atomic uint32_t bus_recoveries;
  _Atomic uint32_t zero_readings;        /* readings of 0, and those void after one or after a NACK */
  _Atomic uint32_t implausible_readings; /* left out by scan_take: see readings.h */
};

enum scan_state {
  SCAN_WAIT_POWER,
  SCAN_RESET,
  SCAN_WAIT_RESET,
  SCAN_READ_PROM,
  SCAN_IDLE,
  SCAN_CONVERT,
  SCAN_WAIT_CONVERSION,
  SCAN_READ_ADC,
  SCAN_RECOVER,
  SCAN_WAIT_RECOVERY,
};

/* A conversion of the whole array: when, and of what. */
struct scan_conversion {
  const struct ms58xx_osr *osr;
  bool is_temperature;
  bool is_frame; /* pressure, or a temperature in the place of one */
  uint32_t number;
  sensor_map heard; /* bitmap: the command was acknowledged, by the sensor or its branch */
  uint64_t t_us, t_begin_us, t_converted_us, t_read_us;
};

/* One set of codes on its way from the event context to the main context. */
struct scan_slot {
  struct scan_conversion conversion;
  sensor_map good;               /* bitmap: the code is a measurement */
  sensor_map still;              /* bitmap: and that of the one before. Of a frame */
  sensor_map zero;               /* bitmap: has read 0 since the last one that was taken. Of a frame */
  sensor_map prom_changed;       /* bitmap: another sensor than before. Of a temperature */
  sensor_map returned;           /* bitmap: admitted again, perhaps after long. Of a temperature */
  uint32_t code[FT_MAX_SENSORS]; /* [sensor] 24-bit */
};

enum scan_slot_state {
  SCAN_SLOT_EMPTY,
  SCAN_SLOT_FULL,    /* the event context may overwrite it */
  SCAN_SLOT_CLAIMED, /* the main context reads it */
};

#define SCAN_STILL 5

struct scan {
  const struct array_bus *bus;
  uint8_t sensor_count;

  /* Requests of the main context. */
  const struct ms58xx_osr *_Atomic osr;
  _Atomic uint32_t period_us;               /* of frames; 0: as fast as the sensors allow */
  _Atomic uint32_t temperature_interval_us; /* set by the main context */
  _Atomic uint32_t temperature_within_us;   /* if not 0, the next in less. Set while the slot of
                                               the temperature is claimed, reset while it is empty */
  struct scan_map suspects;                 /* bitmap: to be reset. Set by the main context */
  _Atomic uint32_t must_rest;

  /* Event context only. */
  enum scan_state state;
  bool operation_running;
  bool bus_stuck;                     /* the last recovery did not free the bus */
  struct scan_conversion *conversion; /* under way */
  bool last_was_temperature;
  uint32_t overhead_us; /* of a conversion: command and reading */
  uint64_t wait_until_us;
  uint64_t next_frame_us;
  uint64_t next_temperature_us;
  bool wants_admission; /* a sensor is there that is not admitted, or a suspect */
  uint64_t recovery_delay_us;
  uint32_t frame_number;
  sensor_map void_next;         /* bitmap: the next reading does not count */
  sensor_map was_zero;          /* bitmap: the last reading was 0 */
  sensor_map zero_seen;         /* bitmap: a pressure was since the slot of the frame was filled */
  sensor_map still[SCAN_STILL]; /* [n] bitmap: the same code as in the n + 1 frames before */
  sensor_map missed_once;       /* bitmap: the last reading was not acknowledged, ... */
  sensor_map missed_twice;      /* ... nor the one before */
  sensor_map returned;          /* bitmap: admitted, and was not before */

  /* Written by the event context, readable from any. */
  struct scan_map present;  /* bitmap: acknowledged at the last attempt */
  struct scan_map admitted; /* bitmap */
  _Atomic uint32_t rests;   /* as it must: nothing is under way on the bus */
  struct scan_map prom_bad; /* bitmap: after all attempts its CRC differs, or it is blank */
  struct scan_counters counters;

  /* Written by the event context while the slot of its kind is not claimed, read by the main
   * context while it is. A temperature is never overwritten, and while it waits no PROM changes. */
  _Atomic uint32_t slot_state, temperature_state; /* enum scan_slot_state */
  struct scan_slot slot;
  struct scan_slot temperature_slot;
  struct bring_up bring_up; /* of which the main context reads prom */

  /* Event context only. */
  struct scan_conversion conversions[2]; /* under way, and the one before, whose codes are in result */
  struct array_bus_result result;

  /* Main context only. */
  uint64_t temperature_us; /* of the last one used */
  struct readings readings;
};

/* FT_ERR_ARGUMENT: a setting outside its range. The bus must outlive the scan. */
enum ft_status scan_init(struct scan *scan, const struct array_bus *bus, const struct scan_settings *settings);

/* Event context. Does whatever is due at now_us and returns the time of the next call at the
 * latest; an earlier one, when the bus has made progress, is welcome. */
uint64_t scan_step(struct scan *scan, uint64_t now_us);

/* Whether scan_take has something to do. Any context. */
static inline bool scan_has_news(const struct scan *scan) {
  return atomic_load_explicit(&scan->slot_state, memory_order_relaxed) == SCAN_SLOT_FULL ||
         atomic_load_explicit(&scan->temperature_state, memory_order_relaxed) == SCAN_SLOT_FULL;
}

/* Main context. True: *frame, which must still hold the frame before, holds a new one. False:
 * nothing new (a temperature may have been used up). */
bool scan_take(struct scan *scan, struct frame *frame);

/* Main context. Resting: what is under way ends, then there is no conversion and nothing on the bus
 * until the rest ends, 10 ms later at most. */
void scan_rest(struct scan *scan, bool resting);

/* The bus is as scan_rest() wants it when resting. Any context. */
static inline bool scan_rests(const struct scan *scan) { return atomic_load_explicit(&scan->rests, memory_order_relaxed) != 0; }

/* The sensors convert for a frame. Event context. */
static inline bool scan_is_converting_frame(const struct scan *scan) {
  return scan->state == SCAN_WAIT_CONVERSION && scan->conversion->is_frame;
}

/* Event context, after scan_step. It waits for what will be due within SCAN_WAIT_MAX_us; whatever
 * the bus does, it does so at least each 100 ms. */
#define SCAN_WAIT_MAX_us 2000000u
static inline bool scan_is_well(const struct scan *scan, uint64_t now_us) {
  return scan->wait_until_us - now_us < SCAN_WAIT_MAX_us; /* past while an operation runs */
}

/* Main context. Effective from the next frame, for which the old rate's pause is cut short. FT_ERR_ARGUMENT. */
enum ft_status scan_set_osr(struct scan *scan, uint16_t osr);
void scan_set_rate_mHz(struct scan *scan, uint32_t rate_mHz);
