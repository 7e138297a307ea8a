// truth_fit: how well the fit's numbers say how far they are from the truth.
//
// Touches of the twin's objects on pads (touches.hpp) go through the firmware's fit_gaussian_grid
// with the settings that the firmware starts with; those that pull along the rubber also through
// its look for a load that is not estimated (fit_doubt.h). One JSON object on the standard output:
// the keys that are judged, and under "cases", "loaded", "elongated", "iterations" and
// "few_sensors" the tables behind them. The constants of fit_limits.h and defaults.h were chosen
// with --seed 1.
#include "libfingertip/in_parallel.hpp"
#include "report/reference/options.hpp"
#include "shear/static/pulled.hpp"
#include "truth/fit/statistics.hpp"
#include "truth/fit/touches.hpp"

extern "C" {
#include "common/contact_flags.h"
#include "config/defaults.h"
#include "fit/fit_doubt.h"
#include "fit/fit_gains.h"
}

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using namespace fingertip;
using namespace fingertip::truth;
using nlohmann::ordered_json;

constexpr char HELP[] = "usage: truth_fit [--seed S] [--pads N] [--cache DIR]\n"
                        "  --seed S     of pads and touches, 20221015 by default\n"
                        "  --pads N     pads of each case, 1500 by default\n"
                        "  --cache DIR  folder of the contact tables\n";

constexpr int TOUCHES = 50; // of each pad
constexpr int TAUGHT = 20;  // touches of a pad that was never calibrated, before those
constexpr double BAD_mm = 1.0;
constexpr std::uint32_t WARNINGS =
    CONTACT_FLAG_UNCERTAIN | CONTACT_FLAG_MODEL | CONTACT_FLAG_FLAT | CONTACT_FLAG_AT_BOUND | CONTACT_FLAG_LOW_SIGNAL;
// Rounded feet, a flat cylinder and a cube, and everyday objects; all of them round or nearly so.
constexpr const char *OBJECTS[] = {"sphere6", "sphere15", "cylinder6", "cube6", "ping_pong", "rubber_duck", "lime"};

struct Options {
  std::string cache = FINGERTIP_TABLES_DIR;
  std::uint64_t seed = 20221015, pads = 1500;
};

// What a case draws. A contact is drawn for each touch, a pad for TOUCHES of them.
struct Case {
  std::string name;
  std::vector<Contact> contacts;
  std::function<Pad(Random &, std::size_t pad)> pad;
  bool gaussian = false; // the model has no error of its own
  double angle_rad = NAN;
  int iterations = DEFAULT_FIT_ITERATIONS;
  std::size_t sensors = SENSORS; // in use, chosen for each touch
  // What presses instead of contacts, and pulls along the rubber: by a share of its force from the
  // first to the second, in any direction, under a force that stays.
  std::vector<const shear::Object *> pulled = {};
  double load_least = 0.0, load_most = 0.0;
  int taught = 0; // touches before, from which the firmware learns how far the gains are apart
};

struct Judged {
  double error_mm, force_N;
  fit_result fit;
};

class Results {
public:
  explicit Results(std::vector<Judged> judged) : judged_(std::move(judged)) {}

  template <typename Predicate> double share(const Predicate &predicate) const {
    return percent(static_cast<double>(std::count_if(judged_.begin(), judged_.end(), predicate)),
                   static_cast<double>(judged_.size()));
  }
  double error_mm(double at) const {
    std::vector<double> errors;
    for (const Judged &j : judged_) {
      errors.push_back(j.error_mm);
    }
    return quantile(errors, at);
  }
  // Share of the errors within so many predicted standard deviations.
  double covered(double sds) const {
    return share([=](const Judged &j) { return j.error_mm <= sds * static_cast<double>(j.fit.location_sd_mm); });
  }
  // Of the force, once the scale that all touches have in common is taken out.
  double force_covered(double sds) const {
    const double scale = force_scale();
    return share([=](const Judged &j) {
      return std::abs(scale * static_cast<double>(j.fit.force_N) - j.force_N) <=
             sds * scale * static_cast<double>(j.fit.force_sd_N);
    });
  }
  double force_scale() const {
    std::vector<double> scales;
    for (const Judged &j : judged_) {
      scales.push_back(j.force_N / static_cast<double>(j.fit.force_N));
    }
    return quantile(scales, 0.5);
  }
  double flagged(std::uint32_t flags) const {
    return share([=](const Judged &j) { return (j.fit.flags & flags) != 0; });
  }
  double bad_without(std::uint32_t flags, double bad_mm = BAD_mm) const {
    return share([=](const Judged &j) { return j.error_mm > bad_mm && !(j.fit.flags & flags); });
  }
  ordered_json row(const std::string &name) const {
    return {{"case", name},
            {"touches", judged_.size()},
            {"error_p50_mm", error_mm(0.5)},
            {"error_p95_mm", error_mm(0.95)},
            {"cover_1sd", covered(1.0)},
            {"cover_2sd", covered(2.0)},
            {"warned", flagged(WARNINGS)},
            {"elongated", flagged(CONTACT_FLAG_ELONGATED)},
            {"bad", share([](const Judged &j) { return j.error_mm > BAD_mm; })},
            {"bad_unflagged", bad_without(WARNINGS)},
            {"force_scale", force_scale()},
            {"force_cover_1sd", force_covered(1.0)},
            {"force_cover_2sd", force_covered(2.0)}};
  }

private:
  std::vector<Judged> judged_;
};

constexpr double FRICTION = 0.5; // at which all of the contact slides

Contact pulled_by(const shear::Object &object, double force_N, double ratio, Random &random) {
  const double direction = random.uniform(0.0, 2.0 * M_PI), load_N = ratio * force_N;
  const twin::TractionTable::Load load{force_N, twin::stuck_force_N(force_N, load_N, FRICTION),
                                       load_N * std::cos(direction), load_N * std::sin(direction)};
  return {object.name, [&object, load](double normal_N, double dx_mm, double dy_mm) {
            return object.pressure.base_pressure_Pa(normal_N, dx_mm, dy_mm) +
                   object.traction.base_pressure_Pa(load, dx_mm, dy_mm);
          }};
}

struct Felt {
  Touch touch;
  Contact contact;
  double noise_Pa;
};

Felt draw(const Case &c, const fit_array &array, Random &random) {
  Felt felt{draw_touch(array, random), {}, 0.0};
  if (!std::isnan(c.angle_rad)) {
    felt.touch.angle_rad = c.angle_rad;
  }
  if (c.pulled.empty()) {
    felt.contact = c.contacts[random.next() % c.contacts.size()];
  } else {
    const shear::Object &object = *c.pulled[random.next() % c.pulled.size()];
    felt.contact = pulled_by(object, felt.touch.force_N, random.uniform(c.load_least, c.load_most), random);
  }
  felt.noise_Pa = draw_noise_Pa(random);
  return felt;
}

// The pad as the firmware has it after these touches.
void teach(const Case &c, const fit_array &array, Pad &pad, Random random) {
  fit_gains gains;
  fit_gains_begin(&gains, static_cast<float>(pad.gain_sd[0]));
  for (int t = 0; t < c.taught; t++) {
    const Felt felt = draw(c, array, random);
    fit_gains_lift(&gains);
    for (int look = 0; look < 2; look++) {
      const auto readings = readings_of(array, felt.contact, felt.touch, pad, felt.noise_Pa, random);
      const fit_settings settings = settings_for(pad, felt.noise_Pa);
      fit_result fit;
      fit_gaussian_grid(&array, readings.data(), (1u << SENSORS) - 1u, &settings, &fit);
      if (fit_gains_learn(&gains, &array, readings.data(), &settings, &fit)) {
        pad.gain_sd.fill(static_cast<double>(fit_gains_sd(&gains)));
      }
    }
  }
}

Results run(const Case &c, const Options &options) {
  const fit_array array = firmware_array();
  std::vector<Judged> judged(options.pads * TOUCHES);
  // Cases that differ in what is done with a touch alone draw the same touches.
  const std::uint64_t stream = stream_of(c.name.substr(0, c.name.find(',')));
  twin::in_parallel(options.pads, [&](std::size_t p) {
    Random random(options.seed, stream, p);
    Pad pad = c.pad(random, p);
    teach(c, array, pad, Random(options.seed, stream + 1, p));
    for (int t = 0; t < TOUCHES;) {
      const auto [touch, contact, noise_Pa] = draw(c, array, random);
      auto readings = readings_of(array, contact, touch, pad, noise_Pa, random);
      const std::uint32_t usable = choose_sensors(c.sensors, random);
      fit_settings settings = settings_for(pad, noise_Pa);
      settings.iterations = static_cast<std::uint8_t>(c.iterations);
      settings.model_sd_q16 = c.gaussian ? 0 : settings.model_sd_q16;
      fit_result fit;
      fit_gaussian_grid(&array, readings.data(), usable, &settings, &fit);
      if (!c.pulled.empty()) { // held until the firmware has looked for the load
        fit_doubt load{};
        for (int frame = 0; frame < FIT_DOUBT_PARTS; frame++) {
          fit_doubt_follow(&load, &array, readings.data(), &settings, &fit);
          readings = readings_of(array, contact, touch, pad, noise_Pa, random);
          fit_gaussian_grid(&array, readings.data(), usable, &settings, &fit);
        }
        fit_doubt_widen(&load, &array, &settings, &fit);
      }
      if (!(fit.flags & CONTACT_FLAG_FIT_VALID)) {
        continue; // no positive reading among the sensors in use
      }
      const double error_mm =
          std::hypot(static_cast<double>(fit.x_mm) - touch.x_mm, static_cast<double>(fit.y_mm) - touch.y_mm);
      judged[p * TOUCHES + static_cast<std::size_t>(t++)] = {error_mm, touch.force_N, fit};
    }
  });
  std::fprintf(stderr, "truth_fit: %s\n", c.name.c_str());
  return Results(std::move(judged));
}

std::vector<Contact> objects_on(double layer_mm, const Options &options) {
  std::vector<Contact> contacts;
  for (const char *name : OBJECTS) {
    contacts.push_back(contact_of(name, layer_mm, options.cache));
  }
  return contacts;
}

// The shorter width is one that 12 mm of rubber makes: 5.4 mm of a point, more of larger objects.
std::vector<Contact> gaussians(double ratio) {
  std::vector<Contact> contacts;
  for (double shorter_mm = 5.25; shorter_mm <= 7.0; shorter_mm += 0.25) {
    contacts.push_back(gaussian(shorter_mm, ratio));
  }
  return contacts;
}

Pad equal(Random &, std::size_t) {
  return perfect_pad();
}

auto spread(double sd) {
  return [sd](Random &random, std::size_t) { return raw_pad(sd, sd, random); };
}

// What the firmware believes at first of a pad that was never calibrated.
auto never_calibrated(double sd) {
  return [sd](Random &random, std::size_t) { return raw_pad(sd, static_cast<double>(DEFAULT_GAIN_SD), random); };
}

// Gains that rise over the pad in one direction, by so much rms: rubber that was cast aslant.
auto tilted(double rms) {
  return [rms](Random &random, std::size_t) {
    const fit_array array = firmware_array();
    Pad pad = raw_pad(0.0, static_cast<double>(DEFAULT_GAIN_SD), random);
    const double angle = random.uniform(0.0, 2.0 * M_PI);
    Readings along{};
    double square = 0.0;
    for (std::size_t k = 0; k < SENSORS; k++) {
      along[k] = std::cos(angle) * static_cast<double>(array.x[k]) + std::sin(angle) * static_cast<double>(array.y[k]);
      square += along[k] * along[k] / static_cast<double>(SENSORS);
    }
    for (std::size_t k = 0; k < SENSORS; k++) {
      pad.gain[k] = 1.0 + rms * along[k] / std::sqrt(square);
    }
    return pad;
  };
}

auto one_of(const CalibratedPads &pads) {
  return [&pads](Random &, std::size_t pad) { return pads[pad % pads.size()]; };
}

void judge_coverage(const Options &options, const std::vector<Contact> &thick, const std::vector<Contact> &thin,
                    const CalibratedPads &calibrated, ordered_json &out) {
  struct Row {
    Case c;
    bool covers; // the standard deviations are to hold here
  };
  const auto learnt = [](Case c) {
    c.taught = TAUGHT;
    return c;
  };
  const Row rows[] = {
      {{"noise only", gaussians(1.0), equal, true}, true},
      {{"12 mm, equal gains", thick, equal}, true},
      {{"12 mm, gains 5 %", thick, spread(0.05)}, true},
      {{"12 mm, gains 10 %, first touch", thick, never_calibrated(0.10)}, true},
      {learnt({"12 mm, gains 10 %", thick, never_calibrated(0.10)}), true},
      {{"12 mm, gains 20 %, first touch", thick, never_calibrated(0.20)}, false},
      {learnt({"12 mm, gains 20 %", thick, never_calibrated(0.20)}), true},
      {{"12 mm, gains aslant by 10 %, first touch", thick, tilted(0.10)}, false},
      {learnt({"12 mm, gains aslant by 10 %", thick, tilted(0.10)}), true},
      {{"12 mm, calibrated", thick, one_of(calibrated)}, true},
      {{"6 mm, equal gains", thin, equal}, true},
      {learnt({"6 mm, gains 10 %", thin, never_calibrated(0.10)}), false},
  };
  double least = 100.0, most = 0.0, least_2 = 100.0;
  for (const auto &[c, covers] : rows) {
    const Results results = run(c, options);
    out["cases"].push_back(results.row(c.name));
    if (covers) {
      least = std::min(least, results.covered(1.0));
      most = std::max(most, results.covered(1.0));
      least_2 = std::min(least_2, results.covered(2.0));
    }
    if (c.name == "12 mm, calibrated") {
      out["cal_warned_percent"] = results.flagged(WARNINGS);
      out["cal_bad_unflagged_percent"] = results.bad_without(WARNINGS);
      out["round_elongated_percent"] =
          results.share([](const Judged &j) { return j.error_mm <= BAD_mm && (j.fit.flags & CONTACT_FLAG_ELONGATED); });
    } else if (c.name == "12 mm, gains 10 %") {
      out["raw_warned_percent"] = results.flagged(WARNINGS);
      out["raw_bad_unflagged_percent"] = results.bad_without(WARNINGS);
    } else if (c.name == "12 mm, gains 20 %") {
      out["raw_20_warned_percent"] = results.flagged(WARNINGS);
      out["raw_20_bad_unflagged_percent"] = results.bad_without(WARNINGS);
    }
  }
  out["cover_1sd_min"] = least;
  out["cover_1sd_max"] = most;
  out["cover_2sd_min"] = least_2;
}

// No profile, so the load is not estimated. Without a load: what the look for one costs.
void judge_loaded(const Options &options, const CalibratedPads &calibrated, ordered_json &out) {
  shear::Objects objects(options.cache);
  struct Kind {
    const char *name;
    double layer_mm;
    std::function<Pad(Random &, std::size_t)> pad;
    int taught = 0;
  };
  const Kind kinds[] = {{"12 mm, calibrated", 12.0, one_of(calibrated)},
                        {"12 mm, gains 10 %", 12.0, never_calibrated(0.10), TAUGHT},
                        {"6 mm, equal gains", 6.0, equal},
                        {"6 mm, gains 10 %", 6.0, never_calibrated(0.10), TAUGHT}};
  const double loads[][2] = {{0.0, 0.0}, {0.1, 0.1}, {0.2, 0.2}, {0.3, 0.3}, {0.5, 0.5}, {0.0, 0.5}};
  for (const Kind &kind : kinds) {
    Case c{"loaded, " + std::string(kind.name), {}, kind.pad};
    c.taught = kind.taught;
    for (const char *name : OBJECTS) {
      c.pulled.push_back(&objects.on(kind.layer_mm, name));
    }
    for (const auto &[least, most] : loads) {
      c.load_least = least;
      c.load_most = most;
      char load[32];
      std::snprintf(load, sizeof load, least < most ? ", Q/F %g to %g" : ", Q/F %g", least, most);
      const Results results = run(c, options);
      out["loaded"].push_back(results.row(kind.name + std::string(load)));
      if (least < most && kind.name == kinds[0].name) {
        out["loaded_silent_percent"] = results.bad_without(WARNINGS);
      } else if (least < most && kind.name == kinds[1].name) {
        out["raw_loaded_silent_percent"] = results.bad_without(WARNINGS);
      } else if (most == 0.0 && kind.name == kinds[0].name) {
        out["unloaded_warned_percent"] = results.flagged(WARNINGS);
      } else if (most == 0.0 && kind.name == kinds[1].name) {
        out["raw_unloaded_warned_percent"] = results.flagged(WARNINGS);
      }
    }
  }
}

void judge_elongated(const Options &options, const CalibratedPads &calibrated, ordered_json &out) {
  struct Shape {
    const char *name;
    std::vector<Contact> contacts;
  };
  const Shape shapes[] = {
      {"sigma ratio 1.2", gaussians(1.2)},
      {"sigma ratio 1.3", gaussians(1.3)},
      {"sigma ratio 2", gaussians(2.0)},
      {"cylinder 6 x 12 mm", {contact_of("cylinder6x12", 12.0, options.cache)}},
      {"edge of 20 mm", {contact_of("edge20", 12.0, options.cache)}},
  };
  struct Angle {
    const char *name;
    double angle_rad;
  };
  const Angle angles[] = {{"any angle", NAN},
                          {"0 degrees", 0.0},
                          {"34 degrees", 34.0 / 180.0 * M_PI},
                          {"45 degrees", 0.25 * M_PI},
                          {"90 degrees", 0.5 * M_PI}};
  double worst = 0.0;
  for (const Shape &shape : shapes) {
    for (const Angle &angle : angles) {
      const Results results = run(
          {std::string(shape.name) + " at " + angle.name, shape.contacts, one_of(calibrated), false, angle.angle_rad},
          options);
      const double unflagged = results.bad_without(WARNINGS | CONTACT_FLAG_ELONGATED);
      ordered_json row = results.row(std::string(shape.name) + ", " + angle.name);
      row["bad_and_neither_warned_nor_elongated"] = unflagged;
      out["elongated"].push_back(row);
      worst = std::max(worst, unflagged);
    }
  }
  out["elongated_bad_unflagged_percent"] = worst;
}

void judge_iterations(const Options &options, const std::vector<Contact> &thick, const std::vector<Contact> &thin,
                      ordered_json &out) {
  for (int iterations = 3; iterations <= 8; iterations++) {
    for (const bool is_thin : {false, true}) {
      for (const double sd : {0.0, 0.10}) {
        Case c{is_thin ? "6 mm" : "12 mm", is_thin ? thin : thick, spread(sd)};
        c.name += sd > 0.0 ? " iterated with gains 10 %" : " iterated";
        c.name += ", " + std::to_string(iterations);
        c.iterations = iterations;
        const Results results = run(c, options);
        ordered_json row = results.row(c.name);
        row["iterations"] = iterations;
        row["layer_mm"] = is_thin ? 6 : 12;
        row["gain_percent"] = 100.0 * sd;
        out["iterations"].push_back(row);
      }
    }
  }
}

void judge_few_sensors(const Options &options, const std::vector<Contact> &thick, const std::vector<Contact> &thin,
                       const CalibratedPads &calibrated, ordered_json &out) {
  for (const bool is_thin : {false, true}) {
    for (const std::size_t sensors : {4u, 5u, 6u, 8u, 14u}) {
      Case c{is_thin ? "6 mm" : "12 mm", is_thin ? thin : thick, one_of(calibrated)};
      c.name += " with sensors missing, " + std::to_string(sensors);
      c.sensors = sensors;
      const Results results = run(c, options);
      ordered_json row = results.row(c.name);
      row["sensors"] = sensors;
      row["off_by_2_mm_unflagged"] = results.bad_without(WARNINGS, 2.0);
      out["few_sensors"].push_back(row);
    }
  }
}

ordered_json judge(const Options &options) {
  if (options.pads == 0) {
    throw std::runtime_error("--pads needs at least one pad");
  }
  const std::vector<Contact> thick = objects_on(12.0, options), thin = objects_on(6.0, options);
  ordered_json out;
  out["seed"] = options.seed;
  out["pads"] = options.pads;
  const CalibratedPads calibrated = calibrated_pads(options.pads, options.seed, options.cache);
  std::fprintf(stderr, "truth_fit: %zu calibrations\n", calibrated.size());
  judge_coverage(options, thick, thin, calibrated, out);
  judge_loaded(options, calibrated, out);
  judge_elongated(options, calibrated, out);
  judge_iterations(options, thick, thin, out);
  judge_few_sensors(options, thick, thin, calibrated, out);
  return out;
}

} // namespace

int main(int argc, char **argv) {
  Options options;
  return reference::print_found(
      "truth_fit", argc, argv,
      {{"--cache", &options.cache}, {"--seed", nullptr, &options.seed}, {"--pads", nullptr, &options.pads}}, HELP,
      [&] { return judge(options); });
}
