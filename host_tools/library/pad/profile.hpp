// How a pad's rubber spreads a press and a pull: the profile for the fingertip's estimate of
// tangential force (firmware/common/pad_profile.h), from the pad's thickness.
//
// The base pressure under one bonded layer is known wave by wave (pad/layer.hpp): T(H) of a press,
// Q(H) of a pull, H = wave number times thickness. The profile has a sum of Gaussians for each,
// which are Gaussians on the base too:
//   T(H) = sum share_j exp(-(H sd_j)^2 / 2),    Q(H) / H = sum moment_j exp(-(H sd_j)^2 / 2)
// They are fitted by least squares over the plane, that is of the error squared times H dH. By
// Parseval's theorem that is the error of the pressure itself. With two terms for T and three for Q
// the pressure's root mean square error is 1.8 and 1.2 % of its own, at every thickness.
//
// The layer is infinite. A pad that ends differs near its edges, and the profile does not contain
// that. Silicone, nu = 0.49; the pad's stiffness does not matter.
#pragma once

#include "libfingertip/wire.hpp"

namespace fingertip::pad {

struct Shape {
  double thickness_mm;     // PAD_THICKNESS_MIN_mm to PAD_THICKNESS_MAX_mm
  double overhang_mm = 0;  // of the rubber beyond the outer sensors; 0: not set
  bool from_touch = false; // the pad's edges spoil the zero
};

// The profile of a pad over the sensors of info. Throws Error where no profile has such values, or
// where the sensors are no array on which a contact can be fitted.
pad_profile profile_of(const Shape &shape, const wire_info &info);

// The profile of a pad over the sensors of this build.
pad_profile profile_over_own_sensors(const Shape &shape);

// The sensors of this build, as profile_of takes them.
wire_info own_sensors();

// So little overhang that the tangential force stays doubtful even after the correction of edges_of
// (pad/edges.hpp): less than half a thickness (blocks of 12 mm in the report's part shear, no real
// pad).
bool edges_spoil_the_zero(const Shape &shape);

} // namespace fingertip::pad
