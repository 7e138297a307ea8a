/* Drives the array: brings the sensors up, decides when to convert, wait and read, notices what
 * fails, and hands over frames.
 *
 * Two contexts meet here. scan_step runs in the event context (interrupt) and only moves bytes;
 * scan_take runs in the main context and does the arithmetic. Between them stands one slot: a new
 * conversion starts as soon as the last reading was taken, so the sensors convert while the
 * processor computes, and a processor that falls behind slows the frames down instead of piling
 * them up.
 *
 * A sensor is admitted when it has acknowledged its whole calibration PROM. One that stops
 * answering loses its admission; when sensors answer again, all are reset and their PROMs read
 * anew, at most once a second. Only admitted sensors yield valid readings. A reading of 0 means
 * that no conversion had finished, and the reading after it is void too: both are invalid, and two
 * in a row are a sensor that needs a reset, which loses its admission.
 *
 * A wrong temperature would falsify the pressures of many frames: all ones are no reading, and one
 * that jumps is used only when the next, taken soon after, jumps too. Temperatures are taken every
 * temperature_interval frames, at slow rates more often: about twice a second, or every frame.
 */
#ifndef SCAN_SCAN_H
#define SCAN_SCAN_H

#include "array_bus/array_bus.h"
#include "frame/frame.h"
#include "ms5840/ms5840.h"

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

struct scan_settings {
  uint8_t sensor_count;          /* 1..FT_MAX_SENSORS */
  uint16_t osr;                  /* see ms5840_find_osr */
  uint16_t temperature_interval; /* most frames between temperature conversions, at least 1 */
  uint32_t rate_mHz;             /* 0 = as fast as the sensors allow */
};

/* Since start, modulo 2^32. Written by scan_step, readable from any context. */
struct scan_counters {
  _Atomic uint32_t frames;
  _Atomic uint32_t frames_incomplete; /* a sensor was missing or void */
  _Atomic uint32_t bus_nacks;
  _Atomic uint32_t bus_timeouts;
  _Atomic uint32_t bus_recoveries;
  _Atomic uint32_t zero_readings; /* readings of 0 and those after them */
};

enum scan_state {
  SCAN_WAIT_POWER,
  SCAN_RESET,
  SCAN_WAIT_RESET,
  SCAN_READ_PROM,
  SCAN_CONVERT_TEMPERATURE,
  SCAN_WAIT_TEMPERATURE,
  SCAN_READ_TEMPERATURE,
  SCAN_IDLE,
  SCAN_CONVERT_PRESSURE,
  SCAN_WAIT_PRESSURE,
  SCAN_READ_PRESSURE,
  SCAN_RECOVER,
  SCAN_WAIT_RECOVERY,
};

/* One set of codes on its way from the event context to the main context. */
struct scan_slot {
  bool is_temperature;
  int32_t noise_Pa_q10;
  uint32_t number;
  uint64_t t_us, t_begin_us, t_converted_us, t_read_us;
  uint32_t good;                 /* bitmap: the code is a measurement */
  uint32_t prom_changed;         /* bitmap: another sensor than before */
  uint32_t code[FT_MAX_SENSORS]; /* [sensor] 24-bit */
};

struct scan {
  const struct array_bus *bus;
  uint8_t sensor_count;
  uint16_t temperature_interval;

  /* Requests of the main context. */
  _Atomic uint32_t osr;
  _Atomic uint32_t rate_mHz;
  _Atomic uint32_t temperature_doubted; /* 1: take the next soon. Set while the slot is full and
                                           cleared while it is empty */

  /* Event context only. */
  enum scan_state state;
  bool operation_running;
  bool bus_stuck;                      /* the last recovery did not free the bus */
  const struct ms5840_osr *conversion; /* of the frame under way */
  uint64_t wait_until_us;
  uint64_t next_frame_us;
  uint64_t next_admission_us;
  uint64_t admission_interval_us;
  uint64_t recovery_delay_us;
  uint32_t frames_to_temperature;
  uint32_t frame_number;
  uint32_t void_next;     /* bitmap: the next reading does not count */
  uint32_t prom_answered; /* bitmap: every word of this pass */
  uint32_t prom_good;     /* bitmap: in some pass of this admission */
  uint32_t prom_changed;  /* bitmap: another PROM than before this admission */
  uint8_t prom_word, prom_pass;
  struct array_bus_result result;
  struct ms5840_prom prom_read[FT_MAX_SENSORS];
  struct scan_slot filling;

  /* Written by the event context while the slot is empty, read by the main context while it is
   * full, so that a sensor's PROM never changes under the arithmetic. */
  struct ms5840_prom prom[FT_MAX_SENSORS];
  struct scan_slot slot;
  _Atomic uint32_t slot_full;

  /* Written by the event context, readable from any. */
  _Atomic uint32_t present;  /* bitmap: acknowledged at the last attempt */
  _Atomic uint32_t admitted; /* bitmap */
  _Atomic uint32_t prom_bad; /* bitmap: after all attempts its CRC differs, or it is blank */
  struct scan_counters counters;

  /* Main context only. */
  struct ms5840_thermal thermal[FT_MAX_SENSORS];
  uint32_t has_thermal; /* bitmap */
  uint32_t renewed;     /* bitmap: another sensor since the last frame */
  uint32_t doubted;     /* bitmap: the last temperature jumped and was not used */
};

/* FT_ERR_ARGUMENT: a setting outside its range. The bus must outlive the scan. */
enum ft_status scan_init(struct scan *scan, const struct array_bus *bus,
                         const struct scan_settings *settings);

/* Event context. Does whatever is due at now_us and returns the time of the next call at the
 * latest; an earlier one, when the bus has made progress, is welcome. */
uint64_t scan_step(struct scan *scan, uint64_t now_us);

/* Main context. True: *frame holds a new frame. False: nothing new (a temperature reading may have
 * been used up). */
bool scan_take(struct scan *scan, struct frame *frame);

/* Main context. Effective from the next frame, for which the old rate's pause is cut short.
 * FT_ERR_ARGUMENT. */
enum ft_status scan_set_osr(struct scan *scan, uint16_t osr);
void scan_set_rate_mHz(struct scan *scan, uint32_t rate_mHz);

#endif
