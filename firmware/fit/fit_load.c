#include "fit/fit_load.h"

#include "common/contact_flags.h"
#include "fit/fit_grid_parts.h"
#include "fit/fit_grid_solve.h"
#include "fit/fit_limits.h"
#include "fit/fit_math.h"

#include <string.h>

/* The model of the residual, lengths in sigma, parts of p0, d = (dx, dy) from the contact to the
 * sensor, g(v) = exp(-d' d / (2 v)):
 *   residual = g(1) (a + b dx + c dy + e d' d) + far g(FAR) + (qx dx + qy dy) g(PULL)
 * The first four are what a step of the fit would still take. `far` is what the rubber has around a
 * contact, heavier tails or a dip, and is 0 +- FAR_SD. The last two are the trace of a load: of the
 * terms of a layer's profile (common/pad_profile.h) the narrow ones are such steps.
 */
enum { HEIGHT, ALONG_X, ALONG_Y, WIDTH, FAR, PULL_X, PULL_Y, UNKNOWNS };

#define FAR_Q16 10486 /* 1 / 6.25: the variance of the dip that the recordings of real pads show */
#define PULL_SHIFT 2  /* 1 / 4: the layer's wide terms under the contacts of the twin */
#define FAR_PER_SD 100 /* FAR_SD 0.01 of p0: half of what layers and cast pads differ by */
/* Of the model's own error, MODEL_SHARE_SHIFT: a half of model_sd is independent from sensor to
 * sensor. The other unknowns take the rest. */
#define MODEL_SHARE_SHIFT 1
/* A trace is one whose square is beyond so many times the sum of its two variances, which chance
 * makes in one press of seven. */
#define SURE 2

/* How far the location moves, over the coefficients of the trace: 0.38 pitch, or 0.58 sigma if that
 * is more, for each unit of Q / F, which makes a trace of 0.068. Medians over truth_fit's objects
 * on 6 to 15 mm of rubber, seed 1. */
#define SHIFT_PER_PITCH 5.6f
#define SHIFT_PER_SIGMA 8.5f
/* Square of the largest coefficient that counts: Q / F of 1, which is what friction holds. */
#define TRACE_MOST ((struct scaled){19389, -22})

#define PIVOT_LEAST (1 << 18) /* 2^-12: an unknown with less is not told from others */
#define X_MAX_Q12 (1 << 15)   /* 8 sigma */
#define READING_BITS 15

#define RESIDUAL UNKNOWNS /* its column */
#define WORDS (UNKNOWNS + 1)

/* For the rectangle of the build, and other layouts that are not much larger. */
#define SENSORS_MAX (NODES > 24 ? FT_MAX_SENSORS : 24)

struct rows {
  int count;
  /* By their weights; Q30 before they are normalised. */
  int32_t row[SENSORS_MAX][WORDS];
  uint32_t size[WORDS]; /* its highest bit is that of the column's largest */
  int8_t q[WORDS];      /* once normalised a value is its integer 2^-q */
  struct scaled base;   /* error of a reading of weight 1, of p0 */
};

/* 2^-z within 0.3 %. */
FIXED_INLINE int32_t exp2_rough(uint32_t z_q22) {
  uint32_t whole = z_q22 >> 22;
  return whole > 29 ? 0 : fit_exp2_table[(z_q22 >> 14) & 255] >> whole;
}

#define DIP_PER_MAX_Q26 (1 << 29) /* 8 */
#define Z_MAX_Q22 (1u << 27)      /* 6.7 sigma away */

struct place {
  int32_t x_q16, y_q16; /* from the array's first sensor, pitches */
  int32_t per_sigma_q12;
  int32_t dip_q18, dip_per_q26; /* its share, and sigma^2 over its sd^2 */
};

static void set_place(const struct fit_array *array, const struct fit_settings *settings,
                      const struct fit_result *result, struct place *place) {
  const float per_pitch = 1.0f / array->pitch_mm;
  place->x_q16 = fit_apart_q16(result->x_mm * per_pitch - array->x[0]);
  place->y_q16 = fit_apart_q16(result->y_mm * per_pitch - array->y[0]);
  int32_t sigma_q16 = fit_fixed(result->sigma_mm * per_pitch, 16);
  place->per_sigma_q12 = port_divide(1 << 28, sigma_q16 < 1 << 13 ? 1 << 13 : sigma_q16);
  place->dip_q18 = place->dip_per_q26 = 0;
  if (fit_has_dip(settings)) {
    struct scaled ratio =
        scaled_div(fit_grid_scaled(result->sigma_mm), fit_grid_scaled(settings->dip_sd_mm));
    place->dip_q18 = fit_fixed(settings->dip_share, 18);
    place->dip_per_q26 =
        fixed_clamp(fit_scaled_to_fixed(scaled_mul(ratio, ratio), 26), 0, DIP_PER_MAX_Q26);
  }
}

FIXED_INLINE int32_t in_sigmas(int32_t off_q16, int32_t per_sigma_q12) {
  return fixed_clamp(fixed_mul_16(off_q16, per_sigma_q12), -X_MAX_Q12 + 1, X_MAX_Q12 - 1);
}

/* One sensor's row; reading_q18: of p0. */
static NOINLINE void set_row(const struct place *place, int32_t off_x_q16, int32_t off_y_q16,
                             int32_t reading_q18, int32_t weight_q12, int32_t *row,
                             uint32_t *size) {
  int32_t x = in_sigmas(off_x_q16, place->per_sigma_q12);
  int32_t y = in_sigmas(off_y_q16, place->per_sigma_q12);
  int32_t square_q20 = (int32_t)(((uint32_t)(x * x) + (uint32_t)(y * y)) >> 4);
  uint32_t z = (uint32_t)fixed_mul_q30(square_q20 * 4, 774541002); /* log2(e) / 2, Q22 */
  int32_t e_q18 = exp2_negative(z) >> 12;
  int32_t pull_q17 = exp2_rough(z >> PULL_SHIFT) >> 13;
  if (place->dip_q18 != 0) {
    int32_t z_dip = fixed_mul_q26((int32_t)(z < Z_MAX_Q22 ? z : Z_MAX_Q22), place->dip_per_q26);
    reading_q18 += (place->dip_q18 * (exp2_rough((uint32_t)z_dip) >> 18)) >> 12;
  }
  int32_t residual_q18 = fixed_clamp(reading_q18 - e_q18, -(1 << 18), 1 << 18);
  row[HEIGHT] = e_q18 * weight_q12;
  row[ALONG_X] = ((e_q18 * x) >> 12) * weight_q12;
  row[ALONG_Y] = ((e_q18 * y) >> 12) * weight_q12;
  row[WIDTH] = ((e_q18 * (square_q20 >> 8)) >> 12) * weight_q12;
  row[FAR] = (exp2_rough((uint32_t)fixed_mul_16((int32_t)z, FAR_Q16)) >> 12) * weight_q12;
  row[PULL_X] = ((pull_q17 * x) >> 11) * weight_q12;
  row[PULL_Y] = ((pull_q17 * y) >> 11) * weight_q12;
  row[RESIDUAL] = residual_q18 * weight_q12;
  for (int u = 0; u < WORDS; u++) {
    size[u] |= fixed_size(row[u]);
  }
}

/* False: there is nothing to be seen in so few or such readings. */
static bool set_rows(const struct fit_array *array, const int32_t *pressure_Pa_q10,
                     const struct fit_settings *settings, const struct fit_result *result,
                     struct rows *rows) {
  int32_t largest = 0;
  int count = 0;
  for (int k = 0; k < array->sensor_count; k++) {
    if (result->used >> k & 1) {
      largest = pressure_Pa_q10[k] > largest ? pressure_Pa_q10[k] : largest;
      count++;
    }
  }
  if (count < FIT_LOAD_SENSORS || count > SENSORS_MAX || largest <= 0) {
    return false;
  }
  rows->count = count;
  memset(rows->size, 0, sizeof rows->size);
  struct place place;
  set_place(array, settings, result, &place);
  int32_t shift = fixed_bits((uint32_t)largest) - READING_BITS;
  struct scaled per_p0 = fit_grid_reciprocal(fit_grid_scaled(result->p0_Pa));
  int32_t noise_q4 = fixed_clamp(shifted(settings->noise_Pa_q10, 4 - shift), 1, 1 << 18);
  int32_t model_q4 = (int32_t)((settings->model_sd_q16 * (uint32_t)shifted(largest, -shift)) >> 12);
  int32_t base_q4 =
      fixed_clamp(fixed_longer_leg(noise_q4, model_q4 >> MODEL_SHARE_SHIFT), 1, (1 << 18) - 1);
  rows->base = scaled_mul(fit_scaled_from(base_q4, shift - 14), per_p0);
  int n = 0;
  for (int k = 0; k < array->sensor_count; k++) {
    if (!(result->used >> k & 1)) {
      continue;
    }
    int32_t reading = fixed_clamp(shifted(pressure_Pa_q10[k], -shift), -INT16_MAX, INT16_MAX);
    int32_t gain_q4 =
        (int32_t)(((uint32_t)settings->gain_sd_q16[k] * fixed_size(reading)) >> 12);
    int32_t weight_q12 = port_divide(base_q4 << 12, fixed_longer_leg(base_q4, gain_q4));
    int32_t reading_q18 = shifted(reading * per_p0.mantissa, per_p0.exponent + shift - 10 + 18);
    set_row(&place, array->apart_x_q16[k] - place.x_q16, array->apart_y_q16[k] - place.y_q16,
            reading_q18, weight_q12, rows->row[n++], rows->size);
  }
  return true;
}

/* The lower half of the normal matrix, its diagonal 2^28 .. 2^30, and the right side. */
struct equations {
  int32_t matrix[UNKNOWNS][UNKNOWNS];
  int32_t right[UNKNOWNS];
  int32_t residual_square;
};

/* Brings a column to 13 bits, or so many that the sums hold, and returns the sum of its squares. */
static NOINLINE int32_t normalise(struct rows *rows, int u, int32_t prior_q30) {
  int32_t shift = fixed_bits(rows->size[u] | fixed_size(prior_q30)) - (rows->count > 16 ? 12 : 13);
  shift = shift < 1 ? 1 : shift;
  rows->q[u] = (int8_t)(30 - shift);
  int32_t half = 1 << (shift - 1), prior = prior_q30 >> shift;
  int32_t *value = &rows->row[0][u], *end = &rows->row[0][u] + rows->count * WORDS;
  int32_t own = prior * prior;
  do {
    int32_t now = (*value + half) >> shift;
    *value = now;
    own += now * now;
    value += WORDS;
  } while (value != end);
  return own;
}

_Static_assert(UNKNOWNS == 7, "every pair is in one of these");
#define TAKE_PRODUCTS(a)                                                                           \
  static NOINLINE void take_products_##a(const struct rows *rows, const int32_t *up,               \
                                         struct equations *equations) {                            \
    int32_t sums[4];                                                                               \
    const int32_t *row = rows->row[0];                                                             \
    fixed_sum_products(row, row + rows->count * WORDS, sums, WORDS, (a), ((a) + 1) % 7,            \
                       ((a) + 2) % 7, ((a) + 3) % 7);                                              \
    put_products((a), sums, up, equations);                                                        \
  }

static NOINLINE void put_products(int a, const int32_t *sums, const int32_t *up,
                                  struct equations *equations) {
  for (int k = 0, b = a; k < 3; k++) {
    b = b == UNKNOWNS - 1 ? 0 : b + 1;
    equations->matrix[a > b ? a : b][a > b ? b : a] = sums[k] * (1 << (up[a] + up[b]));
  }
  equations->right[a] = sums[3] * (1 << up[a]);
}

TAKE_PRODUCTS(0)
TAKE_PRODUCTS(1)
TAKE_PRODUCTS(2)
TAKE_PRODUCTS(3)
TAKE_PRODUCTS(4)
TAKE_PRODUCTS(5)
TAKE_PRODUCTS(6)

static void make_equations(struct rows *rows, struct equations *equations) {
  int32_t prior_q30 =
      fit_scaled_to_fixed(scaled_mul(rows->base, fit_scaled_from(FAR_PER_SD, 0)), 30);
  int32_t up[UNKNOWNS];
  for (int u = 0; u < UNKNOWNS; u++) {
    int32_t own = normalise(rows, u, u == FAR ? prior_q30 : 0);
    up[u] = own >> 30 ? 0 : (30 - fixed_bits((uint32_t)own | 1)) >> 1;
    equations->matrix[u][u] = own * (1 << (2 * up[u]));
    rows->q[u] = (int8_t)(rows->q[u] + up[u]);
  }
  equations->residual_square = normalise(rows, RESIDUAL, 0);
  take_products_0(rows, up, equations);
  take_products_1(rows, up, equations);
  take_products_2(rows, up, equations);
  take_products_3(rows, up, equations);
  take_products_4(rows, up, equations);
  take_products_5(rows, up, equations);
  take_products_6(rows, up, equations);
}

/* Takes from the unknowns after j what j explains, L D L^T with a power of two between the factors,
 * of 16 bits each; returns what it explains of the square of the residual. An unknown that is not
 * told from those before explains nothing more. */
static NOINLINE int32_t eliminate(struct equations *equations, int j) {
  int32_t pivot = equations->matrix[j][j];
  if (pivot < PIVOT_LEAST) {
    return 0;
  }
  int32_t half = pivot >> 30 ? 0 : (30 - fixed_bits((uint32_t)pivot)) >> 1;
  int32_t down = 15 - half, round = 1 << down >> 1;
  int32_t inverse_q14 = port_divide((1 << 29) - 1, (pivot * (1 << (2 * half))) >> 15);
  int32_t right = fixed_clamp((equations->right[j] + round) >> down, -(1 << 15), 1 << 15);
  int32_t right_over = (right * inverse_q14 + (1 << 14)) >> 15; /* Q14, as the next */
  int32_t over_pivot[UNKNOWNS];
  for (int i = j + 1; i < UNKNOWNS; i++) {
    int32_t *row = equations->matrix[i];
    int32_t element = fixed_clamp((row[j] + round) >> down, -(1 << 15), 1 << 15); /* Q15 */
    over_pivot[i] = (element * inverse_q14 + (1 << 14)) >> 15;
    for (int k = j + 1; k <= i; k++) {
      row[k] -= element * over_pivot[k] * 2;
    }
    equations->right[i] -= element * right_over * 2;
  }
  return right * right_over * 2;
}

/* The square of the trace's coefficients beyond what they are by chance, 0 where there is none. */
static NOINLINE struct scaled trace_of(struct rows *rows) {
  const struct scaled none = {0, 0};
  struct equations equations;
  make_equations(rows, &equations);
  int32_t left = equations.residual_square;
  for (int j = 0; j < UNKNOWNS; j++) {
    left -= eliminate(&equations, j);
  }
  if (equations.matrix[PULL_X][PULL_X] < PIVOT_LEAST ||
      equations.matrix[PULL_Y][PULL_Y] < PIVOT_LEAST) {
    return none;
  }
  struct scaled pivot_x = fit_scaled_from(equations.matrix[PULL_X][PULL_X], -2 * rows->q[PULL_X]);
  struct scaled pivot_y = fit_scaled_from(equations.matrix[PULL_Y][PULL_Y], -2 * rows->q[PULL_Y]);
  struct scaled both = fit_scaled_from(equations.matrix[PULL_Y][PULL_X],
                                       -rows->q[PULL_X] - rows->q[PULL_Y]);
  struct scaled right_x =
      fit_scaled_from(equations.right[PULL_X], -rows->q[PULL_X] - rows->q[RESIDUAL]);
  struct scaled right_y =
      fit_scaled_from(equations.right[PULL_Y], -rows->q[PULL_Y] - rows->q[RESIDUAL]);
  struct scaled per_x = fit_grid_reciprocal(pivot_x), per_y = fit_grid_reciprocal(pivot_y);
  struct scaled lean = scaled_mul(fit_scaled_short(both), per_x);
  struct scaled y = scaled_mul(right_y, per_y);
  struct scaled x = fit_scaled_short(
      scaled_sub(scaled_mul(right_x, per_x), fit_scaled_short(scaled_mul(lean, y))));
  struct scaled square = scaled_add(scaled_mul(x, x), scaled_mul(y, y));
  struct scaled form_x = scaled_add(per_x, scaled_mul(scaled_mul(lean, lean), per_y));
  struct scaled variance = scaled_mul(rows->base, rows->base);
  /* Residuals that the model does not explain count as errors of the readings. */
  int32_t freedom = rows->count - UNKNOWNS;
  struct scaled found = fit_scaled_from(port_divide(left > 0 ? left : 0, freedom < 1 ? 1 : freedom),
                                        -2 * rows->q[RESIDUAL]);
  variance = scaled_sub(found, variance).mantissa > 0 ? found : variance;
  struct scaled by_chance = scaled_mul(fit_scaled_short(variance), scaled_add(form_x, per_y));
  by_chance = fit_scaled_short(by_chance);
  struct scaled sure = {by_chance.mantissa * SURE, by_chance.exponent};
  if (scaled_sub(square, sure).mantissa <= 0) {
    return none;
  }
  struct scaled excess = scaled_sub(square, by_chance);
  return scaled_sub(excess, TRACE_MOST).mantissa > 0 ? TRACE_MOST : excess;
}

void fit_doubt_load(const struct fit_array *array, const int32_t *pressure_Pa_q10,
                    const struct fit_settings *settings, struct fit_result *result) {
  struct rows rows;
  if (!(result->flags & CONTACT_FLAG_FIT_VALID) ||
      (result->flags & (CONTACT_FLAG_AT_BOUND | CONTACT_FLAG_FLAT)) ||
      !set_rows(array, pressure_Pa_q10, settings, result, &rows)) {
    return;
  }
  struct scaled trace = trace_of(&rows);
  if (trace.mantissa == 0) {
    return;
  }
  struct scaled by_pitch =
      scaled_mul(fit_grid_scaled(SHIFT_PER_PITCH), fit_grid_scaled(array->pitch_mm));
  struct scaled by_sigma =
      scaled_mul(fit_grid_scaled(SHIFT_PER_SIGMA), fit_grid_scaled(result->sigma_mm));
  struct scaled shift = scaled_sub(by_pitch, by_sigma).mantissa > 0 ? by_pitch : by_sigma;
  struct scaled sd = fit_grid_scaled(result->location_sd_mm);
  sd = fit_scaled_sqrt(
      scaled_add(scaled_mul(sd, sd), scaled_mul(fit_scaled_short(trace), scaled_mul(shift, shift))));
  result->location_sd_mm = fit_float(sd.mantissa, sd.exponent);
  if (result->location_sd_mm > fit_location_sd_limit_mm(settings)) {
    result->flags |= CONTACT_FLAG_UNCERTAIN;
  }
}
