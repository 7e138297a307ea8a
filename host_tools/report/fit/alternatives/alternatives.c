#include "alternatives/alternatives.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

/* Compiled once with ALTERNATIVE_REAL float and once with double. */
typedef ALTERNATIVE_REAL real;
#define JOIN2(a, b) a##b
#define JOIN(a, b) JOIN2(a, b)
#define NAMED(name) JOIN(name, ALTERNATIVE_REAL)
#define R(constant) ((real)(constant))
#define OF_REAL(name) _Generic((real)0, float : name##f, double : name)
#define EXP OF_REAL(exp)
#define LOG OF_REAL(log)
#define SQRT OF_REAL(sqrt)

#define GUESS_SHARE R(0.1) /* of the largest reading */
#define GUESS_RIDGE R(1e-3)
#define GUESS_SIGMA R(0.65)
#define SETTLED (sizeof(real) == sizeof(float) ? R(1e-6) : R(1e-12)) /* pitches */

/* In pitches and units of the largest reading. */
struct samples {
  int count;
  int peak;
  real x[FT_MAX_SENSORS], y[FT_MAX_SENSORS], p[FT_MAX_SENSORS];
  real unit_Pa;
};

enum { P0, X, Y, SIGMA, PARAMETERS };

static real larger(real a, real b) { return a > b ? a : b; }
static real smaller(real a, real b) { return a < b ? a : b; }

struct normal {
  real matrix[PARAMETERS][PARAMETERS]; /* lower triangle */
  real rhs[PARAMETERS];
};

static bool normalise(const struct fit_array *array, const int32_t *pressure_Pa_q10, sensor_map usable, struct samples *samples) {
  int32_t largest = 0;
  samples->count = 0;
  for (int k = 0; k < array->sensor_count; k++) {
    if (usable >> k & 1u) {
      int n = samples->count++;
      samples->x[n] = (real)array->x[k];
      samples->y[n] = (real)array->y[k];
      samples->p[n] = (real)pressure_Pa_q10[k];
      if (pressure_Pa_q10[k] > largest) {
        largest = pressure_Pa_q10[k];
        samples->peak = n;
      }
    }
  }
  if (largest <= 0 || samples->count < PARAMETERS) {
    return false;
  }
  real scale = R(1) / (real)largest;
  for (int n = 0; n < samples->count; n++) {
    samples->p[n] *= scale;
  }
  samples->unit_Pa = (real)largest / R(1024);
  return true;
}

static void add_row(struct normal *normal, const real row[PARAMETERS], real value) {
  for (int i = 0; i < PARAMETERS; i++) {
    for (int j = 0; j <= i; j++) {
      normal->matrix[i][j] += row[i] * row[j];
    }
    normal->rhs[i] += row[i] * value;
  }
}

/* Cholesky in place; false, and the step undefined, if the matrix is not positive definite. */
static bool solve(struct normal *normal, real step[PARAMETERS]) {
  for (int i = 0; i < PARAMETERS; i++) {
    for (int j = 0; j <= i; j++) {
      real sum = normal->matrix[i][j];
      for (int k = 0; k < j; k++) {
        sum -= normal->matrix[i][k] * normal->matrix[j][k];
      }
      if (i == j && !(sum > R(0))) {
        return false;
      }
      normal->matrix[i][j] = i == j ? SQRT(sum) : sum / normal->matrix[j][j];
    }
    step[i] = normal->rhs[i];
    for (int k = 0; k < i; k++) {
      step[i] -= normal->matrix[i][k] * step[k];
    }
    step[i] /= normal->matrix[i][i];
  }
  for (int i = PARAMETERS - 1; i >= 0; i--) {
    for (int k = i + 1; k < PARAMETERS; k++) {
      step[i] -= normal->matrix[k][i] * step[k];
    }
    step[i] /= normal->matrix[i][i];
  }
  return true;
}

/* The largest reading, moved by a paraboloid through the logarithms of the large ones where they have one. */
static void guess(const struct samples *samples, real theta[PARAMETERS]) {
  theta[P0] = R(1);
  theta[X] = samples->x[samples->peak];
  theta[Y] = samples->y[samples->peak];
  theta[SIGMA] = GUESS_SIGMA;
  struct normal normal;
  memset(&normal, 0, sizeof normal);
  for (int i = 0; i < PARAMETERS; i++) {
    normal.matrix[i][i] = GUESS_RIDGE;
  }
  normal.rhs[3] = -GUESS_RIDGE * R(0.5) / (GUESS_SIGMA * GUESS_SIGMA);
  for (int n = 0; n < samples->count; n++) {
    real p = samples->p[n];
    if (p >= GUESS_SHARE) {
      real x = samples->x[n] - theta[X], y = samples->y[n] - theta[Y];
      real row[PARAMETERS] = {p, p * x, p * y, p * (x * x + y * y)};
      add_row(&normal, row, p * LOG(p));
    }
  }
  real c[PARAMETERS];
  if (solve(&normal, c) && c[3] < R(-0.02)) {
    real variance = R(-0.5) / c[3];
    theta[X] += smaller(larger(c[1] * variance, R(-1)), R(1));
    theta[Y] += smaller(larger(c[2] * variance, R(-1)), R(1));
    theta[SIGMA] = larger(SQRT(variance), R(0.25));
  }
}

/* exponential[n] and half the sum of squared residuals. */
static real evaluate(const struct samples *samples, const real theta[PARAMETERS], real exponential[FT_MAX_SENSORS]) {
  real scale = R(-0.5) / (theta[SIGMA] * theta[SIGMA]);
  real cost = 0;
  for (int n = 0; n < samples->count; n++) {
    real x = samples->x[n] - theta[X], y = samples->y[n] - theta[Y];
    exponential[n] = EXP((x * x + y * y) * scale);
    real residual = samples->p[n] - theta[P0] * exponential[n];
    cost += R(0.5) * residual * residual;
  }
  return cost;
}

static void linearise(const struct samples *samples, const real theta[PARAMETERS], const real exponential[FT_MAX_SENSORS],
                      struct normal *normal) {
  real inverse_variance = R(1) / (theta[SIGMA] * theta[SIGMA]);
  real inverse_sigma = R(1) / theta[SIGMA];
  memset(normal, 0, sizeof *normal);
  for (int n = 0; n < samples->count; n++) {
    real x = samples->x[n] - theta[X], y = samples->y[n] - theta[Y];
    real model = theta[P0] * exponential[n];
    real slope = model * inverse_variance;
    real row[PARAMETERS] = {exponential[n], slope * x, slope * y, slope * (x * x + y * y) * inverse_sigma};
    add_row(normal, row, samples->p[n] - model);
  }
}

static void naive(const struct samples *samples, int iterations, real theta[PARAMETERS]) {
  real step[PARAMETERS], exponential[FT_MAX_SENSORS];
  struct normal normal;
  for (int i = 0; i < iterations; i++) {
    evaluate(samples, theta, exponential);
    linearise(samples, theta, exponential, &normal);
    if (!solve(&normal, step)) {
      break;
    }
    for (int j = 0; j < PARAMETERS; j++) {
      theta[j] += step[j];
    }
  }
}

static void lm(const struct samples *samples, int iterations, real theta[PARAMETERS]) {
  real trial[PARAMETERS], step[PARAMETERS], exponential[FT_MAX_SENSORS];
  struct normal normal, damped;
  real cost = evaluate(samples, theta, exponential);
  linearise(samples, theta, exponential, &normal);
  real lambda = R(1e-3), moved = R(1);
  for (int i = 0; i < iterations && moved > SETTLED; i++) {
    damped = normal;
    for (int j = 0; j < PARAMETERS; j++) {
      damped.matrix[j][j] += lambda * damped.matrix[j][j] + R(1e-30);
    }
    if (!solve(&damped, step)) {
      lambda *= R(10);
      continue;
    }
    moved = 0;
    for (int j = 0; j < PARAMETERS; j++) {
      trial[j] = theta[j] + step[j];
      moved = larger(moved, step[j] < R(0) ? -step[j] : step[j]);
    }
    real trial_cost = evaluate(samples, trial, exponential);
    if (trial_cost < cost) {
      memcpy(theta, trial, sizeof trial);
      cost = trial_cost;
      linearise(samples, theta, exponential, &normal);
      lambda *= R(0.1);
    } else {
      lambda *= R(10);
    }
  }
}

static struct alternative_fit fitted(const struct fit_array *array, const int32_t *pressure_Pa_q10, sensor_map usable, int iterations,
                                     void (*iterate)(const struct samples *samples, int iterations, real *theta)) {
  struct samples samples;
  real theta[PARAMETERS], pitch_mm = (real)array->pitch_mm;
  if (!normalise(array, pressure_Pa_q10, usable, &samples)) {
    return (struct alternative_fit){0};
  }
  guess(&samples, theta);
  iterate(&samples, iterations, theta);
  return (struct alternative_fit){(double)(theta[X] * pitch_mm), (double)(theta[Y] * pitch_mm), (double)(theta[P0] * samples.unit_Pa),
                                  (double)(theta[SIGMA] * pitch_mm)};
}

ALTERNATIVE(NAMED(alternative_naive_)) { return fitted(array, pressure_Pa_q10, usable, iterations, naive); }
ALTERNATIVE(NAMED(alternative_lm_)) { return fitted(array, pressure_Pa_q10, usable, iterations, lm); }
