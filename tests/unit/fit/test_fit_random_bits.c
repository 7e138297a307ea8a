/* Inputs of any bits: every result is finite, consistent, and within its documented range, and the build's sanitizers find nothing. Every
 * input goes through fit_gaussian; some, as frames that follow each other, through all that is computed of a frame. The number in a
 * failure's message repeats the input. RANDOM_BITS, if set, is the number of inputs and the seed. */
#include "common/calibration.h"
#include "common/contact_flags.h"
#include "condition/plausibility.h"
#include "contact/motion.h"
#include "contact/shapes.h"
#include "fit/fit_bias.h"
#include "fit/fit_gains.h"
#include "pad_press.h"

#include <inttypes.h>
#include <stdlib.h>

#define ARRAYS 14
#define RECTANGLES 7 /* of these */
#define SENSORS_MOST 32

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
static uint64_t seed = UINT64_C(0x66696E676572);
static uint32_t inputs = RANDOM_BITS_INPUTS;

void setUp(void) {
  const char *said = getenv("RANDOM_BITS");
  TEST_ASSERT_TRUE(!said || sscanf(said, "%" SCNu32 " %" SCNu64, &inputs, &seed) == 2);
}

static void make_array(struct fit_array *array, uint8_t count, const float *x_mm, const float *y_mm, float pitch_mm) {
  fit_array_init_grid(array, count, x_mm, y_mm, pitch_mm);
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

static void make_scattered(struct random *random, struct fit_array *array, uint8_t count, float spread_mm, float pitch_mm) {
  float x[FT_MAX_SENSORS], y[FT_MAX_SENSORS];
  for (uint8_t k = 0; k < count; k++) {
    x[k] = (float)random_between(random, (double)-spread_mm, (double)spread_mm);
    y[k] = (float)random_between(random, (double)-spread_mm, (double)spread_mm);
  }
  make_array(array, count, x, y, pitch_mm);
}

/* The firmware's own grid comes first, at three scales, then other rectangles. */
static void make_arrays(struct random *random) {
  make_grid(&arrays[0], 3, 5, 9.0f, -9.0f, -18.0f);
  make_grid(&arrays[1], 3, 5, 0.01f, 0.0f, 0.0f);
  make_grid(&arrays[2], 3, 5, 1300.0f, 3000.0f, -9000.0f);
  make_grid(&arrays[3], 6, 5, 9.0f, -22.5f, -18.0f);
  make_grid(&arrays[4], 4, 4, 6.0f, -10.0f, -8.0f);
  make_grid(&arrays[5], 2, 4, 9.0f, -4.5f, -13.5f);
  make_grid(&arrays[6], 2, 2, 9.0f, 0.0f, 0.0f);
  make_grid(&arrays[12], 4, 1, 6.0f, 0.0f, 0.0f);
  make_grid(&arrays[13], 1, 1, 9.0f, 0.0f, 0.0f);
  make_scattered(random, &arrays[7], 15, 20.0f, 9.0f);
  make_scattered(random, &arrays[8], SENSORS_MOST, 10000.0f, 0.01f);
  make_scattered(random, &arrays[9], SENSORS_MOST, 0.001f, 10000.0f);
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
  static const int32_t values[] = {INT32_MIN, INT32_MIN + 1, -1, 0, 1, 2, INT32_MAX - 1, INT32_MAX, 1 << 27, 1 << 28, 1 << 30};
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
  for (uint8_t k = 0; k < SENSORS_MOST; k++) {
    int32_t *p = &input->pressure_Pa_q10[k];
    switch (kind) {
    case 0: *p = any_bits(random); break;
    case 1: /* small ones */ *p = any_bits(random) >> shift; break;
    case 2: *p = k == hot ? constant : 0; break;
    case 3: *p = constant; break;
    case 4: *p = extreme(random); break;
    case 5: /* sparse */ *p = random_below(random, 4) ? 0 : any_bits(random); break;
    default: /* Cauchy */ *p = to_int32(ldexp(tan(random_between(random, -1.5707963, 1.5707963)), (int)shift)); break;
    }
  }
}

static float any_float(struct random *random) {
  float value;
  uint32_t bits = random_u32(random);
  static const uint32_t special[] = {0, 0x80000000, 1, 0x7FFFFF, 0x800000, 0x7F7FFFFF, 0x7F800000, 0xFF800000, 0x7FC00000, 0x7F800001};
  if (random_below(random, 4) == 0) {
    bits = special[random_below(random, sizeof special / sizeof *special)];
  }
  memcpy(&value, &bits, sizeof value);
  return value;
}

static int32_t any_q15(struct random *random) { return (int32_t)random_below(random, 65535) - 32767; }

/* on: this array, or any where NULL. */
static struct input draw(uint32_t number, const struct fit_array *on) {
  struct random random = {seed + number * UINT64_C(0x9E3779B97F4A7C15)};
  random_u64(&random);
  struct input input = {0};
  /* Half of them on the arrays that the fixed-point kernel takes. */
  input.array = &arrays[random_below(&random, random_below(&random, 2) ? RECTANGLES : ARRAYS)];
  input.array = on ? on : input.array;
  input.usable = random_below(&random, 2) ? UINT32_MAX : random_u32(&random);
  if (random_below(&random, 4) == 0) {
    input.usable |= random_u32(&random) | random_u32(&random);
  }
  draw_readings(&random, &input);
  struct fit_settings *settings = &input.settings;
  settings->iterations = (uint8_t)random_below(&random, random_below(&random, 8) ? 8 : 21);
  settings->noise_Pa_q10 = (int32_t)(random_u32(&random) >> (1 + random_below(&random, 31)));
  settings->noise_Pa_q10 += random_below(&random, 32) != 0 && settings->noise_Pa_q10 == 0;
  for (int k = 0; k < SENSORS_MOST && random_below(&random, 8); k++) { /* of some sensors */
    settings->gain_sd_q16[k] = (uint16_t)(random_u32(&random) >> random_below(&random, 16));
    settings->hysteresis_sd_Pa_q10[k] = (int32_t)(random_u32(&random) >> (3 + random_below(&random, 29)));
  }
  settings->model_sd_q16 = (uint16_t)(random_u32(&random) >> random_below(&random, 32));
  settings->clip_below_sds = random_below(&random, 2) ? 0 : (uint8_t)random_u32(&random);
  if (random_below(&random, 4) == 0) {
    bool any = random_below(&random, 2);
    settings->dip_share = any ? any_float(&random) : (float)random_between(&random, 0.0, 0.1);
    settings->dip_sd_mm = any ? any_float(&random) : (float)random_between(&random, 1.0, 100.0);
  }
  if (random_below(&random, 4) == 0) {
    static struct fit_deviation own[FT_MAX_SENSORS];
    for (int k = 0; k < SENSORS_MOST; k++) {
      own[k] = (struct fit_deviation){any_q15(&random), any_q15(&random), any_q15(&random)};
    }
    settings->deviations = own;
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
  default: break;
  }
  return input;
}

static bool is_zero(const struct fit_result *result) {
  const struct fit_result zero = {.flags = result->flags};
  return memcmp(&zero, result, sizeof zero) == 0;
}

/* What is wrong with it, or NULL. */
static const char *complaint(const struct input *input, const struct fit_result *result) {
  const struct fit_array *array = input->array;
  const uint32_t all = UINT32_MAX >> (SENSORS_MOST - array->sensor_count);
  const float slack = 1e-5f, huge = 1e30f;
  if (input->settings.noise_Pa_q10 < 1) {
    return !(result->flags & CONTACT_FLAG_FIT_VALID) && is_zero(result) ? NULL : "a fit without noise";
  }
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
  CHECK(wrong == NULL, "input %u, %s: %s; flags %x", (unsigned)number, kernel, wrong ? wrong : "", (unsigned)result->flags);
}

TEST(test_any_bits_give_finite_consistent_results) {
  struct random random = {seed};
  make_arrays(&random);
  uint32_t fits = 0;
  for (uint32_t number = 0; number < inputs; number++) {
    struct input input = draw(number, NULL);
    struct fit_result result;
    memset(&result, 0xFF, sizeof result);
    fit_gaussian(input.array, input.pressure_Pa_q10, input.usable, &input.settings, &result);
    judge(number, "fit_gaussian", &input, &result);
    fits += (result.flags & CONTACT_FLAG_FIT_VALID) != 0;
  }
  TEST_ASSERT_GREATER_THAN_UINT32(inputs / 2, fits);
}

static uint32_t calls;

/* All that is kept of one fingertip, and what is new in a frame. */
static struct {
  struct random random;
  struct fit_outlier_state outliers;
  struct fit_bias bias;
  struct fit_gains gains;
  struct fit_settings settings;
  struct fit_result fit;
  struct tangential_job tangential;
  struct tangential_settings scales;
  struct tangential_history history;
  struct shapes_job shapes;
  struct slip_history slip;
  struct motion_history motion;
  struct pad_press rubber;
  struct condition condition;
  struct plausibility plausibility;
  struct frame frame;
} tip;

static double any(double low, double high) { return random_between(&tip.random, low, high); }

static uint32_t below(uint32_t limit) { return random_below(&tip.random, limit); }

static bool are_finite(const void *values, size_t bytes) {
  bool good = true;
  for (size_t k = 0; k < bytes / sizeof(float); k++) {
    good = good && isfinite(((const float *)values)[k]);
  }
  return good;
}
#define FINITE(object) are_finite(&(object), sizeof(object))

/* Of any thickness, narrower or wider, with any ends. */
static void draw_pad(void) {
  struct pad_profile profile;
  do {
    profile = pad_of_12_mm();
    const float by = (float)any(0.4, 1.7), wider = (float)exp(any(-0.4, 0.4));
    for (int j = 0; j < PAD_TANGENTIAL_TERMS; j++) {
      profile.normal[j % PAD_NORMAL_TERMS].sd_mm = pad_of_12_mm().normal[j % PAD_NORMAL_TERMS].sd_mm * by * wider;
      profile.tangential[j].sd_mm *= by * wider;
      profile.tangential[j].moment_mm *= by * (float)exp(any(-1, 0.5));
      ((float *)&profile.edges)[below(PAD_EDGE_FLOATS)] = (float)any((double)-PAD_EDGE_MAX, (double)PAD_EDGE_MAX);
    }
    profile.spread_mm2 = (float)any(0, 100);
    profile.spread_sd_mm2 = (float)exp(any(log(0.11), log(99)));
    profile.from_touch = (uint8_t)below(2);
    tangential_configure(&tip.scales, &profile, &(struct contact_settings){0.75f, 0, (float)any(0.1, 10), 1.0f}, (int32_t)below(4002) - 1);
  } while (fit_pad_init(&tip.tangential.pad, tip.tangential.array, &profile) != FT_OK ||
           fit_shapes_init(&tip.shapes.pad, tip.tangential.array, &profile) != FT_OK);
  tip.rubber.profile = profile;
}

static void press(int32_t *readings) {
  const double far = any(0, 1), force_N = exp(any(-6, 5)), q_N = force_N * pow(any(0, 1.5), 3);
  const struct contact contact = {far * any(-28, 28), far * any(-32, 32), force_N, q_N, any(-1, 1) * q_N, any(0, 8)};
  for (int k = 0; k < GRID_SENSORS; k++) {
    readings[k] = to_int32(1024.0 * pad_press_Pa(&tip.rubber, &contact, k));
  }
}

static void begin(uint32_t number) {
  memset(&tip, 0, sizeof tip);
  tip.random = (struct random){seed + number};
  random_u64(&tip.random);
  tip.shapes.array = tip.tangential.array = &arrays[below(2) ? 0 : 3 + below(RECTANGLES - 3)];
  draw_pad();
  fit_gains_begin(&tip.gains, (float)any(0.0, 0.5));
  fit_gains_end_touch(&tip.gains);
  fit_bias_begin(&tip.bias);
  tangential_reset(&tip.history);
  tip.scales.location_sd_limit_mm = FIT_LOCATION_SD_LIMIT_mm;
  condition_start(&tip.condition);
  tip.plausibility.apart_Pa = 5000;
}

static void condition_any(const struct input *input) {
  struct frame *frame = &tip.frame;
  struct condition_gains gains;
  struct conditioned found;
  frame->sensor_count = (uint8_t)(1 + below(SENSORS_MOST));
  const uint32_t all = UINT32_MAX >> (SENSORS_MOST - frame->sensor_count);
  frame->valid = input->usable & all;
  frame->saturated = below(4) ? 0 : random_u32(&tip.random) & frame->valid;
  frame->doubtful = random_u32(&tip.random) & random_u32(&tip.random) & frame->valid;
  frame->unsettled = below(4) ? 0 : random_u32(&tip.random) & frame->valid;
  frame->restored = below(8) ? 0 : random_u32(&tip.random) & all;
  frame->renewed = below(8) ? 0 : random_u32(&tip.random) & all;
  frame->noise_Pa_q10 = (int32_t)(1 + below(20000));
  for (int k = 0; k < frame->sensor_count; k++) {
    frame->pressure_Pa_q10[k] = below(2) ? input->pressure_Pa_q10[k] : frame->pressure_Pa_q10[k];
    gains.inverse_q16[k] = 16384 + below(262144 - 16384 + 1);
  }
  if (below(200) == 0) {
    condition_tare(&tip.condition);
  }
  condition_frame(&tip.condition, frame, below(2) ? &gains : NULL, &found);
  condition_follow(&tip.condition, frame, &found);
  plausibility_compare(&tip.plausibility, frame, &found);
  TEST_ASSERT_EQUAL_HEX32(0, found.usable & ~(frame->valid & ~frame->saturated));
  int32_t peak = 0;
  for (int k = 0; k < frame->sensor_count; k++) {
    TEST_ASSERT_TRUE(found.usable >> k & 1u || found.pressure_Pa_q10[k] == 0);
    peak = found.pressure_Pa_q10[k] > peak ? found.pressure_Pa_q10[k] : peak;
  }
  TEST_ASSERT_EQUAL_INT32(peak, found.peak_Pa_q10);
  calls += 3;
}

/* What becomes of a contact: by the firmware in the same order. */
static void fit_any(uint32_t number, const struct input *input, bool begins) {
  const int32_t *readings = input->pressure_Pa_q10;
  struct fit_result fit;
  struct fit_settings *settings = &tip.settings;
  *settings = input->settings;
  settings->clip_below_sds = 0;
  settings->location_sd_limit_mm = 0.0f;
  void (*const plain[])(const struct fit_array *, const int32_t *, uint32_t, const struct fit_settings *,
                        struct fit_result *) = {fit_gaussian_grid, fit_gaussian_grid_plain, fit_gaussian_grid_small, fit_general};
  for (size_t k = 0; k < sizeof plain / sizeof *plain - (settings->noise_Pa_q10 < 1); k++) { /* the last one needs noise */
    plain[k](input->array, readings, input->usable, settings, &fit);
    judge(number, "a kernel of the grid", input, &fit);
  }
  struct fit_outlier_state outliers = tip.outliers;
  fit_gaussian_grid_update(input->array, readings, input->usable, settings, &outliers, &fit);
  fit_gaussian_update(input->array, readings, input->usable, settings, &tip.outliers, &fit);
  fit_bias_add(&tip.bias, input->array, settings, &fit);
  tip.fit = fit;
  tip.tangential.question = (struct tangential_question){begins, 0, tip.frame.t_us, readings, settings, &tip.fit};
  tangential_estimate(&tip.tangential);
  struct shapes_question *question = &tip.shapes.question;
  if (begins || tip.shapes.progress != FIT_SHAPES_UNFINISHED) {
    *question = (struct shapes_question){.begins = begins, .t_us = tip.frame.t_us, .settings = *settings, .fit = fit, .force_scale = 1.0f};
    memcpy(question->pressure_Pa_q10, readings, sizeof question->pressure_Pa_q10);
  }
  question->parts = below(8) ? 1 : FIT_SHAPES_FRAMES * FIT_SHAPES_PARTS;
  shapes_estimate(&tip.shapes);
  calls += tip.shapes.progress != FIT_SHAPES_UNFINISHED &&
           (fit_shapes(input->array, &tip.shapes.pad, readings, settings, &fit, &tip.shapes.state, &tip.shapes.result), true);
  const struct contact_settings scales = {0.75f, 100000, tip.scales.force_scale, tip.scales.force_scale_sd};
  const struct contact_input of_frame = {
      .t_us = tip.frame.t_us, .contact = true, .tared = true, .fit = &fit, .tangential = &tip.tangential.estimate};
  struct contact_result result;
  struct tangential_force force;
  struct motion motion;
  contact_update(&tip.slip, &scales, &of_frame, &result);
  tangential_update(&tip.history, &tip.scales, &of_frame, &result, &force);
  motion_update(&tip.motion, &tip.scales, &of_frame, &result, &motion);
  const struct contact_force weighed = contact_scale_force(&scales, &fit, 1e9f);
  const struct shapes_location place =
      shapes_locate(&tip.shapes.report, &fit, result.flags & CONTACT_FLAG_TANGENTIAL_VALID ? &force : NULL);
  fit_bias_step(&tip.bias, input->array, readings, settings, &fit);
  fit_gains_learn(&tip.gains, input->array, readings, settings, &fit);
  const struct fit_tangential *found = &tip.tangential.estimate;
  bool good = are_finite(&found->x_mm, 9 * sizeof(float)) && FINITE(force) && FINITE(weighed) && FINITE(motion) && FINITE(place) &&
              FINITE(tip.shapes.report.contact) && FINITE(tip.shapes.report.edge_length_mm) && isfinite(fit_gains_sd(&tip.gains)) &&
              shapes_parts(tip.frame.t_us) > 0 && (shapes_flags(&tip.shapes.report) & CONTACT_FLAG_FIT_VALID) == 0;
  static const struct fit_tangential none;
  good = good && (found->valid ? (fit.flags & CONTACT_FLAG_FIT_VALID) && found->force_N > 0.0f && found->q_sd_N > 0.0f
                               : memcmp(found, &none, sizeof none) == 0);
  CHECK(good, "input %u: what follows the fit", (unsigned)number);
  calls += 19;
}

TEST(test_any_bits_of_frames_that_follow_each_other) {
  make_arrays(&(struct random){seed});
  uint32_t estimates = 0, shapes = 0;
  for (uint32_t number = 0; number < inputs; number += 8) {
    if (number % 512 == 0) {
      begin(number);
    }
    struct input input = draw(number, tip.tangential.array);
    if (below(2)) {
      press(input.pressure_Pa_q10);
    }
    if (below(4)) { /* as the firmware has them, nearly */
      struct fit_settings *settings = &input.settings;
      *settings = (struct fit_settings){.iterations = 4, .noise_Pa_q10 = (int32_t)(1 + below(1u << below(18)))};
      settings->prior_sigma_mm = (float)any(0, 20);
      settings->prior_width_mm = (float)any(0, 40) * (float)below(2);
      settings->dip_share = below(2) ? 0.0f : (float)any(0, 0.1);
      settings->dip_sd_mm = (float)any(5, 40);
      fit_set_errors(settings, (float)any(0, 0.1) * (float)below(2), 0.0065f * (float)below(2));
    }
    const uint32_t period_us = random_u32(&tip.random) >> below(32);
    const uint32_t count = below(4) ? 1 : 1 + below(2 * FIT_SHAPES_FRAMES);
    for (uint32_t n = 0; n < count; n++) {
      tip.frame.t_us += 1 + (below(2) ? period_us : 1000);
      condition_any(&input);
      fit_any(number, &input, n == 0 && below(2));
      estimates += tip.tangential.estimate.valid;
      shapes += tip.shapes.report.shape != FIT_SHAPE_UNDECIDED;
    }
    struct calibration calibration;
    for (size_t k = 0; k < sizeof calibration; k++) {
      ((uint8_t *)&calibration)[k] = (uint8_t)random_u32(&tip.random);
    }
    calibration_is_valid(&calibration, SENSORS_MOST);
  }
  printf("%u calls\n", (unsigned)calls);
  TEST_ASSERT_TRUE(estimates > calls / 1000 && shapes > calls / 1000);
}
