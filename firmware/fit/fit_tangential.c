#include "fit/fit_tangential.h"

#include "common/contact_flags.h"
#include "fit/fit_grid_parts.h"

#include <string.h>

/* The model of a reading, lengths in units of twice the widest normal term's standard deviation,
 * d = (dx, dy) from the contact to the sensor:
 *   m = sum over the normal terms of     (A + E / v^2) share V0 / v exp(-d' d / (2 v))
 *     + sum over the tangential terms of (Bx dx + By dy) moment V0 / V^2 exp(-d' d / (2 V))
 *   E = e1 (dx^2 - dy^2) / 2 + e2 dx dy
 * with v and V the terms' variances and t, or KAPPA t, of the contact's own, and V0 the widest
 * normal term's, so that the forces are 2 pi V0 A and 2 pi V0 B. E is what a contact's longer and
 * shorter axis make of its pressure, to first order. Unknowns in this order: the ones that the
 * others tell least about come last, and what is left of their columns is what the tangential force
 * is told by.
 */
enum { AMPLITUDE, PLACE_X, PLACE_Y, SPREAD, STRETCH, SLANT, PULL_X, PULL_Y, UNKNOWNS };

#define KAPPA_Q14                                                                                  \
  21299 /* 1.3: an object that holds pulls more at its rim than it presses there                   \
         */

#define MODEL_SD_Q16 328 /* 0.005 of the largest reading */
/* Prior of both elongations. */
#define ELONGATION_SD_mm2 3.0f

/* Of chi^2, as standard deviations count it. Independent model errors of MODEL_SD are more than
 * layers make of smooth contacts. */
#define MISFIT_SHIFT 4 /* 1 / 16 */
#define MISFIT_LEAST_Q16 6554
#define CHI_SQUARE_MAX 60

#define GAUSSIAN_VARIANCE_Q26 15300821 /* of the Gaussian that fits a point contact: 0.912 V0 */
#define GAUSSIAN_FORCE 1.0753f         /* its 2 pi p0 sigma^2 over the force */

#define SPREAD_LEAST_Q15 9830 /* 0.3 of the narrowest normal term's variance: as much below 0 */
#define SPREAD_MOST_Q26 (ONE_Q26 / 2) /* 2 V0 */
#define LONG_MAX_Q26 (ONE_Q26 / 4 - 1)
#define AMPLITUDE_MAX_Q24 (4 << 24)
#define PULL_MAX_Q24 (4 << 24)

/* Longest step of the place, and of t in the narrowest term's variance. */
#define MOVE_MAX_Q26 (ONE_Q26 * 3 / 8)

#define PIVOT_LEAST (1 << 18) /* 2^-12: what is told less is left where it is */

struct unknowns {
  int32_t amplitude_q24; /* of the unit of readings */
  int32_t x_q26, y_q26;  /* from the grid's origin node */
  int32_t t_q26, e1_q26, e2_q26;
  int32_t pull_x_q24, pull_y_q24;
};

/* What of the readings is kept from step to step. */
struct problem {
  const struct fit_pad *pad;
  struct readings readings;
  int32_t base_q22;    /* standard deviation of a reading of weight 1, of the unit of readings */
  int32_t noise_q22;   /* likewise */
  int32_t long_sd_q26; /* prior of e1 and e2: the amplitude at the beginning is in it */
};

static int32_t q26_from(float value) {
  return (int32_t)(value * 67108864.0f);
}

enum ft_status fit_pad_init(struct fit_pad *pad, const struct fit_array *array,
                            const struct pad_profile *profile) {
  if (array->grid.columns != FIT_GRID_COLUMNS || array->grid.rows != FIT_GRID_ROWS ||
      !pad_profile_is_valid(profile)) {
    return FT_ERR_ARGUMENT;
  }
  float unit_mm = 2.0f * profile->normal[PAD_NORMAL_TERMS - 1].sd_mm;
  float per_unit = 1.0f / unit_mm;
  for (int j = 0; j < FIT_TANGENTIAL_TERMS; j++) {
    bool normal = j < PAD_NORMAL_TERMS;
    float sd_mm =
        normal ? profile->normal[j].sd_mm : profile->tangential[j - PAD_NORMAL_TERMS].sd_mm;
    float strength = normal ? profile->normal[j].share
                            : profile->tangential[j - PAD_NORMAL_TERMS].moment_mm * per_unit;
    float sd = sd_mm * per_unit;
    pad->variance_q26[j] = q26_from(sd * sd);
    pad->strength_q26[j] = q26_from(strength);
  }
  float per_square = per_unit * per_unit;
  pad->unit_mm = unit_mm;
  pad->per_unit = per_unit;
  pad->pitch_q26 = q26_from(array->pitch_mm * per_unit);
  pad->spread_q26 = q26_from(profile->spread_mm2 * per_square);
  pad->spread_sd_q26 = q26_from(profile->spread_sd_mm2 * per_square);
  pad->long_sd_q26 = q26_from(ELONGATION_SD_mm2 * per_square);
  pad->force_unit_N = 1.57079633e-6f * unit_mm * unit_mm; /* 2 pi V0, V0 = 1/4 */
  pad->per_force = fit_grid_scaled(1.0f / (GAUSSIAN_FORCE * pad->force_unit_N));
  return FT_OK;
}

/* (1 / v) / 16 in Q26 for v in Q26, at least 2^-7. */
static int32_t sixteenth_of_inverse(int32_t v_q26) {
  return fixed_div_q26(1 << 22, v_q26);
}

/* Of a contact at the state's place: where the sensors lie, along each axis. */
struct offsets {
  int32_t x_q26[COLUMNS], y_q26[ROWS];
  int32_t xx_q24[COLUMNS], yy_q24[ROWS]; /* squares */
};

static void set_offsets(int32_t pitch_q26, const struct unknowns *at, struct offsets *off) {
  for (int i = 0; i < COLUMNS; i++) {
    off->x_q26[i] = (i - COLUMNS / 2) * pitch_q26 - at->x_q26;
    off->xx_q24[i] = fixed_mul_q28(off->x_q26[i], off->x_q26[i]);
  }
  for (int k = 0; k < ROWS; k++) {
    off->y_q26[k] = (k - ROWS / 2) * pitch_q26 - at->y_q26;
    off->yy_q24[k] = fixed_mul_q28(off->y_q26[k], off->y_q26[k]);
  }
}

/* The factors of one term, strength V0 / v exp(-d' d / (2 v)). */
struct term {
  int32_t x_q28[COLUMNS]; /* with the strength, at most 2 */
  int32_t y_q30[ROWS];
  int32_t inverse_q10; /* 1 / v, at most 16 */
};

#define LEAST_VARIANCE_Q26 (ONE_Q26 / 16)
#define EXPONENT_MAX_Q20 (1 << 29)
#define LONGER_MAX_Q24 ((4 << 24) - 1)

NOINLINE static void set_term(const struct fit_pad *pad, int j, int32_t t_q26,
                              const struct offsets *off, struct term *term) {
  int32_t v = pad->variance_q26[j] + t_q26;
  int32_t inverse = sixteenth_of_inverse(v < LEAST_VARIANCE_Q26 ? LEAST_VARIANCE_Q26 : v);
  int32_t height = fixed_mul_q26(inverse, pad->strength_q26[j]) * 4 /* V0 / v of it */;
  if (j >= PAD_NORMAL_TERMS) {
    height = fixed_mul_q26(height, inverse) * 16; /* moment V0 / v^2 */
  }
  height = fixed_clamp(height, 0, 2 << 26);
  int32_t bend = fixed_mul_q26(inverse, LOG2E_HALF_Q26);
  for (int i = 0; i < COLUMNS; i++) {
    int32_t z_q20 = fixed_clamp(fixed_mul_q26(bend, off->xx_q24[i]), 0, EXPONENT_MAX_Q20);
    term->x_q28[i] = fixed_mul_q28(exp2_negative((uint32_t)z_q20 << 2), height);
  }
  for (int k = 0; k < ROWS; k++) {
    int32_t z_q20 = fixed_clamp(fixed_mul_q26(bend, off->yy_q24[k]), 0, EXPONENT_MAX_Q20);
    term->y_q30[k] = exp2_negative((uint32_t)z_q20 << 2);
  }
  term->inverse_q10 = inverse >> 12;
}

FIXED_INLINE int32_t weighed(int32_t value, int32_t weight_q12) {
  return (value * weight_q12 + (1 << 11)) >> 12;
}

/* One step's model and Jacobian. With w_j a term at a node, s_i and f_i the sums of w_j / v_j^i
 * over the normal and the tangential terms, d = (dx, dy) and r2 = d' d: m     = A s0 + P s2 + (B'
 * d) f0,     P = e1 (dx^2 - dy^2) / 2 + e2 dx dy dm/dx = dx (A s1 + P s3 + (B' d) f1) - (e1 dx + e2
 * dy) s2 - Bx f0 dm/dt = A (r2 s2 / 2 - s1) + P (r2 s4 / 2 - 3 s3) + KAPPA (B' d) (r2 f2 / 2 - 2
 * f1) (e1 and e2 with the amplitude in them). Columns leave weighed, in Q14, residuals in Q24. */
NOINLINE static void linearise(struct problem *problem, const struct unknowns *at,
                               struct fit_tangential_room *room) {
  struct offsets off;
  struct term terms[FIT_TANGENTIAL_TERMS];
  set_offsets(problem->pad->pitch_q26, at, &off);
  int32_t wider_q26 = fixed_mul_16(at->t_q26, KAPPA_Q14) * 4;
  for (int j = 0; j < FIT_TANGENTIAL_TERMS; j++) {
    set_term(problem->pad, j, j < PAD_NORMAL_TERMS ? at->t_q26 : wider_q26, &off, &terms[j]);
  }
  int32_t a_q10 = at->amplitude_q24 >> 14;
  int32_t bx_q12 = at->pull_x_q24 >> 12, by_q12 = at->pull_y_q24 >> 12;
  int32_t e1_q17 = at->e1_q26 >> 9, e2_q17 = at->e2_q26 >> 9;
  int node = 0;
  for (int i = 0; i < COLUMNS; i++) {
    int32_t dx = off.x_q26[i] >> 14; /* Q12 */
    int32_t pulled_x = fixed_mul_q26(at->pull_x_q24, off.x_q26[i]);
    int32_t xx = off.xx_q24[i];
    for (int k = 0; k < ROWS; k++, node++) {
      int32_t weight = room->weight_q12[node];
      int32_t dy = off.y_q26[k] >> 14;
      int32_t yy = off.yy_q24[k];
      int32_t half_r2 = (xx + yy) >> 11; /* Q14 */

      int32_t s0_q28 = 0, s1 = 0, s2_q12 = 0, s3 = 0, s4 = 0; /* Q14, Q12, Q8, Q4 */
      _Pragma("GCC unroll 2") for (int j = 0; j < PAD_NORMAL_TERMS; j++) {
        int32_t w_q28 = fixed_mul_q30(terms[j].x_q28[i], terms[j].y_q30[k]);
        int32_t over = terms[j].inverse_q10;
        s0_q28 += w_q28;
        int32_t w = ((w_q28 >> 13) * over) >> 11;
        s1 += w;
        w = ((w >> 2) * over) >> 10;
        s2_q12 += w;
        w = ((w >> 4) * over) >> 10;
        s3 += w;
        s4 += ((w >> 4) * over) >> 10;
      }
      int32_t f0_q28 = 0, f1 = 0, f2 = 0; /* Q14, Q12 */
      _Pragma("GCC unroll 3") for (int j = PAD_NORMAL_TERMS; j < FIT_TANGENTIAL_TERMS; j++) {
        int32_t w_q28 = fixed_mul_q30(terms[j].x_q28[i], terms[j].y_q30[k]);
        int32_t over = terms[j].inverse_q10;
        f0_q28 += w_q28;
        int32_t w = ((w_q28 >> 13) * over) >> 11;
        f1 += w;
        f2 += ((w >> 2) * over) >> 10;
      }
      int32_t pulled = pulled_x + fixed_mul_q26(at->pull_y_q24, off.y_q26[k]); /* Q24 */
      int32_t stretch_q24 = (xx - yy) >> 1;                                    /* of unit 1/2 */
      int32_t slant_q24 = fixed_mul_q28(off.x_q26[i], off.y_q26[k]);
      int32_t longer_q24 =
          fixed_mul_q26(stretch_q24, at->e1_q26) + fixed_mul_q26(slant_q24, at->e2_q26);
      longer_q24 = fixed_clamp(longer_q24, -LONGER_MAX_Q24, LONGER_MAX_Q24); /* P */
      room->residual[node] =
          (problem->readings.q28[node] >> 4) - fixed_mul_q28(at->amplitude_q24, s0_q28) -
          fixed_mul_q28(pulled, f0_q28) - fixed_mul_q26(longer_q24 * 16, s2_q12 * 1024);

      int32_t s2 = s2_q12 >> 2;                               /* Q10 */
      int32_t f = f0_q28 >> 14;                               /* Q14 */
      int32_t b = pulled >> 12;                               /* Q12 */
      int32_t p = longer_q24 >> 8;                            /* Q16 */
      int32_t bf1 = (b * f1) >> 12, as1 = (a_q10 * s1) >> 10; /* Q14 */
      int32_t radial = as1 + ((p * s3) >> 10) + bf1;
      int32_t along_x = (e1_q17 * dx + e2_q17 * dy) >> 12; /* Q17 */
      int32_t along_y = (e2_q17 * dx - e1_q17 * dy) >> 12;
      int32_t *column = &room->column[0][node];
      int32_t place_x = ((radial * dx) >> 12) - ((along_x * s2) >> 13) - ((bx_q12 * f) >> 12);
      int32_t place_y = ((radial * dy) >> 12) - ((along_y * s2) >> 13) - ((by_q12 * f) >> 12);
      int32_t bend = ((a_q10 * s2) >> 10) + ((p * s4) >> 10); /* Q10 */
      int32_t widen = ((half_r2 * bend) >> 10) - as1 - 3 * ((p * s3) >> 10);
      int32_t pulled_widen = ((half_r2 * ((b * f2) >> 14)) >> 10) - 2 * bf1;
      widen += (pulled_widen * (KAPPA_Q14 >> 4)) >> 10;
      column[AMPLITUDE * NODES] = weighed(s0_q28 >> 14, weight);
      column[PLACE_X * NODES] = weighed(place_x, weight);
      column[PLACE_Y * NODES] = weighed(place_y, weight);
      column[SPREAD * NODES] = weighed(widen, weight);
      column[STRETCH * NODES] = weighed(((stretch_q24 >> 10) * s2) >> 10, weight);
      column[SLANT * NODES] = weighed(((slant_q24 >> 10) * s2) >> 10, weight);
      column[PULL_X * NODES] = weighed((f * dx) >> 12, weight);
      column[PULL_Y * NODES] = weighed((f * dy) >> 12, weight);
    }
  }
}

/* The rows that priors add: of SPREAD, STRETCH and SLANT, each alone in its own. */
struct priors {
  int32_t row[UNKNOWNS];      /* as the column it belongs to */
  int32_t residual[UNKNOWNS]; /* as the residuals */
};

static void set_priors(const struct problem *problem, const struct unknowns *at,
                       struct priors *priors) {
  memset(priors, 0, sizeof *priors);
  int32_t base_q26 = problem->base_q22 << 4;
  int32_t spread_q26 = fixed_div_q26(base_q26, problem->pad->spread_sd_q26);
  int32_t long_q26 = fixed_div_q26(base_q26, problem->long_sd_q26);
  const int32_t missing[UNKNOWNS] = {[SPREAD] = problem->pad->spread_q26 - at->t_q26,
                                     [STRETCH] = -at->e1_q26,
                                     [SLANT] = -at->e2_q26};
  for (int u = SPREAD; u <= SLANT; u++) {
    priors->row[u] = fixed_clamp(u == SPREAD ? spread_q26 : long_q26, 1, 2 * ONE_Q26);
    priors->residual[u] = fixed_mul_q28(missing[u], priors->row[u]);
  }
}

/* Brings column, Q14, and prior, Q26, to 13 bits at most, so that their square sum is below 2^30;
 * returns their Q. */
static int32_t normalise_column(int32_t *column, int32_t *prior) {
  uint32_t largest = fixed_size(*prior) >> 12;
  _Pragma("GCC unroll 15") for (int k = 0; k < NODES; k++) {
    largest |= fixed_size(column[k]);
  }
  int32_t shift = fixed_bits(largest) - 13;
  if (shift > 0) {
    int32_t half = 1 << (shift - 1);
    _Pragma("GCC unroll 15") for (int k = 0; k < NODES; k++) {
      column[k] = (column[k] + half) >> shift;
    }
  } else {
    _Pragma("GCC unroll 15") for (int k = 0; k < NODES; k++) {
      column[k] *= 1 << -shift;
    }
  }
  *prior = (*prior + (1 << (11 + shift))) >> (12 + shift);
  return 14 - shift;
}

/* Brings residuals to 13 bits, and weighs those of the sensors; returns their Q. */
NOINLINE static int32_t normalise_residuals(const int32_t *weight_q12, int32_t *residual,
                                            struct priors *priors) {
  uint32_t largest = 1;
  for (int k = 0; k < NODES; k++) {
    largest |= fixed_size(residual[k]);
  }
  for (int u = SPREAD; u <= SLANT; u++) {
    largest |= fixed_size(priors->residual[u]);
  }
  int32_t shift = fixed_bits(largest) - 13;
  int32_t down = shift > 0 ? shift : 0, up = shift < 0 ? -shift : 0;
  for (int k = 0; k < NODES; k++) {
    residual[k] = (((residual[k] >> down) * (1 << up)) * weight_q12[k]) >> 12;
  }
  for (int u = SPREAD; u <= SLANT; u++) {
    priors->residual[u] = (priors->residual[u] >> down) * (1 << up);
  }
  return 24 - shift;
}

static int32_t dot(const int32_t *a, const int32_t *b) {
  int32_t sum = 0;
  _Pragma("GCC unroll 15") for (int k = 0; k < NODES; k++) {
    sum += a[k] * b[k];
  }
  return sum;
}

/* One step's normal equations, solved. L D L^T in place: below the diagonal L, Q12; above it D L,
 * Q15. A direction whose pivot is below PIVOT_LEAST is not told: it takes no step. */
struct solution {
  int32_t step_q20[UNKNOWNS];    /* of the normalised columns */
  int32_t inverse_q12[UNKNOWNS]; /* of the pivots */
  int32_t explained_q30;         /* what the step takes from the square sum of the residuals */
};

#define STEP_MAX_Q20 (1 << 26)

NOINLINE static void solve(int32_t matrix[UNKNOWNS][UNKNOWNS], const int32_t *right_q30,
                           struct solution *solution) {
  int32_t y_q26[UNKNOWNS];
  solution->explained_q30 = 0;
  for (int j = 0; j < UNKNOWNS; j++) {
    int32_t y = right_q30[j] >> 4;
    for (int k = 0; k < j; k++) {
      y -= fixed_mul_16(y_q26[k], matrix[j][k]) * 16;
    }
    for (int i = j; i < UNKNOWNS; i++) {
      int32_t sum = matrix[i][j];
      for (int k = 0; k < j; k++) {
        sum -= matrix[k][j] * matrix[i][k] * 8;
      }
      matrix[i][j] = sum;
    }
    int32_t pivot = matrix[j][j];
    if (pivot < PIVOT_LEAST) {
      for (int i = j + 1; i < UNKNOWNS; i++) {
        matrix[j][i] = matrix[i][j] = 0;
      }
      y_q26[j] = solution->step_q20[j] = 0;
      solution->inverse_q12[j] = 1 << 24;
      continue;
    }
    int32_t up = 30 - fixed_bits((uint32_t)pivot - 1);
    up = up < 0 ? 0 : up;
    int32_t divisor = pivot >> (15 - up); /* 2^14 .. 2^15 */
    for (int i = j + 1; i < UNKNOWNS; i++) {
      int32_t sum = matrix[i][j];
      matrix[j][i] = sum >> 15;
      matrix[i][j] = fixed_clamp(port_divide(shifted(sum, up - 3), divisor), -INT16_MAX, INT16_MAX);
    }
    y_q26[j] = y = fixed_clamp(y, -(1 << 26), 1 << 26);
    int32_t z_q20 = shifted(port_divide(y * (1 << 4), divisor), 5 + up);
    solution->step_q20[j] = z_q20 = fixed_clamp(z_q20, -STEP_MAX_Q20, STEP_MAX_Q20);
    solution->inverse_q12[j] = port_divide(1 << 27, divisor) * (1 << up);
    solution->explained_q30 += (y >> 11) * (fixed_clamp(z_q20, -(1 << 20), 1 << 20) >> 5);
  }
  for (int i = UNKNOWNS - 2; i >= 0; i--) {
    int32_t z_q20 = solution->step_q20[i];
    for (int k = i + 1; k < UNKNOWNS; k++) {
      z_q20 -= fixed_mul_16(solution->step_q20[k], matrix[k][i]) * 16;
      z_q20 = fixed_clamp(z_q20, -STEP_MAX_Q20, STEP_MAX_Q20);
    }
    solution->step_q20[i] = z_q20;
  }
}

/* What the last step leaves for judging it. */
struct outcome {
  struct solution solution;
  int32_t column_q[UNKNOWNS]; /* a column's integer is its value times 2^q */
  struct scaled misfit;       /* chi^2 in units of the base's square */
  bool at_bound;
};

static int32_t clamp_told(int32_t value, int32_t low, int32_t high, bool *at_bound) {
  *at_bound = *at_bound || value < low || value > high;
  return fixed_clamp(value, low, high);
}

/* |value| / limit in Q14, at most 2^17. */
static int32_t in_limits(int32_t value, int32_t limit) {
  uint32_t size = fixed_size(value);
  int32_t coarse = limit >> 14;
  return size > (uint32_t)limit * 8 ? 1 << 17 : port_divide((int32_t)size, coarse < 1 ? 1 : coarse);
}

static int32_t spread_least(const struct fit_pad *pad) {
  return -fixed_mul_16(pad->variance_q26[0], SPREAD_LEAST_Q15) * 2;
}

NOINLINE static void take_step(const struct problem *problem, const struct outcome *outcome,
                               int32_t residual_q, struct unknowns *at, bool *at_bound) {
  const struct fit_pad *pad = problem->pad;
  int32_t move[UNKNOWNS];
  for (int u = 0; u < UNKNOWNS; u++) {
    int32_t q = u == AMPLITUDE || u >= PULL_X ? 24 : 26;
    move[u] = shifted(outcome->solution.step_q20[u], outcome->column_q[u] - residual_q - 20 + q);
  }
  int32_t narrow = pad->variance_q26[0] + at->t_q26;
  int32_t most = 1 << 14;
  for (int u = PLACE_X; u <= SPREAD; u++) {
    int32_t share = in_limits(move[u], u <= PLACE_Y ? MOVE_MAX_Q26 : narrow >> 1);
    most = share > most ? share : most;
  }
  if (most > 1 << 14) {
    int32_t share_q15 = port_divide(1 << 29, most);
    for (int u = 0; u < UNKNOWNS; u++) {
      move[u] = fixed_mul_16(move[u], share_q15 >> 1) * 4;
    }
  }
  *at_bound = false;
  int32_t half_x = (4 * (COLUMNS / 2) + 3) * (pad->pitch_q26 >> 2);
  int32_t half_y = (4 * (ROWS / 2) + 3) * (pad->pitch_q26 >> 2);
  int32_t even_x = COLUMNS % 2 ? 0 : pad->pitch_q26, even_y = ROWS % 2 ? 0 : pad->pitch_q26;
  at->x_q26 = clamp_told(at->x_q26 + move[PLACE_X], -half_x, half_x - even_x, at_bound);
  at->y_q26 = clamp_told(at->y_q26 + move[PLACE_Y], -half_y, half_y - even_y, at_bound);
  at->amplitude_q24 =
      clamp_told(at->amplitude_q24 + move[AMPLITUDE], 1 << 16, AMPLITUDE_MAX_Q24, at_bound);
  at->pull_x_q24 = clamp_told(at->pull_x_q24 + move[PULL_X], -PULL_MAX_Q24, PULL_MAX_Q24, at_bound);
  at->pull_y_q24 = clamp_told(at->pull_y_q24 + move[PULL_Y], -PULL_MAX_Q24, PULL_MAX_Q24, at_bound);
  at->t_q26 = fixed_clamp(at->t_q26 + move[SPREAD], spread_least(pad), SPREAD_MOST_Q26);
  at->e1_q26 = clamp_told(at->e1_q26 + move[STRETCH], -LONG_MAX_Q26, LONG_MAX_Q26, at_bound);
  at->e2_q26 = clamp_told(at->e2_q26 + move[SLANT], -LONG_MAX_Q26, LONG_MAX_Q26, at_bound);
}

/* The normal equations, each unknown scaled so that its diagonal element is 2^28 .. 2^30. */
NOINLINE static void form(struct fit_tangential_room *room, const struct priors *priors,
                          int32_t *column_q, int32_t *right_q30) {
  int32_t scale[UNKNOWNS];
  for (int u = 0; u < UNKNOWNS; u++) {
    const int32_t *column = room->column[u];
    int32_t own = dot(column, column) + priors->row[u] * priors->row[u];
    int32_t up = (30 - fixed_bits((uint32_t)own)) >> 1;
    scale[u] = up;
    column_q[u] += up;
    room->matrix[u][u] = own * (1 << (2 * up));
    int32_t right = dot(column, room->residual) + priors->row[u] * priors->residual[u];
    right_q30[u] = right * (1 << up);
    for (int v = 0; v < u; v++) {
      room->matrix[u][v] = dot(column, room->column[v]) * (1 << (up + scale[v]));
    }
  }
}

static void improve(struct problem *problem, struct unknowns *at, struct fit_tangential_room *room,
                    struct outcome *outcome) {
  struct priors priors;
  int32_t right_q30[UNKNOWNS];
  linearise(problem, at, room);
  set_priors(problem, at, &priors);
  int32_t residual_q = normalise_residuals(room->weight_q12, room->residual, &priors);
  for (int u = 0; u < UNKNOWNS; u++) {
    outcome->column_q[u] = normalise_column(room->column[u], &priors.row[u]);
  }
  form(room, &priors, outcome->column_q, right_q30);
  solve(room->matrix, right_q30, &outcome->solution);
  int32_t squares = dot(room->residual, room->residual);
  for (int u = SPREAD; u <= SLANT; u++) {
    squares += priors.residual[u] * priors.residual[u];
  }
  squares -= outcome->solution.explained_q30;
  outcome->misfit = fit_scaled_from(squares > 0 ? squares : 0, -2 * residual_q);
  take_step(problem, outcome, residual_q, at, &outcome->at_bound);
}

/* sqrt(a^2 + b^2) within 7 %, for weights. */
static int32_t longer_leg(int32_t a, int32_t b) {
  int32_t longer = a > b ? a : b, shorter = a > b ? b : a;
  return longer + ((3 * shorter) >> 3);
}

/* What a reading's errors are, and the weights that follow. False: too few sensors. */
NOINLINE static bool weigh(const struct fit_array *array, const struct fit_settings *settings,
                           uint32_t used, struct problem *problem,
                           struct fit_tangential_room *room) {
  const struct readings *readings = &problem->readings;
  int32_t noise = shifted(settings->noise_Pa_q10, readings->shift - 6);
  noise = fixed_clamp(noise, 1, ONE_Q26 >> 5);
  int32_t up = readings->shift > 0 ? readings->shift : 0, down = up - readings->shift;
  int32_t largest_q28 = (readings->largest >> down) * (1 << up);
  int32_t base = longer_leg(noise, ((largest_q28 >> 14) * MODEL_SD_Q16) >> 8);
  int sensors = 0;
  for (int k = 0; k < NODES; k++) {
    uint8_t sensor = array->grid.sensor[k];
    room->weight_q12[k] = 0;
    if (used >> sensor & 1) {
      uint32_t size = fixed_size(readings->q14[k]);
      int32_t gain = (int32_t)((uint32_t)settings->gain_sd_q16[sensor] * size >> 8);
      room->weight_q12[k] = port_divide(base << 8, longer_leg(base, gain) >> 4);
      sensors++;
    }
  }
  problem->base_q22 = base;
  problem->noise_q22 = noise;
  return sensors >= FIT_TANGENTIAL_SENSORS;
}

NOINLINE static void begin(const struct fit_array *array, const struct fit_pad *pad,
                           const struct fit_result *start, int32_t shift, struct unknowns *at) {
  const float q26 = 67108864.0f;
  uint8_t origin = array->grid.sensor[COLUMNS / 2 * ROWS + ROWS / 2];
  float scale = pad->per_unit * q26;
  at->x_q26 = (int32_t)((start->x_mm - array->x[origin] * array->pitch_mm) * scale);
  at->y_q26 = (int32_t)((start->y_mm - array->y[origin] * array->pitch_mm) * scale);
  float sigma = start->sigma_mm * pad->per_unit;
  float square = sigma * sigma;
  int32_t most = SPREAD_MOST_Q26 + GAUSSIAN_VARIANCE_Q26;
  int32_t t_q26 = square < 1.0f ? (int32_t)(square * q26) : most;
  at->t_q26 = fixed_clamp(t_q26 - GAUSSIAN_VARIANCE_Q26, spread_least(pad), SPREAD_MOST_Q26);
  at->e1_q26 = at->e2_q26 = at->pull_x_q24 = at->pull_y_q24 = 0;
  struct scaled amplitude = scaled_mul(fit_grid_scaled(start->force_N), pad->per_force);
  amplitude.exponent += shift - 18;
  at->amplitude_q24 = fixed_clamp(fit_scaled_to_fixed(amplitude, 24), 1 << 18, AMPLITUDE_MAX_Q24);
}

/* Element i of the diagonal of the inverse matrix, Q12. */
static struct scaled inverse_element(const struct fit_tangential_room *room,
                                     const struct solution *solution, int i) {
  int32_t w_q12[UNKNOWNS];
  struct scaled sum = {0, 0};
  for (int k = i; k < UNKNOWNS; k++) {
    int32_t w = k == i ? 1 << 12 : 0;
    for (int m = i; m < k; m++) {
      w -= (room->matrix[k][m] * w_q12[m]) >> 12;
    }
    w_q12[k] = w = fixed_clamp(w, -INT16_MAX, INT16_MAX);
    struct scaled square = fit_scaled_from(w * w, -24);
    sum = scaled_add(sum, scaled_mul(square, fit_scaled_from(solution->inverse_q12[k], -12)));
  }
  return sum;
}

/* Variance of an unknown, in its unit squared, of readings whose variance is 1. */
static struct scaled variance_of(const struct fit_tangential_room *room,
                                 const struct outcome *outcome, int u) {
  struct scaled variance = inverse_element(room, &outcome->solution, u);
  variance.exponent += 2 * outcome->column_q[u] - 30;
  return variance;
}

static float root_of(struct scaled square) {
  struct scaled root = fit_scaled_sqrt(square);
  return fit_grid_compose(root.mantissa, root.exponent);
}

NOINLINE static void conclude(const struct fit_array *array, const struct problem *problem,
                              const struct unknowns *at, const struct outcome *outcome,
                              struct fit_tangential *result) {
  const struct fit_pad *pad = problem->pad;
  const struct fit_tangential_room *room = &pad->room;
  struct scaled base = fit_scaled_from(problem->base_q22, -22);
  struct scaled variance = scaled_mul(base, base);
  struct scaled chi_square = scaled_div(outcome->misfit, variance);
  if (outcome->at_bound || fit_scaled_to_fixed(chi_square, 16) > CHI_SQUARE_MAX << 16) {
    return;
  }
  chi_square.exponent -= MISFIT_SHIFT;
  if (fit_scaled_to_fixed(chi_square, 16) > MISFIT_LEAST_Q16) {
    variance = scaled_mul(variance, chi_square);
  } else {
    variance = scaled_mul(variance, (struct scaled){MISFIT_LEAST_Q16, -16});
  }
  struct scaled pulls =
      scaled_add(variance_of(room, outcome, PULL_X), variance_of(room, outcome, PULL_Y));
  pulls.exponent -= 1;
  struct scaled place =
      scaled_add(variance_of(room, outcome, PLACE_X), variance_of(room, outcome, PLACE_Y));
  float unit_N = pad->force_unit_N * fit_grid_compose(1, 18 - problem->readings.shift);
  float amplitude = fit_grid_compose(at->amplitude_q24, -24);
  float pull_sd = root_of(scaled_mul(pulls, variance));
  if (pull_sd > FIT_TANGENTIAL_SD_MAX * amplitude) {
    return;
  }
  uint8_t origin = array->grid.sensor[COLUMNS / 2 * ROWS + ROWS / 2];
  result->valid = true;
  result->x_mm =
      fit_grid_compose(at->x_q26, -26) * pad->unit_mm + array->x[origin] * array->pitch_mm;
  result->y_mm =
      fit_grid_compose(at->y_q26, -26) * pad->unit_mm + array->y[origin] * array->pitch_mm;
  result->force_N = unit_N * amplitude;
  result->qx_N = unit_N * fit_grid_compose(at->pull_x_q24, -24);
  result->qy_N = unit_N * fit_grid_compose(at->pull_y_q24, -24);
  result->q_sd_N = unit_N * pull_sd;
  result->location_sd_mm = pad->unit_mm * root_of(scaled_mul(place, variance));
  struct scaled noise = fit_scaled_from(problem->noise_q22, -22);
  result->location_noise_mm = pad->unit_mm * root_of(scaled_mul(place, scaled_mul(noise, noise)));
  result->force_sd_N =
      unit_N * root_of(scaled_mul(variance_of(room, outcome, AMPLITUDE), variance));
}

void fit_tangential_load(const struct fit_array *array, struct fit_pad *pad,
                         const int32_t *pressure_Pa_q10, const struct fit_settings *settings,
                         const struct fit_result *start, struct fit_tangential *result) {
  *result = (struct fit_tangential){0};
  struct problem problem = {.pad = pad};
  if (!(start->flags & CONTACT_FLAG_FIT_VALID) || settings->noise_Pa_q10 < 1 ||
      !fit_grid_take_readings(array, pressure_Pa_q10, start->used, settings, &problem.readings) ||
      !weigh(array, settings, start->used, &problem, &pad->room)) {
    return;
  }
  struct unknowns at;
  struct outcome outcome;
  begin(array, pad, start, problem.readings.shift, &at);
  problem.long_sd_q26 = fixed_mul_q28(at.amplitude_q24 * 4, pad->long_sd_q26) * 4;
  for (int step = 0; step < FIT_TANGENTIAL_STEPS; step++) {
    improve(&problem, &at, &pad->room, &outcome);
  }
  conclude(array, &problem, &at, &outcome, result);
}
