// The fits that the firmware's kernels are compared with, and the reference optimum, on many presses.
#include "report/fit/compared.hpp"

#include "common/contact_flags.h"
#include "libfingertip/in_parallel.hpp"
#include "report/reference/reference.hpp"
#include "tool/arrays/entry.hpp"

extern "C" {
#include "alternatives/alternatives.h"
}

#include <cmath>
#include <ctime>
#include <limits>

using namespace fingertip::measure;
namespace fitting = fingertip::fitting;
namespace reference = fingertip::reference;

using compared_fit = fitting::KernelResult;
MEASURE_RECORD(compared_fit, FIELD(x_mm), FIELD(y_mm), FIELD(p0_Pa), FIELD(sigma_mm), FIELD(flags))

namespace {

template <auto SOLVE>
compared_fit alternative(const fit_array &array, const std::int32_t *pressure_Pa_q10, sensor_map usable,
                         const fitting::KernelSettings &settings) {
  const auto found = SOLVE(&array, pressure_Pa_q10, usable, settings.iterations);
  const bool valid = std::isfinite(found.x_mm) && std::isfinite(found.y_mm) && found.sigma_mm != 0.0;
  return {found.x_mm, found.y_mm, found.p0_Pa, found.sigma_mm, valid ? std::uint32_t{CONTACT_FLAG_FIT_VALID} : 0};
}

struct Named {
  const char *name;
  fitting::Solve solve;
};
constexpr Named OWN[] = {
    {"double", fitting::double_kernel},
    {"naive_float", alternative<alternative_naive_float>},
    {"naive_double", alternative<alternative_naive_double>},
    {"lm_float", alternative<alternative_lm_float>},
    {"lm_double", alternative<alternative_lm_double>},
};

} // namespace

// kernel: of those above, or a library, which one thread at a time may call. us: of one fit, if a single thread runs them.
static void compare(std::string kernel, std::int64_t threads, std::int64_t iterations, std::int64_t firmware_guess,
                    Batch<const fit_array, 1> array, Batch<const double, 1> noise_Pa, Batch<const std::int32_t, 2> pressure_Pa_q10,
                    Batch<const sensor_map, 1> usable, Batch<compared_fit, 1> results, Batch<double, 1> us) {
  same_length(results, pressure_Pa_q10, usable, noise_Pa);
  require(array[0].sensor_count == pressure_Pa_q10.size(1), "readings of another number of sensors");
  fitting::Solve solve = fitting::library_named(kernel);
  require(!solve || threads == 1, "a library takes one thread");
  for (const Named &own : OWN) {
    solve = kernel == own.name ? own.solve : solve;
  }
  require(solve != nullptr, "no kernel has this name");
  const std::clock_t begun = std::clock(); // of this process: what others run meanwhile does not count
  fingertip::twin::in_parallel(
      results.size(),
      [&](std::size_t press) {
        results[press] = solve(array[0], pressure_Pa_q10.row(press), usable[press],
                               {static_cast<int>(iterations), noise_Pa[press], firmware_guess != 0});
      },
      static_cast<std::size_t>(threads));
  us[0] = 1e6 * static_cast<double>(std::clock() - begun) / CLOCKS_PER_SEC / static_cast<double>(results.size());
}
MEASURE_ENTRY(compare)

using reference_fit = reference::Fit;
MEASURE_RECORD(reference_fit, FIELD(p0_Pa), FIELD(x_mm), FIELD(y_mm), FIELD(sigma_mm), FIELD(cost), FIELD(force_N), FIELD(location_sd_mm),
               FIELD(condition_number), FIELD(at_bound), FIELD(observable))

// The optimum of presses [press][sensor]. starts [press or 0]: a further first guess. all_starts: Ceres from every
// start. Without a positive usable reading there is none, and its location's sd is infinite.
static void optimum(Batch<const double, 1> x_mm, Batch<const double, 1> y_mm, double pitch_mm, Batch<const double, 2> pressure_Pa,
                    Batch<const sensor_map, 1> usable, Batch<const double, 1> noise_Pa, Batch<const reference_fit, 1> starts,
                    std::int64_t all_starts, Batch<reference_fit, 1> results) {
  same_length(results, pressure_Pa, usable, noise_Pa);
  require(starts.size() == 0 || starts.size() == results.size(), "another number of starts");
  require(x_mm.size() == y_mm.size() && x_mm.size() == pressure_Pa.size(1), "another number of sensors");
  const reference::Array array{pitch_mm, {x_mm.data, x_mm.data + x_mm.size()}, {y_mm.data, y_mm.data + y_mm.size()}};
  fingertip::twin::in_parallel(results.size(), [&](std::size_t i) {
    const double *const readings = pressure_Pa.row(i);
    bool positive = false;
    for (std::size_t k = 0; k < x_mm.size(); k++) {
      positive = positive || ((usable[i] >> k & 1u) && readings[k] > 0.0);
    }
    if (!positive) {
      constexpr double INFINITE = std::numeric_limits<double>::infinity();
      results[i] = {0, 0, 0, 0, 0, 0, INFINITE, INFINITE, false, false};
      return;
    }
    reference::Parameters start{};
    if (starts.size()) {
      start = {starts[i].p0_Pa, starts[i].x_mm, starts[i].y_mm, starts[i].sigma_mm};
    }
    results[i] = reference::fit(array, readings, usable[i], noise_Pa[i], starts.size() ? &start : nullptr, all_starts != 0);
  });
}
MEASURE_ENTRY(optimum)
