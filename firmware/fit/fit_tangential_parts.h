/* Internal to fit_tangential: what its files share.
 *
 * The model of a reading, lengths in units of twice the widest normal term's standard deviation,
 * d = (dx, dy) from the contact to the sensor:
 *   m = sum over the normal terms of     (A + E / v^2) share V0 / v exp(-d' d / (2 v))
 *     + sum over the tangential terms of (Bx dx + By dy) moment V0 / V^2 exp(-d' d / (2 V))
 *   E = e1 (dx^2 - dy^2) / 2 + e2 dx dy
 * with v and V the terms' variances and t, or KAPPA t, of the contact's own, and V0 the widest normal term's, so that the forces are 2 pi
 * V0 A and 2 pi V0 B. E is what a contact's longer and shorter axis make of its pressure, to first order. The order of the unknowns: those
 * that the others determine least come last. The tangential force follows from the remainder of their columns. */
#pragma once

#include "fit/fit_grid_parts.h"
#include "fit/fit_tangential.h"

enum { AMPLITUDE, LOCATION_X, LOCATION_Y, SPREAD, ELONGATION_1, ELONGATION_2, TANGENTIAL_X, TANGENTIAL_Y, UNKNOWNS };

#define SPREAD_MIN_Q15 9830          /* 0.3 of the narrowest normal term's variance: as much below 0 */
#define SPREAD_MAX_Q26 (ONE_Q26 / 2) /* 2 V0 */
#define ELONGATION_MAX_Q26 (ONE_Q26 / 4 - 1)
#define AMPLITUDE_MAX_Q24 ((4 << 24) - (1 << 11))
#define TANGENTIAL_MAX_Q24 (2 << 24)

/* Where a step begins is rounded, which moves the step and not where it ends: so that what residual and Jacobian have
 * of it is exact in 16 bits, distances from sensors too, whose pitch is such a number. */
#define LOCATION_Q 12
#define AMPLITUDE_Q 13  /* of A and B */
#define ELONGATION_Q 17 /* of e1 and e2 */

/* What of the readings is kept from step to step. */
struct problem {
  const struct fit_pad *pad;
  struct readings readings;
  struct fit_base base;
  int32_t by_gains_q12; /* share of the readings' variances that gains and hysteresis make, mean */
  int32_t model_sd_q16;
  /* The dip, -depth v0 / v exp(-d' d / (2 v)), v = v0 + t as of a term: depth v0, 0: none; v0. */
  int32_t dip_q22, dip_variance_q26;
  const struct fit_deviation *deviations; /* [sensor] or NULL */
  const uint8_t *sensor;                  /* [node] */
  /* Rows of the priors of t and of e1 and e2, whose scale is the amplitude at the beginning. */
  int32_t spread_prior_q26, elongation_prior_q26;
};

/* One step's normal equations, solved. L D L^T in place, with a power of two for each pivot between the factors, 2^half
 * about 1 / sqrt(pivot), so that both have all of their 16 bits: below the diagonal L / 2^half, Q14; above it D L
 * 2^half, Q15. A direction whose pivot is below PIVOT_MIN takes no step. */
struct solution {
  int32_t step_q20[UNKNOWNS]; /* of the normalised columns */
  int32_t half[UNKNOWNS];
  int32_t inverse_q13[UNKNOWNS]; /* of pivot 4^half, 1 to 4 */
  int32_t explained_q30;         /* what the step takes from the square sum of the residuals */
};

/* What the last step leaves for judging it. */
struct outcome {
  struct solution solution;
  int32_t column_q[UNKNOWNS]; /* a column's integer is its value times 2^q */
  struct scaled misfit;       /* chi^2 in units of the base's square */
  bool at_bound;
  int32_t length_q14; /* see take_step */
};

/* The least t. */
FIXED_INLINE int32_t spread_min(const struct fit_pad *pad) { return -fixed_mul_16(pad->variance_q26[0], SPREAD_MIN_Q15) * 2; }

/* Three quarters of a pitch beyond the outer nodes, for an even number of them beyond those on the origin's far side too. */
FIXED_INLINE int32_t reach(const struct fit_pad *pad, int32_t nodes) { return (4 * (nodes / 2) + 3) * (pad->pitch_q26 >> 2); }

/* a * b / 2^shift, 16 < shift <= 32, from three 16-bit products, for |a|, |b| <= 2^30: error below 1 + 2^(32 - shift) units. */
FIXED_INLINE int32_t product(int32_t a, int32_t b, int shift) {
  int32_t a_high = a >> 16, a_low = (uint16_t)a;
  int32_t b_high = b >> 16, b_low = (uint16_t)b;
  return a_high * b_high * (1 << (32 - shift)) + ((a_high * b_low + a_low * b_high) >> (shift - 16));
}

/* The same with the fourth product: error below 2 units. */
FIXED_INLINE int32_t whole_product(int32_t a, int32_t b, int shift) {
  uint32_t low = (uint32_t)(uint16_t)a * (uint16_t)b;
  return product(a, b, shift) + (int32_t)(shift < 32 ? low >> shift : 0);
}

/* a * b / 2^shift, shift <= 16, for |b| < 2^15, from two: error below one unit. */
FIXED_INLINE int32_t scaled_by(int32_t a, int32_t b, int shift) {
  return (a >> 16) * b * (1 << (16 - shift)) + (((int32_t)(uint16_t)a * b) >> shift);
}

/* value / 2^shift to the nearest. */
FIXED_INLINE int32_t rounded(int32_t value, int shift) { return (value + (1 << (shift - 1))) >> shift; }

/* fit_tangential_model.c: residuals and columns of the model there, with the weights. column_q: Qs in which it leaves the columns. */
extern const uint8_t fit_tangential_column_q[UNKNOWNS];
void fit_tangential_linearise(const struct problem *problem, const struct fit_tangential_unknowns *at, struct fit_tangential_work *work);

/* fit_tangential_step.c: one Gauss-Newton step from there. */
void fit_tangential_step(const struct problem *problem, struct fit_tangential_unknowns *at, struct fit_tangential_work *work,
                         struct outcome *outcome);

/* Variance of an unknown, in its unit squared, of readings whose variance is 1: an element of the
 * diagonal of the inverse matrix. influence_q8: the element of the row for this pull, or NULL. */
FIXED_INLINE struct scaled variance_of(const struct fit_tangential_work *work, const struct outcome *outcome, int u, int pull,
                                       int32_t *influence_q8) {
  const struct solution *solution = &outcome->solution;
  int32_t w_q8[UNKNOWNS]; /* row of the inverse of L, times 2^half */
  int32_t sum_q11 = 0;
  for (int k = u; k < UNKNOWNS; k++) {
    int32_t w = k == u ? 1 << 8 : 0;
    for (int m = u; m < k; m++) {
      // cppcheck-suppress uninitvar ; m < k, and the rounds before have set those
      w -= (work->matrix[k][m] * w_q8[m]) >> 14;
    }
    w_q8[k] = w = fixed_clamp(shifted(w, solution->half[k]), -INT16_MAX, INT16_MAX);
    sum_q11 += (((w * w) >> 9) * (solution->inverse_q13[k] >> 6)) >> 3;
  }
  if (influence_q8) {
    *influence_q8 = w_q8[pull];
  }
  return fit_scaled_from(sum_q11, 2 * outcome->column_q[u] - 30 - 11);
}

FIXED_INLINE bool exceeds(struct scaled a, struct scaled b) { return scaled_sub(a, b).mantissa > 0; }

/* fit_tangential_elongation.c. square: e1^2 + e2^2; round: A v. variance: of a reading of weight 1. */
bool fit_tangential_is_elongated(const struct fit_tangential_work *work, const struct outcome *outcome, struct scaled square,
                                 struct scaled round, struct scaled variance);
