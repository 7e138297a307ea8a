// What follows the fit, on frames in order: condition, contact with slip, tangential estimate and shapes. Runs and
// contacts are independent of each other; along the dimension `frame` their state goes on.
#include "libfingertip/in_parallel.hpp"
#include "library/pad/profile.hpp"
#include "tool/arrays/fit_arguments.hpp"
#include "tool/arrays/places.hpp"

extern "C" {
#include "common/pad_profile.h"
#include "condition/condition.h"
#include "config/defaults.h"
#include "contact/contact.h"
#include "contact/tangential.h"
#include "fit/fit_shapes.h"
#include "ms58xx/ms58xx.h"
}

#include <memory>

using namespace fingertip::measure;
using fingertip::twin::in_parallel;

MEASURE_RECORD(frame, FIELD(number), FIELD(t_us), FIELD(held), FIELD(sensor_count), FIELD(noise_Pa_q10), FIELD(temperature_cC),
               FIELD(renewed), FIELD(restored), FIELD(valid), FIELD(doubtful), FIELD(unsettled), FIELD(saturated), FIELD(pressure_Pa_q10))
MEASURE_RECORD(conditioned, FIELD(usable), FIELD(tared), FIELD(contact), FIELD(zero_doubtful), FIELD(peak_Pa_q10), FIELD(pressure_Pa_q10))
MEASURE_RECORD(condition_gains, FIELD(inverse_q16))
MEASURE_RECORD(contact_settings, FIELD(slip_threshold_mm), FIELD(slip_window_us), FIELD(force_scale), FIELD(force_scale_sd))
MEASURE_RECORD(contact_result, FIELD(flags), FIELD(slip_mm))

// Of this build, as the headers of these names have them.
struct firmware_constants {
  double sensor_max_pressure_Pa, default_gain_sd, location_sd_limit_mm;
  std::int32_t zero_tare_frames;
  std::int32_t tangential_frames, shapes_frames;                           // until the first answer
  double gate_open_Pa, gate_open_noises, gate_close_Pa, gate_close_noises; // of the largest reading
  double default_force_scale_sd;
};
MEASURE_RECORD(firmware_constants, FIELD(sensor_max_pressure_Pa), FIELD(default_gain_sd), FIELD(location_sd_limit_mm),
               FIELD(zero_tare_frames), FIELD(tangential_frames), FIELD(shapes_frames), FIELD(gate_open_Pa), FIELD(gate_open_noises),
               FIELD(gate_close_Pa), FIELD(gate_close_noises), FIELD(default_force_scale_sd))

static void constants_of_build(Batch<firmware_constants, 1> constants) {
  constants[0] = {static_cast<double>(MS58XX_MAX_PRESSURE_Pa),
                  static_cast<double>(DEFAULT_GAIN_SD),
                  static_cast<double>(FIT_LOCATION_SD_LIMIT_mm),
                  ZERO_TARE_FRAMES,
                  FIT_TANGENTIAL_FRAMES,
                  FIT_SHAPES_FRAMES,
                  GATE_OPEN_Pa,
                  GATE_OPEN_SIGMA,
                  GATE_CLOSE_Pa,
                  GATE_CLOSE_SIGMA,
                  static_cast<double>(DEFAULT_FORCE_SCALE_SD)};
}
MEASURE_ENTRY(constants_of_build)

static void default_contact_settings(Batch<contact_settings, 1> settings) {
  for (std::size_t i = 0; i < settings.size(); i++) {
    settings[i] = {DEFAULT_SLIP_THRESHOLD_mm, DEFAULT_SLIP_WINDOW_ms * 1000u, 1.0f, 0.0f};
  }
}
MEASURE_ENTRY(default_contact_settings)

// frames [run][frame] through condition, fit and contact, as the firmware's main loop does it. Every run begins after
// the frames `before`; the noise is that of each frame. gains: one, or none for sensors that are alike.
static void chain(Batch<const fit_array, 1> arrays, Batch<const fit_settings, 1> all_settings, Batch<const fit_deviation, 2> deviations,
                  Batch<const contact_settings, 1> contacts, Batch<const condition_gains, 1> gains, Batch<const frame, 1> before,
                  Batch<const frame, 2> frames, Batch<conditioned, 2> readings, Batch<fit_result, 2> fits,
                  Batch<contact_result, 2> results) {
  const fit_array *const array = &checked(arrays, arrays[0].sensor_count, deviations);
  same_length(frames, readings, fits, results);
  length_or_one(frames, all_settings, contacts);
  require(frames.size(1) == readings.size(1) && frames.size(1) == fits.size(1) && frames.size(1) == results.size(1),
          "other numbers of frames");
  const condition_gains *const divide = gains.size() ? gains.data : nullptr;
  condition start;
  condition_start(&start);
  for (std::size_t i = 0; i < before.size(); i++) {
    conditioned ignored;
    condition_frame(&start, &before[i], divide, &ignored);
    condition_follow(&start, &before[i], &ignored);
  }
  in_parallel(frames.size(), [&](std::size_t run) {
    condition state = start;
    slip_history history{};
    fit_settings settings = settings_of(all_settings, deviations, run);
    for (std::size_t i = 0; i < frames.size(1); i++) {
      const frame &taken = frames.row(run)[i];
      conditioned &reading = readings.row(run)[i];
      fit_result &fit = fits.row(run)[i];
      condition_frame(&state, &taken, divide, &reading);
      condition_follow(&state, &taken, &reading);
      settings.noise_Pa_q10 = taken.noise_Pa_q10;
      fit = {};
      if (reading.contact) {
        fit_gaussian(array, reading.pressure_Pa_q10, reading.usable, &settings, &fit);
      }
      contact_input input{};
      input.t_us = taken.t_us;
      input.contact = reading.contact;
      input.tared = reading.tared;
      input.masked = reading.usable != first_sensors(taken.sensor_count);
      input.zero_doubtful = reading.zero_doubtful;
      input.saturated = taken.saturated;
      input.fit = reading.contact ? &fit : nullptr;
      contact_update(&history, contacts.row_or_all(run), &input, results.row(run) + i);
    }
  });
}
MEASURE_ENTRY(chain)

MEASURE_RECORD(pad_profile, FIELD(thickness_mm), FIELD(overhang_mm), FIELD(normal), FIELD(tangential), FIELD(spread_mm2),
               FIELD(spread_sd_mm2), FIELD(force_ratio), FIELD(tangential_scale), FIELD(tangential_scale_sd), FIELD(from_touch))
MEASURE_RECORD(fit_pad)
MEASURE_RECORD(fit_tangential, FIELD(valid), FIELD(x_mm), FIELD(y_mm), FIELD(location_sd_mm), FIELD(location_noise_mm), FIELD(force_N),
               FIELD(force_sd_N), FIELD(qx_N), FIELD(qy_N), FIELD(q_sd_N), FIELD(shift_q20_mm), FIELD(variance_per_tangential),
               FIELD(elongated))
MEASURE_RECORD(fit_shapes_pad)
MEASURE_RECORD(fit_shapes_result, FIELD(shape), FIELD(x_mm), FIELD(y_mm), FIELD(force_N), FIELD(location_sd_mm), FIELD(force_sd_N),
               FIELD(length_mm), FIELD(along_x), FIELD(along_y), FIELD(angle_sd_rad), FIELD(qx_N), FIELD(qy_N), FIELD(chi_square))

// Of a pad over these sensors; overhang 0: not set.
static void profile_of(Batch<const float, 1> x_mm, Batch<const float, 1> y_mm, double pitch_mm, double thickness_mm, double overhang_mm,
                       Batch<pad_profile, 1> profile) {
  profile[0] = fingertip::pad::profile_of({thickness_mm, overhang_mm}, places_of(x_mm, y_mm, pitch_mm));
}
MEASURE_ENTRY(profile_of)

static void tangential_pad(Batch<const fit_array, 1> array, Batch<const pad_profile, 1> profile, Batch<fit_pad, 1> pad) {
  require(fit_pad_init(pad.data, array.data, profile.data) == FT_OK, "the firmware refuses the pad's profile");
}
MEASURE_ENTRY(tangential_pad)

static void shapes_pad(Batch<const fit_array, 1> array, Batch<const pad_profile, 1> profile, Batch<fit_shapes_pad, 1> pad) {
  require(fit_shapes_init(pad.data, array.data, profile.data) == FT_OK, "the firmware refuses the pad's profile");
}
MEASURE_ENTRY(shapes_pad)

// Fit and tangential estimate of contacts [contact][frame][sensor], each from its first frame on; saturated: bitmap of the sensors that are
// left out, usable of those that are not missing. Frames whose fit is not worthwhile have no estimate, and the one after begins again.
static void tangential(Batch<const fit_array, 1> arrays, Batch<const fit_pad, 1> pads, Batch<const fit_settings, 1> all_settings,
                       Batch<const fit_deviation, 2> deviations, Batch<const std::int32_t, 3> pressure_Pa_q10,
                       Batch<const sensor_map, 2> usable, Batch<const sensor_map, 2> saturated, Batch<fit_result, 2> fits,
                       Batch<fit_tangential, 2> results) {
  const fit_array *const array = &checked(arrays, pressure_Pa_q10.size(2), deviations);
  same_length(results, fits, pressure_Pa_q10, usable, saturated);
  length_or_one(results, all_settings, pads);
  require(results.size(1) == pressure_Pa_q10.size(1) && results.size(1) == fits.size(1) && results.size(1) == usable.size(1) &&
              results.size(1) == saturated.size(1),
          "other numbers of frames");
  in_parallel(results.size(), [&](std::size_t contact) {
    const fit_settings settings = settings_of(all_settings, deviations, contact);
    const auto pad = std::make_unique<fit_pad>(*pads.row_or_all(contact));
    fit_tangential_state state{};
    for (std::size_t i = 0; i < results.size(1); i++) {
      const std::int32_t *pressure = pressure_Pa_q10.row(contact) + i * pressure_Pa_q10.size(2);
      const sensor_map left_out = saturated.row(contact)[i];
      fit_result &fit = fits.row(contact)[i];
      fit_tangential &result = results.row(contact)[i];
      result = {};
      fit_gaussian_grid(array, pressure, usable.row(contact)[i] & ~left_out, &settings, &fit);
      if (tangential_is_worthwhile(&fit, left_out)) {
        fit_tangential_estimate(array, pad.get(), pressure, &settings, &fit, &state, &result);
      } else {
        state = {};
      }
    }
  });
}
MEASURE_ENTRY(tangential)
