#include "grasp/trials.hpp"

#include "grasp/settings.hpp"
#include "grasp/still_oracle.hpp"
#include "libfingertip/in_parallel.hpp"
#include "libfingertip/text.hpp"
#include "library/pad/table_file.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

namespace fingertip::grasp {

using namespace cell;

namespace {

constexpr double FORCE_GAIN_SD = 0.05; // of a calibrated fingertip's force scale
constexpr double LAYER_mm = 12.0;
constexpr std::size_t CALIBRATIONS = 40;
constexpr double FAST_Hz = 600.0;
enum Stream : std::uint64_t { PADS = 831, NOISE, SET };

} // namespace

std::map<std::string, double> settings_of(const std::string &changes) {
  std::map<std::string, double> values;
  for (const std::string_view one : split(changes, ',')) {
    if (one.empty()) {
      continue;
    }
    const std::size_t equals = one.find('=');
    const std::string name(one.substr(0, equals));
    const auto value = equals == std::string_view::npos ? std::nullopt : to_double(one.substr(equals + 1));
    const auto &all = grasp_settings();
    if (std::none_of(all.begin(), all.end(), [&](const GraspSetting &each) { return name == each.name; })) {
      throw std::runtime_error("the controller has no setting \"" + name + "\"");
    }
    if (!value) {
      throw std::runtime_error("the setting " + name + " has no number");
    }
    values[name] = *value;
  }
  return values;
}

namespace {

// A calibration takes half a second, so they are kept; the first of them is gone through anyway,
// and tells whether the others still are what they would be.
truth::CalibratedPads pads_of(std::uint64_t seed, const std::string &cache) {
  constexpr std::size_t PER_CALIBRATION = 10; // truth::calibrated_pads
  constexpr std::size_t VALUES = 2 * truth::SENSORS;
  const auto values_of = [](const truth::CalibratedPads &pads) {
    std::vector<float> values;
    for (const truth::Pad &pad : pads) {
      for (const truth::Readings *part : {&pad.gain, &pad.gain_sd}) {
        for (const double value : *part) {
          values.push_back(static_cast<float>(value));
        }
      }
    }
    return values;
  };
  const std::string key = "calibrated-pads seed " + std::to_string(seed);
  const twin::TableFile file(cache, "calibrated-pads", key);
  std::vector<float> values(CALIBRATIONS * VALUES);
  const std::vector<float> first = values_of(truth::calibrated_pads(PER_CALIBRATION, seed, cache));
  if (!file.read(values) || !std::equal(first.begin(), first.end(), values.begin())) {
    values = values_of(truth::calibrated_pads(PER_CALIBRATION * CALIBRATIONS, seed, cache));
    file.write(values);
  }
  truth::CalibratedPads pads(CALIBRATIONS);
  for (std::size_t i = 0; i < CALIBRATIONS; i++) {
    for (std::size_t k = 0; k < truth::SENSORS; k++) {
      pads[i].gain[k] = static_cast<double>(values[i * VALUES + k]);
      pads[i].gain_sd[k] = static_cast<double>(values[i * VALUES + truth::SENSORS + k]);
    }
  }
  return pads;
}

std::vector<std::string> names_of(const std::string &objects) {
  if (objects.find_first_of("0123456789_") == std::string::npos) {
    return faces_of(objects);
  }
  std::vector<std::string> names;
  for (const std::string_view name : split(objects, ',')) {
    names.emplace_back(name);
  }
  return names;
}

} // namespace

Set::Set(const SetOptions &options)
    : options_(options), faces_(names_of(options.objects)), gripper_(gripper_mechanics(options.gripper)) {
  if (options.mode != "hold" && options.mode != "fixed" && !is_still()) {
    throw std::runtime_error("there is no mode \"" + options.mode +
                             "\"; choose one of: hold fixed still still-fixed still-oracle");
  }
  if (!(options.rate_Hz >= 1.0 && options.rate_Hz <= 1600.0)) {
    throw std::runtime_error("a fingertip gives 1 to 1600 frames a second");
  }
  sensing_.rate_Hz = options.rate_Hz;
  sensing_.osr = options.rate_Hz > FAST_Hz ? 256 : 1024;
  sensing_.tangential = options.effect;
  for (const std::string &name : faces_) {
    all_.emplace(name, Face(name, LAYER_mm, options.cache));
  }
  pads_ = pads_of(options.seed, options.cache);
}

Trial Set::trial(std::uint64_t n) const {
  Trial trial;
  trial.scene = draw_scene(faces_, options_.seed, n);
  trial.gripper = gripper_;
  trial.sensing = sensing_;
  trial.seed = Random(options_.seed, NOISE, n).next();
  Random random(options_.seed, PADS, n);
  for (Rubber &rubber : trial.rubber) {
    const truth::Pad &pad = pads_[random.next() % pads_.size()];
    rubber = {pad.gain, pad.gain_sd};
    const double scale = 1.0 + FORCE_GAIN_SD * std::clamp(random.normal(), -3.0, 3.0);
    for (double &gain : rubber.gain) {
      gain *= scale;
    }
  }
  trial.still_s = is_still() ? options_.still_s : 0.0;
  trial.set_N = settings(n).set_N;
  trial.set_of_smaller = options_.mode != "still-fixed";
  return trial;
}

GripSettings Set::settings(std::uint64_t n) const {
  GripSettings settings = settings_for(gripper_.traits, settings_of(options_.settings));
  const bool fixed = options_.mode == "fixed" || options_.mode == "still-fixed";
  settings.mode = fixed ? GRIP_MODE_FIXED : GRIP_MODE_HOLD;
  if (is_still()) {
    settings.set_N = Random(options_.seed, SET, n).log_uniform(2.0, 15.0);
    settings.start_N = settings.floor_N = settings.blind_N = settings.set_N;
  }
  return settings;
}

Outcome Set::run(std::uint64_t n, const std::function<void(const Moment &)> &trace) const {
  const Trial one = trial(n);
  const Face &face = all_.at(one.scene.face);
  if (options_.mode == "still-oracle") {
    StillOracle oracle(one, face);
    return run_trial(one, face, oracle, [&](const Moment &moment) {
      oracle.see(moment);
      trace ? trace(moment) : void();
    });
  }
  CoreController controller(settings(n), gripper_.traits);
  return run_trial(one, face, controller, trace);
}

std::vector<Done> run_all(const Set &set, std::uint64_t first, std::uint64_t count, std::uint64_t jobs) {
  std::vector<Done> done(count);
  const auto one = [&](std::size_t i) {
    const Trial trial = set.trial(first + i);
    done[i] = {trial.scene, trial.set_N, set.run(first + i)};
  };
  twin::in_parallel(count, one, jobs);
  return done;
}

} // namespace fingertip::grasp
