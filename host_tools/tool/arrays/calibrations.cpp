// The tool's calibration, on many sessions.
#include "tool/arrays/calibrations.hpp"

#include "libfingertip/in_parallel.hpp"
#include "tool/arrays/entry.hpp"

#include <algorithm>
#include <cstring>

using namespace fingertip::calibrating;
using namespace fingertip::measure;

MEASURE_RECORD(calibration, FIELD(state), FIELD(reason), FIELD(text), FIELD(solved), FIELD(has_deviations), FIELD(width_mm),
               FIELD(residual_share), FIELD(sigma_sd_mm), FIELD(dip), FIELD(dip_sd), FIELD(position_mm), FIELD(halves_shape),
               FIELD(halves_gauge), FIELD(force_scale), FIELD(force_scale_sd), FIELD(prior_sigma_mm), FIELD(prior_width_mm),
               FIELD(dip_share), FIELD(dip_sd_mm), FIELD(worst_shape_sd), FIELD(force_share), FIELD(ellipse), FIELD(offset_share),
               FIELD(drift_share), FIELD(slope), FIELD(wanted_x_mm), FIELD(wanted_y_mm))

MEASURE_RECORD(calibrated_sensor, FIELD(gain), FIELD(gain_sd), FIELD(reading_sd), FIELD(off_x_mm), FIELD(off_y_mm), FIELD(wider))

void fingertip::measure::describe(const Array &layout, const std::vector<Placement> &placements, const Judgement &judgement, double force_N,
                                  calibration &found, calibrated_sensor *sensors, fit_deviation *deviations) {
  const Solution &solution = judgement.solution, &stored = judgement.kept;
  const Shape shape = shape_of(stored);
  found = {};
  found.state = static_cast<std::int32_t>(judgement.state);
  std::strncpy(found.reason, name_of(judgement.reason), sizeof found.reason - 1);
  std::strncpy(found.text, judgement.text.c_str(), sizeof found.text - 1);
  found.solved = solution.solved;
  found.width_mm = solution.sigma_mm;
  found.residual_share = solution.residual_share;
  found.prior_sigma_mm = shape.sigma_mm;
  found.prior_width_mm = shape.sigma_sd_mm;
  found.dip_share = shape.dip_share;
  found.dip_sd_mm = shape.dip_sd_mm;
  found.worst_shape_sd = solution.worst_shape_sd();
  found.force_share = judgement.force_share;
  found.ellipse = judgement.ellipse;
  found.offset_share = judgement.offset_share;
  found.drift_share = judgement.drift_share;
  found.slope = judgement.slope;
  found.sigma_sd_mm = solution.sigma_sd_mm;
  found.dip = solution.dip;
  found.dip_sd = solution.dip_sd;
  found.position_mm = solution.solved ? solution.spread.position_mm : 0.0;
  found.halves_shape = judgement.halves_shape;
  found.halves_gauge = judgement.halves_gauge;
  if (const auto scale = force_scale(layout, placements, stored, force_N, shape); stored.solved && scale) {
    found.force_scale = scale->scale;
    found.force_scale_sd = scale->sd;
  }
  const std::vector<fit_deviation> kept = deviations_of(layout, shape);
  found.has_deviations = !kept.empty();
  std::fill_n(deviations, layout.sensors(), fit_deviation{});
  std::copy(kept.begin(), kept.end(), deviations);
  for (std::size_t k = 0; k < layout.sensors(); k++) {
    const auto at = [&](const std::vector<double> &values) { return k < values.size() ? values[k] : 0.0; };
    const Deviation sensor = k < shape.deviations.size() ? shape.deviations[k] : Deviation{};
    sensors[k] = {at(stored.gain), at(stored.gain_sd), at(stored.reading_sd), sensor.off_x_mm, sensor.off_y_mm, sensor.wider};
  }
}

// Sessions [session][placement][sensor]; a sensor whose reading is not a number has none. last: no placement follows.
// force_N: of each placement. fading: share of the readings that each loses in half a second, or none. deviations
// [session][sensor]: zeros unless the session found it.
static void calibrate(Batch<const double, 1> x_mm, Batch<const double, 1> y_mm, double pitch_mm, double noise_Pa, double force_N,
                      std::int64_t last, Batch<const double, 2> t_s, Batch<const double, 3> reading_Pa, Batch<const double, 2> fading,
                      Batch<calibration, 1> found, Batch<calibrated_sensor, 2> sensors, Batch<fit_deviation, 2> deviations) {
  same_length(x_mm, y_mm);
  same_length(found, t_s, reading_Pa, sensors, deviations);
  require(fading.size() == 0 || (fading.size() == found.size() && fading.size(1) == t_s.size(1)), "other fadings");
  const std::size_t count = x_mm.size(), placements_of_each = reading_Pa.size(1);
  require(reading_Pa.size(2) == count && sensors.size(1) == count && deviations.size(1) == count && t_s.size(1) == placements_of_each,
          "arrays of another number of sensors or placements");
  const Array layout{pitch_mm, {x_mm.data, x_mm.data + count}, {y_mm.data, y_mm.data + count}};
  check_places(layout);
  fingertip::twin::in_parallel(found.size(), [&](std::size_t session) {
    std::vector<Placement> placements(placements_of_each);
    for (std::size_t i = 0; i < placements_of_each; i++) {
      Placement &placement = placements[i];
      placement.t_s = t_s.row(session)[i];
      placement.noise_Pa = noise_Pa;
      placement.fading = fading.size() ? fading.row(session)[i] : 0.0;
      const double *const readings = reading_Pa.row(session) + i * count;
      for (std::size_t k = 0; k < count; k++) {
        const bool there = readings[k] == readings[k];
        placement.usable |= there ? sensor_bit(static_cast<unsigned>(k)) : 0;
        placement.reading_Pa.push_back(there ? readings[k] : 0.0);
      }
    }
    const Judgement judgement = judge(layout, placements, last != 0);
    describe(layout, placements, judgement, force_N, found[session], sensors.row(session), deviations.row(session));
    const Wanted wanted = next_place(layout, placements, judgement.solution);
    found[session].wanted_x_mm = wanted.x_mm;
    found[session].wanted_y_mm = wanted.y_mm;
  });
}
MEASURE_ENTRY(calibrate)
