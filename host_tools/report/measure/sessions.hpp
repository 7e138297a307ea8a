// Simulated calibrations: pads of the twin on which a person sets down a weight, as it should be done and as it should not.
#pragma once

#include "libfingertip/random.hpp"
#include "library/pad/block_table.hpp"
#include "simulation/twin/contact_table.hpp"
#include "simulation/twin/effects.hpp"
#include "tool/calibration/judge.hpp"

#include <filesystem>
#include <optional>
#include <vector>

namespace fingertip::measure {

// The firmware's.
calibrating::Array session_array();

struct PadOptions {
  double gain_percent = 10.0;  // spread of the gains
  double memory_percent = 0.0; // each sensor's own part of a hold; 1 is usual (twin/effects.hpp)
  double misplaced_mm = 0.0;   // sd of a sensor's place, each way
  double dip_percent = 0.0, widths_percent = 0.0;
  const twin::BlockTable *block = nullptr; // of rubber that ends; of sensors that are in their places
};

// Fifteen sensors under a layer, over time. What touches it is a table of the twin.
class SessionPad {
public:
  SessionPad(const PadOptions &options, double layer_mm, std::uint64_t seed);

  // A weight is set down by hand and lifted after two seconds. The result has the means of the readings from 0.5 to 1 s after it was down.
  calibrating::Placement place(const twin::ContactTable &foot, double force_N, double x_mm, double y_mm, double angle_rad);
  // A tap: the readings of one frame 0.15 s after it was down.
  std::vector<double> tap(const twin::ContactTable &object, double force_N, double x_mm, double y_mm);

  // What a reading from 0.5 to 1 s after a placement is multiplied by, relative to the sensors' mean.
  std::vector<double> settled_gains() const;

  const twin::Pad &rubber() const { return pad_; }

private:
  void report(double after_s, double share);
  std::vector<double> base_Pa_, reported_Pa_; // [sensor]
  void aim(const twin::ContactTable &object, double force_N, double x_mm, double y_mm, double angle_rad);

  std::vector<double> x_mm_, y_mm_;
  PadOptions options_;
  double layer_mm_;
  std::uint64_t seed_;
  twin::Pad pad_;
  Random noise_;
  double t_s_ = 0.0;
};

enum class SessionKind { good, elongated, offsets, one_end, cluster, drift, too_few, weights };
const char *name_of(SessionKind kind);

constexpr double WEIGHT_N = 3.0;

// Contact tables of one layer: the foot, a sphere of 15 mm, and a lying cylinder of 6 by 12 mm.
struct Feet {
  Feet(double layer_mm, const std::filesystem::path &cache);
  double layer_mm;
  twin::ContactTable round, lying;
};

// A person who calibrates. Locations are anywhere on the array. In a good session, where the tool asks for a location,
// they are within 3 mm (sd) of it.
//   elongated  lying cylinder, half of the sessions always at one angle
//   offsets    zeros off by 500 Pa: up in every other session, else up or down by the sensor
//   one_end    all in the upper third of the array
//   cluster    all within 7 mm of one location
//   drift      zeros move by 100 Pa/s, up or down by the sensor
//   too_few    six placements
//   weights    in turn 3 and 4 N, or anything from 1.5 to 4.5 N
class Session {
public:
  Session(const Feet &feet, SessionKind kind, std::uint64_t seed, std::size_t planned);
  // The next placement, of as many as the person is willing to make.
  std::optional<calibrating::Placement> next(SessionPad &pad, std::optional<calibrating::Wanted> wanted = {});

private:
  const Feet &feet_;
  SessionKind kind_;
  Random random_;
  std::size_t planned_, made_ = 0;
  bool variant_;
  double middle_x_mm_, middle_y_mm_, angle_rad_;
  std::vector<double> zero_Pa_, drift_Pa_s_;
};

} // namespace fingertip::measure
