/* The rows of the least squares of a model: what it is off by at each sensor, and its derivatives. */
#include "fit/fit_limits.h"
#include "fit/fit_math.h"
#include "fit/fit_shapes_parts.h"

#include <stddef.h>

#define FAR_WIDTHS 6.25f /* FAR: the dip that the recordings of real pads show */
/* A twelfth of the line's square: half of what it adds to a spread, as steps do not know of it. */
#define LINE_Q16 5461
#define KAPPA_Q14 21299 /* 1.3, as in fit_tangential.c */
#define SQUARE_MAX_Q24 (40 << 24)

struct blob {
  int32_t x_q12, y_q12, weight_q14, lever_q14;
};

static int32_t q26_from(float value) { return fit_fixed(value, 26); }

enum ft_status fit_shapes_init(struct fit_shapes_pad *pad, const struct fit_array *array, const struct pad_profile *profile) {
  const float per = 1.0f / array->pitch_mm, per_square = per * per;
  const float widest = profile->normal[PAD_NORMAL_TERMS - 1].sd_mm * per;
  const float narrowest = profile->normal[0].sd_mm * per;
  if (!fit_is_rectangle(array) || !pad_profile_is_valid(profile) || narrowest * narrowest < FIT_SHAPES_VARIANCE_MIN || widest > 1.5f ||
      profile->tangential[PAD_TANGENTIAL_TERMS - 1].sd_mm * per > 4.0f) {
    return FT_ERR_ARGUMENT;
  }
  const float V = widest * widest;
  for (int j = 0; j < PAD_NORMAL_TERMS; j++) {
    float sd = profile->normal[j].sd_mm * per;
    pad->variance_q26[j] = q26_from(sd * sd);
    pad->strength_q26[j] = q26_from(profile->normal[j].share * V);
  }
  for (int j = 0; j < PAD_TANGENTIAL_TERMS; j++) {
    float sd = profile->tangential[j].sd_mm * per;
    pad->tangential_variance_q26[j] = q26_from(sd * sd);
    pad->tangential_strength_q26[j] = q26_from(profile->tangential[j].moment_mm * per * V);
  }
  pad->far_k_q24 = fit_fixed(LOG2E_HALF_FLOAT / (FAR_WIDTHS * V), 24);
  pad->spread_q20 = fit_fixed(profile->spread_mm2 * per_square, 20);
  int32_t per_sd_q4 = fit_fixed(1.0f / (profile->spread_sd_mm2 * per_square), 4);
  pad->per_spread_sd_q4 = per_sd_q4 < PER_SD_MAX_Q4 ? per_sd_q4 : PER_SD_MAX_Q4;
  pad->spread_min_q20 = -(pad->variance_q26[0] >> 9); /* an eighth */
  pad->spread_max_q20 = fit_fixed(0.75f * V, 20);
  fit_use_rectangle(&array->grid);
  uint8_t origin = array->grid.sensor[COLUMNS / 2 * ROWS + ROWS / 2];
  pad->pitch_mm = array->pitch_mm;
  pad->per_pitch = per;
  pad->per_pitch_q28 = fit_fixed(per, 28);
  pad->pitch_q22_mm = fit_fixed(array->pitch_mm, 22);
  pad->origin_x_q20 = fit_fixed(array->x[origin], 20);
  pad->origin_y_q20 = fit_fixed(array->y[origin], 20);
  pad->widest_mm2 = profile->normal[PAD_NORMAL_TERMS - 1].sd_mm;
  pad->widest_mm2 *= pad->widest_mm2;
  pad->force_unit_N = 6.2831853e-6f * pad->widest_mm2;
  return FT_OK;
}

void fit_shapes_set_terms(const struct fit_shapes_pad *pad, int32_t t_q20, struct terms *terms) {
  int32_t heights = 0;
  for (int j = 0; j < PAD_NORMAL_TERMS; j++) {
    int32_t v_q26 = pad->variance_q26[j] + t_q20 * 64;
    int32_t h_q26 = fixed_div_q26(pad->strength_q26[j], v_q26);
    terms->k_q24[j] = fixed_div_q26(LOG2E_HALF_Q26, v_q26) >> 2;
    terms->h_q14[j] = h_q26 >> 12;
    terms->q_q12[j] = fixed_div_q26(h_q26, v_q26) >> 14;
    terms->s_q8[j] = port_divide(terms->q_q12[j] << 14, v_q26 >> 8);
    heights += terms->h_q14[j];
  }
  terms->dip_q14 = fixed_mul_16(pad->work.frame.dip_share_q16, heights);
  terms->dip_k_q24 = pad->work.frame.dip_k_q24;
}

static void set_tangential_terms(const struct fit_shapes_pad *pad, int32_t t_q20, struct terms *terms) {
  for (int j = 0; j < PAD_TANGENTIAL_TERMS; j++) {
    int32_t v_q26 = pad->tangential_variance_q26[j] + fixed_mul_16(t_q20 * 64, KAPPA_Q14) * 4;
    int32_t over_q26 = fixed_div_q26(pad->tangential_strength_q26[j] >> 2, v_q26 >> 2);
    terms->tangential_k_q24[j] = fixed_div_q26(LOG2E_HALF_Q26 >> 2, v_q26 >> 2) >> 2;
    terms->tangential_q12[j] = fixed_div_q26(over_q26 >> 2, v_q26 >> 2) >> 14;
  }
}

static int set_blobs(int model, const int32_t *at, struct blob *blob) {
  static const int32_t weight_q14[4] = {5342, 5342, 2850, 2850}, lever_q14[4] = {5570, -5570, 14109, -14109};
  int count = model == ROUND ? 1 : model == LONG ? 4 : 2;
  for (int b = 0; b < count; b++) {
    if (model == TWO) {
      int32_t sign = b == 0 ? 1 : -1;
      blob[b].weight_q14 = (1 << 13) + sign * (at[BALANCE] >> 7);
      blob[b].lever_q14 = sign * (1 << 14);
    } else {
      blob[b].weight_q14 = model == ROUND ? 1 << 14 : weight_q14[b];
      blob[b].lever_q14 = lever_q14[b];
    }
    blob[b].x_q12 = at[LOCATION_X] >> 8;
    blob[b].y_q12 = at[LOCATION_Y] >> 8;
    if (model != ROUND) {
      blob[b].x_q12 += ((at[SPAN_X] >> 8) * blob[b].lever_q14) >> 14;
      blob[b].y_q12 += ((at[SPAN_Y] >> 8) * blob[b].lever_q14) >> 14;
    }
  }
  return count;
}

void fit_shapes_set_squares(int32_t x_q12, int32_t y_q12, struct squares *squares) {
  for (int i = 0; i < COLUMNS; i++) {
    int32_t d = (i - COLUMNS / 2) * 4096 - x_q12;
    squares->x_q24[i] = fixed_clamp(d * d, 0, SQUARE_MAX_Q24);
  }
  for (int k = 0; k < ROWS; k++) {
    int32_t d = (k - ROWS / 2) * 4096 - y_q12;
    squares->y_q24[k] = fixed_clamp(d * d, 0, SQUARE_MAX_Q24);
  }
}

FIXED_INLINE void set_factors(const struct squares *squares, int32_t k_q24, int32_t (*power)(uint32_t),
                              struct axis_gaussians *axis_gaussians) {
  for (int i = 0; i < COLUMNS; i++) {
    axis_gaussians->x_q15[i] = power((uint32_t)fixed_mul_q26(squares->x_q24[i], k_q24)) >> 15;
  }
  for (int k = 0; k < ROWS; k++) {
    axis_gaussians->y_q15[k] = power((uint32_t)fixed_mul_q26(squares->y_q24[k], k_q24)) >> 15;
  }
}

void fit_shapes_set_gaussians(const struct squares *squares, int32_t k_q24, struct axis_gaussians *axis_gaussians) {
  set_factors(squares, k_q24, exp2_negative, axis_gaussians);
}

/* The same within 0.6 %, for what is little. */
static NOINLINE void set_rough_gaussians(const struct squares *squares, int32_t k_q24, struct axis_gaussians *axis_gaussians) {
  set_factors(squares, k_q24, exp2_rough, axis_gaussians);
}

/* Begins the rows: the readings, and the broad term about the middle, of a pair about both. */
static NOINLINE void set_far(struct fit_shapes_pad *pad, int model, const struct blob *blob, const int32_t *at) {
  struct squares squares;
  struct axis_gaussians axis_gaussians, other;
  const int32_t k_q24 = pad->far_k_q24;
  int32_t first_q13 = at[AMPLITUDE] >> 7, second_q13 = 0;
  int32_t x_q12 = at[LOCATION_X] >> 8, y_q12 = at[LOCATION_Y] >> 8;
  if (model == TWO) {
    x_q12 = blob[0].x_q12;
    y_q12 = blob[0].y_q12;
  }
  fit_shapes_set_squares(x_q12, y_q12, &squares);
  set_rough_gaussians(&squares, k_q24, &axis_gaussians);
  other = axis_gaussians;
  if (model == TWO) {
    second_q13 = (first_q13 * blob[1].weight_q14) >> 14;
    first_q13 -= second_q13;
    fit_shapes_set_squares(blob[1].x_q12, blob[1].y_q12, &squares);
    set_rough_gaussians(&squares, k_q24, &other);
  }
  int32_t far_q16 = at[FAR] >> 4;
  int32_t *row = pad->work.row[0];
  const int32_t *reading_q28 = pad->work.frame.q28;
  for (int i = 0; i < COLUMNS; i++) {
    int32_t x_q13 = (first_q13 * axis_gaussians.x_q15[i]) >> 15;
    int32_t other_x_q13 = (second_q13 * other.x_q15[i]) >> 15;
    for (int k = 0; k < ROWS; k++, row += UNKNOWNS + 1) {
      row[AMPLITUDE] = row[LOCATION_X] = row[LOCATION_Y] = row[SPREAD] = 0;
      row[SPAN_X] = row[SPAN_Y] = row[BALANCE] = 0;
      row[FAR] = (x_q13 * axis_gaussians.y_q15[k] + other_x_q13 * other.y_q15[k]) >> 13;
      row[RESIDUAL] = *reading_q28++ - ((far_q16 * row[FAR]) >> 3);
    }
  }
}

/* Adds a blob to the rows, whose elements are Q15 (RESIDUAL Q28). */
static NOINLINE void add_blob(struct fit_shapes_pad *pad, const struct terms *terms, int model, const struct blob *blob,
                              int32_t amplitude_q13) {
  struct squares squares;
  struct axis_gaussians narrow, wide, dip;
  fit_shapes_set_squares(blob->x_q12, blob->y_q12, &squares);
  fit_shapes_set_gaussians(&squares, terms->k_q24[0], &narrow);
  fit_shapes_set_gaussians(&squares, terms->k_q24[1], &wide);
  set_rough_gaussians(&squares, terms->dip_k_q24, &dip);
  int32_t a_q13 = (amplitude_q13 * blob->weight_q14) >> 14;
  int32_t half_q13 = blob->lever_q14 > 0 ? amplitude_q13 : -amplitude_q13;
  const struct fit_deviation *deviation = pad->work.frame.has_deviations ? pad->work.deviations : NULL;
  int32_t *row = pad->work.row[0];
  for (int i = 0; i < COLUMNS; i++) {
    int32_t dx_q12 = (i - COLUMNS / 2) * 4096 - blob->x_q12;
    for (int k = 0; k < ROWS; k++, row += UNKNOWNS + 1) {
      int32_t dy_q12 = (k - ROWS / 2) * 4096 - blob->y_q12;
      int32_t e_q15 = (narrow.x_q15[i] * narrow.y_q15[k]) >> 15;
      int32_t s_q29 = terms->h_q14[0] * e_q15;
      int32_t g_q27 = terms->q_q12[0] * e_q15;
      int32_t w_q23 = terms->s_q8[0] * e_q15;
      e_q15 = (wide.x_q15[i] * wide.y_q15[k]) >> 15;
      s_q29 += terms->h_q14[1] * e_q15;
      g_q27 += terms->q_q12[1] * e_q15;
      w_q23 += terms->s_q8[1] * e_q15;
      s_q29 -= terms->dip_q14 * ((dip.x_q15[i] * dip.y_q15[k]) >> 15);
      int32_t s_q15 = s_q29 >> 14, g_q12 = g_q27 >> 15;
      int32_t square_q10 = (squares.x_q24[i] + squares.y_q24[k]) >> 14;
      int32_t along_x = (((g_q12 * dx_q12) >> 12) * a_q13) >> 10;
      int32_t along_y = (((g_q12 * dy_q12) >> 12) * a_q13) >> 10;
      row[AMPLITUDE] += (s_q15 * blob->weight_q14) >> 14;
      row[LOCATION_X] += along_x;
      row[LOCATION_Y] += along_y;
      row[SPREAD] += (((square_q10 * (w_q23 >> 15)) >> 7) - g_q12) * a_q13 >> 10;
      row[RESIDUAL] -= a_q13 * s_q15;
      if (deviation) { /* the log of a width, times what moves the model with it */
        int32_t grows_q15 = (((g_q12 * square_q10) >> 10) * a_q13) >> 10;
        row[RESIDUAL] -= (grows_q15 >> 2) * deviation++->wider_q15;
      }
      if (model != ROUND) {
        row[SPAN_X] += (along_x * (blob->lever_q14 >> 2)) >> 12;
        row[SPAN_Y] += (along_y * (blob->lever_q14 >> 2)) >> 12;
      }
      if (model == TWO) {
        row[BALANCE] += (half_q13 * s_q15) >> 14;
      }
    }
  }
}

static NOINLINE void add_tangential(struct fit_shapes_pad *pad, const struct terms *terms, const int32_t *at, int tangential) {
  struct squares squares;
  struct axis_gaussians axis_gaussians[PAD_TANGENTIAL_TERMS];
  int32_t x_q12 = at[LOCATION_X] >> 8, y_q12 = at[LOCATION_Y] >> 8;
  int32_t tangential_x_q13 = at[tangential] >> 7, tangential_y_q13 = at[tangential + 1] >> 7;
  fit_shapes_set_squares(x_q12, y_q12, &squares);
  for (int j = 0; j < PAD_TANGENTIAL_TERMS; j++) {
    fit_shapes_set_gaussians(&squares, terms->tangential_k_q24[j], &axis_gaussians[j]);
  }
  int32_t *row = pad->work.row[0];
  for (int i = 0; i < COLUMNS; i++) {
    for (int k = 0; k < ROWS; k++, row += UNKNOWNS + 1) {
      int32_t f_q27 = 0;
      for (int j = 0; j < PAD_TANGENTIAL_TERMS; j++) {
        f_q27 += terms->tangential_q12[j] * ((axis_gaussians[j].x_q15[i] * axis_gaussians[j].y_q15[k]) >> 15);
      }
      row[tangential] = ((f_q27 >> 15) * ((i - COLUMNS / 2) * 4096 - x_q12)) >> 9;
      row[tangential + 1] = ((f_q27 >> 15) * ((k - ROWS / 2) * 4096 - y_q12)) >> 9;
      row[RESIDUAL] -= row[tangential] * tangential_x_q13 + row[tangential + 1] * tangential_y_q13;
    }
  }
}

void fit_shapes_round_locations(struct fit_shapes_at *at) {
  for (int u = 0; u < UNKNOWNS; u++) {
    at->value[u] = (at->value[u] + 128) & ~255;
  }
}

void fit_shapes_set_rows(struct fit_shapes_pad *pad, int model, int count, const struct fit_shapes_at *where,
                         struct fit_shapes_equations *equations) {
  const int32_t *at = where->value;
  const int tangential = model == ROUND ? SPAN_X : TANGENTIAL_X;
  const bool pulls = count > tangential && model != TWO;
  struct terms terms;
  struct blob blob[4];
  fit_shapes_set_terms(pad, at[SPREAD], &terms);
  int blobs = set_blobs(model, at, blob);
  equations->count = count;
  equations->tangential = pulls ? tangential : 0;
  set_far(pad, model, blob, at);
  for (int b = 0; b < blobs; b++) {
    add_blob(pad, &terms, model, &blob[b], at[AMPLITUDE] >> 7);
  }
  if (pulls) {
    int32_t line_q20 = model == LONG ? fixed_mul_16(fit_shapes_span_square(at), LINE_Q16) : 0;
    set_tangential_terms(pad, at[SPREAD] + line_q20, &terms);
    add_tangential(pad, &terms, at, tangential);
  }
  uint32_t size = 0;
  int32_t *row = pad->work.row[0];
  for (int k = 0; k < NODES; k++, row += UNKNOWNS + 1) {
    int32_t residual = row[RESIDUAL];
    if (pad->work.frame.has_deviations) { /* what a sensor reads that is off its place */
      const struct fit_deviation *deviation = &pad->work.deviations[k];
      residual = wrap_add(
          residual, wrap_add(wrap_mul(row[LOCATION_X] >> 2, deviation->off_x_q15), wrap_mul(row[LOCATION_Y] >> 2, deviation->off_y_q15)));
    }
    residual = fixed_clamp(residual >> 12, -(1 << 17), 1 << 17) * pad->work.weight_q12[k];
    row[RESIDUAL] = residual;
    size |= fixed_magnitude(residual);
  }
  equations->residual_size = size;
}
