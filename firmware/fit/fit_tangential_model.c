/* The model at the sensors: residuals and Jacobian. */
#include "fit/fit_tangential_parts.h"

/* 1.3: the tangential force of an object that sticks is larger at its rim than its pressure there. */
#define KAPPA_Q14 21299

const uint8_t fit_tangential_column_q[UNKNOWNS] = {14, 14, 14, 14, 14, 14, 16, 16};

/* Where a step begins, rounded. */
struct origin {
  int32_t x_q12, y_q12, amplitude_q13, tangential_x_q13, tangential_y_q13, e1_q17, e2_q17;
};

/* Offset of the sensors from the contact along one axis, and the parts of the model that depend on it alone. */
struct offset {
  int32_t d_q12, half_square_q24;
  int32_t tangential_q25;           /* B d */
  int32_t longer_q26;               /* e1 d^2 / 2 */
  int32_t along_x_q17, along_y_q17; /* in x e1 d and e2 d, in y e2 d and -e1 d */
};

FIXED_INLINE void set_offset(int32_t d_q12, int32_t tangential_q13, int32_t e1_q17, int32_t by_x_q17, int32_t by_y_q17,
                             struct offset *off) {
  off->d_q12 = d_q12;
  off->half_square_q24 = (d_q12 * d_q12) >> 1;
  off->tangential_q25 = d_q12 * tangential_q13;
  off->longer_q26 = scaled_by(off->half_square_q24, e1_q17, 15);
  off->along_x_q17 = rounded(d_q12 * by_x_q17, 12);
  off->along_y_q17 = rounded(d_q12 * by_y_q17, 12);
}

/* One term, strength V0 / v exp(-d' d / (2 v)). */
struct term {
  int32_t x_q28[MAX_COLUMNS]; /* with the strength */
  int32_t y_q30[MAX_ROWS];
  int32_t over_q11, over_square_q7; /* 1 / v, at most 16, and its square */
  int32_t height_q28;               /* the strength over v, or over v^2 */
};

/* d' d / (2 v) in Q22 and powers of 2, along one axis: bend (i pitch - place)^2, exactly a parabola in the node number, so that rounding
 * moves the location and width of the term, never the residual. */
struct parabola {
  int32_t square_q26, by_pitch_q26; /* place^2, place pitch */
};

#define Z_MIN_Q22 16 /* rounding takes no exponent below zero */

FIXED_INLINE void set_axis(int32_t bend, int32_t by_square, int32_t nodes, const struct parabola *axis, int32_t (*power)(uint32_t),
                           int down, int32_t *value) {
  uint32_t at_origin = (uint32_t)fixed_mul_q26(bend, axis->square_q26) + Z_MIN_Q22;
  int32_t slope = fixed_mul_q26(bend, axis->by_pitch_q26) * 2;
  for (int32_t k = 0, i = -(nodes / 2); k < nodes; k++, i++) {
    value[k] = power(at_origin + (uint32_t)i * ((uint32_t)(i * by_square) - (uint32_t)slope)) >> down;
  }
}

NOINLINE static void set_exponentials(int32_t bend_q26, int32_t by_square, int32_t nodes, const struct parabola *axis, int32_t *value_q30) {
  set_axis(bend_q26, by_square, nodes, axis, exp2_negative, 0, value_q30);
}

#define VARIANCE_MIN_Q26 (ONE_Q26 / 16)

NOINLINE static void set_term(const struct fit_pad *pad, int j, int32_t t_q26, const struct parabola *axes, struct term *term) {
  int32_t v = pad->variance_q26[j] + t_q26;
  int32_t inverse_q22 = fixed_div_q26(1 << 22, v < VARIANCE_MIN_Q26 ? VARIANCE_MIN_Q26 : v); /* 1 / v */
  int32_t height_q24 = fixed_mul_q26(inverse_q22, pad->strength_q26[j]);                     /* V0 / v of it, V0 1/4 */
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

/* The residuals of five nodes but for P s2, and the terms there with the weight, for set_sums. */
NOINLINE static void set_terms(const struct problem *problem, const struct term *terms, int i, const struct offset *x,
                               const struct offset *y, int32_t amplitude_q13, struct fit_tangential_work *work) {
  for (int k = 0, n = i * ROWS; k < ROWS; k++, n++, y++) {
    struct fit_tangential_terms *found = &work->node[n].terms;
    int32_t weight_q12 = work->weight_q12[n];
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
    int32_t model_q24 = (scaled_by(s0_q28, amplitude_q13, 16) >> 1) + whole_product(x->tangential_q25 + y->tangential_q25, f0_q28 * 2, 30);
    work->residual[n] = scaled_by((problem->readings.q28[n] >> 4) - model_q24, weight_q12, 12);
  }
}

/* struct fit_tangential_sums of every node, of its terms. What is multiplied by little has few bits. */
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

/* The dip's Gaussian along an axis within 0.3 %. */
NOINLINE static void set_dip_axis(int32_t bend_q22, int32_t by_square, int32_t nodes, const struct parabola *axis, int32_t *value_q15) {
  set_axis(bend_q22, by_square, nodes, axis, exp2_rough, 15, value_q15);
}

#define DIP_VARIANCE_MIN_Q26 (ONE_Q26 / 8)

/* Subtracts the dip from the model: one more term, which the contact's spread widens as the others. Elongations are not in it. */
NOINLINE static void remove_dip(const struct problem *problem, int32_t t_q26, const struct parabola *axes, int32_t amplitude_q13,
                                struct fit_tangential_work *work) {
  int32_t x_q15[MAX_COLUMNS], y_q15[MAX_ROWS];
  int32_t v = problem->dip_variance_q26 + t_q26;
  int32_t inverse_q26 = fixed_div_q26(ONE_Q26, v < DIP_VARIANCE_MIN_Q26 ? DIP_VARIANCE_MIN_Q26 : v); /* 1 / v */
  int32_t bend_q22 = fixed_mul_q26(inverse_q26 >> 4, LOG2E_HALF_Q26);
  int32_t by_square = fixed_mul_q26(bend_q22, problem->pad->pitch_square_q26);
  set_dip_axis(bend_q22, by_square, COLUMNS, &axes[0], x_q15);
  set_dip_axis(bend_q22, by_square, ROWS, &axes[1], y_q15);
  int32_t depth_q22 = fixed_clamp(fixed_mul_q26(problem->dip_q22, inverse_q26), 0, (1 << 20) - 1);
  int32_t first_q22 = fixed_mul_q26(depth_q22, inverse_q26);
  int32_t depth_q17 = depth_q22 >> 5, first_q15 = first_q22 >> 7;
  int32_t second_q12 = fixed_mul_q26(first_q22, inverse_q26) >> 10;
  int32_t lack_q16 = (depth_q17 * amplitude_q13) >> 14; /* with the amplitude */
  const int32_t *weight_q12 = work->weight_q12;
  int32_t *residual = work->residual;
  union fit_tangential_node *node = work->node;
  for (int i = 0; i < COLUMNS; i++) {
    for (int k = 0; k < ROWS; k++, node++) {
      int32_t bell_q15 = (((x_q15[i] * y_q15[k]) >> 15) * *weight_q12++) >> 12;
      node->sums.s0_q14 -= (bell_q15 * depth_q17) >> 18;
      node->sums.s1_q25 -= (bell_q15 * first_q15) >> 5;
      node->sums.s2_q22 -= (bell_q15 * second_q12) >> 5;
      *residual++ += (bell_q15 * lack_q16) >> 7;
    }
  }
}

/* Ends the residuals of five nodes and sets their columns of the place and the spread. With d = (dx, dy), r2 = d' d and b = Bx dx + By dy:
 *   m     = A s0 + P s2 + b f0,     P = e1 (dx^2 - dy^2) / 2 + e2 dx dy
 *   dm/dx = dx (A s1 + P s3 + b f1) - (e1 dx + e2 dy) s2 - Bx f0
 *   dm/dt = r2 / 2 (A s2 + P s4 + KAPPA b f2) - (A s1 + 3 P s3 + 2 KAPPA b f1)
 * (e1 and e2 with the amplitude in them). */
NOINLINE static void set_shape_columns(const struct offset *x, const struct offset *y, const struct origin *at,
                                       union fit_tangential_node *node, int32_t *residual) {
  const union fit_tangential_node *end = node + ROWS;
  do {
    int32_t longer_q26 = x->longer_q26 - y->longer_q26 + scaled_by(x->d_q12 * y->d_q12, at->e2_q17, 15);
    int32_t longer_q28 = fixed_clamp(longer_q26, -LONGER_MAX_Q26, LONGER_MAX_Q26) * 4;
    int32_t s2_q22 = node->sums.s2_q22;
    *residual++ -= product(longer_q28, s2_q22, 26);
    int32_t p_q17 = longer_q28 >> 11;
    int32_t b_q14 = (x->tangential_q25 + y->tangential_q25) >> 11;
    int32_t more_b_q14 = b_q14 + (((b_q14 >> 1) * (KAPPA_Q14 - (1 << 14))) >> 13);
    int32_t f1_q12 = node->sums.f1_q12;
    int32_t as1_q22 = scaled_by(node->sums.s1_q25, at->amplitude_q13, 16);
    int32_t ps3_q22 = (node->sums.s3_q8 * p_q17) >> 3;
    int32_t radial_q13 = rounded(as1_q22 + ps3_q22 + ((f1_q12 * b_q14) >> 4), 9);
    int32_t flat_q22 = as1_q22 + 3 * ps3_q22 + ((f1_q12 * more_b_q14) >> 3);
    int32_t bend_q20 = scaled_by(s2_q22, at->amplitude_q13, 15) + whole_product(node->sums.s4_q14, longer_q28, 22) +
                       product(node->sums.f2_q22, more_b_q14 * (1 << 11), 27);
    int32_t wider_q22 = whole_product(x->half_square_q24 + y->half_square_q24, bend_q20, 22);
    node->column[SPREAD] = rounded(wider_q22 - flat_q22, 8);
    int32_t s2_q8 = rounded(s2_q22, 14), f0_q14 = node->sums.f0_q14;
    int32_t along_x_q25 = s2_q8 * (x->along_x_q17 + y->along_x_q17) + ((f0_q14 * at->tangential_x_q13) >> 2);
    int32_t along_y_q25 = s2_q8 * (x->along_y_q17 + y->along_y_q17) + ((f0_q14 * at->tangential_y_q13) >> 2);
    node->column[LOCATION_X] = rounded(radial_q13 * x->d_q12 - along_x_q25, 11);
    node->column[LOCATION_Y] = rounded(radial_q13 * y->d_q12 - along_y_q25, 11);
    y++;
  } while (++node != end);
}

/* Removes the sensors' deviations from the residuals. A sensor that is off by o and wider by b reads the model at d + o - b d; the columns
 * of the location give the difference. */
NOINLINE static void remove_deviations(const struct problem *problem, const struct offset *x, const struct offset *y,
                                       struct fit_tangential_work *work) {
  const int32_t pitch_q12 = problem->pad->pitch_q26 >> (26 - LOCATION_Q);
  const uint8_t *sensor = problem->sensor;
  const int32_t *column = work->node[0].column;
  int32_t *residual = work->residual;
  for (int i = 0; i < COLUMNS; i++) {
    const int32_t x_q12 = x[i].d_q12;
    const struct offset *along = y;
    for (int32_t *end = residual + ROWS; residual != end; column += UNKNOWNS, along++) {
      const struct fit_deviation *deviation = &problem->deviations[*sensor++];
      int32_t wider_q15 = deviation->wider_q15;
      int32_t more_x_q12 = (wider_q15 * x_q12 - deviation->off_x_q15 * pitch_q12) >> 15;
      int32_t more_y_q12 = (wider_q15 * along->d_q12 - deviation->off_y_q15 * pitch_q12) >> 15;
      *residual++ -= (column[LOCATION_X] >> 2) * more_x_q12 + (column[LOCATION_Y] >> 2) * more_y_q12;
    }
  }
}

/* The columns of the unknowns that the model is linear in; that of the amplitude is s0. */
NOINLINE static void set_linear_columns(const struct offset *x, const struct offset *y, union fit_tangential_node *node) {
  const union fit_tangential_node *end = node + ROWS;
  do {
    int32_t s2_q22 = node->sums.s2_q22, f0_q14 = node->sums.f0_q14;
    node->column[ELONGATION_1] = rounded(product(x->half_square_q24 - y->half_square_q24, s2_q22, 27), 5);
    node->column[ELONGATION_2] = rounded(product(x->d_q12 * y->d_q12, s2_q22, 27), 5);
    node->column[TANGENTIAL_X] = rounded(f0_q14 * x->d_q12, 10);
    node->column[TANGENTIAL_Y] = rounded(f0_q14 * y->d_q12, 10);
    y++;
  } while (++node != end);
}

void fit_tangential_linearise(const struct problem *problem, const struct fit_tangential_unknowns *at, struct fit_tangential_work *work) {
  const struct fit_pad *pad = problem->pad;
  struct offset off_x[MAX_COLUMNS], off_y[MAX_ROWS];
  struct term terms[FIT_TANGENTIAL_TERMS];
  const struct parabola axes[2] = {{fixed_mul_q26(at->x_q26, at->x_q26), fixed_mul_q26(at->x_q26, pad->pitch_q26)},
                                   {fixed_mul_q26(at->y_q26, at->y_q26), fixed_mul_q26(at->y_q26, pad->pitch_q26)}};
  const struct origin origin = {at->x_q26 >> (26 - LOCATION_Q),
                                at->y_q26 >> (26 - LOCATION_Q),
                                at->amplitude_q24 >> (24 - AMPLITUDE_Q),
                                at->tangential_x_q24 >> (24 - AMPLITUDE_Q),
                                at->tangential_y_q24 >> (24 - AMPLITUDE_Q),
                                at->e1_q26 >> (26 - ELONGATION_Q),
                                at->e2_q26 >> (26 - ELONGATION_Q)};
  int32_t pitch_q12 = pad->pitch_q26 >> (26 - LOCATION_Q);
  for (int i = 0; i < COLUMNS; i++) {
    set_offset((i - COLUMNS / 2) * pitch_q12 - origin.x_q12, origin.tangential_x_q13, origin.e1_q17, origin.e1_q17, origin.e2_q17,
               &off_x[i]);
  }
  for (int k = 0; k < ROWS; k++) {
    set_offset((k - ROWS / 2) * pitch_q12 - origin.y_q12, origin.tangential_y_q13, origin.e1_q17, origin.e2_q17, -origin.e1_q17, &off_y[k]);
  }
  int32_t wider_q26 = fixed_mul_16(at->t_q26, KAPPA_Q14) * 4;
  for (int j = 0; j < FIT_TANGENTIAL_TERMS; j++) {
    set_term(pad, j, j < PAD_NORMAL_TERMS ? at->t_q26 : wider_q26, axes, &terms[j]);
  }
  for (int i = 0; i < COLUMNS; i++) {
    set_terms(problem, terms, i, &off_x[i], off_y, origin.amplitude_q13, work);
  }
  set_sums(terms, work->node);
  if (problem->dip_q22 != 0) {
    remove_dip(problem, at->t_q26, axes, origin.amplitude_q13, work);
  }
  for (int i = 0; i < COLUMNS; i++) {
    union fit_tangential_node *node = &work->node[i * ROWS];
    set_shape_columns(&off_x[i], off_y, &origin, node, &work->residual[i * ROWS]);
    set_linear_columns(&off_x[i], off_y, node);
  }
  if (problem->deviations) {
    remove_deviations(problem, off_x, off_y, work);
  }
}
