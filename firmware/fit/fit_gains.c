#include "fit/fit_gains.h"

#include "common/contact_flags.h"
#include "fit/fit_fixed.h"

#include <math.h>

#define SHARE_PER_CUBE 0.58f
#define WIDTH_MIN 0.55f /* pitches */
#define WIDTH_MAX 1.0f
#define WIDTH_USUAL 0.6f  /* of the touches that the assumed value counts for */
#define REST_SHARE 0.02f  /* of p0 */
#define NOISE_SHARE 0.05f /* of what remains, at most */
#define VARIANCE_USUAL 0.01f
#define TOUCH_FACTOR_MAX 8.0f /* of these or what is learnt: one odd touch shows little */
#define SD_MIN 0.08f
#define SD_MAX 0.5f
#define PARAMETERS 4
#define SENSORS_MIN 9
#define READING_BITS 13 /* so that the squares of all FT_MAX_SENSORS fit into 32 bits */
_Static_assert(FT_MAX_SENSORS <= 1 << (32 - 2 * READING_BITS), "sum of squares");

static float share_of(float width) { return SHARE_PER_CUBE * width * width * width; }

/* Pa^2; the largest reading in Pa. */
static float squares_of(const int32_t *pressure_Pa_q10, unsigned count, float *largest_Pa) {
  int32_t largest = 1;
  for (unsigned k = 0; k < count; k++) {
    largest = pressure_Pa_q10[k] > largest ? pressure_Pa_q10[k] : largest;
  }
  int32_t down = fixed_bits((uint32_t)largest) - READING_BITS;
  down = down < 0 ? 0 : down;
  uint32_t squares = 0;
  for (unsigned k = 0; k < count; k++) {
    uint32_t reading = pressure_Pa_q10[k] > 0 ? (uint32_t)pressure_Pa_q10[k] >> down : 0;
    squares += reading * reading;
  }
  const float unit_Pa = (float)(UINT32_C(1) << down) * (1.0f / 1024.0f);
  *largest_Pa = (float)largest * (1.0f / 1024.0f);
  return unit_Pa * unit_Pa * (float)squares;
}

void fit_gains_begin(struct fit_gains *gains, float gain_sd) {
  *gains = (struct fit_gains){0};
  gains->share = FIT_GAINS_TOUCHES * share_of(WIDTH_USUAL);
  gains->residual = gains->share * gain_sd * gain_sd;
}

void fit_gains_end_touch(struct fit_gains *gains) {
  gains->p0_Pa = 0.0f;
  gains->counted = false;
}

bool fit_gains_learn(struct fit_gains *gains, const struct fit_array *array, const int32_t *pressure_Pa_q10,
                     const struct fit_settings *settings, const struct fit_result *result) {
  const unsigned count = array->sensor_count;
  const float p0_Pa = result->p0_Pa, width = result->sigma_mm / array->pitch_mm;
  const bool rests = fabsf(p0_Pa - gains->p0_Pa) <= REST_SHARE * p0_Pa;
  gains->p0_Pa = p0_Pa;
  if (gains->counted || !rests || array->is_line || count < SENSORS_MIN || !(result->flags & CONTACT_FLAG_FIT_VALID) ||
      (result->flags & (CONTACT_FLAG_AT_BOUND | CONTACT_FLAG_FLAT)) || result->used != first_sensors(count) || width < WIDTH_MIN ||
      width > WIDTH_MAX) {
    return false;
  }
  float largest_Pa;
  const float readings = squares_of(pressure_Pa_q10, count, &largest_Pa);
  const float left = (float)count * result->residual_rms_Pa * result->residual_rms_Pa;
  const float fitted = readings - left, share = share_of(width);
  const float noise_Pa = (float)settings->noise_Pa_q10 * (1.0f / 1024.0f);
  const float model_Pa = (float)settings->model_sd_q16 * (1.0f / 65536.0f) * largest_Pa;
  const float freedom = (float)(count - PARAMETERS);
  const float noise = freedom * noise_Pa * noise_Pa;
  const float learnt = gains->residual / gains->share;
  const float most = TOUCH_FACTOR_MAX * share * (learnt > VARIANCE_USUAL ? learnt : VARIANCE_USUAL);
  if (!(noise < NOISE_SHARE * share * learnt * fitted)) {
    return false;
  }
  const float residual = (left - freedom * model_Pa * model_Pa) / fitted;
  gains->residual += residual < most ? residual : most;
  gains->share += share;
  gains->counted = true;
  const float remembered = FIT_GAINS_TOUCHES_MAX * share_of(WIDTH_USUAL);
  if (gains->share > remembered) {
    gains->residual *= remembered / gains->share;
    gains->share = remembered;
  }
  return true;
}

float fit_gains_sd(const struct fit_gains *gains) {
  const float variance = gains->residual / gains->share;
  return variance <= SD_MIN * SD_MIN ? SD_MIN : variance >= SD_MAX * SD_MAX ? SD_MAX : sqrtf(variance);
}
