// The program behind `fingertip simulate`: simulated fingertips on ports, in real time, each with its firmware on this machine and on
// simulated rubber. The tool itself knows no simulation: it starts this program, which is next to it (tool/cli/commands/simulate.cpp).
#include "libfingertip/error.hpp"
#include "libfingertip/output_file.hpp"
#include "libfingertip/text.hpp"
#include "library/pad/table_file.hpp"
#include "simulation/cell/simulations.hpp"
#include "tool/plain_help.hpp"

#include <CLI/CLI.hpp>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <utility>

using namespace fingertip;
using namespace fingertip::cell;
namespace fs = std::filesystem;

namespace {

struct Options : SimulationOptions {
  std::string ports, kind;
  double pull_g = 0.0;
};

// Contact tables: those that were built with this program, for the faces that it needs by itself;
// others are solved once and kept for this user.
std::string tables_for(const std::string &face) {
  std::error_code none;
  const fs::path bin = fs::read_symlink("/proc/self/exe", none).parent_path();
  for (const char *place : {"../../share/fingertip/tables", "tables"}) {
    const fs::path folder = (bin / place).lexically_normal();
    for (const auto &file : fs::directory_iterator(folder, none)) {
      if (file.path().filename().string().rfind(face + "-", 0) == 0) {
        return folder.string();
      }
    }
  }
  return twin::default_cache_directory().string();
}

void run(Options &options, bool is_lift, bool is_validate) {
  if (!options.truth.empty()) {
    check_output(options.truth, options.overwrite);
  }
  options.cache = options.cache.empty() ? tables_for(is_lift ? LIFT_FACE : PRESS_FACE) : options.cache;
  if (is_lift) {
    if (!options.kind.empty()) { // whose errors and delays of frames are no part of it: the fingertips are the firmware
      GraspScenario &grasp = options.world.grasp;
      const GraspScenario given = std::exchange(grasp, draw_grasp(kind_of(options.kind), options.seed, 0));
      grasp.stiffness_N_mm = given.stiffness_N_mm;
      grasp.down_rad = given.down_rad;
    }
    lift(options, PortFolder(options.ports));
  } else if (is_validate) {
    const ValidatedOptions one = {
        .weight_g = options.weight_g, .pulling = {.weight_g = options.pull_g}, .seed = options.seed, .cache = options.cache};
    validate(one, options.seconds, PortFolder(options.ports));
  } else {
    press(options, PortFolder(options.ports));
  }
}

} // namespace

int main(int argc, char **argv) {
  CLI::App app("Simulates fingertips in real time: their firmware on this machine, on simulated rubber. "
               "Every program finds them as it finds real ones, and by the names sim:left and sim:right "
               "(sim: for the first). Ctrl-C ends it.",
               "fingertip simulate");
  const auto name_of_any = [](auto one) { return name_of(one); };
  Options options;
  GraspScenario &object = options.world.grasp;
  object.down_rad = M_PI_2; // the fingertips' cables leave upwards
  double friction = object.pads[0].friction;
  std::string shape = name_of(object.shape);
  std::vector<std::string> planned_texts;
  bool is_press = false, is_lift = false, is_validate = false, by_command = false;
  const auto add = [&](const char *name, auto &value, const char *unit, const char *help) {
    return app.add_option(name, value, help)->type_name(unit);
  };
  std::vector<CLI::Option *> of_lift;
  const auto for_lift = [&](CLI::Option *option) { return of_lift.emplace_back(option); };
  const auto lift_number = [&](const char *name, double &value, const char *unit, double low, double high, const char *help) {
    return for_lift(add(name, value, unit, help)->check(within(low, high))->capture_default_str());
  };

  CLI::Option *press_flag = app.add_flag(
      "--press", is_press,
      "A weight on a ball of 15 mm is set down here and there, for two seconds each time; this is what happens without an option");
  CLI::Option *mouse_flag = app.add_flag("--mouse", options.by_hand,
                                         "A hand presses the ball: yours, with the pointer on the pad in the page of `fingertip web`");
  CLI::Option *lift_flag =
      app.add_flag("--lift", is_lift,
                   "Two fingertips on a gripper with an object between: `fingertip grasp --gripper 2f85 --gripper-port "
                   "sim:gripper` grasps it, then a hand lifts it. Obeys lines of standard input (help lists them)");
  CLI::Option *validate_flag =
      app.add_flag("--validate", is_validate,
                   "A hand that goes through the steps of `fingertip validate`, when that begins: the weight at each mark of "
                   "the template, a hold, a rest");
  mouse_flag->excludes(press_flag);
  lift_flag->excludes(press_flag, mouse_flag);
  validate_flag->excludes(press_flag, mouse_flag, lift_flag);
  add("--pull", options.pull_g, "GRAMS",
      "The hand of --validate pulls a thread in the end, with this weight, for `fingertip validate --pull`")
      ->needs(validate_flag)
      ->check(within(10.0, 1000.0));
  add("--ports", options.ports, "FOLDER",
      "Folder for the ports left, right and gripper, which FINGERTIP_PORT may name; no program finds the fingertips by itself then, and "
      "one at a time may use each");
  add("--seed", options.seed, "N", "Of gains, noise and places; default 1")->check(within(0, 999999999));
  add("--gain-spread", options.gain_spread, "SHARE", "Standard deviation between sensors; default 0.1, with --lift 0.05")
      ->check(within(0.0, 0.2));
  add("--seconds", options.seconds, "S", "End after this time")->check(within(0.1, 1e6));
  add("--truth", options.truth, "FILE.csv", "Keeps what is true");
  app.add_flag("--overwrite", options.overwrite, "Replace FILE.csv if it exists");
  add("--cache", options.cache, "FOLDER", "Of contact tables; default: those installed, else ~/.cache/fingertip");
  for (CLI::Option *option : {add("--fingertips", options.fingertips, "N", "How many")->check(within(1, 2)),
                              add("--weight", options.weight_g, "GRAMS", "What is set down")->check(within(20.0, 2000.0))}) {
    option->excludes(lift_flag)->group("Presses")->capture_default_str();
  }

  for_lift(app.add_option("--gripper", options.model, "Which one"))
      ->check(CLI::IsMember(texts_of(gripper_models(), [](const auto &one) { return one.model; })))
      ->capture_default_str();
  CLI::Option *kind = app.add_option("--kind", options.kind, "A grasp of this kind, drawn by the seed: object, lift, and what happens then")
                          ->check(CLI::IsMember(texts_of(KINDS, name_of_any)));
  const std::size_t before_drawn = of_lift.size();
  for_lift(app.add_option("--shape", shape, "Of the object"))->check(CLI::IsMember(texts_of(SHAPES, name_of_any)))->capture_default_str();
  lift_number("--width", object.width_mm, "MM", 1.0, 500.0, "Of the object, between the fingers");
  lift_number("--mass", object.mass_kg, "KG", 0.001, 10.0, "Its mass");
  lift_number("--friction", friction, "NUMBER", 0.05, 3.0, "Its friction coefficient");
  const CLI::Option *stiffness =
      for_lift(add("--stiffness", object.stiffness_N_mm, "N/MM", "Its stiffness; default: it does not yield"))->check(within(0.1, 1e6));
  for_lift(add("--crushes", object.crushes_N, "N", "More force breaks it; default: none does"))->check(within(0.1, 1e6));
  lift_number("--opens", object.opens_mm, "MM", 0.5, 100.0, "How much wider than the object the gripper is at first");
  lift_number("--lift-time", object.lift_s, "S", 0.05, 60.0, "How long the lift takes");
  for (std::size_t i = before_drawn; i < of_lift.size(); i++) {
    if (of_lift[i] != stiffness) { // no kind sets it
      kind->excludes(of_lift[i]);
    }
  }
  for_lift(kind);
  for_lift(app.add_flag("--by-command", by_command, "Lift only on the command, not once the force is steady"));
  for_lift(add("--then", planned_texts, "KIND:AMOUNT@S",
               "A disturbance: pour:MASSES, knock:M/S, slick:SHARE, or lower:SECONDS onto the table, @SECONDS after the lift"));
  lift_number("--patience", options.patience_s, "S", 0.0, 3600.0,
              "Longest pause of the world while fingertips or the gripper's client are held up");
  for (CLI::Option *option : of_lift) {
    option->needs(lift_flag)->group("Lifts");
  }
  return run_program(app, argc, argv, [&] {
    for (int number_of_signal : {SIGINT, SIGTERM, SIGHUP}) {
      std::signal(number_of_signal, [](int) { interrupted = 1; });
    }
    std::signal(SIGPIPE, SIG_IGN);
    for (const std::string &text : planned_texts) {
      options.world.planned.push_back(planned(text));
    }
    options.world.lifts_by_itself = !by_command;
    object.shape = *find_in(SHAPES, [&](Shape one) { return shape == name_of(one); });
    object.pads[0].friction = object.pads[1].friction = friction;
    stiffen(object);
    run(options, is_lift, is_validate);
    return 0;
  });
}
