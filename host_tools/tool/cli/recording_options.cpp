#include "tool/cli/recording_options.hpp"

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

void with_several(CLI::App *command, Several &several) {
  command->add_option("--device", several.devices, "Serial number of the fingertip; several are taken on one clock")
      ->take_all()
      ->expected(1)
      ->type_name("SERIAL");
  with_port_only(command, several.choice);
  command->add_flag("--all", several.all, "Every fingertip there is, on one clock");
}

std::vector<Way> ways_of(const Several &several) {
  if (several.all) {
    auto ways = all_ways(several.choice.reach);
    if (!ways.empty()) {
      return ways;
    }
  }
  std::vector<Way> ways;
  for (const std::string &device : several.devices) {
    ways.push_back(choose_way({several.choice.port, device, several.choice.reach}));
  }
  if (ways.empty()) {
    ways.push_back(choose_way(several.choice));
  }
  return ways;
}

void with_seconds(CLI::App *command, std::optional<double> &seconds, const std::string &help) {
  command
      ->add_option_function<std::string>(
          "--seconds", [&seconds](const std::string &text) { seconds = seconds_from_text(text); }, help)
      ->type_name("S");
}

void with_recording(CLI::App *command, LiveOptions &options) {
  with_seconds(command, options.seconds, "End after this much device time");
  command->add_option("--raw-bytes", options.raw_bytes, "Also keep the bytes of the line as they came")
      ->type_name("FILE.ftr");
  command->add_flag("--overwrite", options.overwrite, "Replace files that exist");
  command->add_flag("--until-gone", options.until_gone, "End when the port vanishes, instead of waiting for it");
}

} // namespace fingertip
