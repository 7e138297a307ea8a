#include "library/pad/thickness.hpp"

#include "libfingertip/text.hpp"
#include "library/pad/profile.hpp"

#include <cmath>

namespace fingertip::pad {

namespace {

// Variance of the foot's pressure along an axis, mm^2: a^2 / 5 of a disc of radius a under Hertz's
// pressure. A sphere of 15 mm under 1 to 6 N makes 2.1 to 3.5 mm on the twin's silicone: 0.8 to 2.5
// mm^2, and more on softer rubber.
constexpr double SPREAD_mm2 = 2.0, SPREAD_SD_mm2 = 1.5;
// Sessions of the twin with relaxation, a dip, sensors off their places: their widths differ so.
constexpr double SESSION_SD = 0.02;
constexpr double AGREES_SDS = 2.0;
constexpr double LEAST_mm = 1.0, MOST_mm = 60.0; // among which it is sought

// The sums of Gaussians of a press are the same for every thickness but for their scale.
const pad_profile &any_layer() {
  static const pad_profile profile = profile_over_own_sensors({10.0});
  return profile;
}

// Width of the Gaussian nearest to the response by least squares over the plane, for a contact of
// this spread. Products of Gaussians have closed integrals.
double sigma_of(double thickness_mm, double spread_mm2) {
  const pad_profile &layer = any_layer();
  const double scale = thickness_mm / static_cast<double>(layer.thickness_mm);
  const auto explained = [&](double sigma_mm) {
    const double own = sigma_mm * sigma_mm;
    double with = 0.0;
    for (const auto &term : layer.normal) {
      const double sd_mm = scale * static_cast<double>(term.sd_mm);
      with += static_cast<double>(term.share) * own / (sd_mm * sd_mm + spread_mm2 + own);
    }
    return with * with / own;
  };
  double low = 0.1 * thickness_mm, high = 2.0 * thickness_mm + std::sqrt(spread_mm2);
  for (int step = 0; step < 60; step++) { // golden section
    constexpr double SHARE = 0.381966;
    const double a = low + SHARE * (high - low), b = high - SHARE * (high - low);
    (explained(a) > explained(b) ? high : low) = explained(a) > explained(b) ? b : a;
  }
  return 0.5 * (low + high);
}

double thickness_mm_of(double sigma_mm, double spread_mm2) {
  double low = LEAST_mm, high = MOST_mm;
  for (int step = 0; step < 40; step++) {
    const double middle = 0.5 * (low + high);
    (sigma_of(middle, spread_mm2) < sigma_mm ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

} // namespace

Thickness thickness_of(double sigma_mm, double sigma_sd_mm) {
  const double mm = thickness_mm_of(sigma_mm, SPREAD_mm2);
  const double by_spread = 0.5 * (thickness_mm_of(sigma_mm, SPREAD_mm2 - SPREAD_SD_mm2) -
                                  thickness_mm_of(sigma_mm, SPREAD_mm2 + SPREAD_SD_mm2));
  const double sd_mm = std::hypot(sigma_sd_mm, SESSION_SD * sigma_mm);
  const double by_width = thickness_mm_of(sigma_mm + sd_mm, SPREAD_mm2) - mm;
  return {mm, std::hypot(by_spread, by_width)};
}

std::optional<Thickness> thickness_of(const calibration &calibration) {
  if (calibration.sigma_um == 0) {
    return {};
  }
  return thickness_of(1e-3 * calibration.sigma_um, 1e-3 * calibration.sigma_sd_um);
}

double Thickness::shown_mm() const { return 0.1 * std::round(10.0 * mm); }

bool Thickness::agrees_with(double set_mm) const { return std::abs(set_mm - mm) <= AGREES_SDS * sd_mm; }

bool profile_suits(const Thickness &thickness) {
  return thickness.mm >= THINNEST_mm && thickness.mm <= static_cast<double>(PAD_THICKNESS_MAX_mm);
}

std::optional<Thickness> thickness_for_profile(const wire_info &info, const calibration &calibration) {
  const auto found = thickness_of(calibration);
  const bool wants = (info.capabilities & WIRE_CAPABILITY_TANGENTIAL) && !(info.stored & WIRE_STORED_PAD);
  return wants && found && profile_suits(*found) ? found : std::nullopt;
}

std::string text_of(const Thickness &thickness) {
  return fixed(thickness.mm, 1) + " mm, sd " + fixed(thickness.sd_mm, 1);
}

std::string disagreement(const Thickness &found, double set_mm) {
  if (found.agrees_with(set_mm)) {
    return {};
  }
  return "the profile is of " + fixed(set_mm, 1) + " mm of rubber, but the calibration's width is that of " +
         text_of(found) + ": with a wrong thickness the tangential force and the place are off, or there are none";
}

} // namespace fingertip::pad
