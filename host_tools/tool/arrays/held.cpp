// What the firmware publishes of contacts over frames: the tangential force, shapes of contacts that are held, and motion.
#include "libfingertip/in_parallel.hpp"
#include "tool/arrays/fit_arguments.hpp"

extern "C" {
#include "common/contact_flags.h"
#include "config/defaults.h"
#include "contact/motion.h"
#include "contact/shapes.h"
#include "fit/fit_bias.h"
}

#include <algorithm>
#include <memory>

using namespace fingertip::measure;
using fingertip::twin::in_parallel;

// In the scales of a calibration: the corrected location and force where the estimate is valid, otherwise the Gaussian's.
struct published {
  bool valid, elongated; // the latter as the Gaussian fit flags it
  double x_mm, y_mm, location_sd_mm, force_N;
  double force_sd_N;   // of the estimate
  double qx, qy, q_sd; // per normal force
  double gaussian_x_mm, gaussian_y_mm, gaussian_force_N;
};
MEASURE_RECORD(published, FIELD(valid), FIELD(elongated), FIELD(x_mm), FIELD(y_mm), FIELD(location_sd_mm), FIELD(force_N),
               FIELD(force_sd_N), FIELD(qx), FIELD(qy), FIELD(q_sd), FIELD(gaussian_x_mm), FIELD(gaussian_y_mm), FIELD(gaussian_force_N))

// force_scale: 0 of a pad that is not calibrated.
static published published_of(const pad_profile &profile, double force_scale, double force_scale_sd, const fit_result &fit,
                              const fit_tangential &estimate) {
  contact_settings scales{};
  const double scale = force_scale > 0.0 ? force_scale : 1.0;
  scales.force_scale = static_cast<float>(scale);
  scales.force_scale_sd = static_cast<float>(force_scale_sd);
  tangential_settings settings{};
  tangential_configure(&settings, &profile, &scales, force_scale > 0.0 ? TANGENTIAL_DEFAULT_OFFSET_um : -1);
  contact_input input{};
  input.contact = true;
  input.fit = &fit;
  input.tangential = &estimate;
  tangential_history history{};
  contact_result result{};
  tangential_force load;
  tangential_update(&history, &settings, &input, &result, &load);
  const auto number = [](float value) { return static_cast<double>(value); };
  published found{};
  found.valid = (result.flags & CONTACT_FLAG_TANGENTIAL_VALID) != 0;
  found.elongated = (fit.flags & CONTACT_FLAG_ELONGATED) != 0;
  found.gaussian_x_mm = number(fit.x_mm);
  found.gaussian_y_mm = number(fit.y_mm);
  found.gaussian_force_N = scale * number(fit.force_N);
  found.x_mm = found.valid ? number(load.x_mm) : found.gaussian_x_mm;
  found.y_mm = found.valid ? number(load.y_mm) : found.gaussian_y_mm;
  found.location_sd_mm = number(found.valid ? load.location_sd_mm : fit.location_sd_mm);
  found.force_N = found.valid ? number(load.force_N) : found.gaussian_force_N;
  if (found.valid) {
    found.force_sd_N = number(load.force_sd_N);
    found.qx = number(load.qx_N) / found.force_N;
    found.qy = number(load.qy_N) / found.force_N;
    found.q_sd = number(load.q_sd_N) / found.force_N;
  }
  return found;
}

// All zeros where there is no fit.
static void publish(Batch<const pad_profile, 1> profile, Batch<const double, 1> force_scale, double force_scale_sd,
                    Batch<const fit_result, 1> fits, Batch<const fit_tangential, 1> estimates, Batch<published, 1> found) {
  same_length(found, force_scale, fits, estimates);
  for (std::size_t i = 0; i < found.size(); i++) {
    const bool has_fit = (fits[i].flags & CONTACT_FLAG_FIT_VALID) != 0;
    found[i] = has_fit ? published_of(profile[0], force_scale[i], force_scale_sd, fits[i], estimates[i]) : published{};
  }
}
MEASURE_ENTRY(publish)

// The force that the firmware reports of fits whose largest readings are these, and its standard deviation.
static void weigh(double force_scale, double force_scale_sd, Batch<const fit_result, 1> fits, Batch<const double, 1> largest_Pa,
                  Batch<double, 2> found) {
  same_length(found, fits, largest_Pa);
  contact_settings scales{};
  scales.force_scale = static_cast<float>(force_scale);
  scales.force_scale_sd = static_cast<float>(force_scale_sd);
  for (std::size_t i = 0; i < found.size(); i++) {
    const contact_force force = contact_scale_force(&scales, &fits[i], static_cast<float>(largest_Pa[i]));
    found.row(i)[0] = static_cast<double>(force.force_N);
    found.row(i)[1] = static_cast<double>(force.force_sd_N);
  }
}
MEASURE_ENTRY(weigh)

MEASURE_RECORD(shapes_location, FIELD(x_mm), FIELD(y_mm), FIELD(location_sd_mm))

// The shapes, as scene grasp has them, of contacts [contact][frame][sensor] that are held: after FIT_SHAPES_FRAMES
// frames the first answer, and the last. Where the tangential force is estimated, its location is used.
static void held_shapes(Batch<const fit_array, 1> arrays, Batch<const fit_shapes_pad, 1> pad, Batch<const fit_settings, 1> all_settings,
                        Batch<const fit_deviation, 2> deviations, Batch<const std::int32_t, 3> pressure_Pa_q10,
                        Batch<const sensor_map, 2> usable, Batch<const published, 1> estimates, Batch<fit_shapes_result, 2> results,
                        Batch<shapes_location, 2> places) {
  const fit_array *const array = &checked(arrays, pressure_Pa_q10.size(2), deviations);
  const std::size_t frames = pressure_Pa_q10.size(1), sensors = pressure_Pa_q10.size(2);
  same_length(results, places, pressure_Pa_q10, usable, estimates);
  require(results.size(1) == 2 && places.size(1) == 2 && frames > FIT_SHAPES_FRAMES && usable.size(1) == frames,
          "too few frames or answers");
  in_parallel(results.size(), [&](std::size_t contact) {
    const auto job = std::make_unique<shapes_job>();
    job->array = array;
    job->pad = pad[0];
    auto &question = job->question;
    question.parts = FIT_SHAPES_PARTS;
    question.settings = settings_of(all_settings, deviations, contact);
    const published &estimate = estimates[contact];
    tangential_force load{};
    load.x_mm = static_cast<float>(estimate.x_mm);
    load.y_mm = static_cast<float>(estimate.y_mm);
    load.location_sd_mm = static_cast<float>(estimate.location_sd_mm);
    fit_bias bias{};
    for (std::size_t i = 0; i < frames; i++) {
      std::copy_n(pressure_Pa_q10.row(contact) + i * sensors, sensors, question.pressure_Pa_q10);
      question.begins = i == 0;
      fit_gaussian_grid(array, question.pressure_Pa_q10, usable.row(contact)[i], &question.settings, &question.fit);
      shapes_estimate(job.get());
      fit_bias_step(&bias, array, question.pressure_Pa_q10, &question.settings, &question.fit);
      const bool last = i == frames - 1;
      if (last || i == FIT_SHAPES_FRAMES - 1) {
        fit_bias_add(&bias, array, &question.settings, &question.fit);
        fit_shapes_result &result = results.row(contact)[last ? 1 : 0];
        result = job->result;
        result.shape = job->report.shape; // which stays, while what is none of these begins again
        places.row(contact)[last ? 1 : 0] = shapes_locate(&job->report, &question.fit, estimate.valid ? &load : nullptr);
      }
    }
  });
}
MEASURE_ENTRY(held_shapes)

// Flags of the frames of contacts that come and go, with the firmware's detectors of motion. Run i has the frames
// before end[i]; pressed: the gate is open.
static void motion_flags(Batch<const fit_array, 1> arrays, Batch<const fit_pad, 1> pad, Batch<const fit_settings, 1> all_settings,
                         Batch<const std::int64_t, 1> end, Batch<const std::int64_t, 1> t_us, Batch<const std::int32_t, 2> pressure_Pa_q10,
                         Batch<const bool, 1> pressed, Batch<std::uint32_t, 1> flags) {
  same_length(flags, t_us, pressure_Pa_q10, pressed);
  length_or_one(end, all_settings);
  require(end.size() == 0 || end[end.size() - 1] == pressure_Pa_q10.shape[0], "runs of another number of frames");
  const sensor_map usable = first_sensors(static_cast<unsigned>(pressure_Pa_q10.size(1)));
  const contact_settings contact{DEFAULT_SLIP_THRESHOLD_mm, DEFAULT_SLIP_WINDOW_ms * 1000u, DEFAULT_FORCE_SCALE, DEFAULT_FORCE_SCALE_SD};
  tangential_settings published{};
  published.force_scale = published.tangential_scale = 1.0F;
  published.location_sd_limit_mm = DEFAULT_LOCATION_LIMIT_mm;
  in_parallel(end.size(), [&](std::size_t run) {
    const fit_settings settings = *all_settings.row_or_all(run);
    const auto job = std::make_unique<tangential_job>();
    job->array = arrays.data;
    job->pad = pad[0];
    slip_history slip{};
    tangential_history history{};
    motion_history moved{};
    for (auto i = static_cast<std::size_t>(run == 0 ? 0 : end[run - 1]); i < static_cast<std::size_t>(end[run]); i++) {
      fit_result fit{};
      fit_tangential estimate{};
      const auto now_us = static_cast<std::uint64_t>(t_us[i]);
      if (pressed[i]) {
        fit_gaussian_grid(arrays.data, pressure_Pa_q10.row(i), usable, &settings, &fit);
        job->question = {false, 0, now_us, pressure_Pa_q10.row(i), &settings, &fit};
        tangential_estimate(job.get());
        estimate = job->estimate;
      } else {
        job->course = {};
      }
      contact_input input{};
      input.t_us = now_us;
      input.contact = pressed[i];
      input.fit = pressed[i] ? &fit : nullptr;
      input.tangential = &estimate;
      contact_result result;
      tangential_force load;
      motion motion;
      contact_update(&slip, &contact, &input, &result);
      tangential_update(&history, &published, &input, &result, &load);
      motion_update(&moved, &published, &input, &result, &motion);
      flags[i] = result.flags;
    }
  });
}
MEASURE_ENTRY(motion_flags)
