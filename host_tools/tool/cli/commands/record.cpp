#include "tool/cli/commands/commands.hpp"
#include "tool/cli/live.hpp"
#include "tool/cli/recording_options.hpp"
#include "tool/cli/usage.hpp"

#include <memory>

namespace fingertip {

namespace {

struct RecordOptions {
  Several several;
  LiveOptions live;
};

int record(const RecordOptions &options) {
  if (options.live.recording == STDOUT_NAME && options.several.is_several()) {
    throw WrongUsage("several fingertips need a file; for - run one `fingertip record - --device "
                     "SERIAL` for each");
  }
  if (options.live.raw_bytes == STDOUT_NAME) {
    throw WrongUsage("--raw-bytes needs a file; give it a name");
  }
  check_outputs(options.live);
  std::vector<Way> ways = ways_of(options.several);
  return run_live(options.live, ways);
}

} // namespace

void add_record(CommandLine &line) {
  auto options = std::make_shared<RecordOptions>();
  options->live.monitor = false;
  CLI::App *command = line.add("record", "Record every frame to a CSV or MCAP file, until Ctrl-C",
                               [options] { return record(*options); });
  with_several(command, options->several);
  command
      ->add_option("file", options->live.recording,
                   "The recording to write, CSV or MCAP by its name; -: standard output, each row as "
                   "it comes")
      ->required()
      ->type_name("FILE.csv|FILE.mcap|-");
  with_recording(command, options->live);
}

} // namespace fingertip
