/* Which model it is, and what follows for places, forces and directions. */
#include "fit/fit_grid_solve.h"
#include "fit/fit_math.h"
#include "fit/fit_shapes_parts.h"

#include <math.h>

#define LINE_SURE 8               /* variances: a line whose square is less is a pull */
#define SEPARATION_HALF_Q10 256   /* of half a pitch: nearer pairs are long contacts */
#define BESIDE_Q20 (1 << 19)      /* half a pitch */
#define SQUARE 3                  /* half a square's side, squared, over its spread */
#define LEAST_SPREAD_CHI_SQUARE 8 /* no contact has that */
#define LONGEST_HALF_Q10 1408     /* of 11/4 pitches: a longer line is rarer than a pair */

/* Variance of a sum of two unknowns times these, each at most some pitches or units of the
 * readings. */
static NOINLINE struct scaled variance_of(const struct fit_shapes_equations *equations, int first, int32_t a_q20,
                                          int second, int32_t b_q20) {
  const int32_t(*matrix)[UNKNOWNS] = equations->matrix;
  int32_t w_q10[UNKNOWNS], sum_q13 = 0;
  int32_t q = equations->q[first] > equations->q[second] ? equations->q[first] : equations->q[second];
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

static float mm(const struct fit_shapes_pad *pad, int32_t place_q20) {
  return fit_float(fixed_mul_q26(place_q20 * 8, pad->pitch_q22_mm), -19);
}

static float product_of(struct scaled a, struct scaled b) {
  return fit_scaled_float(scaled_mul(fit_scaled_short(a), fit_scaled_short(b)));
}

/* unit: N of amplitude 1. variance: of a reading of weight 1. */
struct scales {
  struct scaled unit, variance, pitch;
};

static float sd_of(struct scaled scale, struct scaled form, struct scaled variance) {
  return product_of(scale, fit_scaled_sqrt(scaled_mul(fit_scaled_short(form), variance)));
}

static NOINLINE void put_two(const struct fit_shapes_pad *pad, const struct fit_shapes_equations *equations,
                             const int32_t *at, const struct scales *scales, struct fit_shapes_result *result) {
  for (int c = 0; c < 2; c++) {
    int32_t sign = (c == 0) == (at[BALANCE] >= 0) ? 1 : -1;
    int32_t share_q20 = (ONE_Q20 + sign * at[BALANCE]) / 2;
    result->x_mm[c] = mm(pad, pad->origin_x_q20 + at[PLACE_X] + sign * at[SPAN_X]);
    result->y_mm[c] = mm(pad, pad->origin_y_q20 + at[PLACE_Y] + sign * at[SPAN_Y]);
    result->force_N[c] =
        product_of(scales->unit, scaled_mul(fit_scaled_from(at[AMPLITUDE], -20), fit_scaled_from(share_q20, -20)));
    struct scaled place = scaled_add(variance_of(equations, PLACE_X, ONE_Q20, SPAN_X, sign * ONE_Q20),
                                     variance_of(equations, PLACE_Y, ONE_Q20, SPAN_Y, sign * ONE_Q20));
    result->location_sd_mm[c] = sd_of(scales->pitch, place, scales->variance);
    struct scaled force = variance_of(equations, AMPLITUDE, share_q20, BALANCE, sign * (at[AMPLITUDE] >> 1));
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
  struct scaled sure = scaled_mul(variance_of(equations, SPAN_X, ux_q20, SPAN_Y, uy_q20), scales->variance);
  sure.mantissa *= LINE_SURE;
  if (scaled_sub(square, fit_scaled_short(sure)).mantissa <= 0) {
    return;
  }
  result->shape = FIT_SHAPE_ELONGATED;
  int32_t sign = ux_q20 < 0 ? -1 : 1;
  result->length_mm = 2.0f * product_of(scales->pitch, reach);
  result->along_x = fit_float(sign * ux_q20, -20);
  result->along_y = fit_float(sign * uy_q20, -20);
  result->angle_sd_rad =
      sd_of(fit_grid_reciprocal(reach), variance_of(equations, SPAN_X, -uy_q20, SPAN_Y, ux_q20), scales->variance);
}

static NOINLINE void put_one(const struct fit_shapes_pad *pad, const struct fit_shapes_equations *equations,
                             const int32_t *at, const struct scales *scales, struct fit_shapes_result *result) {
  result->x_mm[0] = mm(pad, pad->origin_x_q20 + at[PLACE_X]);
  result->y_mm[0] = mm(pad, pad->origin_y_q20 + at[PLACE_Y]);
  result->force_N[0] = product_of(scales->unit, fit_scaled_from(at[AMPLITUDE], -20));
  struct scaled place = scaled_add(variance_of(equations, PLACE_X, ONE_Q20, PLACE_Y, 0),
                                   variance_of(equations, PLACE_Y, ONE_Q20, PLACE_X, 0));
  result->location_sd_mm[0] = sd_of(scales->pitch, place, scales->variance);
  result->force_sd_N[0] = sd_of(scales->unit, variance_of(equations, AMPLITUDE, ONE_Q20, FAR, 0), scales->variance);
}

/* More unknowns must make the sum of chi^2 and FIT_SHAPES_ERRORS less by a quarter. */
static bool explains_more(int32_t chi_square_q8, int32_t than_q8) {
  than_q8 += FIT_SHAPES_ERRORS << 8;
  return than_q8 - (than_q8 >> 2) > chi_square_q8 + (FIT_SHAPES_ERRORS << 8);
}

static int32_t span_square_q20(const struct fit_shapes_at *at) {
  int32_t x_q10 = at->value[SPAN_X] >> 10, y_q10 = at->value[SPAN_Y] >> 10;
  return x_q10 * x_q10 + y_q10 * y_q10;
}

/* Where the line is long, the pair may leave a little more. */
static bool explains_as_well(int32_t chi_square_q8, int32_t than_q8) {
  return chi_square_q8 - than_q8 < (than_q8 + (FIT_SHAPES_ERRORS << 8)) >> 3;
}

/* Two contacts are apart and do not overlap, and both are on the array or hardly beside it. A pair
 * that is otherwise explains a wide contact, or what the models of a pull are off by. Of squares,
 * discs (4) and balls (5), squares of the same spread overlap last. */
static bool can_be_two(const struct fit_shapes_at *pair) {
  const int32_t *at = pair->value, square_q20 = span_square_q20(pair);
  uint32_t reach_x = fixed_size(at[PLACE_X]) + fixed_size(at[SPAN_X]);
  uint32_t reach_y = fixed_size(at[PLACE_Y]) + fixed_size(at[SPAN_Y]);
  return square_q20 > SEPARATION_HALF_Q10 * SEPARATION_HALF_Q10 && square_q20 > SQUARE * at[SPREAD] &&
         reach_x < COLUMNS / 2 * ONE_Q20 + BESIDE_Q20 && reach_y < ROWS / 2 * ONE_Q20 + BESIDE_Q20;
}

int fit_shapes_best(const struct fit_shapes_pad *pad, const int32_t *chi_square_q8, const struct fit_shapes_at *at) {
  int32_t round = chi_square_q8[ROUND], line = chi_square_q8[LONG], pair = chi_square_q8[TWO];
  bool is_longest = span_square_q20(&at[LONG]) > LONGEST_HALF_Q10 * LONGEST_HALF_Q10;
  /* A point's spread is 0, and the least is far from that. */
  bool is_narrow = fit_shapes_is_narrowest(pad, at[TWO].value[SPREAD]);
  int32_t doubted = pair + (is_narrow ? LEAST_SPREAD_CHI_SQUARE << 8 : 0);
  bool is_no_line = is_longest ? explains_as_well(pair, line) : explains_more(doubted, line);
  if (can_be_two(&at[TWO]) && explains_more(doubted, round) && is_no_line) {
    return TWO;
  }
  return explains_more(line, round) ? LONG : ROUND;
}

/* The middle of a model's forces. */
static void put_middle(int model, const int32_t *at, int32_t middle_q20[2]) {
  int32_t balance_q14 = model == TWO ? at[BALANCE] >> 6 : 0;
  middle_q20[0] = at[PLACE_X] + fixed_mul_16(at[SPAN_X], balance_q14) * 4;
  middle_q20[1] = at[PLACE_Y] + fixed_mul_16(at[SPAN_Y], balance_q14) * 4;
}

/* The other models may be right: how far their middles are, by how likely they are, adds to the
 * errors of the places. Where chi^2 is above FIT_SHAPES_ERRORS none of the models may be, and the
 * errors grow with it. */
static void doubt_places(const struct fit_shapes_pad *pad, int best, const int32_t *chi_square_q8,
                         const struct fit_shapes_state *state, struct fit_shapes_result *result) {
  float total = 1.0f, square_mm2[2] = {0.0f, 0.0f};
  for (int m = 0; m < MODELS; m++) {
    int32_t middle_q20[2];
    if (m == best) {
      continue;
    }
    float likely = fit_float(chi_square_q8[best] + (FIT_SHAPES_ERRORS << 8), 0) /
                   fit_float(chi_square_q8[m] + (FIT_SHAPES_ERRORS << 8), 0);
    /* Where the scale of the errors is unknown, the likelihood of n readings falls as chi^2 to the power n / 2. For
     * fifteen that is the eighth, nearly. */
    likely *= likely;
    likely *= likely;
    likely *= likely;
    put_middle(m, state->at[m].value, middle_q20);
    total += likely;
    for (int c = 0; c < (best == TWO ? 2 : 1); c++) {
      float x_mm = mm(pad, pad->origin_x_q20 + middle_q20[0]) - result->x_mm[c];
      float y_mm = mm(pad, pad->origin_y_q20 + middle_q20[1]) - result->y_mm[c];
      square_mm2[c] += likely * (x_mm * x_mm + y_mm * y_mm);
    }
  }
  const float usual = (float)(FIT_SHAPES_ERRORS << 8), found = (float)chi_square_q8[best];
  const float times = found > usual ? found / usual : 1.0f;
  for (int c = 0; c < 2; c++) {
    result->location_sd_mm[c] = fit_quadrature(times, result->location_sd_mm[c], times, sqrtf(square_mm2[c] / total));
  }
}

void fit_shapes_conclude(const struct fit_shapes_pad *pad, int best, const int32_t *chi_square_q8,
                         const struct fit_shapes_state *state, struct fit_shapes_result *result) {
  const struct fit_shapes_equations *equations = &pad->room.equations[best];
  const struct fit_shapes_at *at = &state->at[best];
  struct scaled base = fit_scaled_from(pad->room.frame.base_q22, -22);
  struct scaled variance = scaled_mul(base, base);
  if (chi_square_q8[best] > FREEDOM << 8) {
    variance = scaled_mul(variance, fit_scaled_from(port_divide(chi_square_q8[best], FREEDOM), -8));
  }
  struct scaled unit = fit_grid_scaled(pad->force_unit_N);
  unit.exponent += 18 - pad->room.frame.shift;
  const struct scales scales = {unit, fit_scaled_short(variance), fit_grid_scaled(pad->pitch_mm)};
  if (best == TWO) {
    result->shape = FIT_SHAPE_TWO;
    put_two(pad, equations, at->value, &scales, result);
  } else {
    result->shape = FIT_SHAPE_ROUND;
    put_one(pad, equations, at->value, &scales, result);
  }
  if (best == LONG) {
    put_line(equations, at->value, &scales, result);
  }
  doubt_places(pad, best, chi_square_q8, state, result);
}
