#include "shear/static/pulled.hpp"

#include "library/pad/profile.hpp"
#include "simulation/twin/scenarios.hpp"
#include "truth/fit/statistics.hpp"

extern "C" {
#include "common/contact_flags.h"
#include "ms58xx/ms58xx.h"
}

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace fingertip::shear {
namespace {

constexpr double RANGE_Pa = MS58XX_MAX_PRESSURE_Pa - twin::AMBIENT_Pa;

} // namespace

const Object &Objects::on(double layer_mm, const std::string &name) {
  std::unique_ptr<Object> &object = objects_[{layer_mm, name}];
  if (!object) {
    const twin::Layer layer = twin::silicone(layer_mm);
    twin::ContactTable pressure = twin::ContactTable::load_or_build(truth::indenter_of(name), layer, cache_);
    twin::TractionTable traction(pressure, layer);
    object = std::make_unique<Object>(Object{name, std::move(pressure), std::move(traction)});
  }
  return *object;
}

pad_profile profile_of(double thickness_mm) {
  return pad::profile_over_own_sensors({thickness_mm});
}

Cast cast_of(const truth::Calibrated &session) {
  Cast cast{session.dip_share, {}};
  std::copy(session.seats.begin(), session.seats.end(), cast.seats.begin());
  return cast;
}

Readings base_Pa(const fit_array &array, const Object &object, const twin::Touch &touch, const twin::BlockTable *block,
                 const Cast &cast) {
  Readings base{};
  const double c = std::cos(touch.angle_rad), s = std::sin(touch.angle_rad);
  const double pitch_mm = static_cast<double>(array.pitch_mm);
  const bool pulls = touch.pull_x_N != 0.0 || touch.pull_y_N != 0.0;
  const twin::TractionTable::Load load{touch.force_N, touch.stuck_N, c * touch.pull_x_N + s * touch.pull_y_N,
                                       c * touch.pull_y_N - s * touch.pull_x_N};
  const twin::BlockTable::Load added{touch.force_N, touch.pull_x_N, touch.pull_y_N,
                                     object.pressure.contact_radius_mm(touch.force_N)};
  for (std::size_t k = 0; k < SENSORS; k++) {
    const twin::Pad::Seat &seat = cast.seats[k];
    const double x_mm = pitch_mm * static_cast<double>(array.x[k]) + seat.dx_mm;
    const double y_mm = pitch_mm * static_cast<double>(array.y[k]) + seat.dy_mm;
    const double dx = (x_mm - touch.x_mm) / seat.width, dy = (y_mm - touch.y_mm) / seat.width;
    const double along = c * dx + s * dy, across = c * dy - s * dx;
    base[k] = object.pressure.base_pressure_Pa(touch.force_N, along, across, cast.dip_share);
    if (pulls) {
      base[k] += object.traction.base_pressure_Pa(load, along, across);
    }
    if (block) {
      base[k] += block->added_Pa(k, added, touch.x_mm, touch.y_mm);
    }
  }
  return base;
}

Fingertip::Fingertip(const pad_profile &profile) : array_(truth::firmware_array()), profile_(profile) {
  if (fit_pad_init(&fit_pad_, &array_, &profile) != FT_OK) {
    throw std::runtime_error("the firmware refuses the pad's profile");
  }
}

bool Fingertip::feel(const Readings &base_Pa, const KnownPad &known, double noise_Pa, std::uint32_t usable,
                     Random &random, Said &said) {
  const truth::Pad &pad = known.pad;
  fit_settings settings = truth::settings_for(pad, noise_Pa);
  settings.cut_noises = 0; // as where a profile acts
  const std::vector<fit_own> own = calibrating::own_of(truth::session_array(), known.shape);
  settings.own = own.empty() ? nullptr : own.data();
  settings.dip_share = static_cast<float>(known.shape.dip_share);
  settings.dip_sd_mm = static_cast<float>(known.shape.dip_sd_mm);
  fit_result fit;
  fit_tangential found{};
  fit_tangential_state state{};
  for (int frame = 0; frame < FIT_TANGENTIAL_FRAMES; frame++) {
    std::array<std::int32_t, SENSORS> readings{};
    std::uint32_t saturated = 0;
    for (std::size_t k = 0; k < SENSORS; k++) {
      const double reading_Pa = pad.gain[k] * base_Pa[k] + noise_Pa * random.normal();
      readings[k] = static_cast<std::int32_t>(std::lround(1024.0 * reading_Pa));
      saturated |= reading_Pa > RANGE_Pa ? 1u << k : 0u;
    }
    fit_gaussian_grid(&array_, readings.data(), usable & ~saturated, &settings, &fit);
    if (!(fit.flags & CONTACT_FLAG_FIT_VALID)) {
      return false;
    }
    found = {};
    if (tangential_is_worthwhile(&fit, saturated)) {
      fit_tangential_estimate(&array_, &fit_pad_, readings.data(), &settings, &fit, &state, &found);
    } else {
      state = {};
    }
  }
  contact_settings scales{};
  scales.force_scale = static_cast<float>(known.force_scale.value_or(1.0));
  tangential_settings published{};
  tangential_use(&published, &profile_, &scales, known.force_scale.has_value());
  published.tangential_scale_sd = 0.0F; // the scales are exact here
  contact_input input{};
  input.contact = true;
  input.fit = &fit;
  input.tangential = &found;
  tangential_history history{};
  contact_result result{};
  tangential_load load;
  tangential_update(&history, &published, &input, &result, &load);
  said = {};
  said.elongated = (fit.flags & CONTACT_FLAG_ELONGATED) != 0;
  said.gaussian_x_mm = static_cast<double>(fit.x_mm);
  said.gaussian_y_mm = static_cast<double>(fit.y_mm);
  said.gaussian_force_N = known.force_scale.value_or(1.0) * static_cast<double>(fit.force_N);
  said.load = load;
  said.valid = (result.flags & CONTACT_FLAG_TANGENTIAL_VALID) != 0;
  if (said.valid) {
    said.force_N = static_cast<double>(load.force_N);
    said.x_mm = static_cast<double>(load.x_mm);
    said.y_mm = static_cast<double>(load.y_mm);
    said.location_sd_mm = static_cast<double>(load.location_sd_mm);
    said.qx = static_cast<double>(load.qx_N) / said.force_N;
    said.qy = static_cast<double>(load.qy_N) / said.force_N;
    said.q_sd = static_cast<double>(load.q_sd_N) / said.force_N;
  } else {
    said.x_mm = said.gaussian_x_mm;
    said.y_mm = said.gaussian_y_mm;
    said.location_sd_mm = static_cast<double>(fit.location_sd_mm);
    said.force_N = said.gaussian_force_N;
  }
  return true;
}

KnownPad Fingertip::weighed(KnownPad pad, const Object &sphere15) {
  constexpr double STEP_mm = 4.5;
  Random none(0, 0, 0);
  std::vector<double> scales;
  for (int i = 0; i < 9; i++) {
    twin::Touch touch;
    touch.x_mm = STEP_mm * (i % 3 - 1);
    touch.y_mm = STEP_mm * (i / 3 - 1);
    touch.force_N = truth::WEIGHT_N;
    Said said;
    // A noise of nothing is none that the fit takes.
    constexpr double QUIET_Pa = 0.1;
    if (feel(base_Pa(array_, sphere15, touch, nullptr, pad.cast), pad, QUIET_Pa, ALL_SENSORS, none, said)) {
      scales.push_back(touch.force_N / said.gaussian_force_N);
    }
  }
  pad.force_scale = truth::quantile(scales, 0.5);
  return pad;
}

} // namespace fingertip::shear
