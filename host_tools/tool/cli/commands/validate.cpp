#include "tool/cli/validate.hpp"

#include "libfingertip/text.hpp"
#include "tool/cli/commands/commands.hpp"
#include "tool/cli/usage.hpp"

#include <algorithm>
#include <cmath>
#include <memory>

namespace fingertip {

namespace {

int validate(const ValidateOptions &options) {
  if (!options.sheet.empty()) {
    return run_validate(options);
  }
  if (options.card.empty() && options.figures.empty()) {
    throw WrongUsage("no place for the card; give -o CARD.html, or --template SHEET.pdf for the "
                     "template");
  }
  if (options.from.empty() && !(options.weight_g > 0.0)) {
    throw WrongUsage("the weight is not known; give --weight GRAMS, or --from a recording of a "
                     "validation");
  }
  if (options.from.empty() && options.recording.empty()) {
    throw WrongUsage("no place for the recording; give --record FILE.csv");
  }
  const double share = options.pulling.weight_g / std::max(options.weight_g, 1.0);
  if (options.pulling.weight_g > 0.0 && (share < validating::PULL_SHARE_MIN || share > validating::PULL_SHARE_MAX)) {
    throw WrongUsage("a pull of " + fixed(options.pulling.weight_g, 0) + " g is " + fixed(share, 2) +
                     " of the weight; give --pull from " +
                     fixed(std::ceil(validating::PULL_SHARE_MIN * options.weight_g), 0) + " to " +
                     fixed(std::floor(validating::PULL_SHARE_MAX * options.weight_g), 0) +
                     " grams, so that it shows and the weight does not slide");
  }
  return run_validate(options);
}

} // namespace

void add_validate(CommandLine &line) {
  auto options = std::make_shared<ValidateOptions>();
  CLI::App *command =
      line.add("validate", "Make a pad's report card in ten minutes, with one weight and a printed template",
               [options] { return validate(*options); });
  with_port(command, options->choice);
  CLI::Option *sheet =
      command
          ->add_option("--template", options->sheet, "Only write the template to print at 1:1, with the marks to press")
          ->type_name("SHEET.pdf|SHEET.svg");
  CLI::Option *weight = command->add_option("--weight", options->weight_g, "Mass of the weight")
                            ->check(CLI::Range(50.0, 2000.0))
                            ->excludes(sheet)
                            ->type_name("GRAMS");
  CLI::Option *skin = command->add_option("--skin", options->skin_mm, "Rubber above the sensors, as it was cast")
                          ->check(CLI::Range(4.0, 30.0))
                          ->excludes(sheet)
                          ->capture_default_str()
                          ->type_name("MM");
  CLI::Option *pull = command
                          ->add_option("--pull", options->pulling.weight_g,
                                       "Also measure pulls: mass on a level thread, over a "
                                       "pulley, that pulls the weight; a third of --weight")
                          ->check(CLI::Range(10.0, 1000.0))
                          ->excludes(sheet)
                          ->type_name("GRAMS");
  CLI::Option *height =
      command->add_option("--thread-height", options->pulling.height_mm, "Height of that thread above the rubber")
          ->check(CLI::Range(0.0, 10.0))
          ->needs(pull)
          ->capture_default_str()
          ->type_name("MM");
  CLI::Option *record = command
                            ->add_option("--record", options->recording,
                                         "The recording that is kept, to send or to make the card from again: it holds "
                                         "what was measured, and no name, port or serial number")
                            ->excludes(sheet)
                            ->type_name("FILE.csv");
  CLI::Option *serial =
      command->add_flag("--serial", options->serial, "Keep the serial number in the recording")->excludes(sheet);
  command->add_option("--from", options->from, "Make the card from a recording that validate kept")
      ->excludes(sheet, weight, skin, pull, height, record, serial)
      ->type_name("FILE.csv");
  command->add_option("-o,--output", options->card, "The card, a page with pictures")
      ->excludes(sheet)
      ->type_name("CARD.html");
  command->add_option("--figures", options->figures, "The card's figures, for programs")
      ->excludes(sheet)
      ->type_name("FILE.json");
  command->add_flag("--overwrite", options->overwrite, "Replace files that exist");
  with_colour(command, options->colour);
}

} // namespace fingertip
