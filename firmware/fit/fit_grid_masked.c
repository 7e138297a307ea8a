/* The grid fit without some of its sensors, where the polynomials of fit_grid.c are not orthogonal. The columns are
 * formed at the sensors that are there, relative to the strongest of those, and made orthogonal over them: each is the
 * model times a polynomial, a part along x plus one along y, whose coefficients come from the iteration before and are
 * nearly right already; an L D L^T of three columns takes out what is left and mends the coefficients for the next.
 * Where the fit ends is decided by the residual against columns of 15 bits, as in fit_grid.c. */
#include "common/contact_flags.h"
#include "fit/fit_grid_solve.h"
#include "fit/fit_limits.h"

#include <string.h>

#define ORIGIN_X (COLUMNS / 2)
#define ORIGIN_Y (ROWS / 2)

#define PRAGMA(text) _Pragma(#text)
#define UNROLL_BY(n) PRAGMA(GCC unroll n)
#define UNROLL UNROLL_BY(5)

/* Polynomials over the nodes are sums of a part along x and one along y. Those of degree one are in LINEAR_Q, |.| <
 * 2^30, that of degree two in SQUARE_Q, |.| < 2^31. Their coefficients are held to what a press can ask for, and used
 * with 12 bits after the point: what that leaves to be orthogonal is dealt with as the rest is. */
#define LINEAR_Q (COLUMNS > 5 || ROWS > 5 ? 24 : 25)
#define LINEAR_ONE (1 << LINEAR_Q)
#define LINEAR_TO_Q26 (1 << (26 - LINEAR_Q))
#define SQUARE_Q (LINEAR_Q - 1)
#define SQUARE_ONE (1 << SQUARE_Q)
#define CROSS_LIMIT (4 << LINEAR_Q)
#define SKEW_LIMIT (4 << LINEAR_Q)
#define LIFT_LIMIT (2 << LINEAR_Q)
#define COEFFICIENT_SHIFT (LINEAR_Q - 12)

/* Sums over all nodes stay within 32 bits. */
#define NORM_SHIFT (NODES > 15 ? 5 : 4)
#define MASS_SHIFT (NODES > 15 ? 6 : 4)
#define SUM_BITS (NODES > 15 ? 25 : 26)
#define COARSE_SHIFT (NODES > 15 ? 4 : 2)

/* A node below 2^-25 of the strongest carries nothing; one that is not used is as far as that, and its reading counts as 0. */
#define FAR 25
#define UNUSED (1 << 24)

/* The first iterations only have to come near: they project the readings themselves. */
#define COARSE_ITERATIONS 3
#define FINE_ITERATIONS 3

/* One sensor: the model there and the columns of the normal equations. Side by side, so that one pointer reaches them all. */
struct node {
  int32_t e;               /* Q30; then the residual, Q28 */
  int32_t mantissa, shift; /* e again, to 15 bits of its own: mantissa * 2^-(15 + shift) */
  int32_t d;               /* the dip there, in units of e, Q30 */
  int32_t p1, p2, p3;      /* e times the polynomials of struct fit_equations; |.| < 2^15 */
};

/* The columns and the polynomials behind them. The polynomials are those that were orthogonal under the previous iterate, about the present
 * mean; what is missing to be orthogonal under the present one is small, and the factors below take it out of the right-hand side. */
struct columns {
  bool dip;
  int32_t narrowness_q12;      /* sigma^2 over that of the dip */
  int32_t centre_x, centre_y;  /* LINEAR_Q */
  int32_t lift1, lift2, lift3; /* LINEAR_Q: what project_out took, in units of the polynomials */
  int32_t q1, q2, q3;          /* value = integer * 2^-q */
  int32_t mean_x, mean_y;      /* LINEAR_Q, as the next */
  int32_t cross;               /* p2 = dy - cross dx */
  int32_t skew_x, skew_y;      /* p3 = dx^2 + dy^2 - variance - skew_x dx - skew_y dy */
  int32_t variance;
  int32_t mass;                /* sum of (e - d)^2, Q(30 - MASS_SHIFT) */
  int32_t product;             /* sum of e - d times the reading, Q(26 - PRODUCT_SHIFT) */
  int32_t norm1, norm2, norm3; /* value = integer * 2^(NORM_SHIFT - 2 q) */
  int32_t f21, f31, f32;       /* L of L D L^T, Q12 in the units of the columns */
  struct node node[MAX_NODES]; /* last: what is before is within reach of a short instruction */
};

/* Added to the norms: what it is in units of a column of the finest scale that is allowed. */
struct ridge {
  int32_t finest_q, norm;
};
/* Ridge of the guess: 0.003. Ridge of the iterations: 2^-31, below which columns are rounding. */
static const struct ridge guess_ridge = {20, 206158430}; /* 0.003 * 2^36 */
static const struct ridge rounding_ridge = {24, 1 << 13};
#define GUESS_RIDGE_CURVATURE ((struct scaled){25733, -21}) /* 0.003 * log2(e) / (2 * 0.42^2) */
#define GUESS_CURVATURE_MIN_Q26 1936353
#define GUESS_CURVATURE_MAX_Q26 484088133 /* sigma 0.316 pitch */
#define GUESS_NOISE_SDS 5                 /* readings below that many noise standard deviations, or */
                                          /* 1 % of the largest, do not enter */

enum { STEP = sizeof(struct node) / sizeof(int32_t) };

/* A column that the dip adds to may double when it is made orthogonal to the model. */
#define COLUMN_BITS(has_dip) ((has_dip) ? 14 : 15)

/* Rounds a column in Qraw_q to this number of bits, unless it has fewer. Returns its norm with the ridge. */
FIXED_INLINE int32_t normalise(int32_t *column, uint32_t size, int32_t bits, int32_t raw_q, const struct ridge *ridge, int32_t *q) {
  int32_t shift = fixed_bits(size) - bits;
  int32_t least = raw_q - ridge->finest_q;
  shift = shift < least ? least : shift;
  shift = shift < 0 ? 0 : shift;
  *q = raw_q - shift;
  int32_t finer = 2 * (ridge->finest_q - *q);
  int32_t norm = (ridge->norm >> (finer > 31 ? 31 : finer)) + (1 << 13);
  UNROLL
  for (int k = 0; k < NODES; k++) {
    int32_t value = *column >> shift;
    *column = value;
    norm += (value * value) >> NORM_SHIFT;
    column += STEP;
  }
  return norm;
}

/* A polynomial as it applies to the model or on the dip: a part along x plus one along y. */
struct polynomial {
  int32_t x[MAX_COLUMNS], y[MAX_ROWS];
};

/* The same of the dip, taken from a column. Returns the size with its own. */
static NOINLINE uint32_t take_dip(int32_t *column, const struct node *node, const struct polynomial *p, uint32_t size) {
  for (int i = 0; i < COLUMNS; i++) {
    for (int j = 0; j < ROWS; j++) {
      int32_t value = *column - fixed_mul_16(p->x[i] + p->y[j], node->d >> 15);
      *column = value;
      size |= fixed_magnitude(value);
      column += STEP;
      node++;
    }
  }
  return size;
}

/* Column of the model times (along_x[i] + along_y[j]), less the dip times that of `dip`, if any. along_y: NULL for none. */
FIXED_INLINE int32_t fill_column(int32_t *column, const struct node *node, const int32_t *along_x, const int32_t *along_y, int32_t q,
                                 const struct polynomial *dip, const struct ridge *ridge, int32_t *column_q) {
  uint32_t size = 1;
  int32_t *to = column;
  for (int i = 0; i < COLUMNS; i++) {
    int32_t x = along_x[i];
    UNROLL
    for (int j = 0; j < ROWS; j++) {
      int32_t value = fixed_mul_16(along_y ? x + along_y[j] : x, node->mantissa) >> node->shift;
      *to = value;
      size |= fixed_magnitude(value);
      to += STEP;
      node++;
    }
  }
  if (dip) {
    size = take_dip(column, node - NODES, dip, size);
  }
  return normalise(column, size, COLUMN_BITS(dip), q - 1, ridge, column_q);
}
static NOINLINE int32_t fill(int32_t *column, const struct node *node, const int32_t *along_x, const int32_t *along_y, int32_t q,
                             const struct polynomial *dip, const struct ridge *ridge, int32_t *column_q) {
  return fill_column(column, node, along_x, along_y, q, dip, ridge, column_q);
}
static NOINLINE int32_t fill_along_x(struct node *node, const int32_t *along_x, const struct polynomial *dip, const struct ridge *ridge,
                                     int32_t *column_q) {
  return fill_column(&node->p1, node, along_x, NULL, LINEAR_Q, dip, ridge, column_q);
}

/* value * coefficient / 2^12, |coefficient| < 2^15. */
FIXED_INLINE int32_t times_q12(int32_t value, int32_t coefficient) {
  return (value >> 16) * coefficient * 16 + (((value & 0xFFFF) * coefficient) >> 12);
}

/* product / norm in Q12. */
FIXED_INLINE int32_t factor(int32_t product, int32_t norm) { return fixed_clamp(port_divide(product, norm >> 12), -INT16_MAX, INT16_MAX); }

/* Converts from Q12 in units of columns to LINEAR_Q. */
FIXED_INLINE int32_t to_poly(int32_t factor_q12, int32_t finer, int32_t limit) {
  int32_t shift = finer + LINEAR_Q - 12;
  shift = shift > 14 ? 14 : shift;
  int32_t value = shift < 0 ? factor_q12 >> (shift < -31 ? 31 : -shift) : factor_q12 * (1 << shift);
  return fixed_clamp(value, -limit, limit);
}

/* What elimination leaves of a norm; never so little that rounding decides. */
FIXED_INLINE int32_t remaining(int32_t norm, int32_t taken) {
  int32_t least = norm >> 8;
  return norm - taken < least ? least : norm - taken;
}

/* Mean and variance of the positions under the squared model, and the readings times the model. */
static NOINLINE void set_mean(const struct readings *readings, struct columns *c) {
  const int32_t *p_q14 = readings->q14;
  int32_t product = 0;
  int32_t mass = 0, first_x = 0, first_y = 0, second = 0;
  const struct node *node = c->node;
  for (int i = 0; i < COLUMNS; i++) {
    const int32_t x = i - ORIGIN_X;
    int32_t sum = 0;
    UNROLL_BY(FIT_GRID_MAX_SIDE)
    for (int j = 0; j < ROWS; j++) {
      const int32_t y = j - ORIGIN_Y;
      int32_t weight = ((node->mantissa * node->mantissa) >> (node->shift + MASS_SHIFT)) >> node->shift;
      sum += weight;
      first_y += y * weight;
      second += y * y * (weight >> 2);
      product += (*p_q14++ * node->mantissa) >> (node->shift + 3 + PRODUCT_SHIFT);
      node++;
    }
    mass += sum;
    first_x += x * sum;
    second += x * x * (sum >> 2);
  }
  int32_t mean_x = fixed_div_q26(first_x, mass), mean_y = fixed_div_q26(first_y, mass);
  int32_t squares = fixed_mul_q26(mean_x, mean_x) + fixed_mul_q26(mean_y, mean_y);
  c->mass = mass;
  c->product = product;
  c->mean_x = mean_x >> (26 - LINEAR_Q);
  c->mean_y = mean_y >> (26 - LINEAR_Q);
  c->variance = (fixed_div_q26(second, mass >> 2) - squares) >> (26 - LINEAR_Q);
}

/* The model with its dip, Q15. */
FIXED_INLINE int32_t model_q15(const struct node *node) { return (node->mantissa >> node->shift) - (node->d >> 15); }

/* Mass and product with the dip. */
static NOINLINE void set_mass(const struct readings *readings, struct columns *c) {
  int32_t mass = 1 << 13, product = 0; /* never 0 as a divisor, as the norms */
  for (int k = 0; k < NODES; k++) {
    int32_t f = model_q15(&c->node[k]);
    mass += (f * f) >> MASS_SHIFT;
    product += (readings->q14[k] * f) >> (3 + PRODUCT_SHIFT);
  }
  c->mass = mass;
  c->product = product;
}

/* What one column moves, a change of centre and width, moves the dip with the centre alone, in the
 * proportion sigma^2 / dip_sd^2. So where p is the polynomial of the column on the model, that on
 * the dip is p at the centre + sigma^2 / dip_sd^2 (x - centre) times the slope of p there. */
struct dips {
  struct polynomial p1, p2, p3;
};
/* Pitches squared, SQUARE_Q: a contact and sensors in use that are further apart show no more. */
#define PART_MAX (32 << SQUARE_Q)
static NOINLINE void set_dips(const struct columns *c, struct dips *dips) {
  const int32_t off_x = c->centre_x - c->mean_x, off_y = c->centre_y - c->mean_y;
  const int32_t cross = c->cross >> COEFFICIENT_SHIFT;
  /* p3 = x (x - skew_x) + y (y - skew_y) - variance of the offsets from the mean */
  const int32_t rest_x = (off_x - c->skew_x) * LINEAR_TO_Q26;
  const int32_t rest_y = (off_y - c->skew_y) * LINEAR_TO_Q26;
  const int32_t slope_x = rest_x + off_x * LINEAR_TO_Q26, slope_y = rest_y + off_y * LINEAR_TO_Q26;
  const int32_t constant_x = fixed_mul_q26(off_x >> 1, rest_x) - (c->variance >> 1);
  const int32_t constant_y = fixed_mul_q26(off_y >> 1, rest_y);
  for (int i = 0; i < COLUMNS; i++) {
    int32_t away = times_q12((i - ORIGIN_X) * LINEAR_ONE - c->centre_x, c->narrowness_q12);
    dips->p1.x[i] = off_x + away;
    dips->p2.x[i] = -times_q12(off_x + away, cross);
    int32_t part = constant_x + fixed_mul_q26(away >> 1, slope_x);
    dips->p3.x[i] = fixed_clamp(part, -PART_MAX, PART_MAX);
  }
  for (int j = 0; j < ROWS; j++) {
    int32_t away = times_q12((j - ORIGIN_Y) * LINEAR_ONE - c->centre_y, c->narrowness_q12);
    dips->p1.y[j] = 0;
    dips->p2.y[j] = off_y + away;
    int32_t part = constant_y + fixed_mul_q26(away >> 1, slope_y);
    dips->p3.y[j] = fixed_clamp(part, -PART_MAX, PART_MAX);
  }
}

/* Makes the column orthogonal to the model, and mends its norm. Returns what that took from the polynomial, LINEAR_Q. */
static NOINLINE int32_t project_out(const struct columns *c, int32_t *column, int32_t q, int32_t *norm) {
  int32_t sum = 0;
  const int32_t *from = column;
  for (int k = 0; k < NODES; k++) {
    sum += (model_q15(&c->node[k]) * *from) >> MASS_SHIFT;
    from += STEP;
  }
  const int32_t share_q12 = factor(sum, c->mass);
  for (int k = 0; k < NODES; k++) {
    *column -= times_q12(model_q15(&c->node[k]), share_q12);
    column += STEP;
  }
  sum = MASS_SHIFT > NORM_SHIFT ? sum * (1 << (MASS_SHIFT - NORM_SHIFT)) : sum;
  *norm = remaining(*norm, times_q12(sum, share_q12));
  return to_poly(share_q12, 15 - q, LIFT_LIMIT);
}

/* The columns and their norms, from the polynomials of the iteration before. */
static NOINLINE void fill_columns(const struct readings *readings, const struct ridge *ridge, struct columns *c) {
  set_mean(readings, c);
  struct dips dips;
  const struct polynomial *dip1 = NULL, *dip2 = NULL, *dip3 = NULL;
  if (c->dip) {
    set_mass(readings, c);
    set_dips(c, &dips);
    dip1 = &dips.p1;
    dip2 = &dips.p2;
    dip3 = &dips.p3;
  }
  int32_t dx[MAX_COLUMNS], dy[MAX_ROWS], square_x[MAX_COLUMNS], square_y[MAX_ROWS];
  int32_t mean_x = c->mean_x, mean_y = c->mean_y;
  int32_t cross = c->cross >> COEFFICIENT_SHIFT;
  int32_t skew_x = c->skew_x >> COEFFICIENT_SHIFT, skew_y = c->skew_y >> COEFFICIENT_SHIFT;
  int32_t constant = (fixed_mul_q26(mean_x, mean_x * LINEAR_TO_Q26) - c->variance) >> 1;
  for (int i = 0; i < COLUMNS; i++) {
    const int32_t k = i - ORIGIN_X;
    dx[i] = k * LINEAR_ONE - mean_x;
    square_x[i] = k * k * SQUARE_ONE - k * mean_x + constant - (times_q12(dx[i], skew_x) >> 1);
  }
  constant = fixed_mul_q26(mean_y, mean_y * LINEAR_TO_Q26) >> 1;
  for (int j = 0; j < ROWS; j++) {
    const int32_t k = j - ORIGIN_Y;
    dy[j] = k * LINEAR_ONE - mean_y;
    square_y[j] = k * k * SQUARE_ONE - k * mean_y + constant - (times_q12(dy[j], skew_y) >> 1);
  }
  c->norm1 = fill_along_x(c->node, dx, dip1, ridge, &c->q1);
  c->norm3 = fill(&c->node[0].p3, c->node, square_x, square_y, SQUARE_Q, dip3, ridge, &c->q3);
  for (int i = 0; i < COLUMNS; i++) {
    dx[i] = -times_q12(dx[i], cross);
  }
  c->norm2 = fill(&c->node[0].p2, c->node, dx, dy, LINEAR_Q, dip2, ridge, &c->q2);
  c->lift1 = c->lift2 = c->lift3 = 0;
  if (c->dip) {
    c->lift1 = project_out(c, &c->node[0].p1, c->q1, &c->norm1);
    c->lift2 = project_out(c, &c->node[0].p2, c->q2, &c->norm2);
    c->lift3 = project_out(c, &c->node[0].p3, c->q3, &c->norm3);
  }
}

/* After fill_columns: the factors, and the polynomials of the next iteration. */
static NOINLINE void orthogonalise(struct columns *c) {
  int32_t g21 = 0, g31 = 0, g32 = 0;
  const struct node *node = c->node;
  UNROLL
  for (int k = 0; k < NODES; k++) {
    int32_t p1 = node->p1, p2 = node->p2, p3 = node->p3;
    g21 += (p1 * p2) >> NORM_SHIFT;
    g31 += (p1 * p3) >> NORM_SHIFT;
    g32 += (p2 * p3) >> NORM_SHIFT;
    node++;
  }
  c->f21 = factor(g21, c->norm1);
  c->f31 = factor(g31, c->norm1);
  c->norm2 = remaining(c->norm2, times_q12(g21, c->f21));
  g32 -= times_q12(g31, c->f21);
  c->f32 = factor(g32, c->norm2);
  c->norm3 = remaining(c->norm3, times_q12(g31, c->f31) + times_q12(g32, c->f32));

  /* The coefficients with the precision that they are used with. */
  const int32_t used = -(1 << COEFFICIENT_SHIFT);
  int32_t cross = (c->cross & used) + to_poly(c->f21, c->q1 - c->q2, CROSS_LIMIT);
  int32_t tilt_x = to_poly(c->f31, c->q1 - c->q3, SKEW_LIMIT);
  int32_t tilt_y = to_poly(c->f32, c->q2 - c->q3, SKEW_LIMIT);
  c->cross = fixed_clamp(cross, -CROSS_LIMIT, CROSS_LIMIT);
  tilt_x += (c->skew_x & used) - fixed_mul_q26(tilt_y, c->cross * LINEAR_TO_Q26);
  tilt_y += c->skew_y & used;
  c->skew_x = fixed_clamp(tilt_x, -SKEW_LIMIT, SKEW_LIMIT);
  c->skew_y = fixed_clamp(tilt_y, -SKEW_LIMIT, SKEW_LIMIT);
}

/* norm as a mantissa of 30 bits. */
FIXED_INLINE struct scaled long_norm(int32_t norm, int32_t q) {
  int32_t up = 30 - fixed_bits((uint32_t)norm);
  return (struct scaled){norm * (1 << up), NORM_SHIFT - 2 * q - up};
}

/* The equations from sums over the columns in Q q. */
static NOINLINE void eliminate(const struct columns *c, int32_t sum1, int32_t sum2, int32_t sum3, int32_t q,
                               struct fit_equations *equations) {
  sum2 -= times_q12(sum1, c->f21);
  sum3 -= times_q12(sum1, c->f31) + times_q12(sum2, c->f32);
  equations->b1 = (struct scaled){sum1, -q - c->q1};
  equations->b2 = (struct scaled){sum2, -q - c->q2};
  equations->b3 = (struct scaled){sum3, -q - c->q3};
  equations->d1 = long_norm(c->norm1, c->q1);
  equations->d2 = long_norm(c->norm2, c->q2);
  equations->d3 = long_norm(c->norm3, c->q3);
  equations->mean_x = (c->mean_x + c->lift1) * LINEAR_TO_Q26;
  equations->mean_y = (c->mean_y + c->lift2 + times_q12(c->lift1, c->cross >> COEFFICIENT_SHIFT)) * LINEAR_TO_Q26;
  equations->cross = c->cross * LINEAR_TO_Q26;
  equations->slope_x = (2 * c->mean_x + c->skew_x) * LINEAR_TO_Q26;
  equations->slope_y = (2 * c->mean_y + c->skew_y) * LINEAR_TO_Q26;
}

/* First guess: a paraboloid fits the logarithm of the readings, weighted by them. A ridge decides where too few of them are large. */
static NOINLINE void guess(const struct fit_grid_shape *grid, const struct readings *readings, const struct fit_settings *settings,
                           struct columns *c, struct fit_equations *equations, struct state *state) {
  int32_t up = readings->shift > 0 ? readings->shift : 0, down = up - readings->shift;
  int32_t largest = (readings->largest >> down) * (1 << up);
  int32_t noise = settings->noise_Pa_q10 >> down;
  noise = noise < largest >> up ? noise * (1 << up) : largest;
  int32_t least = (largest >> 7) + (largest >> 9);
  least = noise * GUESS_NOISE_SDS > least ? noise * GUESS_NOISE_SDS : least;
  least = least < largest ? least : largest;
  int32_t weighted[MAX_NODES];
  for (int k = 0; k < NODES; k++) {
    int32_t p = readings->q28[k];
    bool enters = p >= least;
    c->node[k].shift = 0;
    c->node[k].mantissa = enters ? p >> 13 : 0;
    weighted[k] = enters ? ((p >> 13) * (log2_q15(p >> 14) >> 3)) >> 13 : 0; /* Q14 */
  }
  c->cross = c->skew_x = c->skew_y = 0;
  c->dip = false;
  fill_columns(readings, &guess_ridge, c);
  orthogonalise(c);
  int32_t sum1 = 0, sum2 = 0, sum3 = 0;
  const struct node *node = c->node;
  for (int k = 0; k < NODES; k++) {
    // cppcheck-suppress uninitvar ; NODES of them are set
    sum1 += (node->p1 * weighted[k]) >> NORM_SHIFT;
    sum2 += (node->p2 * weighted[k]) >> NORM_SHIFT;
    sum3 += (node->p3 * weighted[k]) >> NORM_SHIFT;
    node++;
  }
  eliminate(c, sum1, sum2, sum3, 14 - NORM_SHIFT, equations);
  struct scaled c1 = scaled_div(scaled_short(equations->b1), scaled_short(equations->d1));
  struct scaled c2 = scaled_div(scaled_short(equations->b2), scaled_short(equations->d2));
  struct scaled curvature = scaled_div(scaled_sub(GUESS_RIDGE_CURVATURE, scaled_short(equations->b3)), scaled_short(equations->d3));
  state->curvature = fixed_clamp(scaled_to_fixed(curvature, 26), GUESS_CURVATURE_MIN_Q26, GUESS_CURVATURE_MAX_Q26);
  struct scaled half = scaled_div((struct scaled){1 << 14, -15}, scaled_from(state->curvature, -26));
  c1 = scaled_sub(c1, scaled_mul(c2, scaled_from(equations->cross, -26)));
  int32_t x = scaled_to_fixed(scaled_mul(c1, half), 26);
  int32_t y = scaled_to_fixed(scaled_mul(c2, half), 26);
  x = fixed_clamp(x, -(1 << 28), 1 << 28) + (equations->slope_x >> 1);
  y = fixed_clamp(y, -(1 << 28), 1 << 28) + (equations->slope_y >> 1);
  state->x = fixed_clamp(x, grid->x_min, grid->x_max);
  state->y = fixed_clamp(y, grid->y_min, grid->y_max);
}

/* One factor of the Gaussian, mantissa (Q30, above 0.5) 2^-shift, over that at the nearest node. Returns the centre from that node, Q26. */
static NOINLINE int32_t set_factor(int32_t *mantissa, int32_t *shift, int nodes, int origin, int32_t centre, int32_t curvature) {
  int32_t offset;
  struct fit_exponent exponent = fit_exponent_first(nodes, origin, centre, curvature, &offset);
  for (int i = 0; i < nodes; i++) {
    shift[i] = (int32_t)(exponent.value >> 22);
    mantissa[i] = exp2_negative(exponent.value & 0x3FFFFF);
    fit_exponent_next(&exponent);
  }
  return offset;
}

/* The model at the sensors in use, over the power of two of the strongest. Returns log2 of the model at the centre in that unit, Q22. */
static NOINLINE int32_t set_model(const struct state *at, const int32_t *unused, struct columns *c) {
  int32_t factor_x[MAX_COLUMNS], factor_y[MAX_ROWS], shift_x[MAX_COLUMNS], shift_y[MAX_ROWS];
  int32_t offset_x = set_factor(factor_x, shift_x, COLUMNS, ORIGIN_X, at->x, at->curvature);
  int32_t offset_y = set_factor(factor_y, shift_y, ROWS, ORIGIN_Y, at->y, at->curvature);
  int32_t strongest = INT32_MAX;
  struct node *node = c->node;
  for (int i = 0; i < COLUMNS; i++) {
    int32_t along = shift_x[i];
    UNROLL
    for (int j = 0; j < ROWS; j++) {
      int32_t shift = along + shift_y[j] + unused[j];
      node->shift = shift;
      strongest = shift < strongest ? shift : strongest;
      node++;
    }
    unused += ROWS;
  }
  node = c->node;
  for (int i = 0; i < COLUMNS; i++) {
    int32_t along = factor_x[i];
    UNROLL
    for (int j = 0; j < ROWS; j++) {
      int32_t shift = node->shift - strongest;
      shift = shift < FAR ? shift : FAR;
      int32_t product = fixed_mul_q30(along, factor_y[j]);
      node->e = product >> shift;
      node->mantissa = (product - (product >> 15)) >> 15;
      node->shift = shift;
      node++;
    }
  }
  int32_t power = strongest < 100 ? strongest : 100;
  return (power << 22) + fit_grid_rise(at->curvature, offset_x, offset_y);
}

#define DEPTH_MAX_Q28 (1 << 26)                                      /* of the strongest node, which is from a quarter to one */
#define IN_ORDER(exponent, mantissa) ((exponent)*65536 + (mantissa)) /* of a positive struct scaled */
#define SHAPE_MIN IN_ORDER(-15, (int32_t)(FIT_WIDTHS_SIGMA_MIN * 32768.0f))
#define DIP_END_Q15 ((int32_t)(FIT_DIP_END * 32768.0f))
#define NARROWNESS_MAX_Q12 (1 << 11) /* a dip is wider than its contact */

/* Takes FIT_DIP_END from the nearer end of an axis. */
static NOINLINE void take_end(int32_t *dip, int32_t last, int32_t centre) {
  int32_t inside_q15 = (centre >> 11) + ((last + 1) >> 1 << 15), other_q15 = (last << 15) - inside_q15;
  if (inside_q15 > other_q15) {
    inside_q15 = other_q15;
    dip += last;
  }
  int32_t share_q15 = DIP_END_Q15 - ((inside_q15 * 3) >> 2);
  if (share_q15 > 0) {
    *dip -= (*dip >> 15) * (share_q15 < DIP_END_Q15 ? share_q15 : DIP_END_Q15);
  }
}

/* The dip at the sensors in use. */
static NOINLINE void set_dip(const struct readings *readings, const struct fit_equations *equations, struct columns *c) {
  const struct state *at = &equations->at;
  c->dip = readings->dip_share.mantissa != 0;
  if (!c->dip) {
    return;
  }
  c->centre_x = at->x / LINEAR_TO_Q26;
  c->centre_y = at->y / LINEAR_TO_Q26;
  int32_t narrowness = port_divide(readings->dip_curvature, at->curvature >> 12);
  c->narrowness_q12 = narrowness < NARROWNESS_MAX_Q12 ? narrowness : NARROWNESS_MAX_Q12;
  struct dip dip;
  int32_t depth_q28 = fit_grid_dip(readings->dip_curvature, readings->dip_share, at, 1 << 28, equations->rise_q22, DEPTH_MAX_Q28, &dip);
  const struct scaled *known = &readings->prior_sigma;
  if (IN_ORDER(known->exponent, known->mantissa) < SHAPE_MIN) { /* not known: 0 */
    if (COLUMNS > 2) {
      take_end(dip.x, COLUMNS - 1, at->x);
    }
    if (ROWS > 2) {
      take_end(dip.y, ROWS - 1, at->y);
    }
  }
  struct node *node = c->node;
  for (int i = 0; i < COLUMNS; i++) {
    int32_t along = fixed_mul_q30(depth_q28 * 4, dip.x[i]);
    for (int j = 0; j < ROWS; j++, node++) {
      node->d = readings->residual[node - c->node] == 0 ? fixed_mul_q30(along, dip.y[j]) : 0;
    }
  }
}

/* The columns of one sensor as they are after the elimination; none where it is not used. */
struct column {
  int32_t e, p1, p2, p3;
};
FIXED_INLINE void orthogonal_columns(const struct columns *c, const struct node *node, struct column *column) {
  column->e = node->mantissa >> node->shift;
  column->p1 = node->p1;
  column->p2 = node->p2 - times_q12(node->p1, c->f21);
  column->p3 = node->p3 - times_q12(node->p1, c->f31) - times_q12(column->p2, c->f32);
}

/* What the result needs besides the equations. */
static NOINLINE void finish(const struct columns *c, int32_t finer, struct fit_equations *equations) {
  int32_t b0 = 0, squares = 0;
  for (int k = 0; k < NODES; k++) {
    int32_t r = shifted(c->node[k].e, finer);
    b0 += c->dip ? fixed_mul_16(r, model_q15(&c->node[k])) : fixed_mul_16(r, c->node[k].mantissa) >> c->node[k].shift;
    r >>= SUM_BITS - 15;
    squares += (r * r) >> NORM_SHIFT;
  }
  equations->b0 = b0;
  equations->residual_shift = 11 - finer;
  equations->square_sum = (struct scaled){squares, NORM_SHIFT - 2 * (28 + finer - (SUM_BITS - 15))};
  equations->mass_q20 = c->mass >> (10 - MASS_SHIFT);
  int32_t off_x = equations->at.x - c->mean_x * LINEAR_TO_Q26;
  int32_t off_y = equations->at.y - c->mean_y * LINEAR_TO_Q26;
  int32_t bend = fixed_mul_q28(off_x, off_x) + fixed_mul_q28(off_y, off_y);
  bend -= fixed_mul_q28(off_x, c->skew_x * LINEAR_TO_Q26) + fixed_mul_q28(off_y, c->skew_y * LINEAR_TO_Q26);
  bend -= (c->variance + c->lift3) >> (LINEAR_Q - 24);
  equations->p3_centre_q24 = fixed_clamp(bend, -(1 << 29), 1 << 29);
}

/* Adds that of the dip to the error of each reading. */
static NOINLINE void add_dip_errors(const struct columns *c, struct readings *work, struct fit_propagation *propagation) {
  uint32_t gains = 0;
  for (int k = 0; k < NODES; k++) {
    int32_t error = (c->node[k].d >> 15) * FIT_DIP_ERROR_Q16 >> 8;
    error = work->q14[k] + ((error << (propagation->gain_shift + 1)) >> 8);
    error = error < INT16_MAX ? error : INT16_MAX;
    work->q14[k] = error;
    gains += (uint32_t)(error * error) >> PROPAGATION_SQUARE_SHIFT;
  }
  propagation->gains = gains;
}

/* What errors of single sensors make of the result. The columns are made orthogonal for it. */
static NOINLINE void spread_errors(const struct fit_grid_shape *grid, const struct fit_settings *settings, struct columns *c,
                                   const struct fit_equations *equations, struct readings *work, struct fit_propagation *propagation) {
  const struct fit_columns_q q = {c->q1, c->q2, c->q3};
  fit_grid_begin_propagation(work->shift, equations, &q, propagation);
  const int32_t most = 3 << 14;
  for (int k = 0; k < NODES; k++) {
    struct node *node = &c->node[k];
    struct column column;
    orthogonal_columns(c, node, &column);
    node->e = work->q28[k] = column.e;
    node->p2 = fixed_clamp(column.p2, -most, most);
    node->p3 = fixed_clamp(column.p3, -most, most);
  }
  fit_grid_set_errors(grid, settings, &equations->at, work, propagation);
  if (c->dip) {
    add_dip_errors(c, work, propagation);
  }
  const struct node *node = c->node;
  for (int k = 0; k < NODES; k++) {
    work->q28[k] = (propagation->x1 * node[k].p1 + propagation->x2 * node[k].p2 + propagation->x3 * node[k].p3) >> 15;
  }
  fit_grid_add_influence(work, &propagation->by_gains, &propagation->shape_x);
  for (int k = 0; k < NODES; k++) {
    work->q28[k] = (propagation->y2 * node[k].p2 + propagation->y3 * node[k].p3) >> 15;
  }
  fit_grid_add_influence(work, &propagation->by_gains, &propagation->shape_y);
  for (int k = 0; k < NODES; k++) {
    work->q28[k] =
        (propagation->f0 * node[k].e + propagation->f1 * node[k].p1 + propagation->f2 * node[k].p2 + propagation->f3 * node[k].p3) >> 15;
  }
  fit_grid_add_influence(work, &propagation->force_by_gains, &propagation->shape_force);
  fit_grid_end_propagation(settings, equations, propagation);
}

enum accuracy { COARSE, FINE, LAST };

static NOINLINE void evaluate(const struct readings *readings, enum accuracy accuracy, struct columns *c, struct fit_equations *equations) {
  equations->rise_q22 = set_model(&equations->at, readings->residual, c);
  set_dip(readings, equations, c);
  fill_columns(readings, &rounding_ridge, c);
  orthogonalise(c);
  equations->amplitude_q28 = fit_grid_amplitude(c->product, c->mass >> (16 + PRODUCT_SHIFT - MASS_SHIFT), accuracy != COARSE);
  int32_t sum1 = 0, sum2 = 0, sum3 = 0;
  struct node *node = c->node;
  if (accuracy == COARSE) {
    /* The columns are orthogonal to the model, so the readings do as well as the residual. */
    UNROLL
    for (int k = 0; k < NODES; k++) {
      int32_t p = readings->q14[k];
      sum1 += (p * node->p1) >> COARSE_SHIFT;
      sum2 += (p * node->p2) >> COARSE_SHIFT;
      sum3 += (p * node->p3) >> COARSE_SHIFT;
      node++;
    }
    eliminate(c, sum1, sum2, sum3, 14 - COARSE_SHIFT, equations);
  } else {
    uint32_t size = 1;
    UNROLL
    for (int k = 0; k < NODES; k++) {
      int32_t model = c->dip ? node->e - node->d : node->e;
      int32_t r = readings->q28[k] - fixed_mul_q30(equations->amplitude_q28, model);
      node->e = r;
      size |= fixed_magnitude(r);
      node++;
    }
    /* As large as the sums allow: truncation hurts small residuals. */
    int32_t finer = SUM_BITS - fixed_bits(size);
    int32_t up = finer > 0 ? finer : 0, down = up - finer;
    node = c->node;
    UNROLL
    for (int k = 0; k < NODES; k++) {
      int32_t r = (node->e * (1 << up)) >> down;
      sum1 += fixed_mul_16(r, node->p1);
      sum2 += fixed_mul_16(r, node->p2);
      sum3 += fixed_mul_16(r, node->p3);
      node++;
    }
    eliminate(c, sum1, sum2, sum3, 12 + finer, equations);
    if (accuracy == LAST) {
      finish(c, finer, equations);
    }
  }
  fit_grid_complete(readings, equations);
}

/* Readings in use, which sensors are not (in their residual's place), and how many are. False: nothing to fit. */
static bool gather(const struct fit_array *array, const int32_t *pressure_Pa_q10, sensor_map usable, const struct fit_settings *settings,
                   struct readings *readings, int *count) {
  *count = 0;
  for (int k = 0; k < NODES; k++) {
    bool used = usable >> array->grid.sensor[k] & 1;
    readings->residual[k] = used ? 0 : UNUSED;
    *count += used;
  }
  return fit_grid_take_readings(array, pressure_Pa_q10, usable, settings, readings);
}

bool fit_grid_masked(const struct fit_array *array, const int32_t *pressure_Pa_q10, sensor_map usable, const struct fit_settings *settings,
                     struct fit_result *result) {
  const struct fit_grid_shape *grid = &array->grid;
  fit_use_rectangle(grid);
  struct readings readings;
  int count;
  memset(result, 0, sizeof *result);
  usable &= first_sensors((unsigned)NODES);
  bool positive = gather(array, pressure_Pa_q10, usable, settings, &readings, &count);
  if (count < NODES) {
    result->flags = CONTACT_FLAG_SENSOR_MASKED;
  }
  if (!positive) {
    result->flags |= CONTACT_FLAG_LOW_SIGNAL;
    return false;
  }
  if (count < 4) {
    return false;
  }
  struct columns columns;
  struct fit_equations equations;
  struct state state;
  guess(grid, &readings, settings, &columns, &equations, &state);
  if (readings.dip_share.mantissa != 0) {
    fit_grid_restore_negative(array, pressure_Pa_q10, usable, &readings);
  }
  int left = settings->iterations;
  do {
    bool coarse = left > FINE_ITERATIONS && settings->iterations - left < COARSE_ITERATIONS;
    if (fit_has_deviations(settings) && left == FIT_DEVIATION_ITERATIONS) {
      const int32_t peak_q28 = fit_grid_peak(equations.amplitude_q28, equations.rise_q22, ONE, FIT_DEVIATION_PEAK_MAX_Q28);
      fit_grid_remove_deviations(array, settings, usable, &state, peak_q28, &readings);
    }
    equations.at = state;
    evaluate(&readings, left <= 1 ? LAST : coarse ? COARSE : FINE, &columns, &equations);
    fit_grid_step(grid, &equations, &state);
    if (left == 0) { /* the guess is asked for: the step only shows how good it is */
      state = equations.at;
    }
    left--;
  } while (left > 0);
  result->used = usable;
  struct fit_propagation propagation;
  spread_errors(grid, settings, &columns, &equations, &readings, &propagation);
  return fit_grid_conclude(grid, &readings, settings, &equations, &propagation, &state, count, result);
}

/* Q26, towards zero; within what fits. */
static int32_t q26_of(float value) {
  return value >= 16.0f ? INT32_C(1) << 30 : value <= -16.0f ? -(INT32_C(1) << 30) : (int32_t)(value * 67108864.0f);
}

/* value^2 of the sum of squares, Q15. */
static int32_t share_of(int32_t value, int32_t sum, int32_t sum_shift) {
  value = fixed_clamp(value, -46340, 46340);
  return port_divide((value * value) >> sum_shift, (sum >> 15) + 1);
}

int fit_grid_outlier(const struct fit_array *array, const int32_t *pressure_Pa_q10, sensor_map usable, const struct fit_settings *settings,
                     const struct fit_result *result) {
  const struct fit_grid_shape *grid = &array->grid;
  fit_use_rectangle(grid);
  struct readings readings;
  int count;
  if (!gather(array, pressure_Pa_q10, usable, settings, &readings, &count) || count < 6) {
    return -1;
  }
  float per_pitch = 1.0f / array->pitch_mm, sigma = result->sigma_mm * per_pitch;
  uint8_t origin = grid->sensor[ORIGIN_X * ROWS + ORIGIN_Y];
  struct fit_equations equations;
  equations.at.x = q26_of(result->x_mm * per_pitch - array->x[origin]);
  equations.at.y = q26_of(result->y_mm * per_pitch - array->y[origin]);
  equations.at.curvature = fixed_clamp(q26_of(0.72134752f / (sigma * sigma)), CURVATURE_MIN_Q26, CURVATURE_MAX_Q26);
  struct columns c;
  c.cross = c.skew_x = c.skew_y = 0;
  if (readings.dip_share.mantissa != 0) {
    fit_grid_restore_negative(array, pressure_Pa_q10, usable, &readings);
  }
  if (settings->deviations) {
    const int32_t peak_q28 =
        fit_scaled_to_fixed(scaled_mul(fit_grid_scaled(result->p0_Pa), fit_scaled_from(1024, readings.shift - 28)), 28);
    fit_grid_remove_deviations(array, settings, usable, &equations.at, fixed_clamp(peak_q28, 0, FIT_DEVIATION_PEAK_MAX_Q28), &readings);
  }
  evaluate(&readings, FINE, &c, &equations);

  uint32_t size = 1;
  for (int k = 0; k < NODES; k++) {
    size |= fixed_magnitude(c.node[k].e);
  }
  int32_t finer = 15 - fixed_bits(size);
  int32_t total = 0, worst = 0, second = 0;
  int outlier = -1;
  for (int k = 0; k < NODES; k++) {
    const struct node *node = &c.node[k];
    int32_t r = shifted(node->e, finer);
    struct column column;
    orthogonal_columns(&c, node, &column);
    int32_t leverage = share_of(column.e, c.mass, MASS_SHIFT) + share_of(column.p1, c.norm1, NORM_SHIFT) +
                       share_of(column.p2, c.norm2, NORM_SHIFT) + share_of(column.p3, c.norm3, NORM_SHIFT);
    int32_t free = 32768 - leverage;
    int32_t without = port_divide(r * r, free < 512 ? 512 : free);
    total += (r * r) >> 15;
    if (without > worst && readings.residual[k] == 0) {
      second = worst;
      worst = without;
      outlier = grid->sensor[k];
    } else if (without > second) {
      second = without;
    }
  }
  int32_t others = total > worst ? total - worst : 0;
  bool alone = second < worst >> 1;
  return alone && others * (FIT_OUTLIER * FIT_OUTLIER) < worst * (count - 5) ? outlier : -1;
}
