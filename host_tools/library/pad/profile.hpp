// How a pad's rubber spreads a press and a pull: the profile for the fingertip's estimate of
// tangential force (firmware/common/pad_profile.h), from the pad's thickness.
//
// The base pressure under one bonded layer is known wave by wave (pad/layer.hpp): T(H) of a press, Q(H) of a pull, H =
// wave number times thickness. The profile has a sum of Gaussians for each, which are Gaussians on the base too:
//   T(H) = sum share_j exp(-(H sd_j)^2 / 2),    Q(H) / H = sum moment_j exp(-(H sd_j)^2 / 2)
// They are fitted by least squares over the plane, that is of the error squared times H dH. By
// Parseval's theorem that is the error of the pressure itself. With two terms for T and three for Q
// the pressure's root mean square error is 1.8 and 1.2 % of its own, at every thickness.
//
// The layer is infinite. A pad that ends differs near its edges, and the profile does not contain
// that. Silicone, nu = 0.49; the pad's stiffness does not matter.
#pragma once

#include "libfingertip/wire.hpp"

#include <optional>
#include <string>

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

// So little overhang that the tangential force stays doubtful even after the correction of edges_of (pad/edges.hpp):
// less than half a thickness (blocks of 12 mm in the report's part shear, no real pad).
bool edges_spoil_the_zero(const Shape &shape);

// The thickness of a pad's rubber, from the width of its response to a usual contact.
//
// The base pressure under one bonded layer is wider the thicker the layer is, in proportion for a contact that is a point
// (pad/profile.hpp). A contact adds its own spread. So the width that a calibration finds determines the thickness. It is uncertain by what
// is not known of the foot's spread, which counts more on thin rubber: 4 % on 12 mm, some 12 % on 6 mm.
//
// On pads of the twin it is right within 2 % from 9 to 15 mm, with a dip or without (test unit.pad_thickness).
struct Thickness {
  double mm, sd_mm;
  double shown_mm() const;               // as text_of shows it, so that a profile has the thickness that was shown
  bool agrees_with(double set_mm) const; // within two standard deviations
};

// sigma_mm: of the Gaussian nearest to the response, without its dip; its standard deviation.
Thickness thickness_of(double sigma_mm, double sigma_sd_mm);

// The thickness from the width that a calibration found, if any.
std::optional<Thickness> thickness_of(const calibration &calibration);

// On thinner rubber than the sensors are apart the corrected location is worse than the fit's, and
// the load off by 0.07 of the force and more (the report's part shear).
constexpr double THINNEST_mm = 9.0;
// Whether a tangential force is estimated well enough on rubber so thick.
bool profile_suits(const Thickness &thickness);

// The thickness whose profile a fingertip gets with its calibration. None: it has a profile, it
// estimates no tangential force, or the rubber does not suit.
std::optional<Thickness> thickness_for_profile(const wire_info &info, const calibration &calibration);

// "12.1 mm, sd 0.5"
std::string text_of(const Thickness &thickness);

// A sentence with both if the thickness that the user set is not the one found; empty if they agree.
std::string disagreement(const Thickness &found, double set_mm);

} // namespace fingertip::pad
