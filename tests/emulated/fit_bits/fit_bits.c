#include "fit_bits.h"

#include "common/crc32.h"
#include "config/geometry.h"
#include "fit/fit.h"
#include "fit/fit_bias.h"
#include "fit/fit_shapes.h"
#include "fit/fit_tangential.h"
#include "support/draw.h"

#include <stdbool.h>
#include <string.h>

#define LAYOUTS 4
#define PADS 4
#define FRAMES 4 /* of one contact */
#define SHAPES_FRAMES (FIT_SHAPES_FRAMES + 2)
#define ONE_Q16 65536

static struct fit_array layouts[LAYOUTS];
static struct fit_pad pads[PADS];
static struct fit_shapes_pad shapes_pad;

static void stop_unless(enum ft_status status) {
  while (status != FT_OK) {
  }
}

/* Silicone's, the products exact or rounded alike everywhere. */
#define SENSORS_MOST 32 /* on every machine */

static struct pad_profile layer_of(float thickness_mm) {
  return (struct pad_profile){
      .thickness_mm = thickness_mm,
      .normal = {{0.09625f, 0.297f * thickness_mm}, {0.8206f, 0.4783f * thickness_mm}},
      .tangential = {{0.0877f * thickness_mm, 0.4f * thickness_mm},
                     {0.3346f * thickness_mm, 0.657f * thickness_mm},
                     {0.4539f * thickness_mm, 1.652f * thickness_mm}},
      .spread_mm2 = 4.0f,
      .spread_sd_mm2 = 6.0f,
      .force_ratio = 1.0f,
      .tangential_scale = 1.0f,
  };
}

void fit_bits_init(void) {
  float x_mm[FT_MAX_SENSORS], y_mm[FT_MAX_SENSORS];
  stop_unless(fit_array_init(&layouts[0], geometry.sensor_count, geometry.x_mm, geometry.y_mm, geometry.pitch_mm));
  for (int k = 0; k < 4; k++) { /* a line */
    x_mm[k] = 6.0f * (float)k;
    y_mm[k] = 3.0f;
  }
  stop_unless(fit_array_init(&layouts[1], 4, x_mm, y_mm, 6.0f));
  for (int k = 0; k < 19; k++) { /* rows that are shifted against each other */
    x_mm[k] = 7.0f * (float)(k % 5) + 3.5f * (float)(k / 5 % 2) - 14.0f;
    y_mm[k] = 6.0625f * (float)(k / 5) - 9.0f;
  }
  stop_unless(fit_array_init(&layouts[2], 19, x_mm, y_mm, 7.0f));
  draw_from(1);
  for (int k = 0; k < SENSORS_MOST; k++) { /* anywhere, some of them twice */
    x_mm[k] = k % 8 == 7 ? x_mm[k - 1] : (float)draw_between(-320, 320) / 16.0f;
    y_mm[k] = k % 8 == 7 ? y_mm[k - 1] : (float)draw_between(-320, 320) / 16.0f;
  }
  stop_unless(fit_array_init(&layouts[3], SENSORS_MOST, x_mm, y_mm, 8.0f));
  for (int k = 0; k < PADS; k++) {
    const struct pad_profile profile = layer_of(5.0f * (float)(k + 1));
    stop_unless(fit_pad_init(&pads[k], &layouts[0], &profile));
  }
  const struct pad_profile profile = layer_of(12.0f);
  stop_unless(fit_shapes_init(&shapes_pad, &layouts[0], &profile));
}

/* 2^-z, z in Q16, in Q30: a parabola between the powers, 0.3 % off. */
static int64_t exp2_negative_q30(int64_t z_q16) {
  int64_t whole = z_q16 >> 16, f = z_q16 & 0xFFFF;
  if (whole > 40) {
    return 0;
  }
  int64_t value_q32 = (INT64_C(1) << 32) - f * 43035 + ((f * f) >> 16) * 10267;
  return value_q32 >> (2 + whole);
}

static int32_t to_int32(int64_t value) { return value > INT32_MAX ? INT32_MAX : value < INT32_MIN ? INT32_MIN : (int32_t)value; }

/* A press near the array, of every width and height, and its noise. */
static void draw_press(const struct fit_array *array, int64_t height_q16, int32_t noise, int32_t *pressure_Pa_q10) {
  uint8_t last = (uint8_t)(array->sensor_count - 1);
  int32_t x = draw_between((int32_t)(array->x[0] * 65536.0f) - ONE_Q16, (int32_t)(array->x[last] * 65536.0f) + ONE_Q16);
  int32_t y = draw_between((int32_t)(array->y[0] * 65536.0f) - ONE_Q16, (int32_t)(array->y[last] * 65536.0f) + ONE_Q16);
  int64_t peak = (int64_t)draw_between(ONE_Q16, 2 * ONE_Q16) << draw_between(0, 14);
  for (uint8_t k = 0; k <= last; k++) {
    int64_t dx = (int64_t)(array->x[k] * 65536.0f) - x;
    int64_t dy = (int64_t)(array->y[k] * 65536.0f) - y;
    int64_t z_q16 = (((dx * dx + dy * dy) >> 16) * height_q16) >> 16;
    int64_t value = (peak * exp2_negative_q30(z_q16)) >> 30;
    int32_t four = 0;
    for (int i = 0; i < 4; i++) {
      four += draw_between(-noise, noise);
    }
    pressure_Pa_q10[k] = to_int32(value + four);
  }
}

/* Makes a press one that pulls: more ahead of it than behind. */
static void pull(const struct fit_array *array, int32_t *pressure_Pa_q10) {
  int32_t x = draw_between(-ONE_Q16 / 8, ONE_Q16 / 8), y = draw_between(-ONE_Q16 / 8, ONE_Q16 / 8);
  for (uint8_t k = 0; k < array->sensor_count; k++) {
    int64_t more = (int64_t)(array->x[k] * 65536.0f) * x + (int64_t)(array->y[k] * 65536.0f) * y;
    int64_t part = pressure_Pa_q10[k] * (more >> 16) >> 16;
    pressure_Pa_q10[k] = to_int32(pressure_Pa_q10[k] + part);
  }
}

/* A press, every other time with a second one, held for as many frames as an answer takes. */
static uint32_t bits_of_shapes(const struct fit_array *array, uint32_t usable, const struct fit_settings *settings,
                               int32_t *pressure_Pa_q10) {
  struct fit_result fit;
  struct fit_shapes_state state;
  static struct fit_shapes_result found[SHAPES_FRAMES];
  memset(&fit, 0, sizeof fit);
  memset(&state, 0, sizeof state);
  memset(found, 0, sizeof found);
  for (int frame = 0; frame < SHAPES_FRAMES; frame++) {
    struct fit_shapes_result *result = &found[frame];
    fit_gaussian(array, pressure_Pa_q10, usable, settings, &fit);
    if (!fit_shapes(array, &shapes_pad, pressure_Pa_q10, settings, &fit, &state, result)) {
      memset(result, 0xFF, sizeof *result);
    }
    for (uint8_t k = 0; k < array->sensor_count; k++) {
      pressure_Pa_q10[k] -= pressure_Pa_q10[k] / 256 * draw_between(0, 1);
    }
  }
  return crc32_iso_hdlc((const uint8_t *)found, sizeof found) ^ crc32_iso_hdlc((const uint8_t *)&state.at, sizeof state.at);
}

uint32_t fit_bits_of(enum fit_bits_kernel kernel, uint32_t press) {
  draw_from(UINT64_C(0x9E3779B97F4A7C15) * (press + 1) ^ (uint64_t)kernel);
  draw();
  bool other = (kernel == FIT_BITS_GENERAL && press % 2) || (kernel == FIT_BITS_BIAS && press % 16 == 1);
  const struct fit_array *array = &layouts[other ? draw_between(1, LAYOUTS - 1) : 0];

  const bool on_a_pad = kernel == FIT_BITS_TANGENTIAL || kernel == FIT_BITS_SHAPES;
  struct fit_settings settings;
  memset(&settings, 0, sizeof settings);
  settings.iterations = (uint8_t)(press % 4 ? 7 : draw_between(0, 12));
  settings.noise_Pa_q10 = draw_between(1, (on_a_pad ? 4 : 32) * 1024);
  if (press % 3 == 0) {
    settings.prior_sigma_mm = (float)draw_between(1, 256) / 16.0f;
    settings.prior_width_mm = (float)draw_between(1, 64) / 32.0f;
  }
  if (kernel != FIT_BITS_TANGENTIAL && press % 5 == 1) {
    settings.clip_below_sds = 4;
    settings.dip_share = (float)draw_between(1, 100) / 1024.0f;
    settings.dip_sd_mm = (float)draw_between(4, 64);
  }

  struct fit_deviation own[FT_MAX_SENSORS];
  if (press % 7 == 2) { /* on a pad so little that an estimate is still reported */
    const int32_t most_q15 = on_a_pad ? 300 : 9000;
    for (int k = 0; k < SENSORS_MOST; k++) {
      own[k].off_x_q15 = draw_between(-most_q15 / 4, most_q15 / 4);
      own[k].off_y_q15 = draw_between(-most_q15 / 4, most_q15 / 4);
      own[k].wider_q15 = draw_between(-most_q15, most_q15);
    }
    settings.deviations = own;
  }

  if (press % 2) {
    for (int k = 0; k < SENSORS_MOST; k++) {
      settings.gain_sd_q16[k] = (uint16_t)(draw_between(0, 1 << 16) >> draw_between(1, 12));
      settings.hysteresis_sd_Pa_q10[k] = draw_between(0, 1 << 20) >> draw_between(0, 12);
    }
    settings.model_sd_q16 = (uint16_t)(draw_between(0, 1 << 14) >> draw_between(0, 8));
  }

  int32_t pressure_Pa_q10[FT_MAX_SENSORS] = {0};
  if (press % 16 == 15) { /* nothing that a press could give */
    int shift = draw_between(0, 30);
    for (uint8_t k = 0; k < array->sensor_count; k++) {
      pressure_Pa_q10[k] = draw_between(INT32_MIN, INT32_MAX) >> shift;
    }
  } else {
    /* 1 / (2 sigma^2) in powers of 2 over pitches squared: sigma 0.2 to 3.4 pitches; of a pad what its thickness makes of a contact. */
    int32_t any_q16 = draw_between(ONE_Q16, 2 * ONE_Q16);
    int64_t height_q16 = (int64_t)any_q16 << draw_between(0, 7) >> 4;
    int64_t thickness = kernel == FIT_BITS_SHAPES ? 2 : press / 4 % PADS + 1; /* 5 mm */
    if (on_a_pad) {
      height_q16 = (int64_t)any_q16 * 7 / (thickness * thickness);
    }
    draw_press(array, height_q16, settings.noise_Pa_q10, pressure_Pa_q10);
    if (kernel == FIT_BITS_SHAPES && press % 4 < 2) {
      int32_t second_Pa_q10[FT_MAX_SENSORS];
      draw_press(array, height_q16, settings.noise_Pa_q10, second_Pa_q10);
      for (uint8_t k = 0; k < array->sensor_count; k++) {
        pressure_Pa_q10[k] = to_int32((int64_t)pressure_Pa_q10[k] + second_Pa_q10[k]);
      }
    }
  }

  uint32_t usable = UINT32_MAX;
  const bool pulls = on_a_pad || kernel == FIT_BITS_BIAS;
  if (pulls && press % 16 != 15) {
    pull(array, pressure_Pa_q10);
  }
  if (kernel == FIT_BITS_MASKED || (pulls && press % 4 == 2)) {
    for (int left_out = draw_between(1, 11) / draw_between(1, 11); left_out >= 0; left_out--) {
      usable &= ~(UINT32_C(1) << draw_between(0, array->sensor_count - 1));
    }
  } else if (kernel == FIT_BITS_GENERAL && press % 4 < 2) {
    usable = draw() | draw();
  }

  if (kernel == FIT_BITS_SHAPES) {
    return bits_of_shapes(array, usable, &settings, pressure_Pa_q10);
  }
  struct fit_result result;
  memset(&result, 0, sizeof result);
  if (kernel == FIT_BITS_GRID) {
    fit_grid(array, pressure_Pa_q10, &settings, &result);
  } else if (kernel == FIT_BITS_MASKED) {
    fit_gaussian(array, pressure_Pa_q10, usable, &settings, &result);
  } else if (kernel == FIT_BITS_GENERAL) {
    fit_general(array, pressure_Pa_q10, usable, &settings, &result);
  } else if (kernel == FIT_BITS_BIAS) {
    struct fit_bias load;
    memset(&load, 0, sizeof load);
    fit_gaussian(array, pressure_Pa_q10, usable, &settings, &result);
    for (int part = 0; part < FIT_BIAS_PARTS; part++) {
      fit_bias_step(&load, array, pressure_Pa_q10, &settings, &result);
    }
    fit_bias_add(&load, array, &settings, &result);
  }
  if (kernel == FIT_BITS_TANGENTIAL) {
    struct fit_tangential found[FRAMES];
    struct fit_tangential_state tangential_state;
    memset(found, 0, sizeof found);
    memset(&tangential_state, 0, sizeof tangential_state);
    for (int frame = 0; frame < FRAMES; frame++) {
      fit_gaussian(array, pressure_Pa_q10, usable, &settings, &result);
      fit_tangential_estimate(array, &pads[press / 4 % PADS], pressure_Pa_q10, &settings, &result, &tangential_state, &found[frame]);
      for (uint8_t k = 0; k < array->sensor_count; k++) {
        pressure_Pa_q10[k] -= pressure_Pa_q10[k] / 64 * draw_between(0, 1);
      }
    }
    return crc32_iso_hdlc((const uint8_t *)found, sizeof found);
  }
  /* As where a map has one word. */
  const uint32_t before = ~crc32_iso_hdlc((const uint8_t *)&result, offsetof(struct fit_result, used));
  return ~crc32_add_u32(crc32_add_u32(before, (uint32_t)result.used), result.flags);
}
