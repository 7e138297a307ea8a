/* Internal to fit_shapes: the models, and what its files share.
 *
 * The models, lengths in pitches. A blob at d = (dx, dy) from its middle, t its contact's spread:
 *   s = sum_j share_j V / v_j exp(-d' d / (2 v_j)) - dip,    v_j = V_j + t,  V the widest V_j
 * and the response to a tangential force there:
 *   f = sum_j moment_j V / v_j^2 d exp(-d' d / (2 v_j)),     v_j = V_j + 1.3 t
 * A model is A sum_b w_b [s(d_b) + far exp(-d_b' d_b / (2 FAR V))] + B' f(d): blobs of weight w_b by lever_b span from the middle.
 *   round  one blob; the tangential force B takes the place of the span
 *   long   four, the nodes of Gauss's quadrature of a line from -span to span
 *   two    two, by +-span, of weight (1 +- balance) / 2
 * Forces are 2 pi V A and 2 pi V B. */
#pragma once

#include "fit/fit_grid_parts.h"
#include "fit/fit_shapes.h"

enum { ROUND, LONG, TWO, MODELS };
enum { AMPLITUDE, LOCATION_X, LOCATION_Y, SPREAD, FAR, SPAN_X, SPAN_Y, BALANCE, TANGENTIAL_X = 7, TANGENTIAL_Y };
#define UNKNOWNS FIT_SHAPES_UNKNOWNS
#define RESIDUAL UNKNOWNS
_Static_assert(TANGENTIAL_Y + 1 == UNKNOWNS, "a column for each");
_Static_assert(MODELS == FIT_SHAPES_PARTS, "a part for each");

#define ONE_Q20 (1 << 20)
#define DEGREES_OF_FREEDOM (NODES > 7 ? NODES - 6 : 1) /* readings and priors less the unknowns of two */
#define PER_SD_MAX_Q4 1024
#define LOG2E_HALF_FLOAT 0.72134752f

/* The middle of this number of nodes, from their origin; and one and a half pitches beyond the outer nodes, from there. */
#define MIDDLE_OF(nodes) ((nodes) % 2 ? 0 : -(ONE_Q20 / 2))
#define LOCATION_MAX_OF(nodes) (((nodes) + 2) * (ONE_Q20 / 2))
#define AMPLITUDE_MAX ((4 << 20) - 1)
#define AMPLITUDE_MIN (1 << 13)

/* Rows of one element each, and their residuals. */
struct priors {
  int32_t element_q27[UNKNOWNS], off_q28[UNKNOWNS];
};

/* The profile's terms at a spread: exponents, heights, and these over v and v^2. */
struct terms {
  int32_t k_q24[PAD_NORMAL_TERMS], h_q14[PAD_NORMAL_TERMS], q_q12[PAD_NORMAL_TERMS], s_q8[PAD_NORMAL_TERMS];
  int32_t tangential_k_q24[PAD_TANGENTIAL_TERMS], tangential_q12[PAD_TANGENTIAL_TERMS];
  int32_t dip_k_q24, dip_q14;
};

/* exp(-d^2 / (2 v)) along both axes; their products are the Gaussian at the nodes. */
struct axis_gaussians {
  int32_t x_q15[MAX_COLUMNS], y_q15[MAX_ROWS];
};

/* d^2 of the nodes along an axis. */
struct squares {
  int32_t x_q24[MAX_COLUMNS], y_q24[MAX_ROWS];
};

/* fit_shapes_model.c */
void fit_shapes_set_terms(const struct fit_shapes_pad *pad, int32_t t_q20, struct terms *terms);
void fit_shapes_set_squares(int32_t x_q12, int32_t y_q12, struct squares *squares);
void fit_shapes_set_gaussians(const struct squares *squares, int32_t k_q24, struct axis_gaussians *axis_gaussians);
/* Where a step begins is rounded, which moves the step and not where it ends. */
void fit_shapes_round_locations(struct fit_shapes_at *at);
/* The weighted rows of a model with this number of unknowns, columns Q27 and residual Q28. */
void fit_shapes_set_rows(struct fit_shapes_pad *pad, int model, int count, const struct fit_shapes_at *where,
                         struct fit_shapes_equations *equations);

/* Square of half a line, or of half the distance between two contacts, Q20. */
static inline int32_t fit_shapes_span_square(const int32_t *at) {
  int32_t x_q10 = at[SPAN_X] >> 10, y_q10 = at[SPAN_Y] >> 10;
  return x_q10 * x_q10 + y_q10 * y_q10;
}

/* fit_shapes_begin.c: all models by the Gaussian, and then the pair by the readings if that leaves less. */
void fit_shapes_begin(const struct fit_shapes_pad *pad, const struct fit_result *fit, struct fit_shapes_state *state);
void fit_shapes_begin_pair(struct fit_shapes_pad *pad, struct fit_shapes_state *state);

/* fit_shapes_step.c. The column of the residuals, and the sum of the squares with those of the priors; chi^2 of both,
 * Q8; and after these, of the model's rows, one damped step, or the factors of the matrix that answers. */
void fit_shapes_form_residuals(struct fit_shapes_pad *pad, const int32_t *at, struct priors *priors,
                               struct fit_shapes_equations *equations);
int32_t fit_shapes_chi_square(const struct fit_shapes_pad *pad, const struct fit_shapes_equations *equations);
void fit_shapes_step(struct fit_shapes_pad *pad, int model, const struct priors *priors, struct fit_shapes_at *at);
void fit_shapes_factorise(struct fit_shapes_pad *pad, int model, const struct priors *priors, const struct fit_shapes_at *at);

/* fit_shapes_answer.c. at: where each model is. */
int fit_shapes_best(const int32_t *chi_square_q8, const struct fit_shapes_at *at);
void fit_shapes_conclude(const struct fit_shapes_pad *pad, int best, const int32_t *chi_square_q8, const struct fit_shapes_state *state,
                         struct fit_shapes_result *result);
