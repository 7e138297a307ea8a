#include "fit/fit_shapes.h"

#include "common/contact_flags.h"
#include "fit/fit_grid_parts.h"
#include "fit/fit_grid_solve.h"
#include "fit/fit_limits.h"
#include "fit/fit_math.h"

#include <math.h>

/* The models, lengths in pitches. A blob at d = (dx, dy) from its middle, t its contact's spread:
 *   s = sum_j share_j V / v_j exp(-d' d / (2 v_j)) - dip,    v_j = V_j + t,  V the widest V_j
 * and what of a load Q the rubber shows there:
 *   f = sum_j moment_j V / v_j^2 d exp(-d' d / (2 v_j)),     v_j = V_j + 1.3 t
 * A model is A sum_b w_b [s(d_b) + far exp(-d_b' d_b / (2 FAR V))] + pull' f(d): blobs of weight
 * w_b by lever_b span from the middle.
 *   round  one blob
 *   long   three, the nodes of Gauss's quadrature of a line from -span to span
 *   two    two, by +-span, of weight (1 +- balance) / 2
 * Forces are 2 pi V A and 2 pi V pull. */
enum { ROUND, LONG, TWO, MODELS };
enum { AMPLITUDE, PLACE_X, PLACE_Y, SPREAD, FAR, SPAN_X, SPAN_Y, BALANCE, PULL_X = 7, PULL_Y };
#define UNKNOWNS FIT_SHAPES_UNKNOWNS
#define RESIDUAL UNKNOWNS
_Static_assert(PULL_Y + 1 == UNKNOWNS, "a column for each");

static const uint8_t unknowns_of[MODELS] = {SPAN_X, UNKNOWNS, PULL_Y};

#define ONE_Q20 (1 << 20)
#define MODEL_SD_Q16 262    /* 0.004 of the largest reading */
#define FAR_WIDTHS 6.25f    /* FAR: the dip that the recordings of real pads show */
#define PER_FAR_SD_Q4 1600  /* 1 / 0.01 */
#define PER_LOAD_SD_Q4 53   /* 1 / 0.3: Q / F of what is held */
#define KAPPA_Q14 21299     /* 1.3, as in fit_tangential.c */
#define DAMPING_SHIFT 6     /* of the diagonal: what readings hardly tell moves slowly */
/* Frames of a contact, counted from 1. The load joins its model once the line has settled: both at
 * once lose their way at the border. After the last frame, which steps only, comes the first that
 * answers. */
#define FIRST_WITH_LOAD 10
#define FIRST_ANSWER FIT_SHAPES_FRAMES
#define LAST_FRAME (FIRST_ANSWER + 3)
#define LOG2E_HALF_FLOAT 0.72134752f
#define FREEDOM 9           /* readings and priors less the unknowns of two */
/* The best of the models explains nothing if its chi^2 is above that. */
#define CHI_SQUARE_MAX 100
#define SEPARATION_HALF_Q10 256 /* of half a pitch: nearer pairs are long contacts */

#define PLACE_X_MAX ((5 << 20) / 2)
#define PLACE_Y_MAX ((7 << 20) / 2)
#define SPAN_MAX (3 << 20)
#define BALANCE_MAX (15 << 16) /* 0.94 */
#define AMPLITUDE_MAX ((4 << 20) - 1)
#define AMPLITUDE_LEAST (1 << 13)
#define MOVE_MAX (1 << 18) /* a quarter of a pitch */
#define SQUARE_MAX_Q24 (40 << 24)
#define PIVOT_LEAST (1 << 18)
#define PER_SD_MAX_Q4 1024
/* Readings whose errors are more than 3 % of their unit tell no shapes. */
#define BASE_MAX_Q22 (1 << 17)

/* Columns are at most 2 pitches or units of the readings, in Q(27 - COLUMN_SHIFT). */
#define COLUMN_MAX ((1 << 16) - 1)
#define COLUMN_SHIFT 15
#define PRIOR_MAX ((1 << 13) - 1)

struct terms {
  int32_t k_q24[PAD_NORMAL_TERMS], h_q14[PAD_NORMAL_TERMS], q_q12[PAD_NORMAL_TERMS],
      s_q8[PAD_NORMAL_TERMS];
  int32_t pull_k_q24[PAD_TANGENTIAL_TERMS], pull_q12[PAD_TANGENTIAL_TERMS];
  int32_t dip_k_q24, dip_q14;
};

struct blob {
  int32_t x_q12, y_q12, weight_q14, lever_q14;
};

struct problem {
  struct fit_shapes_pad *pad;
  struct readings readings;
  int32_t base_q22; /* error of a reading of weight 1 */
  int32_t dip_share_q16, dip_k_q24;
};

static int32_t q26_from(float value) {
  return fit_fixed(value, 26);
}

enum ft_status fit_shapes_init(struct fit_shapes_pad *pad, const struct fit_array *array,
                               const struct pad_profile *profile) {
  const float per = 1.0f / array->pitch_mm, per_square = per * per;
  const float widest = profile->normal[PAD_NORMAL_TERMS - 1].sd_mm * per;
  const float narrowest = profile->normal[0].sd_mm * per;
  if (array->grid.columns != FIT_GRID_COLUMNS || array->grid.rows != FIT_GRID_ROWS ||
      !pad_profile_is_valid(profile) || narrowest * narrowest < FIT_SHAPES_VARIANCE_MIN ||
      widest > 1.5f || profile->tangential[PAD_TANGENTIAL_TERMS - 1].sd_mm * per > 4.0f) {
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
    pad->pull_variance_q26[j] = q26_from(sd * sd);
    pad->pull_strength_q26[j] = q26_from(profile->tangential[j].moment_mm * per * V);
  }
  pad->far_k_q24 = fit_fixed(LOG2E_HALF_FLOAT / (FAR_WIDTHS * V), 24);
  pad->spread_q20 = fit_fixed(profile->spread_mm2 * per_square, 20);
  int32_t per_sd_q4 = fit_fixed(1.0f / (profile->spread_sd_mm2 * per_square), 4);
  pad->per_spread_sd_q4 = per_sd_q4 < PER_SD_MAX_Q4 ? per_sd_q4 : PER_SD_MAX_Q4;
  pad->spread_least_q20 = -(pad->variance_q26[0] >> 9); /* an eighth */
  pad->spread_most_q20 = fit_fixed(0.75f * V, 20);
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

static NOINLINE void set_terms(const struct problem *problem, int32_t t_q20, bool pulls,
                               struct terms *terms) {
  const struct fit_shapes_pad *pad = problem->pad;
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
  terms->dip_q14 = fixed_mul_16(problem->dip_share_q16, heights);
  terms->dip_k_q24 = problem->dip_k_q24;
  for (int j = 0; pulls && j < PAD_TANGENTIAL_TERMS; j++) {
    int32_t v_q26 = pad->pull_variance_q26[j] + fixed_mul_16(t_q20 * 64, KAPPA_Q14) * 4;
    int32_t over_q26 = fixed_div_q26(pad->pull_strength_q26[j] >> 2, v_q26 >> 2);
    terms->pull_k_q24[j] = fixed_div_q26(LOG2E_HALF_Q26 >> 2, v_q26 >> 2) >> 2;
    terms->pull_q12[j] = fixed_div_q26(over_q26 >> 2, v_q26 >> 2) >> 14;
  }
}

static int set_blobs(int model, const int32_t *at, struct blob *blob) {
  static const int32_t weight_q14[3] = {7282, 4551, 4551}, lever_q14[3] = {0, 12691, -12691};
  int count = model == ROUND ? 1 : model == LONG ? 3 : 2;
  for (int b = 0; b < count; b++) {
    if (model == TWO) {
      int32_t sign = b == 0 ? 1 : -1;
      blob[b].weight_q14 = (1 << 13) + sign * (at[BALANCE] >> 7);
      blob[b].lever_q14 = sign * (1 << 14);
    } else {
      blob[b].weight_q14 = model == ROUND ? 1 << 14 : weight_q14[b];
      blob[b].lever_q14 = lever_q14[b];
    }
    blob[b].x_q12 = at[PLACE_X] >> 8;
    blob[b].y_q12 = at[PLACE_Y] >> 8;
    if (model != ROUND) {
      blob[b].x_q12 += ((at[SPAN_X] >> 8) * blob[b].lever_q14) >> 14;
      blob[b].y_q12 += ((at[SPAN_Y] >> 8) * blob[b].lever_q14) >> 14;
    }
  }
  return count;
}

/* exp(-d^2 / (2 v)) along both axes, whose products are the bells at the nodes. */
struct bell {
  int32_t x_q15[COLUMNS], y_q15[ROWS];
};

/* d^2 of the nodes along an axis. */
struct squares {
  int32_t x_q24[COLUMNS], y_q24[ROWS];
};

static void set_squares(int32_t x_q12, int32_t y_q12, struct squares *squares) {
  for (int i = 0; i < COLUMNS; i++) {
    int32_t d = (i - COLUMNS / 2) * 4096 - x_q12;
    squares->x_q24[i] = fixed_clamp(d * d, 0, SQUARE_MAX_Q24);
  }
  for (int k = 0; k < ROWS; k++) {
    int32_t d = (k - ROWS / 2) * 4096 - y_q12;
    squares->y_q24[k] = fixed_clamp(d * d, 0, SQUARE_MAX_Q24);
  }
}

static NOINLINE void set_bell(const struct squares *squares, int32_t k_q24, struct bell *bell) {
  for (int i = 0; i < COLUMNS; i++) {
    bell->x_q15[i] = exp2_negative((uint32_t)fixed_mul_q26(squares->x_q24[i], k_q24)) >> 15;
  }
  for (int k = 0; k < ROWS; k++) {
    bell->y_q15[k] = exp2_negative((uint32_t)fixed_mul_q26(squares->y_q24[k], k_q24)) >> 15;
  }
}

/* The same within 0.6 %, for what is little. */
static NOINLINE void set_rough_bell(const struct squares *squares, int32_t k_q24,
                                    struct bell *bell) {
  for (int i = 0; i < COLUMNS; i++) {
    bell->x_q15[i] = exp2_rough((uint32_t)fixed_mul_q26(squares->x_q24[i], k_q24)) >> 15;
  }
  for (int k = 0; k < ROWS; k++) {
    bell->y_q15[k] = exp2_rough((uint32_t)fixed_mul_q26(squares->y_q24[k], k_q24)) >> 15;
  }
}

/* Begins the rows: the readings, and the broad term about the middle, of a pair about both. */
static NOINLINE void set_far(const struct problem *problem, int model, const struct blob *blob,
                             const int32_t *at) {
  struct squares squares;
  struct bell bell, other;
  const int32_t k_q24 = problem->pad->far_k_q24;
  int32_t first_q13 = at[AMPLITUDE] >> 7, second_q13 = 0;
  set_squares(blob[0].x_q12, blob[0].y_q12, &squares);
  set_rough_bell(&squares, k_q24, &bell);
  other = bell;
  if (model == TWO) {
    second_q13 = (first_q13 * blob[1].weight_q14) >> 14;
    first_q13 -= second_q13;
    set_squares(blob[1].x_q12, blob[1].y_q12, &squares);
    set_rough_bell(&squares, k_q24, &other);
  }
  int32_t far_q16 = at[FAR] >> 4;
  int32_t *row = problem->pad->room.row[0];
  const int32_t *reading_q28 = problem->readings.q28;
  for (int i = 0; i < COLUMNS; i++) {
    int32_t x_q13 = (first_q13 * bell.x_q15[i]) >> 15;
    int32_t other_x_q13 = (second_q13 * other.x_q15[i]) >> 15;
    for (int k = 0; k < ROWS; k++, row += UNKNOWNS + 1) {
      row[AMPLITUDE] = row[PLACE_X] = row[PLACE_Y] = row[SPREAD] = 0;
      row[SPAN_X] = row[SPAN_Y] = row[BALANCE] = 0;
      row[FAR] = (x_q13 * bell.y_q15[k] + other_x_q13 * other.y_q15[k]) >> 13;
      row[RESIDUAL] = *reading_q28++ - ((far_q16 * row[FAR]) >> 3);
    }
  }
}

/* Adds a blob to the rows, whose elements are Q15 (RESIDUAL Q28). */
static NOINLINE void add_blob(const struct problem *problem, const struct terms *terms, int model,
                              const struct blob *blob, int32_t amplitude_q13) {
  struct squares squares;
  struct bell narrow, wide, dip;
  set_squares(blob->x_q12, blob->y_q12, &squares);
  set_bell(&squares, terms->k_q24[0], &narrow);
  set_bell(&squares, terms->k_q24[1], &wide);
  set_rough_bell(&squares, terms->dip_k_q24, &dip);
  int32_t a_q13 = (amplitude_q13 * blob->weight_q14) >> 14;
  int32_t half_q13 = blob->lever_q14 > 0 ? amplitude_q13 : -amplitude_q13;
  int32_t *row = problem->pad->room.row[0];
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
      row[PLACE_X] += along_x;
      row[PLACE_Y] += along_y;
      row[SPREAD] += (((square_q10 * (w_q23 >> 15)) >> 7) - g_q12) * a_q13 >> 10;
      row[RESIDUAL] -= a_q13 * s_q15;
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

static NOINLINE void add_pull(const struct problem *problem, const struct terms *terms,
                              const int32_t *at) {
  struct squares squares;
  struct bell bell[PAD_TANGENTIAL_TERMS];
  int32_t x_q12 = at[PLACE_X] >> 8, y_q12 = at[PLACE_Y] >> 8;
  int32_t pull_x_q13 = at[PULL_X] >> 7, pull_y_q13 = at[PULL_Y] >> 7;
  set_squares(x_q12, y_q12, &squares);
  for (int j = 0; j < PAD_TANGENTIAL_TERMS; j++) {
    set_bell(&squares, terms->pull_k_q24[j], &bell[j]);
  }
  int32_t *row = problem->pad->room.row[0];
  for (int i = 0; i < COLUMNS; i++) {
    for (int k = 0; k < ROWS; k++, row += UNKNOWNS + 1) {
      int32_t f_q27 = 0;
      for (int j = 0; j < PAD_TANGENTIAL_TERMS; j++) {
        f_q27 += terms->pull_q12[j] * ((bell[j].x_q15[i] * bell[j].y_q15[k]) >> 15);
      }
      row[PULL_X] = ((f_q27 >> 15) * ((i - COLUMNS / 2) * 4096 - x_q12)) >> 9;
      row[PULL_Y] = ((f_q27 >> 15) * ((k - ROWS / 2) * 4096 - y_q12)) >> 9;
      row[RESIDUAL] -= row[PULL_X] * pull_x_q13 + row[PULL_Y] * pull_y_q13;
    }
  }
}

/* Where a step begins is rounded, which moves the step and not where it ends. */
static void round_places(struct fit_shapes_at *at) {
  for (int u = 0; u < UNKNOWNS; u++) {
    at->value[u] = (at->value[u] + 128) & ~255;
  }
}

/* The weighted rows of a model, columns Q27 and residual Q28. */
static NOINLINE void set_rows(const struct problem *problem, int model, int count,
                              const struct fit_shapes_at *where,
                              struct fit_shapes_equations *equations) {
  struct fit_shapes_pad *pad = problem->pad;
  const int32_t *at = where->value;
  const bool pulls = count > BALANCE && model == LONG;
  struct terms terms;
  struct blob blob[3];
  set_terms(problem, at[SPREAD], pulls, &terms);
  int blobs = set_blobs(model, at, blob);
  equations->count = count;
  set_far(problem, model, blob, at);
  for (int b = 0; b < blobs; b++) {
    add_blob(problem, &terms, model, &blob[b], at[AMPLITUDE] >> 7);
  }
  if (pulls) {
    add_pull(problem, &terms, at);
  }
  uint32_t size = 0;
  int32_t *residual = &pad->room.row[0][RESIDUAL];
  for (int k = 0; k < NODES; k++, residual += UNKNOWNS + 1) {
    *residual = fixed_clamp(*residual >> 12, -(1 << 17), 1 << 17) * pad->room.weight_q12[k];
    size |= fixed_size(*residual);
  }
  equations->residual_size = size;
}

/* The column with its weights, 13 bits at most; returns the sum of its squares. */
static NOINLINE int32_t put_column(struct fit_shapes_pad *pad, int u) {
  const int32_t *row = &pad->room.row[0][u], *weight_q12 = pad->room.weight_q12;
  int32_t *column = pad->room.column[u];
  int32_t own = 0;
  for (int k = 0; k < NODES; k++, row += UNKNOWNS + 1) {
    int32_t value = *row;
    if ((uint32_t)value + COLUMN_MAX > 2u * COLUMN_MAX) {
      value = value < 0 ? -COLUMN_MAX : COLUMN_MAX;
    }
    value = (value * weight_q12[k] + (1 << (COLUMN_SHIFT - 1))) >> COLUMN_SHIFT;
    column[k] = value;
    own += value * value;
  }
  return own;
}

/* The same of the residuals, as many bits as there are. */
static NOINLINE int32_t put_residuals(struct fit_shapes_pad *pad, uint32_t size,
                                      struct fit_shapes_equations *equations) {
  int32_t shift = fixed_bits(size) - 13;
  shift = shift < 1 ? 1 : shift;
  equations->q[RESIDUAL] = (int8_t)(28 - shift);
  const int32_t *row = &pad->room.row[0][RESIDUAL];
  int32_t *column = pad->room.column[RESIDUAL];
  int32_t own = 0, half = 1 << (shift - 1);
  for (int k = 0; k < NODES; k++, row += UNKNOWNS + 1) {
    int32_t value = (*row + half) >> shift;
    column[k] = value;
    own += value * value;
  }
  return own;
}

/* The sums of the products of a column with two others. */
static NOINLINE void sum_products(const int32_t *a, const int32_t *b, const int32_t *c,
                                  int32_t sums[2]) {
  int32_t first = 0, second = 0;
  for (int k = 0; k < NODES; k++) {
    int32_t own = a[k];
    first += own * b[k];
    second += own * c[k];
  }
  sums[0] = first;
  sums[1] = second;
}

struct priors {
  int32_t element_q27[UNKNOWNS], off_q28[UNKNOWNS]; /* rows of one element, and their residuals */
};

static void put_prior(int u, int32_t element_q27, int32_t off_q20, struct priors *priors) {
  priors->element_q27[u] = element_q27;
  priors->off_q28[u] = (element_q27 >> 12) * (off_q20 >> 4) >> 3;
}

/* The column of the residuals, and the sum of the squares with those of the priors. */
static NOINLINE void form_residuals(const struct problem *problem, const int32_t *at,
                                    struct priors *priors,
                                    struct fit_shapes_equations *equations) {
  const struct fit_shapes_pad *pad = problem->pad;
  int32_t base_q23 = problem->base_q22 * 2;
  for (int u = 0; u < UNKNOWNS; u++) {
    priors->element_q27[u] = priors->off_q28[u] = 0;
  }
  put_prior(SPREAD, base_q23 * pad->per_spread_sd_q4, pad->spread_q20 - at[SPREAD], priors);
  put_prior(FAR, base_q23 * PER_FAR_SD_Q4, -at[FAR], priors);
  if (equations->count == UNKNOWNS) {
    int32_t per_q4 = port_divide(PER_LOAD_SD_Q4 << 16, at[AMPLITUDE] >> 4);
    int32_t element_q27 = base_q23 * (per_q4 < PER_SD_MAX_Q4 ? per_q4 : PER_SD_MAX_Q4);
    put_prior(PULL_X, element_q27, -at[PULL_X], priors);
    put_prior(PULL_Y, element_q27, -at[PULL_Y], priors);
  }
  uint32_t size = equations->residual_size;
  for (int u = SPREAD; u < equations->count; u++) {
    size |= fixed_size(priors->off_q28[u]);
  }
  equations->residual_square = put_residuals(problem->pad, size, equations);
  int32_t shift = 28 - equations->q[RESIDUAL];
  for (int u = SPREAD; u < equations->count; u++) {
    int32_t residual = priors->off_q28[u] >> shift;
    priors->off_q28[u] = residual;
    equations->residual_square += residual * residual;
  }
}

/* The normal matrix, of which the diagonal is 2^28 to 2^30. */
static NOINLINE void form(struct fit_shapes_pad *pad, const struct priors *priors,
                          struct fit_shapes_equations *equations) {
  int8_t up[UNKNOWNS] = {0};
  for (int u = 0; u < equations->count; u++) {
    int32_t prior = priors->element_q27[u] >> COLUMN_SHIFT;
    prior = prior < PRIOR_MAX ? prior : PRIOR_MAX;
    int32_t own = put_column(pad, u) + prior * prior;
    up[u] = (int8_t)(own >> 30 ? 0 : (30 - fixed_bits((uint32_t)own | 1)) >> 1);
    equations->matrix[u][u] = own * (1 << (2 * up[u]));
    equations->right[u] = prior * priors->off_q28[u];
    equations->q[u] = (int8_t)(27 - COLUMN_SHIFT + up[u]);
  }
  for (int a = 0; a < equations->count; a++) {
    int32_t(*column)[NODES] = pad->room.column;
    int32_t sums[2];
    int b = 0;
    for (; b + 1 < a; b += 2) {
      sum_products(column[a], column[b], column[b + 1], sums);
      equations->matrix[a][b] = sums[0] * (1 << (up[a] + up[b]));
      equations->matrix[a][b + 1] = sums[1] * (1 << (up[a] + up[b + 1]));
    }
    sum_products(column[a], column[b], column[RESIDUAL], sums);
    if (b < a) {
      equations->matrix[a][b] = sums[0] * (1 << (up[a] + up[b]));
    }
    equations->right[a] = (equations->right[a] + sums[1]) * (1 << up[a]);
  }
}

/* L D L^T in place, below the diagonal L 2^-half in Q14. An unknown that is not told from those
 * before stays where it is. right: 2^-half times the elements of D^-1 L^-1 right, Q14. */
static NOINLINE void eliminate(struct fit_shapes_equations *equations, int32_t *right) {
  int32_t(*matrix)[UNKNOWNS] = equations->matrix;
  int count = equations->count;
  for (int j = 0; j < count; j++) {
    int32_t pivot = matrix[j][j];
    if (pivot < PIVOT_LEAST) {
      equations->half[j] = 0;
      equations->inverse_q14[j] = 0;
      right[j] = 0;
      for (int i = j + 1; i < count; i++) {
        matrix[i][j] = 0;
      }
      continue;
    }
    int32_t half = pivot >> 30 ? 0 : (30 - fixed_bits((uint32_t)pivot)) >> 1;
    int32_t down = 15 - half, round = 1 << down >> 1;
    int32_t inverse_q14 = port_divide((1 << 29) - 1, (pivot * (1 << (2 * half))) >> 15);
    equations->half[j] = (int8_t)half;
    equations->inverse_q14[j] = inverse_q14;
    int32_t own = fixed_clamp((right[j] + round) >> down, -(1 << 15), 1 << 15);
    right[j] = (own * inverse_q14 + (1 << 14)) >> 15;
    int32_t over[UNKNOWNS];
    for (int i = j + 1; i < count; i++) {
      int32_t *row = matrix[i];
      int32_t twice = fixed_clamp((row[j] + round) >> down, -(1 << 15), 1 << 15) * 2; /* Q16 */
      row[j] = over[i] = (twice * inverse_q14 + (1 << 15)) >> 16;
      right[i] -= twice * right[j];
      for (int k = j + 1; k <= i; k++) {
        row[k] -= twice * over[k];
      }
    }
  }
}

/* x of L^T x = right, Q20 in the columns' units. */
static NOINLINE void substitute(const struct fit_shapes_equations *equations, const int32_t *right,
                                int32_t *x_q20) {
  const int32_t(*matrix)[UNKNOWNS] = equations->matrix;
  for (int j = equations->count - 1; j >= 0; j--) {
    int32_t sum = right[j] * 64;
    for (int i = j + 1; i < equations->count; i++) {
      sum -= fixed_mul_16(x_q20[i], matrix[i][j] >> 1) * 8;
    }
    x_q20[j] = fixed_clamp(sum, -(1 << 24), 1 << 24) * (1 << equations->half[j]);
  }
}

static const int32_t limit_of[UNKNOWNS] = {AMPLITUDE_MAX, PLACE_X_MAX, PLACE_Y_MAX, 0,
                                           ONE_Q20 / 8,   SPAN_MAX,    SPAN_MAX,    0, 0};

static NOINLINE void take_step(const struct fit_shapes_pad *pad, int model,
                               const struct fit_shapes_equations *equations, const int32_t *x_q20,
                               struct fit_shapes_at *at) {
  int32_t move[UNKNOWNS], most_q14 = 1 << 14;
  int32_t amplitude = at->value[AMPLITUDE];
  for (int u = 0; u < equations->count; u++) {
    move[u] = shifted(x_q20[u], equations->q[u] - equations->q[RESIDUAL]);
    int32_t limit = u == AMPLITUDE ? amplitude >> 1
                    : u == SPREAD  ? MOVE_MAX / 4
                    : u == FAR     ? MOVE_MAX / 4
                    : u < BALANCE  ? MOVE_MAX
                    : model == TWO ? MOVE_MAX * 2
                                   : amplitude / 4;
    int32_t size = (int32_t)fixed_size(move[u]) >> 6;
    int32_t share_q14 = port_divide((size < 1 << 16 ? size : 1 << 16) << 14, (limit >> 6) | 1);
    most_q14 = share_q14 > most_q14 ? share_q14 : most_q14;
  }
  int32_t share_q14 = port_divide(1 << 28, most_q14);
  for (int u = 0; u < equations->count; u++) {
    int32_t limit = limit_of[u];
    if (u >= BALANCE) {
      limit = model == TWO ? BALANCE_MAX : amplitude;
    }
    if (most_q14 > 1 << 14) {
      move[u] = fixed_mul_16(move[u], share_q14) * 4;
    }
    move[u] = fixed_clamp(move[u], -(1 << 22), 1 << 22);
    at->value[u] = u == SPREAD ? fixed_clamp(at->value[u] + move[u], pad->spread_least_q20,
                                             pad->spread_most_q20)
                               : fixed_clamp(at->value[u] + move[u], -limit, limit);
  }
  if (at->value[AMPLITUDE] < AMPLITUDE_LEAST) {
    at->value[AMPLITUDE] = AMPLITUDE_LEAST;
  }
}

/* chi^2 of the residuals and priors, Q8. */
static int32_t chi_square_of(const struct problem *problem,
                             const struct fit_shapes_equations *equations) {
  struct scaled base = fit_scaled_from(problem->base_q22, -22);
  struct scaled squares =
      fit_scaled_from(equations->residual_square, -2 * equations->q[RESIDUAL]);
  return fit_scaled_to_fixed(scaled_div(squares, scaled_mul(base, base)), 8);
}

/* At a limit that it wants to pass the spread is no unknown: the others would step as if it moved.
 */
static void hold_spread(const struct fit_shapes_pad *pad, struct fit_shapes_equations *equations,
                        int32_t spread) {
  int32_t right = equations->right[SPREAD];
  if (!((spread < pad->spread_least_q20 + 256 && right < 0) ||
        (spread > pad->spread_most_q20 - 256 && right > 0))) {
    return;
  }
  for (int u = 0; u < SPREAD; u++) {
    equations->matrix[SPREAD][u] = 0;
  }
  for (int u = SPREAD; u < equations->count; u++) {
    equations->matrix[u][SPREAD] = 0;
  }
  equations->right[SPREAD] = 0;
}

/* Factors of the damped matrix; right: of the step that it asks for. */
static NOINLINE void factorise(struct fit_shapes_equations *equations, int32_t spread,
                               const struct fit_shapes_pad *pad, int32_t *right) {
  hold_spread(pad, equations, spread);
  for (int u = 0; u < equations->count; u++) {
    right[u] = equations->right[u];
    equations->matrix[u][u] += equations->matrix[u][u] >> DAMPING_SHIFT;
  }
  eliminate(equations, right);
}

static NOINLINE bool weigh(const struct fit_array *array, const struct fit_settings *settings,
                           uint32_t used, struct problem *problem) {
  const struct readings *readings = &problem->readings;
  int32_t noise = fixed_clamp(shifted(settings->noise_Pa_q10, readings->shift - 6), 1, 1 << 18);
  problem->base_q22 =
      fixed_longer_leg(noise, ((readings->largest_q28 >> 14) * MODEL_SD_Q16) >> 8);
  int sensors = 0;
  for (int k = 0; k < NODES; k++) {
    uint8_t sensor = array->grid.sensor[k];
    problem->pad->room.weight_q12[k] = 0;
    if (used >> sensor & 1) {
      int32_t gain = (int32_t)((uint32_t)settings->gain_sd_q16[sensor] *
                                   fixed_size(readings->q14[k]) >> 8);
      problem->pad->room.weight_q12[k] = port_divide(
          problem->base_q22 << 8, fixed_longer_leg(problem->base_q22, gain) >> 4);
      sensors++;
    }
  }
  return sensors >= FIT_SHAPES_SENSORS && problem->base_q22 <= BASE_MAX_Q22;
}

static int32_t sum_of(const struct readings *readings) {
  int32_t sum_q20 = 0;
  for (int k = 0; k < NODES; k++) {
    sum_q20 += readings->q28[k] >> 8;
  }
  return sum_q20;
}

static int32_t place_q20(const struct fit_shapes_pad *pad, float mm) {
  return fixed_mul_q28(fixed_clamp(fit_fixed(mm, 20), -(1 << 29), 1 << 29), pad->per_pitch_q28);
}

static int32_t pitches_q20(float pitches) {
  return fixed_clamp(fit_fixed(pitches, 20), -PLACE_Y_MAX, PLACE_Y_MAX);
}

/* Where the pair may be: along the Gaussian's longer axis, equal or three to one either way; or
 * under the largest reading and where it leaves most. */
static void set_pair(float x, float y, float dx, float dy, float share, struct fit_shapes_at *at) {
  at->value[PLACE_X] = pitches_q20(x - share * dx);
  at->value[PLACE_Y] = pitches_q20(y - share * dy);
  at->value[SPAN_X] = pitches_q20(dx);
  at->value[SPAN_Y] = pitches_q20(dy);
  at->value[BALANCE] = fit_fixed(share, 20);
}

static NOINLINE void set_pair_by_readings(const struct problem *problem,
                                          struct fit_shapes_at *at) {
  const struct readings *readings = &problem->readings;
  int first = 0, second = -1;
  int32_t most = 0;
  struct terms terms;
  set_terms(problem, at->value[SPREAD], false, &terms);
  for (int k = 1; k < NODES; k++) {
    first = readings->q14[k] > readings->q14[first] ? k : first;
  }
  int32_t height_q14 = terms.h_q14[0] + terms.h_q14[1];
  struct squares squares;
  struct bell narrow, wide;
  set_squares((first / ROWS - COLUMNS / 2) * 4096, (first % ROWS - ROWS / 2) * 4096, &squares);
  set_bell(&squares, terms.k_q24[0], &narrow);
  set_bell(&squares, terms.k_q24[1], &wide);
  for (int k = 0; k < NODES; k++) {
    int32_t e_q15 = (narrow.x_q15[k / ROWS] * narrow.y_q15[k % ROWS]) >> 15;
    int32_t wide_q15 = (wide.x_q15[k / ROWS] * wide.y_q15[k % ROWS]) >> 15;
    int32_t s_q14 = (terms.h_q14[0] * e_q15 + terms.h_q14[1] * wide_q15) >> 15;
    int32_t left = readings->q14[k] - port_divide(readings->q14[first] * s_q14, height_q14);
    if (left > most) {
      most = left;
      second = k;
    }
  }
  if (second < 0) {
    return;
  }
  int32_t both = readings->q14[first] + most;
  at->value[AMPLITUDE] = port_divide(both << 14, height_q14) << 6;
  at->value[PLACE_X] = (first / ROWS + second / ROWS - 2 * (COLUMNS / 2)) * (ONE_Q20 / 2);
  at->value[PLACE_Y] = (first % ROWS + second % ROWS - 2 * (ROWS / 2)) * (ONE_Q20 / 2);
  at->value[SPAN_X] = (first / ROWS - second / ROWS) * (ONE_Q20 / 2);
  at->value[SPAN_Y] = (first % ROWS - second % ROWS) * (ONE_Q20 / 2);
  at->value[BALANCE] = port_divide((readings->q14[first] - most) << 14, both) << 6;
}

/* Sum of the squares of a pair's residuals, Q16: one with a good start has less. */
static NOINLINE int32_t residuals_at(const struct problem *problem, struct fit_shapes_at *at) {
  round_places(at);
  set_rows(problem, TWO, SPAN_X, at, problem->pad->room.equations);
  int32_t sum_q16 = 0;
  for (int k = 0; k < NODES; k++) {
    int32_t residual_q13 = problem->pad->room.row[k][RESIDUAL] >> 15;
    sum_q16 += (residual_q13 * residual_q13) >> 10;
  }
  return sum_q16;
}

static NOINLINE void begin(const struct problem *problem, const struct fit_result *fit,
                           struct fit_shapes_state *state) {
  const struct fit_shapes_pad *pad = problem->pad;
  const float per = pad->per_pitch;
  struct fit_shapes_at at = {{0}};
  float variance = fit->sigma_mm * fit->sigma_mm * per * per;
  /* The longer axis: half the difference of its variance to the other's, and its direction. */
  float half = 0.0f, along_x = 1.0f, along_y = 0.0f;
  if (fit->flags & CONTACT_FLAG_WIDTHS_VALID) {
    float sx = fit->sigma_x_mm * per, sy = fit->sigma_y_mm * per;
    float difference = 0.5f * (sx * sx - sy * sy), slant = fit->width_correlation * sx * sy;
    half = sqrtf(difference * difference + slant * slant);
    if (half > 0.0f) {
      float cosine = difference / half;
      along_x = sqrtf(fmaxf(0.5f + 0.5f * cosine, 0.0f));
      along_y = sqrtf(fmaxf(0.5f - 0.5f * cosine, 0.0f));
      along_y = slant < 0.0f ? -along_y : along_y;
    }
  }
  float excess = fminf(fmaxf(2.0f * half, 0.05f), 2.5f);
  float widest = pad->widest_mm2 * per * per;
  float spread = fminf(fmaxf(variance - half - 0.912f * widest, 0.0f), 0.1f);
  float x = fit->x_mm * per - fit_float(pad->origin_x_q20, -20);
  float y = fit->y_mm * per - fit_float(pad->origin_y_q20, -20);
  struct scaled amplitude = fit_grid_scaled(fit->force_N / (1.0753f * pad->force_unit_N));
  amplitude.exponent += problem->readings.shift - 18;
  at.value[AMPLITUDE] =
      fixed_clamp(fit_scaled_to_fixed(amplitude, 20), AMPLITUDE_LEAST, AMPLITUDE_MAX);
  at.value[SPREAD] = fit_fixed(spread, 20);
  at.value[PLACE_X] = pitches_q20(x);
  at.value[PLACE_Y] = pitches_q20(y);
  state->at[ROUND] = at;
  float reach = sqrtf(excess);
  float line = fminf(1.7320508f * reach, 1.4f);
  at.value[SPAN_X] = pitches_q20(line * along_x);
  at.value[SPAN_Y] = pitches_q20(line * along_y);
  state->at[LONG] = at;
  int32_t least = INT32_MAX;
  for (int start = 0; start < 4; start++) {
    static const float share[3] = {0.0f, 0.5f, -0.5f};
    struct fit_shapes_at pair = at;
    if (start < 3) {
      float by = share[start] == 0.0f ? reach : 1.1547005f * reach;
      set_pair(x, y, by * along_x, by * along_y, share[start], &pair);
    } else {
      set_pair_by_readings(problem, &pair);
    }
    int32_t chi_square = residuals_at(problem, &pair);
    if (chi_square < least) {
      least = chi_square;
      state->at[TWO] = pair;
    }
  }
}

/* Variance of a sum of two unknowns times these, each at most some pitches or units of the
 * readings. */
static NOINLINE struct scaled variance_of(const struct fit_shapes_equations *equations, int first,
                                          int32_t a_q20, int second, int32_t b_q20) {
  const int32_t(*matrix)[UNKNOWNS] = equations->matrix;
  int32_t w_q10[UNKNOWNS], sum_q13 = 0;
  int32_t q = equations->q[first] > equations->q[second] ? equations->q[first]
                                                         : equations->q[second];
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
                             const struct fit_shapes_equations *equations,
                             const int32_t *at, const struct scales *scales,
                             struct fit_shapes_result *result) {
  const struct fit_shapes_pad *pad = problem->pad;
  for (int c = 0; c < 2; c++) {
    int32_t sign = (c == 0) == (at[BALANCE] >= 0) ? 1 : -1;
    int32_t share_q20 = (ONE_Q20 + sign * at[BALANCE]) / 2;
    result->x_mm[c] = mm(pad, pad->origin_x_q20 + at[PLACE_X] + sign * at[SPAN_X]);
    result->y_mm[c] = mm(pad, pad->origin_y_q20 + at[PLACE_Y] + sign * at[SPAN_Y]);
    result->force_N[c] =
        product_of(scales->unit, scaled_mul(fit_scaled_from(at[AMPLITUDE], -20),
                                            fit_scaled_from(share_q20, -20)));
    struct scaled place =
        scaled_add(variance_of(equations, PLACE_X, ONE_Q20, SPAN_X, sign * ONE_Q20),
                   variance_of(equations, PLACE_Y, ONE_Q20, SPAN_Y, sign * ONE_Q20));
    result->location_sd_mm[c] = sd_of(scales->pitch, place, scales->variance);
    struct scaled force = variance_of(equations, AMPLITUDE, share_q20, BALANCE,
                                      sign * (at[AMPLITUDE] >> 1));
    result->force_sd_N[c] = sd_of(scales->unit, force, scales->variance);
  }
}

static NOINLINE void put_line(const struct fit_shapes_equations *equations,
                              const int32_t *at, const struct scales *scales,
                              struct fit_shapes_result *result) {
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
  struct scaled sure = scaled_mul(variance_of(equations, SPAN_X, ux_q20, SPAN_Y, uy_q20),
                                  scales->variance);
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
      sd_of(fit_grid_reciprocal(reach),
            variance_of(equations, SPAN_X, -uy_q20, SPAN_Y, ux_q20), scales->variance);
}

static NOINLINE void put_one(const struct problem *problem,
                             const struct fit_shapes_equations *equations,
                             const int32_t *at, const struct scales *scales,
                             struct fit_shapes_result *result) {
  const struct fit_shapes_pad *pad = problem->pad;
  result->x_mm[0] = mm(pad, pad->origin_x_q20 + at[PLACE_X]);
  result->y_mm[0] = mm(pad, pad->origin_y_q20 + at[PLACE_Y]);
  result->force_N[0] = product_of(scales->unit, fit_scaled_from(at[AMPLITUDE], -20));
  struct scaled place = scaled_add(variance_of(equations, PLACE_X, ONE_Q20, PLACE_Y, 0),
                                   variance_of(equations, PLACE_Y, ONE_Q20, PLACE_X, 0));
  result->location_sd_mm[0] = sd_of(scales->pitch, place, scales->variance);
  result->force_sd_N[0] = sd_of(
      scales->unit, variance_of(equations, AMPLITUDE, ONE_Q20, FAR, 0), scales->variance);
}

static int best_of(const int32_t *chi_square_q8, const int32_t *two) {
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

static void set_dip(const struct fit_settings *settings, struct problem *problem) {
  problem->dip_share_q16 = 0;
  problem->dip_k_q24 = 1 << 24;
  if (fit_has_dip(settings)) {
    float sd = settings->dip_sd_mm * problem->pad->per_pitch;
    problem->dip_share_q16 = fit_fixed(settings->dip_share, 16);
    problem->dip_k_q24 = fit_fixed(LOG2E_HALF_FLOAT / (sd > 0.5f ? sd * sd : 0.25f), 24);
  }
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

static void conclude(const struct problem *problem, int best, const int32_t *chi_square_q8,
                     const struct fit_shapes_state *state, struct fit_shapes_result *result) {
  const struct fit_shapes_equations *equations = &problem->pad->room.equations[best];
  const struct fit_shapes_at *at = &state->at[best];
  const struct fit_shapes_pad *pad = problem->pad;
  struct scaled base = fit_scaled_from(problem->base_q22, -22);
  struct scaled variance = scaled_mul(base, base);
  if (chi_square_q8[best] > FREEDOM << 8) {
    variance = scaled_mul(variance, fit_scaled_from(port_divide(chi_square_q8[best], FREEDOM), -8));
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

static void follow(const struct problem *problem, const struct fit_result *fit,
                   struct fit_shapes_state *state, int32_t sum_q20) {
  const struct fit_shapes_pad *pad = problem->pad;
  int32_t x = place_q20(pad, fit->x_mm) - pad->origin_x_q20;
  int32_t y = place_q20(pad, fit->y_mm) - pad->origin_y_q20;
  if (state->frames > 0 && (sum_q20 < 1 << 18 || state->sum_q20 < 1 << 18 ||
                            sum_q20 >> 2 >= state->sum_q20 || state->sum_q20 >> 2 >= sum_q20)) {
    state->frames = 0;
  }
  if (state->frames > 0) {
    int32_t share_q13 = fixed_clamp(port_divide(sum_q20, state->sum_q20 >> 13), 0, INT16_MAX);
    for (int m = 0; m < MODELS; m++) {
      int32_t *value = state->at[m].value;
      value[AMPLITUDE] = shifted(fixed_mul_16(value[AMPLITUDE], share_q13), 3);
      value[AMPLITUDE] = fixed_clamp(value[AMPLITUDE], AMPLITUDE_LEAST, AMPLITUDE_MAX);
      value[PLACE_X] += x - state->fit_x_q20;
      value[PLACE_Y] += y - state->fit_y_q20;
      value[PLACE_X] = fixed_clamp(value[PLACE_X], -PLACE_X_MAX, PLACE_X_MAX);
      value[PLACE_Y] = fixed_clamp(value[PLACE_Y], -PLACE_Y_MAX, PLACE_Y_MAX);
      if (m == LONG) {
        value[PULL_X] = shifted(fixed_mul_16(value[PULL_X], share_q13), 3);
        value[PULL_Y] = shifted(fixed_mul_16(value[PULL_Y], share_q13), 3);
      }
    }
  }
  state->fit_x_q20 = x;
  state->fit_y_q20 = y;
  state->sum_q20 = sum_q20;
}

static void set_residuals(const struct problem *problem, int model, struct fit_shapes_state *state,
                          struct priors *priors, int32_t *chi_square_q8) {
  struct fit_shapes_equations *equations = &problem->pad->room.equations[model];
  const bool early = model == LONG && state->frames < FIRST_WITH_LOAD;
  struct fit_shapes_at *at = &state->at[model];
  round_places(at);
  set_rows(problem, model, early ? BALANCE : unknowns_of[model], at, equations);
  form_residuals(problem, at->value, priors, equations);
  *chi_square_q8 = chi_square_of(problem, equations);
}

/* After set_residuals of the model. */
static void step(const struct problem *problem, int model, struct fit_shapes_state *state,
                 const struct priors *priors) {
  struct fit_shapes_pad *pad = problem->pad;
  struct fit_shapes_equations *equations = &pad->room.equations[model];
  int32_t right[UNKNOWNS], x_q20[UNKNOWNS] = {0};
  form(pad, priors, equations);
  factorise(equations, state->at[model].value[SPREAD], pad, right);
  substitute(equations, right, x_q20);
  take_step(pad, model, equations, x_q20, &state->at[model]);
}

bool fit_shapes(const struct fit_array *array, struct fit_shapes_pad *pad,
                const int32_t *pressure_Pa_q10, const struct fit_settings *settings,
                const struct fit_result *fit, struct fit_shapes_state *state,
                struct fit_shapes_result *result) {
  struct problem problem;
  problem.pad = pad;
  if (!(fit->flags & CONTACT_FLAG_FIT_VALID) || settings->noise_Pa_q10 < 1 ||
      !fit_grid_take_readings(array, pressure_Pa_q10, fit->used, settings, &problem.readings) ||
      !weigh(array, settings, fit->used, &problem)) {
    state->frames = 0;
    *result = (struct fit_shapes_result){0};
    return true;
  }
  set_dip(settings, &problem);
  follow(&problem, fit, state, sum_of(&problem.readings));
  if (state->frames == 0) {
    begin(&problem, fit, state);
    state->frames = 1;
    *result = (struct fit_shapes_result){0};
    return true;
  }
  state->frames = state->frames == LAST_FRAME ? FIRST_ANSWER : state->frames + 1;
  const bool answers = state->frames >= FIRST_ANSWER && state->frames < LAST_FRAME;
  int32_t chi_square_q8[MODELS];
  for (int m = LONG; m <= TWO; m++) {
    struct priors priors;
    set_residuals(&problem, m, state, &priors, &chi_square_q8[m]);
    step(&problem, m, state, &priors);
  }
  struct priors priors;
  set_residuals(&problem, ROUND, state, &priors, &chi_square_q8[ROUND]);
  if (!answers) {
    step(&problem, ROUND, state, &priors);
    return false;
  }
  int best = best_of(chi_square_q8, state->at[TWO].value);
  *result = (struct fit_shapes_result){0};
  for (int m = 0; m < MODELS; m++) {
    result->chi_square[m] = fit_float(chi_square_q8[m], -8);
  }
  if (chi_square_q8[best] > CHI_SQUARE_MAX << 8) {
    result->shape = FIT_SHAPE_NONE;
    state->frames = 0;
    return true;
  }
  if (best == ROUND) {
    step(&problem, ROUND, state, &priors);
  }
  conclude(&problem, best, chi_square_q8, state, result);
  return true;
}
