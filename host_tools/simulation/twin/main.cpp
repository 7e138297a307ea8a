// twin: writes scenarios that emulator and native pipeline play. Exit status: 0 done; 1 something
// went wrong, reported in one line; 2 wrong usage.
#include "libfingertip/error.hpp"
#include "libfingertip/output_file.hpp"
#include "libfingertip/progress_bar.hpp"
#include "libfingertip/text.hpp"
#include "simulation/twin/best_gaussian.hpp"
#include "simulation/twin/scenario_file.hpp"
#include "tool/plain_help.hpp"

#include <CLI/CLI.hpp>
#include <atomic>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <exception>
#include <functional>

namespace {

using namespace fingertip;
using namespace fingertip::twin;

constexpr double LAYER_MIN_mm = 3.0, LAYER_MAX_mm = 20.0;
constexpr double SHORE_MIN = 5.0, SHORE_MAX = 70.0; // Gent's relation is for rubber

struct Options {
  ScenarioOptions scenario;
  std::string effects;
  std::string output;
  bool overwrite = false;
  std::string cache;
  std::optional<double> shore_a; // default: that of silicone()
  double width_force_N = 2.0;
};

std::atomic<bool> interrupted{false};

void catch_signals() {
  struct sigaction action {};
  action.sa_handler = [](int) { interrupted = true; };
  action.sa_flags = static_cast<int>(SA_RESETHAND); // a second one ends it at once
  for (int signal : {SIGINT, SIGTERM, SIGHUP}) {
    sigaction(signal, &action, nullptr);
  }
}

std::string number(double value) { return shortest(static_cast<float>(value)); }

// Throws Error once a signal asked for the end.
void show(ProgressBar &bar, double share) {
  if (interrupted) {
    throw Error("interrupted; what was not finished was not written");
  }
  bar.show(share);
}

Layer layer_of(double thickness_mm) {
  if (!(thickness_mm >= LAYER_MIN_mm && thickness_mm <= LAYER_MAX_mm)) {
    throw Error("--layer " + number(thickness_mm) + " is out of range; give " + number(LAYER_MIN_mm) + " to " + number(LAYER_MAX_mm) +
                " mm");
  }
  return silicone(thickness_mm);
}

// There and open to new tables.
std::filesystem::path cache_of(const Options &options) {
  const std::filesystem::path cache = options.cache.empty() ? default_cache_directory() : std::filesystem::path(options.cache);
  std::error_code error;
  std::filesystem::create_directories(cache, error);
  if (error || !std::filesystem::is_directory(cache) || access(cache.c_str(), W_OK | X_OK) != 0) {
    throw Error(cache.string() + ": cannot keep contact tables here; give another --cache");
  }
  return cache;
}

int list() {
  std::printf("Scenarios (twin scenario KIND), usual length and force:\n");
  for (const ScenarioKind &kind : scenario_kinds()) {
    std::printf("  %-14s%s; %s s, %s N\n", kind.name.c_str(), kind.description.c_str(), number(kind.usual_seconds).c_str(),
                kind.usual_forces.c_str());
  }
  std::printf("\nIndenters (--indenter):\n");
  for (const Indenter &one : indenters()) {
    std::printf("  %-14s%s\n", one.name.c_str(), one.description.c_str());
  }
  std::printf("\nLayers (--layer):\n"
              "  %-14sof silicone rubber, Shore 15 A; %s to %s mm, the report uses 12 and 6\n",
              "MM", number(LAYER_MIN_mm).c_str(), number(LAYER_MAX_mm).c_str());
  std::printf("\nEffects (--effects NAME[=VALUE],...; none and all), usual value:\n");
  for (const Effect &effect : effects()) {
    std::printf("  %-14s%s; %s %s. %s\n", effect.name.c_str(), effect.description.c_str(), number(effect.usual).c_str(),
                effect.unit.c_str(), effect.source.c_str());
  }
  return 0;
}

ContactTable table_of(const std::string &name, const Layer &layer, const Options &options) {
  return ContactTable::load_or_build(indenter(name), layer, cache_of(options));
}

int width(const Options &options) {
  Layer layer = layer_of(options.scenario.layer_mm);
  if (options.shore_a) {
    layer.youngs_modulus_Pa = youngs_modulus_Pa(*options.shore_a);
  }
  const std::string name = complete(options.scenario).indenter;
  const BestGaussian gaussian(table_of(name, layer, options), layer.thickness_mm);
  const BestGaussian::Fit fit = gaussian.at(options.width_force_N);
  const double force_N = 2e-6 * M_PI * fit.p0_Pa * fit.sigma_mm * fit.sigma_mm;
  std::printf("sigma_mm=%s force_share=%s peak_kPa=%s\n", fixed(fit.sigma_mm, 3).c_str(), fixed(force_N / options.width_force_N, 3).c_str(),
              fixed(1e-3 * fit.p0_Pa, 2).c_str());
  return 0;
}

int scenario(Options &options) {
  ScenarioOptions &chosen = options.scenario;
  chosen.effects = parse_effects(options.effects);
  const Layer layer = layer_of(chosen.layer_mm);
  chosen = complete(chosen);
  check_output(options.output, options.overwrite);
  check_output(truth_path(options.output), options.overwrite);
  const ContactTable table = table_of(chosen.indenter, layer, options);
  const Scenario made = make_scenario(chosen, table);
  std::optional<BlockTable> block;
  if (chosen.overhang_mm) {
    ProgressBar bar("table of the pad's edges, once");
    block = BlockTable::load_or_build(block_around(layer, *chosen.overhang_mm), sensor_places(), cache_of(options),
                                      [&](double share) { show(bar, share); });
  }
  Written written;
  {
    ProgressBar bar(made.name);
    written = write_scenario(made, layer, table, block ? &*block : nullptr, options.output, options.overwrite,
                             [&](double share) { show(bar, share); });
  }
  std::printf("%s: %s, %zu contacts in %s s, %zu rows, %s MB, at most %s kPa\n", printable(options.output).c_str(), made.name.c_str(),
              made.episodes.size(), number(*made.options.seconds).c_str(), written.rows,
              fixed(1e-6 * static_cast<double>(written.bytes), 1).c_str(), fixed(1e-3 * written.peak_Pa, 1).c_str());
  return 0;
}

// CLI11 would take -1 for a large seed.
std::uint64_t seed_from_text(const std::string &option, const std::string &text) {
  const auto seed = to_u64(text);
  if (!seed) {
    throw CLI::ValidationError(option + " \"" + text + "\" is not possible; give a whole number from 0");
  }
  return *seed;
}

} // namespace

int main(int argc, char **argv) {
  Options options;
  std::function<int()> action;
  CLI::App app("Writes what the sensors of a simulated pad feel, for emulator and native pipeline.", "twin");
  app.set_version_flag("--version", "twin " FINGERTIP_VERSION);
  app.require_subcommand(1);
  const auto option = [](CLI::App *command, const char *name, auto &value, const char *type, const char *help) {
    return command->add_option(name, value, help)->type_name(type);
  };
  const auto with_cache = [&](CLI::App *command) {
    option(command, "--cache", options.cache, "DIR", "Folder of the contact tables; default: ~/.cache/fingertip/contact-tables");
  };

  app.add_subcommand("list", "Explain scenarios, indenters, layers and effects")->callback([&] { action = list; });

  ScenarioOptions &s = options.scenario;
  const auto with_contact = [&](CLI::App *command) {
    option(command, "--indenter", s.indenter, "NAME", "Contact shape; default sphere6, for placements and drags sphere15");
    option(command, "--layer", s.layer_mm, "MM", "Thickness of the rubber; default 12");
  };

  CLI::App *fit = app.add_subcommand("width", "Width of the Gaussian that fits the pressure under a force best, its "
                                              "share of the force, and its peak");
  with_contact(fit);
  option(fit, "--force", options.width_force_N, "N", "Normal force")
      ->check(within(ContactTable::FORCE_MIN_N, ContactTable::FORCE_MAX_N))
      ->capture_default_str();
  option(fit, "--shore", options.shore_a, "A", "Hardness of the rubber, Shore A; default 15")->check(within(SHORE_MIN, SHORE_MAX));
  with_cache(fit);
  fit->callback([&] { action = [&] { return width(options); }; });

  CLI::App *write = app.add_subcommand("scenario", "Write a scenario, and its events beside it: FILE.truth.csv");
  option(write, "kind", s.kind, "KIND", "What happens: see twin list")->required();
  option(write, "-o,--output", options.output, "FILE.csv", "The scenario to write")->required();
  with_contact(write);
  option(write, "--overhang", s.overhang_mm, "MM", "The pad ends so far beyond its outer sensors; default: never");
  option(write, "--effects", options.effects, "NAME[=VALUE],...", "Errors of the pad, as in \"drift,relaxation=20\"; none (default), all");
  const auto seed = [&](const char *name, auto &value, const char *help) {
    const auto set = [&value, name](const std::string &text) { value = seed_from_text(name, text); };
    write->add_option_function<std::string>(name, set, help)->type_name("N");
  };
  seed("--seed", s.seed, "Of places, forces and times; default 1");
  seed("--pad", s.pad_seed, "Seed of the pad's errors; default: --seed");
  option(write, "--seconds", s.seconds, "S", "Length; default: see twin list");
  option(write, "--force", s.forces, "N", "\"5\", in turn \"1,2,5\", any of \"1..15\"; default: see twin list");
  option(write, "--tangential", s.tangential, "SHARE[,DEG]",
         "Pulled along the rubber by this share of the force, as 0.3 or any of 0.1..0.4; without an angle in any "
         "direction. In lifts the weight, in drags what hangs on the string, default 0.3; else 0");
  option(write, "--friction", s.friction, "MU", "Holds what is pulled, as 0.5 or any of 0.3..0.8; default 0.5, in slides 0.3..0.8");
  option(write, "--kinetic", s.kinetic_share, "SHARE", "Kinetic friction per static, in slides; 0.8");
  option(write, "--mass", s.mass_kg, "KG", "Of the object, in slides; default 0.1..0.5");
  option(write, "--speed", s.speeds_mm_s, "MM_PER_S,...", "In turn, of slip, rolloff, drag, the hand in slides")->delimiter(',');
  option(write, "--dead-travel", s.dead_travel_mm, "MM", "Way of the pusher, or of the pulled object, before it slips; default 1");
  option(write, "--creep", s.creep_share, "SHARE", "Share of the dead travel by which the contact moves along; default 0.5");
  option(write, "--stick-slip", s.stick_slip_mm, "MM", "Slip in jumps of this size; default 0: steady");
  option(write, "--margin", s.margin_mm, "MM",
         "Random places reach so far beyond the paper's grid; default a quarter of the pitch, for placements half");
  option(write, "--quiet", s.quiet_s, "S", "Time between contacts; default 1.2");
  write->add_flag("--overwrite", options.overwrite, "Replace files that exist");
  with_cache(write);
  write->callback([&] { action = [&] { return scenario(options); }; });

  return run_program(app, argc, argv, [&] {
    catch_signals();
    return action();
  });
}
