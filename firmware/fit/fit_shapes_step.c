/* One damped Gauss-Newton step of a model. */
#include "fit/fit_shapes_parts.h"

#define PER_FAR_SD_Q4 1600      /* 1 / 0.01 */
#define PER_TANGENTIAL_SD_Q4 53 /* 1 / 0.3: Q / F of what is held */
#define SPAN_MAX (3 << 20)
#define BALANCE_MAX (15 << 16) /* 0.94 */
#define MOVE_MAX (1 << 18)     /* a quarter of a pitch */
/* Damping of the diagonal. With less, noise moves unknowns far that readings hardly determine; with more, standard deviations are too small
 * (NUMERICS.md, "Contact shape"). */
#define STEP_DAMPING_SHIFT 6
#define ANSWER_DAMPING_SHIFT 10

/* Columns are at most 2 pitches or units of the readings, in Q(27 - COLUMN_SHIFT). */
#define COLUMN_MAX ((1 << 16) - 1)
#define COLUMN_SHIFT (NODES > 15 ? 16 : 15)
#define COLUMN_BITS (28 - COLUMN_SHIFT) /* so that sums over the nodes and a prior hold */
#define PRIOR_MAX ((1 << COLUMN_BITS) - 1)

/* The column with its weights and bits; returns the sum of its squares. */
static NOINLINE int32_t put_column(struct fit_shapes_pad *pad, int u) {
  const int32_t *row = &pad->work.row[0][u], *weight_q12 = pad->work.weight_q12;
  int32_t *column = pad->work.column[u];
  int32_t squares = 0;
  for (int k = 0; k < NODES; k++, row += UNKNOWNS + 1) {
    int32_t value = *row;
    if ((uint32_t)value + COLUMN_MAX > 2u * COLUMN_MAX) {
      value = value < 0 ? -COLUMN_MAX : COLUMN_MAX;
    }
    value = (value * weight_q12[k] + (1 << (COLUMN_SHIFT - 1))) >> COLUMN_SHIFT;
    column[k] = value;
    squares += value * value;
  }
  return squares;
}

/* The same of the residuals, as many bits as there are. */
static NOINLINE int32_t put_residuals(struct fit_shapes_pad *pad, uint32_t size, struct fit_shapes_equations *equations) {
  int32_t shift = fixed_bits(size) - COLUMN_BITS;
  shift = shift < 1 ? 1 : shift;
  equations->q[RESIDUAL] = (int8_t)(28 - shift);
  const int32_t *row = &pad->work.row[0][RESIDUAL];
  int32_t *column = pad->work.column[RESIDUAL];
  int32_t squares = 0, half = 1 << (shift - 1);
  for (int k = 0; k < NODES; k++, row += UNKNOWNS + 1) {
    int32_t value = (*row + half) >> shift;
    column[k] = value;
    squares += value * value;
  }
  return squares;
}

/* The sums of the products of a column with two others. */
static NOINLINE void sum_products(const int32_t *a, const int32_t *b, const int32_t *c, int32_t sums[2]) {
  int32_t first = 0, second = 0;
  for (int k = 0; k < NODES; k++) {
    int32_t value = a[k];
    first += value * b[k];
    second += value * c[k];
  }
  sums[0] = first;
  sums[1] = second;
}
static void put_prior(int u, int32_t element_q27, int32_t off_q20, struct priors *priors) {
  const int32_t element_q15 = element_q27 >> 12;
  const int32_t most_q16 = port_divide(INT32_MAX, element_q15 > 1 ? element_q15 : 1);
  priors->element_q27[u] = element_q27;
  priors->off_q28[u] = element_q15 * fixed_clamp(off_q20 >> 4, -most_q16, most_q16) >> 3;
}

void fit_shapes_form_residuals(struct fit_shapes_pad *pad, const int32_t *at, struct priors *priors,
                               struct fit_shapes_equations *equations) {
  int32_t base_q23 = pad->work.frame.base_q22 * 2;
  for (int u = 0; u < UNKNOWNS; u++) {
    priors->element_q27[u] = priors->off_q28[u] = 0;
  }
  put_prior(SPREAD, base_q23 * pad->per_spread_sd_q4, pad->spread_q20 - at[SPREAD], priors);
  put_prior(FAR, base_q23 * PER_FAR_SD_Q4, -at[FAR], priors);
  if (equations->tangential) {
    int32_t per_q4 = port_divide(PER_TANGENTIAL_SD_Q4 << 16, at[AMPLITUDE] >> 4);
    int32_t element_q27 = base_q23 * (per_q4 < PER_SD_MAX_Q4 ? per_q4 : PER_SD_MAX_Q4);
    put_prior(equations->tangential, element_q27, -at[equations->tangential], priors);
    put_prior(equations->tangential + 1, element_q27, -at[equations->tangential + 1], priors);
  }
  uint32_t size = equations->residual_size;
  for (int u = SPREAD; u < equations->count; u++) {
    size |= fixed_magnitude(priors->off_q28[u]);
  }
  equations->residual_square = put_residuals(pad, size, equations);
  int32_t shift = 28 - equations->q[RESIDUAL];
  for (int u = SPREAD; u < equations->count; u++) {
    int32_t residual = priors->off_q28[u] >> shift;
    priors->off_q28[u] = residual;
    equations->residual_square += residual * residual;
  }
}

/* The normal matrix, of which the diagonal is 2^28 to 2^30. */
static NOINLINE void form(struct fit_shapes_pad *pad, const struct priors *priors, struct fit_shapes_equations *equations) {
  int8_t up[UNKNOWNS] = {0};
  for (int u = 0; u < equations->count; u++) {
    int32_t prior = priors->element_q27[u] >> COLUMN_SHIFT;
    prior = prior < PRIOR_MAX ? prior : PRIOR_MAX;
    int32_t squares = put_column(pad, u) + prior * prior;
    up[u] = (int8_t)(squares >> 30 ? 0 : (30 - fixed_bits((uint32_t)squares | 1)) >> 1);
    equations->matrix[u][u] = squares * (1 << (2 * up[u]));
    equations->right[u] = prior * priors->off_q28[u];
    equations->q[u] = (int8_t)(27 - COLUMN_SHIFT + up[u]);
  }
  for (int a = 0; a < equations->count; a++) {
    int32_t(*column)[MAX_NODES] = pad->work.column;
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

/* L D L^T in place, below the diagonal L 2^-half in Q14. An unknown that is not separable from those
 * before stays where it is. right: 2^-half times the elements of D^-1 L^-1 right, Q14. */
static NOINLINE void eliminate(struct fit_shapes_equations *equations, int32_t *right) {
  for (int j = 0; j < equations->count; j++) {
    int32_t factor[UNKNOWNS];
    struct fixed_pivot pivot = fixed_eliminate(equations->matrix[0], UNKNOWNS, equations->count, j, right, factor);
    equations->half[j] = (int8_t)pivot.half;
    equations->inverse_q14[j] = pivot.inverse_q14;
    right[j] = pivot.quotient;
    for (int i = j + 1; i < equations->count; i++) {
      equations->matrix[i][j] = factor[i];
    }
  }
}

/* x of L^T x = right, Q20 in the columns' units. */
static NOINLINE void substitute(const struct fit_shapes_equations *equations, const int32_t *right, int32_t *x_q20) {
  const int32_t(*matrix)[UNKNOWNS] = equations->matrix;
  for (int j = equations->count - 1; j >= 0; j--) {
    int32_t sum = right[j] * 64;
    for (int i = j + 1; i < equations->count; i++) {
      sum -= fixed_mul_16(x_q20[i], matrix[i][j] >> 1) * 8;
    }
    x_q20[j] = fixed_clamp(sum, -(1 << 24), 1 << 24) * (1 << equations->half[j]);
  }
}

static NOINLINE void take_step(const struct fit_shapes_pad *pad, int model, const struct fit_shapes_equations *equations,
                               const int32_t *x_q20, struct fit_shapes_at *at) {
  const int32_t limit_of[UNKNOWNS] = {
      AMPLITUDE_MAX, LOCATION_MAX_OF(COLUMNS), LOCATION_MAX_OF(ROWS), 0, ONE_Q20 / 8, SPAN_MAX, SPAN_MAX, 0, 0};
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
    int32_t size = (int32_t)fixed_magnitude(move[u]) >> 6;
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
    const int32_t middle = u == LOCATION_X ? MIDDLE_OF(COLUMNS) : u == LOCATION_Y ? MIDDLE_OF(ROWS) : 0;
    at->value[u] = u == SPREAD ? fixed_clamp(at->value[u] + move[u], pad->spread_min_q20, pad->spread_max_q20)
                               : fixed_clamp(at->value[u] + move[u], middle - limit, middle + limit);
  }
  if (at->value[AMPLITUDE] < AMPLITUDE_MIN) {
    at->value[AMPLITUDE] = AMPLITUDE_MIN;
  }
}

int32_t fit_shapes_chi_square(const struct fit_shapes_pad *pad, const struct fit_shapes_equations *equations) {
  struct scaled base = fit_scaled_from(pad->work.frame.base_q22, -22);
  struct scaled squares = fit_scaled_from(equations->residual_square, -2 * equations->q[RESIDUAL]);
  return fit_scaled_to_fixed(scaled_div(squares, scaled_mul(base, base)), 8);
}

/* A spread at a limit that its step would pass is held, as the others would step as if it moved. */
static void hold_spread(const struct fit_shapes_pad *pad, struct fit_shapes_equations *equations, int32_t spread) {
  int32_t right = equations->right[SPREAD];
  if (!((spread < pad->spread_min_q20 + 256 && right < 0) || (spread > pad->spread_max_q20 - 256 && right > 0))) {
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
static NOINLINE void factorise(struct fit_shapes_equations *equations, int32_t spread, const struct fit_shapes_pad *pad, int damping_shift,
                               int32_t *right) {
  hold_spread(pad, equations, spread);
  for (int u = 0; u < equations->count; u++) {
    right[u] = equations->right[u];
    equations->matrix[u][u] += equations->matrix[u][u] >> damping_shift;
  }
  eliminate(equations, right);
}

void fit_shapes_step(struct fit_shapes_pad *pad, int model, const struct priors *priors, struct fit_shapes_at *at) {
  struct fit_shapes_equations *equations = &pad->work.equations[model];
  int32_t right[UNKNOWNS], x_q20[UNKNOWNS] = {0};
  form(pad, priors, equations);
  factorise(equations, at->value[SPREAD], pad, STEP_DAMPING_SHIFT, right);
  substitute(equations, right, x_q20);
  take_step(pad, model, equations, x_q20, at);
}

void fit_shapes_factorise(struct fit_shapes_pad *pad, int model, const struct priors *priors, const struct fit_shapes_at *at) {
  struct fit_shapes_equations *equations = &pad->work.equations[model];
  int32_t right[UNKNOWNS];
  form(pad, priors, equations);
  factorise(equations, at->value[SPREAD], pad, ANSWER_DAMPING_SHIFT, right);
}
