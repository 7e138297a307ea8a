#include "fit/fit_grid_parts.h"

#include "common/bytes.h"
#include "fit/fit_limits.h"
#include "fit/fit_math.h"

uint64_t fit_packed_from(int32_t value, int32_t exponent) { return scaled_pack(scaled_from(value, exponent)); }

uint64_t fit_packed_sqrt(struct scaled a) { return scaled_pack(scaled_sqrt(a)); }

int32_t fit_scaled_to_fixed(struct scaled a, int32_t q) { return scaled_to_fixed(a, q); }

uint64_t fit_packed_float(float value) {
  uint32_t bits = bytes_from_f32(value);
  if (bits >> 23 == 0) {
    return 0;
  }
  int32_t mantissa = (int32_t)((bits & 0x7FFFFFu) | 0x800000u);
  return scaled_pack((struct scaled){mantissa >> 9, (int32_t)(bits >> 23) - 141});
}

float fit_quadrature(float a, float b, float c, float d) {
  struct scaled first = scaled_mul(fit_grid_scaled(a), fit_grid_scaled(b));
  struct scaled second = scaled_mul(fit_grid_scaled(c), fit_grid_scaled(d));
  struct scaled root = fit_scaled_sqrt(scaled_add(scaled_mul(first, first), scaled_mul(second, second)));
  return fit_scaled_float(root);
}

/* One Newton step of sigma = (log2(e) / 2) / (curvature sigma) from 11 bits: 22 of them, or 2e-7. */
int32_t fit_grid_sigma(int32_t curvature) {
  struct scaled rough = scaled_sqrt(scaled_div(LOG2E_HALF, scaled_from(curvature, -26)));
  int32_t sigma = scaled_to_fixed(rough, 26);
  int32_t other = fixed_div_q26(LOG2E_HALF_Q26, fixed_mul_q26(curvature, sigma));
  return (sigma + other) >> 1;
}

FIXED_INLINE void set_reading(struct readings *readings, int k, int32_t value, int32_t more_q28) {
  int32_t largest = readings->largest, shift = readings->shift;
  int32_t up = shift >= 0 ? shift : 0, down = up - shift;
  value = value < -largest ? -largest : value;
  value = (value >> down) * (1 << up) + more_q28;
  readings->q28[k] = value;
  readings->q14[k] = (value + (1 << 13)) >> 14;
}

bool fit_grid_take_readings(const struct fit_array *array, const int32_t *pressure_Pa_q10, sensor_map usable,
                            const struct fit_settings *settings, struct readings *readings) {
  const uint8_t *sensor = array->grid.sensor;
  int32_t largest = 0;
  for (int k = 0; k < NODES; k++) {
    bool used = usable >> sensor[k] & 1;
    int32_t value = used ? fit_reading(settings, pressure_Pa_q10[sensor[k]]) : 0;
    readings->q28[k] = value;
    largest = value > largest ? value : largest;
  }
  if (largest <= 0) {
    return false;
  }
  bool dip = fit_has_dip(settings);
  int32_t shift = (dip ? 27 : 28) - fixed_bits((uint32_t)largest);
  int32_t up = shift >= 0 ? shift : 0;
  int32_t down = up - shift;
  readings->largest = largest;
  readings->shift = shift;
  readings->largest_q28 = (largest >> down) * (1 << up);
  for (int k = 0; k < NODES; k++) {
    set_reading(readings, k, readings->q28[k], 0);
  }
  readings->dip_share = (struct scaled){0, 0};
  if (dip) {
    float sd = settings->dip_sd_mm / array->pitch_mm;
    sd = sd < FIT_DIP_SD_MIN ? FIT_DIP_SD_MIN : sd > FIT_DIP_SD_MAX ? FIT_DIP_SD_MAX : sd;
    readings->dip_share = fit_grid_scaled(settings->dip_share);
    readings->dip_curvature = (int32_t)(0.72134752f * 67108864.0f / (sd * sd));
  }
  readings->prior_sigma = readings->prior_weight = readings->prior_sd = (struct scaled){0, 0};
  if (fit_has_prior(settings)) {
    struct scaled width = fit_grid_scaled(settings->prior_width_mm / array->pitch_mm);
    readings->prior_sd = scaled_mul(fit_grid_scaled(FIT_PRIOR_WEIGHT), scaled_from(readings->largest_q28, -28));
    readings->prior_sigma = fit_grid_scaled(settings->prior_sigma_mm / array->pitch_mm);
    readings->prior_weight = scaled_div(readings->prior_sd, width);
  }
  return true;
}

int fit_grid_weigh(const struct fit_array *array, const struct fit_settings *settings, sensor_map used, const struct readings *readings,
                   int32_t noise_most, int32_t model_sd_q16, int32_t *weight_q12, struct fit_base *base) {
  int32_t noise = fixed_clamp(shifted(settings->noise_Pa_q10, readings->shift - 6), 1, noise_most);
  int32_t of_one = fixed_hypot(noise, ((readings->largest_q28 >> 14) * model_sd_q16) >> 8);
  int sensors = 0;
  int32_t squares_q12 = 0;
  for (int k = 0; k < NODES; k++) {
    uint8_t sensor = array->grid.sensor[k];
    weight_q12[k] = 0;
    if (used >> sensor & 1) {
      int32_t gain = (int32_t)((uint32_t)settings->gain_sd_q16[sensor] * fixed_magnitude(readings->q14[k]) >> 8);
      int32_t hysteresis = fixed_clamp(shifted(settings->hysteresis_sd_Pa_q10[sensor], readings->shift - 6), 0, 1 << 22);
      int32_t error = fixed_hypot(of_one, fixed_hypot(gain, hysteresis));
      int32_t weight = port_divide(of_one << 8, error >> 4);
      weight_q12[k] = weight;
      squares_q12 += (weight * weight) >> 12;
      sensors++;
    }
  }
  *base = (struct fit_base){noise, of_one, squares_q12};
  return sensors;
}

int32_t fit_grid_sum_q20(const int32_t *q28) {
  int32_t sum_q20 = 0;
  for (int k = 0; k < NODES; k++) {
    sum_q20 += q28[k] >> 8;
  }
  return sum_q20;
}

#define RISE_MAX_Q22 (20 << 22) /* what it is for is at its limit long before */

static void set_dip(int32_t *g, int nodes, int origin, int32_t centre, int32_t curvature) {
  for (int i = 0; i < nodes; i++) {
    int32_t off_q12 = ((i - origin) * ONE_Q26 - centre) >> 14;
    g[i] = exp2_negative((uint32_t)fixed_mul_q32(curvature, off_q12 * off_q12) << 4);
  }
}

int32_t fit_grid_peak(int32_t amplitude_q28, int32_t rise_q22, struct scaled share, int32_t most_q28) {
  /* 2^rise is 2^-(1 - its fraction) and a power of two. */
  rise_q22 = fixed_clamp(rise_q22, 0, RISE_MAX_Q22);
  int32_t fraction = exp2_negative((uint32_t)((1 << 22) - (rise_q22 & 0x3FFFFF)));
  struct scaled rise = fit_scaled_from(fraction, (rise_q22 >> 22) + 1 - 30);
  struct scaled peak = scaled_mul(scaled_mul(rise, fit_scaled_from(amplitude_q28, -28)), share);
  return fixed_clamp(fit_scaled_to_fixed(peak, 28), 0, most_q28);
}

int32_t fit_grid_dip(int32_t curvature, struct scaled share, const struct state *at, int32_t amplitude_q28, int32_t rise_q22,
                     int32_t most_q28, struct dip *dip) {
  set_dip(dip->x, COLUMNS, COLUMNS / 2, at->x, curvature);
  set_dip(dip->y, ROWS, ROWS / 2, at->y, curvature);
  return fit_grid_peak(amplitude_q28, rise_q22, share, most_q28);
}

void fit_grid_remove_dip(const struct fit_array *array, const int32_t *pressure_Pa_q10, const struct state *at, int32_t amplitude_q28,
                         int32_t rise_q22, struct readings *readings) {
  const uint8_t *sensor = array->grid.sensor;
  struct dip dip;
  const int32_t most = readings->largest_q28 >> 2; /* FIT_DIP_DEPTH_MAX */
  int32_t depth_q28 = fit_grid_dip(readings->dip_curvature, readings->dip_share, at, amplitude_q28, rise_q22, most, &dip);
  for (int i = 0; i < COLUMNS; i++) {
    int32_t column = fixed_mul_q30(depth_q28, dip.x[i]);
    for (int j = 0; j < ROWS; j++) {
      int k = i * ROWS + j;
      set_reading(readings, k, pressure_Pa_q10[sensor[k]], fixed_mul_q30(column, dip.y[j]));
    }
  }
}

#define TWO_LN2_Q30 1488522236
#define SHARE_MAX_Q15 ((int32_t)(FIT_DEVIATION_SHARE_MAX * 32768.0f))
#define SLOPE_MAX_Q11 (7 << 11) /* what it makes is at its limit before, or nothing */

/* At the nodes along an axis: the Gaussian's factor, and from the contact x / sigma^2 per pitch and x^2 / sigma^2. */
struct deviation_axis {
  int32_t gaussian_q30[MAX_SIDE], slope_q11[MAX_SIDE], square_q11[MAX_SIDE];
};

static NOINLINE void set_deviation_axis(int32_t nodes, int32_t centre, int32_t curvature, struct deviation_axis *axis) {
  const int32_t inverse_q11 = fixed_mul_q30(curvature, TWO_LN2_Q30) >> 15; /* 1 / sigma^2 */
  for (int i = 0; i < nodes; i++) {
    int32_t x_q12 = ((i - nodes / 2) * ONE_Q26 - centre) >> 14;
    int32_t slope_q11 = fixed_clamp(fixed_mul_16(inverse_q11, x_q12) * 16, -SLOPE_MAX_Q11, SLOPE_MAX_Q11);
    axis->gaussian_q30[i] = exp2_rough((uint32_t)fixed_mul_q32(curvature, x_q12 * x_q12) << 4);
    axis->slope_q11[i] = slope_q11;
    axis->square_q11[i] = fixed_clamp((x_q12 * slope_q11) >> 12, 0, SLOPE_MAX_Q11);
  }
}

/* A sensor that is off by o and wider by b reads (b d - o)' d / sigma^2 of the Gaussian more, d from the contact to its place. */
void fit_grid_remove_deviations(const struct fit_array *array, const struct fit_settings *settings, sensor_map usable,
                                const struct state *at, int32_t peak_q28, struct readings *readings) {
  const uint8_t *sensor = array->grid.sensor;
  struct deviation_axis x, y;
  set_deviation_axis(COLUMNS, at->x, at->curvature, &x);
  set_deviation_axis(ROWS, at->y, at->curvature, &y);
  for (int i = 0, k = 0; i < COLUMNS; i++) {
    int32_t column_q28 = fixed_mul_q30(peak_q28, x.gaussian_q30[i]);
    for (int j = 0; j < ROWS; j++, k++) {
      const struct fit_deviation *deviation = &settings->deviations[sensor[k]];
      int32_t more_q26 = deviation->wider_q15 * (x.square_q11[i] + y.square_q11[j]) - deviation->off_x_q15 * x.slope_q11[i] -
                         deviation->off_y_q15 * y.slope_q11[j];
      int32_t share_q15 = fixed_clamp(more_q26 >> 11, -SHARE_MAX_Q15, SHARE_MAX_Q15);
      if (usable >> sensor[k] & 1) {
        int32_t gaussian_q15 = fixed_mul_q30(column_q28, y.gaussian_q30[j]) >> 13;
        int32_t value = readings->q28[k] - ((gaussian_q15 * share_q15) >> 2);
        readings->q28[k] = value;
        readings->q14[k] = (value + (1 << 13)) >> 14;
      }
    }
  }
}

void fit_grid_restore_negative(const struct fit_array *array, const int32_t *pressure_Pa_q10, sensor_map usable,
                               struct readings *readings) {
  const uint8_t *sensor = array->grid.sensor;
  for (int k = 0; k < NODES; k++) {
    if (usable >> sensor[k] & 1) {
      set_reading(readings, k, pressure_Pa_q10[sensor[k]], 0);
    }
  }
}
