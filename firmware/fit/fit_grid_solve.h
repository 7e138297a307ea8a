/* Internal to the fixed-point kernels: the normal equations of one iteration, the step that solves them, and the result of the last ones.
 * Each kernel sets the equations up in its own way. */
#pragma once

#include "fit/fit_grid_parts.h"

/* The model and its derivatives span the same as e times
 *   1,
 *   p1 = x - mean_x,
 *   p2 = y - mean_y - cross p1,
 *   p3 = x^2 + y^2 - slope_x x - slope_y y + constant,
 * e being the model with amplitude 1 at the strongest node, give or take a factor of four. The coefficients are such that the four are
 * orthogonal over the sensors in use, so the normal matrix is diagonal. Mantissas of the struct scaled here have up to 31 bits. */
struct fit_equations {
  struct state at;        /* where the model is linearised */
  int32_t mean_x, mean_y; /* Q26, pitches from the grid's origin node, as the next */
  int32_t cross, slope_x, slope_y;
  int32_t p3_centre_q24; /* p3 at the centre */
  int32_t rise_q22;      /* log2 of e at the centre */
  int32_t mass_q20;      /* sum of e^2 */
  int32_t amplitude_q28;
  int32_t residual_shift;         /* the sums took the residual in Q(28 - shift) */
  int32_t b0;                     /* what the amplitude's rounding left, Q(38 - shift) */
  struct scaled b1, b2, b3;       /* right-hand side */
  struct scaled d1, d2, d3;       /* the matrix */
  struct scaled stiffness;        /* amplitude / sigma^2, of e */
  struct scaled prior_row;        /* what the prior adds to the matrix is its square */
  struct scaled square_sum;       /* of the residuals; the last iteration alone needs it */
  int32_t c1_q26, c2_q26, c3_q28; /* the step along p1, p2, p3, before any limit */
  int32_t step_x_q22, step_y_q22; /* the step taken */
};

#define STIFFNESS_PER_CURVATURE_Q14 22713 /* 2 / log2(e) = 1 / (sigma^2 curvature) */

#define AMPLITUDE_MIN_Q28 13421773        /* 0.05 */
#define AMPLITUDE_MAX_Q28 ((1 << 30) - 1) /* 4 */

/* numerator (Q(26 - PRODUCT_SHIFT)) / denominator (Q(14 - PRODUCT_SHIFT)), limited to the two above, to 12 or 24 bits after the point. */
FIXED_INLINE int32_t fit_grid_amplitude(int32_t numerator, int32_t denominator, bool fine) {
  denominator = denominator < 1 ? 1 : denominator;
  int32_t quotient_q12 = port_divide(numerator, denominator);
  if (quotient_q12 >= AMPLITUDE_MAX_Q28 >> 16) {
    return AMPLITUDE_MAX_Q28;
  }
  if (quotient_q12 < AMPLITUDE_MIN_Q28 >> 16) {
    return AMPLITUDE_MIN_Q28;
  }
  int32_t amplitude = quotient_q12 * (1 << 16);
  if (fine) {
    int32_t rest = numerator - quotient_q12 * denominator;
    amplitude += port_divide(rest * (1 << 12), denominator) * (1 << 4);
  }
  return amplitude;
}

/* log2 of e at the centre, Q22, where e is 1 at a node by these offsets (Q26) from the centre. */
FIXED_INLINE int32_t fit_grid_rise(int32_t curvature, int32_t offset_x, int32_t offset_y) {
  int32_t squares = fixed_mul_q26(offset_x, offset_x) + fixed_mul_q26(offset_y, offset_y);
  return fixed_mul_q32(curvature, fixed_clamp(squares, 0, (1 << 29) - 1) * 2) * 2;
}

/* The prior (sigma - prior) / width as one more row of the least squares; c3 is the only unknown that changes sigma. */
void fit_grid_add_prior(const struct readings *readings, struct fit_equations *equations);

/* Sets the stiffness and adds the prior, if there is one, to what the kernel filled in. */
FIXED_INLINE void fit_grid_complete(const struct readings *readings, struct fit_equations *equations) {
  uint32_t product = (uint32_t)(equations->at.curvature >> 14) * (uint32_t)(equations->amplitude_q28 >> 14);
  int32_t shift = fixed_bits(product) - 14;
  equations->stiffness = (struct scaled){((int32_t)(product >> shift) * STIFFNESS_PER_CURVATURE_Q14) >> 14, shift - 26};
  if (readings->prior_weight.mantissa != 0) {
    fit_grid_add_prior(readings, equations);
  }
}

/* One Gauss-Newton step of the state. */
void fit_grid_step(const struct fit_grid_shape *grid, struct fit_equations *equations, struct state *state);

/* 1 / value; what is not positive counts as the last place. */
uint64_t fit_packed_reciprocal(struct scaled value);
FIXED_INLINE struct scaled fit_grid_reciprocal(struct scaled value) { return scaled_unpack(fit_packed_reciprocal(value)); }

/* Error propagation: how an error of each reading moves the result. fit_limits.h lists the errors. For those that are the same for every
 * sensor, as the noise, the norms of the columns suffice. Gains differ between sensors, and the model's error has a shape. */

/* Formats of the columns p1, p2, p3 of struct fit_equations, times e: value = integer * 2^-q. */
struct fit_columns_q {
  int32_t q1, q2, q3;
};

struct fit_propagation {
  /* How far one unit of a column moves x and y (pitches, times 2^(location_exponent - 15)) and the force (its share
   * times sigma^2, times 2^(force_exponent - 15)), if the readings' unit is that of Q28. */
  int32_t x1, x2, x3, y2, y3, location_exponent;
  int32_t f0, f1, f2, f3, force_exponent;
  struct scaled inverse_mass, inverse1, inverse2, inverse3; /* of the norms, of all four columns */
  struct scaled amplitude, inverse_stiffness;               /* the latter 1 / stiffness */
  /* dF / F is that of e, p1, p2 and p3 times 1, off_x, off_y (Q26) and centre_q24. */
  int32_t off_x, off_y, centre_q24;
  struct scaled hysteresis; /* 1/1024 Pa in shares of the amplitude, 1 / 2^16 */
  int32_t gain_shift;       /* gains Q16 are used with this number of bits more */
  int32_t shape_shift;      /* the model error's shape in Q(21 - shape_shift) */
  /* Sums over the sensors. */
  uint32_t gains;    /* of the squared errors of the readings */
  uint32_t by_gains; /* of the squares of what they make of x and y */
  uint32_t force_by_gains;
  struct scaled location_variance, force_variance; /* of all of this, once it is concluded */
  struct scaled elongation_shift;                  /* square of how far another shape of the contact would move it, pitches */
  int32_t shape_x, shape_y, shape_force;           /* what the model error's shape makes of these */
};

/* The square of a number of 15 bits, so that those of all sensors and of two coordinates add up. */
#define PROPAGATION_SQUARE_SHIFT (NODES > 15 ? 6 : 5)

/* shift: the readings'. The columns have at most 1.5 * 2^15. */
void fit_grid_begin_propagation(int32_t shift, const struct fit_equations *equations, const struct fit_columns_q *columns,
                                struct fit_propagation *propagation);

/* The variances that the sums make: pitches squared, share of the force squared. */
void fit_grid_end_propagation(const struct fit_settings *settings, const struct fit_equations *equations,
                              struct fit_propagation *propagation);

/* Reuses the memory of the readings, [node]. In: e (Q15) in q28. Out: the error of each reading by gain and hysteresis in q14, as a share
 * of the amplitude times 2^(16 + gain_shift); the shape of the model's error in residual; both of 15 bits. */
void fit_grid_set_errors(const struct fit_grid_shape *grid, const struct fit_settings *settings, const struct state *at,
                         struct readings *work, struct fit_propagation *propagation);

/* work->q28: how far a unit of each reading moves a quantity, 15 bits. Adds what the errors make of it. */
void fit_grid_add_influence(const struct readings *work, uint32_t *by_gains, int32_t *by_shape);

/* Values of up to 15 bits in one unit, the largest of 13 bits. Returns the exponent of that unit. */
int32_t fit_grid_align(const struct scaled *values, int count, int32_t *aligned);

/* Sets the result from the last equations, the propagation of errors, and the state after the last step; count: of the sensors in use.
 * Returns whether the fit has settled with residuals that are rough and larger than noise and gains explain. */
bool fit_grid_conclude(const struct fit_grid_shape *grid, const struct readings *readings, const struct fit_settings *settings,
                       const struct fit_equations *equations, const struct fit_propagation *propagation, const struct state *state,
                       int count, struct fit_result *result);

/* The outlier among the sensors, or -1; result: the fit to them all. */
int fit_grid_outlier(const struct fit_array *array, const int32_t *pressure_Pa_q10, sensor_map usable, const struct fit_settings *settings,
                     const struct fit_result *result);
