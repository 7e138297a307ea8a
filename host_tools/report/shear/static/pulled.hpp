// Touches that pull along the rubber, as the sensors of a pad report them, and what the firmware
// says of them.
//
// Readings are relative to the true zero: what condition does to them is left out. A reading above
// the sensor's range is left out of the fit, as scan has it.
#pragma once

#include "library/pad/block_table.hpp"
#include "simulation/twin/traction_table.hpp"
#include "simulation/twin/trajectory.hpp"
#include "truth/fit/touches.hpp"

extern "C" {
#include "common/pad_profile.h"
#include "contact/tangential.h"
}

#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

namespace fingertip::shear {

using truth::Readings;
using truth::SENSORS;

// What presses, on a layer.
struct Object {
  std::string name;
  twin::ContactTable pressure;
  twin::TractionTable traction;
};

// Solved or read once each.
class Objects {
public:
  explicit Objects(std::filesystem::path cache) : cache_(std::move(cache)) {}
  // truth::indenter_of knows the names.
  const Object &on(double layer_mm, const std::string &name);

private:
  std::filesystem::path cache_;
  std::map<std::pair<double, std::string>, std::unique_ptr<Object>> objects_;
};

constexpr std::uint32_t ALL_SENSORS = (1u << SENSORS) - 1u;

// Of a pad of this thickness without end.
pad_profile profile_of(double thickness_mm);

// How cast rubber and its sensors differ from a bonded layer over places on a grid: the twin's
// effects dip, places and widths. A pull has no dip.
struct Cast {
  double dip_share = 0.0;
  std::array<twin::Pad::Seat, SENSORS> seats{};
};

Cast cast_of(const truth::Calibrated &session);

// On the base, Pa; block: the pad that ends, nullptr if it does not.
Readings base_Pa(const fit_array &array, const Object &object, const twin::Touch &touch,
                 const twin::BlockTable *block = nullptr, const Cast &cast = {});

// What the firmware publishes, in the scales of its calibration: the corrected location and force
// where the estimate is valid, and the Gaussian's.
struct Said {
  bool valid;
  bool elongated; // as the Gaussian fit flags it
  double x_mm, y_mm, location_sd_mm, force_N;
  double qx, qy, q_sd; // per normal force
  double gaussian_x_mm, gaussian_y_mm, gaussian_force_N;
  tangential_load load; // as the packet has it, if valid
};

struct KnownPad {
  truth::Pad pad;
  std::optional<double> force_scale; // force over 2 pi p0 sigma^2; of a calibrated pad only
  calibrating::Shape shape{};        // that the calibration found
  Cast cast{};
};

// The fit and the estimate as the firmware runs them, with one pad's profile. Copies share nothing.
class Fingertip {
public:
  explicit Fingertip(const pad_profile &profile);

  const fit_array &array() const { return array_; }
  double pitch_mm() const { return static_cast<double>(array_.pitch_mm); }
  // base: pressures; gains act, noise is added. False: no fit.
  bool feel(const Readings &base_Pa, const KnownPad &known, double noise_Pa, std::uint32_t usable, Random &random,
            Said &said);
  // With the scale that a known weight tells: a sphere of 15 mm under 3 N at nine places around the
  // middle, the median of them.
  KnownPad weighed(KnownPad pad, const Object &sphere15);

private:
  fit_array array_;
  pad_profile profile_;
  fit_pad fit_pad_;
};

} // namespace fingertip::shear
