#include "grasp/settings.hpp"
#include "tool/cli/command_line.hpp"
#include "tool/cli/grasp_session.hpp"
#include "tool/cli/gripper_options.hpp"

#include <cmath>
#include <cstdio>
#include <memory>

namespace fingertip {

namespace {

std::string plain(double value) {
  char text[32];
  std::snprintf(text, sizeof text, value == std::floor(value) ? "%.0f" : "%.4g", value);
  return text;
}

/* The default for the usual gripper, and for a servo if it differs. */
std::string default_of(const GraspSetting &setting, const GripSettings &usual, const GripSettings &servo) {
  if (setting.name == std::string("fixed")) {
    return "";
  }
  const double value = value_of(setting, usual), other = value_of(setting, servo);
  return "; default " + plain(value) + (value == other ? "" : ", of a servo " + plain(other));
}

/* What breaks: a preset by name, or the force that breaks it. Options of single limits override it. */
void with_presets(CLI::App *command, std::map<std::string, double> &breaking) {
  std::string names;
  for (const GraspPreset &preset : grasp_presets()) {
    names += (names.empty() ? "" : ", ") + std::string(preset.name) + " (" + plain(preset.breaks_N) + " N)";
  }
  auto *preset = command->add_option_function<std::string>(
      "--preset", [&breaking](const std::string &name) { breaking = typed([&] { return preset_values(name); }); },
      "Cap, start, floor and approach for what breaks: " + names);
  preset->type_name("NAME")->group("Limits");
  with_number(
      command, "--breaks", 1, 100, "N, 1 to 100", [&breaking](double value) { breaking = breaking_values(value); },
      "The same, for an object that this force breaks")
      ->type_name("N")
      ->excludes(preset)
      ->group("Limits");
}

void with_limits(CLI::App *command, std::map<std::string, double> &limits) {
  const auto models = gripper_models();
  const GripSettings usual = settings_for(models.front(), {});
  const GripSettings servo = settings_for(models.back(), {});
  for (const GraspSetting &setting : grasp_settings()) {
    const std::string range = plain(setting.low) + " to " + plain(setting.high), unit = setting.unit;
    with_number(
        command, std::string("--") + setting.name, setting.low, setting.high, unit + (unit.empty() ? "" : ", ") + range,
        [&limits, &setting](double value) { limits[setting.name] = value; },
        std::string(setting.help) + ": " + range + default_of(setting, usual, servo))
        ->type_name(*setting.unit ? setting.unit : "X")
        ->group("Limits");
  }
}

} // namespace

void add_grasp(CommandLine &line) {
  auto options = std::make_shared<GraspOptions>();
  CLI::App *command = line.add("grasp", "Hold an object between two fingertips on a gripper",
                               [options] { return run_grasp(*options); });
  command->add_option("--gripper", options->gripper.model, gripper_model_names())->required()->type_name("MODEL");
  command
      ->add_option("--gripper-port", options->gripper.port,
                   "Its serial line; default: the only one on USB that is no fingertip")
      ->type_name("PATH");
  command->add_option("--left", options->left, "Fingertip; default: the first of two")->type_name("SERIAL|PORT");
  command->add_option("--right", options->right, "Fingertip; default: the other")->type_name("SERIAL|PORT");
  command->add_flag("--activate", options->activate,
                    "Activate a gripper that is not: it moves, and drops what it holds");
  with_seconds(command, options->seconds, "End after this long, the gripper holding");
  command->add_option("-o,--record", options->recording, "Record all of it")->type_name("FILE.csv|FILE.mcap");
  command->add_flag("--overwrite", options->overwrite, "Replace the recording if it exists");
  command->add_flag("--quiet", options->quiet, "Print only changes, on standard error");
  with_transport(command, options->reach);
  with_colour(command, options->colour);
  with_gripper_line(command, options->gripper);
  with_presets(command, options->breaking);
  with_limits(command, options->limits);
  command->footer(
      "Keys, on a terminal: q end, holding; o open; h hold; g grasp.\n\nExit status:\n  0  as asked, the gripper "
      "holding or open\n  1  an error, which is named\n  2  wrong usage\n  3  it closed, and nothing was there\n  4  "
      "the object fell\n  5  the gripper failed, was not active, or did not answer at the end");
}

} // namespace fingertip
