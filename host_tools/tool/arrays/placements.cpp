// The tool's finder of placements, frame by frame, and the calibration that placements give.
#include "tool/calibration/placements.hpp"

#include "library/pad/profile.hpp"
#include "tool/arrays/calibrations.hpp"
#include "tool/arrays/places.hpp"

#include <algorithm>

using namespace fingertip::calibrating;
using namespace fingertip::measure;

struct found_placement {
  double t_s, noise_Pa, fading;
  sensor_map usable;
};
MEASURE_RECORD(found_placement, FIELD(t_s), FIELD(noise_Pa), FIELD(fading), FIELD(usable))

// force_scale: 0 where there is none.
struct solved_placements {
  double peak_Pa, width_mm, mixing, dip, dip_share, dip_sd_mm; // as Solution has them
  double sigma_mm, thickness_mm, thickness_sd_mm, force_scale, force_ratio;
};
MEASURE_RECORD(solved_placements, FIELD(peak_Pa), FIELD(width_mm), FIELD(mixing), FIELD(dip), FIELD(dip_share), FIELD(dip_sd_mm),
               FIELD(sigma_mm), FIELD(thickness_mm), FIELD(thickness_sd_mm), FIELD(force_scale), FIELD(force_ratio))

static void finder_new(std::int64_t sensors, Batch<std::int64_t, 1> finder) {
  require(sensors > 0 && sensors <= FT_MAX_SENSORS && finder.size() == 1, "no number of sensors");
  finder[0] = reinterpret_cast<std::intptr_t>(new PlacementFinder(static_cast<std::size_t>(sensors)));
}
MEASURE_ENTRY(finder_new)

static void finder_free(std::int64_t finder) { delete reinterpret_cast<PlacementFinder *>(static_cast<std::intptr_t>(finder)); }
MEASURE_ENTRY(finder_free)

// frame: pressures and zeros, [2][sensor]. state: State, Refusal, and whether this frame completes a placement; then found, and its
// readings and rest in levels, [2][sensor].
static void finder_take(std::int64_t finder, Batch<const double, 1> t_s, Batch<const std::int64_t, 1> valid, Batch<const double, 2> frame,
                        Batch<std::int64_t, 1> state, Batch<found_placement, 1> found, Batch<double, 2> levels) {
  auto &placements = *reinterpret_cast<PlacementFinder *>(static_cast<std::intptr_t>(finder));
  const std::size_t sensors = placements.above_Pa().size();
  require(frame.size() == 2 && frame.size(1) == sensors && levels.size() == 2 && levels.size(1) == sensors, "another number of sensors");
  require(t_s.size() == 1 && valid.size() == 1 && state.size() == 3 && found.size() == 1, "another number of values");
  const auto row = [&](std::size_t i) { return std::vector<double>(frame.row(i), frame.row(i) + frame.size(1)); };
  const auto placement = placements.take({t_s[0], static_cast<sensor_map>(valid[0]), row(0), row(1)});
  state[0] = static_cast<std::int64_t>(placements.state());
  state[1] = static_cast<std::int64_t>(placements.refusal());
  state[2] = placement.has_value();
  if (placement) {
    found[0] = {placement->t_s, placement->noise_Pa, placement->fading, placement->usable};
    std::copy(placement->reading_Pa.begin(), placement->reading_Pa.end(), levels.row(0));
    std::copy(placement->rest_Pa.begin(), placement->rest_Pa.end(), levels.row(1));
  }
}
MEASURE_ENTRY(finder_take)

// levels: [placement][reading, rest][sensor], in the order of time; force_N: of each. gains: [gain, sd][sensor]. kept, kept_sensors: what
// the tool would keep.
static void solve_placements(Batch<const double, 1> x_mm, Batch<const double, 1> y_mm, double pitch_mm, double force_N,
                             Batch<const found_placement, 1> placements, Batch<const double, 3> levels, Batch<solved_placements, 1> solved,
                             Batch<double, 2> gains, Batch<fingertip::measure::calibration, 1> kept,
                             Batch<calibrated_sensor, 1> kept_sensors) {
  same_length(x_mm, y_mm);
  same_length(placements, levels);
  const std::size_t sensors = x_mm.size();
  require(sensors > 0 && sensors <= FT_MAX_SENSORS, "no number of sensors");
  require(levels.size(1) == 2 && levels.size(2) == sensors && gains.size(1) == sensors && kept_sensors.size() == sensors,
          "another number of sensors");
  require(solved.size() == 1 && gains.size() == 2 && kept.size() == 1, "no room for what is found");
  const Array array{pitch_mm, {x_mm.data, x_mm.data + sensors}, {y_mm.data, y_mm.data + sensors}};
  check_places(array);
  std::vector<Placement> all(placements.size());
  for (std::size_t i = 0; i < all.size(); i++) {
    const double *const reading_Pa = levels.row(i);
    all[i].t_s = placements[i].t_s;
    all[i].noise_Pa = placements[i].noise_Pa;
    all[i].fading = placements[i].fading;
    all[i].usable = placements[i].usable;
    all[i].reading_Pa.assign(reading_Pa, reading_Pa + sensors);
    all[i].rest_Pa.assign(reading_Pa + sensors, reading_Pa + 2 * sensors);
  }
  const Judgement judgement = judge(array, all, true);
  describe(array, all, judgement, force_N, kept[0], kept_sensors.data, std::vector<fit_deviation>(sensors).data());
  const Solution &solution = judgement.solution;
  solved_placements &found = solved[0];
  if (!solution.solved) {
    return;
  }
  const fingertip::pad::Thickness thickness = fingertip::pad::thickness_of(solution.sigma_mm, solution.sigma_sd_mm);
  found.peak_Pa = solution.peak_Pa;
  found.width_mm = solution.width_mm;
  found.mixing = solution.mixing;
  found.dip = solution.dip;
  found.dip_share = solution.dip_share;
  found.dip_sd_mm = solution.dip_sd_mm;
  found.sigma_mm = solution.sigma_mm;
  found.thickness_mm = thickness.mm;
  found.thickness_sd_mm = thickness.sd_mm;
  const auto scale = force_scale(array, all, solution, force_N, shape_of(solution));
  found.force_scale = scale ? scale->scale : 0.0;
  const double layer_mm = std::clamp(thickness.mm, double{PAD_THICKNESS_MIN_mm}, double{PAD_THICKNESS_MAX_mm});
  found.force_ratio = static_cast<double>(fingertip::pad::profile_of({layer_mm}, places_of(x_mm, y_mm, pitch_mm)).force_ratio);
  std::copy(solution.gain.begin(), solution.gain.end(), gains.row(0));
  std::copy(solution.gain_sd.begin(), solution.gain_sd.end(), gains.row(1));
}
MEASURE_ENTRY(solve_placements)
