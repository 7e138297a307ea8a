// What the ends of a pad's rubber make of the fingertip's estimate of tangential load, and how to
// take it back: coefficients of pad_edges (firmware/common/pad_profile.h).
//
// The estimate knows a layer without end. Contacts on the pad's own block (pad/block.hpp) go
// through the firmware's estimate at places all over the array, with no load and with one along
// each axis; the polynomials are fitted to what it says. They take back the mean response of a
// usual contact, spread_mm2 wide: what is left of the zero on 12 mm of rubber is 0.02 to 0.03 of
// the normal force with 6 to 13 mm of overhang, from 0.10 to 0.21 without (part shear of the
// report). Simulated: no real pad has been measured, and an edge that is rounded, glued or pressed
// against a frame is another one.
#pragma once

#include "libfingertip/wire.hpp"

#include <filesystem>
#include <functional>

namespace fingertip::pad {

// Overhangs for which there are such coefficients.
constexpr double EDGE_OVERHANG_MIN_mm = 3.0, EDGE_OVERHANG_MAX_mm = 20.0;

// Of the pad of this profile, whose own edges count as none, over the sensors of info, which lie
// evenly about the origin. Solves the block, 2 to 30 s, unless the cache holds it; on_progress gets
// the share done, 0..1. Throws Error where the overhang is out of range, the sensors are no array
// that the estimate takes, or the edges leave it on less than half of the array; and as
// twin::BlockTable does.
pad_edges edges_of(const pad_profile &profile, const wire_info &info,
                   const std::filesystem::path &cache_directory,
                   const std::function<void(double)> &on_progress = {});

} // namespace fingertip::pad
