#include "world.hpp"

extern "C" {
#include "config/geometry.h"
}

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace storm {

constexpr double PI = 3.14159265358979;
constexpr double AMBIENT_Pa = 101325;
// Moulding presses on the sensors, on each by its own amount.
constexpr double MOULDED_Pa = 3000;
constexpr double TEMPERATURE_degC = 25, TEMPERATURE_SWING_degC = 1.5, TEMPERATURE_PERIOD_s = 300;
constexpr std::uint64_t KEPT_us = 120000000;

static double smooth(double share) {
  const double s = std::clamp(share, 0.0, 1.0);
  return s * s * (3 - 2 * s);
}

static double mix(double a, double b, double share) { return a + (b - a) * share; }

double Row::force_N() const { return 2 * PI * p0_Pa * sigma_mm * sigma_mm * 1e-6; }

World::World(std::uint64_t seed) : random_{seed * 2 + 1} {
  for (int i = 0; i < 8; i++) {
    random_u64(&random_);
  }
  for (double &ambient : ambient_Pa_) {
    ambient = AMBIENT_Pa + random_between(&random_, 0, MOULDED_Pa);
  }
  begin_touch(3000000);
  add_row(0);
}

void World::begin_touch(std::uint64_t t_us) {
  struct random *r = &random_;
  touch_.begin_us = t_us;
  touch_.end_us = t_us + static_cast<std::uint64_t>(random_between(r, 0.5e6, 6e6));
  touch_.rise_us = random_between(r, 30e3, 300e3);
  touch_.fall_us = random_between(r, 30e3, 300e3);
  touch_.p0_Pa = 2000 * std::pow(25.0, random_between(r, 0, 1));
  touch_.sigma_mm = random_between(r, 5, 8);
  touch_.x_mm = random_between(r, -6, 6);
  touch_.y_mm = random_between(r, -14, 14);
  touch_.reach_mm = random_below(r, 2) ? random_between(r, 0, 2.5) : 0;
  touch_.turn_s = random_between(r, 0.8, 4);
  touch_.phase = random_between(r, 0, 2 * PI);
}

void World::add_row(std::uint64_t t_us) {
  if (t_us >= off_from_us_ && t_us < off_to_us_) {
    begin_touch(off_to_us_ + static_cast<std::uint64_t>(random_between(&random_, 0, 2e6)));
    off_from_us_ = off_to_us_ = 0;
  }
  if (t_us > touch_.end_us) {
    begin_touch(t_us + static_cast<std::uint64_t>(random_between(&random_, 0.5e6, 4e6)));
  }
  const double t_s = 1e-6 * static_cast<double>(t_us);
  const double since_us = static_cast<double>(t_us) - static_cast<double>(touch_.begin_us);
  const double left_us = static_cast<double>(touch_.end_us) - static_cast<double>(t_us);
  Row row{};
  row.p0_Pa = touch_.p0_Pa * smooth(since_us / touch_.rise_us) * smooth(left_us / touch_.fall_us);
  const double angle = touch_.phase + 2 * PI * t_s / touch_.turn_s;
  row.x_mm = touch_.x_mm + touch_.reach_mm * std::cos(angle);
  row.y_mm = touch_.y_mm + touch_.reach_mm * std::sin(angle);
  row.sigma_mm = touch_.sigma_mm;
  row.temperature_degC = TEMPERATURE_degC + TEMPERATURE_SWING_degC * std::sin(2 * PI * t_s / TEMPERATURE_PERIOD_s);
  for (unsigned k = 0; k < SENSORS; k++) {
    const double dx = static_cast<double>(geometry.x_mm[k]) - row.x_mm;
    const double dy = static_cast<double>(geometry.y_mm[k]) - row.y_mm;
    const double above = row.p0_Pa * std::exp(-(dx * dx + dy * dy) / (2 * row.sigma_mm * row.sigma_mm));
    row.pressure_Pa[k] = ambient_Pa_[k] + above;
    row.peak_Pa = std::max(row.peak_Pa, above);
  }
  if (row.p0_Pa > 0) {
    resting_since_us_ = UINT64_MAX;
  } else if (resting_since_us_ == UINT64_MAX) {
    resting_since_us_ = t_us;
  }
  rows_.push_back(row);
}

void World::extend_to(std::uint64_t t_us) {
  while (fixed_us() < t_us + AHEAD_us) {
    add_row(fixed_us() + STEP_us);
  }
  while (fixed_us() - first_us_ > KEPT_us) {
    rows_.pop_front();
    first_us_ += STEP_us;
  }
}

void World::keep_off(std::uint64_t from_us, std::uint64_t to_us) {
  if (from_us <= fixed_us()) {
    throw std::logic_error("what is fixed stays");
  }
  off_from_us_ = from_us;
  off_to_us_ = to_us;
}

World::Place World::place(std::uint64_t t_us) const {
  if (t_us < first_us_) {
    return {0, 0};
  }
  const std::size_t row = (t_us - first_us_) / STEP_us;
  if (row + 1 >= rows_.size()) {
    return {rows_.size() - 1, 0};
  }
  return {row, static_cast<double>((t_us - first_us_) % STEP_us) / STEP_us};
}

Row World::at(std::uint64_t t_us) const {
  const Place p = place(t_us);
  Row row = rows_[p.row];
  if (p.share == 0) {
    return row;
  }
  const Row &next = rows_[p.row + 1];
  if (row.p0_Pa == 0 || next.p0_Pa == 0) { // one of the two has no location: the other's holds
    const Row &there = row.p0_Pa == 0 ? next : row;
    row.x_mm = there.x_mm;
    row.y_mm = there.y_mm;
    row.sigma_mm = there.sigma_mm;
  } else {
    row.x_mm = mix(row.x_mm, next.x_mm, p.share);
    row.y_mm = mix(row.y_mm, next.y_mm, p.share);
  }
  row.p0_Pa = mix(row.p0_Pa, next.p0_Pa, p.share);
  row.peak_Pa = mix(row.peak_Pa, next.peak_Pa, p.share);
  row.temperature_degC = mix(row.temperature_degC, next.temperature_degC, p.share);
  for (unsigned k = 0; k < SENSORS; k++) {
    row.pressure_Pa[k] = mix(row.pressure_Pa[k], next.pressure_Pa[k], p.share);
  }
  return row;
}

double World::pressure_Pa(unsigned sensor, std::uint64_t t_us) const {
  const Place p = place(t_us);
  const double here = rows_[p.row].pressure_Pa[sensor];
  return p.share == 0 ? here : mix(here, rows_[p.row + 1].pressure_Pa[sensor], p.share);
}

double World::temperature_degC(std::uint64_t t_us) const {
  const Place p = place(t_us);
  const double here = rows_[p.row].temperature_degC;
  return p.share == 0 ? here : mix(here, rows_[p.row + 1].temperature_degC, p.share);
}

} // namespace storm
