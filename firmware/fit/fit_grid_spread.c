#include "fit/fit_grid_spread.h"

/* Columns times these stay within 31 bits with four of them. */
#define COEFFICIENT_BITS 13

/* z^2 e of a sensor, z in Q10 and below 22.6, in Q21. Where the contact lies among the sensors it is
 * at most 1.2, with room for an e that is up to four times what it is called. */
#define DOWN_MAX_Q10 23170
#define SHAPE_USUAL_Q21 (10 << 21)

int32_t fit_grid_align(const struct scaled *values, int count, int32_t *aligned) {
  int32_t exponent = -1000;
  for (int i = 0; i < count; i++) {
    int32_t top = fixed_bits(fixed_size(values[i].mantissa)) + values[i].exponent;
    if (values[i].mantissa != 0 && top - COEFFICIENT_BITS > exponent) {
      exponent = top - COEFFICIENT_BITS;
    }
  }
  for (int i = 0; i < count; i++) {
    aligned[i] = scaled_to_fixed(values[i], -exponent);
  }
  return exponent;
}

/* Reciprocal of a norm times 2^-q. */
static struct scaled per_unit(const struct scaled *norm, int32_t q) {
  struct scaled result = fit_grid_reciprocal(*norm);
  result.exponent -= q;
  return result;
}

/* log2 of the model along one axis. */
static void set_down(int32_t *down_q10, int nodes, int origin, int32_t centre, int32_t height) {
  for (int i = 0; i < nodes; i++) {
    int32_t off_q12 = ((i - origin) * ONE_Q26 - centre) >> 14;
    down_q10[i] = fixed_mul_q32(height, off_q12 * off_q12) >> 8;
  }
}

NOINLINE void fit_grid_begin_spread(const struct fit_settings *settings,
                                    const struct fit_system *system,
                                    const struct fit_columns_q *columns,
                                    struct fit_spread *spread) {
  const struct state *at = &system->at;
  struct scaled unit1 = per_unit(&system->d1, columns->q1);
  struct scaled unit2 = per_unit(&system->d2, columns->q2);
  struct scaled unit3 = per_unit(&system->d3, columns->q3);
  struct scaled values[5], softness = fit_grid_reciprocal(system->stiffness);
  int32_t aligned[5];
  values[0] = scaled_mul(softness, unit1);
  values[3] = scaled_mul(softness, unit2);
  values[1] = scaled_mul(values[3], scaled_from(-system->cross, -26));
  unit1 = values[0];
  unit2 = values[3];
  unit3 = scaled_mul(softness, unit3);
  values[2] = scaled_mul(unit3, scaled_from(2 * at->x - system->slope_x, -26));
  values[4] = scaled_mul(unit3, scaled_from(2 * at->y - system->slope_y, -26));
  spread->location_exponent = fit_grid_align(values, 5, aligned) + 15;
  spread->x1 = aligned[0];
  spread->x2 = aligned[1];
  spread->x3 = aligned[2];
  spread->y2 = aligned[3];
  spread->y3 = aligned[4];

  /* dF / F = dp0 / p0 + 2 dsigma / sigma, each by its part in the basis. */
  int32_t sigma = fit_grid_sigma(at->height);
  spread->off_x = at->x - system->mean_x;
  spread->off_y = at->y - system->mean_y - fixed_mul_q26(system->cross, spread->off_x);
  spread->lift_q24 = system->bend_q24 + (fixed_mul_q26(sigma, sigma) >> 1);
  values[0] = scaled_mul(fit_grid_reciprocal(scaled_from(system->mass_q20, -20)), softness);
  values[0].exponent -= 15;
  values[1] = scaled_mul(unit1, scaled_from(spread->off_x, -26));
  values[2] = scaled_mul(unit2, scaled_from(spread->off_y, -26));
  values[3] = scaled_mul(unit3, scaled_from(spread->lift_q24, -24));
  spread->force_exponent = fit_grid_align(values, 4, aligned) + 15;
  spread->f0 = aligned[0];
  spread->f1 = aligned[1];
  spread->f2 = aligned[2];
  spread->f3 = aligned[3];

  set_down(spread->down_x, COLUMNS, COLUMNS / 2, at->x, at->height);
  set_down(spread->down_y, ROWS, ROWS / 2, at->y, at->height);
  int32_t rise_q10 = fixed_clamp(system->rise_q22 >> 12, 0, DOWN_MAX_Q10);
  int32_t most_q21 = (rise_q10 * rise_q10) * 2;
  most_q21 = most_q21 > SHAPE_USUAL_Q21 ? most_q21 : SHAPE_USUAL_Q21;
  spread->shape_shift = fixed_bits((uint32_t)most_q21) - 15;

  uint32_t gains = 1;
  for (int k = 0; k < NODES; k++) {
    gains |= settings->gain_sd_q16[k];
  }
  spread->gain_shift = 15 - fixed_bits(gains);
  spread->apart = (struct scaled){0, 0};
  spread->gains = spread->by_gains = spread->force_by_gains = 0;
  spread->shape_x = spread->shape_y = spread->shape_force = 0;
}

/* The square of what 31 bits hold, for a sum. */
FIXED_INLINE uint32_t square_of(int32_t value) {
  int32_t high = value >> 16;
  return (uint32_t)(high * high) >> SPREAD_SQUARE_SHIFT;
}

NOINLINE int32_t fit_grid_add_to_spread(struct fit_spread *spread, const struct fit_node *node,
                                        int i, int j, uint16_t gain_sd_q16) {
  int32_t p1 = node->p1, p2 = node->p2, p3 = node->p3, e = node->e;
  int32_t x = (spread->x1 * p1 + spread->x2 * p2 + spread->x3 * p3) >> 15;
  int32_t y = (spread->y2 * p2 + spread->y3 * p3) >> 15;
  int32_t f = (spread->f0 * e + spread->f1 * p1 + spread->f2 * p2 + spread->f3 * p3) >> 15;

  int32_t down = spread->down_x[i] + spread->down_y[j];
  down = down < DOWN_MAX_Q10 ? down : DOWN_MAX_Q10;
  int32_t shape = (((down * down) >> 13) * (e >> 1)) >> spread->shape_shift;
  shape = shape < INT16_MAX ? shape : INT16_MAX;
  spread->shape_x += (x * shape) >> 4;
  spread->shape_y += (y * shape) >> 4;
  spread->shape_force += (f * shape) >> 4;

  int32_t gain = spread->gain_shift >= 0 ? gain_sd_q16 << spread->gain_shift : gain_sd_q16 >> 1;
  int32_t error = (gain * e) >> 15;
  spread->gains += (uint32_t)(error * error) >> SPREAD_SQUARE_SHIFT;
  spread->by_gains += square_of(x * error) + square_of(y * error);
  spread->force_by_gains += square_of(f * error);
  return error;
}
