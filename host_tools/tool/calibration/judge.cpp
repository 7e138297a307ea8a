#include "tool/calibration/judge.hpp"

#include "libfingertip/text.hpp"

extern "C" {
#include "common/contact_flags.h"
#include "fit/fit.h"
#include "fit/fit_limits.h"
}

#include <algorithm>
#include <cmath>
#include <numeric>

namespace fingertip::calibrating {
namespace {

/* Placements within this of their middle, in pitches (rms), are a cluster. */
constexpr double CLUSTER_PITCHES = 0.6;
/* An array none of whose placements lie in an end third of it lacks that end. */
constexpr double END_SHARE = 1.0 / 3.0;
/* What one scale leaves between round and flat objects, 1 to 15 N, and of the firmware's fit
 * (report truth, part calibration, table "force"). */
constexpr double FORCE_MODEL_SD = 0.01;
/* How far the force of a tap is off, over what the readings lose from 0.5 to 1 s, on the twin's
 * pads that relax by 9 to 26 % in 8 s (truth.py --parts calibration --seed 500, "relaxing"). */
constexpr double FADED_BEFORE = 2.7;
/* Contacts add to sigma^2, each its own spread; sd of that, about the calibration's foot. */
constexpr double CONTACTS_SD_mm2 = 0.6;
/* A sensor has load if it should read as much as this share of the peak. */
constexpr double LOADED_SHARE = 0.1;
/* Sd of readings where a part is kept: on the twin's pads of 6 mm, as uneven as real ones, 0.2 % of the presses are
 * off by 1 mm without a warning with Assumptions::gain, none with this (20 placements, seed 7000). */
constexpr double PART_SD = 0.3;
/* With a dip that helps: 0.21 at most, of the twin's pads of 6 mm that have one (seed 7000), and 0.07 of the real pad that chooses. */
constexpr double ASTRAY_PITCHES = 0.25;
/* Evidence refuses a session from EVIDENCE_SURE placements on. From EVIDENCE_MIN on it does so if it
 * is EVIDENCE_CLEAR times its bound; otherwise it only keeps a session from being good. */
constexpr std::size_t EVIDENCE_SURE = 24, EVIDENCE_MIN = 8;
constexpr double EVIDENCE_CLEAR = 3.0;
/* The halves' difference at a sensor: its largest sd, and how many of its sds are chance. */
constexpr double HALVES_SD_MAX = 0.025, HALVES_SDS = 2.0;
/* Halves that disagree may agree until there is this number of placements. */
constexpr std::size_t HALVES_SURE = 40;

double rms(const std::vector<double> &values) {
  double sum = 0.0;
  for (double value : values) {
    sum += value * value;
  }
  return values.empty() ? 0.0 : std::sqrt(sum / double(values.size()));
}

double rms_about_mean(std::vector<double> values) {
  const double mean = std::accumulate(values.begin(), values.end(), 0.0) / double(values.size());
  std::for_each(values.begin(), values.end(), [mean](double &value) { value -= mean; });
  return rms(values);
}

/* Beyond what their uncertainty makes. */
double rms_beyond(const std::vector<double> &values, const std::vector<double> &sds) {
  const double all = rms(values), chance = rms(sds);
  return std::sqrt(std::max(all * all - chance * chance, 0.0));
}

/* Rms of e about its mean, of placements within the array: beyond it a force is extrapolated, and rubber that ends near gives way. */
double force_share(const Array &array, const Solution &solution) {
  const auto [left, right] = std::minmax_element(array.x_mm.begin(), array.x_mm.end());
  const auto [bottom, top] = std::minmax_element(array.y_mm.begin(), array.y_mm.end());
  std::vector<double> forces;
  for (const Fitted &fitted : solution.placements) {
    if (fitted.kept && fitted.x_mm >= *left && fitted.x_mm <= *right && fitted.y_mm >= *bottom && fitted.y_mm <= *top) {
      forces.push_back(fitted.force);
    }
  }
  return rms_about_mean(forces);
}

/* What zeros move between the rest and the readings of a placement, rms over the sensors: by the line through the rests of all. */
double drift_Pa(const std::vector<Placement> &placements, std::size_t sensors) {
  std::vector<double> drifts_Pa;
  for (std::size_t k = 0; k < sensors; k++) {
    double count = 0.0, t = 0.0, p = 0.0, tt = 0.0, tp = 0.0;
    for (const Placement &placement : placements) {
      if (placement.usable >> k & 1u && !placement.rest_Pa.empty()) {
        const double t_s = placement.t_s - placements[0].t_s, rest_Pa = placement.rest_Pa[k];
        count += 1.0;
        t += t_s;
        p += rest_Pa;
        tt += t_s * t_s;
        tp += t_s * rest_Pa;
      }
    }
    if (count * tt > t * t) {
      drifts_Pa.push_back(RESTED_BEFORE_s * (count * tp - t * p) / (count * tt - t * t));
    }
  }
  return rms(drifts_Pa);
}

/* Rms of the log gains, beyond what their sds make. */
double spread_of(const Solution &solution) {
  std::vector<double> logs;
  for (double gain : solution.gain) {
    logs.push_back(std::log(gain));
  }
  return rms_beyond(logs, solution.gain_sd);
}

std::string percent(double share) { return fixed(100.0 * share, 1) + " %"; }

std::string list_of(const std::vector<std::size_t> &sensors) {
  return joined(sensors, " ", [](std::size_t k) { return std::to_string(k); });
}

std::string too_little_load(const std::vector<std::size_t> &sensors) {
  return sensors.empty() ? "" : ", so sensors " + list_of(sensors) + " had too little load";
}

/* Whether the sensor had a load in any placement, by its own readings. */
bool is_loaded(const std::vector<Placement> &placements, const Solution &solution, std::size_t k) {
  return std::any_of(placements.begin(), placements.end(), [&](const Placement &placement) {
    return placement.reading_Pa[k] > LOADED_SHARE * solution.peak_Pa || !(placement.usable >> k & 1u);
  });
}

/* Whether a sensor that is not loaded measures nothing where the other sensors locate placements. */
bool measures_nothing(const Array &array, const std::vector<Placement> &placements, std::size_t k) {
  std::vector<Placement> without = placements;
  for (Placement &placement : without) {
    placement.usable &= ~sensor_bit(static_cast<unsigned>(k));
  }
  const Solution others = solve(array, without);
  double measured = 0.0, expected = 0.0;
  for (std::size_t i = 0; others.solved && i < placements.size(); i++) {
    const Fitted &at = others.placements[i];
    if (!at.kept || !(placements[i].usable >> k & 1u)) {
      continue;
    }
    const double widths = std::hypot(array.x_mm[k] - at.x_mm, array.y_mm[k] - at.y_mm) / others.sigma_mm;
    const double usual_Pa = others.peak_Pa * std::exp(-0.5 * widths * widths);
    measured += placements[i].reading_Pa[k] * usual_Pa;
    expected += usual_Pa * usual_Pa;
  }
  return expected > LOADED_SHARE * others.peak_Pa * LOADED_SHARE * others.peak_Pa && measured < MEASURED_MIN * expected;
}

/* What it has of the pad, with readings as uncertain as unknown gains make them. */
Solution in_part(Solution solution, bool gains) {
  solution.gain_sd.assign(solution.gain.size(), Assumptions{}.gain);
  solution.reading_sd.assign(solution.gain.size(), PART_SD);
  if (!gains) {
    solution.gain.assign(solution.gain.size(), 1.0);
    for (std::vector<double> *each : {&solution.dx_mm, &solution.dy_mm, &solution.own_width}) {
      each->assign(each->size(), 0.0);
    }
  }
  return solution;
}

/* Differences of the gains of odd and even placements beyond their uncertainty, and what of either brings the forces that the firmware's
 * fit has of the other nearest to each other: all are of one weight, which is the only truth in a session. */
void compare_halves(const Array &array, const std::vector<Placement> &placements, const Solution &solution, Judgement &judgement) {
  std::vector<Placement> halves[2];
  Solution from[2] = {solution, solution};
  from[0].placements.clear();
  from[1].placements.clear();
  std::size_t turn = 0;
  for (std::size_t i = 0; i < placements.size(); i++) {
    if (solution.placements[i].kept) {
      halves[turn % 2].push_back(placements[i]);
      from[turn % 2].placements.push_back(solution.placements[i]);
      turn++;
    }
  }
  const Solution odd = solve_from(array, halves[0], from[0]);
  const Solution even = solve_from(array, halves[1], from[1]);
  if (!odd.solved || !even.solved) {
    return;
  }
  std::vector<double> ratio;
  for (std::size_t k = 0; k < array.sensors(); k++) {
    ratio.push_back(odd.gain[k] / even.gain[k]);
  }
  const std::vector<double> shape = outside_gauge(array, ratio);
  double squares = 0.0;
  for (std::size_t k = 0; k < array.sensors(); k++) {
    const double within = std::log(ratio[k]) - shape[k];
    squares += within * within / double(array.sensors());
    const double sd = std::hypot(odd.shape_sd[k], even.shape_sd[k]);
    if (sd <= HALVES_SD_MAX) {
      judgement.halves_shape = std::max(judgement.halves_shape, std::abs(shape[k]) - HALVES_SDS * sd);
    }
  }
  const double gauge_sd = std::hypot(odd.gauge_sd, even.gauge_sd);
  judgement.halves_gauge = std::max(std::sqrt(squares) - HALVES_SDS * gauge_sd, 0.0);
  const std::vector<double> ones(array.sensors(), 1.0);
  double least = 1.0;
  for (const bool gains : {true, false}) {
    double by = 1.0;
    for (int half : {0, 1}) {
      Solution part = in_part(half == 0 ? even : odd, gains);
      part.dip_share = solution.dip_share > 0.0 ? part.dip_share : 0.0;
      by *= scatter(array, halves[half], from[half], part.gain, shape_of(part)).force_mean /
            scatter(array, halves[half], from[half], ones, {}).force_mean;
    }
    if (by < least) {
      least = by;
      judgement.helps = true;
      judgement.gains_help = gains;
    }
  }
}

/* What the placements lack where gains are not known: by where they are. Where they are not all
 * over the pad the dip is mistaken for gains. */
Reason lacking(const Array &array, const std::vector<Placement> &placements, const Solution &solution, bool unloaded) {
  if (placements.size() < PLACEMENTS_WANTED || !solution.solved) {
    return Reason::too_few;
  }
  std::vector<double> x_mm, y_mm;
  for (const Fitted &fitted : solution.placements) {
    if (fitted.kept) {
      x_mm.push_back(fitted.x_mm);
      y_mm.push_back(fitted.y_mm);
    }
  }
  if (std::hypot(rms_about_mean(x_mm), rms_about_mean(y_mm)) < CLUSTER_PITCHES * array.pitch_mm) {
    return Reason::cluster;
  }
  const auto lacks_an_end = [](const std::vector<double> &places, const std::vector<double> &sensors) {
    const auto [least, most] = std::minmax_element(places.begin(), places.end());
    const auto [first, last] = std::minmax_element(sensors.begin(), sensors.end());
    const double end = END_SHARE * (*last - *first);
    return std::min(*least, *last) > *first + end || std::max(*most, *first) < *last - end; /* not across sensors in one line */
  };
  if (unloaded || lacks_an_end(x_mm, array.x_mm) || lacks_an_end(y_mm, array.y_mm)) {
    return Reason::one_end;
  }
  return placements.size() < PLACEMENTS_ENOUGH ? Reason::too_few : Reason::unsure;
}

std::string text_of(const Judgement &j, std::size_t placements) {
  const Solution &s = j.solution;
  switch (j.reason) {
  case Reason::none: return "good: every gain is known to " + percent(s.worst_shape_sd());
  case Reason::too_few:
    if (placements == 0) {
      return "no placement was found: set a weight of about 3 N on a round foot down, let it rest by itself for a "
             "second, and lift it";
    }
    return "too few placements (" + std::to_string(placements) + "): place the weight at more places all over the pad";
  case Reason::cluster: return "all placements are near one place" + too_little_load(j.unsure) + ": place the weight all over the pad";
  case Reason::one_end: return "part of the pad has no placements" + too_little_load(j.unsure) + ": place the weight there too";
  case Reason::unsure:
    return "the gains of sensors " + list_of(j.unsure) + " are only known to " + percent(s.worst_shape_sd()) +
           ": place the weight near them; on thin rubber too few sensors measure a placement";
  case Reason::weights:
    return "the force differed by " + percent(j.force_share) + " between placements: use one and the same weight, resting freely";
  case Reason::elongated:
    return "the contact is not round (its axes differ by " + percent(2.0 * j.ellipse) + "): use a weight with a round foot, as a ball";
  case Reason::offsets:
    return "the zeros of the sensors were off by " + percent(j.offset_share) +
           " of the peak: see that nothing touches the pad, tare, and begin again";
  case Reason::drift:
    return "the zeros of the sensors move by " + percent(j.drift_share) +
           " of the peak in the second of a placement: let the fingertip warm up, and begin again";
  case Reason::slope:
    return "the weight pulls along the pad with " + percent(j.slope) + " of itself, more than is corrected: level the pad";
  case Reason::stray:
    return "only " + percent(j.kept_share) + " of the placements fit each other: let the same weight rest freely each time";
  case Reason::residual:
    return "the readings are " + percent(s.residual_share) +
           " of the peak off that of one round foot: use one, and see that the pad is whole";
  case Reason::halves:
    return "every other placement gives other gains, by " + percent(std::max(j.halves_shape, j.halves_gauge)) +
           ": something changed meanwhile; begin again";
  case Reason::useless:
    return "the gains from half of the placements make the other half no better than the pad's width and dip do: "
           "the sensors are alike, or something changed meanwhile";
  case Reason::layout:
    return "the sensors seem to sit " + fixed(s.spread.position_mm, 2) +
           " mm from where the firmware has them: see the pad that it was built for";
  case Reason::silent:
    return "sensors " + list_of(j.silent) +
           " measured nothing under the weight, or gave no valid reading: see fingertip info; one that answers is not "
           "covered by the rubber, or broken";
  }
  return "";
}

/* What speaks most against the session, and how many times its bound it is. */
struct Evidence {
  Reason reason = Reason::none;
  double times = 0.0;
};
Evidence against(const Judgement &j) {
  const Solution &s = j.solution;
  const Evidence all[] = {{Reason::elongated, j.ellipse / ELLIPSE_MAX},
                          {Reason::weights, j.force_share / FORCE_SPREAD_MAX},
                          {Reason::offsets, j.offset_share / OFFSET_MAX},
                          {Reason::drift, j.drift_share / DRIFT_MAX},
                          {Reason::slope, j.slope / SLOPE_MAX},
                          {Reason::stray, (1.0 - j.kept_share) / (1.0 - KEPT_MIN)},
                          {Reason::layout, s.spread.position_mm / POSITION_MAX_mm},
                          {Reason::residual, s.residual_share / RESIDUAL_MAX}};
  return *std::max_element(std::begin(all), std::end(all), [](const Evidence &a, const Evidence &b) { return a.times < b.times; });
}

/* The firmware's fit to a placement. */
struct FirmwareFit {
  FirmwareFit(const Array &array, const Shape &shape) : deviations(deviations_of(array, shape)) {
    std::vector<float> x, y;
    for (std::size_t k = 0; k < array.sensors(); k++) {
      x.push_back(static_cast<float>(array.x_mm[k]));
      y.push_back(static_cast<float>(array.y_mm[k]));
    }
    usable_array =
        fit_array_init(&of, static_cast<std::uint8_t>(array.sensors()), x.data(), y.data(), static_cast<float>(array.pitch_mm)) == FT_OK;
    settings.iterations = ITERATIONS;
    settings.noise_Pa_q10 = NOISE_Pa_Q10;
    settings.clip_below_sds = CLIP_BELOW_SDS;
    settings.prior_sigma_mm = static_cast<float>(shape.sigma_mm);
    settings.prior_width_mm = static_cast<float>(shape.sigma_sd_mm);
    settings.dip_share = static_cast<float>(shape.dip_share);
    settings.dip_sd_mm = static_cast<float>(shape.dip_sd_mm);
    settings.deviations = deviations.empty() ? nullptr : deviations.data();
  }
  std::optional<fit_result> operator()(const Placement &placement, const std::vector<double> &gain) {
    std::int32_t pressure[FT_MAX_SENSORS] = {};
    for (std::size_t k = 0; k < placement.reading_Pa.size(); k++) {
      pressure[k] = static_cast<std::int32_t>(std::lround(std::clamp(placement.reading_Pa[k] / gain[k], -1e6, 1e6) * 1024.0));
    }
    fit_result result{};
    if (usable_array) {
      fit_gaussian(&of, pressure, placement.usable, &settings, &result);
    }
    if (!(result.flags & CONTACT_FLAG_FIT_VALID)) {
      return std::nullopt;
    }
    return result;
  }
  /* The firmware's own settings (config/defaults.h), without a pad profile; a mean of many frames has hardly any noise. */
  static constexpr std::uint8_t ITERATIONS = 4, CLIP_BELOW_SDS = 4;
  static constexpr std::int32_t NOISE_Pa_Q10 = 1024;
  std::vector<fit_deviation> deviations;
  fit_array of{};
  fit_settings settings{};
  bool usable_array = false;
};

/* Whether the firmware's fit, if it knows of the dip, locates the placements (rms), or a press that is as the solution has it anywhere on
 * the array, ASTRAY_PITCHES off: where few sensors measure a press, a dip makes a second solution. */
bool goes_astray(const Array &array, const std::vector<Placement> &placements, const Solution &s) {
  constexpr double STEPS = 4.0; /* of a pitch */
  const Shape shape{s.sigma_mm, shape_of(s).sigma_sd_mm, s.dip_share, s.dip_sd_mm};
  if (scatter(array, placements, s, s.gain, shape).location_rms_mm > ASTRAY_PITCHES * array.pitch_mm) {
    return true;
  }
  FirmwareFit fit(array, shape);
  const auto [left, right] = std::minmax_element(array.x_mm.begin(), array.x_mm.end());
  const auto [bottom, top] = std::minmax_element(array.y_mm.begin(), array.y_mm.end());
  const std::vector<double> ones(array.sensors(), 1.0);
  const bool ends = fit_jacobian_needs_dip(&fit.of, &fit.settings);
  for (double x = *left; x <= *right; x += array.pitch_mm / STEPS) {
    for (double y = *bottom; y <= *top; y += array.pitch_mm / STEPS) {
      Placement press;
      press.usable = first_sensors(static_cast<unsigned>(array.sensors()));
      for (std::size_t k = 0; k < array.sensors(); k++) {
        const double per = std::pow(std::hypot(array.x_mm[k] - x, array.y_mm[k] - y) / s.width_mm, 2) / 2.0;
        const double there =
            ends ? fit_dip_share(&fit.of, float(x / array.pitch_mm), float(y / array.pitch_mm), fit.of.x[k], fit.of.y[k]) : 1.0F;
        press.reading_Pa.push_back(s.peak_Pa * ((1.0 - s.mixing) * std::exp(-per) + s.mixing * std::exp(-per / (NARROW * NARROW)) -
                                                there * s.dip * std::exp(-per / (s.dip_widths * s.dip_widths))));
      }
      const auto found = fit(press, ones);
      if (!found || std::hypot(double(found->x_mm) - x, double(found->y_mm) - y) > ASTRAY_PITCHES * array.pitch_mm) {
        return true;
      }
    }
  }
  return false;
}

} // namespace

const char *name_of(Reason reason) {
  static const char *const names[] = {"none",  "too_few", "cluster", "one_end",  "unsure", "weights", "elongated", "offsets",
                                      "drift", "slope",   "stray",   "residual", "halves", "useless", "layout",    "silent"};
  return names[static_cast<int>(reason)];
}

Judgement judge(const Array &array, std::vector<Placement> placements, bool last) {
  set_earlier(placements);
  Judgement j;
  j.solution = solve(array, placements);
  const Solution &s = j.solution;
  if (s.solved && goes_astray(array, placements, s)) {
    j.solution.dip_share = j.solution.dip_sd_mm = 0.0;
  }
  j.kept = s;

  const bool thin = s.solved && s.sigma_mm < THIN_PITCHES * array.pitch_mm;
  const double helps = s.solved ? HELPS_SHARE * spread_of(s) : 0.0;
  const bool enough = placements.size() >= PLACEMENTS_ENOUGH;
  j.wanted_sd = enough ? std::max(SHAPE_SD_WANTED, helps) : SHAPE_SD_WANTED;
  const double wanted_gauge_sd = enough ? std::max(GAUGE_SD_WANTED, helps) : GAUGE_SD_WANTED;
  sensor_map seen = 0;
  for (const Placement &placement : placements) {
    seen |= placement.usable;
  }
  std::vector<std::size_t> unloaded;
  for (std::size_t k = 0; k < array.sensors(); k++) {
    if (!s.solved || thin || s.shape_sd[k] > j.wanted_sd) {
      j.unsure.push_back(k);
    }
    const bool no_load = s.solved && !is_loaded(placements, s, k);
    if (no_load) {
      unloaded.push_back(k);
    }
    if (!(seen >> k & 1u) || (no_load && placements.size() >= EVIDENCE_MIN && measures_nothing(array, placements, k))) {
      j.silent.push_back(k);
    }
  }
  j.unsure = unloaded.empty() ? j.unsure : unloaded;
  if (s.solved) {
    const double of_all = rms_beyond({std::begin(s.ellipse_of_all), std::end(s.ellipse_of_all)},
                                     {std::begin(s.ellipse_of_all_sd), std::end(s.ellipse_of_all_sd)});
    j.ellipse = std::hypot(of_all, s.spread.ellipse);
    j.force_share = force_share(array, s);
    j.kept_share = double(s.kept) / double(placements.size());
    j.offset_share = rms_beyond(s.offset_Pa, s.offset_sd_Pa) / s.peak_Pa;
    j.slope = std::hypot(s.pull[0], s.pull[1]);
    j.drift_share = drift_Pa(placements, array.sensors()) / s.peak_Pa;
  }
  last = last || placements.size() >= PLACEMENTS_MAX;
  const Evidence evidence = s.solved ? against(j) : Evidence{};
  const bool speaks = evidence.times > 1.0 && (last || placements.size() >= EVIDENCE_SURE || evidence.times > EVIDENCE_CLEAR);
  if (placements.size() >= EVIDENCE_MIN && (speaks || !j.silent.empty())) {
    j.state = Judgement::State::refused;
    j.reason = j.silent.empty() ? evidence.reason : Reason::silent;
    j.text = text_of(j, placements.size());
    return j;
  }
  const Reason lacks = lacking(array, placements, s, !unloaded.empty());
  const bool all_over = s.solved && lacks != Reason::cluster && lacks != Reason::one_end;
  const bool known = all_over && placements.size() >= PLACEMENTS_WANTED && j.unsure.empty() && s.gauge_sd <= wanted_gauge_sd;
  if (evidence.times <= 1.0 && (known || (all_over && enough))) {
    compare_halves(array, placements, s, j);
  }
  const bool agree = j.halves_shape <= HALVES_SHAPE_MAX && j.halves_gauge <= HALVES_GAUGE_MAX;
  j.reason = !known                       ? lacks
             : evidence.times > 1.0       ? evidence.reason
             : !agree                     ? Reason::halves
             : !(j.helps && j.gains_help) ? Reason::useless
                                          : Reason::none;
  j.text = text_of(j, placements.size());
  /* More placements would hardly change this. */
  const bool ends = last || (thin && j.gains_help) || ((known || thin) && placements.size() >= HALVES_SURE);
  if (j.reason == Reason::none) {
    j.state = Judgement::State::good;
  } else if (ends && enough && j.helps && agree) {
    j.state = Judgement::State::good;
    j.text = (j.gains_help ? "good as far as it goes: " : "good for the pad's width and dip alone: ") + j.text;
    j.kept = in_part(s, j.gains_help);
  } else if (ends) {
    j.state = Judgement::State::refused;
  }
  return j;
}

Shape shape_of(const Solution &solution) {
  Shape shape{solution.sigma_mm, std::hypot(solution.sigma_sd_mm, CONTACTS_SD_mm2 / (2.0 * solution.sigma_mm)), solution.dip_share,
              solution.dip_sd_mm};
  for (std::size_t k = 0; k < solution.own_width.size(); k++) {
    shape.deviations.push_back({solution.dx_mm[k], solution.dy_mm[k], solution.own_width[k]});
  }
  return shape;
}

Shape without_width(Shape shape) {
  shape.sigma_mm = shape.sigma_sd_mm = 0.0;
  return shape;
}

std::vector<fit_deviation> deviations_of(const Array &array, const Shape &shape) {
  const auto q15 = [](double value) { return static_cast<std::int32_t>(std::lround(std::clamp(32768.0 * value, -32767.0, 32767.0))); };
  std::vector<fit_deviation> made;
  for (const Deviation &each : shape.deviations) {
    made.push_back({q15(each.off_x_mm / array.pitch_mm), q15(each.off_y_mm / array.pitch_mm), q15(each.wider)});
  }
  return made;
}

std::optional<ForceScale> force_scale(const Array &array, const std::vector<Placement> &placements, const Solution &solution,
                                      double force_N, const Shape &shape) {
  FirmwareFit fit(array, shape);
  std::vector<double> forces, fadings;
  for (std::size_t i = 0; i < placements.size(); i++) {
    const auto fitted = solution.placements[i].kept ? fit(placements[i], solution.gain) : std::nullopt;
    if (fitted) {
      forces.push_back(static_cast<double>(fitted->force_N));
      fadings.push_back(placements[i].fading);
    }
  }
  if (forces.size() < PLACEMENTS_MIN) {
    return std::nullopt;
  }
  const double middle = median(forces);
  std::vector<double> off;
  for (double force : forces) {
    off.push_back(std::abs(force / middle - 1.0));
  }
  /* The sd of a median is 1.2533 of a mean's; a normal spread is 1.4826 of the median deviation. */
  const double by_chance = 1.2533 * 1.4826 * median(off) / std::sqrt(double(off.size()));
  const double faded = FADED_BEFORE * median(fadings);
  return ForceScale{force_N / middle, force_N / middle * std::hypot(by_chance, FORCE_MODEL_SD, faded)};
}

Scatter scatter(const Array &array, const std::vector<Placement> &placements, const Solution &solution, const std::vector<double> &gain,
                const Shape &shape) {
  FirmwareFit fit(array, shape);
  std::vector<double> dx_mm, dy_mm, distances, forces;
  for (std::size_t i = 0; i < placements.size(); i++) {
    const auto fitted = solution.placements[i].kept ? fit(placements[i], gain) : std::nullopt;
    if (fitted) {
      dx_mm.push_back(static_cast<double>(fitted->x_mm) - solution.placements[i].x_mm);
      dy_mm.push_back(static_cast<double>(fitted->y_mm) - solution.placements[i].y_mm);
      forces.push_back(static_cast<double>(fitted->force_N));
    }
  }
  if (forces.empty()) {
    return {};
  }
  /* A slope moves all of them. */
  const double all_x_mm = median(dx_mm), all_y_mm = median(dy_mm);
  for (std::size_t i = 0; i < dx_mm.size(); i++) {
    distances.push_back(std::hypot(dx_mm[i] - all_x_mm, dy_mm[i] - all_y_mm));
  }
  const double force = median(forces);
  double sum = 0.0;
  for (double &each : forces) {
    sum += std::abs(std::log(each / force));
    each = std::abs(each / force - 1.0);
  }
  return {median(distances), rms(distances), median(forces), sum / double(forces.size())};
}

} // namespace fingertip::calibrating
