// What the fit is judged on: touches whose true place and force are known, as the sensors of a pad
// report them.
//
// A contact is an object of the twin on a layer of rubber, or an elliptic Gaussian; a pad is a draw
// of its sensors' gains with the firmware's calibration of them.
#pragma once

#include "libfingertip/random.hpp"
#include "report/measure/sessions.hpp"
#include "simulation/twin/contact_table.hpp"

extern "C" {
#include "fit/fit.h"
}

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace fingertip::truth {

constexpr std::size_t SENSORS = 15;
using Readings = std::array<double, SENSORS>;

// Pressure on the base by dx, dy from the contact's middle, along its own axes, under this force.
struct Contact {
  std::string name;
  std::function<double(double force_N, double dx_mm, double dy_mm)> base_Pa;
};

// The twin's object by its name, or one of these: "cylinder6x12", a cylinder of 6 mm lying on a
// side of 12 mm; "edge20", "edge14" and "edge10", straight edges: a cylinder of 2 mm lying on a side of
// so many millimetres; "cube15".
const twin::Indenter &indenter_of(const std::string &name);
// Its table is solved if the cache does not hold it.
Contact contact_of(const std::string &name, double layer_mm, const std::filesystem::path &cache_directory);
// Its width along the first axis is this times the other.
Contact gaussian(double shorter_mm, double ratio);

// Gain of each sensor and its standard deviation as the firmware has it. Gains multiply readings:
// of a calibrated pad it is what is left after the calibration.
struct Pad {
  Readings gain, gain_sd;
};

Pad perfect_pad();
// Gains as cast, normal about 1 as the twin draws them, and no calibration: the firmware has
// this standard deviation.
Pad raw_pad(double spread, double told, Random &random);
// What a calibration left of the gains, which is all that acts on a touch here: it does not relax,
// and sensors are where they should be. The same on any layer, though on 6 mm none would be
// accepted.
Pad calibrated_pad(const Calibrated &session);

// One for every ten pads that are judged, a hundred at most: a calibration each, which so many
// pads have in turn. The kinds of pads take turns.
std::vector<Calibrated> calibrations_of(const std::vector<PadOptions> &kinds, std::size_t judged, std::uint64_t seed,
                                        const std::filesystem::path &cache_directory);

// As the twin's own, and as many whose sensors relax by 9 to 26 % and sit 0.1 mm (sd) off.
inline const std::vector<PadOptions> USUAL_PADS{{10.0}, {10.0, 17.5, 0.1}};

using CalibratedPads = std::vector<Pad>;
// What calibrations of USUAL_PADS left of the gains.
CalibratedPads calibrated_pads(std::size_t judged, std::uint64_t seed, const std::filesystem::path &cache_directory);

// Of random numbers, for a name.
std::uint64_t stream_of(const std::string &name);
// A bitmap of so many sensors, drawn.
std::uint32_t choose_sensors(std::size_t sensors, Random &random);

struct Touch {
  double x_mm, y_mm, force_N;
  double angle_rad; // of the contact's first axis
};

// Anywhere on the array, 1..15 N, at any angle.
Touch draw_touch(const fit_array &array, Random &random);

// The noise of one of the six oversampling ratios, Pa rms.
double draw_noise_Pa(Random &random);

// What condition hands to the fit: gains act, noise is added; 1/1024 Pa.
std::array<std::int32_t, SENSORS> readings_of(const fit_array &array, const Contact &contact, const Touch &touch,
                                              const Pad &pad, double noise_Pa, Random &random);

// The firmware's array. Throws std::runtime_error if its geometry is refused.
fit_array firmware_array();
// The settings that it fits with: its defaults, with this pad and noise.
fit_settings settings_for(const Pad &pad, double noise_Pa);

} // namespace fingertip::truth
