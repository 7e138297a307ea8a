#include "fit/fit_grid_solve.h"
#include "fit/fit_limits.h"

#include <string.h>

#define UNROLL _Pragma("GCC unroll 6") /* for loops over the nodes of an axis */

/* Columns times these stay within 31 bits with four of them. */
#define COEFFICIENT_BITS 13

/* z^2 e of a sensor in Q21, z = -log2 of the model there, in Q10 and at most 22.6. Where the contact lies among the
 * sensors it is at most 1.2, with room for an e that is up to four times what it is called. */
#define DOWN_MAX_Q10 23170
#define SHAPE_USUAL_Q21 (10 << 21)

/* FIT_SHAPE_PER_MODEL in terms of z^2 and the curvature: sigma^2 = log2(e) / (2 curvature) and r^2 / sigma^2 = 2 z / log2(e). */
#define SHAPE_PER_MODEL ((struct scaled){19914, -14})
#define SHAPE_KNOWN ((struct scaled){19661, -16})
#define FORCE_SHARE ((struct scaled){20972, -17}) /* FIT_FORCE_SHAPE^2 */

int32_t fit_grid_align(const struct scaled *values, int count, int32_t *aligned) {
  int32_t exponent = INT16_MIN;
  for (int i = 0; i < count; i++) {
    uint32_t size = fixed_magnitude(values[i].mantissa);
    int32_t spare = size >= 1 << 14 ? 0 : size >= 1 << 13 ? 1 : 2; /* products have 13 bits or more */
    if (size != 0 && values[i].exponent - spare > exponent) {
      exponent = values[i].exponent - spare;
    }
  }
  exponent += 15 - COEFFICIENT_BITS;
  for (int i = 0; i < count; i++) {
    uint32_t shift = (uint32_t)(exponent - values[i].exponent); /* of a zero anything */
    aligned[i] = values[i].mantissa >> (shift < 31 ? shift : 31);
  }
  return exponent;
}

#define LOG2E_Q30 1549082005

/* log2 of the model at the centre over that at each node of an axis, Q10. */
static void set_down(int32_t *down, int nodes, int origin, int32_t centre, int32_t curvature) {
  for (int i = 0; i < nodes; i++) {
    int32_t off_q12 = ((i - origin) * ONE_Q26 - centre) >> 14;
    down[i] = fixed_mul_q32(curvature, off_q12 * off_q12) >> 8;
  }
}

/* How far one unit of each column moves a coefficient of the step: the inverse stiffness over its norm. */
struct units {
  struct scaled of1, of2, of3;
};

FIXED_INLINE void set_units(const struct fit_columns_q *columns, const struct fit_propagation *propagation, struct units *units) {
  units->of1 = scaled_mul(propagation->inverse_stiffness, propagation->inverse1);
  units->of2 = scaled_mul(propagation->inverse_stiffness, propagation->inverse2);
  units->of3 = scaled_mul(propagation->inverse_stiffness, propagation->inverse3);
  units->of1.exponent -= columns->q1;
  units->of2.exponent -= columns->q2;
  units->of3.exponent -= columns->q3;
}

FIXED_INLINE void set_location_influence(const struct fit_equations *equations, const struct units *units,
                                         struct fit_propagation *propagation) {
  const struct state *at = &equations->at;
  struct scaled values[5];
  int32_t aligned[5];
  values[0] = units->of1;
  values[1] = (struct scaled){0, 0};
  if (equations->cross != 0) {
    values[1] = scaled_mul(units->of2, fit_scaled_from(-equations->cross, -26));
  }
  values[2] = scaled_mul(units->of3, fit_scaled_from(2 * at->x - equations->slope_x, -26));
  values[3] = units->of2;
  values[4] = scaled_mul(units->of3, fit_scaled_from(2 * at->y - equations->slope_y, -26));
  propagation->location_exponent = fit_grid_align(values, 5, aligned) + 15;
  propagation->x1 = aligned[0];
  propagation->x2 = aligned[1];
  propagation->x3 = aligned[2];
  propagation->y2 = aligned[3];
  propagation->y3 = aligned[4];
}

/* dF / F = dp0 / p0 + 2 dsigma / sigma, each by its part in the basis. */
FIXED_INLINE void set_force_influence(const struct fit_equations *equations, const struct units *units,
                                      struct fit_propagation *propagation) {
  const struct state *at = &equations->at;
  struct scaled values[4];
  int32_t aligned[4];
  propagation->off_x = at->x - equations->mean_x;
  propagation->off_y = at->y - equations->mean_y - fixed_mul_q26(equations->cross, propagation->off_x);
  /* 2 sigma^2 = log2(e) / curvature */
  propagation->centre_q24 = equations->p3_centre_q24 + port_divide(LOG2E_Q30, at->curvature >> 14) * (1 << 6);
  values[0] = scaled_mul(propagation->inverse_mass, propagation->inverse_stiffness);
  values[0].exponent -= 15;
  values[1] = scaled_mul(units->of1, fit_scaled_from(propagation->off_x, -26));
  values[2] = scaled_mul(units->of2, fit_scaled_from(propagation->off_y, -26));
  values[3] = scaled_mul(units->of3, fit_scaled_from(propagation->centre_q24, -24));
  propagation->force_exponent = fit_grid_align(values, 4, aligned) + 15;
  propagation->f0 = aligned[0];
  propagation->f1 = aligned[1];
  propagation->f2 = aligned[2];
  propagation->f3 = aligned[3];
}

/* errors[NODES]: what earlier presses leave in each sensor, as a share of the amplitude, at most half, 1 / 2^16. */
#ifdef FT_WITHOUT_HYSTERESIS
FIXED_INLINE void set_hysteresis(int32_t shift, struct fit_propagation *propagation) { (void)shift, (void)propagation; }
FIXED_INLINE void put_hysteresis(const uint8_t *sensor, const struct fit_settings *settings, const struct fit_propagation *propagation,
                                 int32_t *errors) {
  (void)sensor, (void)settings, (void)propagation;
  memset(errors, 0, NODES * sizeof errors[0]);
}
#else
FIXED_INLINE void set_hysteresis(int32_t shift, struct fit_propagation *propagation) {
  propagation->hysteresis = fit_grid_reciprocal(propagation->amplitude);
  propagation->hysteresis.exponent += shift - 28 + 16;
}
FIXED_INLINE void put_hysteresis(const uint8_t *sensor, const struct fit_settings *settings, const struct fit_propagation *propagation,
                                 int32_t *errors) {
  int32_t any = INT16_MAX;
  for (int k = 0; k < NODES; k++) {
    any |= settings->hysteresis_sd_Pa_q10[sensor[k]];
  }
  const int32_t less = fixed_bits((uint32_t)any) - 15;
  for (int k = 0; k < NODES; k++) {
    const int32_t hysteresis = settings->hysteresis_sd_Pa_q10[sensor[k]] >> less;
    errors[k] = fixed_clamp(shifted(hysteresis * propagation->hysteresis.mantissa, propagation->hysteresis.exponent + less), 0, INT16_MAX);
  }
}
#endif

NOINLINE void fit_grid_begin_propagation(int32_t shift, const struct fit_equations *equations, const struct fit_columns_q *columns,
                                         struct fit_propagation *propagation) {
  propagation->inverse_mass = fit_grid_reciprocal(fit_scaled_from(equations->mass_q20, -20));
  propagation->inverse1 = fit_grid_reciprocal(equations->d1);
  propagation->inverse2 = fit_grid_reciprocal(equations->d2);
  propagation->inverse3 = fit_grid_reciprocal(equations->d3);
  propagation->amplitude = fit_scaled_from(equations->amplitude_q28, -28);
  propagation->inverse_stiffness = fit_grid_reciprocal(equations->stiffness);
  struct units units;
  set_units(columns, propagation, &units);
  set_location_influence(equations, &units, propagation);
  set_force_influence(equations, &units, propagation);

  int32_t rise_q10 = fixed_clamp(equations->rise_q22 >> 12, 0, DOWN_MAX_Q10);
  int32_t most_q21 = (rise_q10 * rise_q10) * 2;
  most_q21 = most_q21 > SHAPE_USUAL_Q21 ? most_q21 : SHAPE_USUAL_Q21;
  propagation->shape_shift = fixed_bits((uint32_t)most_q21) - 15;

  set_hysteresis(shift, propagation);
  propagation->elongation_shift = (struct scaled){0, 0};
  propagation->by_gains = propagation->force_by_gains = 0;
}

NOINLINE void fit_grid_set_errors(const struct fit_grid_shape *grid, const struct fit_settings *settings, const struct state *at,
                                  struct readings *work, struct fit_propagation *propagation) {
  int32_t down_x[MAX_COLUMNS], down_y[MAX_ROWS];
  set_down(down_x, COLUMNS, COLUMNS / 2, at->x, at->curvature);
  set_down(down_y, ROWS, ROWS / 2, at->y, at->curvature);
  const int32_t *at_node = work->q28;
  int32_t *shapes = work->residual;
  int32_t shape_shift = propagation->shape_shift;
  for (int i = 0; i < COLUMNS; i++) {
    int32_t along = down_x[i];
    UNROLL for (int j = 0; j < ROWS; j++) {
      int32_t down = along + down_y[j];
      down = down < DOWN_MAX_Q10 ? down : DOWN_MAX_Q10;
      int32_t shape = (((down * down) >> 13) * (*at_node++ >> 1)) >> shape_shift;
      *shapes++ = shape < INT16_MAX ? shape : INT16_MAX;
    }
  }
  const uint8_t *sensor = grid->sensor;
  int32_t *errors = work->q14;
  uint32_t most = fit_has_dip(settings) ? (uint32_t)FIT_DIP_ERROR_Q16 >> 1 : 1; /* the dip is at most a quarter */
  put_hysteresis(sensor, settings, propagation, errors);
  for (int k = 0; k < NODES; k++) {
    most |= (uint32_t)fixed_hypot(settings->gain_sd_q16[sensor[k]], errors[k]);
  }
  propagation->gain_shift = 15 - fixed_bits(most < UINT16_MAX ? most : UINT16_MAX);
  uint32_t gains = 0;
  int32_t gain_shift = propagation->gain_shift + 1;
  at_node = work->q28;
  for (int k = 0; k < NODES; k++) {
    uint32_t gain = (uint32_t)settings->gain_sd_q16[sensor[k]] << gain_shift;
    int32_t hysteresis = shifted(errors[k], propagation->gain_shift);
    int32_t error = fixed_hypot((int32_t)((gain * (uint32_t)at_node[k]) >> 16), hysteresis);
    errors[k] = error;
    gains += (uint32_t)(error * error) >> PROPAGATION_SQUARE_SHIFT;
  }
  propagation->gains = gains;
}

NOINLINE void fit_grid_add_influence(const struct readings *work, uint32_t *by_gains, int32_t *by_shape) {
  const int32_t *moves = work->q28, *errors = work->q14, *shapes = work->residual;
  uint32_t squares = *by_gains;
  int32_t sum = 0;
  _Pragma("GCC unroll 5") for (int k = 0; k < NODES; k++) {
    int32_t move = moves[k];
    int32_t high = (move * errors[k]) >> 16;
    squares += (uint32_t)(high * high) >> PROPAGATION_SQUARE_SHIFT;
    sum += (move * shapes[k]) >> 4;
  }
  *by_gains = squares;
  *by_shape = sum;
}

NOINLINE void fit_grid_end_propagation(const struct fit_settings *settings, const struct fit_equations *equations,
                                       struct fit_propagation *propagation) {
  const int32_t gains_exponent = PROPAGATION_SQUARE_SHIFT - 2 * propagation->gain_shift;
  uint32_t bend = (uint32_t)settings->model_sd_q16 * (uint32_t)(equations->at.curvature >> 14);
  struct scaled strength = fit_scaled_from((int32_t)(bend >> 1), 1 - 16 - 12);
  strength = scaled_mul(strength, SHAPE_PER_MODEL);
  if (fit_has_dip(settings)) {
    strength = scaled_mul(strength, SHAPE_KNOWN);
  }
  strength.exponent += 4 - 21 + propagation->shape_shift;
  struct scaled x = scaled_mul(fit_scaled_from(propagation->shape_x, 0), strength);
  struct scaled y = scaled_mul(fit_scaled_from(propagation->shape_y, 0), strength);
  struct scaled sum = scaled_add(scaled_mul(x, x), scaled_mul(y, y));
  sum = scaled_add(sum, fit_scaled_from((int32_t)propagation->by_gains, gains_exponent));
  sum = scaled_mul(scaled_mul(sum, propagation->amplitude), propagation->amplitude);
  propagation->location_variance = (struct scaled){sum.mantissa, sum.exponent + 2 * propagation->location_exponent};

  struct scaled force = scaled_mul(fit_scaled_from(propagation->shape_force, 0), strength);
  sum = scaled_mul(scaled_mul(force, force), FORCE_SHARE);
  sum = scaled_add(sum, fit_scaled_from((int32_t)propagation->force_by_gains, gains_exponent));
  sum = scaled_mul(scaled_mul(sum, equations->stiffness), equations->stiffness);
  propagation->force_variance = (struct scaled){sum.mantissa, sum.exponent + 2 * propagation->force_exponent};
}
