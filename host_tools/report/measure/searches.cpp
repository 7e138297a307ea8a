// Presses that are repeated: what they show of the sensors' gains.
#include "tool/arrays/fit_arguments.hpp"

extern "C" {
#include "fit/fit_gains.h"
#include "ms58xx/ms58xx.h"
}

using namespace fingertip::measure;

MEASURE_RECORD(fit_gains)

static void gains_begin(Batch<const double, 1> gain_sd, Batch<fit_gains, 1> gains) {
  same_length(gain_sd, gains);
  for (std::size_t i = 0; i < gains.size(); i++) {
    fit_gains_begin(&gains[i], static_cast<float>(gain_sd[i]));
  }
}
MEASURE_ENTRY(gains_begin)

// One frame of each pad: what it has learnt of how far its gains are apart. gain_sd keeps its value where nothing was.
static void gains_learn(Batch<const fit_array, 1> array, Batch<const fit_settings, 1> settings,
                        Batch<const std::int32_t, 2> pressure_Pa_q10, Batch<const fit_result, 1> fits, std::int64_t is_first_of_touch,
                        Batch<fit_gains, 1> gains, Batch<double, 1> gain_sd) {
  checked(array, pressure_Pa_q10.size(1), {});
  same_length(gains, settings, pressure_Pa_q10, fits, gain_sd);
  for (std::size_t i = 0; i < gains.size(); i++) {
    if (is_first_of_touch) {
      fit_gains_end_touch(&gains[i]);
    }
    if (fit_gains_learn(&gains[i], array.data, pressure_Pa_q10.row(i), &settings[i], &fits[i])) {
      gain_sd[i] = static_cast<double>(fit_gains_sd(&gains[i]));
    }
  }
}
MEASURE_ENTRY(gains_learn)

// Conversion time and rms noise of one reading at an oversampling.
static void sensor_osr(std::int64_t osr, Batch<std::int32_t, 1> conversion_us, Batch<std::int32_t, 1> noise_Pa_q10) {
  const ms58xx_osr *const row = ms58xx_find_osr(static_cast<std::uint16_t>(osr));
  require(row != nullptr, "no sensor has this oversampling");
  conversion_us[0] = row->conversion_us;
  noise_Pa_q10[0] = row->noise_Pa_q10;
}
MEASURE_ENTRY(sensor_osr)
