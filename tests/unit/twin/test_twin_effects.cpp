#include "libfingertip/error.hpp"
#include "simulation/twin/effects.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <gtest/gtest.h>

using namespace fingertip;
using namespace fingertip::twin;

constexpr double AMBIENT_Pa = 101325.0;
constexpr std::size_t SENSORS = 15;
constexpr double LAYER_mm = 12.0;

static Pad pad_with(const std::string &effects, std::uint64_t seed = 1) {
  return Pad(parse_effects(effects), SENSORS, LAYER_mm, AMBIENT_Pa, seed);
}

static std::vector<double> reported(Pad &pad, double t_s, double base_Pa) {
  std::vector<double> out(SENSORS);
  pad.report(t_s, std::vector<double>(SENSORS, base_Pa), out);
  return out;
}

// Readings of sensor 0 along a path of pressures that is linear between its corners.
struct Corner {
  double t_s, base_Pa;
};
static std::vector<double> along(Pad &pad, const std::vector<Corner> &corners, double step_s) {
  std::vector<double> readings{reported(pad, corners[0].t_s, corners[0].base_Pa)[0]};
  for (std::size_t i = 1; i < corners.size(); i++) {
    const Corner &a = corners[i - 1], &b = corners[i];
    const long steps = std::lround((b.t_s - a.t_s) / step_s);
    for (long n = 1; n <= steps; n++) {
      const double u = static_cast<double>(n) / static_cast<double>(steps);
      readings.push_back(reported(pad, a.t_s + u * (b.t_s - a.t_s), a.base_Pa + u * (b.base_Pa - a.base_Pa))[0]);
    }
  }
  return readings;
}

TEST(Effects, NoneChangesNothing) {
  Pad pad = pad_with("none");
  double t_s = 0.0;
  for (double base_Pa : {0.0, 12345.6, -321.0, 350000.0, 0.0}) {
    EXPECT_EQ(reported(pad, t_s, base_Pa), std::vector<double>(SENSORS, base_Pa));
    t_s += 1.0;
  }
  EXPECT_EQ(pad.temperature_degC(1000.0), ROOM_degC);
}

// Of a force along a path that is linear between its corners.
static double share_after(Pad &pad, const std::vector<std::pair<double, double>> &corners, double step_s) {
  double share = 1.0, t_s = corners[0].first;
  for (std::size_t i = 1; i < corners.size(); i++) {
    const auto [end_s, end_N] = corners[i];
    const auto [begin_s, begin_N] = corners[i - 1];
    for (; t_s < end_s - 1e-9; share = pad.relaxed_share(t_s, begin_N + (end_N - begin_N) * (t_s - begin_s) / (end_s - begin_s))) {
      t_s += step_s;
    }
  }
  return share;
}

TEST(Effects, AForceLosesItsShareWhereTravelIsHeldAndBeginsAfreshWithEachContact) {
  for (std::uint64_t seed = 1; seed <= 5; seed++) {
    Pad pad = pad_with("relaxation", seed), twice = pad_with("relaxation", seed);
    const double peak = share_after(pad, {{0.0, 0.0}, {1.3, 10.0}}, 0.1);
    const double lost = 1.0 - share_after(pad, {{1.3, 10.0}, {9.3, 10.0}}, 0.1) / peak;
    EXPECT_GT(lost, 0.04 - 1e-9);
    EXPECT_LT(lost, 0.14 + 1e-9);
    EXPECT_EQ(pad.relaxed_share(9.4, 0.0), 1.0);
    EXPECT_NEAR(share_after(twice, {{0.0, 0.0}, {1.3, 20.0}}, 0.01), peak, 1e-9);
    EXPECT_NEAR(share_after(pad, {{9.4, 0.0}, {10.7, 10.0}}, 0.1), peak, 1e-9);
    EXPECT_EQ(reported(pad, 11.0, 500.0), std::vector<double>(SENSORS, 500.0)); // readings follow the force
  }
}

TEST(Effects, MemoryLosesItsShareInAHoldAndStandsOffByAsMuchAfterIt) {
  double squares = 0.0;
  int strong = 0, sensors = 0;
  for (std::uint64_t seed = 1; seed <= 200; seed++) {
    Pad pad = pad_with("memory", seed);
    reported(pad, 0.0, 0.0);
    const std::vector<double> peak = reported(pad, 1.3, 20000.0), held = reported(pad, 9.3, 20000.0),
                              after = reported(pad, 9.3 + 1e-6, 0.0), later = reported(pad, 12.3, 0.0);
    for (std::size_t k = 0; k < SENSORS; k++) {
      const auto [share, time_s] = pad.memories()[k];
      EXPECT_NEAR(1.0 - held[k] / peak[k], share, 1e-9);
      EXPECT_NEAR(after[k], held[k] - 20000.0, 0.1);
      EXPECT_NEAR(later[k], after[k] * std::exp(-3.0 / time_s), 0.1);
      EXPECT_GE(time_s, 1.0);
      EXPECT_LE(time_s, 4.0);
      const bool is_strong = std::abs(share) > 0.03; // of the others one in 370
      strong += is_strong;
      squares += is_strong ? 0.0 : share * share;
      sensors++;
    }
  }
  EXPECT_NEAR(double(strong) / sensors, 0.125 * 0.515 + 0.0024, 0.02);
  EXPECT_NEAR(std::sqrt(squares / (sensors - strong)), 0.0107, 0.001);
}

// Presses that overtake what is remembered of the one before, or do not.
TEST(Effects, NeitherMemoryNorAftereffectDependOnTheStepOrTheScale) {
  const std::vector<Corner> path{{0, 0},      {0.4, 9000},  {1, 9000}, {1.2, 0},    {2, 0},
                                 {2.4, 3000}, {2.6, 30000}, {3, 1000}, {3.5, 4000}, {6, 0}};
  std::vector<Corner> doubled = path;
  for (Corner &corner : doubled) {
    corner.base_Pa *= 2.0;
  }
  for (const char *effect : {"memory", "aftereffect"}) {
    for (std::uint64_t seed = 1; seed <= 8; seed++) {
      Pad fine = pad_with(effect, seed), coarse = pad_with(effect, seed), twice = pad_with(effect, seed);
      const std::vector<double> a = along(fine, path, 0.001), b = along(coarse, path, 0.1), c = along(twice, doubled, 0.1);
      for (std::size_t i = 0; i < b.size(); i++) {
        EXPECT_NEAR(a[100 * i], b[i], 1e-6) << effect << 0.1 * double(i);
        EXPECT_NEAR(2.0 * b[i], c[i], 1e-6) << effect << 0.1 * double(i);
      }
    }
  }
}

TEST(Effects, HysteresisLoopHasItsShareOfTheWorkAtAnySpeedAndSize) {
  for (double speed : {1.0, 10.0}) {
    for (double peak_Pa : {2000.0, 80000.0}) {
      Pad pad = pad_with("hysteresis=4");
      const double t_s = 10.0 / speed;
      const std::vector<double> readings = along(pad, {{0, 0}, {t_s, peak_Pa}, {2 * t_s, 0}}, t_s / 5000);
      const std::size_t half = readings.size() / 2;
      double loop = 0.0, work = 0.0;
      for (std::size_t i = 0; i <= half; i++) {
        loop += readings[i] - readings[readings.size() - 1 - i];
        work += readings[i];
        EXPECT_NEAR(readings[i], peak_Pa * double(i) / double(half), 1e-6);
      }
      EXPECT_NEAR(loop / work, 0.04, 1e-5);
      EXPECT_EQ(readings.back(), 0.0);
    }
  }
}

TEST(Effects, HysteresisRemembersItsLargestPressureAndClosesInnerLoops) {
  Pad pad = pad_with("hysteresis=10");
  const std::vector<double> readings = along(pad, {{0, 0}, {1, 10000}, {2, 5000}, {3, 8000}, {4, 5000}, {5, 10000}, {6, 12000}}, 0.01);
  EXPECT_NEAR(readings[200], 5000.0 - 0.3 * 5000.0 * 0.5, 1e-6);
  EXPECT_LT(readings[300], 8000.0);
  EXPECT_GT(readings[300], 8000.0 - 0.3 * 2500.0);
  EXPECT_LT(readings[350], 6500.0);
  EXPECT_NEAR(readings[500], 10000.0, 1e-6);
  EXPECT_NEAR(readings[600], 12000.0, 1e-6);
  for (std::size_t i = 1; i < readings.size(); i++) {
    EXPECT_LT(std::abs(readings[i] - readings[i - 1]), 120.0) << i; // no jump at a turn
  }
}

TEST(Effects, AftereffectLeavesPressesAndHoldsAsTheyWere) {
  Pad pad = pad_with("aftereffect");
  double t_s = 0.0;
  for (double base_Pa : {0.0, 400.0, 20000.0, 20000.0, 30000.0, 30000.0, 30000.0}) {
    EXPECT_EQ(reported(pad, t_s, base_Pa), std::vector<double>(SENSORS, base_Pa)) << t_s;
    t_s += 1.7;
  }
  Pad pulled = pad_with("aftereffect"); // rubber that was pulled remembers nothing
  for (double base_Pa : {0.0, -300.0, 0.0}) {
    EXPECT_EQ(reported(pulled, t_s, base_Pa), std::vector<double>(SENSORS, base_Pa));
    t_s += 1.0;
  }
}

TEST(Effects, AftereffectIsAShareOfThePeakThatGoesBackInItsTime) {
  for (double peak_Pa : {5000.0, 80000.0}) {
    for (double held_s : {0.1, 20.0}) {
      Pad pad = pad_with("aftereffect");
      reported(pad, 0.0, 0.0);
      reported(pad, 0.2, peak_Pa);
      reported(pad, 0.2 + held_s, peak_Pa);
      const double released_s = 0.2 + held_s + 1e-6;
      const std::vector<double> after = reported(pad, released_s, 0.0);
      const std::vector<double> later = reported(pad, released_s + 3.0, 0.0);
      for (std::size_t k = 0; k < SENSORS; k++) {
        const Pad::Aftereffect &effect = pad.aftereffects()[k];
        EXPECT_NEAR(after[k], effect.share * peak_Pa, 1e-5 * peak_Pa);
        EXPECT_NEAR(later[k], after[k] * std::exp(-3.0 / effect.time_s), 1e-6 * peak_Pa);
      }
      const std::vector<double> gone = reported(pad, released_s + 300.0, 0.0);
      for (double reading_Pa : gone) {
        EXPECT_NEAR(reading_Pa, 0.0, 1e-6);
      }
    }
  }
}

TEST(Effects, AftereffectsStandOffOrUndershootAsMeasured) {
  int sensors = 0, dips = 0, slow = 0;
  double least = 1.0, most = 0.0, least_dip = 1.0, most_dip = 0.0;
  for (std::uint64_t seed = 0; seed < 200; seed++) {
    const Pad pad = pad_with("aftereffect", seed), twice = pad_with("aftereffect=4", seed);
    for (std::size_t k = 0; k < SENSORS; k++) {
      const auto [share, time_s] = pad.aftereffects()[k];
      EXPECT_NEAR(twice.aftereffects()[k].share, 2.0 * share, 1e-12);
      EXPECT_EQ(twice.aftereffects()[k].time_s, time_s);
      EXPECT_GE(time_s, 1.0);
      EXPECT_LE(time_s, 4.0);
      slow += time_s > 2.0;
      double &low = share < 0.0 ? least_dip : least, &high = share < 0.0 ? most_dip : most;
      low = std::min(low, std::abs(share));
      high = std::max(high, std::abs(share));
      dips += share < 0.0;
      sensors++;
    }
  }
  EXPECT_NEAR(double(dips) / sensors, 1.0 / 3.0, 0.03);
  EXPECT_NEAR(double(slow) / sensors, 0.5, 0.03);
  EXPECT_NEAR(least, 0.01, 5e-4);
  EXPECT_NEAR(most, 0.025, 5e-4);
  EXPECT_NEAR(least_dip, 0.015, 5e-4);
  EXPECT_NEAR(most_dip, 0.045, 5e-4);
}

TEST(Effects, AftereffectOfAPressThatIsSmallerAddsNothing) {
  Pad one = pad_with("aftereffect"), two = pad_with("aftereffect");
  const std::vector<double> a = along(one, {{0, 0}, {1, 50000}, {1.5, 0}, {3, 0}}, 0.1);
  const std::vector<double> b = along(two, {{0, 0}, {1, 50000}, {1.5, 0}, {1.7, 0}, {1.8, 50}, {1.9, 0}, {3, 0}}, 0.1);
  EXPECT_NEAR(a.back(), b.back(), 0.1 * std::abs(a.back()));
  EXPECT_NE(a.back(), 0.0);
}

TEST(Effects, CreepRisesInAHoldAndStaysAsLongAfterIt) {
  Pad pad = pad_with("creep=2");
  const auto readings = along(pad, {{0, 0}, {0.1, 10000}, {30.1, 10000}, {30.2, 0}, {40.2, 0}}, 0.1);
  EXPECT_NEAR(readings[1], 10000.0, 10.0);
  EXPECT_NEAR(readings[31], 10000.0 + 200.0 * (1.0 - std::exp(-1.0)), 5.0);
  EXPECT_NEAR(readings[301], 10200.0, 1.0);
  EXPECT_NEAR(readings[332], 200.0 * std::exp(-1.0), 5.0);
}

TEST(Effects, SensorsSitOffTheirPlacesAndFeelWidthsOfTheirOwn) {
  double squares = 0.0, widths = 0.0;
  for (std::uint64_t seed = 1; seed <= 60; seed++) {
    const Pad pad = pad_with("places=0.2,widths=4", seed), twice = pad_with("places=0.4", seed);
    for (std::size_t k = 0; k < SENSORS; k++) {
      const Pad::Seat &seat = pad.seats()[k];
      squares += seat.dx_mm * seat.dx_mm + seat.dy_mm * seat.dy_mm;
      widths += std::log(seat.width) * std::log(seat.width);
      EXPECT_NEAR(twice.seats()[k].dx_mm, 2.0 * seat.dx_mm, 1e-12);
      EXPECT_EQ(twice.seats()[k].width, 1.0);
    }
  }
  EXPECT_NEAR(std::sqrt(squares / (2.0 * 60 * SENSORS)), 0.2, 0.015);
  EXPECT_NEAR(std::sqrt(widths / (60.0 * SENSORS)), 0.04, 0.003);
  EXPECT_EQ(pad_with("dip=3").dip_share(), 0.03);
  EXPECT_EQ(pad_with("none").dip_share(), 0.0);
}

TEST(Effects, GainsAreNormalAndTheSamePadAtAnySpread) {
  double sum = 0.0, squares = 0.0, largest = 0.0;
  int beyond_sd = 0;
  constexpr int PADS = 4000;
  for (int seed = 0; seed < PADS; seed++) {
    const Pad ten = pad_with("gain=10", static_cast<std::uint64_t>(seed));
    const Pad five = pad_with("gain=5", static_cast<std::uint64_t>(seed));
    for (std::size_t k = 0; k < SENSORS; k++) {
      const double error = ten.gain_errors()[k];
      EXPECT_NEAR(five.gain_errors()[k], 0.5 * error, 1e-12);
      sum += error;
      squares += error * error;
      largest = std::max(largest, std::abs(error));
      beyond_sd += std::abs(error) > 0.1;
    }
  }
  constexpr double COUNT = PADS * SENSORS;
  // Cut at three sd, a normal has 0.9866 of its sd.
  EXPECT_NEAR(std::sqrt(squares / COUNT), 0.09866, 0.001);
  EXPECT_NEAR(sum / COUNT, 0.0, 0.0015);
  EXPECT_LE(largest, 0.3);
  EXPECT_NEAR(beyond_sd / COUNT, 0.3155, 0.008);
  Pad pad = pad_with("gain=10");
  const std::vector<double> readings = reported(pad, 0.0, 1000.0);
  for (std::size_t k = 0; k < SENSORS; k++) {
    EXPECT_NEAR(readings[k], 1000.0 * (1.0 + pad.gain_errors()[k]), 1e-9);
  }
}

TEST(Effects, DriftIsARampOfTheMeasuredSizeEitherWay) {
  int up = 0, down = 0;
  for (std::uint64_t seed = 0; seed < 20; seed++) {
    Pad pad = pad_with("drift", seed);
    const std::vector<double> first = reported(pad, 0.0, 0.0), half = reported(pad, 480.0, 0.0), last = reported(pad, 960.0, 0.0);
    for (std::size_t k = 0; k < SENSORS; k++) {
      EXPECT_EQ(first[k], 0.0);
      EXPECT_NEAR(2.0 * half[k], last[k], 1e-9);
      EXPECT_GE(std::abs(last[k]), 130.0 - 1e-9);
      EXPECT_LE(std::abs(last[k]), 210.0 + 1e-9);
      (last[k] > 0 ? up : down)++;
    }
  }
  EXPECT_GT(up, 110);
  EXPECT_GT(down, 110);
}

TEST(Effects, BiasReadsLowAboveTheSpecifiedRangeOnly) {
  Pad pad = pad_with("bias=2");
  double before_Pa = -1.0;
  for (double absolute_Pa = AMBIENT_Pa; absolute_Pa < 600000.0; absolute_Pa += 1000.0) {
    const double reading_Pa = reported(pad, absolute_Pa, absolute_Pa - AMBIENT_Pa)[0];
    if (absolute_Pa <= 120000.0) {
      EXPECT_NEAR(reading_Pa, absolute_Pa - AMBIENT_Pa, 1e-9);
    } else {
      EXPECT_LT(reading_Pa, absolute_Pa - AMBIENT_Pa);
    }
    EXPECT_GT(reading_Pa, before_Pa);
    before_Pa = reading_Pa;
  }
  EXPECT_NEAR(reported(pad, 1e6, 200000.0 - AMBIENT_Pa)[0], 196000.0 - AMBIENT_Pa, 1e-6);
}

TEST(Effects, ClipEndsReadings) {
  Pad two = pad_with("clip"), five = pad_with("clip=5");
  EXPECT_NEAR(reported(two, 0, 90000)[0], 90000, 1e-9);
  EXPECT_NEAR(reported(two, 1, 300000)[0], 202000 - AMBIENT_Pa, 1e-9);
  EXPECT_NEAR(reported(five, 0, 300000)[0], 300000, 1e-9);
  EXPECT_NEAR(reported(five, 1, 500000)[0], 500000 - AMBIENT_Pa, 1e-9);
}

TEST(Effects, TemperatureRisesThroughTheLayerAndLeavesPressuresAlone) {
  Pad thick = pad_with("temperature");
  const Pad thin(parse_effects("temperature"), SENSORS, 6.0, AMBIENT_Pa, 1);
  EXPECT_EQ(thick.temperature_degC(0), 25.0);
  EXPECT_NEAR(thick.temperature_degC(486.3), 25.0 + 6.0 * (1 - std::exp(-1.0)), 0.01);
  EXPECT_NEAR(thin.temperature_degC(486.3 / 4), 25.0 + 6.0 * (1 - std::exp(-1.0)), 0.01);
  EXPECT_NEAR(thick.temperature_degC(1e5), 31.0, 1e-9);
  EXPECT_EQ(reported(thick, 0, 1234.0)[3], 1234.0);
}

// The rule itself, in real numbers: what a part says whose codes are these.
static double compensated_Pa(const std::array<double, 6> &c, double d1, double dT, bool very_cold) {
  const double below = dT * c[5] / 0x1p23;
  double offset = c[1] * 0x1p17 + c[3] * dT / 0x1p6;
  double sensitivity = c[0] * 0x1p16 + c[2] * dT / 0x1p7;
  offset -= below * below * (very_cold ? 35.0 / 8.0 : 30.0 / 256.0);
  sensitivity -= very_cold ? 63.0 * below * below / 32.0 : 0.0;
  return (d1 * sensitivity / 0x1p21 - offset) / 0x1p15;
}

TEST(Effects, BranchStepsByWhatTheRuleStepsBy) {
  const std::array<double, 6> typical{46372, 43981, 29059, 27842, 31553, 28165};
  const double dT = -1000.0 * 0x1p23 / typical[5];
  double sum_Pa[2]{}, least_Pa = 1e9, most_Pa = 0.0;
  const double bases_Pa[2]{0.0, 60000.0};
  constexpr int PADS = 200;
  for (std::uint64_t seed = 0; seed < PADS; seed++) {
    for (int i = 0; i < 2; i++) {
      Pad pad = pad_with("branch", seed);
      const std::vector<double> before = reported(pad, 45.0, bases_Pa[i]);
      const std::vector<double> after = reported(pad, 48.0, bases_Pa[i]);
      for (std::size_t k = 0; k < SENSORS; k++) {
        EXPECT_EQ(before[k], bases_Pa[i]);
        sum_Pa[i] += (after[k] - before[k]) / (PADS * SENSORS);
        if (i == 0) {
          EXPECT_EQ(after[k], pad.branches()[k].step_Pa);
          least_Pa = std::min(least_Pa, after[k]);
          most_Pa = std::max(most_Pa, after[k]);
        }
      }
    }
  }
  for (int i = 0; i < 2; i++) {
    // The code at which the part, in the middle branch, reads this pressure.
    double low = 0.0, high = 0x1p24;
    while (high - low > 1e-3) {
      const double code = 0.5 * (low + high);
      (compensated_Pa(typical, code, dT, false) < AMBIENT_Pa + bases_Pa[i] ? low : high) = code;
    }
    const double step_Pa = compensated_Pa(typical, low, dT, false) - compensated_Pa(typical, low, dT, true);
    EXPECT_NEAR(sum_Pa[i], step_Pa, 0.6) << i;
    EXPECT_NEAR(step_Pa, i == 0 ? 51.1 : 90.9, 0.2);
  }
  EXPECT_GT(least_Pa, 40.0);
  EXPECT_LT(least_Pa, 46.0);
  EXPECT_GT(most_Pa, 57.0);
  EXPECT_LT(most_Pa, 63.0);
}

TEST(Effects, BranchIsCrossedOnceAndWhereItIs) {
  Pad pad = pad_with("branch");
  EXPECT_EQ(pad.temperature_degC(0.0), 5.0);
  EXPECT_NEAR(pad.temperature_degC(30.0), 8.0, 1e-12);
  EXPECT_EQ(pad.temperature_degC(200.0), ROOM_degC);
  EXPECT_EQ(pad.temperature_degC(5000.0), ROOM_degC);
  std::vector<double> before(SENSORS, 0.0);
  std::vector<int> crossings(SENSORS, 0);
  for (int ms = 0; ms <= 220000; ms += 10) {
    const std::vector<double> now = reported(pad, 1e-3 * ms, 0.0);
    for (std::size_t k = 0; k < SENSORS; k++) {
      if (now[k] != before[k]) {
        crossings[k]++;
        EXPECT_NEAR(1e-3 * ms, (pad.branches()[k].edge_degC - 5.0) / 0.1, 0.02);
        EXPECT_NEAR(pad.branches()[k].edge_degC, 9.665, 0.05);
      }
    }
    before = now;
  }
  EXPECT_EQ(crossings, std::vector<int>(SENSORS, 1));
  // What begins beyond the edge has nothing to cross; what warms from above adds to it.
  Pad warm = pad_with("branch=12"), held = pad_with("branch=25,temperature");
  EXPECT_EQ(reported(warm, 0.0, 0.0), std::vector<double>(SENSORS, 0.0));
  EXPECT_EQ(reported(warm, 100.0, 0.0), std::vector<double>(SENSORS, 0.0));
  EXPECT_NEAR(held.temperature_degC(1e5), 31.0, 1e-9);
}

TEST(Effects, AreParsed) {
  EXPECT_TRUE(parse_effects("").empty());
  EXPECT_TRUE(parse_effects("none").empty());
  EXPECT_EQ(parse_effects("all").size(), effects().size());
  for (const Effect &effect : effects()) {
    EXPECT_GE(effect.usual, effect.lowest);
    EXPECT_LE(effect.usual, effect.highest);
  }
  EXPECT_EQ(parse_effects("all,clip=5").at("clip"), 5.0);
  EXPECT_EQ(parse_effects("clip=5, all").at("clip"), 5.0);
  EXPECT_EQ(parse_effects("gain").at("gain"), 10.0);
  for (const char *wrong : {"noise", "gain=", "gain=x", "gain=31", "gain=-1", "drift,,gain", "all=1"}) {
    EXPECT_THROW(parse_effects(wrong), Error) << wrong;
  }
  try {
    parse_effects("clip=9999");
    FAIL();
  } catch (const Error &error) {
    EXPECT_STREQ(error.what(), "effect clip is \"9999\"; give 1.2 to 10 (bar)");
  }
}
