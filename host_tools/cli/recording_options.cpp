#include "cli/recording_options.hpp"

#include "libfingertip/text.hpp"

namespace fingertip {

namespace {

double seconds_from_text(const std::string &text) {
  auto seconds = to_double(text);
  if (!seconds || *seconds < 0.001 || *seconds > 1e9) {
    wrong_value("--seconds", text, "a number from 0.001 to 1e9");
  }
  return *seconds;
}

} // namespace

void with_recording(CLI::App *command, LiveOptions &options) {
  command
      ->add_option_function<std::string>(
          "--seconds",
          [&options](const std::string &text) { options.seconds = seconds_from_text(text); },
          "End after this much device time")
      ->type_name("S");
  command
      ->add_option("--raw-bytes", options.raw_bytes, "Also keep the bytes of the line as they came")
      ->type_name("FILE.ftr");
  command->add_flag("--overwrite", options.overwrite, "Replace files that exist");
  command->add_flag("--until-gone", options.until_gone,
                    "End when the port vanishes, instead of waiting for it");
}

} // namespace fingertip
