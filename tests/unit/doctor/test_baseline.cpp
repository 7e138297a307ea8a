#include "support/host_packets.hpp"
#include "tool/doctor/baseline.hpp"

#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <random>

using fingertip::Baseline;
using fingertip::BaselineMeter;

constexpr unsigned SENSORS = 15;
constexpr double NOISE_Pa = 4;

/* What one sensor reads beside 101325 Pa and the noise, at a time in s. */
using Signal = std::function<double(unsigned sensor, double t_s)>;

struct Pad {
  double noise_Pa[SENSORS];
  std::uint32_t flags = CONTACT_FLAG_TARED;
  std::uint32_t valid = 0x7FFF;
  Pad() { std::fill_n(noise_Pa, SENSORS, NOISE_Pa); }
};

static Baseline measure(const Pad &pad, const Signal &signal, double seconds = 10, double rate_Hz = 200) {
  std::mt19937 random(20260101);
  std::normal_distribution<double> gaussian;
  BaselineMeter meter;
  auto frames = static_cast<std::uint32_t>(seconds * rate_Hz) + 1;
  for (std::uint32_t i = 0; i < frames; i++) {
    double t_s = i / rate_Hz;
    auto t_us = 1000000 + static_cast<std::uint64_t>(t_s * 1e6);
    wire_packet contact = test::make_contact(0, t_us, 50 + i);
    contact.body.contact.flags = pad.flags;
    meter.add(contact);
    wire_packet raw = test::make_raw(0, t_us, 50 + i);
    raw.body.raw.flags = pad.flags;
    raw.body.raw.valid = pad.valid;
    raw.body.raw.saturated = 0;
    raw.body.raw.doubtful = i % 2 ? 1u << 3 : 0;
    for (unsigned k = 0; k < SENSORS; k++) {
      double pressure_Pa = 101325 + 1000.0 * k + signal(k, t_s) + pad.noise_Pa[k] * gaussian(random);
      raw.body.raw.pressure_Pa_q10[k] = static_cast<std::int32_t>(pressure_Pa * 1024);
    }
    meter.add(raw);
  }
  return meter.result();
}

static double nothing(unsigned, double) { return 0; }

TEST(Baseline, EdgesAndThoseThatAreMissing) {
  BaselineMeter meter;
  for (std::uint32_t number : {7u, 8u, 11u}) {
    wire_packet edge{};
    edge.type = WIRE_SYNC;
    edge.t_us = 1000000 + 1000 * number;
    edge.body.sync.number = number;
    meter.add(edge);
  }
  EXPECT_EQ(meter.result().edges, 3u);
  EXPECT_EQ(meter.result().edges_missing, 2u);
}

TEST(Baseline, NoiseOfEachSensorWhateverTheOthersDo) {
  Pad pad;
  pad.noise_Pa[7] = 40;
  for (bool touched : {false, true}) {
    pad.flags = CONTACT_FLAG_TARED | (touched ? CONTACT_FLAG_CONTACT : 0);
    Baseline baseline = measure(pad, nothing);
    ASSERT_EQ(baseline.sensors.size(), SENSORS);
    for (unsigned k = 0; k < SENSORS; k++) {
      EXPECT_NEAR(*baseline.sensors[k].noise_Pa / pad.noise_Pa[k], 1, touched ? 0.2 : 0.08) << k;
    }
  }
}

TEST(Baseline, MovesOfTheAirAreNoNoiseAndNoDriftOfASensor) {
  Baseline baseline = measure(Pad(), [](unsigned, double t_s) { return 200 * std::sin(40 * t_s) + 30 * t_s; });
  for (const auto &sensor : baseline.sensors) {
    EXPECT_NEAR(*sensor.noise_Pa / NOISE_Pa, 1, 0.08);
    EXPECT_LT(std::abs(sensor.drift->Pa_per_s), 0.2);
  }
  EXPECT_NEAR(baseline.common_drift->Pa_per_s, 30, 2);
}

TEST(Baseline, DriftOfOneSensorWithItsStandardDeviation) {
  Baseline baseline = measure(Pad(), [](unsigned k, double t_s) { return k == 4 ? -2 * t_s : 0; });
  for (unsigned k = 0; k < SENSORS; k++) {
    const auto &drift = *baseline.sensors[k].drift;
    EXPECT_LT(std::abs(drift.Pa_per_s + (k == 4 ? 2 : 0)), 5 * drift.sd_Pa_per_s) << k;
    EXPECT_LT(drift.sd_Pa_per_s, 0.1) << k;
  }
}

TEST(Baseline, CountsFramesTouchedDoubtfulAndMissing) {
  Pad pad;
  pad.flags = CONTACT_FLAG_TARED | CONTACT_FLAG_CONTACT;
  pad.valid = 0x7FFF & ~(1u << 9);
  Baseline baseline = measure(pad, nothing, 2, 100);
  EXPECT_NEAR(baseline.seconds, 2, 1e-6);
  EXPECT_EQ(baseline.frames_made, 200u);
  EXPECT_EQ(baseline.frames_received, 201u);
  EXPECT_EQ(baseline.frames_touched, 201u);
  EXPECT_EQ(baseline.last_flags, pad.flags);
  EXPECT_EQ(baseline.sensors[9].readings, 0u);
  EXPECT_EQ(baseline.sensors[9].valid_share, 0);
  EXPECT_FALSE(baseline.sensors[9].noise_Pa);
  EXPECT_FALSE(baseline.sensors[9].drift);
  EXPECT_EQ(baseline.sensors[8].valid_share, 1);
  EXPECT_NEAR(baseline.sensors[8].mean_Pa, 101325 + 8000, 2);
  EXPECT_NEAR(baseline.sensors[3].doubtful_share, 0.5, 0.01);
}

TEST(Baseline, HeldFramesAreNoReadings) {
  BaselineMeter meter;
  for (std::uint32_t i = 0; i < 100; i++) {
    wire_packet raw = test::make_raw(0, i * 10000, i);
    raw.body.raw.valid = 0x7FFF;
    raw.body.raw.flags = i % 2 ? CONTACT_FLAG_HELD : 0;
    meter.add(raw);
  }
  Baseline baseline = meter.result();
  EXPECT_EQ(baseline.frames_received, 100u);
  EXPECT_EQ(baseline.sensors[0].readings, 50u);
  EXPECT_EQ(baseline.sensors[0].valid_share, 1);
}

TEST(Baseline, NothingOrOneFrameIsNoMeasurement) {
  BaselineMeter meter;
  EXPECT_EQ(meter.result().frames_made, 0u);
  meter.add(test::make_health(0, 5));
  EXPECT_EQ(meter.result().frames_received, 0u);
  meter.add(test::make_raw(0, 5, 1));
  Baseline baseline = meter.result();
  EXPECT_EQ(baseline.frames_received, 1u);
  EXPECT_EQ(baseline.frames_made, 0u);
  EXPECT_FALSE(baseline.sensors.at(1).noise_Pa);
  EXPECT_FALSE(baseline.sensors.at(1).drift);
}
