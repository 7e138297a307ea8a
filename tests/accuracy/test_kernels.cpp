// The kernels of the report against the reference.
#include "common/contact_flags.h"
#include "report/fit/kernels.hpp"
#include "report/reference/dataset.hpp"

#include <cmath>
#include <cstring>
#include <gtest/gtest.h>

namespace fingertip::fitting {
namespace {

using namespace reference;

constexpr std::uint64_t SEED = 5;
const std::string cache_dir = FINGERTIP_TEST_CACHE_DIR;

const Kernel &kernel_named(const char *name) {
  for (const Kernel &kernel : all_kernels()) {
    if (std::strcmp(kernel.name, name) == 0) {
      return kernel;
    }
  }
  throw std::runtime_error(name);
}

double error_um(const KernelResult &result, const Case &c) {
  return 1e3 * std::hypot(result.x_mm - c.best.theta.x_mm, result.y_mm - c.best.theta.y_mm);
}

KernelResult fit_with(const Kernel &kernel, const Case &c, int iterations, Guess guess = Guess::log_linear) {
  static const fit_array array = firmware_fit_array();
  return kernel.fit(array, c.pressure_Pa_q10.data(), c.usable, {iterations, c.press.noise_Pa, 0, 0.0, 0.0, guess});
}

TEST(Kernels, EveryOneReachesTheOptimumOfAnEasyPress) {
  for (Mask mask : {Mask::none, Mask::random}) {
    for (const Case &c : load_cases(PressSet::C, mask, SEED, 100, cache_dir)) {
      if (!c.observable) {
        continue;
      }
      for (const Kernel &kernel : all_kernels()) {
        if (mask != Mask::none && !(kernel.capabilities & ANY_SUBSET)) {
          continue;
        }
        const KernelResult result = fit_with(kernel, c, 20);
        ASSERT_TRUE(result.flags & CONTACT_FLAG_FIT_VALID) << kernel.name;
        EXPECT_LT(error_um(result, c), 1.0) << kernel.name;
        EXPECT_NEAR(result.p0_Pa / c.best.theta.p0_Pa, 1.0, 2e-4) << kernel.name;
        EXPECT_NEAR(result.sigma_mm / c.best.theta.sigma_mm, 1.0, 2e-4) << kernel.name;
        EXPECT_NEAR(result.force_N / c.best.force_N, 1.0, 3e-4) << kernel.name;
      }
    }
  }
}

TEST(Kernels, DoubleAndSeparableReachEveryObservableOptimum) {
  for (PressSet set : ALL_PRESS_SETS) {
    for (const Case &c : load_cases(set, Mask::none, SEED, 400, cache_dir)) {
      if (c.observable) {
        for (const char *name : {"double", "separable"}) {
          const KernelResult result = fit_with(kernel_named(name), c, 10);
          EXPECT_LT(error_um(result, c), 0.1) << name << ", set " << name_of(set);
          EXPECT_NEAR(result.p0_Pa / c.best.theta.p0_Pa, 1.0, 1e-4) << name;
          EXPECT_NEAR(result.sigma_mm / c.best.theta.sigma_mm, 1.0, 1e-5) << name;
        }
      }
    }
  }
}

TEST(Kernels, GuessesDifferAndTheLogLinearOneIsBest) {
  double sum_um[3] = {};
  for (const Case &c : load_cases(PressSet::A, Mask::none, SEED, 400, cache_dir)) {
    if (c.observable) {
      for (int guess = 0; guess < 3; guess++) {
        const auto from = static_cast<Guess>(guess);
        sum_um[guess] += error_um(fit_with(kernel_named("double"), c, 0, from), c);
      }
    }
  }
  EXPECT_LT(2 * sum_um[0], sum_um[1]);
  EXPECT_LT(2 * sum_um[0], sum_um[2]);
  EXPECT_NE(sum_um[1], sum_um[2]);
}

TEST(Kernels, NothingPositiveIsNoFit) {
  Case c = load_cases(PressSet::A, Mask::none, SEED, 1, cache_dir).front();
  c.pressure_Pa_q10.assign(c.pressure_Pa_q10.size(), -1024);
  for (const Kernel &kernel : all_kernels()) {
    EXPECT_FALSE(fit_with(kernel, c, 7).flags & CONTACT_FLAG_FIT_VALID) << kernel.name;
  }
}

} // namespace
} // namespace fingertip::fitting
