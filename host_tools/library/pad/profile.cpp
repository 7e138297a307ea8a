#include "library/pad/profile.hpp"

#include "libfingertip/error.hpp"
#include "libfingertip/text.hpp"
#include "library/pad/edges.hpp"

extern "C" {
#include "config/geometry.h"
#include "fit/fit.h"
}

#include <algorithm>
#include <array>
#include <cmath>

namespace fingertip::pad {

namespace {

// The sums of profile.hpp for silicone, lengths in thicknesses: the optimum of Levenberg-Marquardt over 4000 waves up
// to H = 20, where nothing is left of T. The test unit.pad_profile computes T and Q, and that each step away is worse.
struct Term {
  double strength, sd;
};
constexpr Term NORMAL[PAD_NORMAL_TERMS] = {{0.095232207857486567, 0.29617093376692155}, {0.82159742314719264, 0.47811810687346074}};
constexpr Term TANGENTIAL[PAD_TANGENTIAL_TERMS] = {
    {0.093594210994422417, 0.40447100259126512}, {0.33589670928222154, 0.66593960858520174}, {0.46353010342238155, 1.6991808512232462}};

// Pressure of 1 N, pascals, so far from the contact's centre.
double pressure_Pa(const pad_profile &profile, double r2_mm2) {
  double sum = 0;
  for (const auto &term : profile.normal) {
    const double sd_mm = static_cast<double>(term.sd_mm);
    const double v = sd_mm * sd_mm + static_cast<double>(profile.spread_mm2);
    sum += static_cast<double>(term.share) / (2 * M_PI * v) * std::exp(-r2_mm2 / (2 * v));
  }
  return 1e6 * sum;
}

// 2 pi p0 sigma^2 as the fingertip fits it, over the force: the mean over places within a pitch
// around the middle of the array, where a calibration's weight is placed.
double force_ratio(const pad_profile &profile, const wire_info &info) {
  constexpr int PLACES = 9; // each way
  constexpr double FORCE_N = 5;
  const float pitch_mm = info.pitch_mm > 0 ? info.pitch_mm : profile.thickness_mm;
  fit_array array;
  if (fit_array_init(&array, info.sensor_count, info.x_mm, info.y_mm, pitch_mm) != FT_OK) {
    throw Error(ErrorCode::bad_value, "the fingertip's sensors are no array to fit a contact on");
  }
  double x_mm = 0, y_mm = 0;
  for (int k = 0; k < info.sensor_count; k++) {
    x_mm += static_cast<double>(info.x_mm[k]) / info.sensor_count;
    y_mm += static_cast<double>(info.y_mm[k]) / info.sensor_count;
  }
  fit_settings settings{};
  settings.iterations = FIT_MAX_ITERATIONS;
  settings.noise_Pa_q10 = 1024;
  double ratio = 0;
  for (int place = 0; place < PLACES * PLACES; place++) {
    const double pitch = static_cast<double>(pitch_mm) / PLACES;
    const double at_x_mm = x_mm + pitch * (place % PLACES - (PLACES - 1) / 2);
    const double at_y_mm = y_mm + pitch * (place / PLACES - (PLACES - 1) / 2);
    std::array<std::int32_t, FT_MAX_SENSORS> pressures_Pa_q10{};
    for (std::size_t k = 0; k < info.sensor_count; k++) {
      const double dx = static_cast<double>(info.x_mm[k]) - at_x_mm;
      const double dy = static_cast<double>(info.y_mm[k]) - at_y_mm;
      pressures_Pa_q10[k] = static_cast<std::int32_t>(std::lround(1024 * FORCE_N * pressure_Pa(profile, dx * dx + dy * dy)));
    }
    fit_result fit;
    fit_gaussian(&array, pressures_Pa_q10.data(), first_sensors(info.sensor_count), &settings, &fit);
    if (!(fit.flags & CONTACT_FLAG_FIT_VALID)) {
      throw Error(ErrorCode::bad_value, "the fingertip has too few sensors to fit a contact");
    }
    ratio += static_cast<double>(fit.force_N) / FORCE_N / (PLACES * PLACES);
  }
  return ratio;
}

void check(const char *what, double value, double least, double greatest) {
  if (!(value >= least && value <= greatest)) {
    throw Error(ErrorCode::bad_value, std::string(what) + " " + shortest(static_cast<float>(value)) + " is out of range; give " +
                                          shortest(static_cast<float>(least)) + " to " + shortest(static_cast<float>(greatest)) + " mm");
  }
}

constexpr double SPREAD_SD_mm2 = 1.5; // of FOOT_SPREAD_mm2
// Sessions of the twin with memories, a dip, sensors off their places: their widths differ so (unit.pad_thickness).
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

pad_profile profile_of(const Shape &shape, const wire_info &info) {
  check("thickness", shape.thickness_mm, PAD_THICKNESS_MIN_mm, PAD_THICKNESS_MAX_mm);
  check("overhang", shape.overhang_mm, 0, PAD_OVERHANG_MAX_mm);
  const double h_mm = shape.thickness_mm;
  pad_profile profile{};
  profile.thickness_mm = static_cast<float>(h_mm);
  profile.overhang_mm = static_cast<float>(shape.overhang_mm);
  for (int j = 0; j < PAD_NORMAL_TERMS; j++) {
    profile.normal[j] = {static_cast<float>(NORMAL[j].strength), static_cast<float>(h_mm * NORMAL[j].sd)};
  }
  for (int j = 0; j < PAD_TANGENTIAL_TERMS; j++) {
    profile.tangential[j] = {static_cast<float>(h_mm * TANGENTIAL[j].strength), static_cast<float>(h_mm * TANGENTIAL[j].sd)};
  }
  // A contact of radius a under Hertz's pressure, sqrt(1 - r^2/a^2), has a variance of a^2/5 along an axis: 4 mm^2 at
  // 4.5 mm, and 10 mm^2, an sd more, at the 7 mm that a sphere of 15 mm makes under 10 N on 12 mm of silicone.
  profile.spread_mm2 = 4;
  profile.spread_sd_mm2 = 6;
  profile.force_ratio = static_cast<float>(force_ratio(profile, info));
  // The scale of an exactly known layer; no weight has been dragged yet. Real rubber differs from nu = 0.49
  // and from the set thickness, each by some per cent.
  profile.tangential_scale = 1;
  profile.tangential_scale_sd = 0.1F;
  profile.from_touch = shape.from_touch ? 1 : 0;
  profile.edges = zero_of(profile, info);
  return profile;
}

wire_info own_sensors() {
  wire_info info{};
  info.sensor_count = geometry.sensor_count;
  info.pitch_mm = geometry.pitch_mm;
  std::copy(std::begin(geometry.x_mm), std::end(geometry.x_mm), info.x_mm);
  std::copy(std::begin(geometry.y_mm), std::end(geometry.y_mm), info.y_mm);
  return info;
}

pad_profile profile_over_own_sensors(const Shape &shape) { return profile_of(shape, own_sensors()); }

bool edges_spoil_the_zero(const Shape &shape) { return shape.overhang_mm > 0 && shape.overhang_mm < 0.5 * shape.thickness_mm; }

Thickness thickness_of(double sigma_mm, double sigma_sd_mm) {
  const double mm = thickness_mm_of(sigma_mm, FOOT_SPREAD_mm2);
  const double by_spread =
      0.5 * (thickness_mm_of(sigma_mm, FOOT_SPREAD_mm2 - SPREAD_SD_mm2) - thickness_mm_of(sigma_mm, FOOT_SPREAD_mm2 + SPREAD_SD_mm2));
  const double sd_mm = std::hypot(sigma_sd_mm, SESSION_SD * sigma_mm);
  const double by_width = thickness_mm_of(sigma_mm + sd_mm, FOOT_SPREAD_mm2) - mm;
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

std::string text_of(const Thickness &thickness) { return fixed(thickness.mm, 1) + " mm, sd " + fixed(thickness.sd_mm, 1); }

std::string disagreement(const Thickness &found, double set_mm) {
  if (found.agrees_with(set_mm)) {
    return {};
  }
  return "the profile is of " + fixed(set_mm, 1) + " mm of rubber, but the calibration's width is that of " + text_of(found) +
         ": with a wrong thickness the tangential force and the place are off, or there are none";
}

} // namespace fingertip::pad
