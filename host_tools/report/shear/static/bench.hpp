// Pads, objects and touches that the tables of shear_static have in common.
#pragma once

#include "shear/static/results.hpp"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace fingertip::shear {

struct Options {
  std::string cache = FINGERTIP_TABLES_DIR, only;
  std::uint64_t seed = 20221015, pads = 1500;
  bool few = false; // thicknesses: LAYER_mm alone
};

constexpr double LAYER_mm = 12.0, FRICTION = 0.5, SHARE = 0.3;
constexpr std::size_t TOUCHES = 10, UNITS_PER_PAD = 5; // 50 of each pad
// As truth_fit has them: round or nearly so, the lime with 45 by 55 mm the least.
inline const std::vector<std::string> SEVEN{"sphere6",   "sphere15",    "cylinder6", "cube6",
                                            "ping_pong", "rubber_duck", "lime"};

// How the load came: under a constant normal force, together with it, or until all slides.
enum class History { held, together, slides };

struct Load {
  const char *name;
  double share; // Q/F
  History history;
};
constexpr Load LOADS[] = {{"0", 0.0, History::held},     {"0.1", 0.1, History::held},
                          {"0.3", SHARE, History::held}, {"0.3, risen with the force", SHARE, History::together},
                          {"0.45", 0.45, History::held}, {"0.5, sliding", FRICTION, History::slides}};

using PadOf = std::function<KnownPad(std::size_t)>;

struct Case {
  std::vector<const Object *> objects;
  PadOf pad;
  double share = SHARE;
  History history = History::held;
  double force_min_N = 1.0, force_max_N = 10.0;
  std::uint16_t osr = 1024;
  std::size_t sensors = SENSORS; // in use, chosen for each touch
  double beyond_mm = 0.0;        // places up to so far outside the array, and only there
  const twin::BlockTable *block = nullptr;
  double fewer = 1.0; // pads, as a share
};

double noise_Pa(std::uint16_t osr);

// Half a pitch inside the outer sensors is where the paper presses; within half a pitch of one row
// of them, or of two.
const char *place_of(const twin::Touch &touch);

struct Bench {
  // Calibrates the pads. Throws std::runtime_error without any.
  explicit Bench(const Options &options);

  std::vector<const Object *> on(double layer_mm, const std::vector<std::string> &names);
  // The seven objects on calibrated pads.
  Case usual();
  // What calibrations left of the gains, alone, under rubber of this thickness.
  PadOf calibrated_on(double layer_mm);
  // Calibrated as they are, on LAYER_mm; the kinds take turns.
  PadOf calibrated_as(const std::vector<truth::PadOptions> &kinds);
  std::size_t units(const Case &c) const;
  twin::Touch draw(const Case &c, const fit_array &array, Random &random) const;
  // Cases of one table draw the same touches.
  Results run(const std::string &table, const Case &c, const pad_profile *told = nullptr) const;
  static void progress(const char *what);

  Options options;
  Objects objects;
  pad_profile profile;
  PadOf equal, calibrated, raw5, raw10;
};

} // namespace fingertip::shear
