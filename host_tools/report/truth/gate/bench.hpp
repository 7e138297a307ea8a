// A pad on a bench: pressures over time through the firmware's own condition and fit, at the rate
// and with the noise of a board and an oversampling.
//
// A contact is a Gaussian of 5.7 mm, the width of most objects under 12 mm of rubber: what is
// judged here is the zero, not the shape.
#pragma once

extern "C" {
#include "condition/condition.h"
#include "fit/fit.h"
#include "ms58xx/ms58xx.h"
}

#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace fingertip::truth {

constexpr std::size_t SENSORS = 15;
using Pressures = std::array<double, SENSORS>; // above the zero, Pa

struct Mode {
  std::string board;
  unsigned osr;
  double frames_per_s, noise_Pa;
  std::int32_t noise_Pa_q10;
};

// Every board at every oversampling.
std::vector<Mode> modes();

// Adds a press of this force.
void press(Pressures &pressures_Pa, double x_mm, double y_mm, double force_N);

struct Said {
  bool contact = false, doubtful = false;
  bool certain() const { return contact && !doubtful; }
};

class Bench {
public:
  // What the pad feels so many seconds after the beginning of a run, added to zeros.
  using Feels = std::function<void(double t_s, Pressures &pressures_Pa)>;
  using Sees = std::function<void(double t_s, const Said &said)>;

  Bench(const Mode &mode, std::uint64_t seed);

  // Each sensor from now on at a constant rate of its own: 130 to 210 Pa in 16 min, up or down.
  void drift();
  // Readings come from conversions, and temperatures from one in half a second.
  void warm(const std::function<double(double t_s)> &temperature_degC);

  void run(double seconds, const Feels &feels = nullptr, const Sees &sees = nullptr);

  // Of the last frame.
  double force_N() const; // 0 without a contact or a fit
  double worst_zero_error_Pa() const;
  const Mode &mode() const { return mode_; }

private:
  double noise();
  std::int32_t converted(std::size_t k, double pressure_Pa);

  Mode mode_;
  std::uint64_t noise_at_;
  double t_s_ = 1.0;
  std::array<double, SENSORS> offset_Pa_{}, drawn_drift_Pa_s_{}, drift_Pa_s_{};
  fit_array array_{};
  condition condition_{};
  conditioned readings_{};
  frame frame_{};
  std::function<double(double)> temperature_degC_;
  double warm_since_s_ = 0.0, thermal_at_s_ = 0.0;
  std::array<ms58xx_prom, SENSORS> proms_{};
  std::array<ms58xx_thermal, SENSORS> thermal_{};
};

} // namespace fingertip::truth
