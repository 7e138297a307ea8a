/* Inside the fixed-point kernels alone: the normal equations of one iteration, the step they ask
 * for, and what the last of them imply for the result. How a kernel comes by them is its own
 * affair.
 */
#ifndef FIT_FIT_GRID_SOLVE_H
#define FIT_FIT_GRID_SOLVE_H

#include "fit/fit_grid_parts.h"

/* The model and its derivatives span the same as e times
 *   1,
 *   p1 = x - mean_x,
 *   p2 = y - mean_y - cross p1,
 *   p3 = x^2 + y^2 - slope_x x - slope_y y + constant,
 * e being the model with amplitude 1 at the strongest node, give or take a factor of four. The
 * coefficients are such that the four are orthogonal over the sensors in use, so the normal matrix
 * is diagonal. Mantissas of the struct scaled here have up to 31 bits. */
struct fit_system {
  struct state at;        /* where the model is linearised */
  int32_t mean_x, mean_y; /* Q26, pitches from the grid's origin node, as the next */
  int32_t cross, slope_x, slope_y;
  int32_t bend_q24; /* p3 at the centre */
  int32_t rise_q22; /* log2 of e at the centre */
  int32_t mass_q20; /* sum of e^2 */
  int32_t amplitude_q28;
  int32_t residual_shift;         /* the sums took the residual in Q(28 - shift) */
  int32_t b0;                     /* what the amplitude's rounding left, Q(38 - shift) */
  struct scaled b1, b2, b3;       /* right-hand side */
  struct scaled d1, d2, d3;       /* the matrix */
  struct scaled stiffness;        /* amplitude / sigma^2, of e */
  struct scaled prior_row;        /* what the prior adds to the matrix is its square */
  struct scaled square_sum;       /* of the residuals; the last iteration alone needs it */
  int32_t c1_q26, c2_q26, c3_q28; /* the step along p1, p2, p3, before any limit */
  int32_t move_x_q22, move_y_q22; /* the step taken */
};

#define STIFFNESS_PER_HEIGHT_Q14 22713 /* 2 / log2(e) = 1 / (sigma^2 height) */

#define AMPLITUDE_MIN_Q28 13421773        /* 0.05 */
#define AMPLITUDE_MAX_Q28 ((1 << 30) - 1) /* 4 */

/* numerator (Q26) / denominator, limited to the two above, to 12 or 24 bits after the point. */
FIXED_INLINE int32_t fit_grid_amplitude(int32_t numerator_q26, int32_t denominator_q14, bool fine) {
  denominator_q14 = denominator_q14 < 1 ? 1 : denominator_q14;
  int32_t quotient_q12 = port_divide(numerator_q26, denominator_q14);
  if (quotient_q12 >= AMPLITUDE_MAX_Q28 >> 16) {
    return AMPLITUDE_MAX_Q28;
  }
  if (quotient_q12 < AMPLITUDE_MIN_Q28 >> 16) {
    return AMPLITUDE_MIN_Q28;
  }
  int32_t amplitude = quotient_q12 * (1 << 16);
  if (fine) {
    int32_t rest = numerator_q26 - quotient_q12 * denominator_q14;
    amplitude += port_divide(rest * (1 << 12), denominator_q14) * (1 << 4);
  }
  return amplitude;
}

/* log2 of e at the centre, Q22, where e is 1 at a node by these offsets (Q26) from the centre. */
FIXED_INLINE int32_t fit_grid_rise(int32_t height, int32_t offset_x, int32_t offset_y) {
  int32_t squares = fixed_mul_q26(offset_x, offset_x) + fixed_mul_q26(offset_y, offset_y);
  return fixed_mul_q32(height, fixed_clamp(squares, 0, (1 << 29) - 1) * 2) * 2;
}

/* The prior (sigma - prior) / width as one more row of the least squares; c3 is the only unknown
 * that changes sigma. */
void fit_grid_add_prior(const struct readings *readings, struct fit_system *system);

/* Sets the stiffness and adds the prior, if there is one, to what the kernel filled in. */
FIXED_INLINE void fit_grid_complete(const struct readings *readings, struct fit_system *system) {
  uint32_t product = (uint32_t)(system->at.height >> 14) * (uint32_t)(system->amplitude_q28 >> 14);
  int32_t shift = fixed_bits(product) - 14;
  system->stiffness = (struct scaled){((int32_t)(product >> shift) * STIFFNESS_PER_HEIGHT_Q14) >> 14, shift - 26};
  if (readings->prior_weight.mantissa != 0) {
    fit_grid_add_prior(readings, system);
  }
}

/* One Gauss-Newton step of the state. */
void fit_grid_step(const struct fit_grid_shape *grid, struct fit_system *system, struct state *state);

/* 1 / value; what is not positive counts as the last place. */
uint64_t fit_packed_reciprocal(struct scaled value);
FIXED_INLINE struct scaled fit_grid_reciprocal(struct scaled value) {
  return scaled_unpack(fit_packed_reciprocal(value));
}

struct fit_spread;

/* The result from the last system, what it makes of the errors of the readings, and the state after
 * its step; count: of the sensors in use. Returns whether it has settled with residuals that are
 * rough and beyond what noise and gains explain. */
bool fit_grid_conclude(const struct fit_grid_shape *grid, const struct readings *readings,
                       const struct fit_settings *settings, const struct fit_system *system,
                       const struct fit_spread *spread, const struct state *state, int count,
                       struct fit_result *result);

/* The sensor whose reading does not belong to the others', or -1; result: the fit to them all. */
int fit_grid_outlier(const struct fit_array *array, const int32_t *pressure_Pa_q10, uint32_t usable,
                     const struct fit_settings *settings, const struct fit_result *result);

#endif
