#include "fit/fit_grid_solve.h"

#include "common/contact_flags.h"
#include "fit/fit_limits.h"
#include "fit/fit_math.h"

/* Longest step: 0.6 pitch in x and y, 0.4 of sigma. A longer one is shortened as a whole (NUMERICS.md, "Step"). */
#define STEP_INVERSE_Q6 107 /* 1 / 0.6 */
#define RATIO_INVERSE_Q1 5  /* 1 / 0.4 */
/* An iterate may leave the box of the result by this much, for the same reason. */
#define OVERSHOOT_Q26 (ONE_Q26 / 4)

#define PEAK_RISE_MAX_Q22 (20 << 22)                      /* a factor of a million */
#define MODEL_INVERSE_SQUARE ((struct scaled){22756, -9}) /* 1 / FIT_MODEL_RESIDUAL^2 */
#define ROUGH_INVERSE_SQUARE ((struct scaled){20000, -3}) /* 1 / FIT_ROUGH_RESIDUAL^2 */
#define FLAT_CURVATURE_Q26 2016200                        /* FIT_FLAT_SIGMA */
#define BOUND_SD ((struct scaled){19661, -14})            /* FIT_BOUND_SD */

FIXED_INLINE struct scaled scaled_square(struct scaled a) { return scaled_mul(a, a); }

FIXED_INLINE struct scaled long_of(struct scaled a) { return (struct scaled){a.mantissa * (1 << 14), a.exponent - 14}; }

void fit_grid_add_prior(const struct readings *readings, struct fit_equations *equations) {
  struct scaled sigma = scaled_from(fit_grid_sigma(equations->at.curvature), -26);
  struct scaled pull = scaled_mul(scaled_sub(readings->prior_sigma, sigma), readings->prior_weight);
  struct scaled row = scaled_div(scaled_mul(sigma, readings->prior_weight), equations->stiffness);
  equations->prior_row = row;
  equations->d3 = long_of(scaled_add(scaled_short(equations->d3), scaled_mul(row, row)));
  equations->b3 = long_of(scaled_add(scaled_short(equations->b3), scaled_mul(row, pull)));
}

/* b / (d stiffness) in Qq, at most 2^30. Near the end b is small, and its last bits decide. */
FIXED_INLINE int32_t step_along(const struct scaled *b, const struct scaled *d, const struct scaled *stiffness, int32_t q) {
  int32_t divisor = ((d->mantissa >> 14) * stiffness->mantissa) >> 13; /* below 2^18 */
  int32_t up = 31 - fixed_bits(fixed_magnitude(b->mantissa) | 1);
  int32_t quotient = port_divide(b->mantissa * (1 << up), divisor < 2 ? 2 : divisor);
  int32_t shift = b->exponent - up - d->exponent - stiffness->exponent - 27 + q;
  if (shift > 0) {
    shift = shift < 30 ? shift : 30;
    int32_t limit = (1 << 30) >> shift;
    return fixed_clamp(quotient, -limit, limit) * (1 << shift);
  }
  return quotient >> (shift < -31 ? 31 : -shift);
}

/* With c = b / d / stiffness:
 *   dsigma / sigma = c3,  dx = c1 - cross c2 + (2 x - slope_x) c3,  dy = c2 + (2 y - slope_y) c3. */
void fit_grid_step(const struct fit_grid_shape *grid, struct fit_equations *equations, struct state *state) {
  int32_t c1 = step_along(&equations->b1, &equations->d1, &equations->stiffness, 26);
  int32_t c2 = step_along(&equations->b2, &equations->d2, &equations->stiffness, 26);
  int32_t ratio = step_along(&equations->b3, &equations->d3, &equations->stiffness, 28);
  equations->c1_q26 = c1;
  equations->c2_q26 = c2;
  equations->c3_q28 = ratio;
  int32_t dx = (c1 >> 4) + fixed_mul_q32(2 * equations->at.x - equations->slope_x, ratio);
  if (equations->cross != 0) {
    dx -= fixed_mul_q28(c2 >> 2, equations->cross);
  }
  int32_t dy = (c2 >> 4) + fixed_mul_q32(2 * equations->at.y - equations->slope_y, ratio);

  /* The largest component in units of its limit, Q14. */
  uint32_t most = (fixed_magnitude(dx) >> 9) * STEP_INVERSE_Q6 >> 5;
  uint32_t other = (fixed_magnitude(dy) >> 9) * STEP_INVERSE_Q6 >> 5;
  most = other > most ? other : most;
  other = (fixed_magnitude(ratio) >> 14) * RATIO_INVERSE_Q1 >> 1;
  most = other > most ? other : most;
  if (most > 1 << 14) {
    int32_t share_q15 = port_divide(1 << 29, (int32_t)most);
    dx = fixed_mul_16(dx, share_q15) * 2;
    dy = fixed_mul_16(dy, share_q15) * 2;
    ratio = fixed_mul_16(ratio, share_q15) * 2;
  }
  equations->step_x_q22 = dx;
  equations->step_y_q22 = dy;
  state->x = fixed_clamp(equations->at.x + dx * 16, grid->x_min - OVERSHOOT_Q26, grid->x_max + OVERSHOOT_Q26);
  state->y = fixed_clamp(equations->at.y + dy * 16, grid->y_min - OVERSHOOT_Q26, grid->y_max + OVERSHOOT_Q26);

  /* curvature /= (1 + ratio)^2 as curvature -= curvature f (2 - f), f = ratio / (1 + ratio), which goes to zero smoothly. */
  int32_t inverse_q15 = port_divide(1 << 30, ((1 << 28) + ratio) >> 13);
  int32_t f = fixed_mul_16(ratio, inverse_q15 >> 1) * 4;
  int32_t curvature = equations->at.curvature;
  int32_t loss = 2 * f - (f >> 14) * (f >> 14); /* Q28, -3 .. 0.56 */
  if (curvature < 1 << 28) {
    curvature -= fixed_mul_q28(curvature, loss);
  } else {
    curvature = (curvature >> 2) - fixed_mul_q28(curvature >> 2, loss);
    curvature = curvature > CURVATURE_MAX_Q26 >> 2 ? CURVATURE_MAX_Q26 : curvature * 4;
  }
  state->curvature = fixed_clamp(curvature, CURVATURE_MIN_Q26, CURVATURE_MAX_Q26);
}

/* Peak at the centre after the step: 30-bit mantissa and exponent, Pa. */
static int32_t peak_of(const struct readings *readings, const struct fit_equations *equations, int32_t *exponent) {
  int32_t rise_q22 = fixed_clamp(equations->rise_q22, 0, PEAK_RISE_MAX_Q22);
  int32_t up = 30 - fixed_bits((uint32_t)equations->amplitude_q28);
  int32_t peak = fixed_mul_q30(equations->amplitude_q28 * (1 << up), exp2_negative((1u << 22) - ((uint32_t)rise_q22 & 0x3FFFFF)));
  *exponent = (rise_q22 >> 22) + 1 - up - 10 - readings->shift;

  /* The last step's own part, relative: c1 and c2 tilt the model about its mean, c3 bends it. */
  const struct state *at = &equations->at;
  int32_t c1 = fixed_clamp(equations->c1_q26, -ONE_Q26, ONE_Q26) * 16;
  int32_t c2 = fixed_clamp(equations->c2_q26, -ONE_Q26, ONE_Q26) * 16;
  int32_t c3 = fixed_clamp(equations->c3_q28, -(1 << 28), 1 << 28) * 4;
  int32_t off_x = at->x - equations->mean_x;
  int32_t off_y = at->y - equations->mean_y - fixed_mul_q26(equations->cross, off_x);
  int32_t tilt_q24 = fixed_mul_q32(c1, off_x) + fixed_mul_q32(c2, off_y);
  int32_t lift_q22 = fixed_clamp(fixed_mul_q32(c3, equations->p3_centre_q24) + (tilt_q24 >> 2), -(1 << 21), 1 << 21);
  int32_t growth_q24 = fixed_mul_q32(at->curvature, lift_q22 * (1 << 8));
  growth_q24 = fixed_mul_16(growth_q24, STIFFNESS_PER_CURVATURE_Q14) * 4;
  /* The amplitude's rounding. */
  int32_t scale_q12 = fixed_mul_q32(equations->mass_q20 * 16, equations->amplitude_q28) >> 8;
  growth_q24 += shifted(port_divide(equations->b0, scale_q12 + 1), equations->residual_shift - 2);
  int32_t growth = fixed_clamp(growth_q24, -(1 << 23), 1 << 23) * 16;
  peak = fixed_mul_q28(peak, (1 << 28) + growth);
  if (peak >= 1 << 30) {
    peak >>= 1;
    *exponent += 1;
  }
  return peak;
}

uint64_t fit_packed_reciprocal(struct scaled value) {
  struct scaled a = scaled_from(value.mantissa < 1 ? 1 : value.mantissa, value.exponent);
  return scaled_pack((struct scaled){port_divide(1 << 29, a.mantissa), -29 - a.exponent});
}

/* square_sum / count */
FIXED_INLINE struct scaled scaled_mean(struct scaled sum, int count) {
  int32_t up = count >= 8 ? 18 : 15; /* 13 bits at least */
  return scaled_mul(sum, (struct scaled){port_divide((1 << up) - 1, count), -up});
}

/* Raises the inverse of d3, so that times the variance of a reading it gives that of c3: the prior's row has another variance. */
static NOINLINE void add_prior_variance(const struct readings *readings, const struct fit_equations *equations,
                                        const struct scaled *variance, struct scaled *inverse3) {
  struct scaled excess = fit_scaled_short(scaled_sub(scaled_square(readings->prior_sd), *variance));
  if (excess.mantissa > 0) {
    struct scaled share = scaled_mul(equations->prior_row, *inverse3);
    struct scaled more = scaled_mul(scaled_mul(excess, scaled_square(share)), fit_grid_reciprocal(*variance));
    *inverse3 = scaled_add(*inverse3, more);
  }
}

/* Location, width, peak and force; returns the force. */
static NOINLINE struct scaled set_values(const struct fit_grid_shape *grid, const struct readings *readings,
                                         const struct fit_equations *equations, const struct state *state, struct fit_result *result) {
  int32_t x = fixed_clamp(state->x, grid->x_min, grid->x_max);
  int32_t y = fixed_clamp(state->y, grid->y_min, grid->y_max);
  int32_t peak_exponent;
  int32_t peak = peak_of(readings, equations, &peak_exponent);
  int32_t sigma = fit_grid_sigma(state->curvature);
  int32_t up = 30 - fixed_bits((uint32_t)sigma);
  int32_t sigma_square = fixed_mul_q30(sigma * (1 << up), sigma * (1 << up));
  int32_t force = fixed_mul_q30(fixed_mul_q30(peak, sigma_square), grid->force_scale);
  int32_t force_exponent = peak_exponent + 38 - 2 * up + grid->force_exponent;
  int32_t pitch_exponent = grid->pitch_exponent;
  result->x_mm = fit_float(fixed_mul_q32(x, grid->pitch) + grid->x_origin, pitch_exponent);
  result->y_mm = fit_float(fixed_mul_q32(y, grid->pitch) + grid->y_origin, pitch_exponent);
  result->sigma_mm = fit_float(fixed_mul_q32(sigma, grid->pitch), pitch_exponent);
  result->p0_Pa = fit_float(peak, peak_exponent);
  result->force_N = fit_float(force, force_exponent);
  return scaled_near(force, force_exponent);
}

/* The flags that need no variance. */
static NOINLINE uint32_t flags_of(const struct fit_grid_shape *grid, const struct readings *readings, const struct fit_settings *settings,
                                  const struct fit_equations *equations, const struct state *state) {
  uint32_t flags = CONTACT_FLAG_FIT_VALID | CONTACT_FLAG_UNCERTAINTY_VALID;
  if (settings->noise_Pa_q10 > port_divide(readings->largest, FIT_LOW_SIGNAL_SIGMA)) {
    flags |= CONTACT_FLAG_LOW_SIGNAL;
  }
  if (state->curvature <= FLAT_CURVATURE_Q26) {
    flags |= CONTACT_FLAG_FLAT;
  }
  if (state->x <= grid->x_min || state->x >= grid->x_max || state->y <= grid->y_min || state->y >= grid->y_max ||
      state->curvature <= CURVATURE_MIN_Q26 || state->curvature >= CURVATURE_MAX_Q26 || equations->amplitude_q28 <= AMPLITUDE_MIN_Q28 ||
      equations->amplitude_q28 >= AMPLITUDE_MAX_Q28) {
    flags |= CONTACT_FLAG_AT_BOUND;
  }
  return flags;
}

/* Variance of the force's share, where readings have 1, times the amplitude squared: the mean of the model adds one over its mass. */
static NOINLINE struct scaled force_form(const struct fit_propagation *propagation, const struct scaled *inverse3) {
  struct scaled off_x = fit_scaled_from(propagation->off_x, -26);
  struct scaled off_y = fit_scaled_from(propagation->off_y, -26);
  struct scaled lift = fit_scaled_from(propagation->centre_q24, -24);
  struct scaled form = scaled_add(propagation->inverse_mass, scaled_mul(scaled_square(off_x), propagation->inverse1));
  form = scaled_add(form, scaled_mul(scaled_square(off_y), propagation->inverse2));
  return scaled_add(form, scaled_mul(scaled_square(lift), *inverse3));
}

/* The same of the location, times the stiffness squared, pitches. */
static NOINLINE struct scaled location_form(const struct fit_equations *equations, const struct fit_propagation *propagation,
                                            const struct scaled *inverse3) {
  int32_t along_x = (2 * equations->at.x - equations->slope_x) >> 16; /* Q10 */
  int32_t along_y = (2 * equations->at.y - equations->slope_y) >> 16;
  struct scaled slopes = fit_scaled_from(along_x * along_x + along_y * along_y, -20);
  struct scaled form = scaled_add(scaled_add(propagation->inverse1, propagation->inverse2), scaled_mul(slopes, *inverse3));
  if (equations->cross != 0) {
    struct scaled cross = fit_scaled_from(equations->cross, -26);
    form = scaled_add(form, scaled_mul(scaled_square(cross), propagation->inverse2));
  }
  return form;
}

/* Variance of one reading that is the same for all of them, in units of Q28, and what the residuals show besides. */
struct scatter {
  struct scaled noise; /* the noise's alone */
  struct scaled all;   /* and the model's, and what the residuals are above these and the gains' */
  bool misfit, rough, other_model;
};

static NOINLINE void set_scatter(const struct readings *readings, const struct fit_settings *settings,
                                 const struct fit_equations *equations, const struct fit_propagation *propagation, int count,
                                 struct scatter *scatter, struct fit_result *result) {
  struct scaled left = fit_scaled_from(equations->b0, equations->residual_shift - 38);
  struct scaled square_sum =
      scaled_sub(fit_scaled_short(equations->square_sum), scaled_mul(scaled_square(left), propagation->inverse_mass));
  square_sum.mantissa = square_sum.mantissa < 0 ? 0 : square_sum.mantissa;
  struct scaled rms = fit_scaled_sqrt(scaled_mean(square_sum, count));
  result->residual_rms_Pa = fit_float(rms.mantissa, rms.exponent + 18 - readings->shift);

  scatter->noise = scaled_square(fit_scaled_from(settings->noise_Pa_q10, readings->shift - 28));
  struct scaled model = scaled_mul(fit_scaled_from(settings->model_sd_q16, -16), fit_scaled_from(readings->largest, readings->shift - 28));
  scatter->all = scaled_add(scatter->noise, scaled_square(model));
  struct scaled amplitude_square = scaled_square(propagation->amplitude);
  struct scaled gains = fit_scaled_from((int32_t)propagation->gains, PROPAGATION_SQUARE_SHIFT - 32 - 2 * propagation->gain_shift);
  gains = scaled_mul(scaled_mean(gains, count), amplitude_square);
  struct scaled expected = scaled_add(scatter->all, gains);
  struct scaled found = scaled_mean(square_sum, count > 4 ? count - 4 : 1);
  struct scaled excess = scaled_sub(found, expected);
  scatter->misfit = false;
  if (excess.mantissa > 0) {
    int32_t ratio_q10 = fit_scaled_to_fixed(scaled_mul(found, fit_grid_reciprocal(expected)), 10);
    scatter->misfit = ratio_q10 > (FIT_MISFIT * FIT_MISFIT) << 10;
    int32_t times_q10 = fixed_clamp(ratio_q10 / FIT_MISFIT_BEGIN, 1 << 10, FIT_MISFIT_MAX << 10);
    excess = fit_scaled_from(excess.mantissa * times_q10, excess.exponent - 10);
    scatter->all = scaled_add(scatter->all, excess);
  }

  struct scaled mass = fit_scaled_from(equations->mass_q20, -20);
  struct scaled total = scaled_add(scaled_mul(amplitude_square, mass), square_sum);
  scatter->rough = scaled_sub(scaled_mul(square_sum, ROUGH_INVERSE_SQUARE), total).mantissa > 0;
  scatter->other_model = scaled_sub(scaled_mul(square_sum, MODEL_INVERSE_SQUARE), total).mantissa > 0;
}

bool fit_grid_conclude(const struct fit_grid_shape *grid, const struct readings *readings, const struct fit_settings *settings,
                       const struct fit_equations *equations, const struct fit_propagation *propagation, const struct state *state,
                       int count, struct fit_result *result) {
  struct scaled force = set_values(grid, readings, equations, state, result);
  uint32_t flags = flags_of(grid, readings, settings, equations, state);
  struct scatter scatter;
  set_scatter(readings, settings, equations, propagation, count, &scatter, result);
  struct scaled inverse3 = propagation->inverse3;
  if (readings->prior_weight.mantissa != 0) {
    add_prior_variance(readings, equations, &scatter.all, &inverse3);
  }

  struct scaled pitch = scaled_near(grid->pitch, grid->pitch_exponent - 6);
  struct scaled form = scaled_mul(location_form(equations, propagation, &inverse3),
                                  scaled_square(scaled_mul(propagation->inverse_stiffness, pitch))); /* mm */
  struct scaled sd = fit_scaled_sqrt(scaled_mul(scatter.noise, form));
  result->location_noise_mm = fit_scaled_float(sd);
  struct scaled step_x = fit_scaled_from(equations->step_x_q22, -22); /* what it moved is not settled */
  struct scaled step_y = fit_scaled_from(equations->step_y_q22, -22);
  struct scaled elongation_shift = scaled_add(scaled_square(step_x), scaled_square(step_y));
  elongation_shift = scaled_add(scaled_add(propagation->location_variance, propagation->elongation_shift), elongation_shift);
  elongation_shift = scaled_mul(elongation_shift, scaled_square(pitch));
  sd = flags & CONTACT_FLAG_AT_BOUND ? scaled_mul(BOUND_SD, pitch)
                                     : fit_scaled_sqrt(scaled_add(scaled_mul(scatter.all, form), elongation_shift));
  result->location_sd_mm = fit_scaled_float(sd);
  struct scaled limit = fit_grid_scaled(fit_location_sd_limit_mm(settings));
  if (scaled_sub(sd, limit).mantissa > 0) {
    flags |= CONTACT_FLAG_UNCERTAIN;
  }

  form = scaled_mul(force_form(propagation, &inverse3), fit_grid_reciprocal(scaled_square(propagation->amplitude)));
  sd = fit_scaled_sqrt(scaled_add(scaled_mul(scatter.all, form), propagation->force_variance));
  sd = scaled_mul(sd, force);
  result->force_sd_N = fit_scaled_float(sd);

  if (scatter.other_model) {
    flags |= CONTACT_FLAG_MODEL;
  }
  int32_t x_q22 = fixed_clamp(equations->step_x_q22, -(1 << 15), 1 << 15);
  int32_t y_q22 = fixed_clamp(equations->step_y_q22, -(1 << 15), 1 << 15);
  bool settled = ((x_q22 * x_q22) >> 1) + ((y_q22 * y_q22) >> 1) <= grid->settled_square;
  result->flags |= flags;
  return scatter.misfit && scatter.rough && settled;
}
