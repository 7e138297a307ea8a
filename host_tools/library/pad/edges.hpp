// The effect of the ends of a pad's rubber on the fingertip's estimate of tangential force, and its
// correction: coefficients of pad_edges (firmware/common/pad_profile.h).
//
// The estimate assumes a layer without end. edges_of passes contacts on the pad's own block (pad/block.hpp) through the firmware's
// estimate, at places all over the array and, from 9 mm of overhang on, 1.5 mm beyond, with no load and with one along each axis. It fits
// the polynomials to the result. They subtract the mean response of a usual contact, spread_mm2 wide. On 12 mm of rubber with 6 to 13 mm of
// overhang the zero's error is then 0.01 to 0.03 of the normal force, and 0.10 to 0.20 without (part shear of the report). Simulated: no
// real pad has been measured. An edge that is rounded, glued or pressed against a frame is another one.
#pragma once

#include "libfingertip/wire.hpp"

#include <filesystem>
#include <functional>

namespace fingertip::pad {

// Overhangs for which there are such coefficients.
constexpr double EDGE_OVERHANG_MIN_mm = 3.0, EDGE_OVERHANG_MAX_mm = 20.0;

// The coefficients of the pad of this profile, whose own edges count as none. The sensors of info lie evenly about the origin. A
// calibration in it was made on this pad: it has taken part of what the ends do for a dip and for its force scale, so the coefficients are
// of what is left, and of another calibration they are others. Solves the block, 2 to 30 s, unless the cache holds it; on_progress gets the
// share done, 0..1. Throws Error where the overhang is out of range, the sensors are no array that the estimate takes, or the edges leave
// it on less than half of the array; and as twin::BlockTable does.
pad_edges edges_of(const pad_profile &profile, const wire_info &info, const std::filesystem::path &cache_directory,
                   const std::function<void(double)> &on_progress = {});

// Variance of the pressure of a calibration's foot along an axis: a^2 / 5 of a disc of radius a under Hertz's pressure. A sphere
// of 15 mm under 1 to 6 N makes 2.1 to 3.5 mm on the twin's silicone: 0.8 to 2.5 mm^2, and more on softer rubber.
constexpr double FOOT_SPREAD_mm2 = 2.0;

// The coefficients of a pad without end: of what the profile's sums of Gaussians miss of a layer under such a foot. Without them the
// estimate finds a pull of 0.04 of the force on 12 mm. All zeros where it takes no such array, or finds half of the contacts at most.
pad_edges zero_of(const pad_profile &profile, const wire_info &info);

} // namespace fingertip::pad
