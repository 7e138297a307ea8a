#include "common/contact_flags.h"
#include "fit/fit.h"
#include "fit/fit_fixed.h"
#include "fit/fit_grid_parts.h"
#include "fit/fit_limits.h"

#include <stdbool.h>
#include <string.h>

#define TWO_OVER_LOG2E ((struct scaled){22713, -14})

#define AMPLITUDE_MIN_Q28 13421773        /* 0.05 */
#define AMPLITUDE_MAX_Q28 ((1 << 30) - 1) /* 4 */
#define STEP_LIMIT_Q22 (1 << 21)          /* half a pitch */
#define RATIO_LIMIT_Q28 (1 << 27)         /* sigma changes by half at most */

/* The first iterations only have to come near: they project the readings themselves, since the
 * basis is orthogonal to the model. Their rounding would let them wander along the valleys of badly
 * conditioned presses, so they are few, and the others work on the residual. */
#define COARSE_ITERATIONS 3

/* Guess alone: readings below a share of the largest carry more noise than shape into a logarithm;
 * a ridge towards sigma 0.556 pitch decides where too few are large. */
#define GUESS_SHARE_Q14 819                              /* 5 % of the largest marginal */
#define GUESS_RIDGE ((struct scaled){20972, -21})        /* 0.01 */
#define GUESS_RIDGE_HEIGHT ((struct scaled){24507, -20}) /* 0.01 * 2.337 */
#define GUESS_HEIGHT_MIN_Q26 1936353
#define GUESS_HEIGHT_MAX_Q26 484088133 /* sigma 0.316 pitch */

#define MODEL_INVERSE_SQUARE ((struct scaled){22756, -9}) /* 1 / 0.15^2 */
#define FLAT_HEIGHT_Q26 2016200                           /* sigma 4.9 pitches */
#define PEAK_RISE_MAX_Q22 (20 << 22)                      /* a factor of a million */

/* What one evaluation of the model leaves: the normal equations in the orthogonal basis
 *   e, e p1(x), e q1(y), e (p2(x) + q2(y))
 * which spans what the derivatives of the model span. Their matrix is diagonal. */
struct moments {
  struct axis x, y;
  int32_t amplitude_q28;
  int32_t residual_shift, residual_squares; /* sum r^2 = residual_squares * 2^(-23 - 2 shift) */
  struct scaled b0, b1, b2, b3; /* right-hand side; b0 is what the amplitude's rounding left */
  struct scaled d1, d2, d3;     /* the matrix */
  struct scaled stiffness;      /* amplitude / sigma^2 */
  int32_t move_x_q22, move_y_q22, ratio_q28; /* the step taken */
};

/* Monic polynomials of degree 1 and 2 in the node number, orthogonal under g^2 to each other and to
 * 1. Their values come from additions, so they stay accurate where they nearly vanish. */
FIXED_INLINE void orthogonalise(struct axis *axis, int nodes, int origin) {
  int32_t mass = 0, first = 0, second = 0;
  for (int i = 0; i < nodes; i++) {
    int32_t k = i - origin;
    int32_t weight = fixed_mul_q32(axis->g[i], axis->g[i]) >> 2; /* Q26 */
    mass += weight;
    first += k * weight;
    second += k * k * weight;
  }
  axis->mass_q26 = mass;
  axis->mean = fixed_div_q26(first, mass);
  int32_t mean_square = fixed_div_q26(second, mass);

  int32_t values[MAX_NODES];
  for (int i = 0; i < nodes; i++) {
    values[i] = fixed_mul_q32(axis->g[i], ((i - origin) * ONE_Q26 - axis->mean) * 4);
  }
  axis->linear_q = 26 + block_normalise(values, axis->linear, nodes);
  int32_t norm = 0, moment = 0;
  for (int i = 0; i < nodes; i++) {
    int32_t square = (axis->linear[i] * axis->linear[i]) >> 2;
    norm += square;
    moment += (i - origin) * square;
  }
  axis->linear_norm = norm;
  int32_t skew = norm < 1 << 13 ? axis->mean : fixed_div_q26(moment, norm);

  axis->slope = skew + axis->mean;
  axis->constant = fixed_mul_q26(axis->slope, axis->mean) - mean_square;
  for (int i = 0; i < nodes; i++) {
    int32_t k = i - origin;
    values[i] = fixed_mul_q28(axis->g[i], k * k * ONE_Q26 - k * axis->slope + axis->constant);
  }
  axis->square_q = 28 + block_normalise(values, axis->square, nodes);
  norm = 0;
  for (int i = 0; i < nodes; i++) {
    norm += (axis->square[i] * axis->square[i]) >> 2;
  }
  axis->square_norm = norm;
}

/* The prior (sigma - prior) / width is one more row of the least squares; c3 is the only unknown
 * that changes sigma, by sigma * gain. */
FIXED_INLINE struct scaled prior_row(const struct readings *readings, const struct state *state,
                                     const struct moments *m, struct scaled *pull) {
  struct scaled sigma = scaled_sqrt(scaled_div(LOG2E_HALF, scaled_from(state->height, -26)));
  *pull = scaled_mul(scaled_sub(readings->prior_sigma, sigma), readings->prior_weight);
  return scaled_div(scaled_mul(sigma, readings->prior_weight), m->stiffness);
}

/* The step in the parameters: with c = b / d / stiffness,
 *   dsigma / sigma = c3,  dx = c1 - (slope - 2 x) c3,  dy likewise. */
static NOINLINE void take_step(const struct fit_grid_shape *grid, struct state *state,
                               struct moments *m) {
  int32_t c1 = scaled_ratio(m->b1, scaled_mul(m->d1, m->stiffness), 26);
  int32_t c2 = scaled_ratio(m->b2, scaled_mul(m->d2, m->stiffness), 26);
  int32_t ratio = scaled_ratio(m->b3, scaled_mul(m->d3, m->stiffness), 28);
  int32_t dx = (c1 >> 4) - fixed_mul_q32(m->x.slope - 2 * state->x, ratio);
  int32_t dy = (c2 >> 4) - fixed_mul_q32(m->y.slope - 2 * state->y, ratio);
  dx = fixed_clamp(dx, -STEP_LIMIT_Q22, STEP_LIMIT_Q22);
  dy = fixed_clamp(dy, -STEP_LIMIT_Q22, STEP_LIMIT_Q22);
  ratio = fixed_clamp(ratio, -RATIO_LIMIT_Q28, RATIO_LIMIT_Q28);
  m->move_x_q22 = dx;
  m->move_y_q22 = dy;
  m->ratio_q28 = ratio;
  state->x = fixed_clamp(state->x + dx * 16, grid->x_min, grid->x_max);
  state->y = fixed_clamp(state->y + dy * 16, grid->y_min, grid->y_max);

  /* height *= (1 - f)^2 with f = ratio / (1 + ratio), which goes to zero smoothly. */
  int32_t divisor = ((1 << 28) + ratio) >> 13;
  int32_t quotient = port_divide(ratio, divisor);
  int32_t rest = (ratio - quotient * divisor) * (1 << 15);
  int32_t shrink = (1 << 28) - (quotient * (1 << 15) + port_divide(rest, divisor));
  int32_t height = state->height;
  if (height < 1 << 28) {
    height = fixed_mul_q28(fixed_mul_q28(height, shrink), shrink);
  } else {
    height = fixed_mul_q28(fixed_mul_q28(height >> 2, shrink), shrink);
    height = height > HEIGHT_MAX_Q26 >> 2 ? HEIGHT_MAX_Q26 : height * 4;
  }
  state->height = fixed_clamp(height, HEIGHT_MIN_Q26, HEIGHT_MAX_Q26);
}

/* numerator (Q26) over the product of the axes' masses, Q28. */
FIXED_INLINE int32_t best_amplitude(int32_t numerator_q26, const struct moments *m, bool fine) {
  int32_t denominator_q14 = fixed_mul_q32(m->x.mass_q26, m->y.mass_q26) >> 6;
  if (denominator_q14 < 1) {
    denominator_q14 = 1;
  }
  int32_t quotient_q12 = port_divide(numerator_q26, denominator_q14);
  if (quotient_q12 >= AMPLITUDE_MAX_Q28 >> 16) {
    return AMPLITUDE_MAX_Q28;
  }
  if (quotient_q12 < AMPLITUDE_MIN_Q28 >> 16) {
    return AMPLITUDE_MIN_Q28;
  }
  int32_t amplitude = quotient_q12 * (1 << 16);
  if (fine) {
    int32_t rest = numerator_q26 - quotient_q12 * denominator_q14;
    amplitude += port_divide(rest * (1 << 12), denominator_q14) * (1 << 4);
  }
  return amplitude;
}

/* The readings themselves against the basis. p_q14: [column][row]. */
FIXED_INLINE void project_readings(struct moments *m, const int32_t *p_q14) {
  int32_t total = 0, b1 = 0, b2 = 0, b3x = 0, b3y = 0;
  for (int i = 0; i < COLUMNS; i++) {
    int32_t sum = 0, linear = 0, square = 0;
    for (int j = 0; j < ROWS; j++) {
      int32_t p = p_q14[i * ROWS + j];
      sum += p * (m->y.g[j] >> 16);
      linear += p * (m->y.linear[j] >> 1);
      square += p * (m->y.square[j] >> 1);
    }
    int32_t g = m->x.g[i] >> 16;
    total += fixed_mul_16(sum, g);
    b1 += fixed_mul_16(sum, m->x.linear[i]);
    b3x += fixed_mul_16(sum, m->x.square[i]);
    b2 += fixed_mul_16(linear, g);
    b3y += fixed_mul_16(square, g);
  }
  m->amplitude_q28 = best_amplitude(total, m, false);
  m->b1 = scaled_from(b1, -12 - m->x.linear_q);
  m->b2 = scaled_from(b2, -11 - m->y.linear_q);
  m->b3 = scaled_add(scaled_from(b3x, -12 - m->x.square_q), scaled_from(b3y, -11 - m->y.square_q));
}

/* The residual against the basis. p_q28: [column][row]. */
FIXED_INLINE void project_residual(struct moments *m, const int32_t *p_q28) {
  int32_t total = 0;
  for (int i = 0; i < COLUMNS; i++) {
    int32_t sum = 0;
    for (int j = 0; j < ROWS; j++) {
      sum += (p_q28[i * ROWS + j] >> 14) * (m->y.g[j] >> 16);
    }
    total += fixed_mul_16(sum, m->x.g[i] >> 16);
  }
  m->amplitude_q28 = best_amplitude(total, m, true);

  int32_t residual[NODES];
  uint32_t size = 1;
  for (int i = 0; i < COLUMNS; i++) {
    int32_t column = fixed_mul_q30(m->amplitude_q28, m->x.g[i]);
    for (int j = 0; j < ROWS; j++) {
      int32_t r = p_q28[i * ROWS + j] - fixed_mul_q30(column, m->y.g[j]);
      residual[i * ROWS + j] = r;
      size |= fixed_size(r);
    }
  }
  /* As large as the sums below allow: truncation hurts small residuals. */
  int32_t shift = (NODES <= 18 ? 29 : 28) - fixed_bits(size);
  int32_t down = shift < 0 ? -shift : 0;
  int32_t up = shift < 0 ? 1 : 1 << shift;
  m->residual_shift = shift;

  int32_t b0 = 0, b1 = 0, b2 = 0, b3x = 0, b3y = 0, squares = 0;
  for (int i = 0; i < COLUMNS; i++) {
    int32_t sum = 0, linear = 0, square = 0;
    for (int j = 0; j < ROWS; j++) {
      int32_t r = (residual[i * ROWS + j] >> down) * up;
      sum += fixed_mul_16(r, m->y.g[j] >> 16);
      linear += fixed_mul_16(r, m->y.linear[j]);
      square += fixed_mul_16(r, m->y.square[j]);
      squares += ((r >> 16) * (r >> 16)) >> 1;
    }
    int32_t g = m->x.g[i] >> 16;
    b0 += fixed_mul_16(sum, g);
    b1 += fixed_mul_16(sum, m->x.linear[i]);
    b3x += fixed_mul_16(sum, m->x.square[i]);
    b2 += fixed_mul_16(linear, g);
    b3y += fixed_mul_16(square, g);
  }
  m->residual_squares = squares;
  int32_t q = -10 - shift;
  m->b0 = scaled_from(b0, q - 14);
  m->b1 = scaled_from(b1, q - m->x.linear_q);
  m->b2 = scaled_from(b2, q - m->y.linear_q);
  m->b3 = scaled_add(scaled_from(b3x, q - m->x.square_q), scaled_from(b3y, q - m->y.square_q));
}

/* norm * 2^(2 - 2 q) times mass, both positive and below 2^31. */
FIXED_INLINE struct scaled norm_product(int32_t norm, int32_t q, int32_t mass_q26) {
  return scaled_from((norm >> 15) * (mass_q26 >> 14), 5 - 2 * q);
}

static NOINLINE void orthogonalise_axes(struct moments *m) {
  orthogonalise(&m->x, COLUMNS, COLUMNS / 2);
  orthogonalise(&m->y, ROWS, ROWS / 2);
}

FIXED_INLINE void evaluate(const struct state *state, const struct readings *readings,
                           struct moments *m, bool fine) {
  gaussian(&m->x, COLUMNS, COLUMNS / 2, state->x, state->height);
  gaussian(&m->y, ROWS, ROWS / 2, state->y, state->height);
  orthogonalise_axes(m);
  if (fine) {
    project_residual(m, readings->q28);
  } else {
    project_readings(m, readings->q14);
  }
  m->d1 = norm_product(m->x.linear_norm, m->x.linear_q, m->y.mass_q26);
  m->d2 = norm_product(m->y.linear_norm, m->y.linear_q, m->x.mass_q26);
  m->d3 = scaled_add(norm_product(m->x.square_norm, m->x.square_q, m->y.mass_q26),
                     norm_product(m->y.square_norm, m->y.square_q, m->x.mass_q26));
  m->stiffness = scaled_mul(scaled_mul(scaled_from(state->height, -26), TWO_OVER_LOG2E),
                            scaled_from(m->amplitude_q28, -28));
  if (readings->prior_weight.mantissa != 0) {
    struct scaled pull;
    struct scaled row = prior_row(readings, state, m, &pull);
    m->d3 = scaled_add(m->d3, scaled_mul(row, row));
    m->b3 = scaled_add(m->b3, scaled_mul(row, pull));
  }
}

/* First guess, every sensor there: the marginals weighted by the row and the column of the largest
 * reading are the two factors of the Gaussian, and the logarithm of each a parabola. */
FIXED_INLINE void guess_axis(struct axis *axis, const int32_t *marginal, int nodes, int origin,
                             struct scaled *linear, struct scaled *square) {
  int32_t largest = 1;
  for (int i = 0; i < nodes; i++) {
    largest = marginal[i] > largest ? marginal[i] : largest;
  }
  int32_t shift = fixed_bits((uint32_t)largest) - 16;
  int32_t unit = shift >= 0 ? largest >> shift : largest * (1 << -shift);
  int32_t weighted[MAX_NODES];
  for (int i = 0; i < nodes; i++) {
    int32_t value = marginal[i] < 0 ? 0 : marginal[i];
    value = shift >= 0 ? value >> shift : value * (1 << -shift);
    int32_t ratio = port_divide(value * (1 << 14), unit); /* Q14, at most 1 */
    if (ratio < GUESS_SHARE_Q14) {
      axis->g[i] = 0;
      weighted[i] = 0;
    } else {
      axis->g[i] = ratio * (1 << 16);
      weighted[i] = (ratio * log2_q15(ratio)) >> 14;
    }
  }
  orthogonalise(axis, nodes, origin);
  int32_t b1 = 0, b2 = 0;
  for (int i = 0; i < nodes; i++) {
    b1 += axis->linear[i] * weighted[i];
    b2 += axis->square[i] * weighted[i];
  }
  *linear = scaled_from(b1, -15 - axis->linear_q);
  *square = scaled_from(b2, -15 - axis->square_q);
}

/* From the parabola's coefficients: height = -c3, centre = slope / 2 + c1 / (2 height). */
FIXED_INLINE void set_guess(const struct fit_grid_shape *grid, const struct moments *m,
                            struct scaled c1, struct scaled c2, struct scaled height,
                            struct state *state) {
  state->height =
      fixed_clamp(scaled_to_fixed(height, 26), GUESS_HEIGHT_MIN_Q26, GUESS_HEIGHT_MAX_Q26);
  struct scaled half = scaled_div(scaled_from(1, -1), scaled_from(state->height, -26));
  int32_t x = (m->x.slope >> 1) + scaled_to_fixed(scaled_mul(c1, half), 26);
  int32_t y = (m->y.slope >> 1) + scaled_to_fixed(scaled_mul(c2, half), 26);
  state->x = fixed_clamp(x, grid->x_min + ONE_Q26 / 2, grid->x_max - ONE_Q26 / 2);
  state->y = fixed_clamp(y, grid->y_min + ONE_Q26 / 2, grid->y_max - ONE_Q26 / 2);
}

static void guess(const struct fit_grid_shape *grid, const struct readings *readings,
                  struct moments *m, struct state *state) {
  const int32_t *p = readings->q14;
  int peak_column = 0, peak_row = 0;
  for (int i = 0; i < COLUMNS; i++) {
    for (int j = 0; j < ROWS; j++) {
      if (p[i * ROWS + j] > p[peak_column * ROWS + peak_row]) {
        peak_column = i;
        peak_row = j;
      }
    }
  }
  int32_t across[MAX_NODES] = {0}, along[MAX_NODES] = {0};
  for (int i = 0; i < COLUMNS; i++) {
    for (int j = 0; j < ROWS; j++) {
      across[i] += p[i * ROWS + j] * p[peak_column * ROWS + j];
      along[j] += p[i * ROWS + j] * p[i * ROWS + peak_row];
    }
  }
  struct scaled b1, b2, b3x, b3y;
  guess_axis(&m->x, across, COLUMNS, COLUMNS / 2, &b1, &b3x);
  guess_axis(&m->y, along, ROWS, ROWS / 2, &b2, &b3y);
  struct scaled norm = scaled_add(scaled_from(m->x.square_norm, 2 - 2 * m->x.square_q),
                                  scaled_from(m->y.square_norm, 2 - 2 * m->y.square_q));
  struct scaled c1 =
      scaled_div(b1, scaled_add(scaled_from(m->x.linear_norm, 2 - 2 * m->x.linear_q), GUESS_RIDGE));
  struct scaled c2 =
      scaled_div(b2, scaled_add(scaled_from(m->y.linear_norm, 2 - 2 * m->y.linear_q), GUESS_RIDGE));
  struct scaled height = scaled_div(scaled_sub(GUESS_RIDGE_HEIGHT, scaled_add(b3x, b3y)),
                                    scaled_add(norm, GUESS_RIDGE));
  set_guess(grid, m, c1, c2, height, state);
}

/* p2(x) + q2(y) at the centre, Q25: how a change along the third basis function lifts the peak. */
FIXED_INLINE int32_t bend_q25(const struct state *before, const struct moments *m) {
  int32_t x = fixed_mul_q26(before->x, before->x - m->x.slope) + m->x.constant;
  int32_t y = fixed_mul_q26(before->y, before->y - m->y.slope) + m->y.constant;
  return (x >> 1) + (y >> 1);
}

/* Sum of e^2. */
FIXED_INLINE struct scaled mass_of(const struct moments *m) {
  return scaled_from((m->x.mass_q26 >> 14) * (m->y.mass_q26 >> 14), -24);
}

/* v^T (matrix)^-1 v, v in the basis. */
FIXED_INLINE struct scaled inverse_form(const struct moments *m, struct scaled v1, struct scaled v2,
                                        struct scaled v3) {
  struct scaled sum = scaled_div(scaled_mul(v1, v1), m->d1);
  sum = scaled_add(sum, scaled_div(scaled_mul(v2, v2), m->d2));
  return scaled_add(sum, scaled_div(scaled_mul(v3, v3), m->d3));
}

/* Peak at the centre after the step: 30-bit mantissa and exponent, Pa. */
FIXED_INLINE int32_t peak_of(const struct readings *readings, const struct state *before,
                             const struct moments *m, int32_t *exponent) {
  /* The amplitude belongs to the nearest node; the centre is higher by 2^(height offset^2). */
  int32_t squares =
      fixed_mul_q26(m->x.offset, m->x.offset) + fixed_mul_q26(m->y.offset, m->y.offset);
  int32_t rise_q22 = fixed_mul_q32(before->height, fixed_clamp(squares, 0, (1 << 28) - 1) * 4);
  rise_q22 = fixed_clamp(rise_q22, 0, PEAK_RISE_MAX_Q22);
  int32_t up = 30 - fixed_bits((uint32_t)m->amplitude_q28);
  int32_t peak =
      fixed_mul_q30(m->amplitude_q28 * (1 << up), exp2_negative((1 << 22) - (rise_q22 & 0x3FFFFF)));
  *exponent = (rise_q22 >> 22) + 1 - up - 10 - readings->shift;

  /* The last step's own part: c1 and c2 tilt the model about its mean, c3 bends it. */
  struct scaled tilt =
      scaled_add(scaled_div(scaled_mul(m->b1, scaled_from(m->x.mean - before->x, -26)), m->d1),
                 scaled_div(scaled_mul(m->b2, scaled_from(m->y.mean - before->y, -26)), m->d2));
  struct scaled change =
      scaled_sub(scaled_div(scaled_mul(m->b3, scaled_from(bend_q25(before, m), -25)), m->d3), tilt);
  change = scaled_add(change, scaled_div(m->b0, mass_of(m)));
  change = scaled_div(change, scaled_from(m->amplitude_q28, -28));
  int32_t growth = fixed_clamp(scaled_to_fixed(change, 28), -(1 << 27), 1 << 27);
  peak = fixed_mul_q28(peak, (1 << 28) + growth);
  while (peak >= 1 << 30) {
    peak >>= 1;
    *exponent += 1;
  }
  return peak;
}

static NOINLINE void conclude(const struct fit_grid_shape *grid, const struct readings *readings,
                              const struct fit_settings *settings, const struct state *before,
                              const struct state *state, const struct moments *m,
                              struct fit_result *result) {
  int32_t peak_exponent;
  int32_t peak = peak_of(readings, before, m, &peak_exponent);
  int32_t sigma = fit_grid_sigma(state->height);
  int32_t up = 30 - fixed_bits((uint32_t)sigma);
  int32_t sigma_square = fixed_mul_q30(sigma * (1 << up), sigma * (1 << up));
  int32_t force = fixed_mul_q30(fixed_mul_q30(peak, sigma_square), grid->force_scale);
  result->x_mm =
      fit_grid_compose(fixed_mul_q32(state->x, grid->pitch) + grid->x_origin, grid->pitch_exponent);
  result->y_mm =
      fit_grid_compose(fixed_mul_q32(state->y, grid->pitch) + grid->y_origin, grid->pitch_exponent);
  result->sigma_mm = fit_grid_compose(fixed_mul_q32(sigma, grid->pitch), grid->pitch_exponent);
  result->p0_Pa = fit_grid_compose(peak, peak_exponent);
  result->force_N = fit_grid_compose(force, peak_exponent + 38 - 2 * up + grid->force_exponent);

  /* Standard deviation of one reading: the residuals', at least the noise. In units of Q28. */
  struct scaled square_sum = scaled_from(m->residual_squares, -23 - 2 * m->residual_shift);
  square_sum = scaled_sub(square_sum, scaled_div(scaled_mul(m->b0, m->b0), mass_of(m)));
  square_sum.mantissa = square_sum.mantissa < 0 ? 0 : square_sum.mantissa;
  const int32_t freedom = NODES > 4 ? NODES - 4 : 1;
  struct scaled noise = scaled_from(settings->noise_Pa_q10, readings->shift - 28);
  struct scaled variance = scaled_div(square_sum, scaled_from(freedom, 0));
  struct scaled noise_variance = scaled_mul(noise, noise);
  if (scaled_sub(variance, noise_variance).mantissa < 0) {
    variance = noise_variance;
  }
  struct scaled rms = scaled_sqrt(scaled_div(square_sum, scaled_from(NODES, 0)));
  result->residual_rms_Pa = fit_grid_compose(rms.mantissa, rms.exponent + 18 - readings->shift);

  const struct scaled zero = {0, 0}, one = {1 << 14, -14};
  struct scaled slope_x = scaled_from(2 * before->x - m->x.slope, -26);
  struct scaled slope_y = scaled_from(2 * before->y - m->y.slope, -26);
  struct scaled location =
      scaled_add(inverse_form(m, one, zero, slope_x), inverse_form(m, zero, one, slope_y));
  struct scaled location_sd = scaled_div(scaled_sqrt(scaled_mul(variance, location)), m->stiffness);
  location_sd = scaled_mul(location_sd, scaled_from(grid->pitch, grid->pitch_exponent - 6));
  result->location_sd_mm = fit_grid_compose(location_sd.mantissa, location_sd.exponent);

  /* dF / F = dp0 / p0 + 2 dsigma / sigma, each by its part in the basis; the mean of the model adds
   * one over its mass. */
  struct scaled minus_x = scaled_from(before->x - m->x.mean, -26);
  struct scaled minus_y = scaled_from(before->y - m->y.mean, -26);
  int32_t lift_q24 = (bend_q25(before, m) >> 1) + (fixed_mul_q26(sigma, sigma) >> 1);
  struct scaled form = inverse_form(m, minus_x, minus_y, scaled_from(lift_q24, -24));
  form = scaled_add(form, scaled_div(one, mass_of(m)));
  struct scaled force_sd =
      scaled_div(scaled_sqrt(scaled_mul(variance, form)), scaled_from(m->amplitude_q28, -28));
  struct scaled force_rough =
      scaled_from(force, peak_exponent + 38 - 2 * up + grid->force_exponent);
  force_sd = scaled_mul(force_sd, force_rough);
  result->force_sd_N = fit_grid_compose(force_sd.mantissa, force_sd.exponent);

  uint32_t flags = CONTACT_FLAG_FIT_VALID | CONTACT_FLAG_UNCERTAINTY_VALID;
  if (settings->noise_Pa_q10 > readings->largest / FIT_LOW_SIGNAL_SIGMA) {
    flags |= CONTACT_FLAG_LOW_SIGNAL;
  }
  if (state->height <= FLAT_HEIGHT_Q26) {
    flags |= CONTACT_FLAG_FLAT;
  }
  int32_t move_x = fixed_clamp(m->move_x_q22, -(1 << 15), 1 << 15);
  int32_t move_y = fixed_clamp(m->move_y_q22, -(1 << 15), 1 << 15);
  if (((move_x * move_x) >> 1) + ((move_y * move_y) >> 1) > grid->settled_square ||
      result->location_sd_mm > FIT_UNCERTAIN_SD_mm) {
    flags |= CONTACT_FLAG_UNCERTAIN;
  }
  struct scaled amplitude = scaled_from(m->amplitude_q28, -28);
  struct scaled explained = scaled_mul(scaled_mul(amplitude, amplitude), mass_of(m));
  struct scaled unexplained = scaled_mul(square_sum, MODEL_INVERSE_SQUARE);
  if (scaled_sub(unexplained, scaled_add(explained, square_sum)).mantissa > 0) {
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

static NOINLINE void evaluate_coarse(const struct state *state, const struct readings *readings,
                                     struct moments *m) {
  evaluate(state, readings, m, false);
}

static NOINLINE void evaluate_fine(const struct state *state, const struct readings *readings,
                                   struct moments *m) {
  evaluate(state, readings, m, true);
}

void fit_grid(const struct fit_array *array, const int32_t *pressure_Pa_q10,
              const struct fit_settings *settings, struct fit_result *result) {
  struct readings readings;
  struct moments m;
  struct state state, before;
  memset(result, 0, sizeof *result);
  if (!fit_grid_take_readings(array, pressure_Pa_q10, settings, &readings)) {
    result->flags = CONTACT_FLAG_LOW_SIGNAL;
    return;
  }
  guess(&array->grid, &readings, &m, &state);
  int left = settings->iterations;
  for (int i = 0; i < COARSE_ITERATIONS && left > COARSE_ITERATIONS; i++) {
    evaluate_coarse(&state, &readings, &m);
    take_step(&array->grid, &state, &m);
    left--;
  }
  do {
    before = state;
    evaluate_fine(&state, &readings, &m);
    if (left > 0) {
      take_step(&array->grid, &state, &m);
    }
    left--;
  } while (left > 0);
  result->used = UINT32_MAX >> (FT_MAX_SENSORS - NODES);
  conclude(&array->grid, &readings, settings, &before, &state, &m, result);
}
