/* monitor and record. */
#include "tool/cli/live.hpp"

#include "tool/cli/command_line.hpp"

#include <memory>

namespace fingertip {

namespace {

struct Options {
  Choice choice; /* without the device */
  std::vector<std::string> devices;
  bool all = false;
  LiveOptions live;
};

/* Throws Error if there is no fingertip, or it is not clear which. */
std::vector<Way> ways_of(const Options &options) {
  std::vector<Way> ways;
  if (options.all) {
    ways = all_ways(options.choice.reach);
  }
  if (!ways.empty()) {
    return ways;
  }
  for (const std::string &device : options.devices) {
    ways.push_back(choose_way({options.choice.port, device, options.choice.reach}));
  }
  if (ways.empty()) {
    ways.push_back(choose_way(options.choice));
  }
  return ways;
}

int run(const Options &options) {
  const LiveOptions &live = options.live;
  if (live.recording == STDOUT_NAME && live.monitor) {
    throw WrongUsage("monitor shows on standard output; give --record a file, or use `fingertip record -`");
  }
  if (live.recording == STDOUT_NAME && (options.all || options.devices.size() > 1)) {
    throw WrongUsage("several fingertips need a file; for - run one `fingertip record - --device SERIAL` for each");
  }
  if (live.raw_bytes == STDOUT_NAME) {
    throw WrongUsage("--raw-bytes needs a file; give it a name");
  }
  check_outputs(live);
  return run_live(live, ways_of(options));
}

CLI::App *add(CommandLine &line, const std::string &name, const std::string &help,
              const std::shared_ptr<Options> &options) {
  CLI::App *command = line.add(name, help, [options] { return run(*options); });
  command->add_option("--device", options->devices, "Serial number of the fingertip; several are taken on one clock")
      ->take_all()
      ->expected(1)
      ->type_name("SERIAL");
  with_port_only(command, options->choice);
  command->add_flag("--all", options->all, "Every fingertip there is, on one clock");
  with_seconds(command, options->live.seconds, "End after this much device time");
  command->add_option("--raw-bytes", options->live.raw_bytes, "Also keep the bytes of the line as they came")
      ->type_name("FILE.ftr");
  command->add_flag("--overwrite", options->live.overwrite, "Replace files that exist");
  command->add_flag("--until-gone", options->live.until_gone, "End when the port vanishes, instead of waiting for it");
  return command;
}

} // namespace

void add_monitor(CommandLine &line) {
  auto options = std::make_shared<Options>();
  CLI::App *command = add(line, "monitor", "Show live what fingertips feel", options);
  command->add_option("--record", options->live.recording, "Record at the same time")->type_name("FILE.csv|FILE.mcap");
  with_colour(command, options->live.colour);
}

void add_record(CommandLine &line) {
  auto options = std::make_shared<Options>();
  options->live.monitor = false;
  add(line, "record", "Record every frame to a CSV or MCAP file, until Ctrl-C", options)
      ->add_option("file", options->live.recording,
                   "The recording to write, CSV or MCAP by its name; -: standard output, each row as it comes")
      ->required()
      ->type_name("FILE.csv|FILE.mcap|-");
}

} // namespace fingertip
