#include "common/contact_flags.h"
#include "fit/fit_limits.h"
#include "fit/fit_math.h"
#include "fit/fit_shapes_parts.h"

#include <string.h>

#define MODEL_SD_Q16 131 /* 0.002 of the largest reading */
/* Readings whose errors are more than 3 % of their unit determine no shape. */
#define BASE_MAX_Q22 (1 << 17)
/* Frames of a contact, from 1. The tangential force joins the line once that has settled. Later every other frame answers, the next steps.
 */
#define FIRST_WITH_FORCE 10
#define FIRST_ANSWER FIT_SHAPES_FRAMES
#define LAST_FRAME (FIRST_ANSWER + 1)
/* The best of the models explains nothing if its chi^2 is above that. */
#define CHI_SQUARE_MAX 100

static const uint8_t unknowns_of[MODELS] = {BALANCE, UNKNOWNS, TANGENTIAL_Y};

static int32_t place_q20(const struct fit_shapes_pad *pad, float mm) {
  return fixed_mul_q28(fixed_clamp(fit_fixed(mm, 20), -(1 << 29), 1 << 29), pad->per_pitch_q28);
}

/* What a calibration knows of the pad. */
static NOINLINE void set_known(const struct fit_array *array, const struct fit_settings *settings, struct fit_shapes_pad *pad) {
  struct fit_shapes_frame *frame = &pad->work.frame;
  frame->has_deviations = settings->deviations != NULL;
  for (int k = 0; frame->has_deviations && k < NODES; k++) {
    pad->work.deviations[k] = settings->deviations[array->grid.sensor[k]];
  }
  frame->dip_share_q16 = 0;
  if (fit_has_dip(settings)) {
    float sd = settings->dip_sd_mm * pad->per_pitch;
    frame->dip_share_q16 = fit_fixed(settings->dip_share, 16);
    frame->dip_k_q24 = fit_fixed(LOG2E_HALF_FLOAT / (sd > 0.5f ? sd * sd : 0.25f), 24);
  }
}

/* The models move and grow as the Gaussian does. Of what it is not the model, its place is unsure: what that explains is no movement. */
static void follow(const struct fit_shapes_pad *pad, const struct fit_result *fit, struct fit_shapes_state *state, int32_t sum_q20) {
  int32_t x = place_q20(pad, fit->x_mm) - pad->origin_x_q20;
  int32_t y = place_q20(pad, fit->y_mm) - pad->origin_y_q20;
  if (state->frames > 0 && fit_is_another_contact(sum_q20, state->sum_q20)) {
    state->frames = 0;
  }
  if (state->frames > 0) {
    int32_t dx_q20 = x - state->fit_x_q20, dy_q20 = y - state->fit_y_q20;
    int32_t sd_q20 = place_q20(pad, fit->location_sd_mm);
    if (fixed_hypot((int32_t)fixed_magnitude(dx_q20), (int32_t)fixed_magnitude(dy_q20)) <= sd_q20) {
      dx_q20 = dy_q20 = 0;
    }
    int32_t share_q13 = fixed_clamp(port_divide(sum_q20, state->sum_q20 >> 13), 0, INT16_MAX);
    for (int m = 0; m < MODELS; m++) {
      int32_t *value = state->at[m].value;
      value[AMPLITUDE] = shifted(fixed_mul_16(value[AMPLITUDE], share_q13), 3);
      value[AMPLITUDE] = fixed_clamp(value[AMPLITUDE], AMPLITUDE_MIN, AMPLITUDE_MAX);
      value[LOCATION_X] += dx_q20;
      value[LOCATION_Y] += dy_q20;
      value[LOCATION_X] =
          fixed_clamp(value[LOCATION_X], MIDDLE_OF(COLUMNS) - LOCATION_MAX_OF(COLUMNS), MIDDLE_OF(COLUMNS) + LOCATION_MAX_OF(COLUMNS));
      value[LOCATION_Y] = fixed_clamp(value[LOCATION_Y], MIDDLE_OF(ROWS) - LOCATION_MAX_OF(ROWS), MIDDLE_OF(ROWS) + LOCATION_MAX_OF(ROWS));
      for (int u = m == ROUND ? SPAN_X : TANGENTIAL_X; m != TWO && u < unknowns_of[m]; u++) {
        value[u] = shifted(fixed_mul_16(value[u], share_q13), 3);
      }
    }
  }
  state->fit_x_q20 = x;
  state->fit_y_q20 = y;
  state->sum_q20 = sum_q20;
}

static void set_residuals(struct fit_shapes_pad *pad, int model, struct fit_shapes_state *state, struct priors *priors) {
  struct fit_shapes_equations *equations = &pad->work.equations[model];
  const bool early = model == LONG && state->frames < FIRST_WITH_FORCE;
  struct fit_shapes_at *at = &state->at[model];
  fit_shapes_round_locations(at);
  fit_shapes_set_rows(pad, model, early ? BALANCE : unknowns_of[model], at, equations);
  fit_shapes_form_residuals(pad, at->value, priors, equations);
  state->chi_square_q8[model] = fit_shapes_chi_square(pad, equations);
}

static void advance(struct fit_shapes_pad *pad, int model, struct fit_shapes_state *state) {
  struct priors priors;
  set_residuals(pad, model, state, &priors);
  if (state->frames == FIRST_ANSWER) {
    fit_shapes_factorise(pad, model, &priors, &state->at[model]);
  } else {
    fit_shapes_step(pad, model, &priors, &state->at[model]);
  }
}

static enum fit_shapes_progress forget(struct fit_shapes_state *state, struct fit_shapes_result *result) {
  state->part = state->frames = 0;
  *result = (struct fit_shapes_result){0};
  return FIT_SHAPES_ANSWERED;
}

static enum fit_shapes_progress answer(const struct fit_shapes_pad *pad, struct fit_shapes_state *state, struct fit_shapes_result *result) {
  int best = fit_shapes_best(state->chi_square_q8, state->at);
  *result = (struct fit_shapes_result){0};
  for (int m = 0; m < MODELS; m++) {
    result->chi_square[m] = fit_float(state->chi_square_q8[m], -8);
  }
  if (state->chi_square_q8[best] > CHI_SQUARE_MAX << 8) {
    result->shape = FIT_SHAPE_NONE;
    state->frames = 0;
  } else {
    fit_shapes_conclude(pad, best, state->chi_square_q8, state, result);
  }
  return FIT_SHAPES_ANSWERED;
}

/* What all parts of a frame need. */
static bool take(const struct fit_array *array, const int32_t *pressure_Pa_q10, const struct fit_settings *settings,
                 const struct fit_result *fit, struct fit_shapes_pad *pad) {
  struct fit_shapes_frame *frame = &pad->work.frame;
  struct readings readings;
  struct fit_base base;
  if (!(fit->flags & CONTACT_FLAG_FIT_VALID) || settings->noise_Pa_q10 < 1 ||
      !fit_grid_take_readings(array, pressure_Pa_q10, fit->used, settings, &readings) ||
      fit_grid_weigh(array, settings, fit->used, &readings, 1 << 18, MODEL_SD_Q16, pad->work.weight_q12, &base) < FIT_SHAPES_SENSORS ||
      base.base_q22 > BASE_MAX_Q22) {
    return false;
  }
  frame->base_q22 = base.base_q22;
  frame->shift = readings.shift;
  memcpy(frame->q28, readings.q28, sizeof frame->q28);
  memcpy(frame->q14, readings.q14, sizeof frame->q14);
  set_known(array, settings, pad);
  return true;
}

enum fit_shapes_progress fit_shapes_part(const struct fit_array *array, struct fit_shapes_pad *pad, const int32_t *pressure_Pa_q10,
                                         const struct fit_settings *settings, const struct fit_result *fit, struct fit_shapes_state *state,
                                         struct fit_shapes_result *result) {
  fit_use_rectangle(&array->grid);
  const bool first = state->part == 0;
  if (first && !take(array, pressure_Pa_q10, settings, fit, pad)) {
    return forget(state, result);
  }
  if (first) {
    follow(pad, fit, state, fit_grid_sum_q20(pad->work.frame.q28));
  }
  if (state->frames == 0) {
    if (state->part++ == 0) {
      fit_shapes_begin(pad, fit, state);
      return FIT_SHAPES_UNFINISHED;
    }
    fit_shapes_begin_pair(pad, state);
    forget(state, result);
    state->frames = 1;
    return FIT_SHAPES_ANSWERED;
  }
  if (first) {
    state->frames = state->frames == LAST_FRAME ? FIRST_ANSWER : state->frames + 1;
  }
  /* The answer costs as much as two parts, so the shortest is the last. */
  advance(pad, MODELS - 1 - state->part, state);
  if (++state->part < FIT_SHAPES_PARTS) {
    return FIT_SHAPES_UNFINISHED;
  }
  state->part = 0;
  return state->frames == FIRST_ANSWER ? answer(pad, state, result) : FIT_SHAPES_STEPPED;
}

bool fit_shapes(const struct fit_array *array, struct fit_shapes_pad *pad, const int32_t *pressure_Pa_q10,
                const struct fit_settings *settings, const struct fit_result *fit, struct fit_shapes_state *state,
                struct fit_shapes_result *result) {
  enum fit_shapes_progress progress;
  do {
    progress = fit_shapes_part(array, pad, pressure_Pa_q10, settings, fit, state, result);
  } while (progress == FIT_SHAPES_UNFINISHED);
  return progress == FIT_SHAPES_ANSWERED;
}
