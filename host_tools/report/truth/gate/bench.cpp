#include "truth/gate/bench.hpp"

#include "libfingertip/random.hpp"
#include "tool/doctor/wiring.hpp"

extern "C" {
#include "common/contact_flags.h"
#include "config/defaults.h"
#include "config/geometry.h"
#include "native/sim_ms5840.h"
}

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace fingertip::truth {
namespace {

constexpr double SIGMA_mm = 5.7;
constexpr double AMBIENT_Pa = 101325.0;
constexpr double DRIFT_LEAST_Pa = 130.0, DRIFT_MOST_Pa = 210.0, DRIFT_SPAN_s = 960.0;
constexpr double TEMPERATURE_INTERVAL_s = 0.5;
// The part's own reading does not step where its correction does: by -60 Pa at 1 bar.
constexpr double BRANCH_degC = 10.0, BRANCH_STEP_Pa = -60.0;
// The worked example of the datasheet; parts differ by 3 % as the player's do.
constexpr std::array<std::uint16_t, 6> COEFFICIENTS{46372, 43981, 29059, 27842, 31553, 28165};
constexpr double PROM_SPREAD = 0.03;

enum Stream : std::uint64_t { OFFSET = 301, DRIFT, PROM, NOISE };

// Normal numbers are drawn once: hours of frames take billions.
const std::vector<float> &normals() {
  static const std::vector<float> drawn = [] {
    std::vector<float> all(1 << 16);
    Random random(1, NOISE, 0);
    for (float &one : all) {
      one = static_cast<float>(random.normal());
    }
    return all;
  }();
  return drawn;
}

} // namespace

std::vector<Mode> modes() {
  std::vector<Mode> all;
  for (const Wiring &wiring : Wiring::all()) {
    for (unsigned osr = 256; osr <= 8192; osr *= 2) {
      const ms58xx_osr *row = ms58xx_find_osr(static_cast<std::uint16_t>(osr));
      all.push_back({wiring.board, osr, 1e6 / (wiring.overhead_us + row->conversion_us), row->noise_Pa_q10 / 1024.0,
                     row->noise_Pa_q10});
    }
  }
  return all;
}

void press(Pressures &pressures_Pa, double x_mm, double y_mm, double force_N) {
  const double p0_Pa = 1e6 * force_N / (2.0 * M_PI * SIGMA_mm * SIGMA_mm);
  for (std::size_t k = 0; k < SENSORS; k++) {
    const double dx = static_cast<double>(geometry.x_mm[k]) - x_mm;
    const double dy = static_cast<double>(geometry.y_mm[k]) - y_mm;
    pressures_Pa[k] += p0_Pa * std::exp(-0.5 * (dx * dx + dy * dy) / (SIGMA_mm * SIGMA_mm));
  }
}

Bench::Bench(const Mode &mode, std::uint64_t seed) : mode_(mode), noise_at_(Random(seed, NOISE, 1).next()) {
  if (fit_array_init_grid(&array_, geometry.sensor_count, geometry.x_mm, geometry.y_mm, geometry.pitch_mm) != FT_OK) {
    throw std::runtime_error("fit_array_init refuses the geometry");
  }
  for (std::size_t k = 0; k < SENSORS; k++) {
    Random offset(seed, OFFSET, k), drift(seed, DRIFT, k), prom(seed, PROM, k);
    offset_Pa_[k] = AMBIENT_Pa + 500.0 * offset.normal();
    drawn_drift_Pa_s_[k] =
        (drift.uniform(0.0, 1.0) < 0.5 ? -1.0 : 1.0) * drift.uniform(DRIFT_LEAST_Pa, DRIFT_MOST_Pa) / DRIFT_SPAN_s;
    std::array<std::uint16_t, 6> c{};
    for (std::size_t i = 0; i < c.size(); i++) {
      c[i] = static_cast<std::uint16_t>(COEFFICIENTS[i] * (1.0 + prom.uniform(-PROM_SPREAD, PROM_SPREAD)));
    }
    sim_ms5840 part;
    sim_ms5840_init(&part, c.data());
    std::copy(std::begin(part.prom), std::end(part.prom), std::begin(proms_[k].word));
  }
  frame_.sensor_count = SENSORS;
  frame_.valid = (1u << SENSORS) - 1;
  frame_.noise_Pa_q10 = mode.noise_Pa_q10;
  condition_start(&condition_);
}

void Bench::drift() {
  for (std::size_t k = 0; k < SENSORS; k++) {
    offset_Pa_[k] -= drawn_drift_Pa_s_[k] * t_s_;
  }
  drift_Pa_s_ = drawn_drift_Pa_s_;
}

void Bench::warm(const std::function<double(double)> &temperature_degC) {
  temperature_degC_ = temperature_degC;
  warm_since_s_ = t_s_;
  thermal_at_s_ = -TEMPERATURE_INTERVAL_s;
}

double Bench::noise() {
  noise_at_ = noise_at_ * 6364136223846793005u + 1442695040888963407u;
  return static_cast<double>(normals()[noise_at_ >> 48]) * mode_.noise_Pa;
}

std::int32_t Bench::converted(std::size_t k, double pressure_Pa) {
  const double degC = temperature_degC_(t_s_ - warm_since_s_);
  const std::uint32_t d2 = sim_ms5840_d2(proms_[k].word, degC);
  const double read_Pa = pressure_Pa + (degC > BRANCH_degC ? BRANCH_STEP_Pa : 0.0);
  return ms58xx_compensate_pressure(&thermal_[k], sim_ms5840_d1(proms_[k].word, read_Pa, d2));
}

void Bench::run(double seconds, const Feels &feels, const Sees &sees) {
  const double begin_s = t_s_;
  for (auto left = std::lround(seconds * mode_.frames_per_s); left > 0; left--) {
    t_s_ += 1.0 / mode_.frames_per_s;
    if (temperature_degC_ && t_s_ - thermal_at_s_ >= TEMPERATURE_INTERVAL_s) {
      thermal_at_s_ = t_s_;
      for (std::size_t k = 0; k < SENSORS; k++) {
        const double degC = temperature_degC_(t_s_ - warm_since_s_);
        ms58xx_compensate_temperature(&proms_[k], sim_ms5840_d2(proms_[k].word, degC), thermal_[k].branch,
                                      &thermal_[k]);
      }
    }
    Pressures felt_Pa{};
    if (feels) {
      feels(t_s_ - begin_s, felt_Pa);
    }
    for (std::size_t k = 0; k < SENSORS; k++) {
      const double reads_Pa = offset_Pa_[k] + drift_Pa_s_[k] * t_s_ + felt_Pa[k] + noise();
      frame_.pressure_Pa_q10[k] =
          temperature_degC_ ? converted(k, reads_Pa) : static_cast<std::int32_t>(1024.0 * reads_Pa);
    }
    frame_.number++;
    frame_.t_us = static_cast<std::uint64_t>(1e6 * t_s_);
    condition_frame(&condition_, &frame_, nullptr, &readings_);
    condition_follow(&condition_, &frame_, &readings_);
    if (sees) {
      sees(t_s_ - begin_s, {readings_.contact, readings_.zero_doubtful});
    }
  }
}

double Bench::force_N() const {
  fit_settings settings{};
  settings.iterations = DEFAULT_FIT_ITERATIONS;
  settings.cut_noises = DEFAULT_CUT_NOISES;
  settings.noise_Pa_q10 = frame_.noise_Pa_q10;
  fit_result fit{};
  if (readings_.contact) {
    fit_gaussian_grid(&array_, readings_.pressure_Pa_q10, readings_.usable, &settings, &fit);
  }
  return fit.flags & CONTACT_FLAG_FIT_VALID ? static_cast<double>(fit.force_N) : 0.0;
}

double Bench::worst_zero_error_Pa() const {
  double worst_Pa = 0.0;
  for (std::size_t k = 0; k < SENSORS; k++) {
    const double zero_Pa = condition_.zero_Pa_q10[k] / 1024.0;
    worst_Pa = std::max(worst_Pa, std::abs(zero_Pa - offset_Pa_[k] - drift_Pa_s_[k] * t_s_));
  }
  return worst_Pa;
}

} // namespace fingertip::truth
