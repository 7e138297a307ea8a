/* Chooses the model, and computes locations, forces and directions from it. */
#include "fit/fit_grid_solve.h"
#include "fit/fit_math.h"
#include "fit/fit_shapes_parts.h"

#include <math.h>

#define TANGENTIAL_SDS 2.83f      /* standard deviations: less is round */
#define EDGE_SDS 0.5f             /* standard deviations by which a line is longer than the shortest edge */
#define TANGENTIAL_MODEL_SD 0.04f /* pitches^2 per Q / F: variance along a line by the error of the tangential model */
#define THIRD_Q16 21845
#define VARIANCE_MIN_Q20 (ONE_Q20 / 24) /* of a line of 0.7 pitches: shorter ones are no edges */
#define SEPARATION_HALF_Q10 256         /* of half a pitch: nearer pairs are long contacts */
#define OUTSIDE_Q20 (1 << 19)           /* half a pitch */
#define SQUARE 3                        /* half a square's side, squared, over its spread */
#define BALL 20                         /* radius of a ball whose contact's is half of it, squared, over its spread */
#define LONGEST_HALF_Q10 1408           /* of 11/4 pitches: a longer line is rarer than a pair of balls */

/* Variance of a sum of the unknowns times these, each at most some pitches or units of the readings. */
static NOINLINE struct scaled variance_of_sum(const struct fit_shapes_equations *equations, const int32_t *by_q20) {
  const int32_t(*matrix)[UNKNOWNS] = equations->matrix;
  int32_t w_q10[UNKNOWNS], sum_q13 = 0, q = INT8_MIN;
  int first = 0;
  while (by_q20[first] == 0) {
    first++;
  }
  for (int j = first; j < equations->count; j++) {
    q = by_q20[j] != 0 && equations->q[j] > q ? equations->q[j] : q;
  }
  for (int j = first; j < equations->count; j++) {
    int32_t w = by_q20[j] != 0 ? shifted(by_q20[j], equations->q[j] - q - 10) : 0;
    for (int i = first; i < j; i++) {
      w -= (matrix[j][i] * w_q10[i]) >> 14;
    }
    w = fixed_clamp(w * (1 << equations->half[j]), -INT16_MAX, INT16_MAX);
    w_q10[j] = w;
    sum_q13 += (((w * w) >> 13) * (equations->inverse_q14[j] >> 4)) >> 4;
  }
  return fit_scaled_from(sum_q13, 2 * q - 30 - 13);
}

static NOINLINE struct scaled variance_of(const struct fit_shapes_equations *equations, int first, int32_t a_q20, int second,
                                          int32_t b_q20) {
  int32_t by_q20[UNKNOWNS] = {0};
  by_q20[first] = a_q20;
  by_q20[second] += b_q20;
  return variance_of_sum(equations, by_q20);
}

static float mm(const struct fit_shapes_pad *pad, int32_t place_q20) {
  return fit_float(fixed_mul_q26(place_q20 * 8, pad->pitch_q22_mm), -19);
}

static float product_of(struct scaled a, struct scaled b) { return fit_scaled_float(scaled_mul(fit_scaled_short(a), fit_scaled_short(b))); }

/* unit: N of amplitude 1. variance: of a reading of weight 1. */
struct scales {
  struct scaled unit, variance, pitch;
};

static NOINLINE float sd_of(struct scaled scale, struct scaled form, struct scaled variance) {
  return product_of(scale, fit_scaled_sqrt(scaled_mul(fit_scaled_short(form), variance)));
}

static NOINLINE void put_two(const struct fit_shapes_pad *pad, const struct fit_shapes_equations *equations, const int32_t *at,
                             const struct scales *scales, struct fit_shapes_result *result) {
  for (int c = 0; c < 2; c++) {
    int32_t sign = (c == 0) == (at[BALANCE] >= 0) ? 1 : -1;
    int32_t share_q20 = (ONE_Q20 + sign * at[BALANCE]) / 2;
    result->x_mm[c] = mm(pad, pad->origin_x_q20 + at[LOCATION_X] + sign * at[SPAN_X]);
    result->y_mm[c] = mm(pad, pad->origin_y_q20 + at[LOCATION_Y] + sign * at[SPAN_Y]);
    result->force_N[c] = product_of(scales->unit, scaled_mul(fit_scaled_from(at[AMPLITUDE], -20), fit_scaled_from(share_q20, -20)));
    struct scaled place = scaled_add(variance_of(equations, LOCATION_X, ONE_Q20, SPAN_X, sign * ONE_Q20),
                                     variance_of(equations, LOCATION_Y, ONE_Q20, SPAN_Y, sign * ONE_Q20));
    result->location_sd_mm[c] = sd_of(scales->pitch, place, scales->variance);
    struct scaled force = variance_of(equations, AMPLITUDE, share_q20, BALANCE, sign * (at[AMPLITUDE] >> 1));
    result->force_sd_N[c] = sd_of(scales->unit, force, scales->variance);
  }
}

/* Standard deviation of two consecutive unknowns together. */
static NOINLINE float sd_of_both(const struct fit_shapes_equations *equations, int first, const struct scales *scales) {
  struct scaled both =
      scaled_add(variance_of(equations, first, ONE_Q20, first + 1, 0), variance_of(equations, first + 1, ONE_Q20, first, 0));
  return sd_of(ONE, both, scales->variance);
}

/* Along an edge the contact's variance is larger than across, by that of a line. */
static NOINLINE bool is_edge(const struct fit_shapes_equations *equations, const struct fit_shapes_at *at, const struct scales *scales,
                             float tangential_sd) {
  int32_t more_q20 = fixed_mul_16(fit_shapes_span_square(at->value), THIRD_Q16) - at->value[SPREAD];
  int32_t by_q20[UNKNOWNS] = {[SPREAD] = -ONE_Q20};
  by_q20[SPAN_X] = 2 * fixed_mul_16(at->value[SPAN_X], THIRD_Q16);
  by_q20[SPAN_Y] = 2 * fixed_mul_16(at->value[SPAN_Y], THIRD_Q16);
  float sd = sd_of(ONE, variance_of_sum(equations, by_q20), scales->variance);
  return fit_float(more_q20 - VARIANCE_MIN_Q20, -20) > EDGE_SDS * fit_quadrature(1.0f, sd, 1.0f, tangential_sd);
}

static NOINLINE void put_edge(const struct fit_shapes_equations *equations, const int32_t *at, const struct scales *scales,
                              float tangential_sd, struct fit_shapes_result *result) {
  float x = fit_float(at[SPAN_X], -20), y = fit_float(at[SPAN_Y], -20);
  float reach = fit_quadrature(1.0f, fabsf(x), 1.0f, fabsf(y)), per = 1.0f / reach, along = x < 0.0f ? -per : per;
  result->length_mm = 2.0f * fit_scaled_float(scales->pitch) * reach;
  result->along_x = along * x;
  result->along_y = along * y;
  struct scaled across = variance_of(equations, SPAN_X, fit_fixed(-result->along_y, 20), SPAN_Y, fit_fixed(result->along_x, 20));
  result->angle_sd_rad = fit_quadrature(per, sd_of(ONE, across, scales->variance), 3.0f * per * per, tangential_sd);
}

/* For one contact: whether it is long, or else under a tangential force. */
static NOINLINE void put_shape(const struct fit_shapes_equations *equations, const struct fit_shapes_at *at, bool is_long,
                               const struct scales *scales, struct fit_shapes_result *result) {
  const int tangential = equations->tangential;
  float x = fit_float(at->value[tangential], -20), y = fit_float(at->value[tangential + 1], -20);
  float size = fit_quadrature(1.0f, fabsf(x), 1.0f, fabsf(y)), unit_N = fit_scaled_float(scales->unit);
  float tangential_sd = TANGENTIAL_MODEL_SD * size / fit_float(at->value[AMPLITUDE], -20);
  if (is_long && is_edge(equations, at, scales, tangential_sd)) {
    result->shape = FIT_SHAPE_ELONGATED;
    put_edge(equations, at->value, scales, tangential_sd, result);
  } else if (size > TANGENTIAL_SDS * sd_of_both(equations, tangential, scales)) {
    result->shape = FIT_SHAPE_TANGENTIAL;
  } else {
    return;
  }
  result->qx_N = unit_N * x;
  result->qy_N = unit_N * y;
}

static NOINLINE void put_one(const struct fit_shapes_pad *pad, const struct fit_shapes_equations *equations, const int32_t *at,
                             const struct scales *scales, struct fit_shapes_result *result) {
  result->x_mm[0] = mm(pad, pad->origin_x_q20 + at[LOCATION_X]);
  result->y_mm[0] = mm(pad, pad->origin_y_q20 + at[LOCATION_Y]);
  result->force_N[0] = product_of(scales->unit, fit_scaled_from(at[AMPLITUDE], -20));
  result->location_sd_mm[0] = fit_scaled_float(scales->pitch) * sd_of_both(equations, LOCATION_X, scales);
  result->force_sd_N[0] = sd_of(scales->unit, variance_of(equations, AMPLITUDE, ONE_Q20, FAR, 0), scales->variance);
}

/* More unknowns must make the sum of chi^2 and FIT_SHAPES_ERRORS less by a quarter, or by a half. */
enum { BY_A_HALF = 1, BY_A_QUARTER = 2 };
static bool explains_more(int32_t chi_square_q8, int32_t than_q8, int by) {
  than_q8 += FIT_SHAPES_ERRORS << 8;
  return than_q8 - (than_q8 >> by) > chi_square_q8 + (FIT_SHAPES_ERRORS << 8);
}

/* Where the line is long, the pair may leave a little more. */
static bool explains_as_well(int32_t chi_square_q8, int32_t than_q8) {
  return chi_square_q8 - than_q8 < (than_q8 + (FIT_SHAPES_ERRORS << 8)) >> 3;
}

/* Two contacts are apart, do not overlap, and are at most OUTSIDE beyond the array. Other pairs explain a wide contact, or the error of the
 * tangential model. Of squares, discs (4) and balls (5), squares of the same spread overlap last. */
static bool can_be_two(const struct fit_shapes_at *pair) {
  const int32_t *at = pair->value, square_q20 = fit_shapes_span_square(at);
  int32_t reach_x = (int32_t)(fixed_magnitude(at[LOCATION_X] - MIDDLE_OF(COLUMNS)) + fixed_magnitude(at[SPAN_X]));
  int32_t reach_y = (int32_t)(fixed_magnitude(at[LOCATION_Y] - MIDDLE_OF(ROWS)) + fixed_magnitude(at[SPAN_Y]));
  return square_q20 > SEPARATION_HALF_Q10 * SEPARATION_HALF_Q10 && square_q20 > SQUARE * at[SPREAD] &&
         reach_x < (COLUMNS - 1) * (ONE_Q20 / 2) + OUTSIDE_Q20 && reach_y < (ROWS - 1) * (ONE_Q20 / 2) + OUTSIDE_Q20;
}

int fit_shapes_best(const int32_t *chi_square_q8, const struct fit_shapes_at *at) {
  int32_t round = chi_square_q8[ROUND], line = chi_square_q8[LONG], pair = chi_square_q8[TWO];
  bool is_likely = fit_shapes_span_square(at[LONG].value) > LONGEST_HALF_Q10 * LONGEST_HALF_Q10 &&
                   fit_shapes_span_square(at[TWO].value) > BALL * at[TWO].value[SPREAD];
  bool is_no_line = is_likely ? explains_as_well(pair, line) : explains_more(pair, line, BY_A_QUARTER);
  if (can_be_two(&at[TWO]) && explains_more(pair, round, BY_A_QUARTER) && is_no_line) {
    return TWO;
  }
  return explains_more(line, round, BY_A_QUARTER) ? LONG : ROUND;
}

/* The middle of a model's forces. */
static void find_middle(int model, const int32_t *at, int32_t middle_q20[2]) {
  int32_t balance_q14 = model == TWO ? at[BALANCE] >> 6 : 0;
  middle_q20[0] = at[LOCATION_X] + fixed_mul_16(at[SPAN_X], balance_q14) * 4;
  middle_q20[1] = at[LOCATION_Y] + fixed_mul_16(at[SPAN_Y], balance_q14) * 4;
}

/* The other models may be right: adds the distances of their middles, by their likelihoods. Above FIT_SHAPES_ERRORS none of the models may
 * be right, and the standard deviations grow with chi^2. */
static void add_model_uncertainty(const struct fit_shapes_pad *pad, int best, const int32_t *chi_square_q8,
                                  const struct fit_shapes_state *state, struct fit_shapes_result *result) {
  float total = 1.0f, square_mm2[2] = {0.0f, 0.0f};
  for (int m = 0; m < MODELS; m++) {
    int32_t middle_q20[2];
    if (m == best) {
      continue;
    }
    float likely = fit_float(chi_square_q8[best] + (FIT_SHAPES_ERRORS << 8), 0) / fit_float(chi_square_q8[m] + (FIT_SHAPES_ERRORS << 8), 0);
    /* Where the scale of the errors is unknown, the likelihood of n readings falls as chi^2 to the power n / 2. For
     * fifteen that is the eighth, nearly. */
    likely *= likely;
    likely *= likely;
    likely *= likely;
    find_middle(m, state->at[m].value, middle_q20);
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

void fit_shapes_conclude(const struct fit_shapes_pad *pad, int best, const int32_t *chi_square_q8, const struct fit_shapes_state *state,
                         struct fit_shapes_result *result) {
  const struct fit_shapes_equations *equations = &pad->work.equations[best];
  const struct fit_shapes_at *at = &state->at[best];
  struct scaled base = fit_scaled_from(pad->work.frame.base_q22, -22);
  struct scaled variance = scaled_mul(base, base);
  if (chi_square_q8[best] > DEGREES_OF_FREEDOM << 8) {
    variance = scaled_mul(variance, fit_scaled_from(port_divide(chi_square_q8[best], DEGREES_OF_FREEDOM), -8));
  }
  struct scaled unit = fit_grid_scaled(pad->force_unit_N);
  unit.exponent += 18 - pad->work.frame.shift;
  const struct scales scales = {unit, fit_scaled_short(variance), fit_grid_scaled(pad->pitch_mm)};
  if (best == TWO) {
    result->shape = FIT_SHAPE_TWO;
    put_two(pad, equations, at->value, &scales, result);
  } else {
    result->shape = FIT_SHAPE_ROUND;
    put_one(pad, equations, at->value, &scales, result);
    bool is_long = best == LONG && explains_more(chi_square_q8[LONG], chi_square_q8[ROUND], BY_A_HALF);
    put_shape(equations, at, is_long, &scales, result);
  }
  add_model_uncertainty(pad, best, chi_square_q8, state, result);
}
