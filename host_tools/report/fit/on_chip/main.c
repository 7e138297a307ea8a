/* An image that fits the given readings, for counting cycles in the emulator: fit_on_chip.mjs
 * beside this file is its other half and is the debugger that the breakpoints call.
 */
#include "alternatives/alternatives.h"
#include "config/geometry.h"
#include "fit/fit.h"
#include "fit/fit_doubt.h"
#include "fit/fit_gains.h"
#include "fit/fit_shapes.h"
#include "fit/fit_tangential.h"
#include "port/port.h"

#include <stddef.h>

/* Words of 32 bits, in this order, as fit_on_chip.mjs writes and reads them. */
static struct {
  uint32_t kernel; /* index into kernels */
  uint32_t iterations, n_largest, guess;
  int32_t noise_Pa_q10;
  float prior_sigma_mm, prior_width_mm;
  uint32_t usable;
  uint32_t own; /* 1: the sensors have one (fit.h) */
  int32_t pressure_Pa_q10[FT_MAX_SENSORS];
  float x_mm, y_mm; /* the answer */
} job;

enum { CALL_NEXT_JOB = 1, CALL_START = 2, CALL_STOP = 3 };

#define CALL_DEBUGGER(number)                                                                                          \
  do {                                                                                                                 \
    register void *argument __asm("r0") = &job;                                                                        \
    __asm volatile("bkpt %1" : : "r"(argument), "i"(number) : "memory");                                               \
  } while (0)

static struct fit_array layout;
static struct fit_own own[FT_MAX_SENSORS];
static struct fit_settings chosen;
static struct fit_result contact;
static struct fit_pad pad;
static struct fit_tangential_state tangential_state;
static struct fit_tangential tangential_result;
static struct fit_doubt doubt;
static struct fit_gains gains;
static struct fit_shapes_pad shapes_pad;
static struct fit_shapes_state shapes_state;
static struct fit_shapes_result shapes_result;

static void nothing(void) {}

static void fit(void) {
  fit_gaussian(&layout, job.pressure_Pa_q10, job.usable, &chosen, &contact);
  job.x_mm = contact.x_mm;
  job.y_mm = contact.y_mm;
}

/* The kernels behind it, one by one. */
static void grid(void) {
  fit_grid(&layout, job.pressure_Pa_q10, &chosen, &contact);
  job.x_mm = contact.x_mm;
  job.y_mm = contact.y_mm;
}

static void masked(void) {
  fit_grid_masked(&layout, job.pressure_Pa_q10, job.usable, &chosen, &contact);
  job.x_mm = contact.x_mm;
  job.y_mm = contact.y_mm;
}

static void general(void) {
  fit_general(&layout, job.pressure_Pa_q10, job.usable, &chosen, &contact);
  job.x_mm = contact.x_mm;
  job.y_mm = contact.y_mm;
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

/* On a pad with a dip, after `fit` of the same readings and the frames before, which are not
 * counted. */
static void tangential(void) {
  struct fit_settings settings = chosen;
  settings.dip_share = 0.0125f;
  settings.dip_sd_mm = 14.0f;
  fit_tangential_estimate(&layout, &pad, job.pressure_Pa_q10, &settings, &contact, &tangential_state,
                          &tangential_result);
  job.x_mm = tangential_result.x_mm;
  job.y_mm = tangential_result.y_mm;
}

/* One part of a search for a tangential force, after `fit` of the same readings and the parts before,
 * which are not counted. */
static void follow_doubt(void) { fit_doubt_follow(&doubt, &layout, job.pressure_Pa_q10, &chosen, &contact); }
#define DOUBT_PART(part)                                                                                               \
  static void doubt_##part(void) { follow_doubt(); }
DOUBT_PART(0)
DOUBT_PART(1)
DOUBT_PART(2)
DOUBT_PART(3)
DOUBT_PART(4)
DOUBT_PART(5)
static void (*const doubt_parts[FIT_DOUBT_PARTS])(void) = {doubt_0, doubt_1, doubt_2, doubt_3, doubt_4, doubt_5};

/* A touch that rests, after `fit` of the same readings. */
static void gains_of_touch(void) { fit_gains_learn(&gains, &layout, job.pressure_Pa_q10, &chosen, &contact); }

/* The two parts of a contact's first frame, and the parts of one that ends with an answer, on a pad with a dip;
 * after `fit` of the same readings and what comes before, which is not counted. */
static void shapes(void) {
  struct fit_settings settings = chosen;
  settings.dip_share = 0.0125f;
  settings.dip_sd_mm = 14.0f;
  fit_shapes_part(&layout, &shapes_pad, job.pressure_Pa_q10, &settings, &contact, &shapes_state, &shapes_result);
  job.x_mm = shapes_result.x_mm[0];
  job.y_mm = shapes_result.y_mm[0];
}
#define SHAPES_LATER (2 + (FIT_SHAPES_FRAMES - 2) * FIT_SHAPES_PARTS)
#define SHAPES_PART(part)                                                                                              \
  static void shapes_##part(void) { shapes(); }
SHAPES_PART(0)
SHAPES_PART(1)
SHAPES_PART(2)
SHAPES_PART(first_0)
SHAPES_PART(first_1)
static void (*const shapes_parts[])(void) = {shapes_first_0, shapes_first_1, shapes_0, shapes_1, shapes_2};
/* Parts before each. */
static const int shapes_before[] = {0, 1, SHAPES_LATER, SHAPES_LATER + 1, SHAPES_LATER + 2};

#define ALTERNATIVE(name, solver, real)                                                                                \
  static void name(void) {                                                                                             \
    const struct alternative_settings options = {(int)job.iterations, (enum alternative_guess)job.guess};              \
    struct alternative_fit_##real answer =                                                                             \
        alternative_##solver##_##real(&layout, job.pressure_Pa_q10, job.usable, &options);                             \
    job.x_mm = (float)answer.x_mm;                                                                                     \
    job.y_mm = (float)answer.y_mm;                                                                                     \
  }
ALTERNATIVE(naive_float, naive, float)
ALTERNATIVE(naive_double, naive, double)
ALTERNATIVE(lm_float, lm, float)
ALTERNATIVE(lm_double, lm, double)

/* The order is that of KERNELS in fit_on_chip.mjs. */
static void (*const kernels[])(void) = {nothing,        fit,      grid,      masked,     general,        naive_float,
                                        naive_double,   lm_float, lm_double, tangential, doubt_0,        doubt_1,
                                        doubt_2,        doubt_3,  doubt_4,   doubt_5,    gains_of_touch, shapes_first_0,
                                        shapes_first_1, shapes_0, shapes_1,  shapes_2};

int main(void) {
  if (fit_array_init(&layout, geometry.sensor_count, geometry.x_mm, geometry.y_mm, geometry.pitch_mm) != FT_OK ||
      fit_pad_init(&pad, &layout, &profile) != FT_OK || fit_shapes_init(&shapes_pad, &layout, &profile) != FT_OK) {
    port_panic();
  }
  for (int k = 0; k < FT_MAX_SENSORS; k++) { /* so little that it spoils no press */
    own[k] = (struct fit_own){12, -12, k % 2 ? 40 : -40};
  }
  for (;;) {
    CALL_DEBUGGER(CALL_NEXT_JOB);
    port_watchdog_feed();
    if (job.kernel >= sizeof kernels / sizeof kernels[0]) {
      port_panic();
    }
    chosen.iterations = (uint8_t)job.iterations;
    chosen.n_largest = (uint8_t)job.n_largest;
    chosen.noise_Pa_q10 = job.noise_Pa_q10;
    chosen.prior_sigma_mm = job.prior_sigma_mm;
    chosen.prior_width_mm = job.prior_width_mm;
    chosen.own = job.own ? own : NULL;
    void (*kernel)(void) = kernels[job.kernel];
    if (kernel == tangential) {
      fit();
      tangential_state = (struct fit_tangential_state){0};
      for (int frame = 1; frame < FIT_TANGENTIAL_FRAMES; frame++) {
        tangential();
      }
    }
    for (unsigned part = 0; part < sizeof shapes_before / sizeof shapes_before[0]; part++) {
      if (kernel == shapes_parts[part]) {
        fit();
        shapes_state = (struct fit_shapes_state){0};
        for (int before = 0; before < shapes_before[part]; before++) {
          shapes();
        }
      }
    }
    for (int part = 0; part < FIT_DOUBT_PARTS; part++) {
      if (kernel == doubt_parts[part]) {
        fit();
        fit_doubt_begin(&doubt);
        for (int before = 0; before < part; before++) {
          follow_doubt();
        }
      }
    }
    if (kernel == gains_of_touch) {
      fit();
      fit_gains_begin(&gains, 0.1f);
      gains.p0_Pa = contact.p0_Pa;
    }
    CALL_DEBUGGER(CALL_START);
    kernel();
    CALL_DEBUGGER(CALL_STOP);
  }
}
