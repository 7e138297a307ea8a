#include "libfingertip/clock.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/packet_fields.hpp"
#include "libfingertip/packet_file.hpp"
#include "libfingertip/text.hpp"
#include "tool/cli/command_line.hpp"
#include "tool/cli/converter.hpp"
#include "tool/cli/playback.hpp"
#include "tool/cli/view.hpp"

#include <cstdio>
#include <memory>

namespace fingertip {

namespace {

struct ReplayOptions {
  std::string file;
  double speed = 1; /* 0: as fast as possible */
  bool salvage = false;
  std::string device; /* of several in the file */
  std::string to_csv; /* empty: show it */
  bool overwrite = false;
  ColourMode colour = ColourMode::automatic;
};

double speed_from_text(const std::string &text) {
  if (text == "max") {
    return 0;
  }
  auto speed = to_double(text);
  if (!speed || *speed < 0.01 || *speed > 1000) {
    wrong_value("--speed", text, "0.01 to 1000, or max");
  }
  return *speed;
}

int show(const ReplayOptions &options) {
  Playback playback(options.file, options.salvage, options.device, options.speed);
  std::string name = printable(options.file);
  std::unique_ptr<View> view =
      playback.grip() ? make_grasp_view(options.colour, *playback.grip()) : make_monitor_view(options.colour);
  while (!playback.is_over() && !stop_requested()) {
    playback.step(host_now());
    view->update(playback.models(), playback.caption(name));
    while (auto key = view->key()) {
      playback.key(*key);
      view->hurry();
    }
    wait_until(playback.next_step(host_now()));
  }
  view.reset();
  for (std::size_t i = 0; i < playback.tracks().size(); i++) {
    const FingertipTrack &track = playback.tracks()[i];
    const Model &model = playback.models()[i];
    if (model.frames() == 0 && track.is_ended()) {
      throw Error(options.file + ": no frames in it; give a recording or capture of a streaming fingertip");
    }
    report_losses(options.file, track.file());
    bool several = playback.tracks().size() > 1;
    std::printf("%s: %s%s\n", name.c_str(),
                several && model.info() ? (text_field(model.info()->serial) + ": ").c_str() : "",
                summary_text(model).c_str());
  }
  return 0;
}

} // namespace

void add_replay(CommandLine &line) {
  auto options = std::make_shared<ReplayOptions>();
  CLI::App *command = line.add("replay", "Show a recording or a capture of bytes", [options] {
    if (options->to_csv.empty()) {
      return show(*options);
    }
    convert_packets({options->file, options->to_csv, options->device, options->salvage, options->overwrite});
    return 0;
  });
  command->add_option("file", options->file, "Recording (.csv, .mcap) or bytes of the line (.ftr)")
      ->required()
      ->type_name("FILE");
  command
      ->add_option_function<std::string>(
          "--speed", [options](const std::string &text) { options->speed = speed_from_text(text); },
          "Times the recorded speed, or max; default 1")
      ->type_name("X|max");
  command
      ->add_option("--device", options->device,
                   "Serial number of one of several fingertips in the recording; default: show all")
      ->type_name("SERIAL");
  command->add_flag("--salvage", options->salvage, "Skip damaged lines and count them");
  command->add_option("--to-csv", options->to_csv, "Write a recording instead of showing it")->type_name("OUT.csv");
  command->add_flag("--overwrite", options->overwrite, "Replace OUT.csv if it exists");
  with_colour(command, options->colour);
}

} // namespace fingertip
