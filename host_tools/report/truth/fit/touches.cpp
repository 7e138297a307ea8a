#include "truth/fit/touches.hpp"

#include "libfingertip/in_parallel.hpp"

extern "C" {
#include "config/defaults.h"
#include "config/geometry.h"
#include "ms58xx/ms58xx.h"
}

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>

namespace fingertip::truth {
namespace {

constexpr double FORCE_MIN_N = 1.0, FORCE_MAX_N = 15.0;
constexpr double GAIN_SIGMAS_MAX = 3.0; // as the twin's pads
constexpr double EDGE_mm = 0.4;         // as the twin's cylinders
constexpr double CALIBRATED_LAYER_mm = 12.0;
constexpr std::size_t SESSIONS_MAX = 100, PADS_PER_SESSION = 10;

double normal_within_limit(Random &random) {
  for (;;) {
    const double sigmas = random.normal();
    if (std::abs(sigmas) <= GAIN_SIGMAS_MAX) {
      return sigmas;
    }
  }
}

} // namespace

const twin::Indenter &indenter_of(const std::string &name) {
  using Shape = twin::Indenter::Shape;
  static const std::vector<twin::Indenter> all{
      {"edge14", "", Shape::roller, 2, 14, 0, EDGE_mm, 0},
      {"edge10", "", Shape::roller, 2, 10, 0, EDGE_mm, 0},
      {"cylinder6x12", "", Shape::roller, 6, 12, 0, EDGE_mm, 0},
      {"edge20", "", Shape::roller, 2, 20, 0, EDGE_mm, 0},
      {"edge24", "", Shape::roller, 2, 24, 0, EDGE_mm, 0},
      {"edge30", "", Shape::roller, 2, 30, 0, EDGE_mm, 0},
      {"edge36", "", Shape::roller, 2, 36, 0, EDGE_mm, 0},
      {"cube15", "", Shape::flat_square, 15, 15, 0, EDGE_mm, 0},
  };
  const auto found = std::find_if(all.begin(), all.end(), [&](const auto &one) { return one.name == name; });
  return found == all.end() ? twin::indenter(name) : *found;
}

Contact contact_of(const std::string &name, double layer_mm, const std::filesystem::path &cache_directory) {
  const auto table = std::make_shared<twin::ContactTable>(
      twin::ContactTable::load_or_build(indenter_of(name), twin::silicone(layer_mm), cache_directory));
  return {name, [table](double force_N, double dx_mm, double dy_mm) {
            return table->base_pressure_Pa(force_N, dx_mm, dy_mm);
          }};
}

Contact gaussian(double shorter_mm, double ratio) {
  const double along = shorter_mm * ratio, across = shorter_mm;
  return {"gaussian", [=](double force_N, double dx_mm, double dy_mm) {
            const double u = dx_mm / along, v = dy_mm / across;
            return 1e6 * force_N / (2.0 * M_PI * along * across) * std::exp(-0.5 * (u * u + v * v));
          }};
}

Pad perfect_pad() {
  Pad pad{};
  pad.gain.fill(1.0);
  return pad;
}

Pad raw_pad(double spread, double told, Random &random) {
  Pad pad{};
  for (double &gain : pad.gain) {
    gain = 1.0 + spread * normal_within_limit(random);
  }
  pad.gain_sd.fill(told);
  return pad;
}

Pad calibrated_pad(const Calibrated &session) {
  Pad pad{};
  for (std::size_t k = 0; k < SENSORS; k++) {
    pad.gain[k] = session.remaining_gain[k];
    pad.gain_sd[k] = session.gain_sd[k];
  }
  return pad;
}

std::vector<Calibrated> calibrations_of(const std::vector<PadOptions> &kinds, std::size_t judged, std::uint64_t seed,
                                        const std::filesystem::path &cache_directory) {
  const Feet feet(CALIBRATED_LAYER_mm, cache_directory);
  std::vector<Calibrated> sessions(std::clamp<std::size_t>(judged / PADS_PER_SESSION, 1, SESSIONS_MAX));
  const std::uint64_t stream = stream_of("calibrated sessions");
  twin::in_parallel(sessions.size(), [&](std::size_t i) {
    sessions[i] = calibrated_session(feet, kinds[i % kinds.size()], Random(seed, stream, i).next());
  });
  return sessions;
}

CalibratedPads calibrated_pads(std::size_t judged, std::uint64_t seed, const std::filesystem::path &cache_directory) {
  CalibratedPads pads;
  for (const Calibrated &session : calibrations_of(USUAL_PADS, judged, seed, cache_directory)) {
    pads.push_back(calibrated_pad(session));
  }
  return pads;
}

std::uint64_t stream_of(const std::string &name) {
  std::uint64_t stream = 0;
  for (const char letter : name) {
    stream = stream * 131 + static_cast<unsigned char>(letter);
  }
  return stream;
}

std::uint32_t choose_sensors(std::size_t sensors, Random &random) {
  std::uint32_t usable = (1u << SENSORS) - 1u;
  for (std::size_t left = SENSORS; left > sensors;) {
    const std::uint32_t bit = 1u << random.next() % SENSORS;
    left -= (usable & bit) ? 1 : 0;
    usable &= ~bit;
  }
  return usable;
}

Touch draw_touch(const fit_array &array, Random &random) {
  const auto [left, right] = std::minmax_element(array.x, array.x + SENSORS);
  const auto [bottom, top] = std::minmax_element(array.y, array.y + SENSORS);
  const double pitch_mm = static_cast<double>(array.pitch_mm);
  Touch touch{};
  touch.x_mm = pitch_mm * random.uniform(*left, *right);
  touch.y_mm = pitch_mm * random.uniform(*bottom, *top);
  touch.force_N = random.uniform(FORCE_MIN_N, FORCE_MAX_N);
  touch.angle_rad = random.uniform(0.0, 2.0 * M_PI);
  return touch;
}

double draw_noise_Pa(Random &random) {
  const auto osr = static_cast<std::uint16_t>(256 << random.next() % 6);
  return ms58xx_find_osr(osr)->noise_Pa_q10 / 1024.0;
}

std::array<std::int32_t, SENSORS> readings_of(const fit_array &array, const Contact &contact, const Touch &touch,
                                              const Pad &pad, double noise_Pa, Random &random) {
  std::array<std::int32_t, SENSORS> readings{};
  const double c = std::cos(touch.angle_rad), s = std::sin(touch.angle_rad);
  const double pitch_mm = static_cast<double>(array.pitch_mm);
  for (std::size_t k = 0; k < SENSORS; k++) {
    const double dx = pitch_mm * static_cast<double>(array.x[k]) - touch.x_mm;
    const double dy = pitch_mm * static_cast<double>(array.y[k]) - touch.y_mm;
    const double base_Pa = contact.base_Pa(touch.force_N, c * dx + s * dy, c * dy - s * dx);
    const double reading_Pa = pad.gain[k] * base_Pa + noise_Pa * random.normal();
    readings[k] = static_cast<std::int32_t>(std::lround(1024.0 * reading_Pa));
  }
  return readings;
}

fit_array firmware_array() {
  fit_array array;
  if (geometry.sensor_count != SENSORS ||
      fit_array_init(&array, geometry.sensor_count, geometry.x_mm, geometry.y_mm, geometry.pitch_mm) != FT_OK) {
    throw std::runtime_error("the firmware's geometry is not the grid of 15 that is judged here");
  }
  return array;
}

fit_settings settings_for(const Pad &pad, double noise_Pa) {
  fit_settings settings{};
  settings.iterations = DEFAULT_FIT_ITERATIONS;
  settings.cut_noises = DEFAULT_CUT_NOISES;
  fit_set_errors(&settings, DEFAULT_GAIN_SD, DEFAULT_MODEL_SD);
  settings.noise_Pa_q10 = static_cast<std::int32_t>(std::lround(1024.0 * noise_Pa));
  for (std::size_t k = 0; k < SENSORS; k++) {
    settings.gain_sd_q16[k] = static_cast<std::uint16_t>(std::lround(65536.0 * pad.gain_sd[k]));
  }
  return settings;
}

} // namespace fingertip::truth
