#include "reference/kernels.hpp"

#include "reference/double_kernel.hpp"

extern "C" {
#include "config/geometry.h"
}

#include <algorithm>
#include <stdexcept>

namespace fingertip::reference {
namespace {

std::uint32_t largest_readings(const fit_array &array, const std::int32_t *pressure_Pa_q10,
                               std::uint32_t usable, int n) {
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
  chip.noise_Pa_q10 = static_cast<std::int32_t>(settings.noise_Pa * 1024.0);
  chip.prior_sigma_mm = static_cast<float>(settings.prior_sigma_mm);
  chip.prior_width_mm = static_cast<float>(settings.prior_width_mm);
  return chip;
}

KernelResult widened(const fit_result &result) {
  return {static_cast<double>(result.x_mm),    static_cast<double>(result.y_mm),
          static_cast<double>(result.p0_Pa),   static_cast<double>(result.sigma_mm),
          static_cast<double>(result.force_N), result.flags};
}

KernelResult grid(const fit_array &array, const std::int32_t *pressure_Pa_q10, std::uint32_t,
                  const KernelSettings &settings) {
  const fit_settings chip = chip_settings(settings);
  fit_result result;
  fit_grid(&array, pressure_Pa_q10, &chip, &result);
  return widened(result);
}

KernelResult general(const fit_array &array, const std::int32_t *pressure_Pa_q10,
                     std::uint32_t usable, const KernelSettings &settings) {
  const fit_settings chip = chip_settings(settings);
  fit_result result;
  fit_general(&array, pressure_Pa_q10,
              largest_readings(array, pressure_Pa_q10, usable, settings.n_largest), &chip, &result);
  return widened(result);
}

KernelResult in_double(const fit_array &array, const std::int32_t *pressure_Pa_q10,
                       std::uint32_t usable, const KernelSettings &settings) {
  return double_kernel(array, pressure_Pa_q10,
                       largest_readings(array, pressure_Pa_q10, usable, settings.n_largest),
                       settings);
}

} // namespace

const std::vector<Kernel> &all_kernels() {
  static const std::vector<Kernel> kernels{
      {"grid", false, grid},
      {"general", true, general},
      {"double", true, in_double},
  };
  return kernels;
}

fit_array firmware_fit_array() {
  fit_array array;
  if (fit_array_init(&array, geometry.sensor_count, geometry.x_mm, geometry.y_mm,
                     geometry.pitch_mm) != FT_OK) {
    throw std::runtime_error("fit_array_init refuses the geometry of firmware/config/geometry.c");
  }
  return array;
}

} // namespace fingertip::reference
