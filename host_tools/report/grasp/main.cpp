// fingertip_grasp_kinds: many grasps in simulated time (host_tools/simulation/cell/kind_trial.hpp). It prints
// one JSON object: what was asked for, and each grasp. kinds.py sums them up.
#include "grasp/settings.hpp"
#include "grasp/words.hpp"
#include "libfingertip/in_parallel.hpp"
#include "libfingertip/random.hpp"
#include "libfingertip/text.hpp"
#include "report/grasp/fault_trials.hpp"
#include "report/grasp/textbook.hpp"
#include "simulation/cell/kind_trial.hpp"
#include "tool/plain_help.hpp"

#include <CLI/CLI.hpp>
#include <iostream>

namespace fingertip::grasp {
namespace {

using namespace cell;
using nlohmann::ordered_json;

enum Stream : std::uint64_t { NOISE = 881, SET, ASKED };

constexpr double FIXED_N = 15.0, PAPER_N = 6.0;
constexpr double SET_LEAST_N = 2.0, SET_MOST_N = 15.0; // of a still grasp
constexpr double STEADY_s = 1.5, WATCHED_s = 3.5;      // before and after what happens in a steady hold
constexpr double ASKED_s = 0.3;                        // from a request to what it waits for
constexpr double PULL_LEAST_N = 2.0, PULL_MOST_N = 6.0, PULL_s = 2.0, LOWERS_s = 1.0;
constexpr double BEYOND_LEAST_mm = 0.5, BEYOND_MOST_mm = 3.0; // where the hand expects no table
constexpr double LOW_mm = 2.0;                                // what falls so far is set down

// Wrong readings of one fingertip.
struct Wrong {
  const char *name;
  Fault::Kind kind;
  double frames; // 0: for good
};
constexpr Wrong WRONG[] = {{"frame", Fault::Kind::nothing, 1},   {"frames", Fault::Kind::nothing, 10},
                           {"nothing", Fault::Kind::nothing, 0}, {"spike", Fault::Kind::spike, 1},
                           {"tared", Fault::Kind::tared, 0},     {"reboot", Fault::Kind::reboot, 0},
                           {"weak", Fault::Kind::weak, 0},       {"moved_zero", Fault::Kind::moved_zero, 0}};

struct Options {
  std::string kind = "usual", gripper = gripper_models().front().model, controller = "ours", settings, then;
  double later_ms = 0.0, rate_Hz = 410.0, still_s = 0.0;
  std::uint64_t seed = 1, count = 100, jobs = 2;
  std::optional<std::uint64_t> trace;
  bool faults = false, loadless = false;
};

// Instead of the kind's events, in a steady hold.
void happens(GraspTrial &trial, const Options &options, std::uint64_t n) {
  const Wrong *wrong = find_in(WRONG, [&](const Wrong &one) { return options.then == one.name; });
  GraspScenario &grasp = trial.grasp;
  const double steady_s = grasp.lift_s + STEADY_s;
  grasp.gone = -1;
  grasp.events.clear();
  Fault &fault = trial.fault.emplace();
  fault.kind = wrong ? wrong->kind : Fault::Kind::none;
  fault.fingers[n % 2] = true;
  fault.state = GRIP_HOLDING;
  fault.after_s = trial.asked_after_s = grasp.waits_s + steady_s;
  fault.lasts_s = wrong && wrong->frames > 0 ? wrong->frames / options.rate_Hz : fault.lasts_s;
  fault.watched_s = WATCHED_s;
  fault.is_followed_by_pouring = false;
  trial.asked = request_of_name(options.then);
  Random random(options.seed, ASKED, n);
  if (trial.asked == GRIP_REQUEST_PLACE) {
    const double beyond_mm = random.uniform(BEYOND_LEAST_mm, BEYOND_MOST_mm);
    grasp.events = {{Event::Kind::lower, steady_s + ASKED_s, LOWERS_s, LOWERS_s, 0.0, 0.0, beyond_mm}};
  } else if (trial.asked == GRIP_REQUEST_HAND_OVER) {
    const double weights = random.log_uniform(PULL_LEAST_N, PULL_MOST_N) / (GRAVITY_m_s2 * grasp.mass_kg);
    grasp.events = {{Event::Kind::push, steady_s + ASKED_s, PULL_s, weights, random.uniform(-M_PI, M_PI)}};
  }
}

GraspTrial trial_of(const Options &options, std::uint64_t n) {
  const auto kinds = split(options.kind, ',');
  GraspTrial trial;
  trial.grasp = draw_grasp(kind_of(std::string(kinds[n % kinds.size()])), options.seed, n / kinds.size());
  trial.gripper = gripper_mechanics(options.gripper);
  trial.seed = Random(options.seed, NOISE, n).next();
  trial.later_s = 1e-3 * options.later_ms;
  trial.rate_Hz = options.rate_Hz;
  trial.estimates_load = !options.loadless;
  if (options.still_s > 0.0) {
    trial.still_s = options.still_s;
    trial.set_N = Random(options.seed, SET, n).log_uniform(SET_LEAST_N, SET_MOST_N);
    trial.set_of_smaller = options.controller != "paper";
    trial.grasp.table_friction = 0.0; // both pads press alike
  }
  if (!options.then.empty()) {
    happens(trial, options, n);
  }
  return trial;
}

GripSettings settings_with(const Options &options, const GraspTrial &trial) {
  std::map<std::string, double> values;
  if (trial.grasp.kind == Kind::fragile) {
    values = preset_values(trial.grasp.object);
  }
  const bool still = trial.still_s > 0.0;
  if (options.controller == "fixed" || options.controller == "paper") {
    values["fixed"] = still ? trial.set_N : options.controller == "fixed" ? FIXED_N : PAPER_N;
    values.erase("cap");
  }
  for (const auto &[name, value] : limits_of(split(options.settings, ','))) {
    values[name] = value;
  }
  GripSettings settings = settings_for(trial.gripper.traits, values);
  if (still) {
    settings.start_N = settings.floor_N = settings.blind_N = trial.set_N;
  }
  return settings;
}

const Face &face() {
  static const Face found("sphere15", FINGERTIP_TABLES);
  return found;
}

struct Done {
  GraspTrial trial;
  TrialOutcome outcome;
  GripSettings settings;
};

Done run_one(const Options &options, std::uint64_t n, const TrialTrace &trace = {}) {
  Done done{trial_of(options, n), {}, {}};
  done.settings = settings_with(options, done.trial);
  const GripperTraits &traits = done.trial.gripper.traits;
  CoreController ours(done.settings, traits);
  Textbook textbook(traits);
  done.outcome = run_trial(done.trial, face(), options.controller == "textbook" ? static_cast<Controller &>(textbook) : ours, trace);
  return done;
}

ordered_json line_of(std::uint64_t n, const Done &one) {
  const GraspScenario &grasp = one.trial.grasp;
  const TrialOutcome &o = one.outcome;
  ordered_json line{{"n", n},
                    {"shape", name_of(grasp.shape)},
                    {"mass_kg", grasp.mass_kg},
                    {"friction", grasp.pads[0].friction},
                    {"dropped", o.dropped},
                    {"never_held", o.never_held},
                    {"crushed", o.crushed},
                    {"hunts", o.hunts},
                    {"margin", o.margin},
                    {"slid_mm", o.slid_mm},
                    {"slides", o.slides},
                    {"learnt", o.friction},
                    {"turned_deg", o.turned_deg},
                    {"first_N", o.first_N},
                    {"peak_N", o.peak_N},
                    {"start_N", one.settings.start_N},
                    {"cap_N", one.settings.cap_N},
                    {"events", ordered_json::array()},
                    {"catches", ordered_json::array()}};
  for (const Event &event : grasp.events) {
    line["events"].push_back(name_of(event.kind));
  }
  for (const Slip &slip : o.catches) {
    line["catches"].push_back({{"peak_N", slip.peak_N},
                               {"least_N", slip.least_N},
                               {"reaction_ms", slip.reaction_s ? ordered_json(1e3 * *slip.reaction_s) : nullptr}});
  }
  if (one.trial.fault) {
    line["before_N"] = o.failed.before_N;
    line["after_N"] = o.failed.after_N;
    line["reported"] = trouble_names(o.failed.trouble);
    line["released"] = o.failed.released_s.has_value();
  }
  if (one.trial.asked && o.failed.released_s) {
    const Event &awaited = grasp.events.front();
    const double at_s = *o.failed.released_s;
    line["early"] = awaited.kind == Event::Kind::lower ? grasp.inputs(at_s).lifted_mm > o.slid_mm + LOW_mm : at_s < awaited.begin_s;
  }
  if (one.trial.still_s > 0.0) {
    line["set_N"] = one.trial.set_N;
    line["settle_s"] = o.settle_s ? ordered_json(*o.settle_s) : nullptr;
    line["rms_percent"] = 100.0 * o.rms;
    line["reversals"] = o.reversals;
  }
  return line;
}

ordered_json measured(const Options &options) {
  if (options.trace) {
    ordered_json series;
    const Done done = run_one(options, *options.trace, [&](const auto &moment) {
      for (const auto &[name, value] : moment) {
        series[name].push_back(value);
      }
    });
    ordered_json out = line_of(*options.trace, done);
    out["series"] = series;
    return out;
  }
  if (options.faults) {
    return {{"rows", fault_rows(face(), options.jobs)}};
  }
  std::vector<Done> done(options.count);
  twin::in_parallel(
      options.count, [&](std::size_t i) { done[i] = run_one(options, i); }, options.jobs);
  ordered_json out{{"gripper", options.gripper}, {"controller", options.controller}};
  for (std::size_t i = 0; i < done.size(); i++) {
    out["each"].push_back(line_of(i, done[i]));
  }
  return out;
}

int run(int argc, char **argv) {
  CLI::App app("Grasps in simulated time, as JSON on the standard output.", "fingertip_grasp_kinds");
  Options options;
  app.add_option("--kind", options.kind, "gentle, usual, rough, slick, fragile; several, split by commas, by turns")->capture_default_str();
  app.add_option("--gripper", options.gripper, gripper_model_names() + " or ideal")->capture_default_str();
  app.add_option("--controller", options.controller, "textbook; fixed: 15 N; paper: eq. (5) and (6) at 6 N")
      ->check(CLI::IsMember({"ours", "textbook", "fixed", "paper"}))
      ->capture_default_str();
  app.add_option("--set", options.settings, "Of our settings, split by commas: margin=1.4")->type_name("NAME=VALUE");
  app.add_option("--later", options.later_ms, "All frames come later")->type_name("MS")->check(within(0.0, 1e4));
  app.add_option("--rate", options.rate_Hz, "Frames of a fingertip")->type_name("HZ")->check(within(1.0, 1600.0))->capture_default_str();
  app.add_flag("--loadless", options.loadless, "Fingertips do not know their pads: no tangential force");
  app.add_option("--still", options.still_s, "No lift: a set force of 2 to 15 N for this time; `paper` by eq. (5) and (6)")
      ->type_name("S")
      ->check(within(1e-3, 1e4));
  std::vector<std::string> happenings = {"none", "place", "hand_over"};
  for (const Wrong &wrong : WRONG) {
    happenings.emplace_back(wrong.name);
  }
  app.add_option("--then", options.then, "Instead of events, in a steady hold: what one fingertip reports wrongly, or a request")
      ->check(CLI::IsMember(happenings));
  app.add_option("--seed", options.seed, "Another set of grasps; 1 to 999 are there to choose constants by, the report judges by others")
      ->capture_default_str();
  app.add_option("--count", options.count, "Grasps")->check(within(1, 1000000))->capture_default_str();
  app.add_option("--jobs", options.jobs, "Threads")->check(within(1, 64))->capture_default_str();
  app.add_option("--trace", options.trace, "Instead: all that is known of this grasp, every 2 ms")->type_name("N");
  app.add_flag("--faults", options.faults, "Instead: every fault in every state of a grasp");
  return run_program(app, argc, argv, [&] {
    std::cout << measured(options).dump() << '\n';
    return std::cout.flush() ? 0 : 1;
  });
}

} // namespace
} // namespace fingertip::grasp

int main(int argc, char **argv) { return fingertip::grasp::run(argc, argv); }
