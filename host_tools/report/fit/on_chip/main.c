/* An image that fits the given readings, for counting cycles in the emulator: fit_on_chip.mjs
 * beside this file is its other half and plays the debugger that the breakpoints call.
 */
#include "alternatives/alternatives.h"
#include "config/geometry.h"
#include "fit/fit.h"
#include "fit/fit_tangential.h"
#include "port/port.h"

/* Words of 32 bits, in this order, as fit_on_chip.mjs writes and reads them. */
static struct {
  uint32_t kernel; /* index into kernels */
  uint32_t iterations, n_largest, guess;
  int32_t noise_Pa_q10;
  float prior_sigma_mm, prior_width_mm;
  uint32_t usable;
  int32_t pressure_Pa_q10[FT_MAX_SENSORS];
  float x_mm, y_mm; /* the answer */
} job;

enum { CALL_NEXT_JOB = 1, CALL_START = 2, CALL_STOP = 3 };

#define CALL_DEBUGGER(number)                                                                      \
  do {                                                                                             \
    register void *argument __asm("r0") = &job;                                                    \
    __asm volatile("bkpt %1" : : "r"(argument), "i"(number) : "memory");                           \
  } while (0)

static struct fit_array array;
static struct fit_settings settings;
static struct fit_result result;
static struct fit_pad pad;
static struct fit_tangential_state tangential_state;
static struct fit_tangential tangential_result;

static void nothing(void) {}

static void fit(void) {
  fit_gaussian(&array, job.pressure_Pa_q10, job.usable, &settings, &result);
  job.x_mm = result.x_mm;
  job.y_mm = result.y_mm;
}

static void grid(void) {
  fit_grid(&array, job.pressure_Pa_q10, &settings, &result);
  job.x_mm = result.x_mm;
  job.y_mm = result.y_mm;
}

static void masked(void) {
  fit_grid_masked(&array, job.pressure_Pa_q10, job.usable, &settings, &result);
  job.x_mm = result.x_mm;
  job.y_mm = result.y_mm;
}

static void general(void) {
  fit_general(&array, job.pressure_Pa_q10, job.usable, &settings, &result);
  job.x_mm = result.x_mm;
  job.y_mm = result.y_mm;
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

/* After `fit` of the same readings and the frames before, which are not counted. */
static void tangential(void) {
  fit_tangential_load(&array, &pad, job.pressure_Pa_q10, &settings, &result, &tangential_state,
                      &tangential_result);
  job.x_mm = tangential_result.x_mm;
  job.y_mm = tangential_result.y_mm;
}

#define ALTERNATIVE(name, solver, real)                                                            \
  static void name(void) {                                                                         \
    const struct alternative_settings chosen = {(int)job.iterations,                               \
                                                (enum alternative_guess)job.guess};                \
    struct alternative_fit_##real found =                                                          \
        alternative_##solver##_##real(&array, job.pressure_Pa_q10, job.usable, &chosen);           \
    job.x_mm = (float)found.x_mm;                                                                  \
    job.y_mm = (float)found.y_mm;                                                                  \
  }
ALTERNATIVE(naive_float, naive, float)
ALTERNATIVE(naive_double, naive, double)
ALTERNATIVE(lm_float, lm, float)
ALTERNATIVE(lm_double, lm, double)

/* The order is that of KERNELS in fit_on_chip.mjs. */
static void (*const kernels[])(void) = {nothing,     fit,          grid,     masked,    general,
                                        naive_float, naive_double, lm_float, lm_double, tangential};

int main(void) {
  if (fit_array_init(&array, geometry.sensor_count, geometry.x_mm, geometry.y_mm,
                     geometry.pitch_mm) != FT_OK ||
      fit_pad_init(&pad, &array, &profile) != FT_OK) {
    port_panic();
  }
  for (;;) {
    CALL_DEBUGGER(CALL_NEXT_JOB);
    port_watchdog_feed();
    if (job.kernel >= sizeof kernels / sizeof kernels[0]) {
      port_panic();
    }
    settings.iterations = (uint8_t)job.iterations;
    settings.n_largest = (uint8_t)job.n_largest;
    settings.noise_Pa_q10 = job.noise_Pa_q10;
    settings.prior_sigma_mm = job.prior_sigma_mm;
    settings.prior_width_mm = job.prior_width_mm;
    void (*kernel)(void) = kernels[job.kernel];
    if (kernel == tangential) {
      fit();
      tangential_state = (struct fit_tangential_state){0};
      for (int frame = 1; frame < FIT_TANGENTIAL_FRAMES; frame++) {
        tangential();
      }
    }
    CALL_DEBUGGER(CALL_START);
    kernel();
    CALL_DEBUGGER(CALL_STOP);
  }
}
