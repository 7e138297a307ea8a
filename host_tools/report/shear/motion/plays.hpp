// Acts of the twin as the firmware feels them, frame by frame: an act's pressures on the base, the
// gains that a calibration leaves, noise, then the firmware's own fit and estimate of tangential
// load. What condition does is left out: readings are relative to the true zero.
#pragma once

#include "simulation/twin/scenarios.hpp"
#include "simulation/twin/traction_table.hpp"
#include "truth/fit/touches.hpp"

extern "C" {
#include "contact/tangential.h"
}

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace fingertip::shear {

// What presses, on what.
class Object {
public:
  Object(const std::string &indenter, double layer_mm, const std::filesystem::path &cache);

  std::array<double, truth::SENSORS> base_Pa(const twin::Touch &touch) const;
  const twin::ContactTable &table() const { return table_; }

  const std::string indenter;
  const double layer_mm;

private:
  twin::ContactTable table_;
  twin::TractionTable traction_;
};

// Gains of a pad and the firmware's calibration of them:
//   equal   all 1, as calibrated
//   cal     10 % spread, after a calibration by placements
//   raw5    5 % spread, never calibrated; raw10
class Pads {
public:
  static const std::vector<std::string> &kinds();
  // Calibrations are gone through once, here.
  Pads(std::size_t calibrations, std::uint64_t seed, const std::filesystem::path &cache);
  truth::Pad pad(const std::string &kind, std::uint64_t n) const;

private:
  std::uint64_t seed_;
  std::vector<truth::Pad> calibrated_;
};

struct Sensing {
  std::uint16_t osr = 1024;
  double rate_Hz = 410.0;
};

// One frame.
struct Felt {
  std::uint64_t t_us; // middle of the conversion, from the act's beginning
  double known_s;     // when the frame can have been interpreted
  twin::Touch truth;
  bool slips;     // grossly
  bool contact;   // the gate is open
  fit_result fit; // all zeros without contact
  fit_tangential tangential;
};

// Plays an act to one pad.
class Player {
public:
  Player(const Object &object, const truth::Pad &pad, const Sensing &sensing, std::uint64_t seed);
  ~Player();
  void play(const twin::Act &act, std::uint64_t number, const std::function<void(const Felt &)> &frame);

private:
  const Object &object_;
  truth::Pad pad_;
  Sensing sensing_;
  std::uint64_t seed_;
  double noise_Pa_, conversion_s_;
  fit_array array_;
  fit_settings settings_;
  std::unique_ptr<tangential_job> job_;
};

} // namespace fingertip::shear
