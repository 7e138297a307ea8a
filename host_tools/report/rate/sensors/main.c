/* An image that takes a frame of any number of sensors through the firmware's arithmetic, for counting cycles in the
 * emulator: sensor_cycles.mjs beside this file is its other half and plays the debugger that the breakpoints call. */
#include "condition/condition.h"
#include "fit/fit.h"
#include "ms58xx/ms58xx.h"
#include "port/port.h"

#include <string.h>

/* Words of 32 bits, in this order, as sensor_cycles.mjs writes and reads them. */
static struct {
  uint32_t sensor_count;
  float pitch_mm;
  float x_mm[FT_MAX_SENSORS], y_mm[FT_MAX_SENSORS];
  int32_t pressure_Pa_q10[FT_MAX_SENSORS]; /* above ambient */
  float fit_x_mm, fit_y_mm;                /* the answer */
} job;

enum { CALL_NEXT_JOB = 1, CALL_START = 2, CALL_STOP = 3 };
/* So that each frame tracks a sensor's zero, as at about the rate behind multiplexers. */
enum { FRAME_us = 4854 };
enum { AMBIENT_Pa_q10 = 101325 * 1024, NOISE_Pa_q10 = 11 * 1024 };

#define CALL_DEBUGGER(number)                                                                                                              \
  do {                                                                                                                                     \
    register void *argument __asm("r0") = &job;                                                                                            \
    __asm volatile("bkpt %1" : : "r"(argument), "i"(number) : "memory");                                                                   \
  } while (0)

static struct condition condition;
static struct conditioned conditioned;
static struct fit_array array;
static struct fit_result result;
static struct frame frame;
static struct ms58xx_thermal thermal;

static void take(void) {
  for (uint32_t k = 0; k < job.sensor_count; k++) {
    frame.pressure_Pa_q10[k] = ms58xx_compensate_pressure(&thermal, 6465444u + k);
  }
}

static void condition_one(void) {
  frame.t_us += FRAME_us;
  condition_frame(&condition, &frame, NULL, &conditioned);
}

static void fit(void) {
  const struct fit_settings settings = {.iterations = FINGERTIP_FIT_ITERATIONS, .noise_Pa_q10 = NOISE_Pa_q10};
  fit_gaussian(&array, conditioned.pressure_Pa_q10, conditioned.usable, &settings, &result);
}

/* The order is that of STAGES in sensor_cycles.mjs. */
static void (*const stages[])(void) = {take, condition_one, fit};

static void set_pressures(bool pressed) {
  for (uint32_t k = 0; k < job.sensor_count; k++) {
    frame.pressure_Pa_q10[k] = AMBIENT_Pa_q10 + (pressed ? job.pressure_Pa_q10[k] : 0);
  }
}

static void prepare(void) {
  memset(&frame, 0, sizeof frame);
  frame.sensor_count = (uint8_t)job.sensor_count;
  frame.valid = UINT32_MAX >> (FT_MAX_SENSORS - job.sensor_count);
  frame.noise_Pa_q10 = NOISE_Pa_q10;
  if (fit_array_init(&array, frame.sensor_count, job.x_mm, job.y_mm, job.pitch_mm) != FT_OK) {
    port_panic();
  }
  condition_start(&condition);
  set_pressures(false);
  for (int i = 0; i < 2 * ZERO_TARE_FRAMES; i++) {
    condition_one();
  }
}

int main(void) {
  static const struct ms58xx_prom prom = {{0, 46372, 43981, 29059, 27842, 31553, 28165}};
  ms58xx_compensate_temperature(&prom, 8077636, MS58XX_BRANCH_UNKNOWN, &thermal);
  for (;;) {
    CALL_DEBUGGER(CALL_NEXT_JOB);
    port_watchdog_feed();
    prepare();
    for (unsigned i = 0; i < sizeof stages / sizeof stages[0]; i++) {
      CALL_DEBUGGER(CALL_START);
      stages[i]();
      CALL_DEBUGGER(CALL_STOP);
      set_pressures(true);
    }
    job.fit_x_mm = result.x_mm;
    job.fit_y_mm = result.y_mm;
  }
}
