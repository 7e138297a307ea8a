#include "cli/commands/commands.hpp"
#include "cli/live.hpp"
#include "cli/recording_options.hpp"
#include "cli/usage.hpp"

#include <memory>

namespace fingertip {

namespace {

struct RecordOptions {
  Choice choice; /* without the device */
  std::vector<std::string> devices;
  bool all = false;
  LiveOptions live;
};

std::vector<Way> ways_of(const RecordOptions &options) {
  if (options.all) {
    auto ways = all_ways(options.choice.reach);
    if (!ways.empty()) {
      return ways;
    }
  }
  std::vector<Way> ways;
  for (const std::string &device : options.devices) {
    ways.push_back(choose_way({options.choice.port, device, options.choice.reach}));
  }
  if (ways.empty()) {
    ways.push_back(choose_way(options.choice));
  }
  return ways;
}

int record(const RecordOptions &options) {
  if (options.live.recording == STANDARD_OUTPUT && (options.all || options.devices.size() > 1)) {
    throw WrongUsage("several fingertips need a file; for - run one `fingertip record - --device "
                     "SERIAL` for each");
  }
  if (options.live.raw_bytes == STANDARD_OUTPUT) {
    throw WrongUsage("--raw-bytes needs a file; give it a name");
  }
  check_outputs(options.live);
  std::vector<Way> ways = ways_of(options);
  if (ways.size() > 1 && !options.live.raw_bytes.empty()) {
    throw Error("--raw-bytes keeps one fingertip's line; leave it out, or record one fingertip");
  }
  return run_live(options.live, ways);
}

} // namespace

void add_record(CommandLine &line) {
  auto options = std::make_shared<RecordOptions>();
  options->live.monitor = false;
  CLI::App *command = line.add("record", "Record every frame to a CSV file, until Ctrl-C",
                               [options] { return record(*options); });
  command
      ->add_option("--device", options->devices,
                   "Serial number of the fingertip; several record on one clock")
      ->take_all()
      ->expected(1)
      ->type_name("SERIAL");
  with_port_only(command, options->choice);
  command->add_flag("--all", options->all, "Every fingertip there is, on one clock");
  command
      ->add_option("file", options->live.recording,
                   "The recording to write; -: standard output, each row as it comes")
      ->required()
      ->type_name("FILE.csv|-");
  with_recording(command, options->live);
}

} // namespace fingertip
