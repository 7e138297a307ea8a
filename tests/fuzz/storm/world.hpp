// What the fingertip senses, and so the truth: touches with rests between, each a Gaussian of pressure, which is what
// the firmware's fit takes a contact for. So an error of what it reports comes from a fault, or from the noise.
//
// Times are of the bench, us since it began. Rows of one step each, linear between; fixed ahead,
// since a simulated conversion asks for its middle when it begins.
#pragma once

extern "C" {
#include "support/random.h"
}

#include <array>
#include <cstdint>
#include <deque>

namespace storm {

constexpr unsigned SENSORS = 15;
constexpr std::uint64_t STEP_us = 10000;
constexpr std::uint64_t AHEAD_us = 5 * STEP_us;

struct Row {
  double p0_Pa, x_mm, y_mm, sigma_mm; // p0_Pa 0: nothing touches
  double temperature_degC;
  std::array<double, SENSORS> pressure_Pa; // absolute

  double force_N() const;
  double peak_Pa; // on the sensor with the most, above ambient
};

class World {
public:
  explicit World(std::uint64_t seed);

  // Adds rows up to t_us + AHEAD_us.
  void extend_to(std::uint64_t t_us);
  // Nothing touches from one time to the other; both later than what is fixed.
  void keep_off(std::uint64_t from_us, std::uint64_t to_us);

  std::uint64_t fixed_us() const { return first_us_ + (rows_.size() - 1) * STEP_us; }
  // Since when nothing has touched, of what is fixed; UINT64_MAX: something does.
  std::uint64_t resting_since_us() const { return resting_since_us_; }
  Row at(std::uint64_t t_us) const; // of the last two minutes
  double pressure_Pa(unsigned sensor, std::uint64_t t_us) const;
  double temperature_degC(std::uint64_t t_us) const;

private:
  struct Place {
    std::size_t row;
    double share; // of the next
  };
  Place place(std::uint64_t t_us) const;
  void begin_touch(std::uint64_t t_us);
  void add_row(std::uint64_t t_us);

  struct random random_;
  std::uint64_t first_us_ = 0;
  std::deque<Row> rows_;
  std::array<double, SENSORS> ambient_Pa_{};
  std::uint64_t off_from_us_ = 0, off_to_us_ = 0;
  std::uint64_t resting_since_us_ = 0;
  struct {
    std::uint64_t begin_us, end_us; // of the touch, or of the next one
    double rise_us, fall_us;
    double p0_Pa, sigma_mm, x_mm, y_mm, reach_mm, turn_s, phase;
  } touch_{};
};

} // namespace storm
