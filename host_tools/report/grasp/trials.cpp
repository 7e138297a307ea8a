#include "grasp/trials.hpp"

#include "grasp/convert.hpp"
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

void change(grip_settings &settings, const std::string &changes) {
  const std::map<std::string, std::int32_t *> numbers{
      {"touch_mN", &settings.touch_mN},
      {"approach_um_s", &settings.approach_um_s},
      {"force_cap_mN", &settings.force_cap_mN},
      {"travel_cap_um", &settings.travel_cap_um},
      {"differ_permille", &settings.differ_permille},
      {"set_mN", &settings.set_mN},
      {"kp_um_per_N", &settings.gains.kp_um_per_N},
      {"ki_um_per_Ns", &settings.gains.ki_um_per_Ns},
      {"kd_um_s_per_N", &settings.gains.kd_um_s_per_N},
      {"first_mN", &settings.first_mN},
      {"blind_mN", &settings.blind_mN},
      {"shift_um", &settings.shift_um},
      {"friction_permille", &settings.friction_permille},
      {"margin_permille", &settings.margin_permille},
      {"slid_permille", &settings.slid_permille},
      {"decay_permille_s", &settings.decay_permille_s}};
  const std::map<std::string, std::uint32_t *> times{{"control_us", &settings.control_us},
                                                     {"rest_us", &settings.rest_us}};
  for (const std::string_view one : split(changes, ',')) {
    if (one.empty()) {
      continue;
    }
    const std::size_t equals = one.find('=');
    const std::string name(one.substr(0, equals));
    const auto value =
        equals == std::string_view::npos ? std::nullopt : to_double(one.substr(equals + 1));
    if (!value) {
      throw std::runtime_error("the setting " + name + " has no number");
    }
    if (const auto number = numbers.find(name); number != numbers.end()) {
      *number->second = static_cast<std::int32_t>(*value);
    } else if (const auto time = times.find(name); time != times.end()) {
      *time->second = static_cast<std::uint32_t>(*value);
    } else {
      throw std::runtime_error("the controller has no setting \"" + name + "\"");
    }
  }
}

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
    : options_(options), faces_(names_of(options.objects)),
      gripper_(gripper_mechanics(options.gripper)) {
  if (options.mode != "hold" && options.mode != "fixed" && !is_still()) {
    throw std::runtime_error("there is no mode \"" + options.mode +
                             "\"; choose one of: hold fixed still still-fixed");
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
  trial.set_N = 1e-3 * settings(n).set_mN;
  trial.set_of_smaller = options_.mode == "still";
  return trial;
}

grip_settings Set::settings(std::uint64_t n) const {
  grip_settings settings;
  const grip_traits traits = core_traits(gripper_.traits);
  grip_default_settings(&settings, &traits);
  const bool holds = options_.mode == "hold" || options_.mode == "still";
  settings.mode = holds ? GRIP_MODE_HOLD : GRIP_MODE_FIXED;
  if (is_still()) {
    settings.set_mN =
        static_cast<std::int32_t>(1e3 * Random(options_.seed, SET, n).log_uniform(2.0, 12.0));
    settings.first_mN = settings.set_mN;
    settings.blind_mN = settings.set_mN;
    settings.shift_um = 0; // nothing pulls: no load is guessed
  }
  change(settings, options_.settings);
  return settings;
}

Outcome Set::run(std::uint64_t n, const std::function<void(const Moment &)> &trace) const {
  const Trial one = trial(n);
  CoreController controller(settings(n), core_traits(gripper_.traits));
  return run_trial(one, all_.at(one.scene.face), controller, trace);
}

std::vector<Done> run_all(const Set &set, std::uint64_t first, std::uint64_t count,
                          std::uint64_t jobs) {
  std::vector<Done> done(count);
  const auto one = [&](std::size_t i) {
    const Trial trial = set.trial(first + i);
    done[i] = {trial.scene, trial.set_N, set.run(first + i)};
  };
  twin::in_parallel(count, one, jobs);
  return done;
}

} // namespace fingertip::grasp
