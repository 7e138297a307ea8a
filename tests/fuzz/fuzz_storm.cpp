// Faults, one after another or several at a time, on the whole firmware while it is used: what must hold of its packets (storm/judge.hpp).
#include "fuzz.h"
#include "storm/storm.hpp"

using namespace storm;

constexpr std::uint64_t SECOND_us = 1000000, STEADY_us = 6 * SECOND_us, CLOCK_WRAPS_us = 4294967296;
// Of a location's own: one frame in sixty million is further off by noise alone.
constexpr double STEADY_SDS = 6;

static void check(const Judge &judge) {
  for (const Finding &finding : judge.findings()) {
    std::fprintf(stderr, "%s at %.3f s: %s\n", finding.kind.c_str(), 1e-6 * static_cast<double>(finding.t_us), finding.text.c_str());
  }
  FUZZ_CHECK(judge.findings().empty());
}

// The highest rate and a pad's profile, while the clock's 32 bits of microseconds wrap: no frame is missing or late.
static void steady(std::uint64_t seed) {
  constexpr std::uint64_t clock_us = CLOCK_WRAPS_us - STEADY_us / 2;
  World world(seed);
  Judge judge(world);
  NativePlant plant(world, seed, clock_us, true);
  judge.set_clock_zero(-static_cast<double>(clock_us));
  judge.allow_standard_deviations(STEADY_SDS);
  Storm(plant, world, judge, seed, fuzz_input{}).run_steady(STEADY_us);
  check(judge);
  FUZZ_CHECK(judge.figures().frames > 1000 * (STEADY_us / SECOND_us - 3));
  FUZZ_CHECK(judge.figures().missing + judge.figures().skipped + judge.figures().late == 0);
}

// The first byte is the seed, one of a few; the rest are faults, or none.
void fuzz_one(const std::uint8_t *bytes, std::size_t length) {
  fuzz_input input{bytes, bytes + length};
  const std::uint64_t seed = 1 + fuzz_u8(&input) % 16;
  if (fuzz_left(&input) == 0) {
    return steady(seed);
  }
  World world(seed);
  Judge judge(world);
  NativePlant plant(world, seed);
  Storm(plant, world, judge, seed, input).run();
  check(judge);
}
