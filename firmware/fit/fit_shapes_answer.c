/* Which model it is, and what that says of places, forces and directions. */
#include "fit/fit_grid_solve.h"
#include "fit/fit_math.h"
#include "fit/fit_shapes_parts.h"

/* What a pair's residuals show of the model's error stands for more of it, as its unknowns follow
 * most of what a profile and a dip are off by. With this share of the freedom 98 % of the places
 * are off by less than two standard deviations. */
#define PAIR_FREEDOM (FREEDOM / 3)
#define SEPARATION_HALF_Q10 256 /* of half a pitch: nearer pairs are long contacts */

/* Variance of a sum of two unknowns times these, each at most some pitches or units of the
 * readings. */
static NOINLINE struct scaled variance_of(const struct fit_shapes_equations *equations, int first,
                                          int32_t a_q20, int second, int32_t b_q20) {
  const int32_t(*matrix)[UNKNOWNS] = equations->matrix;
  int32_t w_q10[UNKNOWNS], sum_q13 = 0;
  int32_t q =
      equations->q[first] > equations->q[second] ? equations->q[first] : equations->q[second];
  int32_t a_q10 = shifted(a_q20, equations->q[first] - q - 10);
  int32_t b_q10 = shifted(b_q20, equations->q[second] - q - 10);
  for (int j = 0; j < equations->count; j++) {
    int32_t w = (j == first ? a_q10 : 0) + (j == second ? b_q10 : 0);
    for (int i = 0; i < j; i++) {
      w -= (matrix[j][i] * w_q10[i]) >> 14;
    }
    w = fixed_clamp(w * (1 << equations->half[j]), -INT16_MAX, INT16_MAX);
    w_q10[j] = w;
    sum_q13 += (((w * w) >> 13) * (equations->inverse_q14[j] >> 4)) >> 4;
  }
  return fit_scaled_from(sum_q13, 2 * q - 30 - 13);
}

static float composed(struct scaled value) {
  return fit_float(value.mantissa, value.exponent);
}

static float mm(const struct fit_shapes_pad *pad, int32_t place_q20) {
  return fit_float(fixed_mul_q26(place_q20 * 8, pad->pitch_q22_mm), -19);
}

static float product_of(struct scaled a, struct scaled b) {
  return composed(scaled_mul(fit_scaled_short(a), fit_scaled_short(b)));
}

/* unit: N of amplitude 1. variance: of a reading of weight 1. */
struct scales {
  struct scaled unit, variance, pitch;
};

static float sd_of(struct scaled scale, struct scaled form, struct scaled variance) {
  return product_of(scale, fit_scaled_sqrt(scaled_mul(fit_scaled_short(form), variance)));
}

static NOINLINE void put_two(const struct problem *problem,
                             const struct fit_shapes_equations *equations, const int32_t *at,
                             const struct scales *scales, struct fit_shapes_result *result) {
  const struct fit_shapes_pad *pad = problem->pad;
  for (int c = 0; c < 2; c++) {
    int32_t sign = (c == 0) == (at[BALANCE] >= 0) ? 1 : -1;
    int32_t share_q20 = (ONE_Q20 + sign * at[BALANCE]) / 2;
    result->x_mm[c] = mm(pad, pad->origin_x_q20 + at[PLACE_X] + sign * at[SPAN_X]);
    result->y_mm[c] = mm(pad, pad->origin_y_q20 + at[PLACE_Y] + sign * at[SPAN_Y]);
    result->force_N[c] = product_of(scales->unit, scaled_mul(fit_scaled_from(at[AMPLITUDE], -20),
                                                             fit_scaled_from(share_q20, -20)));
    struct scaled place =
        scaled_add(variance_of(equations, PLACE_X, ONE_Q20, SPAN_X, sign * ONE_Q20),
                   variance_of(equations, PLACE_Y, ONE_Q20, SPAN_Y, sign * ONE_Q20));
    result->location_sd_mm[c] = sd_of(scales->pitch, place, scales->variance);
    struct scaled force =
        variance_of(equations, AMPLITUDE, share_q20, BALANCE, sign * (at[AMPLITUDE] >> 1));
    result->force_sd_N[c] = sd_of(scales->unit, force, scales->variance);
  }
}

static NOINLINE void put_line(const struct fit_shapes_equations *equations, const int32_t *at,
                              const struct scales *scales, struct fit_shapes_result *result) {
  result->shape = FIT_SHAPE_PULLED;
  result->qx_N = product_of(scales->unit, fit_scaled_from(at[PULL_X], -20));
  result->qy_N = product_of(scales->unit, fit_scaled_from(at[PULL_Y], -20));
  struct scaled x = fit_scaled_from(at[SPAN_X], -20), y = fit_scaled_from(at[SPAN_Y], -20);
  struct scaled square = fit_scaled_short(scaled_add(scaled_mul(x, x), scaled_mul(y, y)));
  if (square.mantissa <= 0) {
    return;
  }
  struct scaled reach = fit_scaled_sqrt(square);
  int32_t ux_q20 = fit_scaled_to_fixed(scaled_div(x, reach), 20);
  int32_t uy_q20 = fit_scaled_to_fixed(scaled_div(y, reach), 20);
  struct scaled sure =
      scaled_mul(variance_of(equations, SPAN_X, ux_q20, SPAN_Y, uy_q20), scales->variance);
  sure.mantissa *= FIT_SHAPES_PENALTY;
  if (scaled_sub(square, fit_scaled_short(sure)).mantissa <= 0) {
    return;
  }
  result->shape = FIT_SHAPE_ELONGATED;
  int32_t sign = ux_q20 < 0 ? -1 : 1;
  result->length_mm = 2.0f * product_of(scales->pitch, reach);
  result->along_x = fit_float(sign * ux_q20, -20);
  result->along_y = fit_float(sign * uy_q20, -20);
  result->angle_sd_rad =
      sd_of(fit_grid_reciprocal(reach), variance_of(equations, SPAN_X, -uy_q20, SPAN_Y, ux_q20),
            scales->variance);
}

static NOINLINE void put_one(const struct problem *problem,
                             const struct fit_shapes_equations *equations, const int32_t *at,
                             const struct scales *scales, struct fit_shapes_result *result) {
  const struct fit_shapes_pad *pad = problem->pad;
  result->x_mm[0] = mm(pad, pad->origin_x_q20 + at[PLACE_X]);
  result->y_mm[0] = mm(pad, pad->origin_y_q20 + at[PLACE_Y]);
  result->force_N[0] = product_of(scales->unit, fit_scaled_from(at[AMPLITUDE], -20));
  struct scaled place = scaled_add(variance_of(equations, PLACE_X, ONE_Q20, PLACE_Y, 0),
                                   variance_of(equations, PLACE_Y, ONE_Q20, PLACE_X, 0));
  result->location_sd_mm[0] = sd_of(scales->pitch, place, scales->variance);
  result->force_sd_N[0] =
      sd_of(scales->unit, variance_of(equations, AMPLITUDE, ONE_Q20, FAR, 0), scales->variance);
}

int fit_shapes_best(const int32_t *chi_square_q8, const int32_t *two) {
  int32_t round = chi_square_q8[ROUND], line = chi_square_q8[LONG], pair = chi_square_q8[TWO];
  /* Residuals larger than their errors are no more than that: the penalty is in their unit. */
  int32_t unit_q8 = port_divide(pair, FREEDOM);
  int32_t pair_q8 = FIT_SHAPES_PAIR_PENALTY * (unit_q8 > 1 << 8 ? unit_q8 : 1 << 8);
  int32_t x_q10 = two[SPAN_X] >> 10, y_q10 = two[SPAN_Y] >> 10;
  bool apart = x_q10 * x_q10 + y_q10 * y_q10 > SEPARATION_HALF_Q10 * SEPARATION_HALF_Q10;
  if (apart && pair < (round < line ? round : line) - pair_q8) {
    return TWO;
  }
  return line < round - (FIT_SHAPES_PENALTY << 8) ? LONG : ROUND;
}

/* What a pair that explains the readings nearly as well would have as its middle of the forces adds
 * to the error of a long contact's place. */
static void doubt_place(const struct scales *scales, const int32_t *line, const int32_t *pair,
                        struct fit_shapes_result *result) {
  int32_t balance = pair[BALANCE] >> 6;
  int32_t dx_q20 = pair[PLACE_X] + fixed_mul_16(pair[SPAN_X], balance) * 4 - line[PLACE_X];
  int32_t dy_q20 = pair[PLACE_Y] + fixed_mul_16(pair[SPAN_Y], balance) * 4 - line[PLACE_Y];
  struct scaled dx = fit_scaled_from(dx_q20, -20), dy = fit_scaled_from(dy_q20, -20);
  struct scaled off = fit_scaled_sqrt(scaled_add(scaled_mul(dx, dx), scaled_mul(dy, dy)));
  result->location_sd_mm[0] =
      fit_quadrature(result->location_sd_mm[0], 1.0f, product_of(scales->pitch, off), 1.0f);
}

void fit_shapes_conclude(const struct problem *problem, int best, const int32_t *chi_square_q8,
                         const struct fit_shapes_state *state, struct fit_shapes_result *result) {
  const struct fit_shapes_equations *equations = &problem->pad->room.equations[best];
  const struct fit_shapes_at *at = &state->at[best];
  const struct fit_shapes_pad *pad = problem->pad;
  struct scaled base = fit_scaled_from(problem->base_q22, -22);
  struct scaled variance = scaled_mul(base, base);
  const int freedom = best == TWO ? PAIR_FREEDOM : FREEDOM;
  if (chi_square_q8[best] > freedom << 8) {
    variance = scaled_mul(variance, fit_scaled_from(port_divide(chi_square_q8[best], freedom), -8));
  }
  struct scaled unit = fit_grid_scaled(pad->force_unit_N);
  unit.exponent += 18 - problem->readings.shift;
  const struct scales scales = {unit, fit_scaled_short(variance), fit_grid_scaled(pad->pitch_mm)};
  if (best == TWO) {
    result->shape = FIT_SHAPE_TWO;
    put_two(problem, equations, at->value, &scales, result);
    return;
  }
  result->shape = FIT_SHAPE_ROUND;
  put_one(problem, equations, at->value, &scales, result);
  if (best == LONG) {
    put_line(equations, at->value, &scales, result);
    if (chi_square_q8[TWO] < chi_square_q8[LONG] + (FIT_SHAPES_PENALTY << 8)) {
      doubt_place(&scales, at->value, state->at[TWO].value, result);
    }
  }
}
