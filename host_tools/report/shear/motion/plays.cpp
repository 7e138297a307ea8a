#include "shear/motion/plays.hpp"

#include "libfingertip/wire.hpp"
#include "library/pad/profile.hpp"

extern "C" {
#include "config/defaults.h"
#include "config/geometry.h"
#include "ms58xx/ms58xx.h"
}

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace fingertip::shear {
namespace {

enum Stream : std::uint64_t { GAINS = 701, NOISE };
// A sensor is pressed from here on: the gate of a quiet pad without any drift.
constexpr double GATE_NOISES = 8.0;
constexpr truth::PadOptions CALIBRATED_PADS[] = {{10.0, 0.0, 0.0}};

fit_pad pad_under(double layer_mm, const fit_array &array) {
  wire_info info{};
  info.sensor_count = geometry.sensor_count;
  info.pitch_mm = geometry.pitch_mm;
  for (unsigned k = 0; k < geometry.sensor_count; k++) {
    info.x_mm[k] = geometry.x_mm[k];
    info.y_mm[k] = geometry.y_mm[k];
  }
  const pad_profile profile = pad::profile_of({layer_mm, 0.0, false}, info);
  fit_pad made;
  if (fit_pad_init(&made, &array, &profile) != FT_OK) {
    throw std::runtime_error("the firmware refuses the profile of this layer");
  }
  return made;
}

} // namespace

Object::Object(const std::string &name, double thickness_mm, const std::filesystem::path &cache)
    : indenter(name), layer_mm(thickness_mm),
      table_(twin::ContactTable::load_or_build(twin::indenter(name), twin::silicone(thickness_mm), cache)),
      traction_(table_, twin::silicone(thickness_mm)) {}

std::array<double, truth::SENSORS> Object::base_Pa(const twin::Touch &touch) const {
  std::array<double, truth::SENSORS> base_Pa{};
  const double c = std::cos(touch.angle_rad), s = std::sin(touch.angle_rad);
  const twin::TractionTable::Load load{touch.force_N, touch.stuck_N, c * touch.pull_x_N + s * touch.pull_y_N,
                                       c * touch.pull_y_N - s * touch.pull_x_N};
  const bool pulls = touch.pull_x_N != 0.0 || touch.pull_y_N != 0.0;
  for (std::size_t k = 0; k < truth::SENSORS; k++) {
    const double dx = static_cast<double>(geometry.x_mm[k]) - touch.x_mm;
    const double dy = static_cast<double>(geometry.y_mm[k]) - touch.y_mm;
    const double along_x = c * dx + s * dy, along_y = c * dy - s * dx;
    base_Pa[k] = table_.base_pressure_Pa(touch.force_N, along_x, along_y) +
                 (pulls ? traction_.base_pressure_Pa(load, along_x, along_y) : 0.0);
  }
  return base_Pa;
}

const std::vector<std::string> &Pads::kinds() {
  static const std::vector<std::string> all{"equal", "cal", "raw5", "raw10"};
  return all;
}

Pads::Pads(std::size_t calibrations, std::uint64_t seed, const std::filesystem::path &cache) : seed_(seed) {
  const truth::Feet feet(12.0, cache);
  for (std::size_t i = 0; i < calibrations; i++) {
    calibrated_.push_back(truth::calibrated_pad(truth::calibrated_session(feet, CALIBRATED_PADS[0], seed + i)));
  }
}

truth::Pad Pads::pad(const std::string &kind, std::uint64_t n) const {
  Random random(seed_, GAINS, n);
  if (kind == "cal") {
    return calibrated_.at(n % calibrated_.size());
  }
  if (kind == "raw5") {
    return truth::raw_pad(0.05, static_cast<double>(DEFAULT_GAIN_SD), random);
  }
  if (kind == "raw10") {
    return truth::raw_pad(0.10, static_cast<double>(DEFAULT_GAIN_SD), random);
  }
  if (kind != "equal") {
    throw std::runtime_error("there is no kind of pad \"" + kind + "\"");
  }
  return truth::perfect_pad();
}

Player::Player(const Object &object, const truth::Pad &pad, const Sensing &sensing, std::uint64_t seed)
    : object_(object), pad_(pad), sensing_(sensing), seed_(seed), array_(truth::firmware_array()) {
  const ms58xx_osr *osr = ms58xx_find_osr(sensing.osr);
  if (!osr) {
    throw std::runtime_error("no sensor converts at this oversampling");
  }
  noise_Pa_ = osr->noise_Pa_q10 / 1024.0;
  conversion_s_ = 1e-6 * osr->maximum_us;
  settings_ = truth::settings_for(pad, noise_Pa_);
  settings_.cut_noises = 0; // as where a profile acts
  job_ = std::make_unique<tangential_job>();
  job_->array = &array_;
  job_->pad = pad_under(object.layer_mm, array_);
}

Player::~Player() = default;

void Player::play(const twin::Act &act, std::uint64_t number, const std::function<void(const Felt &)> &frame) {
  Random random(seed_, NOISE, number);
  job_->course = {};
  const double first_s = random.uniform(0.0, 1.0) / sensing_.rate_Hz;
  for (std::uint64_t i = 0;; i++) {
    const double t_s = first_s + static_cast<double>(i) / sensing_.rate_Hz;
    if (t_s > act.end_s - act.begin_s) {
      return;
    }
    Felt felt{};
    felt.t_us = static_cast<std::uint64_t>(std::llround(1e6 * t_s));
    // The other half of the conversion; reading and fit take about as long as that at most.
    felt.known_s = t_s + conversion_s_;
    felt.truth = act.tracks[0].at(t_s);
    felt.slips = act.slips(act.begin_s + t_s);
    const auto base_Pa = object_.base_Pa(felt.truth);
    std::int32_t readings[FT_MAX_SENSORS] = {};
    double largest_Pa = 0.0;
    for (std::size_t k = 0; k < truth::SENSORS; k++) {
      const double reading_Pa = pad_.gain[k] * base_Pa[k] + noise_Pa_ * random.normal();
      largest_Pa = std::max(largest_Pa, reading_Pa);
      readings[k] = static_cast<std::int32_t>(std::lround(1024.0 * reading_Pa));
    }
    felt.contact = largest_Pa > GATE_NOISES * noise_Pa_;
    if (felt.contact) {
      fit_gaussian_grid(&array_, readings, (1u << geometry.sensor_count) - 1u, &settings_, &felt.fit);
      job_->question = {false, 0, felt.t_us, readings, &settings_, &felt.fit};
      tangential_estimate(job_.get());
      felt.tangential = job_->estimate;
    } else {
      job_->course = {};
    }
    frame(felt);
  }
}

} // namespace fingertip::shear
