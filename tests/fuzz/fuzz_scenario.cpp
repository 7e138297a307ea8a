// Scenarios, as the player reads them.
#include "fuzz.h"
#include "libfingertip/error.hpp"
#include "memory_file.hpp"
#include "simulation/player/scenario.hpp"

#include <cmath>

using namespace fingertip;

void fuzz_one(const uint8_t *bytes, size_t length) {
  const fuzz::MemoryFile file(bytes, length);
  try {
    Scenario scenario(file.path());
    FUZZ_CHECK(scenario.sensors() >= 1 && scenario.sensors() <= 32);
    FUZZ_CHECK(std::isfinite(scenario.end_s()) && scenario.end_s() >= 0);
    // Onward, and back.
    for (const std::uint64_t t_us : {std::uint64_t{0}, std::uint64_t{1}, std::uint64_t{500'000}, std::uint64_t{1} << 40,
                                     std::uint64_t{UINT64_MAX}, std::uint64_t{750'000}}) {
      const double temperature_degC = scenario.temperature_degC(t_us);
      FUZZ_CHECK(std::abs(temperature_degC) <= 1000);
      for (unsigned k = 0; k < scenario.sensors(); k++) {
        FUZZ_CHECK(std::abs(scenario.pressure_Pa(k, t_us)) <= 2e7);
      }
    }
  } catch (const Error &) {
  }
}
