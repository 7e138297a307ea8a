// The firmware's zero and gate over many frames: of a simulated pad for hours, and of series that are given.
#include "libfingertip/random.hpp"
#include "tool/arrays/entry.hpp"

extern "C" {
#include "condition/condition.h"
#include "ms58xx/ms58xx.h"
#include "native/sim_ms5840.h"
}

#include <algorithm>
#include <cmath>

using namespace fingertip;
using namespace fingertip::measure;

namespace {

constexpr std::size_t SENSORS = 15;
constexpr double TEMPERATURE_INTERVAL_s = 0.5;
// The part's own reading does not step where its correction does: by -60 Pa at 1 bar.
constexpr double BRANCH_degC = 10.0, BRANCH_STEP_Pa = -60.0;
enum Stream : std::uint64_t { NOISE = 304 };

// Normal numbers are drawn once, because hours of frames take billions.
const std::vector<float> NORMALS = [] {
  std::vector<float> all(1 << 16);
  Random random(1, NOISE, 0);
  std::generate(all.begin(), all.end(), [&] { return static_cast<float>(random.normal()); });
  return all;
}();

enum Flag : std::uint8_t { CONTACT = 1, DOUBTFUL = 2 };

std::uint8_t flags_of(const conditioned &readings) {
  return static_cast<std::uint8_t>((readings.contact ? CONTACT : 0) | (readings.zero_doubtful ? DOUBTFUL : 0));
}

} // namespace

// A pad with its sensors and the firmware's condition, between two runs.
struct gate_pad {
  condition state;
  conditioned readings;
  frame taken;
  double frames_per_s, noise_Pa, t_s;
  double offset_Pa[SENSORS], drift_Pa_s[SENSORS];
  // Begin, rate in K/s, and a rise with its time constant. If it is given, the readings come from conversions.
  double temperature[4], thermal_at_s;
  bool is_warmed;
  ms58xx_prom prom[SENSORS];
  ms58xx_thermal thermal[SENSORS];
  std::uint64_t noise_at;

  double noise() {
    noise_at = noise_at * 6364136223846793005u + 1442695040888963407u;
    return static_cast<double>(NORMALS[noise_at >> 48]) * noise_Pa;
  }
  double degC() const {
    const double since_s = t_s - 1.0;
    return temperature[0] + temperature[1] * since_s + temperature[2] * (1.0 - std::exp(-since_s / temperature[3]));
  }
  std::int32_t converted(std::size_t k, double pressure_Pa, double at_degC) const {
    const std::uint32_t d2 = sim_ms5840_d2(prom[k].word, at_degC);
    const double read_Pa = pressure_Pa + (at_degC > BRANCH_degC ? BRANCH_STEP_Pa : 0.0);
    return ms58xx_compensate_pressure(&thermal[k], sim_ms5840_d1(prom[k].word, read_Pa, d2));
  }
  // The next frame, with these pressures above the zeros.
  void step(const double *pressure_Pa) {
    t_s += 1.0 / frames_per_s;
    const double at_degC = is_warmed ? degC() : 0.0;
    if (is_warmed && t_s - thermal_at_s >= TEMPERATURE_INTERVAL_s) {
      thermal_at_s = t_s;
      for (std::size_t k = 0; k < SENSORS; k++) {
        ms58xx_compensate_temperature(&prom[k], sim_ms5840_d2(prom[k].word, at_degC), thermal[k].branch, &thermal[k]);
      }
    }
    for (std::size_t k = 0; k < SENSORS; k++) {
      const double reads_Pa = offset_Pa[k] + drift_Pa_s[k] * (t_s - 1.0) + pressure_Pa[k] + noise();
      taken.pressure_Pa_q10[k] = is_warmed ? converted(k, reads_Pa, at_degC) : static_cast<std::int32_t>(1024.0 * reads_Pa);
    }
    taken.number++;
    taken.t_us = static_cast<std::uint64_t>(1e6 * t_s);
    condition_frame(&state, &taken, nullptr, &readings);
    condition_follow(&state, &taken, &readings);
  }
  double worst_zero_error_Pa() const {
    double worst_Pa = 0.0;
    for (std::size_t k = 0; k < SENSORS; k++) {
      const double zero_Pa = state.zero_Pa_q10[k] / 1024.0;
      worst_Pa = std::max(worst_Pa, std::abs(zero_Pa - offset_Pa[k] - drift_Pa_s[k] * (t_s - 1.0)));
    }
    return worst_Pa;
  }
};
MEASURE_RECORD(gate_pad)

// temperature: none, or [4] as gate_pad has it. coefficients [sensor][6]: of the sensors' PROMs.
static void gate_begin(std::int64_t seed, double frames_per_s, std::int64_t noise_Pa_q10, Batch<const double, 1> offset_Pa,
                       Batch<const double, 1> drift_Pa_s, Batch<const double, 1> temperature, Batch<const std::uint16_t, 2> coefficients,
                       Batch<gate_pad, 1> pads) {
  require(offset_Pa.size() == SENSORS && drift_Pa_s.size() == SENSORS && coefficients.size() == SENSORS && coefficients.size(1) == 6 &&
              temperature.size() % 4 == 0 && pads.size() == 1,
          "another number of sensors, or no pad");
  gate_pad &pad = pads[0];
  pad = {};
  pad.frames_per_s = frames_per_s;
  pad.noise_Pa = static_cast<double>(noise_Pa_q10) / 1024.0;
  pad.t_s = 1.0;
  pad.noise_at = Random(static_cast<std::uint64_t>(seed), NOISE, 1).next();
  std::copy_n(offset_Pa.data, SENSORS, pad.offset_Pa);
  std::copy_n(drift_Pa_s.data, SENSORS, pad.drift_Pa_s);
  std::copy_n(temperature.data, temperature.size(), pad.temperature);
  pad.is_warmed = temperature.size() > 0;
  pad.thermal_at_s = -TEMPERATURE_INTERVAL_s;
  for (std::size_t k = 0; k < SENSORS; k++) {
    sim_ms5840 part;
    sim_ms5840_init(&part, coefficients.row(k));
    std::copy(std::begin(part.prom), std::end(part.prom), std::begin(pad.prom[k].word));
  }
  pad.taken.sensor_count = SENSORS;
  pad.taken.valid = first_sensors(SENSORS);
  pad.taken.noise_Pa_q10 = static_cast<std::int32_t>(noise_Pa_q10);
  condition_start(&pad.state);
}
MEASURE_ENTRY(gate_begin)

// Runs a pad for a number of frames under a contact whose share goes from the first to the second of `share` within
// its third, in seconds, and stays there; and under what remains of another, which decays exponentially. Of each frame:
// flags (enum Flag), worst_zero_Pa, and pressure_Pa_q10 [frame][sensor], each unless the array is empty.
static void gate_run(Batch<gate_pad, 1> pads, std::int64_t frames, Batch<const double, 1> contact_Pa, Batch<const double, 1> share,
                     Batch<const double, 1> remains_Pa, double decay_s, Batch<std::uint8_t, 1> flags, Batch<float, 1> worst_zero_Pa,
                     Batch<std::int32_t, 2> pressure_Pa_q10) {
  require(contact_Pa.size() == SENSORS && remains_Pa.size() == SENSORS && share.size() == 3, "another number of sensors");
  const auto fits = [&](const auto &array) { return array.size() == 0 || std::int64_t(array.size()) == frames; };
  require(fits(flags) && fits(worst_zero_Pa) && fits(pressure_Pa_q10), "another number of frames");
  gate_pad &pad = pads[0];
  const double begin_s = pad.t_s;
  const bool remains = std::any_of(remains_Pa.data, remains_Pa.data + SENSORS, [](double p_Pa) { return p_Pa != 0.0; });
  for (std::size_t i = 0; i < static_cast<std::size_t>(frames); i++) {
    const double t_s = pad.t_s + 1.0 / pad.frames_per_s - begin_s;
    const double now = share[0] + (share[1] - share[0]) * std::min(1.0, t_s / share[2]);
    const double left = remains ? std::exp(-t_s / decay_s) : 0.0;
    double pressure_Pa[SENSORS];
    for (std::size_t k = 0; k < SENSORS; k++) {
      pressure_Pa[k] = now * contact_Pa[k] + left * remains_Pa[k];
    }
    pad.step(pressure_Pa);
    if (flags.size()) {
      flags[i] = flags_of(pad.readings);
    }
    if (worst_zero_Pa.size()) {
      worst_zero_Pa[i] = static_cast<float>(pad.worst_zero_error_Pa());
    }
    if (pressure_Pa_q10.size()) {
      std::copy_n(pad.readings.pressure_Pa_q10, SENSORS, pressure_Pa_q10.row(i));
    }
  }
}
MEASURE_ENTRY(gate_run)

// The firmware's condition of readings [frame][sensor], 1/1024 Pa. Of each frame: flags (enum Flag), bitmap of the
// usable sensors, and pressure [frame][sensor] above the zero; and hysteresis_sd of the last frame.
static void gate_series(double noise_Pa, Batch<const std::uint64_t, 1> t_us, Batch<const std::int32_t, 2> reading_Pa_q10,
                        Batch<std::uint8_t, 1> flags, Batch<sensor_map, 1> usable, Batch<std::int32_t, 2> pressure_Pa_q10,
                        Batch<std::int32_t, 1> hysteresis_sd_Pa_q10) {
  same_length(t_us, reading_Pa_q10, flags, usable, pressure_Pa_q10);
  const std::size_t sensors = reading_Pa_q10.size(1);
  require(sensors <= FT_MAX_SENSORS && pressure_Pa_q10.size(1) == sensors, "another number of sensors");
  condition state;
  condition_start(&state);
  frame taken{};
  taken.sensor_count = static_cast<std::uint8_t>(sensors);
  taken.valid = first_sensors(static_cast<unsigned>(sensors));
  taken.noise_Pa_q10 = static_cast<std::int32_t>(1024.0 * noise_Pa);
  for (std::size_t i = 0; i < t_us.size(); i++) {
    taken.t_us = t_us[i];
    std::copy_n(reading_Pa_q10.row(i), sensors, taken.pressure_Pa_q10);
    conditioned readings;
    condition_frame(&state, &taken, nullptr, &readings);
    condition_follow(&state, &taken, &readings);
    flags[i] = flags_of(readings);
    usable[i] = readings.usable;
    std::copy_n(readings.pressure_Pa_q10, sensors, pressure_Pa_q10.row(i));
  }
  std::copy_n(state.hysteresis_sd_Pa_q10, std::min(sensors, hysteresis_sd_Pa_q10.size()), hysteresis_sd_Pa_q10.data);
}
MEASURE_ENTRY(gate_series)
