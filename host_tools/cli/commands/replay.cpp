#include "cli/commands/commands.hpp"
#include "cli/playback.hpp"
#include "cli/view.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/output_file.hpp"
#include "libfingertip/packet_fields.hpp"
#include "libfingertip/packet_file.hpp"
#include "libfingertip/recording_writer.hpp"
#include "libfingertip/text.hpp"

#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>
#include <thread>

namespace fingertip {

namespace {

using Clock = std::chrono::steady_clock;

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

using Kind = PacketFile::Item::Kind;

PacketFile open_file(const ReplayOptions &options) {
  return PacketFile(options.file, options.salvage, options.device);
}

bool is_frame(const wire_packet &packet) {
  return packet.type == WIRE_CONTACT || packet.type == WIRE_RAW;
}

void report_losses(const ReplayOptions &options, const PacketFile &file) {
  std::string name = printable(options.file);
  if (file.skipped_lines() > 0) {
    std::fprintf(stderr, "%s: %llu damaged lines skipped\n", name.c_str(),
                 static_cast<unsigned long long>(file.skipped_lines()));
  }
  if (file.is_cut_short()) {
    std::fprintf(stderr,
                 "%s: no end line: the recording was cut short, its recorder killed or its disk "
                 "full\n",
                 name.c_str());
  }
}

/* Of a file that is read for them once. */
struct Contents {
  std::optional<wire_info> info; /* the first */
  std::optional<std::uint8_t> sensor_count;
  std::uint64_t frames = 0; /* packets of them */
  Metadata recorder;
};

Contents contents_of(const ReplayOptions &options) {
  PacketFile file = open_file(options);
  Contents contents;
  while (auto item = file.next()) {
    if (item->kind != Kind::packet) {
      continue;
    }
    const wire_packet &packet = item->packet;
    contents.frames += is_frame(packet);
    if (packet.type == WIRE_INFO && !contents.info) {
      contents.info = packet.body.info;
    } else if (packet.type == WIRE_RAW && !contents.sensor_count) {
      contents.sensor_count = packet.body.raw.sensor_count;
    }
  }
  contents.recorder = file.recorder_metadata();
  return contents;
}

int convert(const ReplayOptions &options) {
  if (is_same_file(options.file, options.to_csv)) {
    throw Error(options.to_csv + ": is the file to read; give --to-csv another name");
  }
  check_output(options.to_csv, options.overwrite);
  Contents contents = contents_of(options);
  if (contents.frames == 0) {
    throw Error(options.file + ": no frames in it; give a capture of a streaming fingertip");
  }
  Metadata metadata = {{"recorded_by", "fingertip " FINGERTIP_VERSION}, {"source", options.file}};
  for (const auto &[key, value] : contents.recorder) {
    bool told = key == "recorded_by" || key == "source" || key == "host_zero_us";
    if (!told) {
      metadata.emplace_back(key, value);
    }
  }
  RecordingWriter writer(
      options.to_csv, options.overwrite, contents.info ? &*contents.info : nullptr,
      contents.sensor_count.value_or(contents.info ? contents.info->sensor_count : std::uint8_t{0}),
      metadata, contents.sensor_count.has_value(), OutputFile::Appears::when_finished);
  PacketFile file = open_file(options);
  while (auto item = file.next()) {
    if (item->kind == Kind::packet) {
      writer.packet(item->packet);
    } else {
      writer.event(item->event);
    }
  }
  writer.finish(file.statistics(), "converted");
  report_losses(options, file);
  std::printf("%s: %llu frames, %s\n", printable(options.to_csv).c_str(),
              static_cast<unsigned long long>(writer.frames()), file.statistics().text().c_str());
  return 0;
}

int show(const ReplayOptions &options) {
  Playback playback(options.file, options.salvage, options.device, options.speed);
  std::string name = printable(options.file);
  std::unique_ptr<View> view = playback.grip() ? make_grasp_view(options.colour, *playback.grip())
                                               : make_monitor_view(options.colour);
  while (!playback.is_over() && !stop_requested()) {
    playback.step(Clock::now());
    view->update(playback.models(), playback.caption(name));
    while (auto key = view->key()) {
      playback.key(*key);
      view->hurry();
    }
    std::this_thread::sleep_until(playback.next_step(Clock::now()));
  }
  view.reset();
  for (std::size_t i = 0; i < playback.tracks().size(); i++) {
    const Track &track = playback.tracks()[i];
    const Model &model = playback.models()[i];
    if (model.frames() == 0 && track.is_ended()) {
      throw Error(options.file +
                  ": no frames in it; give a recording or capture of a streaming fingertip");
    }
    report_losses(options, track.file());
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
    return options->to_csv.empty() ? show(*options) : convert(*options);
  });
  command->add_option("file", options->file, "Recording (.csv) or bytes of the line (.ftr)")
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
  command->add_option("--to-csv", options->to_csv, "Write a recording instead of showing it")
      ->type_name("OUT.csv");
  command->add_flag("--overwrite", options->overwrite, "Replace OUT.csv if it exists");
  with_colour(command, options->colour);
}

} // namespace fingertip
