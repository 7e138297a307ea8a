#include "common/contact_flags.h"
#include "fit/fit_limits.h"
#include "fit/fit_math.h"
#include "fit/fit_shapes_parts.h"

#define MODEL_SD_Q16 131 /* 0.002 of the largest reading */
/* Readings whose errors are more than 3 % of their unit tell no shapes. */
#define BASE_MAX_Q22 (1 << 17)
/* Of the diagonal: what readings hardly tell moves slowly from the first guess. The matrix that
 * answers has hardly any, since it would hide how little they tell from the standard deviations. */
#define DAMPING_SHIFT 6
#define LAST_DAMPING_SHIFT 10
#define LOG2E_HALF_FLOAT 0.72134752f
/* Frames of a contact, counted from 1. The load joins its model once the line has settled: both at
 * once lose their way at the border. After the last frame, which steps only, comes the first that
 * answers. */
#define FIRST_WITH_LOAD 10
#define FIRST_ANSWER FIT_SHAPES_FRAMES
#define LAST_FRAME (FIRST_ANSWER + 3)
/* The best of the models explains nothing if its chi^2 is above that. */
#define CHI_SQUARE_MAX 100

static const uint8_t unknowns_of[MODELS] = {SPAN_X, UNKNOWNS, PULL_Y};

static NOINLINE bool weigh(const struct fit_array *array, const struct fit_settings *settings,
                           uint32_t used, struct problem *problem) {
  const struct readings *readings = &problem->readings;
  int32_t noise = fixed_clamp(shifted(settings->noise_Pa_q10, readings->shift - 6), 1, 1 << 18);
  problem->base_q22 = fixed_longer_leg(noise, ((readings->largest_q28 >> 14) * MODEL_SD_Q16) >> 8);
  int sensors = 0;
  for (int k = 0; k < NODES; k++) {
    uint8_t sensor = array->grid.sensor[k];
    problem->pad->room.weight_q12[k] = 0;
    if (used >> sensor & 1) {
      int32_t gain =
          (int32_t)((uint32_t)settings->gain_sd_q16[sensor] * fixed_size(readings->q14[k]) >> 8);
      problem->pad->room.weight_q12[k] =
          port_divide(problem->base_q22 << 8, fixed_longer_leg(problem->base_q22, gain) >> 4);
      sensors++;
    }
  }
  return sensors >= FIT_SHAPES_SENSORS && problem->base_q22 <= BASE_MAX_Q22;
}

static int32_t sum_of(const struct readings *readings) {
  int32_t sum_q20 = 0;
  for (int k = 0; k < NODES; k++) {
    sum_q20 += readings->q28[k] >> 8;
  }
  return sum_q20;
}

static int32_t place_q20(const struct fit_shapes_pad *pad, float mm) {
  return fixed_mul_q28(fixed_clamp(fit_fixed(mm, 20), -(1 << 29), 1 << 29), pad->per_pitch_q28);
}

/* What a calibration knows of the pad. */
static void set_known(const struct fit_array *array, const struct fit_settings *settings,
                      struct problem *problem) {
  problem->own = NULL;
  if (settings->own) {
    struct fit_own *own = problem->pad->room.own;
    problem->own = own;
    for (int k = 0; k < NODES; k++) {
      own[k] = settings->own[array->grid.sensor[k]];
    }
  }
  problem->dip_share_q16 = 0;
  problem->dip_k_q24 = 1 << 24;
  if (fit_has_dip(settings)) {
    float sd = settings->dip_sd_mm * problem->pad->per_pitch;
    problem->dip_share_q16 = fit_fixed(settings->dip_share, 16);
    problem->dip_k_q24 = fit_fixed(LOG2E_HALF_FLOAT / (sd > 0.5f ? sd * sd : 0.25f), 24);
  }
}

static void follow(const struct problem *problem, const struct fit_result *fit,
                   struct fit_shapes_state *state, int32_t sum_q20) {
  const struct fit_shapes_pad *pad = problem->pad;
  int32_t x = place_q20(pad, fit->x_mm) - pad->origin_x_q20;
  int32_t y = place_q20(pad, fit->y_mm) - pad->origin_y_q20;
  if (state->frames > 0 && (sum_q20 < 1 << 18 || state->sum_q20 < 1 << 18 ||
                            sum_q20 >> 2 >= state->sum_q20 || state->sum_q20 >> 2 >= sum_q20)) {
    state->frames = 0;
  }
  if (state->frames > 0) {
    int32_t share_q13 = fixed_clamp(port_divide(sum_q20, state->sum_q20 >> 13), 0, INT16_MAX);
    for (int m = 0; m < MODELS; m++) {
      int32_t *value = state->at[m].value;
      value[AMPLITUDE] = shifted(fixed_mul_16(value[AMPLITUDE], share_q13), 3);
      value[AMPLITUDE] = fixed_clamp(value[AMPLITUDE], AMPLITUDE_LEAST, AMPLITUDE_MAX);
      value[PLACE_X] += x - state->fit_x_q20;
      value[PLACE_Y] += y - state->fit_y_q20;
      value[PLACE_X] = fixed_clamp(value[PLACE_X], -PLACE_X_MAX, PLACE_X_MAX);
      value[PLACE_Y] = fixed_clamp(value[PLACE_Y], -PLACE_Y_MAX, PLACE_Y_MAX);
      if (m == LONG) {
        value[PULL_X] = shifted(fixed_mul_16(value[PULL_X], share_q13), 3);
        value[PULL_Y] = shifted(fixed_mul_16(value[PULL_Y], share_q13), 3);
      }
    }
  }
  state->fit_x_q20 = x;
  state->fit_y_q20 = y;
  state->sum_q20 = sum_q20;
}

static void set_residuals(const struct problem *problem, int model, struct fit_shapes_state *state,
                          struct priors *priors) {
  struct fit_shapes_equations *equations = &problem->pad->room.equations[model];
  const bool early = model == LONG && state->frames < FIRST_WITH_LOAD;
  struct fit_shapes_at *at = &state->at[model];
  fit_shapes_round_places(at);
  fit_shapes_set_rows(problem, model, early ? BALANCE : unknowns_of[model], at, equations);
  fit_shapes_form_residuals(problem, at->value, priors, equations);
  priors->damping_shift = state->frames < FIRST_ANSWER ? DAMPING_SHIFT : LAST_DAMPING_SHIFT;
  state->chi_square_q8[model] = fit_shapes_chi_square(problem, equations);
}

static void advance(const struct problem *problem, int model, struct fit_shapes_state *state) {
  struct priors priors;
  set_residuals(problem, model, state, &priors);
  fit_shapes_step(problem->pad, model, &priors, &state->at[model]);
}

static enum fit_shapes_progress finish(const struct problem *problem,
                                       struct fit_shapes_state *state,
                                       struct fit_shapes_result *result) {
  struct priors priors;
  set_residuals(problem, ROUND, state, &priors);
  if (state->frames < FIRST_ANSWER || state->frames == LAST_FRAME) {
    fit_shapes_step(problem->pad, ROUND, &priors, &state->at[ROUND]);
    return FIT_SHAPES_STEPPED;
  }
  int best = fit_shapes_best(state->chi_square_q8, state->at[TWO].value);
  *result = (struct fit_shapes_result){0};
  for (int m = 0; m < MODELS; m++) {
    result->chi_square[m] = fit_float(state->chi_square_q8[m], -8);
  }
  if (state->chi_square_q8[best] > CHI_SQUARE_MAX << 8) {
    result->shape = FIT_SHAPE_NONE;
    state->frames = 0;
    return FIT_SHAPES_ANSWERED;
  }
  if (best == ROUND) {
    fit_shapes_step(problem->pad, ROUND, &priors, &state->at[ROUND]);
  }
  fit_shapes_conclude(problem, best, state->chi_square_q8, state, result);
  return FIT_SHAPES_ANSWERED;
}

static enum fit_shapes_progress forget(struct fit_shapes_state *state,
                                       struct fit_shapes_result *result) {
  state->part = state->frames = 0;
  *result = (struct fit_shapes_result){0};
  return FIT_SHAPES_ANSWERED;
}

static bool take(const struct fit_array *array, const int32_t *pressure_Pa_q10,
                 const struct fit_settings *settings, const struct fit_result *fit,
                 struct problem *problem) {
  if (!(fit->flags & CONTACT_FLAG_FIT_VALID) || settings->noise_Pa_q10 < 1 ||
      !fit_grid_take_readings(array, pressure_Pa_q10, fit->used, settings, &problem->readings) ||
      !weigh(array, settings, fit->used, problem)) {
    return false;
  }
  set_known(array, settings, problem);
  return true;
}

static enum fit_shapes_progress do_part(const struct problem *problem, const struct fit_result *fit,
                                        struct fit_shapes_state *state,
                                        struct fit_shapes_result *result) {
  if (state->part == 0) {
    follow(problem, fit, state, sum_of(&problem->readings));
  }
  if (state->frames == 0) {
    fit_shapes_begin(problem, fit, state->part, state);
    if (++state->part < BEGIN_PARTS) {
      return FIT_SHAPES_UNFINISHED;
    }
    forget(state, result);
    state->frames = 1;
    return FIT_SHAPES_ANSWERED;
  }
  if (state->part == 0) {
    state->frames = state->frames == LAST_FRAME ? FIRST_ANSWER : state->frames + 1;
  }
  if (state->part == FIT_SHAPES_PARTS - 1) {
    state->part = 0;
    return finish(problem, state, result);
  }
  advance(problem, state->part == 0 ? LONG : TWO, state);
  state->part++;
  return FIT_SHAPES_UNFINISHED;
}

enum fit_shapes_progress fit_shapes_part(const struct fit_array *array, struct fit_shapes_pad *pad,
                                         const int32_t *pressure_Pa_q10,
                                         const struct fit_settings *settings,
                                         const struct fit_result *fit,
                                         struct fit_shapes_state *state,
                                         struct fit_shapes_result *result) {
  struct problem problem;
  problem.pad = pad;
  return take(array, pressure_Pa_q10, settings, fit, &problem)
             ? do_part(&problem, fit, state, result)
             : forget(state, result);
}

bool fit_shapes(const struct fit_array *array, struct fit_shapes_pad *pad,
                const int32_t *pressure_Pa_q10, const struct fit_settings *settings,
                const struct fit_result *fit, struct fit_shapes_state *state,
                struct fit_shapes_result *result) {
  struct problem problem;
  problem.pad = pad;
  if (!take(array, pressure_Pa_q10, settings, fit, &problem)) {
    return forget(state, result) == FIT_SHAPES_ANSWERED;
  }
  enum fit_shapes_progress progress;
  do {
    progress = do_part(&problem, fit, state, result);
  } while (progress == FIT_SHAPES_UNFINISHED);
  return progress == FIT_SHAPES_ANSWERED;
}
