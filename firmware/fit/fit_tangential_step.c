/* One Gauss-Newton step: the normal equations with the priors, their solution, and its limits. */
#include "fit/fit_tangential_parts.h"

#include <string.h>

/* The rows that priors add: of SPREAD, ELONGATION_1 and ELONGATION_2, each alone in its own. */
struct priors {
  int32_t row_q26[UNKNOWNS];
  int32_t residual[UNKNOWNS]; /* Q24, then as the residuals */
};

static void set_priors(const struct problem *problem, const struct fit_tangential_unknowns *at, struct priors *priors) {
  memset(priors, 0, sizeof *priors);
  priors->row_q26[SPREAD] = problem->spread_prior_q26;
  priors->row_q26[ELONGATION_1] = priors->row_q26[ELONGATION_2] = problem->elongation_prior_q26;
  priors->residual[SPREAD] = fixed_mul_q28(problem->pad->spread_q26 - at->t_q26, problem->spread_prior_q26);
  priors->residual[ELONGATION_1] = fixed_mul_q28(-at->e1_q26, problem->elongation_prior_q26);
  priors->residual[ELONGATION_2] = fixed_mul_q28(-at->e2_q26, problem->elongation_prior_q26);
}

/* Bits of a column, so that sums over the nodes and a prior hold; residuals have one more. */
#define COLUMN_BITS (NODES > 15 ? 12 : 13)
#define SCALE_MAX (15 - COLUMN_BITS)
/* Nodes that a loop takes at a time. */
#define TOGETHER (NODES % 3 == 0 ? 3 : NODES % 2 == 0 ? 2 : 1)

/* Brings residuals to their bits; returns their Q less one. */
NOINLINE static int32_t normalise_residuals(int32_t *residual, struct priors *priors) {
  uint32_t largest = 1;
  for (int k = 0; k < NODES; k++) {
    largest |= fixed_magnitude(residual[k]);
  }
  for (int u = SPREAD; u <= ELONGATION_2; u++) {
    largest |= fixed_magnitude(priors->residual[u]);
  }
  /* What rounding carries over counts as a bit more. */
  int32_t shift = fixed_bits(largest + (largest >> 8)) - (COLUMN_BITS + 1);
  int32_t down = shift > 0 ? shift : 0, up = shift < 0 ? -shift : 0;
  int32_t half = (1 << down) >> 1;
  for (int k = 0; k < NODES; k++) {
    residual[k] = ((residual[k] + half) >> down) * (1 << up);
  }
  for (int u = SPREAD; u <= ELONGATION_2; u++) {
    priors->residual[u] = ((priors->residual[u] + half) >> down) * (1 << up);
  }
  return 24 - shift - 1;
}

/* The normal equations, each unknown scaled so that its diagonal element is 2^28 .. 2^30. */
struct equations {
  int32_t right_q26[UNKNOWNS];
  int32_t column_q[UNKNOWNS]; /* a column's integer is its value times 2^q */
  int32_t scale[UNKNOWNS];
};

/* Over a column, whose elements are UNKNOWNS apart. */
NOINLINE static uint32_t column_size(const int32_t *column, uint32_t largest) {
  const int32_t *end = column + NODES * UNKNOWNS;
  const int together = TOGETHER;
  do {
    largest |= fixed_magnitude(column[0]) | (together > 1 ? fixed_magnitude(column[UNKNOWNS]) : 0) |
               (together > 2 ? fixed_magnitude(column[2 * UNKNOWNS]) : 0);
    column += together * UNKNOWNS;
  } while (column != end);
  return largest;
}

/* Divides a column by 2^shift; gives its square sum, and adds its products with the residuals. */
NOINLINE static int32_t shift_column(int32_t *column, const int32_t *residual, int32_t shift, int32_t *right) {
  const int32_t *end = residual + NODES;
  int32_t squares = 0, other = *right, half = (1 << shift) >> 1;
  const int together = TOGETHER;
  do {
    _Pragma("GCC unroll 3") for (int k = 0; k < together; k++) {
      int32_t value = (column[k * UNKNOWNS] + half) >> shift;
      column[k * UNKNOWNS] = value;
      other += value * residual[k];
      squares += value * value;
    }
    column += together * UNKNOWNS;
    residual += together;
  } while (residual != end);
  *right = other;
  return squares;
}

/* Brings a column to its bits at most, and its prior with it. */
NOINLINE static void normalise_column(struct fit_tangential_work *work, int u, int32_t prior_q26, int32_t prior_residual,
                                      struct equations *equations) {
  int32_t *column = &work->node[0].column[u];
  int32_t q = fit_tangential_column_q[u];
  uint32_t largest = column_size(column, fixed_magnitude(prior_q26) >> (26 - q));
  int32_t shift = fixed_bits(largest + (largest >> 8)) - COLUMN_BITS;
  shift = shift < 0 ? 0 : shift; /* fewer bits of a column so small, which is no pad's */
  q -= shift;
  int32_t row = shifted(prior_q26, q - 26);
  int32_t right = row * prior_residual;
  int32_t squares = shift_column(column, work->residual, shift, &right) + row * row;
  int32_t scale = (30 - fixed_bits((uint32_t)squares)) >> 1;
  scale = scale > SCALE_MAX ? SCALE_MAX : scale;
  equations->scale[u] = scale;
  equations->column_q[u] = q + scale;
  equations->right_q26[u] = right >> (5 - scale);
  work->matrix[u][u] = squares * (1 << (2 * scale));
}

/* Four sums in as many registers as a Cortex-M0+ has for them. */
FIXED_INLINE void sum_products(const int32_t *row, const int32_t *end, int32_t *sums, int a, int b, int c, int d) {
  int32_t ab = 0, ac = 0, ad = 0, al = 0;
  do {
    int32_t value = row[a];
    ab += row[b] * value;
    ac += row[c] * value;
    ad += row[d] * value;
    al += row[UNKNOWNS - 1] * value;
    row += UNKNOWNS;
  } while (row != end);
  sums[0] = ab;
  sums[1] = ac;
  sums[2] = ad;
  sums[3] = al;
}

_Static_assert(UNKNOWNS == FIT_PRODUCTS + 1, "every pair of all but the last is in one of these");
#define SUM_PRODUCTS(a)                                                                                                                    \
  NOINLINE static void sum_products_##a(const int32_t *row, const int32_t *end, int32_t *sums) {                                           \
    sum_products(row, end, sums, (a), ((a) + 1) % FIT_PRODUCTS, ((a) + 2) % FIT_PRODUCTS, ((a) + 3) % FIT_PRODUCTS);                       \
  }
SUM_PRODUCTS(0)
SUM_PRODUCTS(1)
SUM_PRODUCTS(2)
SUM_PRODUCTS(3)
SUM_PRODUCTS(4)
SUM_PRODUCTS(5)
SUM_PRODUCTS(6)
void (*const fit_sum_products[FIT_PRODUCTS])(const int32_t *, const int32_t *, int32_t *) = {
    sum_products_0, sum_products_1, sum_products_2, sum_products_3, sum_products_4, sum_products_5, sum_products_6};

static void form(struct fit_tangential_work *work, const int32_t *scale) {
  const int32_t *row = work->node[0].column;
  for (int a = 0; a < UNKNOWNS - 1; a++) {
    int32_t sums[4];
    fit_sum_products[a](row, row + NODES * UNKNOWNS, sums);
    int32_t up = scale[a];
    for (int k = 0, b = a; k < 3; k++) {
      b = b == UNKNOWNS - 2 ? 0 : b + 1;
      work->matrix[a > b ? a : b][a > b ? b : a] = sums[k] * (1 << (up + scale[b]));
    }
    work->matrix[UNKNOWNS - 1][a] = sums[3] * (1 << (up + scale[UNKNOWNS - 1]));
  }
}

/* Longest step of the place, and of t in the narrowest term's variance. */
#define MOVE_MAX_Q26 (ONE_Q26 * 3 / 8)

#define PIVOT_MIN (1 << 18) /* 2^-12: an unknown with less stays where it is */

#define STEP_MAX_Q20 (1 << 26)

/* a - b modulo 2^32: rounding may take what a matrix that is nearly singular leaves anywhere. */
FIXED_INLINE int32_t less(int32_t a, uint32_t b) { return (int32_t)((uint32_t)a - b); }

/* Takes from column j of the matrix what the unknowns before j explain. */
FIXED_INLINE void reduce(int32_t matrix[UNKNOWNS][UNKNOWNS], int j) {
  int32_t *row = matrix[UNKNOWNS - 1];
  do {
    uint32_t sum = 0;
    _Pragma("GCC unroll 8") for (int k = 0; k < j; k++) { sum += (uint32_t)(row[k] * matrix[k][j]); }
    row[j] = less(row[j], sum << 1);
    row -= UNKNOWNS;
  } while (row != matrix[j - 1]);
}

NOINLINE static void take_pivot(int32_t matrix[UNKNOWNS][UNKNOWNS], int32_t j, int32_t right_q26, int32_t *y_q26,
                                struct solution *solution) {
  int32_t *row = matrix[j];
  uint32_t known = 0;
  for (int32_t k = 0; k < j; k++) {
    known += (uint32_t)scaled_by(y_q26[k], row[k], 14);
  }
  int32_t y = fixed_clamp(less(right_q26, known), -(1 << 26), 1 << 26);
  int32_t pivot = row[j];
  if (pivot < PIVOT_MIN) {
    for (int32_t i = j + 1; i < UNKNOWNS; i++) {
      matrix[j][i] = matrix[i][j] = 0;
    }
    y_q26[j] = solution->step_q20[j] = 0;
    solution->half[j] = 6;
    solution->inverse_q13[j] = 1 << 13;
    return;
  }
  int32_t up = 30 - fixed_bits((uint32_t)pivot);
  up = up < 0 ? 0 : up;
  int32_t inverse = port_divide((1 << 29) - 1, pivot >> (15 - up)); /* 2^14 .. 2^15 */
  int32_t half = up >> 1, odd = up & 1;
  int32_t down = 15 - half, round = 1 << down >> 1;
  int32_t *column = row + j;
  for (int32_t i = j + 1; i < UNKNOWNS; i++) {
    column += UNKNOWNS;
    int32_t element = fixed_clamp((*column + round) >> down, -INT16_MAX, INT16_MAX);
    row[i] = element;
    *column = rounded(element * inverse, 15 - odd);
  }
  int32_t z_q20 = shifted(fixed_mul_16(y, inverse), up - 4);
  solution->step_q20[j] = z_q20 = fixed_clamp(z_q20, -STEP_MAX_Q20, STEP_MAX_Q20);
  solution->half[j] = half;
  solution->inverse_q13[j] = (inverse << odd) >> 1;
  solution->explained_q30 += (y >> 11) * (fixed_clamp(z_q20, -(1 << 20), 1 << 20) >> 5);
  y_q26[j] = shifted(y, half);
}

NOINLINE static void solve(int32_t matrix[UNKNOWNS][UNKNOWNS], const int32_t *right_q26, struct solution *solution) {
  int32_t y_q26[UNKNOWNS]; /* 2^half of it */
  solution->explained_q30 = 0;
  take_pivot(matrix, 0, right_q26[0], y_q26, solution);
  _Pragma("GCC unroll 8") for (int j = 1; j < UNKNOWNS; j++) {
    reduce(matrix, j);
    take_pivot(matrix, j, right_q26[j], y_q26, solution);
  }
  for (int i = UNKNOWNS - 2; i >= 0; i--) {
    uint32_t known = 0;
    for (int k = i + 1; k < UNKNOWNS; k++) {
      known += (uint32_t)scaled_by(solution->step_q20[k], matrix[k][i], 14);
    }
    int32_t z_q20 = solution->step_q20[i] - shifted((int32_t)known, solution->half[i]);
    solution->step_q20[i] = fixed_clamp(z_q20, -STEP_MAX_Q20, STEP_MAX_Q20);
  }
}

static int32_t clamp_noting(int32_t value, int32_t low, int32_t high, bool *at_bound) {
  *at_bound = *at_bound || value < low || value > high;
  return fixed_clamp(value, low, high);
}

/* |value| / limit in Q14, at most 2^17. */
static int32_t in_limits(int32_t value, int32_t limit) {
  uint32_t size = fixed_magnitude(value);
  int32_t coarse = limit >> 14;
  return size > (uint32_t)limit * 8 ? 1 << 17 : port_divide((int32_t)size, coarse < 1 ? 1 : coarse);
}

/* Returns how long the step is, Q14 of the longest that is taken. */
NOINLINE static int32_t take_step(const struct problem *problem, const struct outcome *outcome, int32_t residual_q,
                                  struct fit_tangential_unknowns *at, bool *at_bound) {
  const struct fit_pad *pad = problem->pad;
  int32_t move[UNKNOWNS];
  for (int u = 0; u < UNKNOWNS; u++) {
    int32_t q = u == AMPLITUDE || u >= TANGENTIAL_X ? 24 : 26;
    move[u] = shifted(outcome->solution.step_q20[u], outcome->column_q[u] - residual_q - 20 + q);
  }
  int32_t narrow = pad->variance_q26[0] + at->t_q26;
  int32_t most = 0;
  for (int u = LOCATION_X; u <= SPREAD; u++) {
    int32_t share = in_limits(move[u], u <= LOCATION_Y ? MOVE_MAX_Q26 : narrow >> 1);
    most = share > most ? share : most;
  }
  if (most > 1 << 14) {
    int32_t share_q15 = port_divide(1 << 29, most);
    for (int u = 0; u < UNKNOWNS; u++) {
      move[u] = fixed_mul_16(move[u], share_q15 >> 1) * 4;
    }
  }
  *at_bound = false;
  at->x_q26 = clamp_noting(at->x_q26 + move[LOCATION_X], -reach(pad, COLUMNS), reach(pad, COLUMNS), at_bound);
  at->y_q26 = clamp_noting(at->y_q26 + move[LOCATION_Y], -reach(pad, ROWS), reach(pad, ROWS), at_bound);
  at->amplitude_q24 = clamp_noting(at->amplitude_q24 + move[AMPLITUDE], 1 << 16, AMPLITUDE_MAX_Q24, at_bound);
  at->tangential_x_q24 = clamp_noting(at->tangential_x_q24 + move[TANGENTIAL_X], -TANGENTIAL_MAX_Q24, TANGENTIAL_MAX_Q24, at_bound);
  at->tangential_y_q24 = clamp_noting(at->tangential_y_q24 + move[TANGENTIAL_Y], -TANGENTIAL_MAX_Q24, TANGENTIAL_MAX_Q24, at_bound);
  at->t_q26 = fixed_clamp(at->t_q26 + move[SPREAD], spread_min(pad), SPREAD_MAX_Q26);
  at->e1_q26 = clamp_noting(at->e1_q26 + move[ELONGATION_1], -ELONGATION_MAX_Q26, ELONGATION_MAX_Q26, at_bound);
  at->e2_q26 = clamp_noting(at->e2_q26 + move[ELONGATION_2], -ELONGATION_MAX_Q26, ELONGATION_MAX_Q26, at_bound);
  return most;
}

void fit_tangential_step(const struct problem *problem, struct fit_tangential_unknowns *at, struct fit_tangential_work *work,
                         struct outcome *outcome) {
  struct priors priors;
  struct equations equations;
  fit_tangential_linearise(problem, at, work);
  set_priors(problem, at, &priors);
  int32_t residual_q = normalise_residuals(work->residual, &priors);
  for (int u = 0; u < UNKNOWNS; u++) {
    normalise_column(work, u, priors.row_q26[u], priors.residual[u], &equations);
    outcome->column_q[u] = equations.column_q[u];
  }
  form(work, equations.scale);
  solve(work->matrix, equations.right_q26, &outcome->solution);
  int32_t squares = -outcome->solution.explained_q30;
  for (int k = 0; k < NODES; k++) {
    squares += (work->residual[k] * work->residual[k]) >> 2;
  }
  for (int u = SPREAD; u <= ELONGATION_2; u++) {
    squares += (priors.residual[u] * priors.residual[u]) >> 2;
  }
  outcome->misfit = fit_scaled_from(squares > 0 ? squares : 0, -2 * residual_q);
  outcome->length_q14 = take_step(problem, outcome, residual_q, at, &outcome->at_bound);
}
