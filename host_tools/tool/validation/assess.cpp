#include "tool/validation/assess.hpp"

#include "libfingertip/error.hpp"
#include "libfingertip/text.hpp"
#include "library/pad/profile.hpp"
#include "library/pad/thickness.hpp"

#include <algorithm>
#include <cmath>

namespace fingertip::validating {
namespace {

using calibrating::Placement;

constexpr std::size_t LOOSE_MAX = 3, CANDIDATES = 3;

double median(std::vector<double> values) {
  if (values.empty()) {
    return 0.0;
  }
  std::sort(values.begin(), values.end());
  const std::size_t half = values.size() / 2;
  return values.size() % 2 ? values[half] : 0.5 * (values[half - 1] + values[half]);
}

double quantile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values.empty() ? 0.0 : values[static_cast<std::size_t>(share * double(values.size() - 1))];
}

double largest(const std::vector<double> &values) {
  double most = 0.0;
  for (double value : values) {
    most = std::abs(value) > std::abs(most) ? value : most;
  }
  return most;
}

std::string percent(double share, int digits = 0) {
  return fixed(100.0 * share, digits) + " %";
}

std::string named(const std::vector<std::size_t> &sensors) {
  std::string text = sensors.size() == 1 ? "Sensor " : "Sensors ";
  for (std::size_t i = 0; i < sensors.size(); i++) {
    text += (i == 0 ? "" : i + 1 == sensors.size() ? " and " : ", ") + std::to_string(sensors[i]);
  }
  return text;
}

class Assessor {
public:
  Assessor(Measured measured) : sensors_(measured.array.sensors()) {
    card_.measured = std::move(measured);
    card_.is_calibrated = card_.measured.info.stored & WIRE_STORED_CALIBRATION;
    card_.fit = fit_marks(card_.measured);
  }

  Card made() {
    find_dead();
    find_swapped();
    find_loose();
    solve();
    locate();
    find_tilt();
    find_thickness();
    weigh();
    look_at_rest();
    look_at_hold();
    look_at_pulls();
    return std::move(card_);
  }

private:
  void figure(const char *key, const char *says, const char *unit, double value, int digits) {
    card_.figures.push_back({key, says, unit, value, digits});
  }
  void finding(const char *code, std::vector<std::size_t> sensors, const std::string &text) {
    card_.findings.push_back({code, std::move(sensors), text});
  }
  std::size_t place_of(std::size_t k) const { return is_dead(k) ? k : card_.fit.sensors[k].place; }
  bool is_dead(std::size_t k) const { return dead_ >> k & 1u; }

  void find_dead() {
    std::vector<std::size_t> silent, numb;
    for (std::size_t k = 0; k < sensors_; k++) {
      if (card_.measured.answered[k] < ANSWERS_MIN) {
        silent.push_back(k);
      } else if (card_.fit.sensors[k].gain < FEELS_MIN) {
        numb.push_back(k);
      }
    }
    for (std::size_t k : silent) {
      dead_ |= 1u << k;
      finding("dead_sensor", {k},
              named({k}) + " answered in " + percent(card_.measured.answered[k]) +
                  " of the frames. See that its power and its wires reach it: fingertip doctor "
                  "names the line.");
    }
    for (std::size_t k : numb) {
      dead_ |= 1u << k;
      finding("dead_sensor", {k},
              named({k}) + " answers, but felt " + percent(card_.fit.sensors[k].gain) +
                  " of what the others feel. See that rubber fills the hole of its lid, and that it "
                  "is glued to nothing but the board; else replace it.");
    }
  }

  void find_swapped() {
    for (std::size_t k = 0; k < sensors_; k++) {
      const std::size_t other = place_of(k);
      if (other > k && place_of(other) == k) {
        finding("swapped_wires", {k, other},
                named({k, other}) + " answer from each other's place: each is found " +
                    fixed(card_.fit.sensors[k].off_mm, 1) + " and " + fixed(card_.fit.sensors[other].off_mm, 1) +
                    " mm from where the layout has it. Exchange their wires, and compare the "
                    "others with the board's table.");
      } else if (other != k && place_of(other) != k) {
        finding("swapped_wires", {k},
                named({k}) + " answers from the place of sensor " + std::to_string(other) +
                    ". Compare the wires with the board's table.");
      }
    }
  }

  /* A loose sensor pulls at the profile, at the places of the presses and so at its neighbours'
   * residuals. So the oddest are left out one after the other, as long as the rest then fits much
   * better. Those of them are loose that feel the same press differently each time. One that is odd
   * by the same each time lies elsewhere, or is wider. */
  void find_loose() {
    if (dead_ != 0) {
      card_.fit = fit_marks(card_.measured, dead_);
    }
    std::uint32_t without = dead_, tried = dead_;
    MarksFit rest = card_.fit;
    double residual = residual_of_rest(rest, tried);
    double odd = ODD_RESIDUAL;
    for (std::size_t turn = 0; turn < LOOSE_MAX && residual > odd; turn++) {
      odd = FITS_BETTER * ODD_RESIDUAL; /* where one is left out, little holds its neighbours */
      tried = without_oddest(rest, tried, &rest);
      const double before = residual;
      residual = residual_of_rest(rest, tried);
      if (before > FITS_BETTER * residual) {
        without = tried;
        card_.fit = rest;
      }
    }
    if (without == dead_) {
      without = without_followed();
    }
    std::vector<double> residuals;
    for (std::size_t k = 0; k < sensors_; k++) {
      if (!(without >> k & 1u)) {
        residuals.push_back(card_.fit.sensors[k].residual_share);
      }
    }
    const double usual_noise_Pa = card_.measured.empty ? median(card_.measured.empty->noise_Pa) : 0.0;
    for (std::size_t k = 0; k < sensors_; k++) {
      const double noise_Pa = card_.measured.empty ? card_.measured.empty->noise_Pa[k] : 0.0;
      std::string evidence;
      if (is_dead(k)) {
        continue;
      } else if (card_.measured.answered[k] < ANSWERS_STEADY) {
        evidence = "answered in " + percent(card_.measured.answered[k], 1) + " of the frames only";
      } else if ((without >> k & 1u) && card_.fit.sensors[k].scatter_share > LOOSE_SCATTER) {
        evidence = "feels the same press differently each time: its readings leave the profile that "
                   "the others teach by " +
                   percent(card_.fit.sensors[k].residual_share, 1) + " rms, the others by " +
                   percent(median(residuals), 1);
      } else if (usual_noise_Pa > 0.0 && noise_Pa > NOISY_OVER_MEDIAN * usual_noise_Pa) {
        evidence =
            "is noisy with nothing on the pad: " + fixed(noise_Pa, 1) + " Pa, the others " + fixed(usual_noise_Pa, 1);
      }
      if (!evidence.empty()) {
        loose_ |= 1u << k;
        finding("loose_sensor", {k},
                named({k}) + " " + evidence +
                    ". See that it is soldered and that the rubber holds it; a calibration cannot "
                    "mend it.");
      }
    }
  }

  /* One sensor more is left out, of those with the largest residuals: the one that leaves the
   * profile of the others by most, in units of how far these leave it. (A neighbour of a loose
   * sensor alone would not do: without it the rest may fit as well.) fit: before; *rest: after. */
  std::uint32_t without_oddest(const MarksFit &fit, std::uint32_t without, MarksFit *rest) const {
    std::vector<std::size_t> candidates;
    for (std::size_t k = 0; k < sensors_; k++) {
      if (!(without >> k & 1u)) {
        candidates.push_back(k);
      }
    }
    std::sort(candidates.begin(), candidates.end(), [&](std::size_t a, std::size_t b) {
      return fit.sensors[a].residual_share > fit.sensors[b].residual_share;
    });
    candidates.resize(std::min(candidates.size(), CANDIDATES));
    std::uint32_t best = without;
    MarksFit best_fit;
    double most = 0.0;
    for (std::size_t k : candidates) {
      MarksFit other = fit_marks(card_.measured, without | 1u << k);
      const double odd = other.sensors[k].residual_share / residual_of_rest(other, without | 1u << k);
      if (odd > most) {
        most = odd;
        best = without | 1u << k;
        best_fit = std::move(other);
      }
    }
    *rest = std::move(best_fit);
    return best;
  }

  /* One sensor more, which the presses follow; the same: there is none. */
  std::uint32_t without_followed() {
    std::uint32_t without = dead_;
    const MarksFit all = card_.fit;
    /* On thin rubber the neighbours feel too little of a press to say what a sensor should read. */
    const double pitches = card_.measured.array.pitch_mm / all.width_mm;
    if (std::exp(-0.5 * pitches * pitches) < FELT_SHARE) {
      return without;
    }
    double most = LOOSE_SCATTER;
    for (std::size_t k = 0; k < sensors_; k++) {
      if (is_dead(k) || all.sensors[k].felt > FELT_FEW) {
        continue;
      }
      MarksFit fit = fit_marks(card_.measured, dead_ | 1u << k);
      if (fit.sensors[k].scatter_share > most) {
        most = fit.sensors[k].scatter_share;
        without = dead_ | 1u << k;
        card_.fit = std::move(fit);
      }
    }
    return without;
  }

  double residual_of_rest(const MarksFit &fit, std::uint32_t without) const {
    double most = 0.0;
    for (std::size_t k = 0; k < sensors_; k++) {
      most = without >> k & 1u ? most : std::max(most, fit.sensors[k].residual_share);
    }
    return most;
  }

  /* Gains, width and dip, from the readings at the places where they belong. */
  void solve() {
    std::vector<Placement> placements;
    for (const Press &press : card_.measured.presses) {
      Placement placement = press.placement;
      std::vector<bool> taken(sensors_, false);
      placement.usable = 0;
      for (std::size_t k = 0; k < sensors_; k++) {
        const std::size_t place = place_of(k);
        const bool usable = press.placement.usable >> k & 1u;
        if (usable && !is_dead(k) && !(loose_ >> k & 1u) && !taken[place]) {
          taken[place] = true;
          placement.usable |= 1u << place;
          placement.reading_Pa[place] = press.placement.reading_Pa[k];
        }
      }
      placements.push_back(std::move(placement));
    }
    card_.judgement = calibrating::judge(card_.measured.array, placements, true);
    const calibrating::Solution &solution = card_.judgement.solution;
    card_.gain.assign(sensors_, 0.0);
    card_.gain_sd.assign(sensors_, 0.0);
    if (!solution.solved) {
      return;
    }
    std::vector<double> spread, sds, left;
    for (std::size_t k = 0; k < sensors_; k++) {
      const std::size_t place = place_of(k);
      if (is_dead(k) || (loose_ >> k & 1u)) {
        continue;
      }
      card_.gain[k] = solution.gain[place];
      card_.gain_sd[k] = solution.gain_sd[place];
      spread.push_back(std::log(card_.gain[k]));
      sds.push_back(card_.gain_sd[k]);
      if (card_.is_calibrated) {
        left.push_back(std::log(card_.gain[k] / static_cast<double>(card_.measured.info.calibration.sensors[k].gain)));
      }
    }
    figure("gain_spread_percent", "gains of the sensors differ by, sd", "%", 100.0 * sd_of(spread), 1);
    figure("gain_sd_percent", "each is known to, median sd", "%", 100.0 * median(sds), 1);
    if (card_.is_calibrated) {
      figure("gain_left_percent", "they differ from the stored calibration by, sd", "%", 100.0 * sd_of(left), 1);
    }
    if (const auto scale = calibrating::force_scale(card_.measured.array, placements, solution, weight_N(),
                                                    calibrating::shape_of(solution))) {
      scale_ = scale->scale;
    }
  }

  static double sd_of(const std::vector<double> &values) {
    double sum = 0.0, squares = 0.0;
    for (double value : values) {
      sum += value;
    }
    const double mean = values.empty() ? 0.0 : sum / double(values.size());
    for (double value : values) {
      squares += (value - mean) * (value - mean);
    }
    return values.size() < 2 ? 0.0 : std::sqrt(squares / double(values.size() - 1));
  }

  double weight_N() const { return calibrating::GRAVITY_N_PER_g * card_.measured.weight_g; }

  void locate() {
    std::vector<double> off, as_pressed, forces;
    std::vector<std::vector<std::size_t>> of_mark;
    std::size_t warned = 0;
    for (std::size_t i = 0; i < card_.measured.presses.size(); i++) {
      const Press &press = card_.measured.presses[i];
      const FoundPress &found = card_.fit.presses[i];
      Location location{-1.0, 0.0, 0.0};
      if (press.estimate.frames > 0) {
        location.x_mm = press.estimate.x_mm - found.x_mm;
        location.y_mm = press.estimate.y_mm - found.y_mm;
        const double square = location.x_mm * location.x_mm + location.y_mm * location.y_mm;
        location.off_mm = std::sqrt(std::max(square, 0.0));
        off.push_back(location.off_mm);
        as_pressed.push_back(std::hypot(press.estimate.x_mm - found.mark_x_mm, press.estimate.y_mm - found.mark_y_mm));
        forces.push_back(press.estimate.force_N / weight_N());
        warned += press.estimate.warned;
        of_mark.resize(std::max(of_mark.size(), press.mark + 1));
        of_mark[press.mark].push_back(i);
      }
      card_.locations.push_back(location);
    }
    if (off.empty()) {
      return;
    }
    double squares = 0.0, freedom = 0.0;
    for (const auto &presses : of_mark) {
      double x = 0.0, y = 0.0;
      for (std::size_t i : presses) {
        x += card_.locations[i].x_mm / double(presses.size());
        y += card_.locations[i].y_mm / double(presses.size());
      }
      for (std::size_t i : presses) {
        squares += std::pow(card_.locations[i].x_mm - x, 2) + std::pow(card_.locations[i].y_mm - y, 2);
        freedom += 2.0 * double(presses.size() - 1) / double(presses.size());
      }
    }
    figure("location_error_mm", "location off by, median", "mm", median(off), 2);
    figure("location_p90_mm", "one in ten is off by more than", "mm", quantile(off, 0.9), 2);
    figure("as_pressed_mm", "from the marks themselves, with the hand's error, median", "mm", median(as_pressed), 2);
    figure("hand_mm", "the hand missed the marks by, sd each way", "mm", card_.fit.hand_sd_mm, 2);
    figure("repeatability_mm", "the same place again differs by, sd each way", "mm",
           freedom > 0.0 ? std::sqrt(squares / freedom) : 0.0, 2);
    figure("warned_percent", "presses with a warning", "%", 100.0 * double(warned) / double(off.size()), 0);
    const double middle = median(forces);
    for (double &force : forces) {
      force = force / middle - 1.0;
    }
    force_over_weight_ = middle;
    figure("force_over_weight", "force reported over the weight, median", "", middle, 3);
    figure("force_scatter_percent", "force scatters by, sd", "%", 100.0 * sd_of(forces), 1);
  }

  void find_tilt() {
    const MarksFit &fit = card_.fit;
    const double slope = std::hypot(fit.slope_x, fit.slope_y);
    const double sd = std::hypot(fit.slope_x_sd, fit.slope_y_sd);
    figure("width_slope_percent", "width grows from the middle to an end by", "%", 100.0 * slope, 1);
    if (slope > TILT_MIN && slope > TILT_SDS * sd) {
      is_tilted_ = true;
      const bool is_x = std::abs(fit.slope_x) > std::abs(fit.slope_y);
      const double main = is_x ? fit.slope_x : fit.slope_y;
      finding("tilted_skin", {},
              "The skin is thicker towards " + std::string(main > 0.0 ? "+" : "-") + (is_x ? "x" : "y") +
                  ": its response is wider there by " + percent(slope) +
                  " than in the middle, and as much narrower at the other end. Level the mould and "
                  "cast it again, or clamp it evenly.");
    }
  }

  void find_thickness() {
    const calibrating::Solution &solution = card_.judgement.solution;
    if (!solution.solved) {
      return;
    }
    figure("sigma_mm", "width of the response, sigma", "mm", solution.sigma_mm, 2);
    figure("dip_percent", "dip around it, of the peak", "%", 100.0 * solution.dip_share, 1);
    const pad::Thickness thickness = pad::thickness_of(solution.sigma_mm, solution.sigma_sd_mm);
    figure("thickness_mm", "that of rubber so thick", "mm", thickness.mm, 1);
    if (thickness.mm < THIN_SHARE * card_.measured.skin_mm) {
      is_thin_ = true;
      finding("thin_skin", {},
              "The response is that of " + pad::text_of(thickness) + " of rubber, not of " +
                  fixed(card_.measured.skin_mm, 0) +
                  " mm. Measure the skin; on rubber as thin as that too few sensors feel a press "
                  "near the outer ones, so cast it thicker or set a prior (fingertip set prior=).");
    }
  }

  /* By the stored calibration, or by what a pad whose sensors feel what is on the base reads. */
  void weigh() {
    double ratio = force_over_weight_;
    if (!card_.is_calibrated || !(ratio > 0.0)) {
      if (!(scale_ > 0.0)) {
        return;
      }
      const Figure *thickness = card_.figure("thickness_mm");
      const double layer_mm =
          std::clamp(thickness ? thickness->value : card_.measured.skin_mm, static_cast<double>(PAD_THICKNESS_MIN_mm),
                     static_cast<double>(PAD_THICKNESS_MAX_mm));
      const pad_profile profile = pad::profile_of({layer_mm}, card_.measured.info);
      ratio = 1.0 / (scale_ * static_cast<double>(profile.force_ratio) * READS_OF_FORCE);
    }
    figure("weight_ratio", "force by the readings, over the weight that was stated", "", ratio, 2);
    /* A calibration of another skin says nothing of the weight, nor does the one width that is
     * fitted to a tilted skin: weights then read up to 1.24 times too heavy (seed 853). */
    const bool tells = card_.is_calibrated ? !is_thin_ : !is_tilted_;
    if (tells && std::abs(ratio - 1.0) > WEIGHT_OFF_MAX) {
      finding("wrong_weight", {},
              "The readings are those of " + fixed(ratio * card_.measured.weight_g, 0) + " g, not of " +
                  fixed(card_.measured.weight_g, 0) + ". Weigh the weight with its foot; if it is right, " +
                  (card_.is_calibrated ? "calibrate again, with --weight."
                                       : "the rubber passes on another share of the force, which "
                                         "fingertip calibrate --weight corrects."));
    }
  }

  void look_at_rest() {
    if (!card_.measured.empty) {
      return;
    }
    const Empty &empty = *card_.measured.empty;
    std::vector<double> noise_Pa, drift_Pa_min;
    for (std::size_t k = 0; k < sensors_; k++) {
      if (card_.measured.answered[k] >= ANSWERS_MIN) {
        noise_Pa.push_back(empty.noise_Pa[k]);
        drift_Pa_min.push_back(empty.drift_Pa_min[k]);
      }
    }
    const double all = median(drift_Pa_min);
    for (double &drift : drift_Pa_min) {
      drift -= all;
    }
    figure("noise_Pa", "noise of a reading, median of the sensors", "Pa", median(noise_Pa), 1);
    figure("noise_worst_Pa", "the noisiest", "Pa", largest(noise_Pa), 1);
    figure("drift_Pa_min", "a zero moves against the others by at most", "Pa/min", std::abs(largest(drift_Pa_min)), 1);
    figure("drift_all_Pa_min", "all together, as the weather does", "Pa/min", all, 1);
    std::vector<std::size_t> moving;
    double most = 0.0;
    for (std::size_t k = 0; k < sensors_; k++) {
      const double own = std::abs(empty.drift_Pa_min[k] - all);
      if (card_.measured.answered[k] >= ANSWERS_MIN && own > DRIFT_MAX_Pa_min) {
        moving.push_back(k);
        most = std::max(most, own);
      }
    }
    if (!moving.empty()) {
      const std::string who = moving.size() > 3 ? std::to_string(moving.size()) + " sensors" : named(moving);
      finding("drift", moving,
              who + ": their zeros move by up to " + fixed(most, 0) +
                  " Pa a minute with nothing on the pad. Let it warm up for ten minutes, away from "
                  "sun and draught; if it goes on, look for rubber that still cures or is clamped "
                  "too hard.");
    }
  }

  void look_at_hold() {
    if (!card_.measured.hold) {
      return;
    }
    const Hold &hold = *card_.measured.hold;
    double early = 0.0, late = 0.0, strongest = 0.0;
    for (std::size_t k = 0; k < sensors_; k++) {
      early += std::max(hold.early_Pa[k], 0.0);
      late += std::max(hold.late_Pa[k], 0.0);
      strongest = std::max(strongest, hold.early_Pa[k]);
    }
    figure("hold_loss_percent", "readings fade in the hold by", "%", 100.0 * (1.0 - late / early), 1);
    const char *const keys[] = {"after_1s_percent", "after_10s_percent", "after_25s_percent"};
    const char *const says[] = {"a sensor stands off 1 s after the release by at most, of what it felt",
                                "the same after 10 s", "the same after 25 s"};
    for (std::size_t a = 0; a < hold.after.size(); a++) {
      double most = 0.0;
      for (std::size_t k = 0; k < hold.after[a].left_Pa.size(); k++) {
        if (hold.early_Pa[k] > FELT_SHARE * strongest) {
          most = std::max(most, std::abs(hold.after[a].left_Pa[k]) / hold.early_Pa[k]);
        }
      }
      if (!hold.after[a].left_Pa.empty()) {
        figure(keys[a], says[a], "%", 100.0 * most, 1);
      }
    }
  }

  void look_at_pulls() {
    PullFigures pulls = pull_figures(card_.measured);
    card_.figures.insert(card_.figures.end(), pulls.figures.begin(), pulls.figures.end());
    card_.pull_note = std::move(pulls.note);
  }

  const std::size_t sensors_;
  Card card_;
  std::uint32_t dead_ = 0, loose_ = 0;
  bool is_thin_ = false, is_tilted_ = false;
  double scale_ = 0.0, force_over_weight_ = 0.0;
};

} // namespace

const Figure *Card::figure(const std::string &key) const {
  const auto at = std::find_if(figures.begin(), figures.end(), [&](const Figure &each) { return each.key == key; });
  return at == figures.end() ? nullptr : &*at;
}

Card assess(Measured measured, const std::string &name) {
  if (!(measured.weight_g > 0.0)) {
    throw Error(name + ": holds no validation; record one with `fingertip validate`");
  }
  std::vector<bool> pressed;
  std::size_t marks = 0;
  for (const Press &press : measured.presses) {
    pressed.resize(std::max(pressed.size(), press.mark + 1), false);
    marks += !pressed[press.mark];
    pressed[press.mark] = true;
  }
  if (marks < MARKS_MIN) {
    throw Error(name + ": holds presses at " + std::to_string(marks) + " marks, and a card needs " +
                std::to_string(MARKS_MIN) + "; record a whole validation");
  }
  return Assessor(std::move(measured)).made();
}

} // namespace fingertip::validating
