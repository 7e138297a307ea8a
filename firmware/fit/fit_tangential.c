#include "fit/fit_tangential.h"

#include "common/contact_flags.h"
#include "fit/fit_limits.h"
#include "fit/fit_math.h"
#include "fit/fit_tangential_parts.h"

#define MODEL_SD_Q16 328 /* 0.005 of the largest reading; besides, what a known dip may be off by in its middle */
/* Prior of both elongations. */
#define ELONGATION_SD_mm2 4.0f

/* Factors of the stated variances by chi^2. NUMERICS.md has their reasons ("What the firmware does not report"). */
#define MISFIT_SHIFT 5              /* chi^2 / 32, by the coverage of calibrated pads */
#define MISFIT_MIN_Q16 1311         /* 0.02 */
#define MISFIT_MIN_OUTSIDE_Q16 4588 /* 0.07: there a contact's shape moves its place, and the readings hardly show it */

/* Thickness of a layer in units of length: the widest term's sd is 0.478 of the thickness. On layers thinner than
 * the pitch standard deviations grow as (pitch / thickness)^2 (NUMERICS.md). */
#define THICKNESS_PER_UNIT 1.0455f

/* An elongation beyond this share of the widest term's variance is no report; all are taken where a pad ends nearer
 * than NEAR_ENDS of its thickness, which makes round contacts look long (report shear, elongated_false_percent). */
#define ELONGATION_MAX_Q15 2294 /* 0.07: a lime of 45 by 55 mm has up to that */
#define NEAR_ENDS_MAX_Q15 8192
#define NEAR_ENDS 0.75f

/* Larger where the pad ends near, which leaves residuals. */
#define CHI_SQUARE_MAX 16
#define CHI_SQUARE_MAX_NEAR_ENDS 60

#define GAUSSIAN_VARIANCE_Q26 15300821 /* of the Gaussian that fits a point contact: 0.912 V0 */
#define GAUSSIAN_FORCE 1.0753f         /* its 2 pi p0 sigma^2 over the force */

/* Only a step of at most 0.2 of the longest is reported, since the estimate is off by some 0.1 mm after a longer one. */
#define STEPS_REPORTED 2
#define LENGTH_REPORTED_Q14 3277
#define JUMP_Q26 (ONE_Q26 / 2)
/* The Gaussian's place jitters more than the estimate's in the corners. */
#define MOVED_NOISES 4
/* Frames in a row without a report after which it starts again: one more than a contact at rest takes. */
#define UNREPORTED_MAX 6

#define DIP_SD_MIN_Q13 (1 << 11) /* the narrowest that a term may be */
#define DIP_SD_MAX_Q13 (1 << 15)

static int32_t q26_from(float value) { return (int32_t)(value * 67108864.0f); }

/* Limits of the formats. Layers need 1.3, 9.5 and 97 of the first three; pads of 5 to 20 mm a pitch of 0.47 to 1.88 units of 4.8 to 19.1
 * mm. */
#define SUM_MAX_0 1.9f
#define SUM_MAX_1 12.0f
#define SUM_MAX_2 112.0f
#define VARIANCE_MAX 7.0f
#define PITCH_MAX 1.9f
#define UNIT_MAX_mm 19.5f
#define FORCE_UNIT_Q 40 /* 2^25 .. 2^30 */

/* Whether the sums over these terms of strength V0 / v^i, i from first, stay below their limits for the most concentrated contact. */
static bool fits_formats(const struct fit_pad *pad, int from, int end, float t, bool pulls) {
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

enum ft_status fit_pad_init(struct fit_pad *pad, const struct fit_array *array, const struct pad_profile *profile) {
  float widest_mm = profile->normal[PAD_NORMAL_TERMS - 1].sd_mm;
  if (!fit_is_rectangle(array) || !pad_profile_is_valid(profile) || 2.0f * widest_mm > UNIT_MAX_mm ||
      array->pitch_mm > PITCH_MAX * 2.0f * widest_mm) {
    return FT_ERR_ARGUMENT;
  }
  int32_t pitch_q12 = (int32_t)(array->pitch_mm / (2.0f * widest_mm) * 4096.0f + 0.5f);
  float unit_mm = array->pitch_mm * 4096.0f / (float)pitch_q12;
  float per_unit = 1.0f / unit_mm;
  for (int j = 0; j < FIT_TANGENTIAL_TERMS; j++) {
    bool normal = j < PAD_NORMAL_TERMS;
    float sd_mm = normal ? profile->normal[j].sd_mm : profile->tangential[j - PAD_NORMAL_TERMS].sd_mm;
    float strength = normal ? profile->normal[j].share : profile->tangential[j - PAD_NORMAL_TERMS].moment_mm * per_unit;
    float sd = sd_mm * per_unit;
    if (sd * sd > VARIANCE_MAX || strength > VARIANCE_MAX) {
      return FT_ERR_ARGUMENT;
    }
    pad->variance_q26[j] = q26_from(sd * sd);
    pad->strength_q26[j] = q26_from(strength);
  }
  float per_square = per_unit * per_unit;
  fit_use_rectangle(&array->grid);
  uint8_t origin = array->grid.sensor[COLUMNS / 2 * ROWS + ROWS / 2];
  pad->unit_q25_mm = (int32_t)(unit_mm * 33554432.0f);
  pad->per_unit_q30 = (int32_t)(per_unit * 1073741824.0f);
  pad->origin_x_q24_mm = fit_fixed(array->x[origin] * array->pitch_mm, 24);
  pad->origin_y_q24_mm = fit_fixed(array->y[origin] * array->pitch_mm, 24);
  pad->pitch_q26 = pitch_q12 * (1 << (26 - LOCATION_Q));
  pad->pitch_square_q26 = fixed_mul_q26(pad->pitch_q26, pad->pitch_q26);
  float spread = profile->spread_mm2 * per_square, spread_sd = profile->spread_sd_mm2 * per_square;
  pad->spread_q26 = q26_from(spread < VARIANCE_MAX ? spread : VARIANCE_MAX);
  pad->spread_sd_q26 = q26_from(spread_sd < VARIANCE_MAX ? spread_sd : VARIANCE_MAX);
  pad->elongation_sd_q26 = q26_from(ELONGATION_SD_mm2 * per_square);
  float peak = 0.0f;
  for (int j = 0; j < PAD_NORMAL_TERMS; j++) {
    peak += (float)pad->strength_q26[j] * 0.25f / (float)(pad->variance_q26[j] + pad->spread_q26);
  }
  pad->peak_q26 = q26_from(peak);
  float least = (float)spread_min(pad) * (1.0f / 67108864.0f);
  if (!fits_formats(pad, 0, PAD_NORMAL_TERMS, least, false) ||
      !fits_formats(pad, PAD_NORMAL_TERMS, FIT_TANGENTIAL_TERMS, 1.3f * least, true)) {
    return FT_ERR_ARGUMENT;
  }
  float force_unit_N = 1.57079633e-6f * unit_mm * unit_mm; /* 2 pi V0, V0 = 1/4 */
  pad->force_unit = (struct scaled){fit_fixed(force_unit_N, FORCE_UNIT_Q), -FORCE_UNIT_Q};
  bool near_ends = profile->overhang_mm > 0.0f && profile->overhang_mm < NEAR_ENDS * profile->thickness_mm;
  pad->chi_square_max = near_ends ? CHI_SQUARE_MAX_NEAR_ENDS : CHI_SQUARE_MAX;
  pad->elongation_max_q15 = near_ends ? NEAR_ENDS_MAX_Q15 : ELONGATION_MAX_Q15;
  float thin = array->pitch_mm / (THICKNESS_PER_UNIT * unit_mm);
  thin *= thin;
  pad->thin = fit_grid_scaled(thin > 1.0f ? thin * thin : 1.0f);
  pad->per_force = fit_grid_scaled(1.0f / (GAUSSIAN_FORCE * force_unit_N));
  return FT_OK;
}

/* False: too few sensors. */
static bool weigh(const struct fit_array *array, const struct fit_settings *settings, sensor_map used, struct problem *problem,
                  struct fit_tangential_work *work) {
  int sensors =
      fit_grid_weigh(array, settings, used, &problem->readings, ONE_Q26 >> 5, problem->model_sd_q16, work->weight_q12, &problem->base);
  problem->by_gains_q12 = sensors > 0 ? (1 << 12) - port_divide(problem->base.squares_q12, sensors) : 0;
  return sensors >= FIT_TANGENTIAL_SENSORS;
}

/* The unknowns by the Gaussian. */
NOINLINE static void set_from_fit(const struct fit_pad *pad, const struct fit_result *fit, int32_t shift,
                                  struct fit_tangential_unknowns *at) {
  at->x_q26 = product(fit_fixed(fit->x_mm, 24) - pad->origin_x_q24_mm, pad->per_unit_q30, 28);
  at->y_q26 = product(fit_fixed(fit->y_mm, 24) - pad->origin_y_q24_mm, pad->per_unit_q30, 28);
  at->x_q26 = fixed_clamp(at->x_q26, -reach(pad, COLUMNS), reach(pad, COLUMNS));
  at->y_q26 = fixed_clamp(at->y_q26, -reach(pad, ROWS), reach(pad, ROWS));
  int32_t sigma_q26 = product(fit_fixed(fit->sigma_mm, 24), pad->per_unit_q30, 28);
  sigma_q26 = fixed_clamp(sigma_q26, 0, 2 * ONE_Q26);
  at->t_q26 = fixed_clamp(fixed_mul_q26(sigma_q26, sigma_q26) - GAUSSIAN_VARIANCE_Q26, spread_min(pad), SPREAD_MAX_Q26);
  at->e1_q26 = at->e2_q26 = at->tangential_x_q24 = at->tangential_y_q24 = 0;
  struct scaled amplitude = scaled_mul(fit_grid_scaled(fit->force_N), pad->per_force);
  amplitude.exponent += shift - 18;
  at->amplitude_q24 = fixed_clamp(fit_scaled_to_fixed(amplitude, 24), 1 << 18, AMPLITUDE_MAX_Q24);
}

/* To the nearest multiple of 2^bits. */
static int32_t round_to(int32_t value, int bits) { return rounded(value, bits) * (1 << bits); }

static int32_t scale_by(int32_t value, int32_t share_q13, int32_t most) {
  return fixed_clamp(scaled_by(value, share_q13, 13), -most, most);
}

/* Start of the step: the Gaussian's place in a new contact. Else the end of the frame before, scaled as the readings, and moved as the
 * Gaussian if that is more than its noise. */
NOINLINE static void begin(const struct fit_pad *pad, struct fit_tangential_state *state, const struct fit_tangential_unknowns *fit,
                           int32_t noise_q26, int32_t sum_q20) {
  struct fit_tangential_unknowns *at = &state->at;
  int32_t before = state->sum_q20;
  int32_t dx_q26 = fit->x_q26 - state->fit_x_q26, dy_q26 = fit->y_q26 - state->fit_y_q26;
  uint32_t moved_q26 = fixed_magnitude(dx_q26) + fixed_magnitude(dy_q26);
  bool other = fit_is_another_contact(sum_q20, before);
  if (state->steps == 0 || other) {
    *at = *fit;
  } else {
    if (moved_q26 > (uint32_t)noise_q26 * MOVED_NOISES) {
      at->x_q26 = fixed_clamp(at->x_q26 + dx_q26, -reach(pad, COLUMNS), reach(pad, COLUMNS));
      at->y_q26 = fixed_clamp(at->y_q26 + dy_q26, -reach(pad, ROWS), reach(pad, ROWS));
    }
    int32_t share_q13 = fixed_clamp(port_divide(sum_q20, before >> 13), 0, INT16_MAX);
    at->amplitude_q24 = scale_by(at->amplitude_q24, share_q13, AMPLITUDE_MAX_Q24);
    at->amplitude_q24 = fixed_clamp(at->amplitude_q24, 1 << 16, AMPLITUDE_MAX_Q24);
    at->tangential_x_q24 = scale_by(at->tangential_x_q24, share_q13, TANGENTIAL_MAX_Q24);
    at->tangential_y_q24 = scale_by(at->tangential_y_q24, share_q13, TANGENTIAL_MAX_Q24);
    at->e1_q26 = scale_by(at->e1_q26, share_q13, ELONGATION_MAX_Q26);
    at->e2_q26 = scale_by(at->e2_q26, share_q13, ELONGATION_MAX_Q26);
  }
  if (other || moved_q26 > JUMP_Q26) {
    state->steps = 0;
  }
  at->x_q26 = round_to(at->x_q26, 26 - LOCATION_Q);
  at->y_q26 = round_to(at->y_q26, 26 - LOCATION_Q);
  at->amplitude_q24 = round_to(at->amplitude_q24, 24 - AMPLITUDE_Q);
  at->tangential_x_q24 = round_to(at->tangential_x_q24, 24 - AMPLITUDE_Q);
  at->tangential_y_q24 = round_to(at->tangential_y_q24, 24 - AMPLITUDE_Q);
  at->e1_q26 = round_to(at->e1_q26, 26 - ELONGATION_Q);
  at->e2_q26 = round_to(at->e2_q26, 26 - ELONGATION_Q);
  state->fit_x_q26 = fit->x_q26;
  state->fit_y_q26 = fit->y_q26;
  state->sum_q20 = sum_q20;
}

/* Shift of the location per Q / F along the same axis, where the other unknowns follow; influence_q8: of variance_of. */
static int32_t shift_q20(const struct outcome *outcome, struct scaled length, int axis, int32_t influence_q8) {
  int32_t q =
      outcome->column_q[LOCATION_X + axis] - outcome->column_q[TANGENTIAL_X + axis] - outcome->solution.half[TANGENTIAL_X + axis] - 8;
  return shifted(influence_q8 * length.mantissa, q + length.exponent + 20);
}

static struct scaled root_of_product(struct scaled a, struct scaled b) { return fit_scaled_sqrt(scaled_mul(a, b)); }

/* 1: it is within a quarter of a pitch of the outer sensors, or beyond; else 0. */
FIXED_INLINE uint32_t is_outside(const struct fit_pad *pad, int32_t at_q26, int32_t nodes) {
  const int32_t from_middle_q26 = at_q26 + (nodes % 2 ? 0 : pad->pitch_q26 >> 1);
  return ((uint32_t)(2 * nodes - 3) * (uint32_t)(pad->pitch_q26 >> 2) - fixed_magnitude(from_middle_q26)) >> 31;
}

NOINLINE static void conclude(const struct problem *problem, const struct fit_tangential_unknowns *at, const struct outcome *outcome,
                              struct fit_tangential *result) {
  const struct fit_pad *pad = problem->pad;
  const struct fit_tangential_work *work = &pad->work;
  struct scaled base = fit_scaled_from(problem->base.base_q22, -22);
  struct scaled variance = scaled_mul(base, base);
  int32_t chi_square_q16 = fit_scaled_to_fixed(scaled_div(outcome->misfit, variance), 16);
  if (outcome->at_bound || chi_square_q16 > pad->chi_square_max << 16) {
    return;
  }
  struct scaled e1 = fit_scaled_from(at->e1_q26, -26), e2 = fit_scaled_from(at->e2_q26, -26);
  struct scaled square = scaled_add(scaled_mul(e1, e1), scaled_mul(e2, e2));
  struct scaled amplitude = fit_scaled_from(at->amplitude_q24, -24);
  struct scaled round = scaled_mul(amplitude, fit_scaled_from(ONE_Q26 / 4 + at->t_q26, -26)); /* A v */
  struct scaled longest = fit_scaled_short(scaled_mul((struct scaled){pad->elongation_max_q15, -15}, round));
  if (exceeds(square, scaled_mul(longest, longest))) {
    return;
  }
  const struct scaled stated = scaled_mul(variance, pad->thin);
  const uint32_t outside = is_outside(pad, at->x_q26, COLUMNS) + is_outside(pad, at->y_q26, ROWS);
  const int32_t least_q16 = outside ? MISFIT_MIN_OUTSIDE_Q16 : MISFIT_MIN_Q16, misfit_q16 = chi_square_q16 >> MISFIT_SHIFT;
  const int32_t factor_q16 = misfit_q16 < least_q16 ? least_q16 : misfit_q16, rest_q16 = factor_q16 < 1 << 16 ? (1 << 16) - factor_q16 : 0;
  /* Where chi^2 is small, half of the gains' part remains for a tangential force; for a location all, or none after a calibration. */
  const int32_t gain_part_q16 = (rest_q16 * problem->by_gains_q12) >> 13;
  struct scaled tangential_variance = fit_scaled_short(scaled_mul(stated, fit_scaled_from(factor_q16 + gain_part_q16, -16)));
  variance = fit_scaled_short(scaled_mul(stated, fit_scaled_from(problem->deviations ? factor_q16 : factor_q16 + 2 * gain_part_q16, -16)));
  int32_t x_q8, y_q8;
  struct scaled pulls = scaled_add(variance_of(work, outcome, TANGENTIAL_X, 0, NULL), variance_of(work, outcome, TANGENTIAL_Y, 0, NULL));
  pulls.exponent -= 1;
  struct scaled place =
      scaled_add(variance_of(work, outcome, LOCATION_X, TANGENTIAL_X, &x_q8), variance_of(work, outcome, LOCATION_Y, TANGENTIAL_Y, &y_q8));
  struct scaled tangential_sd = root_of_product(pulls, tangential_variance);
  const struct scaled most = {(int32_t)(FIT_TANGENTIAL_SD_MAX * 32768.0f), -15};
  if (exceeds(tangential_sd, scaled_mul(most, amplitude))) {
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
  result->qx_N = fit_float(product(at->tangential_x_q24 * 32, unit_q30, 32), exponent + 3);
  result->qy_N = fit_float(product(at->tangential_y_q24 * 32, unit_q30, 32), exponent + 3);
  result->q_sd_N = fit_scaled_float(scaled_mul(unit, tangential_sd));
  result->location_sd_mm = fit_scaled_float(scaled_mul(length, root_of_product(place, variance)));
  struct scaled noise = fit_scaled_from(problem->base.noise_q22, -22);
  result->location_noise_mm = fit_scaled_float(scaled_mul(length, scaled_mul(noise, fit_scaled_sqrt(place))));
  result->variance_per_tangential = fit_scaled_float(scaled_div(variance, tangential_variance));
  struct scaled peak = variance_of(work, outcome, AMPLITUDE, 0, NULL);
  result->force_sd_N = fit_scaled_float(scaled_mul(unit, root_of_product(peak, variance)));
  struct scaled moved = scaled_mul(length, amplitude);
  result->shift_q20_mm[0] = shift_q20(outcome, moved, 0, x_q8);
  result->shift_q20_mm[1] = shift_q20(outcome, moved, 1, y_q8);
  result->at_corner = outside >> 1;
  result->elongated = pad->elongation_max_q15 == NEAR_ENDS_MAX_Q15 && fit_tangential_is_elongated(work, outcome, square, round, variance);
}

/* What a calibration knows of the pad. */
static void set_known(const struct fit_array *array, const struct fit_settings *settings, struct problem *problem) {
  problem->deviations = settings->deviations;
  problem->sensor = array->grid.sensor;
  problem->model_sd_q16 = MODEL_SD_Q16;
  problem->dip_q22 = 0;
  if (fit_has_dip(settings)) {
    int32_t sd_q20 = fixed_mul_q30(fit_fixed(settings->dip_sd_mm, 20), problem->pad->per_unit_q30);
    int32_t sd_q13 = fixed_clamp(sd_q20 >> 7, DIP_SD_MIN_Q13, DIP_SD_MAX_Q13);
    int32_t share_q16 = fit_fixed(settings->dip_share, 16), square_q26 = sd_q13 * sd_q13;
    problem->model_sd_q16 = fixed_hypot(MODEL_SD_Q16, fixed_mul_16(share_q16, FIT_DIP_ERROR_Q16));
    problem->dip_q22 = fixed_mul_q26(fixed_mul_16(problem->pad->peak_q26, share_q16), square_q26) >> 4;
    problem->dip_variance_q26 = square_q26 - problem->pad->spread_q26;
  }
}

static int32_t prior_row(int32_t base_q22, int32_t sd_q26) {
  int32_t base_q26 = base_q22 * 16;
  return base_q26 / 2 >= sd_q26 ? 2 * ONE_Q26 : fixed_div_q26(base_q26, sd_q26) | 1;
}

void fit_tangential_estimate(const struct fit_array *array, struct fit_pad *pad, const int32_t *pressure_Pa_q10,
                             const struct fit_settings *settings, const struct fit_result *fit, struct fit_tangential_state *state,
                             struct fit_tangential *result) {
  fit_use_rectangle(&array->grid);
  *result = (struct fit_tangential){0};
  struct problem problem;
  problem.pad = pad;
  set_known(array, settings, &problem);
  struct fit_settings of_readings = *settings;
  of_readings.dip_share = 0.0f; /* readings without room for a dip */
  if (!(fit->flags & CONTACT_FLAG_FIT_VALID) || settings->noise_Pa_q10 < 1 ||
      !fit_grid_take_readings(array, pressure_Pa_q10, fit->used, &of_readings, &problem.readings) ||
      !weigh(array, settings, fit->used, &problem, &pad->work)) {
    state->steps = 0;
    return;
  }
  struct fit_tangential_unknowns of_fit;
  struct outcome outcome;
  set_from_fit(pad, fit, problem.readings.shift, &of_fit);
  begin(pad, state, &of_fit, product(fixed_clamp(fit_fixed(fit->location_noise_mm, 24), 0, 1 << 28), pad->per_unit_q30, 28),
        fit_grid_sum_q20(problem.readings.q28));
  int32_t elongation_sd_q26 = fixed_mul_q28(of_fit.amplitude_q24 * 4, pad->elongation_sd_q26) * 4;
  problem.spread_prior_q26 = prior_row(problem.base.base_q22, pad->spread_sd_q26);
  problem.elongation_prior_q26 = prior_row(problem.base.base_q22, elongation_sd_q26);
  fit_tangential_step(&problem, &state->at, &pad->work, &outcome);
  if (state->steps < STEPS_REPORTED) {
    state->steps++;
  }
  if (state->steps == STEPS_REPORTED && outcome.length_q14 <= LENGTH_REPORTED_Q14) {
    conclude(&problem, &state->at, &outcome, result);
  }
  state->unreported = result->valid ? 0 : state->unreported + 1;
  if (state->unreported == UNREPORTED_MAX) {
    *state = (struct fit_tangential_state){0};
  }
}
