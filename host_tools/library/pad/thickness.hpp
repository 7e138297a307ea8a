// The thickness of a pad's rubber, from the width of its response to a usual contact.
//
// The base pressure under one bonded layer is wider the thicker the layer is, in proportion for a
// contact that is a point (pad/profile.hpp). A contact adds its own spread. So the width that a
// calibration finds determines the thickness. It is uncertain by what is not known of the foot's spread,
// which counts more on thin rubber: 4 % on 12 mm, some 12 % on 6 mm.
//
// On pads of the twin it is right within 2 % from 9 to 15 mm, with a dip or without (test
// unit.pad_thickness).
#pragma once

#include "libfingertip/wire.hpp"

#include <optional>
#include <string>

namespace fingertip::pad {

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
