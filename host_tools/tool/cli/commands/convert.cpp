#include "libfingertip/line_sink.hpp"
#include "libfingertip/line_source.hpp"
#include "libfingertip/text.hpp"
#include "tool/cli/command_line.hpp"
#include "tool/cli/converter.hpp"

#include <filesystem>
#include <fstream>
#include <memory>

namespace fingertip {

namespace {

/* Whether its content is a recording; the reader reports a file that is neither. */
bool is_recording(const std::string &path) {
  std::string begin(12, '\0');
  std::ifstream(path, std::ios::binary).read(begin.data(), 12);
  return begin == "# fingertip-" || is_mcap(path);
}

int convert(const Conversion &conversion) {
  const auto end = std::filesystem::path(conversion.to).extension();
  const bool to_capture = end == ".ftr";
  if (!to_capture && end != ".csv" && !is_mcap_name(conversion.to)) {
    throw WrongUsage("\"" + printable(conversion.to) +
                     "\" must end with .csv, .mcap or .ftr, which selects the format");
  }
  if (to_capture) {
    convert_to_capture(conversion);
  } else if (conversion.device.empty() && is_recording(conversion.from)) {
    convert_lines(conversion);
  } else {
    convert_packets(conversion);
  }
  return 0;
}

} // namespace

void add_convert(CommandLine &line) {
  auto options = std::make_shared<Conversion>();
  CLI::App *command =
      line.add("convert", "Turn a recording or a capture into another kind", [options] { return convert(*options); });
  command->add_option("from", options->from, "Recording (.csv, .mcap) or bytes of the line (.ftr)")
      ->required()
      ->type_name("FILE");
  command->add_option("to", options->to, "File to write; its ending selects the format")
      ->required()
      ->type_name("OUT.csv|OUT.mcap|OUT.ftr");
  command
      ->add_option("--device", options->device,
                   "Serial number of one of several fingertips in the recording; only this one")
      ->type_name("SERIAL");
  command->add_flag("--salvage", options->salvage, "Read what is readable of a damaged file, and report the rest");
  command->add_flag("--overwrite", options->overwrite, "Replace OUT if it exists");
}

} // namespace fingertip
