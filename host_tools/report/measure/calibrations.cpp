// The tool's calibration, on many sessions.
#include "libfingertip/in_parallel.hpp"
#include "report/measure/entry.hpp"
#include "tool/calibration/judge.hpp"

extern "C" {
#include "fit/fit.h"
}

#include <algorithm>
#include <cstring>

using namespace fingertip::calibrating;
using namespace fingertip::measure;

// What a session ends with, and what the tool would keep of it.
struct calibration {
  std::int32_t state; // 0: more, 1: good, 2: refused
  char reason[16];
  bool solved, helps;
  bool has_own; // the tool would keep `own`
  double width_mm, residual_share;
  double prior_sigma_mm, prior_width_mm, dip_share, dip_sd_mm; // as fit_settings has them
  double worst_shape_sd, gauge_sd, force_share, ellipse, offset_share, drift_share, kept_share;
};
MEASURE_RECORD(calibration, FIELD(state), FIELD(reason), FIELD(solved), FIELD(helps), FIELD(has_own), FIELD(width_mm),
               FIELD(residual_share), FIELD(prior_sigma_mm), FIELD(prior_width_mm), FIELD(dip_share), FIELD(dip_sd_mm),
               FIELD(worst_shape_sd), FIELD(gauge_sd), FIELD(force_share), FIELD(ellipse), FIELD(offset_share),
               FIELD(drift_share), FIELD(kept_share))

// What it found of one sensor.
struct calibrated_sensor {
  double gain, gain_sd, reading_sd; // reading_sd: what the firmware gets as the gain's
  double off_x_mm, off_y_mm, wider;
};
MEASURE_RECORD(calibrated_sensor, FIELD(gain), FIELD(gain_sd), FIELD(reading_sd), FIELD(off_x_mm), FIELD(off_y_mm),
               FIELD(wider))

static calibration found_by(const Judgement &judgement, const Shape &shape) {
  const Solution &solution = judgement.solution;
  calibration found{};
  found.state = static_cast<std::int32_t>(judgement.state);
  std::strncpy(found.reason, name_of(judgement.reason), sizeof found.reason - 1);
  found.solved = solution.solved;
  found.helps = judgement.helps;
  found.width_mm = solution.sigma_mm;
  found.residual_share = solution.residual_share;
  found.prior_sigma_mm = shape.sigma_mm;
  found.prior_width_mm = shape.sigma_sd_mm;
  found.dip_share = shape.dip_share;
  found.dip_sd_mm = shape.dip_sd_mm;
  found.worst_shape_sd = solution.worst_shape_sd();
  found.gauge_sd = solution.gauge_sd;
  found.force_share = judgement.force_share;
  found.ellipse = judgement.ellipse;
  found.offset_share = judgement.offset_share;
  found.drift_share = judgement.drift_share;
  found.kept_share = judgement.kept_share;
  return found;
}

// Sessions [session][placement][sensor]; a sensor whose reading is not a number has none. No placement follows.
// own [session][sensor]: zeros unless the session found it.
static void calibrate(Batch<const double, 1> x_mm, Batch<const double, 1> y_mm, double pitch_mm, double noise_Pa,
                      Batch<const double, 2> t_s, Batch<const double, 3> reading_Pa, Batch<calibration, 1> found,
                      Batch<calibrated_sensor, 2> sensors, Batch<fit_own, 2> own) {
  same_length(x_mm, y_mm);
  same_length(found, t_s, reading_Pa, sensors, own);
  const std::size_t count = x_mm.size(), placements_of_each = reading_Pa.size(1);
  require(reading_Pa.size(2) == count && sensors.size(1) == count && own.size(1) == count &&
              t_s.size(1) == placements_of_each,
          "arrays of another number of sensors or placements");
  Array layout;
  layout.pitch_mm = pitch_mm;
  layout.x_mm.assign(x_mm.data, x_mm.data + count);
  layout.y_mm.assign(y_mm.data, y_mm.data + count);
  fingertip::twin::in_parallel(found.size(), [&](std::size_t session) {
    std::vector<Placement> placements(placements_of_each);
    for (std::size_t i = 0; i < placements_of_each; i++) {
      Placement &placement = placements[i];
      placement.t_s = t_s.row(session)[i];
      placement.noise_Pa = noise_Pa;
      const double *const readings = reading_Pa.row(session) + i * count;
      for (std::size_t k = 0; k < count; k++) {
        const bool there = readings[k] == readings[k];
        placement.usable |= there ? 1u << k : 0u;
        placement.reading_Pa.push_back(there ? readings[k] : 0.0);
      }
    }
    const Judgement judgement = judge(layout, placements, true);
    const Solution &solution = judgement.solution;
    const Shape shape = shape_of(solution);
    found[session] = found_by(judgement, shape);
    const std::vector<fit_own> kept = own_of(layout, shape);
    found[session].has_own = !kept.empty();
    std::fill_n(own.row(session), count, fit_own{});
    std::copy(kept.begin(), kept.end(), own.row(session));
    for (std::size_t k = 0; k < count; k++) {
      const auto at = [&](const std::vector<double> &values) { return k < values.size() ? values[k] : 0.0; };
      const Own sensor = k < shape.own.size() ? shape.own[k] : Own{};
      sensors.row(session)[k] = {at(solution.gain), at(solution.gain_sd), at(solution.reading_sd),
                                 sensor.off_x_mm,   sensor.off_y_mm,      sensor.wider};
    }
  });
}
MEASURE_ENTRY(calibrate)
