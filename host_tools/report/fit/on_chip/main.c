/* An image that fits the given readings, for counting cycles in the emulator: fit_on_chip.mjs
 * beside this file is its other half and is the debugger that the breakpoints call. */
#include "alternatives/alternatives.h"
#include "config/geometry.h"
#include "fit/fit.h"
#include "fit/fit_bias.h"
#include "fit/fit_gains.h"
#include "fit/fit_shapes.h"
#include "fit/fit_tangential.h"
#include "port/port.h"

#include <stddef.h>

/* Words of 32 bits, in this order, as fit_on_chip.mjs writes and reads them. */
static struct {
  uint32_t kernel; /* index into kernels */
  uint32_t iterations;
  int32_t noise_Pa_q10;
  uint32_t usable;
  uint32_t own; /* 1: the sensors have one (fit.h) */
  int32_t pressure_Pa_q10[FT_MAX_SENSORS];
  float x_mm, y_mm; /* the answer */
} job;

enum { CALL_NEXT_JOB = 1, CALL_START = 2, CALL_STOP = 3 };

#define CALL_DEBUGGER(number)                                                                                                              \
  do {                                                                                                                                     \
    register void *argument __asm("r0") = &job;                                                                                            \
    __asm volatile("bkpt %1" : : "r"(argument), "i"(number) : "memory");                                                                   \
  } while (0)

static struct fit_array layout;
static struct fit_deviation own[FT_MAX_SENSORS];
static struct fit_settings chosen;
static struct fit_result contact;
static struct fit_pad pad;
static struct fit_tangential_state tangential_state;
static struct fit_tangential tangential_result;
static struct fit_bias bias;
static struct fit_gains gains;
static struct fit_shapes_pad shapes_pad;
static struct fit_shapes_state shapes_state;
static struct fit_shapes_result shapes_result;

static void nothing(void) {}

static void answer(float x_mm, float y_mm) {
  job.x_mm = x_mm;
  job.y_mm = y_mm;
}

static void fit(void) {
  fit_gaussian(&layout, job.pressure_Pa_q10, job.usable, &chosen, &contact);
  answer(contact.x_mm, contact.y_mm);
}

/* The kernels behind it, one by one. */
static void grid(void) {
  fit_grid(&layout, job.pressure_Pa_q10, &chosen, &contact);
  answer(contact.x_mm, contact.y_mm);
}

static void masked(void) {
  fit_grid_masked(&layout, job.pressure_Pa_q10, job.usable, &chosen, &contact);
  answer(contact.x_mm, contact.y_mm);
}

static void general(void) {
  fit_general(&layout, job.pressure_Pa_q10, job.usable, &chosen, &contact);
  answer(contact.x_mm, contact.y_mm);
}

/* Of 12 mm of rubber. */
static const struct pad_profile profile = {
    .thickness_mm = 12.0f,
    .normal = {{0.0962158f, 3.563492f}, {0.8206275f, 5.739365f}},
    .tangential = {{1.051876f, 4.802645f}, {4.015438f, 7.883257f}, {5.430944f, 19.82153f}},
    .spread_mm2 = 4.0f,
    .spread_sd_mm2 = 6.0f,
    .force_ratio = 1.0f,
    .tangential_scale = 1.0f,
};

static struct fit_settings with_dip(void) {
  struct fit_settings settings = chosen;
  settings.dip_share = 0.0125f;
  settings.dip_sd_mm = 14.0f;
  return settings;
}

/* What follows needs `fit` of the same readings and the calls before. */
static void begin_tangential(void) { tangential_state = (struct fit_tangential_state){0}; }
static void tangential(void) {
  const struct fit_settings settings = with_dip();
  fit_tangential_estimate(&layout, &pad, job.pressure_Pa_q10, &settings, &contact, &tangential_state, &tangential_result);
  answer(tangential_result.x_mm, tangential_result.y_mm);
}

static void begin_bias(void) { fit_bias_begin(&bias); }
static void step_bias(void) { fit_bias_step(&bias, &layout, job.pressure_Pa_q10, &chosen, &contact); }

/* A touch that rests. */
static void begin_gains(void) {
  fit_gains_begin(&gains, 0.1f);
  gains.p0_Pa = contact.p0_Pa;
}
static void gains_of_touch(void) { fit_gains_learn(&gains, &layout, job.pressure_Pa_q10, &chosen, &contact); }

static void begin_shapes(void) { shapes_state = (struct fit_shapes_state){0}; }
static void shapes(void) {
  const struct fit_settings settings = with_dip();
  fit_shapes_part(&layout, &shapes_pad, job.pressure_Pa_q10, &settings, &contact, &shapes_state, &shapes_result);
  answer(shapes_result.x_mm[0], shapes_result.y_mm[0]);
}
#define SHAPES_CALLS (2 + (FIT_SHAPES_FRAMES - 1) * FIT_SHAPES_PARTS) /* to the first answer; a contact's first frame has two parts */

#define RUN_ALTERNATIVE(name)                                                                                                              \
  static void name(void) {                                                                                                                 \
    const struct alternative_fit found = alternative_##name(&layout, job.pressure_Pa_q10, job.usable, (int)job.iterations);                \
    answer((float)found.x_mm, (float)found.y_mm);                                                                                          \
  }
RUN_ALTERNATIVE(naive_float)
RUN_ALTERNATIVE(naive_double)
RUN_ALTERNATIVE(lm_float)
RUN_ALTERNATIVE(lm_double)

/* The order is that of KERNELS in fit_on_chip.mjs. begin: after `fit`, not counted; calls: of run, each counted. */
static const struct {
  void (*run)(void), (*begin)(void);
  int calls;
} kernels[] = {
    {nothing, NULL, 1},
    {fit, NULL, 1},
    {grid, NULL, 1},
    {masked, NULL, 1},
    {general, NULL, 1},
    {naive_float, NULL, 1},
    {naive_double, NULL, 1},
    {lm_float, NULL, 1},
    {lm_double, NULL, 1},
    {tangential, begin_tangential, FIT_TANGENTIAL_FRAMES},
    {step_bias, begin_bias, FIT_BIAS_PARTS},
    {gains_of_touch, begin_gains, 1},
    {shapes, begin_shapes, SHAPES_CALLS},
};

int main(void) {
  if (fit_array_init(&layout, geometry.sensor_count, geometry.x_mm, geometry.y_mm, geometry.pitch_mm) != FT_OK ||
      fit_pad_init(&pad, &layout, &profile) != FT_OK || fit_shapes_init(&shapes_pad, &layout, &profile) != FT_OK) {
    port_panic();
  }
  for (int k = 0; k < FT_MAX_SENSORS; k++) { /* so little that it spoils no press */
    own[k] = (struct fit_deviation){12, -12, k % 2 ? 40 : -40};
    chosen.hysteresis_sd_Pa_q10[k] = 1024 * k;
  }
  for (;;) {
    CALL_DEBUGGER(CALL_NEXT_JOB);
    port_watchdog_feed();
    if (job.kernel >= sizeof kernels / sizeof kernels[0]) {
      port_panic();
    }
    chosen.iterations = (uint8_t)job.iterations;
    chosen.noise_Pa_q10 = job.noise_Pa_q10;
    chosen.deviations = job.own ? own : NULL;
    void (*run)(void) = kernels[job.kernel].run;
    if (kernels[job.kernel].begin) {
      fit();
      kernels[job.kernel].begin();
    }
    for (int call = 0; call < kernels[job.kernel].calls; call++) {
      CALL_DEBUGGER(CALL_START);
      run();
      CALL_DEBUGGER(CALL_STOP);
    }
  }
}
