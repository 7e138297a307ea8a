#include "tool/cli/commands/commands.hpp"
#include "tool/cli/live.hpp"
#include "tool/cli/recording_options.hpp"
#include "tool/cli/usage.hpp"

#include <memory>

namespace fingertip {

namespace {

struct MonitorOptions {
  Several several;
  LiveOptions live;
};

int monitor(const MonitorOptions &options) {
  if (options.live.recording == STDOUT_NAME) {
    throw WrongUsage("monitor shows on standard output; give --record a file, or use `fingertip "
                     "record -`");
  }
  if (options.live.raw_bytes == STDOUT_NAME) {
    throw WrongUsage("--raw-bytes needs a file; give it a name");
  }
  check_outputs(options.live);
  return run_live(options.live, ways_of(options.several));
}

} // namespace

void add_monitor(CommandLine &line) {
  auto options = std::make_shared<MonitorOptions>();
  CLI::App *command = line.add("monitor", "Show live what fingertips feel", [options] { return monitor(*options); });
  with_several(command, options->several);
  with_recording(command, options->live);
  command->add_option("--record", options->live.recording, "Record at the same time")->type_name("FILE.csv|FILE.mcap");
  with_colour(command, options->live.colour);
}

} // namespace fingertip
