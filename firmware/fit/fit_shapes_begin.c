/* Where the models start in the first frame of a contact. */
#include "common/contact_flags.h"
#include "fit/fit_math.h"
#include "fit/fit_shapes_parts.h"

#include <math.h>

/* A pair may start beyond the limits of a step. */
#define START_MAX (((COLUMNS > ROWS ? COLUMNS : ROWS) / 2 * 2 + 3) * (ONE_Q20 / 2))
static int32_t pitches_q20(float pitches) { return fixed_clamp(fit_fixed(pitches, 20), -START_MAX, START_MAX); }

/* Under the largest reading, and where it leaves most. */
static NOINLINE void set_pair_by_readings(const struct fit_shapes_pad *pad, struct fit_shapes_at *at) {
  const struct fit_shapes_frame *readings = &pad->work.frame;
  int first = 0, second = -1;
  int32_t most = 0;
  struct terms terms;
  fit_shapes_set_terms(pad, at->value[SPREAD], &terms);
  for (int k = 1; k < NODES; k++) {
    first = readings->q14[k] > readings->q14[first] ? k : first;
  }
  int32_t height_q14 = terms.h_q14[0] + terms.h_q14[1], peak_q14 = port_divide(readings->q14[first] << 14, height_q14);
  struct squares squares;
  struct axis_gaussians narrow, wide;
  fit_shapes_set_squares((first / ROWS - COLUMNS / 2) * 4096, (first % ROWS - ROWS / 2) * 4096, &squares);
  fit_shapes_set_gaussians(&squares, terms.k_q24[0], &narrow);
  fit_shapes_set_gaussians(&squares, terms.k_q24[1], &wide);
  for (int k = 0; k < NODES; k++) {
    int32_t e_q15 = (narrow.x_q15[k / ROWS] * narrow.y_q15[k % ROWS]) >> 15;
    int32_t wide_q15 = (wide.x_q15[k / ROWS] * wide.y_q15[k % ROWS]) >> 15;
    int32_t s_q14 = (terms.h_q14[0] * e_q15 + terms.h_q14[1] * wide_q15) >> 15;
    int32_t left = readings->q14[k] - ((peak_q14 * s_q14) >> 14);
    if (left > most) {
      most = left;
      second = k;
    }
  }
  if (second < 0) {
    return;
  }
  int32_t both = readings->q14[first] + most;
  at->value[AMPLITUDE] = fixed_clamp(port_divide(both << 14, height_q14), 0, AMPLITUDE_MAX >> 6) << 6;
  at->value[LOCATION_X] = (first / ROWS + second / ROWS - 2 * (COLUMNS / 2)) * (ONE_Q20 / 2);
  at->value[LOCATION_Y] = (first % ROWS + second % ROWS - 2 * (ROWS / 2)) * (ONE_Q20 / 2);
  at->value[SPAN_X] = (first / ROWS - second / ROWS) * (ONE_Q20 / 2);
  at->value[SPAN_Y] = (first % ROWS - second % ROWS) * (ONE_Q20 / 2);
  at->value[BALANCE] = port_divide((readings->q14[first] - most) << 14, both) << 6;
}

/* Sum of the squares of a pair's residuals, Q16: one with a good start has less. */
static NOINLINE int32_t residuals_at(struct fit_shapes_pad *pad, struct fit_shapes_at *at) {
  fit_shapes_round_locations(at);
  fit_shapes_set_rows(pad, TWO, SPAN_X, at, pad->work.equations);
  int32_t sum_q16 = 0;
  for (int k = 0; k < NODES; k++) {
    int32_t residual_q13 = pad->work.row[k][RESIDUAL] >> 15;
    sum_q16 += (residual_q13 * residual_q13) >> 10;
  }
  return sum_q16;
}

void fit_shapes_begin(const struct fit_shapes_pad *pad, const struct fit_result *fit, struct fit_shapes_state *state) {
  const float per = pad->per_pitch;
  struct fit_shapes_at at = {{0}};
  float variance = fit->sigma_mm * fit->sigma_mm * per * per;
  /* The longer axis: half the difference of its variance to the other's, and its direction. */
  float half = 0.0f, along_x = 1.0f, along_y = 0.0f;
  if (fit->flags & CONTACT_FLAG_WIDTHS_VALID) {
    float sx = fit->sigma_x_mm * per, sy = fit->sigma_y_mm * per;
    float difference = 0.5f * (sx * sx - sy * sy), slant = fit->width_correlation * sx * sy;
    half = sqrtf(difference * difference + slant * slant);
    if (half > 0.0f) {
      float cosine = difference / half;
      along_x = sqrtf(fmaxf(0.5f + 0.5f * cosine, 0.0f));
      along_y = sqrtf(fmaxf(0.5f - 0.5f * cosine, 0.0f));
      along_y = slant < 0.0f ? -along_y : along_y;
    }
  }
  float excess = fminf(fmaxf(2.0f * half, 0.05f), 2.5f);
  float widest = pad->widest_mm2 * per * per;
  float spread = fminf(fmaxf(variance - half - 0.912f * widest, 0.0f), 0.1f);
  float x = fit->x_mm * per - fit_float(pad->origin_x_q20, -20);
  float y = fit->y_mm * per - fit_float(pad->origin_y_q20, -20);
  struct scaled amplitude = fit_grid_scaled(fit->force_N / (1.0753f * pad->force_unit_N));
  amplitude.exponent += pad->work.frame.shift - 18;
  at.value[AMPLITUDE] = fixed_clamp(fit_scaled_to_fixed(amplitude, 20), AMPLITUDE_MIN, AMPLITUDE_MAX);
  at.value[SPREAD] = fit_fixed(spread, 20);
  at.value[LOCATION_X] = pitches_q20(x);
  at.value[LOCATION_Y] = pitches_q20(y);
  state->at[ROUND] = at;
  float reach = sqrtf(excess);
  float line = fminf(1.7320508f * reach, 1.4f);
  at.value[SPAN_X] = pitches_q20(line * along_x);
  at.value[SPAN_Y] = pitches_q20(line * along_y);
  state->at[LONG] = at;
  at.value[SPAN_X] = pitches_q20(reach * along_x);
  at.value[SPAN_Y] = pitches_q20(reach * along_y);
  state->at[TWO] = at;
}

void fit_shapes_begin_pair(struct fit_shapes_pad *pad, struct fit_shapes_state *state) {
  struct fit_shapes_at pair = state->at[LONG];
  set_pair_by_readings(pad, &pair);
  if (residuals_at(pad, &pair) < residuals_at(pad, &state->at[TWO])) {
    state->at[TWO] = pair;
  }
}
