#include "common/contact_flags.h"
#include "fit/fit.h"
#include "fit/fit_limits.h"
#include "fit/fit_math.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

#define PARAMETERS 4
#define LOG2_E 1.44269504f
#define TWO_PI 6.28318531f

/* Readings below this share of the largest, or this number of noise standard deviations, have more noise than shape in their logarithm. */
#define GUESS_SHARE 0.01f
#define GUESS_NOISE_SDS 5.0f
/* Prior of the guess alone, which decides where too few readings are large. */
#define GUESS_PRIOR_WEIGHT 3e-3f
#define GUESS_PRIOR_SIGMA 0.42f

/* Longest step, pitches and share of sigma. A longer one is shortened as a whole (NUMERICS.md, "Step"). */
#define STEP_MAX 0.65f
#define WIDTH_STEP_MAX 0.5f
/* Pitches by which an iterate may leave the box that the result is held to, for the same reason. */
#define OVERSHOOT 0.25f
#define P0_MIN 0.05f       /* of the largest reading */
#define P0_MAX 1e6f        /* reached 30 mm outside the array */
#define FREE_MIN 0.015625f /* 1 - leverage, in a studentised residual */
#define PIVOT_FLOOR 2e-7f  /* of the diagonal entry: float32 resolves no less */

/* Symmetric 4 x 4 and right-hand side. matrix[i][j] for j <= i. */
struct normal_equations {
  float matrix[PARAMETERS][PARAMETERS];
  float rhs[PARAMETERS];
};

/* The readings that enter, in units of the largest. */
struct samples {
  int count;
  uint8_t sensor[FT_MAX_SENSORS];
  float x[FT_MAX_SENSORS], y[FT_MAX_SENSORS];
  float p[FT_MAX_SENSORS];
  int32_t log2_q24[FT_MAX_SENSORS]; /* of a reading that enters the guess, else INT32_MIN */
};

struct parameters {
  float p0, x, y, sigma;
};

/* What cast rubber takes from the Gaussian e: share exp(-(X^2 + Y^2) / (2 sd^2)), of the same amplitude. */
struct dip {
  float share, log2_scale, inverse_variance; /* log2(e) / (2 sd^2), 1 / sd^2 */
  const struct fit_array *ends;              /* of the pad, where the dip is less; NULL: nowhere */
};

/* One more row weight (sigma - prior) of the least squares, pitches; weight 0: none. */
struct prior {
  float sigma, weight;
};

/* NaN counts as low. */
static float clamp(float value, float low, float high) {
  if (!(value > low)) {
    return low;
  }
  return value > high ? high : value;
}

/* NaN and infinity count as high. */
static float at_most(float value, float high) { return value < high ? value : high; }

/* Factorises in place, matrix = L D L^T: L below the diagonal, D on it. A pivot below its floor is raised to it, which shortens
 * the step in a direction that the readings do not determine. Returns whether that happened. */
static bool factorise(struct normal_equations *normal) {
  bool deficient = false;
  for (int i = 0; i < PARAMETERS; i++) {
    float *row = normal->matrix[i];
    float diagonal = row[i];
    float pivot = diagonal;
    for (int j = 0; j < i; j++) {
      float *other = normal->matrix[j];
      float product = row[j]; /* L[i][j] * D[j] */
      for (int k = 0; k < j; k++) {
        product -= row[k] * other[k];
      }
      row[j] = product;
    }
    for (int j = 0; j < i; j++) {
      float scaled = row[j] / normal->matrix[j][j];
      pivot -= row[j] * scaled;
      row[j] = scaled;
    }
    float floor = diagonal * PIVOT_FLOOR + 1e-30f;
    if (!(pivot > floor)) {
      pivot = floor;
      deficient = true;
    }
    row[i] = pivot;
  }
  return deficient;
}

/* L z = vector, in place. */
static void forward(const struct normal_equations *normal, float vector[PARAMETERS]) {
  for (int i = 1; i < PARAMETERS; i++) {
    for (int j = 0; j < i; j++) {
      vector[i] -= normal->matrix[i][j] * vector[j];
    }
  }
}

static void solve(const struct normal_equations *normal, float vector[PARAMETERS]) {
  forward(normal, vector);
  for (int i = PARAMETERS - 1; i >= 0; i--) {
    vector[i] /= normal->matrix[i][i];
    for (int j = i + 1; j < PARAMETERS; j++) {
      vector[i] -= normal->matrix[j][i] * vector[j];
    }
  }
}

/* vector^T matrix^-1 vector, from the factors. */
static float inverse_form(const struct normal_equations *normal, float vector[PARAMETERS]) {
  forward(normal, vector);
  float sum = 0.0f;
  for (int i = 0; i < PARAMETERS; i++) {
    sum += vector[i] * vector[i] / normal->matrix[i][i];
  }
  return sum;
}

/* Adds row^T row to the matrix and row * value to the right-hand side. */
static void add_row(struct normal_equations *normal, const float row[PARAMETERS], float value) {
  for (int i = 0; i < PARAMETERS; i++) {
    for (int j = 0; j <= i; j++) {
      normal->matrix[i][j] += row[i] * row[j];
    }
    normal->rhs[i] += row[i] * value;
  }
}

/* log p is a paraboloid: weighted linear least squares about the largest reading. */
static struct parameters guess(const struct samples *samples, int peak) {
  struct normal_equations normal;
  memset(&normal, 0, sizeof normal);
  const float prior_curvature = 0.5f / (GUESS_PRIOR_SIGMA * GUESS_PRIOR_SIGMA);
  for (int i = 0; i < PARAMETERS; i++) {
    normal.matrix[i][i] = GUESS_PRIOR_WEIGHT;
  }
  normal.rhs[3] = -GUESS_PRIOR_WEIGHT * prior_curvature;
  for (int k = 0; k < samples->count; k++) {
    float weight = samples->p[k];
    if (samples->log2_q24[k] == INT32_MIN) {
      continue;
    }
    float x = samples->x[k] - samples->x[peak];
    float y = samples->y[k] - samples->y[peak];
    int32_t log2_q24 = samples->log2_q24[k] - samples->log2_q24[peak];
    float log_p = (float)log2_q24 * (1.0f / (16777216.0f * LOG2_E));
    float row[PARAMETERS] = {weight, weight * x, weight * y, weight * (x * x + y * y)};
    add_row(&normal, row, weight * log_p);
  }
  factorise(&normal);
  solve(&normal, normal.rhs);
  float curvature = -normal.rhs[3]; /* 1 / (2 sigma^2) */
  const float flattest = 0.5f / (FIT_SIGMA_MAX * FIT_SIGMA_MAX);
  const float sharpest = 0.5f / (0.25f * 0.25f);
  curvature = clamp(curvature, flattest, sharpest);
  struct parameters theta;
  float half_inverse = 0.5f / curvature;
  theta.x = clamp(normal.rhs[1] * half_inverse, -1.0f, 1.0f) + samples->x[peak];
  theta.y = clamp(normal.rhs[2] * half_inverse, -1.0f, 1.0f) + samples->y[peak];
  theta.sigma = sqrtf(half_inverse);
  theta.p0 = 1.0f;
  return theta;
}

/* At a place, X, Y from the centre: the model of amplitude 1 is e - d, with e = exp(-(X^2 + Y^2) / (2 sigma^2)) and d that of
 * the dip. The row is what its derivatives span, e (1, X, Y, X^2 + Y^2) where there is no dip. Returns d. */
static float model_row(const struct dip *dip, const struct parameters *at, float place_x, float place_y, float row[PARAMETERS]) {
  float x = place_x - at->x, y = place_y - at->y;
  float r2 = x * x + y * y, sigma2 = at->sigma * at->sigma;
  float e = fit_exp2_negative(r2 * (0.5f * LOG2_E / sigma2));
  float d = dip->share > 0.0f ? dip->share * fit_exp2_negative(r2 * dip->log2_scale) : 0.0f;
  d = dip->ends ? d * fit_dip_share(dip->ends, at->x, at->y, place_x, place_y) : d;
  float slope = e - sigma2 * dip->inverse_variance * d;
  row[0] = e - d;
  row[1] = slope * x;
  row[2] = slope * y;
  row[3] = e * r2;
  return d;
}

/* Sets the best amplitude for the shape of theta, and the normal equations linearised there. Returns the sum of squared residuals. */
static float linearise(const struct fit_array *array, const struct samples *samples, struct prior prior, const struct dip *dip,
                       struct parameters *theta, struct normal_equations *normal) {
  memset(normal, 0, sizeof *normal);
  float row[FT_MAX_SENSORS][PARAMETERS];
  float numerator = 0.0f;
  float denominator = 1e-30f;
  for (int k = 0; k < samples->count; k++) {
    model_row(dip, theta, samples->x[k], samples->y[k], row[k]);
    numerator += row[k][0] * samples->p[k];
    denominator += row[k][0] * row[k][0];
  }
  theta->p0 = clamp(numerator / denominator, P0_MIN, P0_MAX);
  float sum = 0.0f;
  for (int k = 0; k < samples->count; k++) {
    // cppcheck-suppress uninitvar ; the loop above has set as many
    float residual = samples->p[k] - theta->p0 * row[k][0];
    sum += residual * residual;
    add_row(normal, row[k], residual);
  }
  if (prior.weight > 0.0f) {
    /* The fourth unknown alone changes sigma, by sigma^3 / p0. */
    float sensitivity = theta->sigma * theta->sigma * theta->sigma / theta->p0;
    float of_prior[PARAMETERS] = {0.0f, 0.0f, 0.0f, prior.weight * sensitivity};
    add_row(normal, of_prior, prior.weight * (prior.sigma - theta->sigma));
  }
  if (array->is_line) {
    /* Nothing else determines the coordinate across the line: this row alone brings it there. */
    float across = theta->x * array->line_x + theta->y * array->line_y;
    float of_line[PARAMETERS] = {0.0f, array->line_x, array->line_y, 0.0f};
    float gain = theta->sigma * theta->sigma / theta->p0;
    add_row(normal, of_line, (array->line_offset - across) / gain);
  }
  return sum;
}

/* One Gauss-Newton step; returns the length of its move in pitches. */
static float step(const struct fit_array *array, struct normal_equations *normal, struct parameters *theta) {
  solve(normal, normal->rhs);
  float sigma2 = theta->sigma * theta->sigma;
  float gain = sigma2 / theta->p0;
  float dx = gain * normal->rhs[1];
  float dy = gain * normal->rhs[2];
  float ratio = gain * normal->rhs[3]; /* of the change of sigma to sigma */
  float excess = fabsf(ratio) * (1.0f / WIDTH_STEP_MAX);
  excess = fabsf(dx) * (1.0f / STEP_MAX) > excess ? fabsf(dx) * (1.0f / STEP_MAX) : excess;
  excess = fabsf(dy) * (1.0f / STEP_MAX) > excess ? fabsf(dy) * (1.0f / STEP_MAX) : excess;
  float share = excess > 1.0f ? 1.0f / excess : 1.0f;
  dx *= share;
  dy *= share;
  theta->p0 = clamp(theta->p0 + share * normal->rhs[0], P0_MIN, P0_MAX);
  theta->x = clamp(theta->x + dx, array->x_min - OVERSHOOT, array->x_max + OVERSHOOT);
  theta->y = clamp(theta->y + dy, array->y_min - OVERSHOOT, array->y_max + OVERSHOOT);
  theta->sigma = clamp(theta->sigma * (1.0f + share * ratio), FIT_SIGMA_MIN, FIT_SIGMA_MAX);
  return sqrtf(dx * dx + dy * dy);
}

static bool at_bound(const struct fit_array *array, const struct parameters *theta) {
  return theta->x <= array->x_min || theta->x >= array->x_max || theta->y <= array->y_min || theta->y >= array->y_max ||
         theta->sigma <= FIT_SIGMA_MIN || theta->sigma >= FIT_SIGMA_MAX || theta->p0 <= P0_MIN || theta->p0 >= P0_MAX;
}

static int32_t largest_reading(const struct fit_array *array, const int32_t *pressure_Pa_q10, sensor_map usable) {
  int32_t largest = 0;
  for (uint8_t k = 0; k < array->sensor_count; k++) {
    if ((usable & sensor_bit(k)) && pressure_Pa_q10[k] > largest) {
      largest = pressure_Pa_q10[k];
    }
  }
  return largest;
}

/* The outlier among the sensors, or -1. theta, the factors and squares, the sum of squared residuals, are of the last linearisation. */
static int outlier_of(const struct samples *samples, const struct dip *dip, const struct parameters *theta,
                      const struct normal_equations *normal, float squares, int unknowns) {
  float worst = 0.0f, second = 0.0f;
  int outlier = -1;
  for (int k = 0; k < samples->count; k++) {
    float row[PARAMETERS];
    model_row(dip, theta, samples->x[k], samples->y[k], row);
    float residual = samples->p[k] - theta->p0 * row[0];
    float free = 1.0f - inverse_form(normal, row); /* of the leverage */
    float without = residual * residual / (free > FREE_MIN ? free : FREE_MIN);
    if (without > worst) {
      second = worst;
      worst = without;
      outlier = samples->sensor[k];
    } else if (without > second) {
      second = without;
    }
  }
  float others = squares > worst ? squares - worst : 0.0f;
  bool alone = second < 0.5f * worst;
  float freedom = (float)(samples->count - unknowns - 1);
  return alone && others * (float)(FIT_OUTLIER * FIT_OUTLIER) < worst * freedom ? outlier : -1;
}

/* How far a unit of the right-hand side moves the result, in pitches and shares of the force; variances where every reading has 1. */
struct influence {
  float gain; /* sigma^2 / p0 */
  float x[PARAMETERS], y[PARAMETERS], force[PARAMETERS];
  float location_form, force_form;
};

static float product(const float a[PARAMETERS], const float b[PARAMETERS]) {
  float sum = 0.0f;
  for (int i = 0; i < PARAMETERS; i++) {
    sum += a[i] * b[i];
  }
  return sum;
}

/* Leaves matrix^-1 direction, scaled, in `influence`, and returns the quadratic form. */
static float influence_along(const struct normal_equations *normal, const float *direction, float scale, float *influence) {
  for (int i = 0; i < PARAMETERS; i++) {
    influence[i] = direction[i];
  }
  solve(normal, influence);
  float form = scale * scale * product(influence, direction);
  for (int i = 0; i < PARAMETERS; i++) {
    influence[i] *= scale;
  }
  return form;
}

static void set_influence(const struct fit_array *array, const struct parameters *at, const struct normal_equations *normal,
                          struct influence *influence) {
  float gain = at->sigma * at->sigma / at->p0;
  influence->gain = gain;
  const float along_force[PARAMETERS] = {1.0f, 0.0f, 0.0f, 2.0f * at->sigma * at->sigma};
  influence->force_form = influence_along(normal, along_force, 1.0f / at->p0, influence->force);
  float along_x[PARAMETERS] = {0.0f, 1.0f, 0.0f, 0.0f};
  float along_y[PARAMETERS] = {0.0f, 0.0f, 1.0f, 0.0f};
  if (array->is_line) { /* x is the coordinate along it, nothing for that across */
    along_x[1] = -array->line_y;
    along_x[2] = array->line_x;
    along_y[2] = 0.0f;
  }
  influence->location_form = influence_along(normal, along_x, gain, influence->x) + influence_along(normal, along_y, gain, influence->y);
}

/* Variances that the sensors' own errors make; fit_limits.h has the errors. */
struct sensor_errors {
  float gains;           /* sum of the squared errors of the readings */
  float location, force; /* pitches squared, and share squared */
};

static void add_sensor_errors(const struct samples *samples, const struct fit_settings *settings, float scale, const struct dip *dip,
                              const struct parameters *at, const struct influence *influence, struct sensor_errors *errors) {
  float inverse = 1.0f / (at->sigma * at->sigma);
  float shape_x = 0.0f, shape_y = 0.0f, shape_force = 0.0f;
  errors->gains = errors->location = errors->force = 0.0f;
  for (int k = 0; k < samples->count; k++) {
    float x = samples->x[k] - at->x, y = samples->y[k] - at->y;
    float r2 = x * x + y * y;
    float row[PARAMETERS];
    float d = model_row(dip, at, samples->x[k], samples->y[k], row), e = row[0] + d;
    float by_x = product(row, influence->x), by_y = product(row, influence->y);
    float by_force = product(row, influence->force);
    float gain_sd = (float)settings->gain_sd_q16[samples->sensor[k]] * (1.0f / 65536.0f);
    float hysteresis_sd = scale * (float)settings->hysteresis_sd_Pa_q10[samples->sensor[k]];
    float error = at->p0 * (gain_sd * e + FIT_DIP_ERROR * d);
    float variance = error * error + hysteresis_sd * hysteresis_sd;
    errors->gains += variance;
    errors->location += (by_x * by_x + by_y * by_y) * variance;
    errors->force += by_force * by_force * variance;
    float shape = e * (r2 * inverse) * (r2 * inverse);
    shape_x += by_x * shape;
    shape_y += by_y * shape;
    shape_force += FIT_FORCE_SHAPE * by_force * shape;
  }
  float usual = FIT_SHAPE_SIGMA * FIT_SHAPE_SIGMA * inverse;
  float strength = FIT_SHAPE_PER_MODEL * (float)settings->model_sd_q16 * (1.0f / 65536.0f);
  if (fit_has_dip(settings)) {
    strength *= FIT_SHAPE_KNOWN;
  }
  strength *= usual * at->p0;
  errors->location += (shape_x * shape_x + shape_y * shape_y) * strength * strength;
  errors->force += shape_force * shape_force * strength * strength;
}

/* The same as fit_grid_remove_deviations. */
static void remove_deviations(const struct fit_deviation *deviations, const struct parameters *at, struct samples *samples) {
  const float inverse = 1.0f / (at->sigma * at->sigma);
  for (int k = 0; k < samples->count; k++) {
    const struct fit_deviation *deviation = &deviations[samples->sensor[k]];
    float x = samples->x[k] - at->x, y = samples->y[k] - at->y;
    float wider = (1.0f / 32768.0f) * (float)deviation->wider_q15;
    float along_x = wider * x - (1.0f / 32768.0f) * (float)deviation->off_x_q15;
    float along_y = wider * y - (1.0f / 32768.0f) * (float)deviation->off_y_q15;
    float share = inverse * (along_x * x + along_y * y);
    share = clamp(share, -FIT_DEVIATION_SHARE_MAX, FIT_DEVIATION_SHARE_MAX);
    float e = fit_exp2_negative((x * x + y * y) * (0.5f * LOG2_E * inverse));
    samples->p[k] -= at->p0 * e * share;
  }
}

/* One fit: what it starts from, and where its last iteration has led. */
struct problem {
  const struct fit_array *array;
  const struct fit_settings *settings;
  struct samples samples;
  int32_t largest;   /* reading, 1/1024 Pa */
  float scale;       /* 1 / largest */
  float sum_squares; /* of the readings, in units of the largest */
  int peak;          /* sample of the largest reading */
  int unknowns;
  struct prior prior;
  struct dip dip;
};
struct solution {
  struct parameters theta, before; /* after the last step, and where it was linearised */
  struct normal_equations normal;  /* factorised */
  float squares;                   /* sum of the squared residuals */
  float moved;                     /* length of the last step, pitches */
  bool deficient;                  /* the readings do not determine a direction */
};

static void take_samples(const int32_t *pressure_Pa_q10, sensor_map usable, struct problem *problem) {
  const struct fit_array *array = problem->array;
  const struct fit_settings *settings = problem->settings;
  const float scale = problem->scale;
  float guess_share = GUESS_NOISE_SDS * (float)settings->noise_Pa_q10 * scale;
  guess_share = clamp(guess_share, GUESS_SHARE, 0.99f); /* the largest reading enters */
  const bool has_dip = fit_has_dip(settings);
  struct samples *samples = &problem->samples;
  samples->count = 0;
  problem->peak = 0;
  problem->sum_squares = 0.0f;
  for (uint8_t k = 0; k < array->sensor_count; k++) {
    if (!(usable & sensor_bit(k))) {
      continue;
    }
    int n = samples->count++;
    int32_t raw = pressure_Pa_q10[k], reading = fit_reading(settings, raw);
    if (reading == problem->largest) {
      problem->peak = n;
    }
    samples->sensor[n] = k;
    samples->x[n] = array->x[k];
    samples->y[n] = array->y[k];
    samples->p[n] = clamp((float)(has_dip ? raw : reading) * scale, -1.0f, 1.0f);
    samples->log2_q24[n] = samples->p[n] >= guess_share ? fit_log2_q24((uint32_t)reading) : INT32_MIN;
    problem->sum_squares += samples->p[n] * samples->p[n];
  }
}

/* The prior and the dip that are known of the pad. */
static void set_known(struct problem *problem) {
  const struct fit_settings *settings = problem->settings;
  const float pitch_mm = problem->array->pitch_mm;
  problem->prior = (struct prior){0.0f, 0.0f};
  if (fit_has_prior(settings)) {
    problem->prior.sigma = settings->prior_sigma_mm / pitch_mm;
    problem->prior.weight = FIT_PRIOR_WEIGHT * pitch_mm / settings->prior_width_mm;
  }
  problem->dip = (struct dip){0.0f, 0.0f, 0.0f, fit_jacobian_needs_dip(problem->array, settings) ? problem->array : NULL};
  if (fit_has_dip(settings)) {
    float sd = clamp(settings->dip_sd_mm / pitch_mm, FIT_DIP_SD_MIN, FIT_DIP_SD_MAX);
    problem->dip.share = settings->dip_share;
    problem->dip.inverse_variance = 1.0f / (sd * sd);
    problem->dip.log2_scale = 0.5f * LOG2_E * problem->dip.inverse_variance;
  }
}

static void iterate(struct problem *problem, struct solution *solution) {
  const struct fit_array *array = problem->array;
  const struct fit_settings *settings = problem->settings;
  struct parameters *theta = &solution->theta;
  *theta = guess(&problem->samples, problem->peak);
  int left = settings->iterations;
  do {
    if (fit_has_deviations(settings) && left == FIT_DEVIATION_ITERATIONS) {
      remove_deviations(settings->deviations, theta, &problem->samples);
    }
    solution->squares = linearise(array, &problem->samples, problem->prior, &problem->dip, theta, &solution->normal);
    solution->before = *theta;
    solution->deficient = factorise(&solution->normal);
    solution->moved = step(array, &solution->normal, theta);
    if (left == 0) { /* the guess is asked for: the step only shows how good it is */
      *theta = solution->before;
    }
    left--;
  } while (left > 0);
  theta->x = clamp(theta->x, array->x_min, array->x_max);
  theta->y = clamp(theta->y, array->y_min, array->y_max);
}

static void set_values(const struct problem *problem, const struct solution *solution, struct fit_result *result) {
  const struct parameters *theta = &solution->theta;
  const float pitch = problem->array->pitch_mm;
  float unit_Pa = (float)problem->largest * (1.0f / 1024.0f);
  float sigma_mm = theta->sigma * pitch;
  result->x_mm = theta->x * pitch;
  result->y_mm = theta->y * pitch;
  result->p0_Pa = theta->p0 * unit_Pa;
  result->sigma_mm = sigma_mm;
  result->force_N = TWO_PI * result->p0_Pa * sigma_mm * sigma_mm * 1e-6f;
  result->residual_rms_Pa = unit_Pa * sqrtf(solution->squares / (float)problem->samples.count);
}

/* The flags that need no variance. */
static uint32_t flags_of(const struct problem *problem, const struct solution *solution) {
  uint32_t flags = CONTACT_FLAG_FIT_VALID | CONTACT_FLAG_UNCERTAINTY_VALID;
  if (problem->settings->noise_Pa_q10 > problem->largest / FIT_LOW_SIGNAL_SIGMA) {
    flags |= CONTACT_FLAG_LOW_SIGNAL;
  }
  if (solution->theta.sigma >= FIT_FLAT_SIGMA) {
    flags |= CONTACT_FLAG_FLAT;
  }
  if (solution->squares > FIT_MODEL_RESIDUAL * FIT_MODEL_RESIDUAL * problem->sum_squares) {
    flags |= CONTACT_FLAG_MODEL;
  }
  if (at_bound(problem->array, &solution->theta)) {
    flags |= CONTACT_FLAG_AT_BOUND;
  }
  return flags;
}

/* Sets the standard deviations by the last linearisation: from a variance that all readings share, the errors of each sensor, and the
 * prior. Returns whether the residuals are larger than noise, gains and model explain. */
static bool set_errors(const struct problem *problem, const struct solution *solution, uint32_t flags, struct fit_result *result) {
  const struct fit_settings *settings = problem->settings;
  const struct parameters *before = &solution->before;
  const int count = problem->samples.count;
  const float pitch = problem->array->pitch_mm;
  struct influence influence;
  set_influence(problem->array, before, &solution->normal, &influence);
  struct sensor_errors errors;
  add_sensor_errors(&problem->samples, settings, problem->scale, &problem->dip, before, &influence, &errors);
  int freedom = count > problem->unknowns ? count - problem->unknowns : 1;
  float noise = (float)settings->noise_Pa_q10 * problem->scale;
  float model = (float)settings->model_sd_q16 * (1.0f / 65536.0f);
  float variance = noise * noise + model * model;
  float expected = variance + errors.gains / (float)count;
  float found = solution->squares / (float)freedom;
  if (found > expected) {
    float times = clamp(found / expected * (1.0f / FIT_MISFIT_BEGIN), 1.0f, FIT_MISFIT_MAX);
    variance += times * (found - expected);
  }
  float location_variance = variance * influence.location_form + errors.location;
  float force_variance = variance * influence.force_form + errors.force;
  float prior_excess = FIT_PRIOR_WEIGHT * FIT_PRIOR_WEIGHT - variance;
  if (problem->prior.weight > 0.0f && prior_excess > 0.0f) {
    float row[PARAMETERS] = {0.0f, 0.0f, 0.0f, problem->prior.weight * before->sigma * influence.gain};
    float x = product(row, influence.x), y = product(row, influence.y);
    float force = product(row, influence.force);
    location_variance += prior_excess * (x * x + y * y);
    force_variance += prior_excess * force * force;
  }
  location_variance += solution->moved * solution->moved;
  if (solution->deficient || (flags & CONTACT_FLAG_AT_BOUND)) {
    location_variance = FIT_BOUND_SD * FIT_BOUND_SD;
  }
  result->location_noise_mm = at_most(pitch * noise * sqrtf(influence.location_form), FIT_HUGE);
  result->location_sd_mm = at_most(pitch * sqrtf(location_variance), FIT_HUGE);
  result->force_sd_N = at_most(result->force_N * sqrtf(force_variance), FIT_HUGE);
  return found > (float)(FIT_MISFIT * FIT_MISFIT) * expected;
}

/* Returns whether the fit has settled with residuals that are rough and no noise. Then outlier is that sensor, or -1. */
static bool fit_once(const struct fit_array *array, const int32_t *pressure_Pa_q10, sensor_map usable, const struct fit_settings *settings,
                     struct fit_result *result, int *outlier) {
  memset(result, 0, sizeof *result);
  *outlier = -1;
  sensor_map all = first_sensors(array->sensor_count);
  usable &= all;
  if (usable != all) {
    result->flags |= CONTACT_FLAG_SENSOR_MASKED;
  }
  struct problem problem;
  problem.array = array;
  problem.settings = settings;
  problem.largest = largest_reading(array, pressure_Pa_q10, usable);
  if (problem.largest <= 0) {
    result->flags |= CONTACT_FLAG_LOW_SIGNAL;
    return false;
  }
  problem.scale = 1.0f / (float)problem.largest;
  problem.unknowns = array->is_line ? PARAMETERS - 1 : PARAMETERS;
  take_samples(pressure_Pa_q10, usable, &problem);
  if (problem.samples.count < problem.unknowns) {
    return false;
  }
  set_known(&problem);
  struct solution solution;
  iterate(&problem, &solution);
  result->used = usable;
  set_values(&problem, &solution, result);
  uint32_t flags = flags_of(&problem, &solution);
  bool misfit = set_errors(&problem, &solution, flags, result);
  if (result->location_sd_mm > fit_location_sd_limit_mm(settings)) {
    flags |= CONTACT_FLAG_UNCERTAIN;
  }
  result->flags |= flags;
  bool rough = solution.squares > FIT_ROUGH_RESIDUAL * FIT_ROUGH_RESIDUAL * problem.sum_squares;
  if (!misfit || !rough || !(solution.moved * array->pitch_mm <= FIT_SETTLED_mm)) {
    return false;
  }
  if (problem.samples.count > problem.unknowns + 1) {
    *outlier = outlier_of(&problem.samples, &problem.dip, &solution.before, &solution.normal, solution.squares, problem.unknowns);
  }
  return true;
}

void fit_general(const struct fit_array *array, const int32_t *pressure_Pa_q10, sensor_map usable, const struct fit_settings *settings,
                 struct fit_result *result) {
  int outlier;
  fit_once(array, pressure_Pa_q10, usable, settings, result, &outlier);
  if (outlier < 0) {
    return;
  }
  struct fit_result without;
  usable &= ~sensor_bit((unsigned)outlier);
  bool rough = fit_once(array, pressure_Pa_q10, usable, settings, &without, &outlier);
  if (fit_is_better_without(settings, result, &without, rough, array->pitch_mm)) {
    *result = without;
  }
}
