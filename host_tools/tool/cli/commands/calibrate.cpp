#include "tool/cli/calibrate.hpp"

#include "libfingertip/text.hpp"
#include "tool/calibration/solver.hpp"
#include "tool/cli/command_line.hpp"

#include <memory>

namespace fingertip {

namespace {

CLI::Option *with_weight(CLI::App *command, const std::string &option, double unit_N, std::optional<double> &force_N,
                         const std::string &help) {
  const double lightest = 0.1 / unit_N, heaviest = 50 / unit_N;
  return with_number(
      command, option, lightest, heaviest, fixed(lightest, 1) + " to " + fixed(heaviest, 0),
      [&force_N, unit_N](double weight) { force_N = weight * unit_N; }, help);
}

} // namespace

void add_calibrate(CommandLine &line) {
  auto options = std::make_shared<CalibrateOptions>();
  CLI::App *command =
      line.add("calibrate", "Find the sensors' gains by setting down one weight at some twenty places", [options] {
        if (options->dry_run && options->from.empty()) {
          throw WrongUsage("--dry-run goes with --from; without, it asks before it writes");
        }
        if (options->placements) {
          return calibrate_placements();
        }
        if (options->drag && !options->force_N) {
          throw WrongUsage("--drag needs the pull: --weight GRAMS on the string, or --force N");
        }
        return run_calibrate(*options);
      });
  with_port(command, options->choice);
  CLI::Option *weight = with_weight(command, "--weight", calibrating::GRAVITY_N_PER_g, options->force_N,
                                    "Mass of the weight: then forces are calibrated too")
                            ->type_name("GRAMS");
  CLI::Option *force =
      with_weight(command, "--force", 1.0, options->force_N, "The same in newtons")->excludes(weight)->type_name("N");
  CLI::Option *drag = command->add_flag("--drag", options->drag,
                                        "Find the tangential force's scale: the weight hangs on a string that pulls an "
                                        "object level along the pad, several times in each direction");
  CLI::Option *from =
      command->add_option("--from", options->from, "Use the placements of a recording with pressures, not live ones")
          ->type_name("FILE.csv");
  CLI::Option *dry_run = command->add_flag("--dry-run", options->dry_run, "With --from: only show");
  CLI::Option *yes = command->add_flag("--yes", options->yes, "Write, or erase, without asking");
  CLI::Option *show = command->add_flag("--show", options->show, "Show the fingertip's calibration")
                          ->excludes(weight, force, drag, from, dry_run, yes);
  command->add_flag("--erase", options->erase, "Erase its calibration, after a question")
      ->excludes(weight, force, drag, from, dry_run, show);
  command
      ->add_flag(
          "--placements", options->placements,
          "For programs: only solve the placements that standard input has, and print the solution, both as JSON")
      ->excludes(weight, force, drag, from, dry_run, yes, show);
  with_colour(command, options->colour);
}

} // namespace fingertip
