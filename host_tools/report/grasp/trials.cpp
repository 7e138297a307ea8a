#include "grasp/trials.hpp"

#include "grasp/settings.hpp"
#include "grasp/still_oracle.hpp"
#include "libfingertip/in_parallel.hpp"
#include "libfingertip/text.hpp"
#include "library/pad/table_file.hpp"
#include "report/measure/sessions.hpp"

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
enum Stream : std::uint64_t { PADS = 831, NOISE, SET, CALIBRATED = 6619936917925592332u };

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

// Pads with what their calibrations left of the gains. A calibration takes half a second, so they are kept. The first
// is repeated anyway, and shows whether the others still are what they would be.
std::vector<Rubber> pads_of(std::uint64_t seed, const std::string &cache) {
  const measure::Feet feet(LAYER_mm, cache);
  const auto pad_of = [&](std::size_t i) {
    const measure::PadOptions relaxing{10.0, 17.5,
                                       0.1}; // every other pad: its sensors relax by 9 to 26 % and sit 0.1 mm off
    const auto session =
        measure::calibrated_session(feet, i % 2 ? relaxing : measure::PadOptions{}, Random(seed, CALIBRATED, i).next());
    std::vector<float> values(session.remaining_gain.begin(), session.remaining_gain.end());
    values.insert(values.end(), session.gain_sd.begin(), session.gain_sd.end());
    return values;
  };
  const std::size_t sensors = measure::session_array().sensors();
  const std::vector<float> first = pad_of(0);
  std::vector<float> values(CALIBRATIONS * 2 * sensors);
  const twin::TableFile file(cache, "calibrated-pads", "calibrated-pads seed " + std::to_string(seed));
  if (!file.read(values) || !std::equal(first.begin(), first.end(), values.begin())) {
    twin::in_parallel(CALIBRATIONS, [&](std::size_t i) {
      const std::vector<float> pad = pad_of(i);
      std::copy(pad.begin(), pad.end(), values.begin() + std::ptrdiff_t(i * 2 * sensors));
    });
    file.write(values);
  }
  std::vector<Rubber> pads(CALIBRATIONS);
  for (std::size_t i = 0; i < CALIBRATIONS; i++) {
    const auto begin = values.begin() + std::ptrdiff_t(i * 2 * sensors), middle = begin + std::ptrdiff_t(sensors);
    std::copy(begin, middle, pads[i].gain.begin());
    std::copy(middle, middle + std::ptrdiff_t(sensors), pads[i].gain_sd.begin());
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
    rubber = pads_[random.next() % pads_.size()];
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
