/* Gauss-Newton without a matrix to solve. On a full rectangle the model is a product e = gx gy, and its derivatives span
 *   e, e p1(x), e q1(y), e (p2(x) + q2(y))
 * with p and q the polynomials of degree 1 and 2 that are orthogonal over the nodes under gx^2 and gy^2. So the normal
 * matrix is diagonal, and a direction that the data hardly determine is a small element with its full relative
 * precision: 16-bit factors do. The amplitude is the best one for the shape (variable projection). Rounding in matrix,
 * step or amplitude only turns or stretches a step; where the fit ends is decided by the right-hand side. So the
 * residual is computed to 2^-26 of the largest reading and then rounded relative to its own size. */
#include "common/contact_flags.h"
#include "fit/fit_grid_solve.h"
#include "fit/fit_limits.h"
#include "fit/fit_math.h"

#include <stdbool.h>
#include <string.h>

#define UNROLL _Pragma("GCC unroll 6") /* for loops over the nodes of an axis */

/* A sum against the basis is at most sum |value| times |g| <= 2^14 and |p| <= 2^15, less 16 bits: it fits if sum |value| is below 2^17. */
#define RESIDUAL_SUM_BITS 17

/* The first iterations project the readings, since the basis is orthogonal to the model. They are few, because rounding would let them
 * wander along the valleys of badly conditioned presses. */
#define COARSE_ITERATIONS 3
#define FINE_ITERATIONS 2

/* First guess: smaller readings have more noise than shape in their logarithm; a ridge towards sigma 0.45 pitch decides where few remain.
 */
#define GUESS_SHARE_Q30 85899346                            /* 8 % of the largest marginal */
#define GUESS_RIDGE ((struct scaled){25166, -23})           /* 0.003 */
#define GUESS_RIDGE_CURVATURE ((struct scaled){22410, -21}) /* 0.003 * log2(e) / (2 * 0.45^2) */
#define GUESS_CURVATURE_MIN_Q26 1936353
#define GUESS_CURVATURE_MAX_Q26 484088133 /* sigma 0.316 pitch */

/* FIT_ELONGATION_ MIN^2, SDS^2, SD_MAX^2 and LINEAR^2, and the curvature of FIT_WIDTHS_SIGMA_MIN. */
#define ELONGATION_MIN_SQUARE ((struct scaled){20972, -21})
#define ELONGATION_SDS_SQUARE ((struct scaled){25600, -12})
#define ELONGATION_SD_MAX_SQUARE ((struct scaled){16384, -18})
#define ELONGATION_LINEAR_SQUARE ((struct scaled){16056, -15})
#define ELONGATION_CURVATURE_MAX_Q26 160029133
#define TAIL_ERROR ((struct scaled){31457, -21}) /* FIT_TAIL_ERROR */

/* One factor of the Gaussian, and the polynomials orthogonal under its square: p1 = k - mean, p2 = k^2 - k slope + constant, k the node. */
struct factor {
  int32_t g[MAX_SIDE];      /* Q30, 1 at the nearest node */
  int32_t g_q14[MAX_SIDE];  /* the same */
  int32_t linear[MAX_SIDE]; /* g p1, |.| <= 2^15, value = integer * 2^-linear_q */
  int32_t square[MAX_SIDE]; /* g p2, |.| <= 2^15, value = integer * 2^-square_q */
  int32_t linear_q;
  int32_t mass_q26;    /* sum of g^2 */
  int32_t linear_norm; /* sum of linear^2 / 8 */
  int32_t square_norm; /* sum of square^2 / 8 */
  int32_t mean;        /* Q26, as the next three */
  int32_t slope, constant;
  int32_t offset; /* of the centre from the nearest node */
};

/* The normal equations in the orthogonal basis. Mantissas of the struct scaled here have up to 31 bits. */
struct moments {
  struct factor x, y;
  int32_t square_q; /* common to both, so that the parts of p2(x) + q2(y) add up */
  int32_t b_x, b_y; /* those parts of the right-hand side */
};

FIXED_INLINE void set_gaussian(struct factor *f, int nodes, int origin, int32_t centre, int32_t curvature) {
  struct fit_exponent exponent = fit_exponent_first(nodes, origin, centre, curvature, &f->offset);
  UNROLL for (int i = 0; i < nodes; i++) {
    f->g[i] = exp2_negative(exponent.value);
    fit_exponent_next(&exponent);
  }
}

/* Largest |.| of the vector as a bit pattern: only its highest bit means anything. */
FIXED_INLINE uint32_t vector_size(const int32_t *vector, int count) {
  uint32_t size = 1;
  UNROLL for (int i = 0; i < count; i++) { size |= fixed_magnitude(vector[i]); }
  return size;
}

FIXED_INLINE void vector_shift(const int32_t *from, int32_t *to, int count, int32_t shift) {
  int32_t half = (1 << shift) >> 1;
  UNROLL for (int i = 0; i < count; i++) { to[i] = (from[i] + half) >> shift; }
}

/* The shift that brings a size to this many bits; what is smaller stays as it is, since there is nothing below its last bit. */
FIXED_INLINE int32_t shift_to(int32_t bits, uint32_t size) {
  int32_t shift = fixed_bits(size) - bits;
  return shift > 0 ? shift : 0;
}

/* p1 and p2, and these times g. Additions give the values of p2, in Q28, so that they stay accurate where they nearly vanish. */
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

  int32_t values[MAX_SIDE];
  UNROLL for (int i = 0; i < nodes; i++) { values[i] = fixed_mul_q32(f->g[i], ((i - origin) * ONE_Q26 - f->mean) * 4); }
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
  /* The mean under linear^2. Where that is too small to matter, any value serves. */
  int32_t skew = norm < 1 << 13 ? f->mean : fixed_div_q26(moment, norm);

  f->slope = skew + f->mean;
  f->constant = fixed_mul_q26(f->slope, f->mean) - mean_square;
  UNROLL for (int i = 0; i < nodes; i++) {
    int32_t k = i - origin;
    f->square[i] = fixed_mul_near_q28(f->g[i], k * k * ONE_Q26 - k * f->slope + f->constant);
  }
}

FIXED_INLINE int32_t sum_of_squares(const int32_t *vector, int count) {
  int32_t sum = 0;
  UNROLL for (int i = 0; i < count; i++) { sum += (vector[i] * vector[i]) >> 3; }
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

/* <e, readings>, Q(26 - PRODUCT_SHIFT). */
static NOINLINE int32_t project_on_model(const struct moments *m, const int32_t *p_q14) {
  const int32_t *x = m->x.g_q14, *y = m->y.g_q14;
  int32_t product = 0;
  UNROLL for (int i = 0; i < COLUMNS; i++) {
    int32_t sum = 0;
    UNROLL for (int j = 0; j < ROWS; j++) { sum = wrap_add(sum, wrap_mul(p_q14[i * ROWS + j], y[j])); }
    product = wrap_add(product, fixed_mul_16(sum, x[i]) >> PRODUCT_SHIFT);
  }
  return product;
}

/* What the model leaves of the readings, rounded so that its sum has RESIDUAL_SUM_BITS; returns the shift. */
static NOINLINE int32_t set_residual(const struct moments *m, int32_t amplitude_q28, struct readings *readings) {
  const struct factor *y = &m->y;
  const int32_t *p = readings->q28;
  int32_t *residual = readings->residual;
  uint32_t sum = 0; /* in sixteenths */
  for (int i = 0; i < COLUMNS; i++) {
    int32_t column = fixed_mul_q30(amplitude_q28, m->x.g[i]);
    UNROLL for (int j = 0; j < ROWS; j++) {
      int32_t r = p[j] - fixed_mul_q30(y->g[j], column);
      residual[j] = r;
      sum += fixed_magnitude(r) >> 4;
    }
    p += ROWS;
    residual += ROWS;
  }
  sum += (sum >> 8) + 2 * (uint32_t)NODES; /* what the rounding may add */
  int32_t shift = shift_to(RESIDUAL_SUM_BITS - 4, sum), half = (1 << shift) >> 1;
  for (int i = 0; i < COLUMNS; i++) {
    residual -= ROWS;
    UNROLL for (int j = 0; j < ROWS; j++) { residual[j] = (residual[j] + half) >> shift; }
  }
  return shift;
}

/* The sums of the values against the basis. Each part of it is g along one of the axes at least, so sums over rows and columns do. */
static NOINLINE void project(struct moments *m, const int32_t *values, int32_t shift, struct fit_equations *equations) {
  const struct factor *x = &m->x, *y = &m->y;
  int32_t over_y[MAX_COLUMNS] = {0};
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
    b0 += fixed_mul_16(over_y[i], x->g_q14[i]) >> PRODUCT_SHIFT;
    b1 += fixed_mul_16(over_y[i], x->linear[i]);
    b3_x += fixed_mul_16(over_y[i], x->square[i]);
  }
  int32_t q = shift - 26; /* values Q(28 - shift), g Q14, 16 bits dropped */
  equations->b0 = b0 >> (2 - PRODUCT_SHIFT);
  equations->b1 = (struct scaled){b1, q - x->linear_q};
  equations->b2 = (struct scaled){b2, q - y->linear_q};
  equations->b3 = (struct scaled){(b3_x >> 1) + (b3_y >> 1), q + 1 - m->square_q}; /* one bit more */
  m->b_x = b3_x;
  m->b_y = b3_y;
}

FIXED_INLINE void evaluate(struct readings *readings, bool coarse, struct moments *m, struct fit_equations *equations) {
  const struct state *at = &equations->at;
  set_gaussian(&m->x, COLUMNS, COLUMNS / 2, at->x, at->curvature);
  set_gaussian(&m->y, ROWS, ROWS / 2, at->y, at->curvature);
  orthogonalise(m);
  int32_t mass = fixed_mul_q32(m->x.mass_q26, m->y.mass_q26) >> (6 + PRODUCT_SHIFT);
  if (coarse) {
    project(m, readings->q14, 14, equations);
    equations->amplitude_q28 = fit_grid_amplitude(equations->b0 * (4 >> PRODUCT_SHIFT), mass, false);
  } else {
    int32_t product = project_on_model(m, readings->q14);
    equations->amplitude_q28 = fit_grid_amplitude(product, mass, true);
    equations->residual_shift = set_residual(m, equations->amplitude_q28, readings);
    project(m, readings->residual, equations->residual_shift, equations);
  }
  equations->slope_x = m->x.slope;
  equations->slope_y = m->y.slope;
  int32_t mass_x = m->x.mass_q26 >> 14, mass_y = m->y.mass_q26 >> 14;
  equations->d1 = (struct scaled){(m->x.linear_norm >> 14) * mass_y, 5 - 2 * m->x.linear_q};
  equations->d2 = (struct scaled){(m->y.linear_norm >> 14) * mass_x, 5 - 2 * m->y.linear_q};
  equations->d3 = (struct scaled){(m->x.square_norm >> 15) * mass_y + (m->y.square_norm >> 15) * mass_x, 6 - 2 * m->square_q};
  fit_grid_complete(readings, equations);
}

/* What the result needs besides the equations of the last iteration. */
static NOINLINE void finish(const struct readings *readings, const struct moments *m, struct fit_equations *equations) {
  const struct state *at = &equations->at;
  int32_t x = fixed_mul_q26(at->x, at->x - m->x.slope) + m->x.constant;
  int32_t y = fixed_mul_q26(at->y, at->y - m->y.slope) + m->y.constant;
  equations->p3_centre_q24 = (x >> 2) + (y >> 2);
  equations->mean_x = m->x.mean;
  equations->mean_y = m->y.mean;
  equations->mass_q20 = fixed_mul_q32(m->x.mass_q26, m->y.mass_q26);
  equations->rise_q22 = fit_grid_rise(at->curvature, m->x.offset, m->y.offset);
  int32_t squares = 0;
  UNROLL for (int k = 0; k < NODES; k++) {
    int32_t r = readings->residual[k] >> 2;
    squares += r * r;
  }
  equations->square_sum = (struct scaled){squares, 4 + 2 * (equations->residual_shift - 28)};
}

/* How far the contact is from round. Widths that differ, e p2(x) and e q2(y) with signs of their
 * own, and e p1(x) q1(y) are two more orthogonal columns. Their coefficients are the elongation along the axes,
 *   axial = log(sigma_x / sigma_y),  and  diagonal,
 * the same of a contact turned by 45 degrees; together they are the logarithm of the longer width over the shorter. */
struct elongation {
  struct scaled log_width_x, log_width_y, axial, diagonal; /* log_width: log of sigma_x / sigma, sigma_y / sigma */
  struct scaled noise_form;                                /* by which the readings' variance gives that of (length of both)^2 / 2 */
  int32_t x, y, xy, exponent;                              /* how one unit of each column changes that square, halved */
  uint32_t by_gains;                                       /* sum over the sensors, as in struct fit_propagation */
};

/* The sum of the residual against e p1(x) q1(y). */
static struct scaled project_diagonal(const struct moments *m, const struct readings *readings, int32_t residual_shift) {
  const int32_t *r = readings->residual;
  int32_t sum = 0;
  for (int i = 0; i < COLUMNS; i++) {
    int32_t over_y = 0;
    UNROLL for (int j = 0; j < ROWS; j++) { over_y += (r[j] >> 1) * m->y.linear[j]; }
    sum += fixed_mul_16(over_y, m->x.linear[i]);
    r += ROWS;
  }
  return fit_scaled_from(sum, 17 + residual_shift - 28 - m->x.linear_q - m->y.linear_q);
}

static NOINLINE void begin_elongation(const struct readings *readings, const struct moments *m, const struct fit_equations *equations,
                                      const struct fit_propagation *propagation, struct elongation *elongation) {
  const struct factor *x = &m->x, *y = &m->y;
  struct scaled mass_x = fit_scaled_from(x->mass_q26, -26), mass_y = fit_scaled_from(y->mass_q26, -26);
  int32_t norm_q = 3 - 2 * m->square_q;
  struct scaled inverse_x = fit_grid_reciprocal(scaled_mul(fit_scaled_from(x->square_norm, norm_q), mass_y));
  struct scaled inverse_y = fit_grid_reciprocal(scaled_mul(fit_scaled_from(y->square_norm, norm_q), mass_x));
  struct scaled inverse_xy = fit_grid_reciprocal(
      scaled_mul(fit_scaled_from(x->linear_norm, 3 - 2 * x->linear_q), fit_scaled_from(y->linear_norm, 3 - 2 * y->linear_q)));
  struct scaled inverse_stiffness = propagation->inverse_stiffness;
  int32_t q = equations->residual_shift - 26 - m->square_q;
  struct scaled along_x = scaled_mul(inverse_x, inverse_stiffness);
  struct scaled along_y = scaled_mul(inverse_y, inverse_stiffness);
  struct scaled along_xy = scaled_mul(inverse_xy, inverse_stiffness);
  elongation->log_width_x = scaled_mul(fit_scaled_from(m->b_x, q), along_x);
  elongation->log_width_y = scaled_mul(fit_scaled_from(m->b_y, q), along_y);
  elongation->axial = fit_scaled_short(scaled_sub(elongation->log_width_x, elongation->log_width_y));
  elongation->diagonal = scaled_mul(project_diagonal(m, readings, equations->residual_shift), along_xy);

  struct scaled values[3] = {scaled_mul(elongation->axial, along_x), scaled_mul(elongation->axial, along_y),
                             scaled_mul(elongation->diagonal, along_xy)};
  elongation->noise_form = scaled_add(scaled_add(scaled_mul(values[0], elongation->axial), scaled_mul(values[1], elongation->axial)),
                                      scaled_mul(values[2], elongation->diagonal));
  elongation->noise_form = scaled_mul(elongation->noise_form, inverse_stiffness);
  values[0].exponent -= m->square_q;
  values[1].exponent -= m->square_q;
  values[2].exponent -= x->linear_q + y->linear_q - 15;
  int32_t aligned[3];
  elongation->exponent = fit_grid_align(values, 3, aligned) + 15;
  elongation->x = aligned[0];
  elongation->y = -aligned[1];
  elongation->xy = aligned[2];
}

/* cosh(v) and sinh(v) / v from v^2, Q13, for v^2 up to FIT_ELONGATION_MAX^2: error below 1 %. */
FIXED_INLINE int32_t cosh_q13(int32_t square_q13) { return 8192 + (square_q13 >> 1) + port_divide((square_q13 * square_q13) >> 13, 24); }
FIXED_INLINE int32_t sinh_ratio_q13(int32_t square_q13) {
  return 8192 + port_divide(square_q13, 6) + port_divide((square_q13 * square_q13) >> 13, 120);
}

/* Covariance = sigma^2 exp(log_width_x + log_width_y) exp([axial diagonal; diagonal -axial]). */
static NOINLINE bool set_widths(const struct elongation *elongation, struct fit_result *result) {
  int32_t axial = fit_scaled_to_fixed(elongation->axial, 13), diagonal = fit_scaled_to_fixed(elongation->diagonal, 13);
  int32_t log_width = fit_scaled_to_fixed(scaled_add(elongation->log_width_x, elongation->log_width_y), 13);
  const int32_t most = (int32_t)(FIT_ELONGATION_MAX * 8192.0f);
  if (fixed_magnitude(axial) > (uint32_t)most || fixed_magnitude(diagonal) > (uint32_t)most || fixed_magnitude(log_width) > 8192) {
    return false;
  }
  int32_t square = (axial * axial + diagonal * diagonal) >> 13;
  if (square > (most * most) >> 13) {
    return false;
  }
  int32_t mean = cosh_q13(square), ratio = sinh_ratio_q13(square);
  int32_t part = (ratio * axial) >> 13, across = (ratio * diagonal) >> 13;
  /* exp of half the sum, since it multiplies widths. */
  int32_t half = log_width >> 1, half_square = (half * half) >> 13;
  int32_t growth = 8192 + half + (half_square >> 1) + port_divide((half_square * half) >> 13, 6);
  struct scaled scale = scaled_mul(fit_scaled_from(growth, -13), fit_grid_scaled(result->sigma_mm));
  struct scaled x = fit_scaled_sqrt(fit_scaled_from(mean + part, -13));
  struct scaled y = fit_scaled_sqrt(fit_scaled_from(mean - part, -13));
  struct scaled correlation = scaled_mul(fit_scaled_from(across, -13), fit_grid_reciprocal(scaled_mul(x, y)));
  x = scaled_mul(x, scale);
  y = scaled_mul(y, scale);
  result->sigma_x_mm = fit_scaled_float(x);
  result->sigma_y_mm = fit_scaled_float(y);
  int32_t limited = fixed_clamp(fit_scaled_to_fixed(correlation, 15), -32767, 32767);
  result->width_correlation = fit_float(limited, -15);
  return true;
}

/* Each column has g of one axis, so a sensor's influence is a number of its column of nodes times gy, and one of its row times gx. */
struct influence {
  int32_t column[MAX_COLUMNS], row[MAX_ROWS];
};

/* The same as fit_grid_add_influence, from factors instead of the influence of each sensor. */
static NOINLINE void add_influence(const struct moments *m, const struct influence *influence, const struct readings *work,
                                   uint32_t *by_gains, int32_t *by_shape) {
  const int32_t *errors = work->q14, *shapes = work->residual;
  uint32_t squares = *by_gains;
  int32_t sum = 0;
  for (int i = 0; i < COLUMNS; i++) {
    // cppcheck-suppress uninitvar ; the caller has set as many
    int32_t column = influence->column[i], g = m->x.g_q14[i];
    UNROLL for (int j = 0; j < ROWS; j++) {
      int32_t change = (column * m->y.g_q14[j] + influence->row[j] * g) >> 15;
      int32_t high = (change * *errors++) >> 16;
      squares += (uint32_t)(high * high) >> PROPAGATION_SQUARE_SHIFT;
      sum += (change * *shapes++) >> 4;
    }
  }
  *by_gains = squares;
  *by_shape = sum;
}

/* The same for the two columns of the elongation, of the gains alone. */
static NOINLINE void add_elongation_influence(const struct moments *m, const struct influence *influence, const struct readings *work,
                                              struct elongation *elongation) {
  const int32_t *errors = work->q14;
  uint32_t squares = 0;
  for (int i = 0; i < COLUMNS; i++) {
    int32_t column = influence->column[i], g = m->x.g_q14[i];
    int32_t xy = (elongation->xy * m->x.linear[i]) >> 15;
    UNROLL for (int j = 0; j < ROWS; j++) {
      int32_t change = (column * m->y.g_q14[j] + influence->row[j] * g + xy * m->y.linear[j]) >> 15;
      int32_t high = (change * *errors++) >> 16;
      squares += (uint32_t)(high * high) >> PROPAGATION_SQUARE_SHIFT;
    }
  }
  elongation->by_gains = squares;
}

/* And of the profile's tail, which is off everywhere at once. */
static NOINLINE void add_tail_influence(const struct moments *m, const struct influence *influence, const struct readings *readings,
                                        const struct fit_equations *equations, int32_t gain_shift, struct elongation *elongation) {
  struct dip dip;
  const int32_t depth_q28 = fit_grid_dip(readings->dip_curvature, TAIL_ERROR, &equations->at, 1 << 28, equations->rise_q22,
                                         (int32_t)(FIT_DIP_DEPTH_MAX * 268435456.0f), &dip);
  /* Larger only far beside the array, where the fit is at a limit. */
  const int32_t error = fixed_clamp((depth_q28 >> 12) * (1 << (gain_shift + 1)) / 2, 0, INT16_MAX);
  int32_t sum = 0;
  for (int i = 0; i < COLUMNS; i++) {
    int32_t column = influence->column[i], g = m->x.g_q14[i];
    int32_t xy = (elongation->xy * m->x.linear[i]) >> 15;
    int32_t along = (error * (dip.x[i] >> 15)) >> 15;
    UNROLL for (int j = 0; j < ROWS; j++) {
      int32_t change = (column * m->y.g_q14[j] + influence->row[j] * g + xy * m->y.linear[j]) >> 15;
      sum += (change * ((along * (dip.y[j] >> 15)) >> 15)) >> 4;
    }
  }
  const int32_t high = fixed_clamp(sum >> 12, -INT16_MAX, INT16_MAX);
  elongation->by_gains += (uint32_t)(high * high) >> PROPAGATION_SQUARE_SHIFT;
}

/* A coefficient times the linear and one times the square column of an axis. */
FIXED_INLINE void set_parts(const struct factor *f, int nodes, int32_t linear, int32_t square, int32_t *parts) {
  UNROLL for (int i = 0; i < nodes; i++) { parts[i] = (linear * f->linear[i] + square * (f->square[i] >> 1)) >> 14; }
}

/* What errors of single sensors make of the result. */
static NOINLINE void spread_errors(const struct fit_grid_shape *grid, const struct fit_settings *settings, const struct moments *m,
                                   const struct fit_equations *equations, struct readings *work, struct fit_propagation *propagation,
                                   struct elongation *elongation) {
  const struct factor *x = &m->x, *y = &m->y;
  int32_t *model = work->q28;
  for (int i = 0; i < COLUMNS; i++) {
    int32_t g = x->g_q14[i];
    UNROLL for (int j = 0; j < ROWS; j++) { *model++ = (g * y->g_q14[j]) >> 13; }
  }
  fit_grid_set_errors(grid, settings, &equations->at, work, propagation);
  struct influence influence;
  set_parts(x, COLUMNS, propagation->x1, propagation->x3, influence.column);
  set_parts(y, ROWS, 0, propagation->x3, influence.row);
  add_influence(m, &influence, work, &propagation->by_gains, &propagation->shape_x);
  set_parts(x, COLUMNS, 0, propagation->y3, influence.column);
  set_parts(y, ROWS, propagation->y2, propagation->y3, influence.row);
  add_influence(m, &influence, work, &propagation->by_gains, &propagation->shape_y);
  set_parts(x, COLUMNS, propagation->f1, propagation->f3, influence.column);
  set_parts(y, ROWS, propagation->f2, propagation->f3, influence.row);
  UNROLL for (int j = 0; j < ROWS; j++) { influence.row[j] += (propagation->f0 * y->g_q14[j]) >> 13; }
  add_influence(m, &influence, work, &propagation->force_by_gains, &propagation->shape_force);
  set_parts(x, COLUMNS, 0, elongation->x * 2, influence.column);
  set_parts(y, ROWS, 0, elongation->y * 2, influence.row);
  add_elongation_influence(m, &influence, work, elongation);
  if (work->dip_share.mantissa != 0) {
    add_tail_influence(m, &influence, work, equations, propagation->gain_shift, elongation);
  }
  fit_grid_end_propagation(settings, equations, propagation);
}

/* The flags of the elongation that apply. If the contact is elongated, separate widths would move the location. */
static NOINLINE uint32_t judge_elongation(const struct readings *readings, const struct fit_settings *settings,
                                          const struct fit_equations *equations, const struct elongation *elongation,
                                          struct fit_propagation *propagation) {
  const struct state *at = &equations->at;
  if (at->curvature > ELONGATION_CURVATURE_MAX_Q26) {
    return 0;
  }
  struct scaled length_square = fit_scaled_short(
      scaled_add(scaled_mul(elongation->axial, elongation->axial), scaled_mul(elongation->diagonal, elongation->diagonal)));
  struct scaled noise = fit_scaled_from(settings->noise_Pa_q10, readings->shift - 28);
  struct scaled by_gains = scaled_mul(
      fit_scaled_from((int32_t)elongation->by_gains, PROPAGATION_SQUARE_SHIFT - 2 * propagation->gain_shift + 2 * elongation->exponent),
      scaled_mul(propagation->amplitude, propagation->amplitude));
  struct scaled variance = fit_scaled_short(scaled_add(scaled_mul(scaled_mul(noise, noise), elongation->noise_form), by_gains));
  struct scaled least = scaled_add(scaled_mul(length_square, ELONGATION_MIN_SQUARE), scaled_mul(variance, ELONGATION_SDS_SQUARE));
  uint32_t flags = 0;
  if (scaled_sub(scaled_mul(length_square, length_square), least).mantissa > 0) {
    flags |= CONTACT_FLAG_ELONGATED;
    struct scaled x = scaled_mul(fit_scaled_from(2 * at->x - equations->slope_x, -26), elongation->log_width_x);
    struct scaled y = scaled_mul(fit_scaled_from(2 * at->y - equations->slope_y, -26), elongation->log_width_y);
    propagation->elongation_shift = scaled_add(scaled_mul(x, x), scaled_mul(y, y));
    if (scaled_sub(length_square, ELONGATION_LINEAR_SQUARE).mantissa > 0) {
      struct scaled share = scaled_mul(ELONGATION_LINEAR_SQUARE, fit_grid_reciprocal(length_square));
      propagation->elongation_shift = scaled_mul(propagation->elongation_shift, scaled_mul(share, share));
    }
  }
  struct scaled known = scaled_mul(length_square, ELONGATION_SD_MAX_SQUARE);
  if (scaled_sub(variance, known).mantissa <= 0) {
    flags |= CONTACT_FLAG_WIDTHS_VALID;
  }
  return flags;
}

/* First guess, every sensor there: the marginals weighted by the row and the column of the largest reading are the two factors of the
 * Gaussian, and the logarithm of each a parabola. Leaves the marginal in g and its logarithm, weighted by it, in `weighted` (Q14). */
static NOINLINE void set_marginal(struct factor *f, const int32_t *marginal, int32_t *weighted, int nodes) {
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
  UNROLL for (int i = 0; i < count; i++) { sum += a[i] * b[i]; }
  return sum;
}

/* b / (norm + ridge), b in Q(14 + q), the norm 2^(3 - 2 q). */
static NOINLINE struct scaled ridged(int32_t b, int32_t norm, int32_t q) {
  return scaled_div(scaled_from(b, -14 - q), scaled_add(scaled_from(norm, 3 - 2 * q), GUESS_RIDGE));
}

static NOINLINE void guess(const struct fit_grid_shape *grid, const struct readings *readings, struct moments *m, struct state *state) {
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
  int32_t across[MAX_SIDE], along[MAX_SIDE] = {0}, weighted_x[MAX_SIDE], weighted_y[MAX_SIDE];
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

  /* From the parabola's coefficients: curvature = -c3, centre = slope / 2 + c1 / (2 curvature). */
  struct scaled c1 = ridged(product_of(m->x.linear, weighted_x, COLUMNS), m->x.linear_norm, m->x.linear_q);
  struct scaled c2 = ridged(product_of(m->y.linear, weighted_y, ROWS), m->y.linear_norm, m->y.linear_q);
  struct scaled b3 =
      scaled_from(product_of(m->x.square, weighted_x, COLUMNS) + product_of(m->y.square, weighted_y, ROWS), -14 - m->square_q);
  struct scaled norm = scaled_from(m->x.square_norm + m->y.square_norm, 3 - 2 * m->square_q);
  struct scaled curvature = scaled_div(scaled_sub(GUESS_RIDGE_CURVATURE, b3), scaled_add(norm, GUESS_RIDGE));
  state->curvature = fixed_clamp(scaled_to_fixed(curvature, 26), GUESS_CURVATURE_MIN_Q26, GUESS_CURVATURE_MAX_Q26);
  struct scaled half = scaled_div(scaled_from(1, -1), scaled_from(state->curvature, -26));
  int32_t x = (m->x.slope >> 1) + scaled_to_fixed(scaled_mul(c1, half), 26);
  int32_t y = (m->y.slope >> 1) + scaled_to_fixed(scaled_mul(c2, half), 26);
  state->x = fixed_clamp(x, grid->x_min + ONE_Q26 / 2, grid->x_max - ONE_Q26 / 2);
  state->y = fixed_clamp(y, grid->y_min + ONE_Q26 / 2, grid->y_max - ONE_Q26 / 2);
}

/* Removes from the readings what is not the Gaussian's: the dip, and the deviations of the sensors. */
static NOINLINE void remove_dip_and_deviations(const struct fit_array *array, const int32_t *pressure_Pa_q10,
                                               const struct fit_settings *settings, const struct state *state, const struct moments *m,
                                               const struct fit_equations *equations, int left, struct readings *readings) {
  const int32_t rise_q22 = fit_grid_rise(equations->at.curvature, m->x.offset, m->y.offset);
  if (readings->dip_share.mantissa != 0) {
    fit_grid_remove_dip(array, pressure_Pa_q10, state, equations->amplitude_q28, rise_q22, readings);
  }
  if (fit_has_deviations(settings) && left == FIT_DEVIATION_ITERATIONS) {
    const int32_t peak_q28 = fit_grid_peak(equations->amplitude_q28, rise_q22, ONE, FIT_DEVIATION_PEAK_MAX_Q28);
    fit_grid_remove_deviations(array, settings, ~(sensor_map)0, state, peak_q28, readings);
  }
}

bool fit_grid(const struct fit_array *array, const int32_t *pressure_Pa_q10, const struct fit_settings *settings,
              struct fit_result *result) {
  const struct fit_grid_shape *grid = &array->grid;
  fit_use_rectangle(grid);
  struct readings readings;
  struct moments m;
  struct fit_equations equations;
  struct state state;
  if (!fit_grid_take_readings(array, pressure_Pa_q10, ~(sensor_map)0, settings, &readings)) {
    memset(result, 0, sizeof *result);
    result->flags = CONTACT_FLAG_LOW_SIGNAL;
    return false;
  }
  guess(grid, &readings, &m, &state);
  equations.cross = 0;
  int left = settings->iterations;
  int coarse = left - COARSE_ITERATIONS;
  const int last = left > FIT_DEVIATION_ITERATIONS ? FIT_DEVIATION_ITERATIONS : 1; /* that removes */
  do {
    if (left < settings->iterations && left >= last && (readings.dip_share.mantissa != 0 || fit_has_deviations(settings))) {
      remove_dip_and_deviations(array, pressure_Pa_q10, settings, &state, &m, &equations, left, &readings);
    }
    equations.at = state;
    evaluate(&readings, left > coarse && left > FINE_ITERATIONS, &m, &equations);
    fit_grid_step(grid, &equations, &state);
    if (left == 0) { /* the guess is asked for: the step only shows how good it is */
      state = equations.at;
    }
    left--;
  } while (left > 0);
  result->flags = 0;
  result->used = first_sensors((unsigned)NODES);
  result->sigma_x_mm = result->sigma_y_mm = result->width_correlation = 0.0f;
  finish(&readings, &m, &equations);
  struct fit_propagation propagation;
  struct elongation elongation;
  const struct fit_columns_q q = {m.x.linear_q, m.y.linear_q, m.square_q - 1};
  fit_grid_begin_propagation(readings.shift, &equations, &q, &propagation);
  begin_elongation(&readings, &m, &equations, &propagation, &elongation);
  spread_errors(grid, settings, &m, &equations, &readings, &propagation, &elongation);
  uint32_t flags = judge_elongation(&readings, settings, &equations, &elongation, &propagation);
  bool rough = fit_grid_conclude(grid, &readings, settings, &equations, &propagation, &state, NODES, result);
  if (!(result->flags & (CONTACT_FLAG_AT_BOUND | CONTACT_FLAG_FLAT | CONTACT_FLAG_LOW_SIGNAL))) {
    if ((flags & CONTACT_FLAG_WIDTHS_VALID) && !set_widths(&elongation, result)) {
      flags &= ~(uint32_t)CONTACT_FLAG_WIDTHS_VALID;
    }
    result->flags |= flags;
  }
  return rough;
}
