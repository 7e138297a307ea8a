#include "simulation/cell/simulated_fingertip.hpp"

#include "library/pad/profile.hpp"

extern "C" {
#include "common/contact_flags.h"
#include "config/defaults.h"
#include "config/geometry.h"
#include "contact/motion.h"
#include "contact/tangential.h"
#include "fit/fit_tangential.h"
#include "ms58xx/ms58xx.h"
}

#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <stdexcept>

namespace fingertip::cell {
namespace {

// A sensor is pressed from here on: the gate of a quiet pad without any drift.
constexpr double GATE_NOISES = 8.0;
constexpr float FORCE_SCALE_SD = 0.05F; // of a calibrated pad

// The model of one layer, found once by least squares.
struct Model {
  fit_array array;
  pad_profile profile;
  fit_pad pad;
};

const Model &model_of(double layer_mm) {
  static std::mutex making;
  static std::map<double, Model> made;
  const std::lock_guard<std::mutex> lock(making);
  const auto found = made.find(layer_mm);
  if (found != made.end()) {
    return found->second;
  }
  Model model;
  model.profile = pad::profile_over_own_sensors({layer_mm, 0.0, false});
  if (geometry.sensor_count != SENSORS ||
      fit_array_init(&model.array, geometry.sensor_count, geometry.x_mm, geometry.y_mm, geometry.pitch_mm) != FT_OK ||
      fit_pad_init(&model.pad, &model.array, &model.profile) != FT_OK) {
    throw std::runtime_error("the firmware refuses the profile of this layer");
  }
  return made.emplace(layer_mm, model).first->second;
}

} // namespace

double speed_of(const ::motion &motion) { return static_cast<double>(std::hypot(motion.vx_mm_s, motion.vy_mm_s)); }

struct SimulatedFingertip::Firmware {
  fit_array array;
  fit_pad pad;
  fit_settings fit{};
  contact_settings contact{};
  tangential_settings tangential{};
  fit_tangential_state state{};
  slip_history slip{};
  tangential_history load{};
  motion_history motion{};

  Firmware(double layer_mm, const Rubber &rubber, double noise_Pa);
  GripTouch frame(std::uint64_t t_us, bool pressed, const std::int32_t *readings);
};

SimulatedFingertip::Firmware::Firmware(double layer_mm, const Rubber &rubber, double noise_Pa)
    : array(model_of(layer_mm).array), pad(model_of(layer_mm).pad) {
  fit.iterations = DEFAULT_FIT_ITERATIONS;
  fit_set_errors(&fit, DEFAULT_GAIN_SD, DEFAULT_MODEL_SD);
  fit.noise_Pa_q10 = static_cast<std::int32_t>(std::lround(1024.0 * noise_Pa));
  fit.location_sd_limit_mm = DEFAULT_LOCATION_LIMIT_mm;
  for (std::size_t k = 0; k < SENSORS; k++) {
    fit.gain_sd_q16[k] = static_cast<std::uint16_t>(std::lround(65536.0 * rubber.gain_sd[k]));
  }
  const pad_profile &profile = model_of(layer_mm).profile;
  contact = {DEFAULT_SLIP_THRESHOLD_mm, DEFAULT_SLIP_WINDOW_ms * 1000U, 1.0F / profile.force_ratio, FORCE_SCALE_SD};
  tangential_use(&tangential, &profile, &contact, true);
  tangential.location_sd_limit_mm = DEFAULT_LOCATION_LIMIT_mm;
}

GripTouch SimulatedFingertip::Firmware::frame(std::uint64_t t_us, bool pressed, const std::int32_t *readings) {
  fit_result fitted{};
  fit_tangential estimate{};
  if (pressed) {
    fit_gaussian_grid(&array, readings, (1U << SENSORS) - 1U, &fit, &fitted);
  }
  if (pressed && tangential_is_worthwhile(&fitted, 0)) {
    fit_tangential_estimate(&array, &pad, readings, &fit, &fitted, &state, &estimate);
  } else {
    state = {};
  }
  contact_input input{};
  input.t_us = t_us;
  input.contact = pressed;
  input.tared = true;
  input.calibrated = true;
  input.fit = pressed ? &fitted : nullptr;
  input.tangential = &estimate;
  const contact_force force = contact_weigh(&contact, &fitted);
  contact_result result;
  tangential_load pull;
  ::motion moved;
  contact_update(&slip, &contact, &input, &result);
  tangential_update(&load, &tangential, &input, &result, &pull);
  motion_update(&motion, &tangential, &input, &result, &moved);

  const bool pulls = (result.flags & CONTACT_FLAG_TANGENTIAL_VALID) != 0;
  GripTouch touch{};
  touch.t_s = 1e-6 * static_cast<double>(t_us);
  touch.flags = result.flags;
  touch.force_N = static_cast<double>(pulls ? pull.force_N : force.force_N);
  touch.force_sd_N = static_cast<double>(pulls ? pull.force_sd_N : force.force_sd_N);
  touch.x_mm = static_cast<double>(pulls ? pull.x_mm : fitted.x_mm);
  touch.y_mm = static_cast<double>(pulls ? pull.y_mm : fitted.y_mm);
  touch.sigma_mm = static_cast<double>(fitted.sigma_mm);
  touch.qx_N = static_cast<double>(pull.qx_N);
  touch.qy_N = static_cast<double>(pull.qy_N);
  touch.q_sd_N = static_cast<double>(pull.q_sd_N);
  touch.speed_mm_s = speed_of(moved);
  return touch;
}

SimulatedFingertip::SimulatedFingertip(const Face &face, const Rubber &rubber, const Sensing &sensing, Random random)
    : face_(&face), rubber_(rubber), sensing_(sensing), random_(random) {
  const ms58xx_osr *osr = ms58xx_find_osr(sensing.osr);
  if (!osr) {
    throw std::runtime_error("no sensor converts at this oversampling");
  }
  noise_Pa_ = osr->noise_Pa_q10 / 1024.0;
  conversion_s_ = 1e-6 * osr->maximum_us;
  next_s_ = random_.uniform(0.0, 1.0) / sensing.rate_Hz;
  firmware_ = std::make_unique<Firmware>(face.layer_mm(), rubber, noise_Pa_);
}

SimulatedFingertip::~SimulatedFingertip() = default;
SimulatedFingertip::SimulatedFingertip(SimulatedFingertip &&) noexcept = default;

SimulatedFingertip::Frame SimulatedFingertip::measure(const twin::Touch &touch) {
  const Pressures base_Pa = face_->base_Pa(touch, sensing_.tangential);
  std::array<std::int32_t, SENSORS> readings{};
  double largest_Pa = 0.0;
  for (std::size_t k = 0; k < SENSORS; k++) {
    const double reading_Pa = rubber_.gain[k] * base_Pa[k] + noise_Pa_ * random_.normal();
    largest_Pa = std::max(largest_Pa, reading_Pa);
    readings[k] = static_cast<std::int32_t>(std::lround(1024.0 * reading_Pa));
  }
  Frame frame;
  const auto t_us = static_cast<std::uint64_t>(std::llround(1e6 * next_s_));
  frame.touch = firmware_->frame(t_us, largest_Pa > GATE_NOISES * noise_Pa_, readings.data());
  const double processing_s = std::min(PROCESSING_s, 1.0 / sensing_.rate_Hz);
  // No frame overtakes another.
  frame.known_s =
      std::max(last_known_s_, next_s_ + 0.5 * conversion_s_ + processing_s + JITTER_s * std::abs(random_.normal()));
  last_known_s_ = frame.known_s;
  next_s_ += 1.0 / sensing_.rate_Hz;
  return frame;
}

} // namespace fingertip::cell
