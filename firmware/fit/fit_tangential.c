#include "fit/fit_tangential.h"

#include "common/contact_flags.h"
#include "fit/fit_grid_parts.h"
#include "fit/fit_limits.h"
#include "fit/fit_math.h"

#include <string.h>

/* The model of a reading, lengths in units of twice the widest normal term's standard deviation,
 * d = (dx, dy) from the contact to the sensor:
 *   m = sum over the normal terms of     (A + E / v^2) share V0 / v exp(-d' d / (2 v))
 *     + sum over the tangential terms of (Bx dx + By dy) moment V0 / V^2 exp(-d' d / (2 V))
 *   E = e1 (dx^2 - dy^2) / 2 + e2 dx dy
 * with v and V the terms' variances and t, or KAPPA t, of the contact's own, and V0 the widest
 * normal term's, so that the forces are 2 pi V0 A and 2 pi V0 B. E is what a contact's longer and
 * shorter axis make of its pressure, to first order. The order of the
 * unknowns: those that the others determine least come last. The tangential force follows from the
 * remainder of their columns.
 */
enum { AMPLITUDE, PLACE_X, PLACE_Y, SPREAD, STRETCH, SLANT, PULL_X, PULL_Y, UNKNOWNS };

/* 1.3: an object that holds pulls more at its rim than it presses there. */
#define KAPPA_Q14 21299

#define MODEL_SD_Q16 328 /* 0.005 of the largest reading */
/* Prior of both elongations. */
#define ELONGATION_SD_mm2 3.0f

/* Of chi^2, as standard deviations count it. Independent model errors of MODEL_SD are more than
 * layers make of smooth contacts. So a small chi^2 takes from the variance what is the model's and
 * the noise's; of what is the gains' it leaves so much, for these are what they are. A half covers
 * as it should on pads of 1.5, 5 and 10 % (seed 1 of shear_static's touches). */
#define GAINS_SHIFT 1
#define MISFIT_SHIFT 4 /* 1 / 16 */
#define MISFIT_LEAST_Q16 6554

/* A layer thinner than the pitch shows less of its shape than the residuals tell: standard
 * deviations grow as (pitch / thickness)^2. On 6 mm, where errors are 2.3 times what they would be
 * called, by 2.25; the widest term's sd is 0.478 of the thickness. */
#define THICKNESS_PER_UNIT 1.0455f

/* Beyond this share of it the contact is too long to tell a load from its shape: of lying cylinders
 * without load 15 % would claim one, 1 % do (report, elongated_false_percent). A pad that ends
 * nearer than three quarters of its thickness makes round contacts look long: there all are taken.
 */
#define LONG_MOST_Q15 1507 /* 0.046 */
#define LONG_MOST_NEAR_ENDS_Q15 8192
#define NEAR_ENDS 0.75f

/* A contact is elongated if its elongation exceeds this share of the widest term's variance with t,
 * and so many standard deviations. shear_static tells how many do, by object and load.
 */
#define ELONGATED_LEAST 0.05f
#define ELONGATED_SURE 2.5f
/* The ends of a pad leave residuals: with 8 a quarter of the good touches 13 mm within them would
 * go. */
#define CHI_SQUARE_MAX 8
#define CHI_SQUARE_MAX_WITH_ENDS 16
#define CHI_SQUARE_MAX_NEAR_ENDS 60

#define GAUSSIAN_VARIANCE_Q26 15300821 /* of the Gaussian that fits a point contact: 0.912 V0 */
#define GAUSSIAN_FORCE 1.0753f         /* its 2 pi p0 sigma^2 over the force */

#define SPREAD_LEAST_Q15 9830 /* 0.3 of the narrowest normal term's variance: as much below 0 */
#define SPREAD_MOST_Q26 (ONE_Q26 / 2) /* 2 V0 */
#define LONG_MAX_Q26 (ONE_Q26 / 4 - 1)
#define AMPLITUDE_MAX_Q24 ((4 << 24) - (1 << 11))
#define PULL_MAX_Q24 (2 << 24)

/* Where a step begins is rounded, which moves the step and not where it ends: so that what residual
 * and Jacobian have of it is exact in 16 bits, distances from sensors too, whose pitch is such a
 * number. */
#define PLACE_Q 12
#define HEIGHT_Q 13 /* of A and B */
#define LONG_Q 17   /* of e1 and e2 */

/* Longest step of the place, and of t in the narrowest term's variance. */
#define MOVE_MAX_Q26 (ONE_Q26 * 3 / 8)

/* The first step leaves what a layer is not a Gaussian; after one longer than 0.2 of the longest
 * the estimate is off its optimum by some 0.1 mm, after a jump of the Gaussian too. */
#define STEPS_TOLD 2
#define LENGTH_TOLD_Q14 3277
#define JUMP_Q26 (ONE_Q26 / 2)
/* The Gaussian's place jitters more than the estimate's in the corners. */
#define MOVED_NOISES 4
/* Sum of the readings, scaled so that the largest is 0.5 to 1. A smaller sum cannot come from a
 * contact. */
#define SUM_LEAST_Q20 (1 << 18)
/* After so many frames in a row without a report it starts again: one more than a contact at rest
 * takes. Where another contact has come and gone it is found again within ten frames, without this
 * after hundreds. */
#define UNTOLD_MOST 6

#define DIP_SD_LEAST_Q13 (1 << 11) /* the narrowest that a term may be */
#define DIP_SD_MOST_Q13 (1 << 15)

#define PIVOT_LEAST (1 << 18) /* 2^-12: an unknown with less stays where it is */

/* What of the readings is kept from step to step. */
struct problem {
  const struct fit_pad *pad;
  struct readings readings;
  int32_t base_q22;  /* standard deviation of a reading of weight 1, of the unit of readings */
  int32_t noise_q22; /* the same */
  int32_t by_gains_q12; /* share of the readings' variances that is their gains', mean */
  /* The dip: its depth in the height of the model's middle, 0: none; log2(e) / (2 sd^2). */
  int32_t dip_share_q16, dip_bend_q22;
  const struct fit_own *own; /* [sensor] or NULL */
  const uint8_t *sensor;     /* [node] */
  /* Rows of the priors of t and of e1 and e2, whose scale is the amplitude at the beginning. */
  int32_t spread_prior_q26, long_prior_q26;
};

static int32_t q26_from(float value) {
  return (int32_t)(value * 67108864.0f);
}

static int32_t spread_least(const struct fit_pad *pad) {
  return -fixed_mul_16(pad->variance_q26[0], SPREAD_LEAST_Q15) * 2;
}

/* What the formats of the sums and of what is made of them carry; layers need 1.3, 9.5 and 97 of
 * the first three, and pads of 5 to 20 mm a pitch of 0.47 to 1.88 units of 4.8 to 19.1 mm. */
#define SUM_MAX_0 1.9f
#define SUM_MAX_1 12.0f
#define SUM_MAX_2 112.0f
#define VARIANCE_MAX 7.0f
#define PITCH_MAX 1.9f
#define UNIT_MAX_mm 19.5f
#define FORCE_UNIT_Q 40 /* 2^25 .. 2^30 */

/* Whether the sums over these terms of strength V0 / v^i, i from first, stay below their limits for
 * the most concentrated contact. */
static bool is_carried(const struct fit_pad *pad, int from, int end, float t, bool pulls) {
  float sums[3] = {0.0f, 0.0f, 0.0f};
  for (int j = from; j < end; j++) {
    float v = (float)pad->variance_q26[j] * (1.0f / 67108864.0f) + t;
    if (v < 0.0625f) {
      return false;
    }
    float w = (float)pad->strength_q26[j] * (0.25f / 67108864.0f) / (pulls ? v * v : v);
    sums[0] += w;
    sums[1] += w / v;
    sums[2] += w / (v * v);
  }
  return sums[0] <= SUM_MAX_0 && sums[1] <= SUM_MAX_1 && sums[2] <= SUM_MAX_2;
}

enum ft_status fit_pad_init(struct fit_pad *pad, const struct fit_array *array,
                            const struct pad_profile *profile) {
  float widest_mm = profile->normal[PAD_NORMAL_TERMS - 1].sd_mm;
  if (array->grid.columns != FIT_GRID_COLUMNS || array->grid.rows != FIT_GRID_ROWS ||
      !pad_profile_is_valid(profile) || 2.0f * widest_mm > UNIT_MAX_mm ||
      array->pitch_mm > PITCH_MAX * 2.0f * widest_mm) {
    return FT_ERR_ARGUMENT;
  }
  int32_t pitch_q12 = (int32_t)(array->pitch_mm / (2.0f * widest_mm) * 4096.0f + 0.5f);
  float unit_mm = array->pitch_mm * 4096.0f / (float)pitch_q12;
  float per_unit = 1.0f / unit_mm;
  for (int j = 0; j < FIT_TANGENTIAL_TERMS; j++) {
    bool normal = j < PAD_NORMAL_TERMS;
    float sd_mm =
        normal ? profile->normal[j].sd_mm : profile->tangential[j - PAD_NORMAL_TERMS].sd_mm;
    float strength = normal ? profile->normal[j].share
                            : profile->tangential[j - PAD_NORMAL_TERMS].moment_mm * per_unit;
    float sd = sd_mm * per_unit;
    if (sd * sd > VARIANCE_MAX || strength > VARIANCE_MAX) {
      return FT_ERR_ARGUMENT;
    }
    pad->variance_q26[j] = q26_from(sd * sd);
    pad->strength_q26[j] = q26_from(strength);
  }
  float per_square = per_unit * per_unit;
  uint8_t origin = array->grid.sensor[COLUMNS / 2 * ROWS + ROWS / 2];
  pad->unit_q25_mm = (int32_t)(unit_mm * 33554432.0f);
  pad->per_unit_q30 = (int32_t)(per_unit * 1073741824.0f);
  pad->origin_x_q24_mm = fit_fixed(array->x[origin] * array->pitch_mm, 24);
  pad->origin_y_q24_mm = fit_fixed(array->y[origin] * array->pitch_mm, 24);
  pad->pitch_q26 = pitch_q12 * (1 << (26 - PLACE_Q));
  pad->pitch_square_q26 = fixed_mul_q26(pad->pitch_q26, pad->pitch_q26);
  float spread = profile->spread_mm2 * per_square, spread_sd = profile->spread_sd_mm2 * per_square;
  pad->spread_q26 = q26_from(spread < VARIANCE_MAX ? spread : VARIANCE_MAX);
  pad->spread_sd_q26 = q26_from(spread_sd < VARIANCE_MAX ? spread_sd : VARIANCE_MAX);
  pad->long_sd_q26 = q26_from(ELONGATION_SD_mm2 * per_square);
  float least = (float)spread_least(pad) * (1.0f / 67108864.0f);
  if (!is_carried(pad, 0, PAD_NORMAL_TERMS, least, false) ||
      !is_carried(pad, PAD_NORMAL_TERMS, FIT_TANGENTIAL_TERMS, 1.3f * least, true)) {
    return FT_ERR_ARGUMENT;
  }
  float force_unit_N = 1.57079633e-6f * unit_mm * unit_mm; /* 2 pi V0, V0 = 1/4 */
  pad->force_unit = (struct scaled){fit_fixed(force_unit_N, FORCE_UNIT_Q), -FORCE_UNIT_Q};
  bool near_ends =
      profile->overhang_mm > 0.0f && profile->overhang_mm < NEAR_ENDS * profile->thickness_mm;
  pad->chi_square_max = near_ends                     ? CHI_SQUARE_MAX_NEAR_ENDS
                        : profile->overhang_mm > 0.0f ? CHI_SQUARE_MAX_WITH_ENDS
                                                      : CHI_SQUARE_MAX;
  pad->long_most_q15 = near_ends ? LONG_MOST_NEAR_ENDS_Q15 : LONG_MOST_Q15;
  float thin = array->pitch_mm / (THICKNESS_PER_UNIT * unit_mm);
  thin *= thin;
  pad->thin = fit_grid_scaled(thin > 1.0f ? thin * thin : 1.0f);
  pad->per_force = fit_grid_scaled(1.0f / (GAUSSIAN_FORCE * force_unit_N));
  return FT_OK;
}

/* a * b / 2^shift, 16 < shift <= 32, from three 16-bit products, for |a|, |b| <= 2^30: error below
 * 1 + 2^(32 - shift) units. */
FIXED_INLINE int32_t product(int32_t a, int32_t b, int shift) {
  int32_t a_high = a >> 16, a_low = (uint16_t)a;
  int32_t b_high = b >> 16, b_low = (uint16_t)b;
  return a_high * b_high * (1 << (32 - shift)) +
         ((a_high * b_low + a_low * b_high) >> (shift - 16));
}

/* The same with the fourth product: error below 2 units. */
FIXED_INLINE int32_t whole_product(int32_t a, int32_t b, int shift) {
  uint32_t low = (uint32_t)(uint16_t)a * (uint16_t)b;
  return product(a, b, shift) + (int32_t)(shift < 32 ? low >> shift : 0);
}

/* a * b / 2^shift, shift <= 16, for |b| < 2^15, from two: error below one unit. */
FIXED_INLINE int32_t scaled_by(int32_t a, int32_t b, int shift) {
  return (a >> 16) * b * (1 << (16 - shift)) + (((int32_t)(uint16_t)a * b) >> shift);
}

/* value / 2^shift to the nearest. */
FIXED_INLINE int32_t rounded(int32_t value, int shift) {
  return (value + (1 << (shift - 1))) >> shift;
}

/* Where a step begins, rounded. */
struct origin {
  int32_t x_q12, y_q12, amplitude_q13, pull_x_q13, pull_y_q13, e1_q17, e2_q17;
};

/* Of a contact there: where the sensors lie along one axis, and what of the model depends on that
 * alone. */
struct offset {
  int32_t d_q12, half_square_q24;
  int32_t pulled_q25;               /* B d */
  int32_t longer_q26;               /* e1 d^2 / 2 */
  int32_t along_x_q17, along_y_q17; /* in x e1 d and e2 d, in y e2 d and -e1 d */
};

FIXED_INLINE void set_offset(int32_t d_q12, int32_t pull_q13, int32_t e1_q17, int32_t by_x_q17,
                             int32_t by_y_q17, struct offset *off) {
  off->d_q12 = d_q12;
  off->half_square_q24 = (d_q12 * d_q12) >> 1;
  off->pulled_q25 = d_q12 * pull_q13;
  off->longer_q26 = scaled_by(off->half_square_q24, e1_q17, 15);
  off->along_x_q17 = rounded(d_q12 * by_x_q17, 12);
  off->along_y_q17 = rounded(d_q12 * by_y_q17, 12);
}

/* One term, strength V0 / v exp(-d' d / (2 v)). */
struct term {
  int32_t x_q28[COLUMNS]; /* with the strength */
  int32_t y_q30[ROWS];
  int32_t over_q11, over_square_q7; /* 1 / v, at most 16, and its square */
  int32_t height_q28;               /* the strength over v, or over v^2 */
};

/* d' d / (2 v) in Q22 and powers of 2, along one axis: bend (i pitch - place)^2, exactly a parabola
 * in the node number, so that rounding moves the term's place and width and never the residual. */
struct parabola {
  int32_t square_q26, by_pitch_q26; /* place^2, place pitch */
};

#define Z_LEAST_Q22 16 /* rounding takes no exponent below zero */

NOINLINE static void set_exponentials(int32_t bend_q26, int32_t by_square, int32_t nodes,
                                      const struct parabola *axis, int32_t *value_q30) {
  uint32_t at_origin = (uint32_t)fixed_mul_q26(bend_q26, axis->square_q26) + Z_LEAST_Q22;
  int32_t slope = fixed_mul_q26(bend_q26, axis->by_pitch_q26) * 2;
  for (int32_t k = 0, i = -(nodes / 2); k < nodes; k++, i++) {
    value_q30[k] =
        exp2_negative(at_origin + (uint32_t)i * ((uint32_t)(i * by_square) - (uint32_t)slope));
  }
}

#define LEAST_VARIANCE_Q26 (ONE_Q26 / 16)

NOINLINE static void set_term(const struct fit_pad *pad, int j, int32_t t_q26,
                              const struct parabola *axes, struct term *term) {
  int32_t v = pad->variance_q26[j] + t_q26;
  int32_t inverse_q22 =
      fixed_div_q26(1 << 22, v < LEAST_VARIANCE_Q26 ? LEAST_VARIANCE_Q26 : v); /* 1 / v */
  int32_t height_q24 = fixed_mul_q26(inverse_q22, pad->strength_q26[j]); /* V0 / v of it, V0 1/4 */
  if (j >= PAD_NORMAL_TERMS) {
    height_q24 = fixed_mul_q26(height_q24, inverse_q22) * 16; /* moment V0 / v^2 */
  }
  int32_t height_q28 = fixed_clamp(height_q24, 0, (2 << 24) - 1) * 16;
  term->height_q28 = height_q28;
  int32_t bend_q26 = fixed_mul_q26(inverse_q22, LOG2E_HALF_Q26);
  int32_t by_square = fixed_mul_q26(bend_q26, pad->pitch_square_q26);
  set_exponentials(bend_q26, by_square, COLUMNS, &axes[0], term->x_q28);
  set_exponentials(bend_q26, by_square, ROWS, &axes[1], term->y_q30);
  for (int i = 0; i < COLUMNS; i++) {
    term->x_q28[i] = product(term->x_q28[i], height_q28, 30);
  }
  term->over_q11 = fixed_clamp(rounded(inverse_q22, 11), 0, INT16_MAX);
  term->over_square_q7 = (term->over_q11 * term->over_q11) >> 15;
}

#define LONGER_MAX_Q26 ((4 << 26) - 1)

/* Qs in which the columns leave linearise. */
static const uint8_t column_q[UNKNOWNS] = {14, 14, 14, 14, 14, 14, 16, 16};

/* The residuals of five nodes but for P s2, and the terms there with the weight, for set_sums. */
NOINLINE static void set_terms(const struct problem *problem, const struct term *terms, int i,
                               const struct offset *x, const struct offset *y,
                               int32_t amplitude_q13, struct fit_tangential_room *room) {
  for (int k = 0, n = i * ROWS; k < ROWS; k++, n++, y++) {
    struct fit_tangential_terms *found = &room->node[n].terms;
    int32_t weight_q12 = room->weight_q12[n];
    int32_t s0_q28 = 0, f0_q28 = 0;
    for (int j = 0; j < PAD_NORMAL_TERMS; j++) {
      int32_t w_q28 = product(terms[j].x_q28[i], terms[j].y_q30[k], 30);
      s0_q28 += w_q28;
      found->normal_q28[j] = scaled_by(w_q28, weight_q12, 12);
    }
    for (int j = 0; j < PAD_TANGENTIAL_TERMS; j++) {
      const struct term *term = &terms[PAD_NORMAL_TERMS + j];
      int32_t w_q28 = product(term->x_q28[i], term->y_q30[k], 30);
      f0_q28 += w_q28;
      found->tangential_q28[j] = scaled_by(w_q28, weight_q12, 12);
    }
    int32_t model_q24 = (scaled_by(s0_q28, amplitude_q13, 16) >> 1) +
                        whole_product(x->pulled_q25 + y->pulled_q25, f0_q28 * 2, 30);
    room->residual[n] = scaled_by((problem->readings.q28[n] >> 4) - model_q24, weight_q12, 12);
  }
}

/* struct fit_tangential_sums of every node, of its terms. What is multiplied by little has few
 * bits. */
NOINLINE static void set_sums(const struct term *terms, union fit_tangential_node *node) {
  const union fit_tangential_node *end = node + NODES;
  do {
    int32_t s0 = 0, s1 = 0, s2 = 0, s3 = 0, s4 = 0;
    for (int j = 0; j < PAD_NORMAL_TERMS; j++) {
      int32_t over_q11 = terms[j].over_q11, w_q28 = node->terms.normal_q28[j];
      s0 += w_q28;
      int32_t w_q25 = scaled_by(w_q28, over_q11, 14);
      s1 += w_q25;
      int32_t w_q22 = scaled_by(w_q25, over_q11, 14);
      s2 += w_q22;
      int32_t w_q18 = scaled_by(w_q22, over_q11, 15);
      s3 += w_q18;
      s4 += scaled_by(w_q18, over_q11, 15);
    }
    int32_t f0 = 0, f1 = 0, f2 = 0;
    for (int j = 0; j < PAD_TANGENTIAL_TERMS; j++) {
      const struct term *term = &terms[PAD_NORMAL_TERMS + j];
      int32_t w_q28 = node->terms.tangential_q28[j];
      f0 += w_q28;
      f1 += scaled_by(w_q28, term->over_q11, 14);
      f2 += scaled_by(w_q28, term->over_square_q7, 13);
    }
    node->sums.s0_q14 = rounded(s0, 14);
    node->sums.s1_q25 = s1;
    node->sums.s2_q22 = s2;
    node->sums.s3_q8 = s3 >> 10;
    node->sums.s4_q14 = s4;
    node->sums.f0_q14 = rounded(f0, 14);
    node->sums.f1_q12 = rounded(f1, 13);
    node->sums.f2_q22 = f2;
  } while (++node != end);
}

/* The dip's Gaussian along an axis within 0.3 %, as set_exponentials has the terms'. */
NOINLINE static void set_dip_axis(int32_t bend_q22, int32_t by_square, int32_t nodes,
                                  const struct parabola *axis, int32_t *value_q15) {
  uint32_t at_origin = (uint32_t)fixed_mul_q26(bend_q22, axis->square_q26) + Z_LEAST_Q22;
  int32_t slope = fixed_mul_q26(bend_q22, axis->by_pitch_q26) * 2;
  for (int32_t k = 0, i = -(nodes / 2); k < nodes; k++, i++) {
    value_q15[k] =
        exp2_rough(at_origin + (uint32_t)i * ((uint32_t)(i * by_square) - (uint32_t)slope)) >> 15;
  }
}

/* Takes the dip from the model: a share of the height in the contact's middle, in a Gaussian about
 * it. The dip is in the column of the amplitude; it is so wide that those of place and spread do
 * without. */
NOINLINE static void take_dip(const struct problem *problem, const struct term *terms,
                              const struct parabola *axes, int32_t amplitude_q13,
                              struct fit_tangential_room *room) {
  int32_t x_q15[COLUMNS], y_q15[ROWS];
  int32_t bend_q22 = problem->dip_bend_q22;
  int32_t by_square = fixed_mul_q26(bend_q22, problem->pad->pitch_square_q26);
  set_dip_axis(bend_q22, by_square, COLUMNS, &axes[0], x_q15);
  set_dip_axis(bend_q22, by_square, ROWS, &axes[1], y_q15);
  int32_t height_q27 = 0;
  for (int j = 0; j < PAD_NORMAL_TERMS; j++) {
    height_q27 += terms[j].height_q28 >> 1;
  }
  int32_t depth_q17 = fixed_mul_16(height_q27, problem->dip_share_q16) >> 10;
  int32_t lack_q16 = (depth_q17 * amplitude_q13) >> 14; /* with the amplitude */
  const int32_t *weight_q12 = room->weight_q12;
  int32_t *residual = room->residual;
  union fit_tangential_node *node = room->node;
  for (int i = 0; i < COLUMNS; i++) {
    for (int k = 0; k < ROWS; k++, node++) {
      int32_t bell_q15 = (((x_q15[i] * y_q15[k]) >> 15) * *weight_q12++) >> 12;
      node->sums.s0_q14 -= (bell_q15 * depth_q17) >> 18;
      *residual++ += (bell_q15 * lack_q16) >> 7;
    }
  }
}

/* Ends the residuals of five nodes and sets their columns of the place and the spread. With
 * d = (dx, dy), r2 = d' d and b = Bx dx + By dy:
 *   m     = A s0 + P s2 + b f0,     P = e1 (dx^2 - dy^2) / 2 + e2 dx dy
 *   dm/dx = dx (A s1 + P s3 + b f1) - (e1 dx + e2 dy) s2 - Bx f0
 *   dm/dt = r2 / 2 (A s2 + P s4 + KAPPA b f2) - (A s1 + 3 P s3 + 2 KAPPA b f1)
 * (e1 and e2 with the amplitude in them). */
NOINLINE static void set_moving(const struct offset *x, const struct offset *y,
                                const struct origin *at, union fit_tangential_node *node,
                                int32_t *residual) {
  const union fit_tangential_node *end = node + ROWS;
  do {
    int32_t longer_q26 =
        x->longer_q26 - y->longer_q26 + scaled_by(x->d_q12 * y->d_q12, at->e2_q17, 15);
    int32_t longer_q28 = fixed_clamp(longer_q26, -LONGER_MAX_Q26, LONGER_MAX_Q26) * 4;
    int32_t s2_q22 = node->sums.s2_q22;
    *residual++ -= product(longer_q28, s2_q22, 26);
    int32_t p_q17 = longer_q28 >> 11;
    int32_t b_q14 = (x->pulled_q25 + y->pulled_q25) >> 11;
    int32_t more_b_q14 = b_q14 + (((b_q14 >> 1) * (KAPPA_Q14 - (1 << 14))) >> 13);
    int32_t f1_q12 = node->sums.f1_q12;
    int32_t as1_q22 = scaled_by(node->sums.s1_q25, at->amplitude_q13, 16);
    int32_t ps3_q22 = (node->sums.s3_q8 * p_q17) >> 3;
    int32_t radial_q13 = rounded(as1_q22 + ps3_q22 + ((f1_q12 * b_q14) >> 4), 9);
    int32_t flat_q22 = as1_q22 + 3 * ps3_q22 + ((f1_q12 * more_b_q14) >> 3);
    int32_t bend_q20 = scaled_by(s2_q22, at->amplitude_q13, 15) +
                       whole_product(node->sums.s4_q14, longer_q28, 22) +
                       product(node->sums.f2_q22, more_b_q14 * (1 << 11), 27);
    int32_t wider_q22 = whole_product(x->half_square_q24 + y->half_square_q24, bend_q20, 22);
    node->column[SPREAD] = rounded(wider_q22 - flat_q22, 8);
    int32_t s2_q8 = rounded(s2_q22, 14), f0_q14 = node->sums.f0_q14;
    int32_t along_x_q25 =
        s2_q8 * (x->along_x_q17 + y->along_x_q17) + ((f0_q14 * at->pull_x_q13) >> 2);
    int32_t along_y_q25 =
        s2_q8 * (x->along_y_q17 + y->along_y_q17) + ((f0_q14 * at->pull_y_q13) >> 2);
    node->column[PLACE_X] = rounded(radial_q13 * x->d_q12 - along_x_q25, 11);
    node->column[PLACE_Y] = rounded(radial_q13 * y->d_q12 - along_y_q25, 11);
    y++;
  } while (++node != end);
}

/* Takes from the residuals what is the sensors' own. A sensor that is off by o and feels all wider
 * by b reads what the model has at d + o - b d, so that the columns of the place tell how much more
 * it is. */
NOINLINE static void take_own(const struct problem *problem, const struct offset *x,
                              const struct offset *y, struct fit_tangential_room *room) {
  const int32_t pitch_q12 = problem->pad->pitch_q26 >> (26 - PLACE_Q);
  const uint8_t *sensor = problem->sensor;
  const int32_t *column = room->node[0].column;
  int32_t *residual = room->residual;
  for (int i = 0; i < COLUMNS; i++) {
    const int32_t x_q12 = x[i].d_q12;
    const struct offset *along = y;
    for (int32_t *end = residual + ROWS; residual != end; column += UNKNOWNS, along++) {
      const struct fit_own *own = &problem->own[*sensor++];
      int32_t wider_q15 = own->wider_q15;
      int32_t more_x_q12 = (wider_q15 * x_q12 - own->off_x_q15 * pitch_q12) >> 15;
      int32_t more_y_q12 = (wider_q15 * along->d_q12 - own->off_y_q15 * pitch_q12) >> 15;
      *residual++ -= (column[PLACE_X] >> 2) * more_x_q12 + (column[PLACE_Y] >> 2) * more_y_q12;
    }
  }
}

/* The columns of the unknowns that the model is linear in; that of the amplitude is s0. */
NOINLINE static void set_still(const struct offset *x, const struct offset *y,
                               union fit_tangential_node *node) {
  const union fit_tangential_node *end = node + ROWS;
  do {
    int32_t s2_q22 = node->sums.s2_q22, f0_q14 = node->sums.f0_q14;
    node->column[STRETCH] =
        rounded(product(x->half_square_q24 - y->half_square_q24, s2_q22, 27), 5);
    node->column[SLANT] = rounded(product(x->d_q12 * y->d_q12, s2_q22, 27), 5);
    node->column[PULL_X] = rounded(f0_q14 * x->d_q12, 10);
    node->column[PULL_Y] = rounded(f0_q14 * y->d_q12, 10);
    y++;
  } while (++node != end);
}

NOINLINE static void linearise(const struct problem *problem,
                               const struct fit_tangential_unknowns *at,
                               struct fit_tangential_room *room) {
  const struct fit_pad *pad = problem->pad;
  struct offset off_x[COLUMNS], off_y[ROWS];
  struct term terms[FIT_TANGENTIAL_TERMS];
  const struct parabola axes[2] = {
      {fixed_mul_q26(at->x_q26, at->x_q26), fixed_mul_q26(at->x_q26, pad->pitch_q26)},
      {fixed_mul_q26(at->y_q26, at->y_q26), fixed_mul_q26(at->y_q26, pad->pitch_q26)}};
  const struct origin origin = {
      at->x_q26 >> (26 - PLACE_Q),          at->y_q26 >> (26 - PLACE_Q),
      at->amplitude_q24 >> (24 - HEIGHT_Q), at->pull_x_q24 >> (24 - HEIGHT_Q),
      at->pull_y_q24 >> (24 - HEIGHT_Q),    at->e1_q26 >> (26 - LONG_Q),
      at->e2_q26 >> (26 - LONG_Q)};
  int32_t pitch_q12 = pad->pitch_q26 >> (26 - PLACE_Q);
  for (int i = 0; i < COLUMNS; i++) {
    set_offset((i - COLUMNS / 2) * pitch_q12 - origin.x_q12, origin.pull_x_q13, origin.e1_q17,
               origin.e1_q17, origin.e2_q17, &off_x[i]);
  }
  for (int k = 0; k < ROWS; k++) {
    set_offset((k - ROWS / 2) * pitch_q12 - origin.y_q12, origin.pull_y_q13, origin.e1_q17,
               origin.e2_q17, -origin.e1_q17, &off_y[k]);
  }
  int32_t wider_q26 = fixed_mul_16(at->t_q26, KAPPA_Q14) * 4;
  for (int j = 0; j < FIT_TANGENTIAL_TERMS; j++) {
    set_term(pad, j, j < PAD_NORMAL_TERMS ? at->t_q26 : wider_q26, axes, &terms[j]);
  }
  for (int i = 0; i < COLUMNS; i++) {
    set_terms(problem, terms, i, &off_x[i], off_y, origin.amplitude_q13, room);
  }
  set_sums(terms, room->node);
  if (problem->dip_share_q16 != 0) {
    take_dip(problem, terms, axes, origin.amplitude_q13, room);
  }
  for (int i = 0; i < COLUMNS; i++) {
    union fit_tangential_node *node = &room->node[i * ROWS];
    set_moving(&off_x[i], off_y, &origin, node, &room->residual[i * ROWS]);
    set_still(&off_x[i], off_y, node);
  }
  if (problem->own) {
    take_own(problem, off_x, off_y, room);
  }
}

/* The rows that priors add: of SPREAD, STRETCH and SLANT, each alone in its own. */
struct priors {
  int32_t row_q26[UNKNOWNS];
  int32_t residual[UNKNOWNS]; /* Q24, then as the residuals */
};

static void set_priors(const struct problem *problem, const struct fit_tangential_unknowns *at,
                       struct priors *priors) {
  memset(priors, 0, sizeof *priors);
  priors->row_q26[SPREAD] = problem->spread_prior_q26;
  priors->row_q26[STRETCH] = priors->row_q26[SLANT] = problem->long_prior_q26;
  priors->residual[SPREAD] =
      fixed_mul_q28(problem->pad->spread_q26 - at->t_q26, problem->spread_prior_q26);
  priors->residual[STRETCH] = fixed_mul_q28(-at->e1_q26, problem->long_prior_q26);
  priors->residual[SLANT] = fixed_mul_q28(-at->e2_q26, problem->long_prior_q26);
}

/* Brings residuals to 14 bits; returns their Q less one. */
NOINLINE static int32_t normalise_residuals(int32_t *residual, struct priors *priors) {
  uint32_t largest = 1;
  for (int k = 0; k < NODES; k++) {
    largest |= fixed_size(residual[k]);
  }
  for (int u = SPREAD; u <= SLANT; u++) {
    largest |= fixed_size(priors->residual[u]);
  }
  /* What rounding carries over counts as a bit more. */
  int32_t shift = fixed_bits(largest + (largest >> 8)) - 14;
  int32_t down = shift > 0 ? shift : 0, up = shift < 0 ? -shift : 0;
  int32_t half = (1 << down) >> 1;
  for (int k = 0; k < NODES; k++) {
    residual[k] = ((residual[k] + half) >> down) * (1 << up);
  }
  for (int u = SPREAD; u <= SLANT; u++) {
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
  do {
    largest |=
        fixed_size(column[0]) | fixed_size(column[UNKNOWNS]) | fixed_size(column[2 * UNKNOWNS]);
    column += 3 * UNKNOWNS;
  } while (column != end);
  return largest;
}

/* Divides a column by 2^shift; gives its square sum, and adds its products with the residuals. */
NOINLINE static int32_t shift_column(int32_t *column, const int32_t *residual, int32_t shift,
                                     int32_t *right) {
  const int32_t *end = residual + NODES;
  int32_t own = 0, other = *right, half = (1 << shift) >> 1;
  do {
    _Pragma("GCC unroll 3") for (int k = 0; k < 3; k++) {
      int32_t value = (column[k * UNKNOWNS] + half) >> shift;
      column[k * UNKNOWNS] = value;
      other += value * residual[k];
      own += value * value;
    }
    column += 3 * UNKNOWNS;
    residual += 3;
  } while (residual != end);
  *right = other;
  return own;
}
_Static_assert(NODES % 3 == 0, "three at a time");

/* Brings a column to 13 bits at most, and its prior with it. */
NOINLINE static void normalise_column(struct fit_tangential_room *room, int u, int32_t prior_q26,
                                      int32_t prior_residual, struct equations *equations) {
  int32_t *column = &room->node[0].column[u];
  int32_t q = column_q[u];
  uint32_t largest = column_size(column, fixed_size(prior_q26) >> (26 - q));
  int32_t shift = fixed_bits(largest + (largest >> 8)) - 13;
  shift = shift < 0 ? 0 : shift; /* fewer bits of a column so small, which is no pad's */
  q -= shift;
  int32_t row = shifted(prior_q26, q - 26);
  int32_t right = row * prior_residual;
  int32_t own = shift_column(column, room->residual, shift, &right) + row * row;
  int32_t scale = (30 - fixed_bits((uint32_t)own)) >> 1;
  scale = scale > 2 ? 2 : scale;
  equations->scale[u] = scale;
  equations->column_q[u] = q + scale;
  equations->right_q26[u] = right >> (5 - scale);
  room->matrix[u][u] = own * (1 << (2 * scale));
}

/* Every pair of the first seven unknowns is a, a + 1, a + 2 or a + 3 modulo 7 of one a. */
_Static_assert(UNKNOWNS == 8, "every pair is in one of these");
#define SUM_PRODUCTS(a)                                                                            \
  NOINLINE static void sum_products_##a(const int32_t *column, int32_t *sums) {                    \
    fixed_sum_products(column, column + NODES * UNKNOWNS, sums, UNKNOWNS, (a), ((a) + 1) % 7,      \
                       ((a) + 2) % 7, ((a) + 3) % 7);                                              \
  }
SUM_PRODUCTS(0)
SUM_PRODUCTS(1)
SUM_PRODUCTS(2)
SUM_PRODUCTS(3)
SUM_PRODUCTS(4)
SUM_PRODUCTS(5)
SUM_PRODUCTS(6)

static void form(struct fit_tangential_room *room, const int32_t *scale) {
  static void (*const sum[UNKNOWNS - 1])(const int32_t *, int32_t *) = {
      sum_products_0, sum_products_1, sum_products_2, sum_products_3,
      sum_products_4, sum_products_5, sum_products_6};
  for (int a = 0; a < UNKNOWNS - 1; a++) {
    int32_t sums[4];
    sum[a](room->node[0].column, sums);
    int32_t up = scale[a];
    for (int k = 0, b = a; k < 3; k++) {
      b = b == UNKNOWNS - 2 ? 0 : b + 1;
      room->matrix[a > b ? a : b][a > b ? b : a] = sums[k] * (1 << (up + scale[b]));
    }
    room->matrix[UNKNOWNS - 1][a] = sums[3] * (1 << (up + scale[UNKNOWNS - 1]));
  }
}

/* One step's normal equations, solved. L D L^T in place, with a power of two for each pivot between
 * the factors, 2^half about 1 / sqrt(pivot), so that both have all of their 16 bits: below the
 * diagonal L / 2^half, Q14; above it D L 2^half, Q15. A direction whose pivot is below PIVOT_LEAST
 * takes no step. */
struct solution {
  int32_t step_q20[UNKNOWNS]; /* of the normalised columns */
  int32_t half[UNKNOWNS];
  int32_t inverse_q13[UNKNOWNS]; /* of pivot 4^half, 1 to 4 */
  int32_t explained_q30;         /* what the step takes from the square sum of the residuals */
};

#define STEP_MAX_Q20 (1 << 26)

/* a - b modulo 2^32: rounding may take what a matrix that is nearly singular leaves anywhere. */
FIXED_INLINE int32_t less(int32_t a, uint32_t b) {
  return (int32_t)((uint32_t)a - b);
}

/* Takes from column j of the matrix what the unknowns before j explain. */
FIXED_INLINE void reduce(int32_t matrix[UNKNOWNS][UNKNOWNS], int j) {
  int32_t *row = matrix[UNKNOWNS - 1];
  do {
    uint32_t sum = 0;
    _Pragma("GCC unroll 8") for (int k = 0; k < j; k++) {
      sum += (uint32_t)(row[k] * matrix[k][j]);
    }
    row[j] = less(row[j], sum << 1);
    row -= UNKNOWNS;
  } while (row != matrix[j - 1]);
}

NOINLINE static void take_pivot(int32_t matrix[UNKNOWNS][UNKNOWNS], int32_t j, int32_t right_q26,
                                int32_t *y_q26, struct solution *solution) {
  int32_t *own = matrix[j];
  uint32_t known = 0;
  for (int32_t k = 0; k < j; k++) {
    known += (uint32_t)scaled_by(y_q26[k], own[k], 14);
  }
  int32_t y = fixed_clamp(less(right_q26, known), -(1 << 26), 1 << 26);
  int32_t pivot = own[j];
  if (pivot < PIVOT_LEAST) {
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
  int32_t *column = own + j;
  for (int32_t i = j + 1; i < UNKNOWNS; i++) {
    column += UNKNOWNS;
    int32_t element = fixed_clamp((*column + round) >> down, -INT16_MAX, INT16_MAX);
    own[i] = element;
    *column = rounded(element * inverse, 15 - odd);
  }
  int32_t z_q20 = shifted(fixed_mul_16(y, inverse), up - 4);
  solution->step_q20[j] = z_q20 = fixed_clamp(z_q20, -STEP_MAX_Q20, STEP_MAX_Q20);
  solution->half[j] = half;
  solution->inverse_q13[j] = (inverse << odd) >> 1;
  solution->explained_q30 += (y >> 11) * (fixed_clamp(z_q20, -(1 << 20), 1 << 20) >> 5);
  y_q26[j] = shifted(y, half);
}

NOINLINE static void solve(int32_t matrix[UNKNOWNS][UNKNOWNS], const int32_t *right_q26,
                           struct solution *solution) {
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

/* What the last step leaves for judging it. */
struct outcome {
  struct solution solution;
  int32_t column_q[UNKNOWNS]; /* a column's integer is its value times 2^q */
  struct scaled misfit;       /* chi^2 in units of the base's square */
  bool at_bound;
  int32_t length_q14; /* see take_step */
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

/* Three quarters of a pitch beyond the outer nodes, for an even number of them beyond those on the
 * origin's far side too. */
static int32_t reach(const struct fit_pad *pad, int32_t nodes) {
  return (4 * (nodes / 2) + 3) * (pad->pitch_q26 >> 2);
}

/* Returns how long the step is, Q14 of the longest that is taken. */
NOINLINE static int32_t take_step(const struct problem *problem, const struct outcome *outcome,
                                  int32_t residual_q, struct fit_tangential_unknowns *at,
                                  bool *at_bound) {
  const struct fit_pad *pad = problem->pad;
  int32_t move[UNKNOWNS];
  for (int u = 0; u < UNKNOWNS; u++) {
    int32_t q = u == AMPLITUDE || u >= PULL_X ? 24 : 26;
    move[u] = shifted(outcome->solution.step_q20[u], outcome->column_q[u] - residual_q - 20 + q);
  }
  int32_t narrow = pad->variance_q26[0] + at->t_q26;
  int32_t most = 0;
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
  at->x_q26 =
      clamp_told(at->x_q26 + move[PLACE_X], -reach(pad, COLUMNS), reach(pad, COLUMNS), at_bound);
  at->y_q26 = clamp_told(at->y_q26 + move[PLACE_Y], -reach(pad, ROWS), reach(pad, ROWS), at_bound);
  at->amplitude_q24 =
      clamp_told(at->amplitude_q24 + move[AMPLITUDE], 1 << 16, AMPLITUDE_MAX_Q24, at_bound);
  at->pull_x_q24 = clamp_told(at->pull_x_q24 + move[PULL_X], -PULL_MAX_Q24, PULL_MAX_Q24, at_bound);
  at->pull_y_q24 = clamp_told(at->pull_y_q24 + move[PULL_Y], -PULL_MAX_Q24, PULL_MAX_Q24, at_bound);
  at->t_q26 = fixed_clamp(at->t_q26 + move[SPREAD], spread_least(pad), SPREAD_MOST_Q26);
  at->e1_q26 = clamp_told(at->e1_q26 + move[STRETCH], -LONG_MAX_Q26, LONG_MAX_Q26, at_bound);
  at->e2_q26 = clamp_told(at->e2_q26 + move[SLANT], -LONG_MAX_Q26, LONG_MAX_Q26, at_bound);
  return most;
}

static void improve(const struct problem *problem, struct fit_tangential_unknowns *at,
                    struct fit_tangential_room *room, struct outcome *outcome) {
  struct priors priors;
  struct equations equations;
  linearise(problem, at, room);
  set_priors(problem, at, &priors);
  int32_t residual_q = normalise_residuals(room->residual, &priors);
  for (int u = 0; u < UNKNOWNS; u++) {
    normalise_column(room, u, priors.row_q26[u], priors.residual[u], &equations);
    outcome->column_q[u] = equations.column_q[u];
  }
  form(room, equations.scale);
  solve(room->matrix, equations.right_q26, &outcome->solution);
  int32_t squares = -outcome->solution.explained_q30;
  for (int k = 0; k < NODES; k++) {
    squares += (room->residual[k] * room->residual[k]) >> 2;
  }
  for (int u = SPREAD; u <= SLANT; u++) {
    squares += (priors.residual[u] * priors.residual[u]) >> 2;
  }
  outcome->misfit = fit_scaled_from(squares > 0 ? squares : 0, -2 * residual_q);
  outcome->length_q14 = take_step(problem, outcome, residual_q, at, &outcome->at_bound);
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
  int32_t base = fixed_longer_leg(noise, ((largest_q28 >> 14) * MODEL_SD_Q16) >> 8);
  int sensors = 0;
  int32_t squares_q12 = 0;
  for (int k = 0; k < NODES; k++) {
    uint8_t sensor = array->grid.sensor[k];
    room->weight_q12[k] = 0;
    if (used >> sensor & 1) {
      uint32_t size = fixed_size(readings->q14[k]);
      int32_t gain = (int32_t)((uint32_t)settings->gain_sd_q16[sensor] * size >> 8);
      int32_t weight_q12 = port_divide(base << 8, fixed_longer_leg(base, gain) >> 4);
      room->weight_q12[k] = weight_q12;
      squares_q12 += (weight_q12 * weight_q12) >> 12;
      sensors++;
    }
  }
  problem->by_gains_q12 = sensors > 0 ? (1 << 12) - port_divide(squares_q12, sensors) : 0;
  problem->base_q22 = base;
  problem->noise_q22 = noise;
  return sensors >= FIT_TANGENTIAL_SENSORS;
}

/* What the Gaussian says of the unknowns. */
NOINLINE static void set_from_fit(const struct fit_pad *pad, const struct fit_result *fit,
                                  int32_t shift, struct fit_tangential_unknowns *at) {
  at->x_q26 = product(fit_fixed(fit->x_mm, 24) - pad->origin_x_q24_mm, pad->per_unit_q30, 28);
  at->y_q26 = product(fit_fixed(fit->y_mm, 24) - pad->origin_y_q24_mm, pad->per_unit_q30, 28);
  at->x_q26 = fixed_clamp(at->x_q26, -reach(pad, COLUMNS), reach(pad, COLUMNS));
  at->y_q26 = fixed_clamp(at->y_q26, -reach(pad, ROWS), reach(pad, ROWS));
  int32_t sigma_q26 = product(fit_fixed(fit->sigma_mm, 24), pad->per_unit_q30, 28);
  sigma_q26 = fixed_clamp(sigma_q26, 0, 2 * ONE_Q26);
  at->t_q26 = fixed_clamp(fixed_mul_q26(sigma_q26, sigma_q26) - GAUSSIAN_VARIANCE_Q26,
                          spread_least(pad), SPREAD_MOST_Q26);
  at->e1_q26 = at->e2_q26 = at->pull_x_q24 = at->pull_y_q24 = 0;
  struct scaled amplitude = scaled_mul(fit_grid_scaled(fit->force_N), pad->per_force);
  amplitude.exponent += shift - 18;
  at->amplitude_q24 = fixed_clamp(fit_scaled_to_fixed(amplitude, 24), 1 << 18, AMPLITUDE_MAX_Q24);
}

static int32_t sum_of(const struct readings *readings) {
  int32_t sum_q20 = 0;
  for (int k = 0; k < NODES; k++) {
    sum_q20 += readings->q28[k] >> 8;
  }
  return sum_q20;
}

/* Of 2^bits. */
static int32_t to_multiple(int32_t value, int bits) {
  return rounded(value, bits) * (1 << bits);
}

static int32_t in_proportion(int32_t value, int32_t share_q13, int32_t most) {
  return fixed_clamp(scaled_by(value, share_q13, 13), -most, most);
}

/* Where the estimate begins: at the Gaussian's, or where the last frame's ended, moved as the
 * Gaussian has moved, unless its noise may have done that, and in proportion to the readings. */
NOINLINE static void begin(const struct fit_pad *pad, struct fit_tangential_state *state,
                           const struct fit_tangential_unknowns *fit, int32_t noise_q26,
                           int32_t sum_q20) {
  struct fit_tangential_unknowns *at = &state->at;
  int32_t before = state->sum_q20;
  int32_t dx_q26 = fit->x_q26 - state->fit_x_q26, dy_q26 = fit->y_q26 - state->fit_y_q26;
  uint32_t moved_q26 = fixed_size(dx_q26) + fixed_size(dy_q26);
  bool other = sum_q20 < SUM_LEAST_Q20 || before < SUM_LEAST_Q20 || sum_q20 >> 2 >= before ||
               before >> 2 >= sum_q20;
  if (state->steps == 0 || other) {
    *at = *fit;
  } else {
    if (moved_q26 > (uint32_t)noise_q26 * MOVED_NOISES) {
      at->x_q26 = fixed_clamp(at->x_q26 + dx_q26, -reach(pad, COLUMNS), reach(pad, COLUMNS));
      at->y_q26 = fixed_clamp(at->y_q26 + dy_q26, -reach(pad, ROWS), reach(pad, ROWS));
    }
    int32_t share_q13 = fixed_clamp(port_divide(sum_q20, before >> 13), 0, INT16_MAX);
    at->amplitude_q24 = in_proportion(at->amplitude_q24, share_q13, AMPLITUDE_MAX_Q24);
    at->amplitude_q24 = fixed_clamp(at->amplitude_q24, 1 << 16, AMPLITUDE_MAX_Q24);
    at->pull_x_q24 = in_proportion(at->pull_x_q24, share_q13, PULL_MAX_Q24);
    at->pull_y_q24 = in_proportion(at->pull_y_q24, share_q13, PULL_MAX_Q24);
    at->e1_q26 = in_proportion(at->e1_q26, share_q13, LONG_MAX_Q26);
    at->e2_q26 = in_proportion(at->e2_q26, share_q13, LONG_MAX_Q26);
  }
  if (other || moved_q26 > JUMP_Q26) {
    state->steps = 0;
  }
  at->x_q26 = to_multiple(at->x_q26, 26 - PLACE_Q);
  at->y_q26 = to_multiple(at->y_q26, 26 - PLACE_Q);
  at->amplitude_q24 = to_multiple(at->amplitude_q24, 24 - HEIGHT_Q);
  at->pull_x_q24 = to_multiple(at->pull_x_q24, 24 - HEIGHT_Q);
  at->pull_y_q24 = to_multiple(at->pull_y_q24, 24 - HEIGHT_Q);
  at->e1_q26 = to_multiple(at->e1_q26, 26 - LONG_Q);
  at->e2_q26 = to_multiple(at->e2_q26, 26 - LONG_Q);
  state->fit_x_q26 = fit->x_q26;
  state->fit_y_q26 = fit->y_q26;
  state->sum_q20 = sum_q20;
}

/* Variance of an unknown, in its unit squared, of readings whose variance is 1: an element of the
 * diagonal of the inverse matrix. with_pull_q8: the element of the row for this pull, or NULL. */
static struct scaled variance_of(const struct fit_tangential_room *room,
                                 const struct outcome *outcome, int u, int pull,
                                 int32_t *with_pull_q8) {
  const struct solution *solution = &outcome->solution;
  int32_t w_q8[UNKNOWNS]; /* row of the inverse of L, times 2^half */
  int32_t sum_q11 = 0;
  for (int k = u; k < UNKNOWNS; k++) {
    int32_t w = k == u ? 1 << 8 : 0;
    for (int m = u; m < k; m++) {
      // cppcheck-suppress uninitvar ; m < k, and the rounds before have set those
      w -= (room->matrix[k][m] * w_q8[m]) >> 14;
    }
    w_q8[k] = w = fixed_clamp(shifted(w, solution->half[k]), -INT16_MAX, INT16_MAX);
    sum_q11 += (((w * w) >> 9) * (solution->inverse_q13[k] >> 6)) >> 3;
  }
  if (with_pull_q8) {
    *with_pull_q8 = w_q8[pull];
  }
  return fit_scaled_from(sum_q11, 2 * outcome->column_q[u] - 30 - 11);
}

/* How far the place moves for a change of Q / F along the same axis, if the other unknowns follow:
 * from its row of the inverse of L, 2^half of it. length: with the amplitude. */
static int32_t moved_q20(const struct outcome *outcome, struct scaled length, int axis,
                         int32_t with_pull_q8) {
  int32_t q = outcome->column_q[PLACE_X + axis] - outcome->column_q[PULL_X + axis] -
              outcome->solution.half[PULL_X + axis] - 8;
  return shifted(with_pull_q8 * length.mantissa, q + length.exponent + 20);
}

static bool exceeds(struct scaled a, struct scaled b) {
  return scaled_sub(a, b).mantissa > 0;
}

/* square: e1^2 + e2^2; round: A v. variance: of a reading of weight 1. */
static bool is_elongated(const struct fit_tangential_room *room, const struct outcome *outcome,
                         struct scaled square, struct scaled round, struct scaled variance) {
  const struct scaled least = {(int32_t)(ELONGATED_LEAST * ELONGATED_LEAST * 8388608.0f), -23};
  if (!exceeds(square, scaled_mul(least, scaled_mul(round, round)))) {
    return false;
  }
  const struct scaled sure = {(int32_t)(ELONGATED_SURE * ELONGATED_SURE * 2048.0f), -12};
  struct scaled twice = scaled_add(variance_of(room, outcome, STRETCH, 0, NULL),
                                   variance_of(room, outcome, SLANT, 0, NULL));
  return exceeds(square, scaled_mul(sure, scaled_mul(twice, variance)));
}

static float composed(struct scaled value) {
  return fit_float(value.mantissa, value.exponent);
}

static struct scaled root_of_product(struct scaled a, struct scaled b) {
  return fit_scaled_sqrt(scaled_mul(a, b));
}

NOINLINE static void conclude(const struct problem *problem,
                              const struct fit_tangential_unknowns *at,
                              const struct outcome *outcome, struct fit_tangential *result) {
  const struct fit_pad *pad = problem->pad;
  const struct fit_tangential_room *room = &pad->room;
  struct scaled base = fit_scaled_from(problem->base_q22, -22);
  struct scaled variance = scaled_mul(base, base);
  struct scaled chi_square = scaled_div(outcome->misfit, variance);
  if (outcome->at_bound || fit_scaled_to_fixed(chi_square, 16) > pad->chi_square_max << 16) {
    return;
  }
  struct scaled e1 = fit_scaled_from(at->e1_q26, -26), e2 = fit_scaled_from(at->e2_q26, -26);
  struct scaled square = scaled_add(scaled_mul(e1, e1), scaled_mul(e2, e2));
  struct scaled amplitude = fit_scaled_from(at->amplitude_q24, -24);
  struct scaled round =
      scaled_mul(amplitude, fit_scaled_from(ONE_Q26 / 4 + at->t_q26, -26)); /* A v */
  struct scaled longest = scaled_mul((struct scaled){pad->long_most_q15, -15}, round);
  longest = fit_scaled_short(longest);
  if (exceeds(square, scaled_mul(longest, longest))) {
    return;
  }
  chi_square.exponent -= MISFIT_SHIFT;
  int32_t misfit_q16 = fit_scaled_to_fixed(chi_square, 16);
  misfit_q16 = misfit_q16 < MISFIT_LEAST_Q16 ? MISFIT_LEAST_Q16 : misfit_q16;
  if (misfit_q16 < 1 << 16) {
    misfit_q16 += (((1 << 16) - misfit_q16) * problem->by_gains_q12) >> (12 + GAINS_SHIFT);
  }
  variance = scaled_mul(variance, fit_scaled_from(misfit_q16, -16));
  variance = fit_scaled_short(scaled_mul(variance, pad->thin));
  int32_t x_q8, y_q8;
  struct scaled pulls = scaled_add(variance_of(room, outcome, PULL_X, 0, NULL),
                                   variance_of(room, outcome, PULL_Y, 0, NULL));
  pulls.exponent -= 1;
  struct scaled place = scaled_add(variance_of(room, outcome, PLACE_X, PULL_X, &x_q8),
                                   variance_of(room, outcome, PLACE_Y, PULL_Y, &y_q8));
  struct scaled pull_sd = root_of_product(pulls, variance);
  const struct scaled most = {(int32_t)(FIT_TANGENTIAL_SD_MAX * 32768.0f), -15};
  if (exceeds(pull_sd, scaled_mul(most, amplitude))) {
    return;
  }
  int32_t exponent = pad->force_unit.exponent + 18 - problem->readings.shift;
  int32_t unit_q30 = pad->force_unit.mantissa;
  struct scaled unit = fit_scaled_from(unit_q30, exponent);
  struct scaled length = {pad->unit_q25_mm >> 15, -10};
  result->valid = true;
  result->x_mm = fit_float(product(at->x_q26, pad->unit_q25_mm, 27) + pad->origin_x_q24_mm, -24);
  result->y_mm = fit_float(product(at->y_q26, pad->unit_q25_mm, 27) + pad->origin_y_q24_mm, -24);
  result->force_N = fit_float(product(at->amplitude_q24 * 16, unit_q30, 32), exponent + 4);
  result->qx_N = fit_float(product(at->pull_x_q24 * 32, unit_q30, 32), exponent + 3);
  result->qy_N = fit_float(product(at->pull_y_q24 * 32, unit_q30, 32), exponent + 3);
  result->q_sd_N = composed(scaled_mul(unit, pull_sd));
  result->location_sd_mm = composed(scaled_mul(length, root_of_product(place, variance)));
  struct scaled noise = fit_scaled_from(problem->noise_q22, -22);
  result->location_noise_mm =
      composed(scaled_mul(length, root_of_product(place, scaled_mul(noise, noise))));
  struct scaled height = variance_of(room, outcome, AMPLITUDE, 0, NULL);
  result->force_sd_N = composed(scaled_mul(unit, root_of_product(height, variance)));
  struct scaled moved = scaled_mul(length, amplitude);
  result->moved_q20_mm[0] = moved_q20(outcome, moved, 0, x_q8);
  result->moved_q20_mm[1] = moved_q20(outcome, moved, 1, y_q8);
  result->elongated = is_elongated(room, outcome, square, round, variance);
}

/* What a calibration knows of the pad. */
static void set_known(const struct fit_array *array, const struct fit_settings *settings,
                      struct problem *problem) {
  problem->own = settings->own;
  problem->sensor = array->grid.sensor;
  problem->dip_share_q16 = 0;
  if (fit_has_dip(settings)) {
    int32_t sd_q20 = fixed_mul_q30(fit_fixed(settings->dip_sd_mm, 20), problem->pad->per_unit_q30);
    int32_t sd_q13 = fixed_clamp(sd_q20 >> 7, DIP_SD_LEAST_Q13, DIP_SD_MOST_Q13);
    problem->dip_share_q16 = fit_fixed(settings->dip_share, 16);
    problem->dip_bend_q22 = fixed_div_q26(LOG2E_HALF_Q26 >> 4, sd_q13 * sd_q13);
  }
}

static int32_t prior_row(int32_t base_q22, int32_t sd_q26) {
  int32_t base_q26 = base_q22 * 16;
  return base_q26 / 2 >= sd_q26 ? 2 * ONE_Q26 : fixed_div_q26(base_q26, sd_q26) | 1;
}

void fit_tangential_load(const struct fit_array *array, struct fit_pad *pad,
                         const int32_t *pressure_Pa_q10, const struct fit_settings *settings,
                         const struct fit_result *fit, struct fit_tangential_state *state,
                         struct fit_tangential *result) {
  *result = (struct fit_tangential){0};
  struct problem problem;
  problem.pad = pad;
  set_known(array, settings, &problem);
  struct fit_settings of_readings = *settings;
  of_readings.dip_share = 0.0f; /* readings without room for a dip */
  if (!(fit->flags & CONTACT_FLAG_FIT_VALID) || settings->noise_Pa_q10 < 1 ||
      !fit_grid_take_readings(array, pressure_Pa_q10, fit->used, &of_readings, &problem.readings) ||
      !weigh(array, settings, fit->used, &problem, &pad->room)) {
    state->steps = 0;
    return;
  }
  struct fit_tangential_unknowns said;
  struct outcome outcome;
  set_from_fit(pad, fit, problem.readings.shift, &said);
  begin(pad, state, &said,
        product(fixed_clamp(fit_fixed(fit->location_noise_mm, 24), 0, 1 << 28), pad->per_unit_q30,
                28),
        sum_of(&problem.readings));
  int32_t long_sd_q26 = fixed_mul_q28(said.amplitude_q24 * 4, pad->long_sd_q26) * 4;
  problem.spread_prior_q26 = prior_row(problem.base_q22, pad->spread_sd_q26);
  problem.long_prior_q26 = prior_row(problem.base_q22, long_sd_q26);
  improve(&problem, &state->at, &pad->room, &outcome);
  if (state->steps < STEPS_TOLD) {
    state->steps++;
  }
  if (state->steps == STEPS_TOLD && outcome.length_q14 <= LENGTH_TOLD_Q14) {
    conclude(&problem, &state->at, &outcome, result);
  }
  state->untold = result->valid ? 0 : state->untold + 1;
  if (state->untold == UNTOLD_MOST) {
    *state = (struct fit_tangential_state){0};
  }
}
