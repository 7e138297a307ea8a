#include "fit/fit_grid_parts.h"

#include "common/bytes.h"
#include "fit/fit_limits.h"
#include "fit/fit_math.h"

#include <string.h>

uint64_t fit_packed_from(int32_t value, int32_t exponent) {
  return scaled_pack(scaled_from(value, exponent));
}

uint64_t fit_packed_sqrt(struct scaled a) {
  return scaled_pack(scaled_sqrt(a));
}

int32_t fit_scaled_to_fixed(struct scaled a, int32_t q) {
  return scaled_to_fixed(a, q);
}

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
  struct scaled root =
      fit_scaled_sqrt(scaled_add(scaled_mul(first, first), scaled_mul(second, second)));
  return fit_float(root.mantissa, root.exponent);
}

/* One Newton step of sigma = (log2(e) / 2) / (height sigma) from 11 bits: 22 of them, or 2e-7. */
int32_t fit_grid_sigma(int32_t height) {
  struct scaled rough = scaled_sqrt(scaled_div(LOG2E_HALF, scaled_from(height, -26)));
  int32_t sigma = scaled_to_fixed(rough, 26);
  int32_t other = fixed_div_q26(LOG2E_HALF_Q26, fixed_mul_q26(height, sigma));
  return (sigma + other) >> 1;
}

bool fit_grid_take_readings(const struct fit_array *array, const int32_t *pressure_Pa_q10,
                            uint32_t usable, const struct fit_settings *settings,
                            struct readings *readings) {
  const uint8_t *sensor = array->grid.sensor;
  int32_t largest = 0;
  for (int k = 0; k < NODES; k++) {
    int32_t value = pressure_Pa_q10[sensor[k]];
    if (usable != UINT32_MAX && !(usable >> sensor[k] & 1)) {
      value = 0;
    }
    readings->q28[k] = value;
    largest = value > largest ? value : largest;
  }
  if (largest <= 0) {
    return false;
  }
  int32_t shift = 28 - fixed_bits((uint32_t)largest);
  int32_t up = shift >= 0 ? shift : 0;
  int32_t down = up - shift;
  readings->largest = largest;
  readings->shift = shift;
  for (int k = 0; k < NODES; k++) {
    int32_t value = readings->q28[k];
    value = value < -largest ? -largest : value;
    value = (value >> down) * (1 << up);
    readings->q28[k] = value;
    readings->q14[k] = (value + (1 << 13)) >> 14;
  }
  readings->prior_sigma = readings->prior_weight = readings->prior_sd = (struct scaled){0, 0};
  if (fit_has_prior(settings)) {
    struct scaled width = fit_grid_scaled(settings->prior_width_mm / array->pitch_mm);
    int32_t largest_q28 = (largest >> down) * (1 << up);
    readings->prior_sd =
        scaled_mul(fit_grid_scaled(FIT_PRIOR_WEIGHT), scaled_from(largest_q28, -28));
    readings->prior_sigma = fit_grid_scaled(settings->prior_sigma_mm / array->pitch_mm);
    readings->prior_weight = scaled_div(readings->prior_sd, width);
  }
  return true;
}
