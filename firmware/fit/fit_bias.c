#include "fit/fit_bias.h"

#include "common/contact_flags.h"
#include "fit/fit_grid_parts.h"
#include "fit/fit_grid_solve.h"
#include "fit/fit_limits.h"
#include "fit/fit_math.h"

#include <string.h>

/* The model of the residual, lengths in sigma, parts of p0, d = (dx, dy) from the contact to the sensor, g(v) = exp(-d' d / (2 v)):
 *   residual = g(1) (a + b dx + c dy + e d' d) + far g(FAR) + (qx dx + qy dy) g(TANGENTIAL)
 * The first four are what a step of the fit would still take. `far` is 0 +- FAR_SD of p0: what the rubber has around a contact, or the
 * error of a known dip. The last two are the trace of a tangential force. */
enum { AMPLITUDE, ALONG_X, ALONG_Y, WIDTH, FAR, TANGENTIAL_X, TANGENTIAL_Y, UNKNOWNS };
_Static_assert(UNKNOWNS == FIT_BIAS_UNKNOWNS, "the search has a column for each");

#define FAR_Q16 10486            /* 1 / 6.25: the variance of the dip that the recordings of real pads show */
#define TANGENTIAL_WIDTH_SHIFT 2 /* 1 / 4: the layer's wide terms under the contacts of the twin */
#define FAR_PER_SD 100           /* FAR_SD 0.01 of p0: half of what layers and cast pads differ by */
/* 1 / 2: the share of model_sd that is independent from sensor to sensor. The other unknowns take the rest. */
#define MODEL_SHARE_SHIFT 1
/* A trace is one whose square exceeds TRACE_RATIO times the sum of its two variances, which chance makes in one press of seven. */
#define TRACE_RATIO 2

/* Shift of the location per Q / F, the larger of two, and Q / F per coefficient of the trace: medians over the objects of report truth on
 * 6 to 15 mm of rubber, seed 1. NARROW: below FIT_WIDTHS_SIGMA_MIN, where a dip that is not known leaves a trace as large as a pull's. */
#define SHIFT_PER_PITCH 0.38f
#define SHIFT_PER_PITCH_NARROW 0.55f
#define SHIFT_PER_SIGMA 0.58f
#define RATIO_PER_TRACE 14.7f
/* Square of the largest coefficient that counts: Q / F of 1, which is what friction holds. */
#define TRACE_MAX ((struct scaled){19389, -22})

#define OFFSET_MAX_Q12 (1 << 15) /* 8 sigma */
#define READING_BITS 15
#define ERROR_MAX_Q4 ((1 << 18) - 1)
#define SIGMA_MIN_Q16 10000 /* pitches; FIT_SIGMA_MIN is above */

#define RESIDUAL UNKNOWNS /* its column */
#define WORDS (UNKNOWNS + 1)

#define DIP_PER_MAX_Q26 (1 << 29) /* 8 */
#define Z_MAX_Q22 (1u << 27)      /* 6.7 sigma away */
#define DEVIATION_MAX_Q12 ((int32_t)(FIT_DEVIATION_SHARE_MAX * 4096.0f))

static void set_dip(const struct fit_settings *settings, const struct fit_result *result, struct fit_bias_search *search) {
  search->dip_q18 = search->dip_per_q26 = 0;
  if (fit_has_dip(settings)) {
    struct scaled ratio = scaled_div(fit_grid_scaled(result->sigma_mm), fit_grid_scaled(settings->dip_sd_mm));
    search->dip_q18 = fit_fixed(settings->dip_share, 18);
    search->dip_per_q26 = fixed_clamp(fit_scaled_to_fixed(scaled_mul(ratio, ratio), 26), 0, DIP_PER_MAX_Q26);
  }
}

/* 2^shift: the readings' unit, 1/1024 Pa. */
static void set_base(const struct fit_settings *settings, int32_t largest, int32_t shift, struct fit_bias_search *search) {
  int32_t noise_q4 = fixed_clamp(shifted(settings->noise_Pa_q10, 4 - shift), 1, ERROR_MAX_Q4);
  int32_t model_q4 = (int32_t)((settings->model_sd_q16 * (uint32_t)shifted(largest, -shift)) >> 12);
  search->base_q4 = fixed_clamp(fixed_hypot(noise_q4, model_q4 >> MODEL_SHARE_SHIFT), 1, ERROR_MAX_Q4);
}

/* What is too far off for Q16 is so in both, and counts as the same place. */
FIXED_INLINE int32_t offset_in_sigmas(float at, int32_t from_q16, int32_t per_sigma_q12) {
  int32_t off_q16 = (int32_t)((uint32_t)fit_fixed(at, 16) - (uint32_t)from_q16);
  return fixed_clamp(fixed_mul_16(off_q16, per_sigma_q12), -OFFSET_MAX_Q12 + 1, OFFSET_MAX_Q12 - 1);
}

/* What a row holds at first: location of the sensor from the contact, reading over p0, error by gain and hysteresis, deviations. */
enum { AT_X_Q12, AT_Y_Q12, READING_Q18, ERROR_Q4, OFF_X_Q12, OFF_Y_Q12, WIDER_Q15 };

/* False: there is nothing to be seen in so few or such readings. */
static bool prepare_rows(const struct fit_array *array, const int32_t *pressure_Pa_q10, const struct fit_settings *settings,
                         const struct fit_result *result, struct fit_bias_search *search) {
  int32_t largest = 0, count = 0;
  for (int k = 0; k < array->sensor_count; k++) {
    if (result->used >> k & 1) {
      largest = pressure_Pa_q10[k] > largest ? pressure_Pa_q10[k] : largest;
      count++;
    }
  }
  const int most = FIT_BIAS_SENSORS_MAX > 24 && fit_is_rectangle(array) ? FIT_BIAS_SENSORS_MAX : 24;
  if (count < FIT_BIAS_SENSORS || count > most || largest <= 0) {
    return false;
  }
  search->count = count;
  memset(search->size, 0, sizeof search->size);
  int32_t shift = fixed_bits((uint32_t)largest) - READING_BITS;
  set_base(settings, largest, shift, search);
  set_dip(settings, result, search);
  struct scaled per_p0 = fit_grid_reciprocal(fit_grid_scaled(result->p0_Pa));
  search->base = scaled_mul(fit_scaled_from(search->base_q4, shift - 14), per_p0);
  const float per_pitch = 1.0f / array->pitch_mm;
  int32_t x_q16 = fit_fixed(result->x_mm * per_pitch, 16);
  int32_t y_q16 = fit_fixed(result->y_mm * per_pitch, 16);
  int32_t sigma_q16 = fit_fixed(result->sigma_mm * per_pitch, 16);
  int32_t per_sigma_q12 = port_divide(1 << 28, sigma_q16 < SIGMA_MIN_Q16 ? SIGMA_MIN_Q16 : sigma_q16);
  int32_t(*row)[WORDS] = search->row;
  for (int k = 0; k < array->sensor_count; k++) {
    if (!(result->used >> k & 1)) {
      continue;
    }
    int32_t reading = fixed_clamp(shifted(pressure_Pa_q10[k], -shift), -INT16_MAX, INT16_MAX);
    (*row)[AT_X_Q12] = offset_in_sigmas(array->x[k], x_q16, per_sigma_q12);
    (*row)[AT_Y_Q12] = offset_in_sigmas(array->y[k], y_q16, per_sigma_q12);
    (*row)[READING_Q18] = shifted(reading * per_p0.mantissa, per_p0.exponent + shift - 10 + 18);
    int32_t gain_q4 = (int32_t)(((uint32_t)settings->gain_sd_q16[k] * fixed_magnitude(reading)) >> 12);
    int32_t hysteresis_q4 = fixed_clamp(shifted(settings->hysteresis_sd_Pa_q10[k], 4 - shift), 0, ERROR_MAX_Q4);
    (*row)[ERROR_Q4] = fixed_hypot(gain_q4, hysteresis_q4);
    (*row)[OFF_X_Q12] = (*row)[OFF_Y_Q12] = (*row)[WIDER_Q15] = 0;
    if (settings->deviations) {
      const struct fit_deviation *deviation = &settings->deviations[k];
      (*row)[OFF_X_Q12] = (per_sigma_q12 * deviation->off_x_q15) >> 15;
      (*row)[OFF_Y_Q12] = (per_sigma_q12 * deviation->off_y_q15) >> 15;
      (*row)[WIDER_Q15] = deviation->wider_q15;
    }
    row++;
  }
  return true;
}

static NOINLINE void set_row(struct fit_bias_search *search, int32_t *row) {
  int32_t x = row[AT_X_Q12], y = row[AT_Y_Q12], reading_q18 = row[READING_Q18];
  int32_t square_q20 = (int32_t)(((uint32_t)(x * x) + (uint32_t)(y * y)) >> 4);
  uint32_t z = (uint32_t)fixed_mul_q30(square_q20 * 4, 774541002); /* log2(e) / 2, Q22 */
  int32_t e_q18 = exp2_negative(z) >> 12;
  int32_t tangential_q17 = exp2_rough(z >> TANGENTIAL_WIDTH_SHIFT) >> 13;
  int32_t error_q4 = fixed_hypot(search->base_q4, row[ERROR_Q4]);
  if (search->dip_q18 != 0) {
    int32_t z_dip = fixed_mul_q26((int32_t)(z < Z_MAX_Q22 ? z : Z_MAX_Q22), search->dip_per_q26);
    int32_t dip_q12 = exp2_rough((uint32_t)z_dip) >> 18;
    reading_q18 += (search->dip_q18 * dip_q12) >> 12;
  }
  int32_t along_x_q12 = ((row[WIDER_Q15] * x) >> 15) - row[OFF_X_Q12];
  int32_t along_y_q12 = ((row[WIDER_Q15] * y) >> 15) - row[OFF_Y_Q12];
  int32_t deviation_q12 = ((along_x_q12 * x) >> 12) + ((along_y_q12 * y) >> 12);
  reading_q18 -= (e_q18 * fixed_clamp(deviation_q12, -DEVIATION_MAX_Q12, DEVIATION_MAX_Q12)) >> 12;
  int32_t weight_q12 = port_divide(search->base_q4 << 12, error_q4);
  int32_t residual_q18 = fixed_clamp(reading_q18 - e_q18, -(1 << 18), 1 << 18);
  row[AMPLITUDE] = e_q18 * weight_q12;
  row[ALONG_X] = ((e_q18 * x) >> 12) * weight_q12;
  row[ALONG_Y] = ((e_q18 * y) >> 12) * weight_q12;
  row[WIDTH] = ((e_q18 * (square_q20 >> 8)) >> 12) * weight_q12;
  row[FAR] = (exp2_rough((uint32_t)fixed_mul_16((int32_t)z, FAR_Q16)) >> 12) * weight_q12;
  row[TANGENTIAL_X] = ((tangential_q17 * x) >> 11) * weight_q12;
  row[TANGENTIAL_Y] = ((tangential_q17 * y) >> 11) * weight_q12;
  row[RESIDUAL] = residual_q18 * weight_q12;
  for (int u = 0; u < WORDS; u++) {
    search->size[u] |= fixed_magnitude(row[u]);
  }
}

static void set_rows(struct fit_bias_search *search, int from, int to) {
  for (int k = from; k < to; k++) {
    set_row(search, search->row[k]);
  }
}

/* Brings a column to 13 bits, or to 12 so that the sums hold, and returns the sum of its squares. */
static NOINLINE int32_t normalise(struct fit_bias_search *search, int u, int32_t prior_q30) {
  int32_t shift = fixed_bits(search->size[u] | fixed_magnitude(prior_q30)) - (search->count > 16 ? 12 : 13);
  shift = shift < 1 ? 1 : shift;
  search->q[u] = (int8_t)(30 - shift);
  int32_t half = 1 << (shift - 1), prior = prior_q30 >> shift;
  int32_t *value = &search->row[0][u], *end = &search->row[0][u] + search->count * WORDS;
  int32_t squares = prior * prior;
  do {
    int32_t now = (*value + half) >> shift;
    *value = now;
    squares += now * now;
    value += WORDS;
  } while (value != end);
  return squares;
}

/* Columns in the room that the sums have, and the diagonal 2^28 .. 2^30. */
static void scale_columns(struct fit_bias_search *search) {
  int32_t prior_q30 = fit_scaled_to_fixed(scaled_mul(search->base, fit_scaled_from(FAR_PER_SD, 0)), 30);
  for (int u = 0; u < UNKNOWNS; u++) {
    int32_t squares = normalise(search, u, u == FAR ? prior_q30 : 0);
    int32_t up = squares >> 30 ? 0 : (30 - fixed_bits((uint32_t)squares | 1)) >> 1;
    search->up[u] = (int8_t)up;
    search->matrix[u][u] = squares * (1 << (2 * up));
    search->q[u] = (int8_t)(search->q[u] + up);
  }
  search->residual_square = normalise(search, RESIDUAL, 0);
}

_Static_assert(UNKNOWNS == FIT_PRODUCTS && RESIDUAL == FIT_PRODUCTS, "as the sums have them");
static void take_products(struct fit_bias_search *search) {
  const int8_t *up = search->up;
  for (int a = 0; a < UNKNOWNS; a++) {
    int32_t sums[4];
    fit_sum_products[a](search->row[0], search->row[search->count], sums);
    for (int k = 0, b = a; k < 3; k++) {
      b = b == UNKNOWNS - 1 ? 0 : b + 1;
      search->matrix[a > b ? a : b][a > b ? b : a] = sums[k] * (1 << (up[a] + up[b]));
    }
    search->right[a] = sums[3] * (1 << up[a]);
  }
}

/* The square of the trace's coefficients beyond what they are by chance, 0 where there is none. */
static NOINLINE struct scaled find_trace(struct fit_bias_search *search) {
  const struct scaled none = {0, 0};
  int32_t left = search->residual_square;
  for (int j = 0; j < UNKNOWNS; j++) {
    int32_t factor[UNKNOWNS];
    const struct fixed_pivot pivot = fixed_eliminate(search->matrix[0], UNKNOWNS, UNKNOWNS, j, search->right, factor);
    left -= pivot.rhs * pivot.quotient * 2; /* what the unknown explains */
  }
  if (search->matrix[TANGENTIAL_X][TANGENTIAL_X] < FIXED_PIVOT_MIN || search->matrix[TANGENTIAL_Y][TANGENTIAL_Y] < FIXED_PIVOT_MIN) {
    return none;
  }
  struct scaled pivot_x = fit_scaled_from(search->matrix[TANGENTIAL_X][TANGENTIAL_X], -2 * search->q[TANGENTIAL_X]);
  struct scaled pivot_y = fit_scaled_from(search->matrix[TANGENTIAL_Y][TANGENTIAL_Y], -2 * search->q[TANGENTIAL_Y]);
  struct scaled both = fit_scaled_from(search->matrix[TANGENTIAL_Y][TANGENTIAL_X], -search->q[TANGENTIAL_X] - search->q[TANGENTIAL_Y]);
  struct scaled right_x = fit_scaled_from(search->right[TANGENTIAL_X], -search->q[TANGENTIAL_X] - search->q[RESIDUAL]);
  struct scaled right_y = fit_scaled_from(search->right[TANGENTIAL_Y], -search->q[TANGENTIAL_Y] - search->q[RESIDUAL]);
  struct scaled per_x = fit_grid_reciprocal(pivot_x), per_y = fit_grid_reciprocal(pivot_y);
  struct scaled lean = scaled_mul(fit_scaled_short(both), per_x);
  struct scaled y = scaled_mul(right_y, per_y);
  struct scaled x = fit_scaled_short(scaled_sub(scaled_mul(right_x, per_x), fit_scaled_short(scaled_mul(lean, y))));
  struct scaled square = scaled_add(scaled_mul(x, x), scaled_mul(y, y));
  struct scaled form_x = scaled_add(per_x, scaled_mul(scaled_mul(lean, lean), per_y));
  struct scaled variance = scaled_mul(search->base, search->base);
  /* Residuals that the model does not explain count as errors of the readings. */
  int32_t freedom = search->count - UNKNOWNS;
  struct scaled found = fit_scaled_from(port_divide(left > 0 ? left : 0, freedom < 1 ? 1 : freedom), -2 * search->q[RESIDUAL]);
  variance = scaled_sub(found, variance).mantissa > 0 ? found : variance;
  struct scaled expected = fit_scaled_short(scaled_mul(fit_scaled_short(variance), scaled_add(form_x, per_y)));
  struct scaled sure = {expected.mantissa * TRACE_RATIO, expected.exponent};
  if (scaled_sub(square, sure).mantissa <= 0) {
    return none;
  }
  struct scaled excess = scaled_sub(square, expected);
  return scaled_sub(excess, TRACE_MAX).mantissa > 0 ? TRACE_MAX : excess;
}

static bool is_located(const struct fit_result *result) {
  return (result->flags & CONTACT_FLAG_FIT_VALID) && !(result->flags & (CONTACT_FLAG_AT_BOUND | CONTACT_FLAG_FLAT));
}

void fit_bias_begin(struct fit_bias *bias) {
  bias->known = false;
  bias->part = 0;
}

void fit_bias_add(const struct fit_bias *bias, const struct fit_array *array, const struct fit_settings *settings,
                  struct fit_result *result) {
  if (!is_located(result) || (bias->known && bias->ratio == 0.0f)) {
    return;
  }
  float per_pitch = SHIFT_PER_PITCH, ratio = bias->known ? bias->ratio : FIT_BIAS_ASSUMED_RATIO;
  if (result->sigma_mm < FIT_WIDTHS_SIGMA_MIN * array->pitch_mm && !fit_has_dip(settings)) {
    per_pitch = SHIFT_PER_PITCH_NARROW;
    ratio = ratio < FIT_BIAS_ASSUMED_RATIO ? ratio : FIT_BIAS_ASSUMED_RATIO;
  }
  const float by_pitch = per_pitch * array->pitch_mm, by_sigma = SHIFT_PER_SIGMA * result->sigma_mm;
  result->location_sd_mm = fit_quadrature(result->location_sd_mm, 1.0f, ratio, by_pitch > by_sigma ? by_pitch : by_sigma);
  if (result->location_sd_mm > fit_location_sd_limit_mm(settings)) {
    result->flags |= CONTACT_FLAG_UNCERTAIN;
  }
}

void fit_bias_step(struct fit_bias *bias, const struct fit_array *array, const int32_t *pressure_Pa_q10,
                   const struct fit_settings *settings, const struct fit_result *result) {
  struct fit_bias_search *search = &bias->search;
  switch (bias->part) {
  case 0:
    if (!is_located(result) || !prepare_rows(array, pressure_Pa_q10, settings, result, search)) {
      return;
    }
    break;
  case 1: set_rows(search, 0, search->count / 2); break;
  case 2: set_rows(search, search->count / 2, search->count); break;
  case 3: scale_columns(search); break;
  case 4: take_products(search); break;
  default: {
    struct scaled ratio = scaled_mul(fit_scaled_sqrt(fit_scaled_short(find_trace(search))), fit_grid_scaled(RATIO_PER_TRACE));
    bias->ratio = fit_scaled_float(ratio);
    bias->known = true;
  }
  }
  bias->part = (uint8_t)((bias->part + 1) % FIT_BIAS_PARTS);
}
