// The firmware's fit on many presses, of any layout.
#include "libfingertip/in_parallel.hpp"
#include "tool/arrays/fit_arguments.hpp"

extern "C" {
#include "config/defaults.h"
#include "config/geometry.h"
#include "fit/fit.h"
#include "fit/fit_bias.h"
}

#include <ctime>
#include <map>

using namespace fingertip::measure;
using fingertip::twin::in_parallel;

MEASURE_RECORD(fit_array, FIELD(sensor_count), FIELD(pitch_mm), FIELD(x), FIELD(y))
MEASURE_RECORD(fit_deviation, FIELD(off_x_q15), FIELD(off_y_q15), FIELD(wider_q15))
MEASURE_RECORD(fit_settings, FIELD(iterations), FIELD(noise_Pa_q10), FIELD(prior_sigma_mm), FIELD(prior_width_mm), FIELD(clip_below_sds),
               FIELD(dip_share), FIELD(dip_sd_mm), FIELD(gain_sd_q16), FIELD(hysteresis_sd_Pa_q10), FIELD(model_sd_q16),
               FIELD(location_sd_limit_mm))
MEASURE_RECORD(fit_result, FIELD(x_mm), FIELD(y_mm), FIELD(p0_Pa), FIELD(sigma_mm), FIELD(force_N), FIELD(residual_rms_Pa),
               FIELD(location_sd_mm), FIELD(location_noise_mm), FIELD(force_sd_N), FIELD(sigma_x_mm), FIELD(sigma_y_mm),
               FIELD(width_correlation), FIELD(used), FIELD(flags))

// The layout that the firmware is built for.
static void own_layout(Batch<float, 1> x_mm, Batch<float, 1> y_mm, Batch<float, 1> pitch_mm) {
  require(x_mm.size() == geometry.sensor_count && y_mm.size() == geometry.sensor_count, "another number of sensors");
  std::copy(geometry.x_mm, geometry.x_mm + geometry.sensor_count, x_mm.data);
  std::copy(geometry.y_mm, geometry.y_mm + geometry.sensor_count, y_mm.data);
  pitch_mm[0] = geometry.pitch_mm;
}
MEASURE_ENTRY(own_layout)

static void array_of(Batch<const float, 1> x_mm, Batch<const float, 1> y_mm, double pitch_mm, Batch<fit_array, 1> array) {
  same_length(x_mm, y_mm);
  require(fit_array_init(array.data, static_cast<std::uint8_t>(x_mm.size()), x_mm.data, y_mm.data, static_cast<float>(pitch_mm)) == FT_OK,
          "the fit takes no such layout");
}
MEASURE_ENTRY(array_of)

// The settings of a firmware that has only its defaults.
static void default_settings(Batch<fit_settings, 1> settings) {
  for (std::size_t i = 0; i < settings.size(); i++) {
    settings[i] = {};
    settings[i].iterations = DEFAULT_FIT_ITERATIONS;
    settings[i].clip_below_sds = DEFAULT_CLIP_BELOW_SDS;
    fit_set_errors(&settings[i], DEFAULT_GAIN_SD, DEFAULT_MODEL_SD);
  }
}
MEASURE_ENTRY(default_settings)

using Kernel = void (*)(const fit_array *, const std::int32_t *, sensor_map, const fit_settings *, fit_result *);

static Kernel kernel_named(const std::string &name) {
  const auto grid = [](const fit_array *array, const std::int32_t *pressure_Pa_q10, sensor_map, const fit_settings *settings,
                       fit_result *result) { fit_grid(array, pressure_Pa_q10, settings, result); };
  const auto masked = [](const fit_array *array, const std::int32_t *pressure_Pa_q10, sensor_map usable, const fit_settings *settings,
                         fit_result *result) { fit_grid_masked(array, pressure_Pa_q10, usable, settings, result); };
  const std::map<std::string, Kernel> kernels = {
      {"fit", fit_gaussian}, {"fit_grid", fit_gaussian_grid}, {"grid", grid}, {"masked", masked}, {"general", fit_general}};
  const auto found = kernels.find(name);
  require(found != kernels.end(), "no kernel has this name");
  return found->second;
}

// kernel: "grid", "masked", "general", "fit" (fit_gaussian) or "fit_grid" (fit_gaussian_grid). us: of one fit, if a
// single thread runs them.
static void fit(std::string kernel, std::int64_t threads, Batch<const fit_array, 1> arrays, Batch<const fit_settings, 1> all_settings,
                Batch<const fit_deviation, 2> deviations, Batch<const std::int32_t, 2> pressure_Pa_q10, Batch<const sensor_map, 1> usable,
                Batch<fit_result, 1> results, Batch<double, 1> us) {
  const fit_array *const array = &checked(arrays, pressure_Pa_q10.size(1), deviations);
  same_length(results, pressure_Pa_q10, usable);
  length_or_one(results, all_settings);
  const Kernel run = kernel_named(kernel);
  const std::clock_t begun = std::clock(); // of this process: what others run meanwhile does not count
  in_parallel(
      results.size(),
      [&](std::size_t press) {
        const fit_settings settings = settings_of(all_settings, deviations, press);
        run(array, pressure_Pa_q10.row(press), usable[press], &settings, results.row(press));
      },
      static_cast<std::size_t>(threads));
  us[0] = 1e6 * static_cast<double>(std::clock() - begun) / CLOCKS_PER_SEC / static_cast<double>(results.size());
}
MEASURE_ENTRY(fit)

// Fit of held presses [press][frame][sensor]: that of the last frame, with what the search for a tangential force that
// is not estimated has found in the frames before. A single frame is not searched.
static void fit_held(Batch<const fit_array, 1> arrays, Batch<const fit_settings, 1> all_settings, Batch<const fit_deviation, 2> deviations,
                     Batch<const std::int32_t, 3> pressure_Pa_q10, Batch<const sensor_map, 2> usable, Batch<fit_result, 1> results) {
  const fit_array *const array = &checked(arrays, pressure_Pa_q10.size(2), deviations);
  same_length(results, pressure_Pa_q10, usable);
  length_or_one(results, all_settings);
  const std::size_t frames = pressure_Pa_q10.size(1), sensors = pressure_Pa_q10.size(2);
  require(usable.size(1) == frames, "other numbers of frames");
  in_parallel(results.size(), [&](std::size_t press) {
    const fit_settings settings = settings_of(all_settings, deviations, press);
    const std::int32_t *pressure = pressure_Pa_q10.row(press);
    fit_gaussian(array, pressure, usable.row(press)[0], &settings, &results[press]);
    fit_bias bias{};
    for (std::size_t i = 1; i < frames; i++, pressure += sensors) {
      fit_bias_step(&bias, array, pressure, &settings, &results[press]);
      fit_gaussian(array, pressure + sensors, usable.row(press)[i], &settings, &results[press]);
    }
    if (frames > 1) {
      fit_bias_add(&bias, array, &settings, &results[press]);
    }
  });
}
MEASURE_ENTRY(fit_held)
