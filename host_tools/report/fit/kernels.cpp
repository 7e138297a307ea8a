#include "report/fit/kernels.hpp"

#include "report/fit/double_kernel.hpp"
#include "report/fit/separable.hpp"

extern "C" {
#include "alternatives/alternatives.h"
#include "config/defaults.h"
#include "config/geometry.h"
#include "fit/fit.h"
}
#include "common/contact_flags.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace fingertip::fitting {
namespace {

std::uint32_t largest_readings(const fit_array &array, const std::int32_t *pressure_Pa_q10, std::uint32_t usable,
                               int n) {
  std::vector<int> sensors;
  for (int k = 0; k < array.sensor_count; k++) {
    if (usable >> k & 1u) {
      sensors.push_back(k);
    }
  }
  if (n == 0 || n >= static_cast<int>(sensors.size())) {
    return usable;
  }
  std::stable_sort(sensors.begin(), sensors.end(),
                   [&](int a, int b) { return pressure_Pa_q10[a] > pressure_Pa_q10[b]; });
  std::uint32_t chosen = 0;
  for (int i = 0; i < n; i++) {
    chosen |= std::uint32_t{1} << sensors[static_cast<std::size_t>(i)];
  }
  return chosen;
}

fit_settings chip_settings(const KernelSettings &settings) {
  fit_settings chip{};
  chip.iterations = static_cast<std::uint8_t>(settings.iterations);
  chip.n_largest = static_cast<std::uint8_t>(settings.n_largest);
  chip.noise_Pa_q10 = static_cast<std::int32_t>(settings.noise_Pa * 1024.0);
  chip.prior_sigma_mm = static_cast<float>(settings.prior_sigma_mm);
  chip.prior_width_mm = static_cast<float>(settings.prior_width_mm);
  fit_set_errors(&chip, 0.0f, DEFAULT_MODEL_SD); // no set spreads gains
  return chip;
}

KernelResult widened(const fit_result &result) {
  return {static_cast<double>(result.x_mm),
          static_cast<double>(result.y_mm),
          static_cast<double>(result.p0_Pa),
          static_cast<double>(result.sigma_mm),
          static_cast<double>(result.force_N),
          result.used,
          result.flags};
}

KernelResult fit(const fit_array &array, const std::int32_t *pressure_Pa_q10, std::uint32_t usable,
                 const KernelSettings &settings) {
  const fit_settings chip = chip_settings(settings);
  fit_result result;
  fit_gaussian(&array, pressure_Pa_q10, usable, &chip, &result);
  return widened(result);
}

// One of the kernels behind fit_gaussian.
template <class FIT> KernelResult of_the_firmware(const KernelSettings &settings, FIT fit) {
  const fit_settings chip = chip_settings(settings);
  fit_result result;
  fit(&chip, &result);
  return widened(result);
}

KernelResult grid(const fit_array &array, const std::int32_t *pressure_Pa_q10, std::uint32_t /*usable*/,
                  const KernelSettings &settings) {
  return of_the_firmware(
      settings, [&](const fit_settings *chip, fit_result *result) { fit_grid(&array, pressure_Pa_q10, chip, result); });
}

KernelResult masked(const fit_array &array, const std::int32_t *pressure_Pa_q10, std::uint32_t usable,
                    const KernelSettings &settings) {
  return of_the_firmware(settings, [&](const fit_settings *chip, fit_result *result) {
    fit_grid_masked(&array, pressure_Pa_q10, usable, chip, result);
  });
}

KernelResult general(const fit_array &array, const std::int32_t *pressure_Pa_q10, std::uint32_t usable,
                     const KernelSettings &settings) {
  return of_the_firmware(settings, [&](const fit_settings *chip, fit_result *result) {
    fit_general(&array, pressure_Pa_q10, usable, chip, result);
  });
}

KernelResult in_double(const fit_array &array, const std::int32_t *pressure_Pa_q10, std::uint32_t usable,
                       const KernelSettings &settings) {
  return double_kernel(array, pressure_Pa_q10, largest_readings(array, pressure_Pa_q10, usable, settings.n_largest),
                       settings);
}

// Neither judges itself, so the only flag is whether it came to anything.
template <auto SOLVE>
KernelResult alternative(const fit_array &array, const std::int32_t *pressure_Pa_q10, std::uint32_t usable,
                         const KernelSettings &settings) {
  const alternative_settings chosen{settings.iterations, static_cast<alternative_guess>(settings.guess)};
  const auto found = SOLVE(&array, pressure_Pa_q10, usable, &chosen);
  KernelResult result{};
  result.x_mm = static_cast<double>(found.x_mm);
  result.y_mm = static_cast<double>(found.y_mm);
  result.p0_Pa = static_cast<double>(found.p0_Pa);
  result.sigma_mm = static_cast<double>(found.sigma_mm);
  result.force_N = static_cast<double>(found.force_N);
  const bool finite = std::isfinite(result.x_mm) && std::isfinite(result.y_mm);
  result.flags = finite && result.sigma_mm != 0.0 ? std::uint32_t{CONTACT_FLAG_FIT_VALID} : 0;
  result.used = usable;
  return result;
}

} // namespace

const char *name_of(Guess guess) {
  static const char *const names[] = {"log_linear", "maximum", "centroid", "firmware"};
  return names[static_cast<int>(guess)];
}

const std::vector<Kernel> &all_kernels() {
  static const std::vector<Kernel> kernels{
      {"fit", ANY_SUBSET | PRIOR, fit},
      {"grid", PRIOR, grid},
      {"masked", ANY_SUBSET | PRIOR, masked},
      {"general", ANY_SUBSET | N_LARGEST | PRIOR, general},
      {"double", ANY_SUBSET | N_LARGEST | PRIOR | GUESSES | FIRMWARE_GUESS, in_double},
      {"separable", 0, separable},
      {"naive_float", ANY_SUBSET | GUESSES, alternative<alternative_naive_float>},
      {"naive_double", ANY_SUBSET | GUESSES, alternative<alternative_naive_double>},
      {"lm_float", ANY_SUBSET | GUESSES | ENDS_EARLY, alternative<alternative_lm_float>},
      {"lm_double", ANY_SUBSET | GUESSES | ENDS_EARLY, alternative<alternative_lm_double>},
  };
  return kernels;
}

fit_array firmware_fit_array() {
  fit_array array;
  if (fit_array_init(&array, geometry.sensor_count, geometry.x_mm, geometry.y_mm, geometry.pitch_mm) != FT_OK) {
    throw std::runtime_error("fit_array_init refuses the geometry of firmware/config/geometry.c");
  }
  return array;
}

} // namespace fingertip::fitting
