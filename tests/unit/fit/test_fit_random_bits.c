/* A million inputs of any bits, fewer for the other size of grid: every result is finite, consistent, and within its
 * documented range. Every input goes through fit_gaussian; one in four, through each kernel by name as well. The number
 * in a failure's message repeats the input. */
#include "common/contact_flags.h"
#include "fit/fit.h"
#include "support/random.h"
#include "support/unit.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

#define INPUTS (FIT_GRID_COLUMNS == 3 ? 1000000 : 200000)
#define ARRAYS 12
#define SEED UINT64_C(0x66696E676572)

static const uint32_t always = CONTACT_FLAG_FIT_VALID | CONTACT_FLAG_UNCERTAINTY_VALID | CONTACT_FLAG_SENSOR_MASKED |
                               CONTACT_FLAG_WIDTHS_VALID | CONTACT_FLAG_ELONGATED;
static const uint32_t warnings =
    CONTACT_FLAG_LOW_SIGNAL | CONTACT_FLAG_FLAT | CONTACT_FLAG_UNCERTAIN | CONTACT_FLAG_MODEL | CONTACT_FLAG_AT_BOUND;

struct input {
  const struct fit_array *array;
  int32_t pressure_Pa_q10[FT_MAX_SENSORS];
  uint32_t usable;
  struct fit_settings settings;
};

static struct fit_array arrays[ARRAYS];

static void make_array(struct fit_array *array, uint8_t count, const float *x_mm, const float *y_mm, float pitch_mm) {
  TEST_ASSERT_EQUAL(FT_OK, fit_array_init(array, count, x_mm, y_mm, pitch_mm));
}

static void make_grid(struct fit_array *array, uint8_t columns, uint8_t rows, float pitch_mm, float x_mm, float y_mm) {
  float x[FT_MAX_SENSORS], y[FT_MAX_SENSORS];
  for (uint8_t k = 0; k < columns * rows; k++) {
    x[k] = x_mm + pitch_mm * (float)(k / rows);
    y[k] = y_mm + pitch_mm * (float)(k % rows);
  }
  make_array(array, (uint8_t)(columns * rows), x, y, pitch_mm);
}

static void make_scattered(struct random *random, struct fit_array *array, uint8_t count, float spread_mm,
                           float pitch_mm) {
  float x[FT_MAX_SENSORS], y[FT_MAX_SENSORS];
  for (uint8_t k = 0; k < count; k++) {
    x[k] = (float)random_between(random, (double)-spread_mm, (double)spread_mm);
    y[k] = (float)random_between(random, (double)-spread_mm, (double)spread_mm);
  }
  make_array(array, count, x, y, pitch_mm);
}

/* The grid that the fixed-point kernel is made for comes first, at three scales. */
static void make_arrays(struct random *random) {
  const uint8_t columns = FIT_GRID_COLUMNS, rows = FIT_GRID_ROWS;
  make_grid(&arrays[0], columns, rows, 9.0f, -9.0f, -18.0f);
  make_grid(&arrays[1], columns, rows, 0.01f, 0.0f, 0.0f);
  make_grid(&arrays[2], columns, rows, 1300.0f, 3000.0f, -9000.0f);
  make_grid(&arrays[3], 4, 1, 6.0f, 0.0f, 0.0f);
  make_grid(&arrays[4], 6, 5, 4.0f, -10.0f, -8.0f);
  make_grid(&arrays[5], 1, 1, 9.0f, 0.0f, 0.0f);
  make_grid(&arrays[6], 2, 2, 9.0f, 0.0f, 0.0f);
  make_scattered(random, &arrays[7], 15, 20.0f, 9.0f);
  make_scattered(random, &arrays[8], FT_MAX_SENSORS, 10000.0f, 0.01f);
  make_scattered(random, &arrays[9], FT_MAX_SENSORS, 0.001f, 10000.0f);
  make_scattered(random, &arrays[10], 7, 1e-30f, 1.0f);
  const float same[5] = {1.0f, 1.0f, 1.0f, 1.0f, 1.0f};
  make_array(&arrays[11], 5, same, same, 2.0f);
}

static int32_t any_bits(struct random *random) { return (int32_t)(random_u32(random) - UINT32_C(0x80000000)); }

static int32_t to_int32(double value) {
  if (!(value > -2147483648.0)) {
    return INT32_MIN;
  }
  return value < 2147483647.0 ? (int32_t)value : INT32_MAX;
}

static int32_t extreme(struct random *random) {
  static const int32_t values[] = {INT32_MIN,     INT32_MIN + 1, -1,      0,       1,      2,
                                   INT32_MAX - 1, INT32_MAX,     1 << 27, 1 << 28, 1 << 30};
  return values[random_below(random, sizeof values / sizeof *values)];
}

/* A Gaussian anywhere near or far, of any width and height, with or without noise. */
static void gaussian(struct random *random, struct input *input) {
  const struct fit_array *array = input->array;
  double reach = exp(random_between(random, -3, 4));
  double x = random_between(random, -reach, reach), y = random_between(random, -reach, reach);
  double sigma = exp(random_between(random, -4, 5));
  double p0 = exp(random_between(random, 0, 25));
  double noise = random_below(random, 2) ? exp(random_between(random, -2, 18)) : 0.0;
  for (uint8_t k = 0; k < array->sensor_count; k++) {
    double dx = (double)(array->x[k] - array->x[0]) - x;
    double dy = (double)(array->y[k] - array->y[0]) - y;
    double p = p0 * exp(-0.5 * (dx * dx + dy * dy) / (sigma * sigma));
    input->pressure_Pa_q10[k] = to_int32(p + noise * random_normal(random));
  }
}

static void draw_readings(struct random *random, struct input *input) {
  uint32_t kind = random_below(random, 10);
  int32_t constant = random_below(random, 2) ? any_bits(random) : extreme(random);
  uint32_t shift = random_below(random, 31);
  uint32_t hot = random_below(random, input->array->sensor_count);
  if (kind >= 7) {
    gaussian(random, input);
    return;
  }
  for (uint8_t k = 0; k < FT_MAX_SENSORS; k++) {
    int32_t *p = &input->pressure_Pa_q10[k];
    switch (kind) {
    case 0:
      *p = any_bits(random);
      break;
    case 1: /* small ones */
      *p = any_bits(random) >> shift;
      break;
    case 2:
      *p = k == hot ? constant : 0;
      break;
    case 3:
      *p = constant;
      break;
    case 4:
      *p = extreme(random);
      break;
    case 5: /* sparse */
      *p = random_below(random, 4) ? 0 : any_bits(random);
      break;
    default: /* Cauchy */
      *p = to_int32(ldexp(tan(random_between(random, -1.5707963, 1.5707963)), (int)shift));
      break;
    }
  }
}

static float any_float(struct random *random) {
  float value;
  uint32_t bits = random_u32(random);
  static const uint32_t special[] = {0,          0x80000000, 1,          0x7FFFFF,   0x800000,
                                     0x7F7FFFFF, 0x7F800000, 0xFF800000, 0x7FC00000, 0x7F800001};
  if (random_below(random, 4) == 0) {
    bits = special[random_below(random, sizeof special / sizeof *special)];
  }
  memcpy(&value, &bits, sizeof value);
  return value;
}

static int32_t any_q15(struct random *random) { return (int32_t)random_below(random, 65535) - 32767; }

static struct input draw(uint32_t number) {
  struct random random = {SEED + number * UINT64_C(0x9E3779B97F4A7C15)};
  random_u64(&random);
  struct input input;
  memset(&input, 0, sizeof input);
  /* Half of them on the arrays that the fixed-point kernel takes. */
  input.array = &arrays[random_below(&random, random_below(&random, 2) ? 3 : ARRAYS)];
  input.usable = random_below(&random, 2) ? UINT32_MAX : random_u32(&random);
  if (random_below(&random, 4) == 0) {
    input.usable |= random_u32(&random) | random_u32(&random);
  }
  draw_readings(&random, &input);
  struct fit_settings *settings = &input.settings;
  settings->iterations = (uint8_t)random_below(&random, random_below(&random, 8) ? 8 : 21);
  settings->noise_Pa_q10 = (int32_t)(random_u32(&random) >> (1 + random_below(&random, 31)));
  settings->noise_Pa_q10 += settings->noise_Pa_q10 == 0;
  for (int k = 0; k < FT_MAX_SENSORS && random_below(&random, 8); k++) { /* of some sensors */
    settings->gain_sd_q16[k] = (uint16_t)(random_u32(&random) >> random_below(&random, 16));
    settings->past_sd_Pa_q10[k] = (int32_t)(random_u32(&random) >> (3 + random_below(&random, 29)));
  }
  settings->model_sd_q16 = (uint16_t)(random_u32(&random) >> random_below(&random, 32));
  settings->cut_noises = random_below(&random, 2) ? 0 : (uint8_t)random_u32(&random);
  if (random_below(&random, 4) == 0) {
    bool any = random_below(&random, 2);
    settings->dip_share = any ? any_float(&random) : (float)random_between(&random, 0.0, 0.1);
    settings->dip_sd_mm = any ? any_float(&random) : (float)random_between(&random, 1.0, 100.0);
  }
  if (random_below(&random, 4) == 0) {
    static struct fit_own own[FT_MAX_SENSORS];
    for (int k = 0; k < FT_MAX_SENSORS; k++) {
      own[k] = (struct fit_own){any_q15(&random), any_q15(&random), any_q15(&random)};
    }
    settings->own = own;
  }
  switch (random_below(&random, 4)) {
  case 0:
    settings->prior_sigma_mm = any_float(&random);
    settings->prior_width_mm = any_float(&random);
    break;
  case 1:
    settings->prior_sigma_mm = (float)exp(random_between(&random, -5, 7));
    settings->prior_width_mm = (float)exp(random_between(&random, -5, 7));
    break;
  default:
    break;
  }
  return input;
}

static bool is_zero(const struct fit_result *result) {
  struct fit_result zero;
  memset(&zero, 0, sizeof zero);
  zero.flags = result->flags;
  return memcmp(&zero, result, sizeof zero) == 0;
}

/* What is wrong with it, or NULL. */
static const char *complaint(const struct input *input, const struct fit_result *result) {
  const struct fit_array *array = input->array;
  const uint32_t all = UINT32_MAX >> (FT_MAX_SENSORS - array->sensor_count);
  const float slack = 1e-5f, huge = 1e30f;
  if (result->flags & ~(always | warnings)) {
    return "an undefined flag";
  }
  const bool outlier = (result->flags & CONTACT_FLAG_FIT_VALID) && result->used != (input->usable & all);
  const bool masked = outlier || (input->usable & all) != all;
  if (!(result->flags & CONTACT_FLAG_SENSOR_MASKED) == masked) {
    return "SENSOR_MASKED";
  }
  if (!(result->flags & CONTACT_FLAG_FIT_VALID)) {
    return is_zero(result) ? NULL : "a member is not zero without a fit";
  }
  if (!(result->flags & CONTACT_FLAG_UNCERTAINTY_VALID)) {
    return "a fit without its uncertainty";
  }
  if (result->used == 0 || (result->used & ~(input->usable & all))) {
    return "used";
  }
  const float pitch = array->pitch_mm, sigma_mm = result->sigma_mm;
  const float x_slack = slack * (fabsf(array->x_min) + fabsf(array->x_max));
  const float y_slack = slack * (fabsf(array->y_min) + fabsf(array->y_max));
  const float force = 6.28318531e-6f * result->p0_Pa * sigma_mm * sigma_mm;
  const bool saturated = result->p0_Pa >= 1e9f || result->force_N >= 1e9f;
  const bool widths = result->flags & CONTACT_FLAG_WIDTHS_VALID;
  const float least = widths ? 0.2f * sigma_mm : 0.0f, most = widths ? 5.0f * sigma_mm : 0.0f;
  const struct {
    const char *name;
    float value, low, high;
  } ranges[] = {
      {"x is outside its box", result->x_mm / pitch, array->x_min - x_slack, array->x_max + x_slack},
      {"y is outside its box", result->y_mm / pitch, array->y_min - y_slack, array->y_max + y_slack},
      {"sigma", sigma_mm / pitch, FIT_SIGMA_MIN * 0.999f, FIT_SIGMA_MAX * 1.001f},
      {"p0", result->p0_Pa, 1e-6f, 1e14f},
      {"the force is not 2 pi p0 sigma^2", saturated ? force : result->force_N, 0.999f * force, 1.001f * force},
      {"residual", result->residual_rms_Pa, 0.0f, 1e13f},
      {"standard deviation", result->location_sd_mm, 0.0f, huge},
      {"standard deviation of the force", result->force_sd_N, 0.0f, huge},
      {"what the noise moves", result->location_noise_mm, 0.0f, huge},
      {"width along x", result->sigma_x_mm, least, most},
      {"width along y", result->sigma_y_mm, least, most},
      {"correlation", result->width_correlation, widths ? -1.0f : 0.0f, widths ? 1.0f : 0.0f},
  };
  for (size_t i = 0; i < sizeof ranges / sizeof *ranges; i++) {
    if (!(ranges[i].value >= ranges[i].low && ranges[i].value <= ranges[i].high)) {
      return ranges[i].name;
    }
  }
  return NULL;
}

static void judge(uint32_t number, const char *kernel, const struct input *input, const struct fit_result *result) {
  const char *wrong = complaint(input, result);
  CHECK(wrong == NULL, "input %u, %s: %s; x %g y %g sigma %g p0 %g force %g rms %g sd %g %g flags %x", (unsigned)number,
        kernel, wrong ? wrong : "", (double)result->x_mm, (double)result->y_mm, (double)result->sigma_mm,
        (double)result->p0_Pa, (double)result->force_N, (double)result->residual_rms_Pa, (double)result->location_sd_mm,
        (double)result->force_sd_N, (unsigned)result->flags);
}

TEST(test_any_bits_give_finite_consistent_results) {
  struct random random = {SEED};
  make_arrays(&random);
  uint32_t fits = 0, plain_grids = 0;
  for (uint32_t number = 0; number < INPUTS; number++) {
    struct input input = draw(number);
    struct fit_result result;
    memset(&result, 0xFF, sizeof result);
    fit_gaussian(input.array, input.pressure_Pa_q10, input.usable, &input.settings, &result);
    judge(number, "fit_gaussian", &input, &result);
    fits += (result.flags & CONTACT_FLAG_FIT_VALID) != 0;
    if (number % 4 != 0) {
      continue;
    }
    memset(&result, 0xFF, sizeof result);
    fit_general(input.array, input.pressure_Pa_q10, input.usable, &input.settings, &result);
    judge(number, "fit_general", &input, &result);
    if (input.array < &arrays[3]) {
      plain_grids++;
      input.usable = UINT32_MAX;
      memset(&result, 0xFF, sizeof result);
      fit_grid(input.array, input.pressure_Pa_q10, &input.settings, &result);
      judge(number, "fit_grid", &input, &result);
    }
  }
  TEST_ASSERT_GREATER_THAN_UINT32(INPUTS / 2, fits);
  TEST_ASSERT_GREATER_THAN_UINT32(INPUTS / 8, plain_grids);
}
