/* Gauss-Newton without a matrix to solve. On a full rectangle the model is a product e = gx gy, and
 * its derivatives span
 *   e, e p1(x), e q1(y), e (p2(x) + q2(y))
 * with p and q the polynomials of degree 1 and 2 that are orthogonal over the nodes under gx^2 and
 * gy^2. These four are orthogonal to each other: the normal matrix is diagonal, and where the data
 * hardly tell a direction apart, a small diagonal element says so with its full relative precision
 * instead of as a difference of large ones. That is what lets 16-bit factors do.
 *
 * The amplitude is no unknown: each evaluation takes the best one for the shape (variable
 * projection). Whatever is rounded in the matrix, the step or the amplitude only turns or stretches
 * a step; where the fit ends is decided by the right-hand side, sums of the residual against the
 * basis. So the residual is computed to 2^-26 of the largest reading and then rounded relative to
 * its own size.
 */
#include "common/contact_flags.h"
#include "fit/fit.h"
#include "fit/fit_fixed.h"
#include "fit/fit_grid_parts.h"
#include "fit/fit_limits.h"

#include <stdbool.h>
#include <string.h>

#define UNROLL _Pragma("GCC unroll 6") /* for loops over the nodes of an axis */

/* A sum against the basis adds NODES products value * g * p, |value| <= 2^RESIDUAL_BITS, g <= 2^14,
 * |p| <= 2^15, of which 16 bits are dropped: below 2^31. */
#define RESIDUAL_BITS (NODES <= 15 ? 14 : 13)

#define STIFFNESS_PER_HEIGHT_Q14 22713 /* 2 / log2(e) = 1 / (sigma^2 height) */

#define AMPLITUDE_MIN_Q28 13421773        /* 0.05 */
#define AMPLITUDE_MAX_Q28 ((1 << 30) - 1) /* 4 */
#define STEP_LIMIT_Q22 (1 << 22)          /* a pitch */
#define RATIO_LIMIT_Q28 (1 << 27)         /* sigma changes by half at most */

/* The first iterations only have to come near: they project the readings themselves, since the
 * basis is orthogonal to the model. Their rounding would let them wander along the valleys of badly
 * conditioned presses, so they are few, and the others work on the residual. */
#define COARSE_ITERATIONS 3

/* Guess alone: readings below a share of the largest carry more noise than shape into a logarithm;
 * a ridge towards sigma 0.556 pitch decides where too few are large. */
#define GUESS_SHARE_Q30 85899346                         /* 8 % of the largest marginal */
#define GUESS_RIDGE ((struct scaled){31458, -21})        /* 0.015 */
#define GUESS_RIDGE_HEIGHT ((struct scaled){18380, -19}) /* 0.015 * 2.337 */
#define GUESS_HEIGHT_MIN_Q26 1936353
#define GUESS_HEIGHT_MAX_Q26 484088133 /* sigma 0.316 pitch */

#define MODEL_INVERSE_SQUARE ((struct scaled){22756, -9}) /* 1 / 0.15^2 */
#define ROUGH_INVERSE_SQUARE ((struct scaled){20000, -3}) /* 1 / 0.02^2 */
#define MISFIT_SQUARE ((struct scaled){FIT_MISFIT * FIT_MISFIT << 11, -11})
#define FLAT_HEIGHT_Q26 2016200      /* sigma 4.9 pitches */
#define NARROW_HEIGHT_Q26 302550256  /* sigma 0.4 pitch */
#define PEAK_RISE_MAX_Q22 (20 << 22) /* a factor of a million */

/* 1 / n of a constant. */
#define RECIPROCAL(n)                                                                              \
  ((struct scaled){(n) >= 8 ? (1 << 18) / (n) : (1 << 15) / (n), (n) >= 8 ? -18 : -15})

/* One factor of the separable Gaussian, and the polynomials that are orthogonal under its square.
 * p1 = k - mean and p2 = k^2 - k slope + constant, k the node number. */
struct factor {
  int32_t g[MAX_NODES];      /* Q30, 1 at the nearest node */
  int32_t g_q14[MAX_NODES];  /* the same */
  int32_t linear[MAX_NODES]; /* g p1, |.| <= 2^15, value = integer * 2^-linear_q */
  int32_t square[MAX_NODES]; /* g p2, |.| <= 2^15, value = integer * 2^-square_q */
  int32_t linear_q;
  int32_t mass_q26;    /* sum of g^2 */
  int32_t linear_norm; /* sum of linear^2 / 8 */
  int32_t square_norm; /* sum of square^2 / 8 */
  int32_t mean;        /* Q26, as the next three */
  int32_t slope, constant;
  int32_t offset; /* of the centre from the nearest node */
};

/* What one evaluation of the model leaves: the normal equations in the orthogonal basis. Of the
 * struct scaled here the mantissas have up to 31 bits. */
struct moments {
  struct factor x, y;
  int32_t square_q; /* common to both, so that the parts of p2(x) + q2(y) add up */
  int32_t amplitude_q28;
  int32_t residual_shift;   /* the sums take the residual in Q(28 - shift) */
  int32_t b0;               /* what the amplitude's rounding left, Q(40 - shift) */
  struct scaled b1, b2, b3; /* right-hand side */
  struct scaled d1, d2, d3; /* the matrix */
  struct scaled stiffness;  /* amplitude / sigma^2 */
  struct scaled prior_row;  /* what the prior adds to the matrix is its square */
  int32_t c1_q26, c2_q26;   /* the step along the basis, before any limit */
  int32_t c3_q28;
  int32_t move_x_q22, move_y_q22; /* the step taken */
};

FIXED_INLINE void set_gaussian(struct factor *f, int nodes, int origin, int32_t centre,
                               int32_t height) {
  int32_t nearest = fixed_clamp((centre + (ONE_Q26 >> 1)) >> 26, -origin, nodes - 1 - origin);
  f->offset = centre - nearest * ONE_Q26;
  /* The exponent relative to the nearest node, k (curvature k - slope) with k counted from there,
   * by its differences: exactly a parabola, so the rounding of the two coefficients moves centre
   * and width and cannot show in the residual. The 2 more than makes up for both roundings, so the
   * exponent is never negative. */
  int32_t slope = fixed_mul_q32(height, f->offset * 8); /* Q22 */
  int32_t curvature = (height >> 4) + 2;
  int32_t k = -origin - nearest;
  uint32_t exponent = (uint32_t)k * (uint32_t)(curvature * k - slope);
  uint32_t difference = (uint32_t)(curvature * (2 * k + 1) - slope);
  UNROLL for (int i = 0; i < nodes; i++) {
    f->g[i] = exp2_negative(exponent);
    exponent += difference;
    difference += 2 * (uint32_t)curvature;
  }
}

/* Largest |.| of the vector as a bit pattern: only its highest bit means anything. */
FIXED_INLINE uint32_t vector_size(const int32_t *vector, int count) {
  uint32_t size = 1;
  UNROLL for (int i = 0; i < count; i++) {
    size |= fixed_size(vector[i]);
  }
  return size;
}

FIXED_INLINE void vector_shift(const int32_t *from, int32_t *to, int count, int32_t shift) {
  int32_t half = (1 << shift) >> 1;
  UNROLL for (int i = 0; i < count; i++) {
    to[i] = (from[i] + half) >> shift;
  }
}

/* The shift that brings a size to this many bits; what is smaller stays as it is, since there is
 * nothing below its last bit. */
FIXED_INLINE int32_t shift_to(int32_t bits, uint32_t size) {
  int32_t shift = fixed_bits(size) - bits;
  return shift > 0 ? shift : 0;
}

/* p1 and p2 and their values times g. Those of p2 come from additions, so that they stay accurate
 * where they nearly vanish; they are left in Q28. */
FIXED_INLINE void set_polynomials(struct factor *f, int nodes, int origin) {
  int32_t mass = 0, first = 0, second = 0;
  UNROLL for (int i = 0; i < nodes; i++) {
    int32_t k = i - origin;
    int32_t g = f->g[i] >> 15;
    int32_t weight = (g * g) >> 4; /* Q26 */
    f->g_q14[i] = (g + 1) >> 1;
    mass += weight;
    first += k * weight;
    second += k * k * weight;
  }
  f->mass_q26 = mass;
  f->mean = fixed_div_q26(first, mass);
  int32_t mean_square = fixed_div_q26(second, mass);

  int32_t values[MAX_NODES];
  UNROLL for (int i = 0; i < nodes; i++) {
    values[i] = fixed_mul_q32(f->g[i], ((i - origin) * ONE_Q26 - f->mean) * 4);
  }
  int32_t shift = shift_to(15, vector_size(values, nodes));
  vector_shift(values, f->linear, nodes, shift);
  f->linear_q = 26 - shift;

  int32_t norm = 0, moment = 0;
  UNROLL for (int i = 0; i < nodes; i++) {
    int32_t square = (f->linear[i] * f->linear[i]) >> 3;
    norm += square;
    moment += (i - origin) * square;
  }
  f->linear_norm = norm;
  /* The mean under linear^2. Where that is too small to tell, any value serves. */
  int32_t skew = norm < 1 << 13 ? f->mean : fixed_div_q26(moment, norm);

  f->slope = skew + f->mean;
  f->constant = fixed_mul_q26(f->slope, f->mean) - mean_square;
  UNROLL for (int i = 0; i < nodes; i++) {
    int32_t k = i - origin;
    f->square[i] = fixed_mul_q28(f->g[i], k * k * ONE_Q26 - k * f->slope + f->constant);
  }
}

FIXED_INLINE int32_t sum_of_squares(const int32_t *vector, int count) {
  int32_t sum = 0;
  UNROLL for (int i = 0; i < count; i++) {
    sum += (vector[i] * vector[i]) >> 3;
  }
  return sum;
}

static NOINLINE void orthogonalise(struct moments *m) {
  set_polynomials(&m->x, COLUMNS, COLUMNS / 2);
  set_polynomials(&m->y, ROWS, ROWS / 2);
  int32_t shift = shift_to(15, vector_size(m->x.square, COLUMNS) | vector_size(m->y.square, ROWS));
  vector_shift(m->x.square, m->x.square, COLUMNS, shift);
  vector_shift(m->y.square, m->y.square, ROWS, shift);
  m->square_q = 28 - shift;
  m->x.square_norm = sum_of_squares(m->x.square, COLUMNS);
  m->y.square_norm = sum_of_squares(m->y.square, ROWS);
}

/* <e, readings>, Q26. */
static NOINLINE int32_t project_on_model(const struct moments *m, const int32_t *p_q14) {
  const int32_t *x = m->x.g_q14, *y = m->y.g_q14;
  int32_t product = 0;
  UNROLL for (int i = 0; i < COLUMNS; i++) {
    int32_t sum = 0;
    UNROLL for (int j = 0; j < ROWS; j++) {
      sum += p_q14[i * ROWS + j] * y[j];
    }
    product += fixed_mul_16(sum, x[i]);
  }
  return product;
}

/* product over <e, e> within the limits, Q28. */
FIXED_INLINE int32_t best_amplitude(const struct moments *m, int32_t product_q26) {
  int32_t mass_q14 = fixed_mul_q32(m->x.mass_q26, m->y.mass_q26) >> 6;
  int32_t quotient_q12 = port_divide(product_q26, mass_q14);
  if (quotient_q12 >= AMPLITUDE_MAX_Q28 >> 16) {
    return AMPLITUDE_MAX_Q28;
  }
  if (quotient_q12 < AMPLITUDE_MIN_Q28 >> 16) {
    return AMPLITUDE_MIN_Q28;
  }
  int32_t rest = product_q26 - quotient_q12 * mass_q14;
  return quotient_q12 * (1 << 16) + port_divide(rest * (1 << 12), mass_q14) * (1 << 4);
}

/* What the model leaves of the readings, rounded to RESIDUAL_BITS; returns the shift. */
static NOINLINE int32_t set_residual(struct moments *m, struct readings *readings) {
  const struct factor *y = &m->y;
  const int32_t *p = readings->q28;
  int32_t *residual = readings->residual;
  uint32_t size = 1;
  for (int i = 0; i < COLUMNS; i++) {
    int32_t column = fixed_mul_q30(m->amplitude_q28, m->x.g[i]);
    UNROLL for (int j = 0; j < ROWS; j++) {
      int32_t r = p[j] - fixed_mul_q30(y->g[j], column);
      residual[j] = r;
      size |= fixed_size(r);
    }
    p += ROWS;
    residual += ROWS;
  }
  int32_t shift = shift_to(RESIDUAL_BITS, size), half = (1 << shift) >> 1;
  for (int i = 0; i < COLUMNS; i++) {
    residual -= ROWS;
    UNROLL for (int j = 0; j < ROWS; j++) {
      residual[j] = (residual[j] + half) >> shift;
    }
  }
  return shift;
}

/* The sums of the values against the basis. Each part of it is g along one of the axes at least, so
 * sums over rows and columns do. */
static NOINLINE void project(struct moments *m, const int32_t *values, int32_t shift) {
  const struct factor *x = &m->x, *y = &m->y;
  int32_t over_y[COLUMNS] = {0};
  int32_t b2 = 0, b3_y = 0;
  for (int j = 0; j < ROWS; j++) {
    int32_t over_x = 0, g = y->g_q14[j];
    UNROLL for (int i = 0; i < COLUMNS; i++) {
      int32_t value = values[i * ROWS + j];
      over_y[i] += value * g;
      over_x += value * x->g_q14[i];
    }
    b2 += fixed_mul_16(over_x, y->linear[j]);
    b3_y += fixed_mul_16(over_x, y->square[j]);
  }
  int32_t b0 = 0, b1 = 0, b3_x = 0;
  UNROLL for (int i = 0; i < COLUMNS; i++) {
    b0 += fixed_mul_16(over_y[i], x->g_q14[i]);
    b1 += fixed_mul_16(over_y[i], x->linear[i]);
    b3_x += fixed_mul_16(over_y[i], x->square[i]);
  }
  int32_t q = shift - 26; /* values Q(28 - shift), g Q14, 16 bits dropped */
  m->b0 = b0;
  m->b1 = (struct scaled){b1, q - x->linear_q};
  m->b2 = (struct scaled){b2, q - y->linear_q};
  m->b3 = (struct scaled){(b3_x >> 1) + (b3_y >> 1), q + 1 - m->square_q}; /* one bit more */
}

/* The prior (sigma - prior) / width is one more row of the least squares; c3 is the only unknown
 * that changes sigma, by sigma * gain. */
static NOINLINE void add_prior(const struct readings *readings, const struct state *state,
                               struct moments *m) {
  struct scaled sigma = scaled_from(fit_grid_sigma(state->height), -26);
  struct scaled pull = scaled_mul(scaled_sub(readings->prior_sigma, sigma), readings->prior_weight);
  struct scaled row = scaled_div(scaled_mul(sigma, readings->prior_weight), m->stiffness);
  m->prior_row = row;
  struct scaled d3 = scaled_add(scaled_from(m->d3.mantissa, m->d3.exponent), scaled_mul(row, row));
  struct scaled b3 = scaled_add(scaled_from(m->b3.mantissa, m->b3.exponent), scaled_mul(row, pull));
  m->d3 = (struct scaled){d3.mantissa * (1 << 14), d3.exponent - 14};
  m->b3 = (struct scaled){b3.mantissa * (1 << 14), b3.exponent - 14};
}

static NOINLINE void evaluate(const struct state *state, struct readings *readings,
                              struct moments *m, bool coarse) {
  set_gaussian(&m->x, COLUMNS, COLUMNS / 2, state->x, state->height);
  set_gaussian(&m->y, ROWS, ROWS / 2, state->y, state->height);
  orthogonalise(m);
  if (coarse) {
    project(m, readings->q14, 14);
    m->amplitude_q28 = best_amplitude(m, m->b0);
  } else {
    m->amplitude_q28 = best_amplitude(m, project_on_model(m, readings->q14));
    m->residual_shift = set_residual(m, readings);
    project(m, readings->residual, m->residual_shift);
  }

  int32_t mass_x = m->x.mass_q26 >> 14, mass_y = m->y.mass_q26 >> 14;
  m->d1 = (struct scaled){(m->x.linear_norm >> 14) * mass_y, 5 - 2 * m->x.linear_q};
  m->d2 = (struct scaled){(m->y.linear_norm >> 14) * mass_x, 5 - 2 * m->y.linear_q};
  m->d3 = (struct scaled){(m->x.square_norm >> 14) * mass_y + (m->y.square_norm >> 14) * mass_x,
                          5 - 2 * m->square_q};
  uint32_t product = (uint32_t)(state->height >> 14) * (uint32_t)(m->amplitude_q28 >> 14);
  int32_t shift = fixed_bits(product) - 14;
  m->stiffness =
      (struct scaled){((int32_t)(product >> shift) * STIFFNESS_PER_HEIGHT_Q14) >> 14, shift - 26};
  if (readings->prior_weight.mantissa != 0) {
    add_prior(readings, state, m);
  }
}

/* value * 2^shift, saturated to +-2^30. */
FIXED_INLINE int32_t shifted(int32_t value, int32_t shift) {
  if (shift >= 0) {
    int32_t limit = (1 << 30) >> (shift < 30 ? shift : 30);
    return fixed_clamp(value, -limit, limit) * (1 << (shift < 30 ? shift : 30));
  }
  return value >> (shift < -31 ? 31 : -shift);
}

/* b / (d stiffness) in Qq. Near the end b is small, and its last bits decide. */
FIXED_INLINE int32_t step_along(struct scaled b, struct scaled d, struct scaled stiffness,
                                int32_t q) {
  int32_t divisor = ((d.mantissa >> 14) * stiffness.mantissa) >> 13; /* below 2^18 */
  int32_t up = 31 - fixed_bits(fixed_size(b.mantissa) | 1);
  int32_t quotient = port_divide(b.mantissa * (1 << up), divisor < 1 ? 1 : divisor);
  return shifted(quotient, b.exponent - up - d.exponent - stiffness.exponent - 27 + q);
}

/* The step in the parameters: with c = b / d / stiffness,
 *   dsigma / sigma = c3,  dx = c1 - (slope - 2 x) c3,  dy likewise. */
static NOINLINE void take_step(const struct fit_grid_shape *grid, struct state *state,
                               struct moments *m) {
  int32_t c1 = step_along(m->b1, m->d1, m->stiffness, 26);
  int32_t c2 = step_along(m->b2, m->d2, m->stiffness, 26);
  int32_t ratio = step_along(m->b3, m->d3, m->stiffness, 28);
  m->c1_q26 = c1;
  m->c2_q26 = c2;
  m->c3_q28 = ratio;
  int32_t dx = (c1 >> 4) - fixed_mul_q32(m->x.slope - 2 * state->x, ratio);
  int32_t dy = (c2 >> 4) - fixed_mul_q32(m->y.slope - 2 * state->y, ratio);
  dx = fixed_clamp(dx, -STEP_LIMIT_Q22, STEP_LIMIT_Q22);
  dy = fixed_clamp(dy, -STEP_LIMIT_Q22, STEP_LIMIT_Q22);
  ratio = fixed_clamp(ratio, -RATIO_LIMIT_Q28, RATIO_LIMIT_Q28);
  m->move_x_q22 = dx;
  m->move_y_q22 = dy;
  state->x = fixed_clamp(state->x + dx * 16, grid->x_min, grid->x_max);
  state->y = fixed_clamp(state->y + dy * 16, grid->y_min, grid->y_max);

  /* height /= (1 + ratio)^2 as height -= height f (2 - f), f = ratio / (1 + ratio): relative
   * precision is enough for f, and it goes to zero smoothly. */
  int32_t inverse_q15 = port_divide(1 << 30, ((1 << 28) + ratio) >> 13);
  int32_t f = fixed_mul_16(ratio, inverse_q15 >> 1) * 4;
  int32_t height = state->height;
  int32_t loss = 2 * f - (f >> 14) * (f >> 14); /* Q28, -3 .. 0.56 */
  if (height < 1 << 28) {
    height -= fixed_mul_q28(height, loss);
  } else {
    height = (height >> 2) - fixed_mul_q28(height >> 2, loss);
    height = height > HEIGHT_MAX_Q26 >> 2 ? HEIGHT_MAX_Q26 : height * 4;
  }
  state->height = fixed_clamp(height, HEIGHT_MIN_Q26, HEIGHT_MAX_Q26);
}

/* First guess, every sensor there: the marginals weighted by the row and the column of the largest
 * reading are the two factors of the Gaussian, and the logarithm of each a parabola. Leaves the
 * marginal in g and its logarithm, weighted by it, in `weighted` (Q14). */
static NOINLINE void set_marginal(struct factor *f, const int32_t *marginal, int32_t *weighted,
                                  int nodes) {
  int32_t largest = 1;
  for (int i = 0; i < nodes; i++) {
    largest = marginal[i] > largest ? marginal[i] : largest;
  }
  int32_t shift = fixed_bits((uint32_t)largest) - 16;
  int32_t down = shift > 0 ? shift : 0, up = shift < 0 ? -shift : 0;
  int32_t inverse = port_divide(1 << 30, (largest >> down) * (1 << up));
  for (int i = 0; i < nodes; i++) {
    int32_t value = marginal[i] < 0 ? 0 : marginal[i];
    int32_t g = (value >> down) * (1 << up) * inverse; /* Q30, at most 1 */
    if (g < GUESS_SHARE_Q30) {
      f->g[i] = 0;
      weighted[i] = 0;
    } else {
      f->g[i] = g;
      weighted[i] = ((g >> 16) * (log2_q15(g >> 16) >> 1)) >> 14;
    }
  }
}

FIXED_INLINE int32_t product_of(const int32_t *a, const int32_t *b, int count) {
  int32_t sum = 0;
  UNROLL for (int i = 0; i < count; i++) {
    sum += a[i] * b[i];
  }
  return sum;
}

/* b / (norm + ridge), b in Q(14 + q), the norm 2^(3 - 2 q). */
static NOINLINE struct scaled ridged(int32_t b, int32_t norm, int32_t q) {
  return scaled_div(scaled_from(b, -14 - q), scaled_add(scaled_from(norm, 3 - 2 * q), GUESS_RIDGE));
}

static NOINLINE void guess(const struct fit_grid_shape *grid, const struct readings *readings,
                           struct moments *m, struct state *state) {
  const int32_t *p = readings->q14;
  int peak_column = 0, peak_row = 0;
  int32_t peak = p[0];
  for (int i = 0; i < COLUMNS; i++) {
    for (int j = 0; j < ROWS; j++) {
      if (p[i * ROWS + j] > peak) {
        peak = p[i * ROWS + j];
        peak_column = i;
        peak_row = j;
      }
    }
  }
  int32_t across[MAX_NODES], along[MAX_NODES] = {0}, weighted_x[MAX_NODES], weighted_y[MAX_NODES];
  for (int i = 0; i < COLUMNS; i++) {
    int32_t sum = 0, at_peak = p[i * ROWS + peak_row];
    UNROLL for (int j = 0; j < ROWS; j++) {
      sum += p[i * ROWS + j] * p[peak_column * ROWS + j];
      along[j] += p[i * ROWS + j] * at_peak;
    }
    across[i] = sum;
  }
  set_marginal(&m->x, across, weighted_x, COLUMNS);
  set_marginal(&m->y, along, weighted_y, ROWS);
  orthogonalise(m);

  /* From the parabola's coefficients: height = -c3, centre = slope / 2 + c1 / (2 height). */
  struct scaled c1 =
      ridged(product_of(m->x.linear, weighted_x, COLUMNS), m->x.linear_norm, m->x.linear_q);
  struct scaled c2 =
      ridged(product_of(m->y.linear, weighted_y, ROWS), m->y.linear_norm, m->y.linear_q);
  struct scaled b3 = scaled_from(product_of(m->x.square, weighted_x, COLUMNS) +
                                     product_of(m->y.square, weighted_y, ROWS),
                                 -14 - m->square_q);
  struct scaled norm = scaled_from(m->x.square_norm + m->y.square_norm, 3 - 2 * m->square_q);
  struct scaled height =
      scaled_div(scaled_sub(GUESS_RIDGE_HEIGHT, b3), scaled_add(norm, GUESS_RIDGE));
  state->height =
      fixed_clamp(scaled_to_fixed(height, 26), GUESS_HEIGHT_MIN_Q26, GUESS_HEIGHT_MAX_Q26);
  struct scaled half = scaled_div(scaled_from(1, -1), scaled_from(state->height, -26));
  int32_t x = (m->x.slope >> 1) + scaled_to_fixed(scaled_mul(c1, half), 26);
  int32_t y = (m->y.slope >> 1) + scaled_to_fixed(scaled_mul(c2, half), 26);
  state->x = fixed_clamp(x, grid->x_min + ONE_Q26 / 2, grid->x_max - ONE_Q26 / 2);
  state->y = fixed_clamp(y, grid->y_min + ONE_Q26 / 2, grid->y_max - ONE_Q26 / 2);
}

/* p2(x) + q2(y) at the centre, Q24: how a change along the third basis function lifts the peak. */
FIXED_INLINE int32_t bend_q24(const struct state *before, const struct moments *m) {
  int32_t x = fixed_mul_q26(before->x, before->x - m->x.slope) + m->x.constant;
  int32_t y = fixed_mul_q26(before->y, before->y - m->y.slope) + m->y.constant;
  return (x >> 2) + (y >> 2);
}

/* Peak at the centre after the step: 30-bit mantissa and exponent, Pa. */
FIXED_INLINE int32_t peak_of(const struct readings *readings, const struct state *before,
                             const struct moments *m, int32_t mass_q20, int32_t bend,
                             int32_t *exponent) {
  /* The amplitude belongs to the nearest node; the centre is higher by 2^(height offset^2). */
  int32_t squares =
      fixed_mul_q26(m->x.offset, m->x.offset) + fixed_mul_q26(m->y.offset, m->y.offset);
  int32_t rise_q22 = fixed_mul_q32(before->height, fixed_clamp(squares, 0, (1 << 28) - 1) * 4);
  rise_q22 = fixed_clamp(rise_q22, 0, PEAK_RISE_MAX_Q22);
  int32_t up = 30 - fixed_bits((uint32_t)m->amplitude_q28);
  int32_t peak = fixed_mul_q30(m->amplitude_q28 * (1 << up),
                               exp2_negative((1u << 22) - ((uint32_t)rise_q22 & 0x3FFFFF)));
  *exponent = (rise_q22 >> 22) + 1 - up - 10 - readings->shift;

  /* The last step's own part, relative: c1 and c2 tilt the model about its mean, c3 bends it. */
  int32_t c1 = fixed_clamp(m->c1_q26, -ONE_Q26, ONE_Q26) * 16;
  int32_t c2 = fixed_clamp(m->c2_q26, -ONE_Q26, ONE_Q26) * 16;
  int32_t c3 = fixed_clamp(m->c3_q28, -(1 << 28), 1 << 28) * 4;
  int32_t tilt_q24 =
      fixed_mul_q32(c1, m->x.mean - before->x) + fixed_mul_q32(c2, m->y.mean - before->y);
  int32_t lift_q22 = fixed_clamp(fixed_mul_q32(c3, bend) - (tilt_q24 >> 2), -(1 << 21), 1 << 21);
  int32_t growth_q24 = fixed_mul_q32(before->height, lift_q22 * (1 << 8));
  growth_q24 = fixed_mul_16(growth_q24, STIFFNESS_PER_HEIGHT_Q14) * 4;
  /* The amplitude's rounding. */
  int32_t scale_q12 = fixed_mul_q32(mass_q20 * 16, m->amplitude_q28) >> 8;
  growth_q24 += shifted(port_divide(m->b0, scale_q12 + 1), m->residual_shift - 4);
  int32_t growth = fixed_clamp(growth_q24, -(1 << 23), 1 << 23) * 16;
  peak = fixed_mul_q28(peak, (1 << 28) + growth);
  if (peak >= 1 << 30) {
    peak >>= 1;
    *exponent += 1;
  }
  return peak;
}

/* 1 / value; what is not positive counts as the last place. */
static NOINLINE struct scaled reciprocal(struct scaled value) {
  struct scaled a = scaled_from(value.mantissa < 1 ? 1 : value.mantissa, value.exponent);
  return (struct scaled){port_divide(1 << 29, a.mantissa), -29 - a.exponent};
}

/* A value of 29 or 30 bits. */
FIXED_INLINE struct scaled scaled_top(int32_t value, int32_t exponent) {
  return (struct scaled){value >> 15, exponent + 15};
}

FIXED_INLINE struct scaled scaled_square(struct scaled a) {
  return scaled_mul(a, a);
}

/* Raises the inverse of d3 to that by which the variance of a reading gives that of c3: the prior's
 * row varies by a width of its own, not as the readings do. */
static NOINLINE void widen_for_prior(const struct readings *readings, const struct moments *m,
                                     const struct scaled *variance, struct scaled *inverse3) {
  struct scaled excess = scaled_sub(scaled_square(readings->prior_sd), *variance);
  if (excess.mantissa > 0) {
    struct scaled share = scaled_mul(m->prior_row, *inverse3);
    struct scaled more = scaled_div(scaled_mul(excess, scaled_square(share)), *variance);
    *inverse3 = scaled_add(*inverse3, more);
  }
}

static NOINLINE void conclude(const struct fit_grid_shape *grid, const struct readings *readings,
                              const struct fit_settings *settings, const struct state *before,
                              const struct state *state, const struct moments *m,
                              struct fit_result *result) {
  int32_t mass_q20 = fixed_mul_q32(m->x.mass_q26, m->y.mass_q26);
  int32_t bend = bend_q24(before, m);
  int32_t peak_exponent;
  int32_t peak = peak_of(readings, before, m, mass_q20, bend, &peak_exponent);
  int32_t sigma = fit_grid_sigma(state->height);
  int32_t up = 30 - fixed_bits((uint32_t)sigma);
  int32_t sigma_square = fixed_mul_q30(sigma * (1 << up), sigma * (1 << up));
  int32_t force = fixed_mul_q30(fixed_mul_q30(peak, sigma_square), grid->force_scale);
  int32_t force_exponent = peak_exponent + 38 - 2 * up + grid->force_exponent;
  result->x_mm =
      fit_grid_compose(fixed_mul_q32(state->x, grid->pitch) + grid->x_origin, grid->pitch_exponent);
  result->y_mm =
      fit_grid_compose(fixed_mul_q32(state->y, grid->pitch) + grid->y_origin, grid->pitch_exponent);
  result->sigma_mm = fit_grid_compose(fixed_mul_q32(sigma, grid->pitch), grid->pitch_exponent);
  result->p0_Pa = fit_grid_compose(peak, peak_exponent);
  result->force_N = fit_grid_compose(force, force_exponent);

  /* Standard deviation of one reading: the residuals', at least the noise. In units of Q28. */
  int32_t squares = 0;
  for (int k = 0; k < NODES; k++) {
    int32_t r = readings->residual[k];
    squares += (r * r) >> 4;
  }
  struct scaled mass = {mass_q20 >> 10, -10}, inverse_mass = reciprocal(mass);
  struct scaled left = scaled_from(m->b0, m->residual_shift - 40);
  struct scaled square_sum = scaled_sub(scaled_from(squares, 2 * m->residual_shift - 52),
                                        scaled_mul(scaled_square(left), inverse_mass));
  square_sum.mantissa = square_sum.mantissa < 0 ? 0 : square_sum.mantissa;
  const int32_t freedom = NODES > 4 ? NODES - 4 : 1;
  struct scaled noise = scaled_from(settings->noise_Pa_q10, readings->shift - 28);
  struct scaled variance = scaled_mul(square_sum, RECIPROCAL(freedom));
  struct scaled noise_variance = scaled_square(noise);
  bool misfit = scaled_sub(variance, scaled_mul(noise_variance, MISFIT_SQUARE)).mantissa > 0;
  if (scaled_sub(variance, noise_variance).mantissa < 0) {
    variance = noise_variance;
  }
  struct scaled rms = scaled_sqrt(scaled_mul(square_sum, RECIPROCAL(NODES)));
  result->residual_rms_Pa = fit_grid_compose(rms.mantissa, rms.exponent + 18 - readings->shift);

  struct scaled inverse1 = reciprocal(m->d1), inverse2 = reciprocal(m->d2);
  struct scaled inverse3 = reciprocal(m->d3);
  if (readings->prior_weight.mantissa != 0) {
    widen_for_prior(readings, m, &variance, &inverse3);
  }
  int32_t slope_x = (2 * before->x - m->x.slope) >> 15; /* Q11 */
  int32_t slope_y = (2 * before->y - m->y.slope) >> 15;
  struct scaled slopes = scaled_from(slope_x * slope_x + slope_y * slope_y, -22);
  struct scaled location = scaled_add(scaled_add(inverse1, inverse2), scaled_mul(slopes, inverse3));
  struct scaled location_sd = scaled_div(scaled_sqrt(scaled_mul(variance, location)), m->stiffness);
  location_sd = scaled_mul(location_sd, scaled_top(grid->pitch, grid->pitch_exponent - 6));
  result->location_sd_mm = fit_grid_compose(location_sd.mantissa, location_sd.exponent);

  /* dF / F = dp0 / p0 + 2 dsigma / sigma, each by its part in the basis; the mean of the model adds
   * one over its mass. */
  struct scaled off_x = scaled_from(before->x - m->x.mean, -26);
  struct scaled off_y = scaled_from(before->y - m->y.mean, -26);
  struct scaled lift = scaled_from(bend + (fixed_mul_q26(sigma, sigma) >> 1), -24);
  struct scaled form =
      scaled_add(scaled_add(scaled_mul(scaled_square(off_x), inverse1),
                            scaled_mul(scaled_square(off_y), inverse2)),
                 scaled_add(scaled_mul(scaled_square(lift), inverse3), inverse_mass));
  struct scaled amplitude = scaled_from(m->amplitude_q28, -28);
  struct scaled force_sd = scaled_div(scaled_sqrt(scaled_mul(variance, form)), amplitude);
  force_sd = scaled_mul(force_sd, scaled_top(force, force_exponent));
  result->force_sd_N = fit_grid_compose(force_sd.mantissa, force_sd.exponent);

  uint32_t flags = CONTACT_FLAG_FIT_VALID | CONTACT_FLAG_UNCERTAINTY_VALID;
  if (settings->noise_Pa_q10 > port_divide(readings->largest, FIT_LOW_SIGNAL_SIGMA)) {
    flags |= CONTACT_FLAG_LOW_SIGNAL;
  }
  if (state->height <= FLAT_HEIGHT_Q26) {
    flags |= CONTACT_FLAG_FLAT;
  }
  struct scaled total = scaled_add(scaled_mul(scaled_square(amplitude), mass), square_sum);
  bool rough = scaled_sub(scaled_mul(square_sum, ROUGH_INVERSE_SQUARE), total).mantissa > 0;
  bool narrow = state->height > NARROW_HEIGHT_Q26;
  int32_t move_x = fixed_clamp(m->move_x_q22, -(1 << 15), 1 << 15);
  int32_t move_y = fixed_clamp(m->move_y_q22, -(1 << 15), 1 << 15);
  if (((move_x * move_x) >> 1) + ((move_y * move_y) >> 1) > grid->settled_square ||
      scaled_to_fixed(location_sd, 16) > fit_sd_limit_mm_q16(misfit, narrow, rough)) {
    flags |= CONTACT_FLAG_UNCERTAIN;
  }
  if (scaled_sub(scaled_mul(square_sum, MODEL_INVERSE_SQUARE), total).mantissa > 0) {
    flags |= CONTACT_FLAG_MODEL;
  }
  if (state->x <= grid->x_min || state->x >= grid->x_max || state->y <= grid->y_min ||
      state->y >= grid->y_max || state->height <= HEIGHT_MIN_Q26 ||
      state->height >= HEIGHT_MAX_Q26 || m->amplitude_q28 <= AMPLITUDE_MIN_Q28 ||
      m->amplitude_q28 >= AMPLITUDE_MAX_Q28) {
    flags |= CONTACT_FLAG_AT_BOUND;
  }
  result->flags = flags;
}

void fit_grid(const struct fit_array *array, const int32_t *pressure_Pa_q10,
              const struct fit_settings *settings, struct fit_result *result) {
  struct readings readings;
  struct moments m;
  struct state state, before;
  if (!fit_grid_take_readings(array, pressure_Pa_q10, settings, &readings)) {
    memset(result, 0, sizeof *result);
    result->flags = CONTACT_FLAG_LOW_SIGNAL;
    return;
  }
  guess(&array->grid, &readings, &m, &state);
  int iterations = settings->iterations;
  int coarse = iterations > COARSE_ITERATIONS ? COARSE_ITERATIONS : 0;
  int i = 0;
  do {
    before = state;
    evaluate(&state, &readings, &m, i < coarse);
    take_step(&array->grid, &state, &m);
    i++;
  } while (i < iterations);
  if (iterations == 0) { /* the guess is asked for: the step only tells how good it is */
    state = before;
    m.c1_q26 = m.c2_q26 = m.c3_q28 = 0;
  }
  result->used = UINT32_MAX >> (FT_MAX_SENSORS - NODES);
  conclude(&array->grid, &readings, settings, &before, &state, &m, result);
}
