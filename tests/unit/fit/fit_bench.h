/* Presses on the array of fifteen, and what a fit said of one, for the tests of fit/fit.h. setUp clears the readings. */
#pragma once

#include "common/contact_flags.h"
#include "fit/fit.h"
#include "support/random.h"
#include "support/unit.h"

enum { SENSORS = 15 };
#define ALL 0x7FFFu
#define PITCH_mm 9.0f
#define NOISE_5_Pa 5120
#define GOOD_FIT (CONTACT_FLAG_FIT_VALID | CONTACT_FLAG_UNCERTAINTY_VALID)

extern const float x_mm[SENSORS];
extern const float y_mm[SENSORS];
extern struct fit_array array;
extern struct fit_result result;
extern int32_t readings[FT_MAX_SENSORS];
extern const struct fit_settings usual;
extern const struct fit_settings patient;

struct press {
  double x_mm, y_mm, p0_Pa, sigma_mm;
};
int32_t to_q10(double pressure_Pa);
double gaussian(const struct press *press, double x, double y);
void read_press(const struct press *press, double noise_Pa, struct random *random);
double location_error_mm(const struct press *press);
double force_of(const struct press *press);
struct press random_press(struct random *random, double reach_mm);
void assert_finite_and_defined(void);
