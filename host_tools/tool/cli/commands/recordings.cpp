/* replay and convert: recordings and captures shown, and turned into one another. */
#include "libfingertip/clock.hpp"
#include "libfingertip/command.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/line_sink.hpp"
#include "libfingertip/line_source.hpp"
#include "libfingertip/output_file.hpp"
#include "libfingertip/packet_fields.hpp"
#include "libfingertip/packet_file.hpp"
#include "libfingertip/progress_bar.hpp"
#include "libfingertip/recording_writer.hpp"
#include "libfingertip/text.hpp"
#include "tool/cli/command_line.hpp"
#include "tool/cli/playback.hpp"
#include "tool/cli/view.hpp"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <unistd.h>

namespace fingertip {

namespace {

struct Conversion {
  std::string from, to;
  std::string device; /* of several in the file; empty: all, or the only one */
  bool salvage = false;
  bool overwrite = false;
  bool every_row = false; /* in all kinds of messages of an MCAP file */
  TimeSpan interval;
};

using Count = unsigned long long;

/* The share of a file that was read; the place in it is asked for now and then. */
class Reading {
public:
  explicit Reading(const std::string &path) : size_(static_cast<double>(open_bytes(path)->size())), bar_("reading") {}

  template <typename Place> void show(const Place &place) {
    constexpr unsigned AT_ONCE = 4096;
    if (count_++ % AT_ONCE == AT_ONCE - 1) {
      bar_.show(static_cast<double>(place().offset) / size_);
    }
  }
  void show(PacketFile &file) {
    show([&] {
      const auto place = file.place();
      return place.in_recording ? place.in_recording->in_file : LineSource::Place{static_cast<std::streamoff>(place.state.offset)};
    });
  }

private:
  double size_;
  unsigned count_ = 0;
  ProgressBar bar_;
};

Error no_frames(const std::string &path, const TimeSpan &interval) {
  return Error(path + (interval.is_all() ? ": no frames in it; give a recording or capture of a streaming fingertip"
                                         : ": no frames from --from to --to; give a part that has some"));
}

/* The facts of a file that is read for them once. */
struct Contents {
  std::optional<wire_info> info; /* the first */
  std::optional<std::uint8_t> sensor_count;
  std::uint64_t frames = 0; /* packets of them */
  std::uint64_t left_out = 0;
  Metadata recorder;
};

Contents contents_of(const Conversion &conversion) {
  PacketFile file(conversion.from, conversion.salvage, conversion.device, conversion.interval);
  Contents contents;
  Reading reading(conversion.from);
  while (auto item = file.next()) {
    reading.show(file);
    if (item->kind != PacketFile::Item::Kind::packet || item->made) {
      if (item->made && !contents.info) {
        contents.info = item->packet.body.info;
      }
      continue;
    }
    const wire_packet &packet = item->packet;
    contents.frames += is_frame(packet);
    constexpr std::uint8_t KEPT[] = {WIRE_CONTACT, WIRE_RAW, WIRE_HEALTH, WIRE_INFO, WIRE_ACK, WIRE_SYNC};
    contents.left_out += std::find(std::begin(KEPT), std::end(KEPT), packet.type) == std::end(KEPT);
    if (packet.type == WIRE_INFO && !contents.info) {
      contents.info = packet.body.info;
    } else if (packet.type == WIRE_RAW && !contents.sensor_count) {
      contents.sensor_count = packet.body.raw.sensor_count;
    }
  }
  contents.recorder = file.recorder_metadata();
  if (contents.frames == 0) {
    throw no_frames(conversion.from, conversion.interval);
  }
  return contents;
}

/* On standard error: damaged lines, a missing end. */
void report_losses(const std::string &path, const RecordingReader *reader, bool is_cut_short) {
  for (std::size_t i = 0; reader && i < reader->damages().size(); i++) {
    std::fprintf(stderr, "%s\n", printable(reader->damages()[i]).c_str());
  }
  if (reader && reader->skipped_lines() > 0) {
    std::fprintf(stderr, "%s: %llu damaged lines skipped\n", printable(path).c_str(), static_cast<Count>(reader->skipped_lines()));
  }
  if (is_cut_short) {
    std::fprintf(stderr, "%s: no end line: the recording was cut short, its recorder killed or its disk full\n", printable(path).c_str());
  }
}

std::unique_ptr<LineSink> sink_of(const Conversion &conversion) {
  auto sink = make_lines(conversion.to, conversion.overwrite, OutputFile::Appears::when_finished);
  if (conversion.every_row) {
    sink->repeat_every_row();
  }
  return sink;
}

/* To a recording of one fingertip, packet by packet, with counts of its own in the end line. Throws Error. */
void convert_packets(const Conversion &conversion) {
  Contents contents = contents_of(conversion);
  Metadata metadata = {{"recorded_by", "fingertip " FINGERTIP_VERSION}, {"source", conversion.from}};
  for (const auto &[key, value] : contents.recorder) {
    bool replaced = key == "recorded_by" || key == "source" || key == "host_zero_us";
    if (!replaced) {
      metadata.emplace_back(key, value);
    }
  }
  RecordingWriter writer(sink_of(conversion), contents.info ? &*contents.info : nullptr,
                         contents.sensor_count.value_or(contents.info ? contents.info->sensor_count : std::uint8_t{0}), metadata,
                         contents.sensor_count.has_value());
  PacketFile file(conversion.from, conversion.salvage, conversion.device, conversion.interval);
  Reading reading(conversion.from);
  while (auto item = file.next()) {
    reading.show(file);
    if (item->kind == PacketFile::Item::Kind::packet && !item->made) {
      writer.packet(item->packet);
    } else if (item->kind == PacketFile::Item::Kind::event) {
      writer.event(0, item->event);
    }
  }
  writer.finish({file.statistics()}, "converted");
  report_losses(conversion.from, file.recording(), file.is_cut_short());
  if (contents.left_out > 0) {
    std::fprintf(stderr, "%s: %llu packets are of kinds that recordings leave out\n", printable(conversion.from).c_str(),
                 static_cast<Count>(contents.left_out));
  }
  std::printf("%s: %llu frames, %s\n", printable(conversion.to).c_str(), static_cast<Count>(writer.frames()),
              file.statistics().text().c_str());
}

/* To a recording, line by line: nothing is lost, nothing changed. What is no line of a recording is refused, or kept as a comment. Throws
 * Error. */
void convert_lines(const Conversion &conversion) {
  RecordingReader reader(conversion.from, conversion.salvage, within(open_lines(conversion.from), conversion.interval));
  auto sink = sink_of(conversion);
  Reading reading(conversion.from);
  std::uint64_t count = 0, frames = 0;
  reader.set_on_line([&](const LineSource::Line &line, bool is_read) {
    sink->line(is_read ? line.text : "# unread: " + printable(line.text));
    count++;
    reading.show([&] { return reader.place().in_file; });
  });
  while (auto item = reader.next()) {
    frames += item->kind == RecordingReader::Item::Kind::packet && is_frame(item->packet);
  }
  if (!conversion.interval.is_all() && frames == 0) {
    throw no_frames(conversion.from, conversion.interval);
  }
  sink->finish();
  report_losses(conversion.from, &reader, !reader.has_end());
  std::printf("%s: %llu lines\n", printable(conversion.to).c_str(), static_cast<Count>(count));
}

/* To the bytes of the line. */
void convert_to_capture(const Conversion &conversion) {
  contents_of(conversion); /* throws before anything is written */
  OutputFile capture(conversion.to, conversion.overwrite, OutputFile::Appears::when_finished);
  PacketFile file(conversion.from, conversion.salvage, conversion.device, conversion.interval);
  std::uint64_t packets = 0;
  while (auto item = file.next()) {
    if (item->kind == PacketFile::Item::Kind::packet) {
      const auto bytes = frame_bytes(item->packet);
      capture.append(bytes.data(), bytes.size());
      packets++;
    }
  }
  capture.finish();
  report_losses(conversion.from, file.recording(), file.is_cut_short());
  std::printf("%s: %llu packets, without the recorder's own lines\n", printable(conversion.to).c_str(), static_cast<Count>(packets));
}

int convert(const Conversion &conversion) {
  const auto end = std::filesystem::path(conversion.to).extension();
  const bool to_capture = end == ".ftr";
  if (!to_capture && end != ".csv" && end != ".CSV" && !is_mcap_name(conversion.to)) {
    throw WrongUsage("\"" + printable(conversion.to) + "\" must end with .csv, .mcap or .ftr, which selects the format");
  }
  if (conversion.every_row && !is_mcap_name(conversion.to)) {
    throw WrongUsage("--every-row is for MCAP files; leave it out, or let OUT end with .mcap");
  }
  if (is_same_file(conversion.from, conversion.to)) {
    throw Error(conversion.to + ": is the file to read; give another name");
  }
  check_output(conversion.to, conversion.overwrite);
  if (to_capture) {
    convert_to_capture(conversion);
  } else if (conversion.device.empty() && is_recording(conversion.from, *open_bytes(conversion.from))) {
    convert_lines(conversion);
  } else {
    convert_packets(conversion);
  }
  return 0;
}

struct ReplayOptions {
  std::string file;
  double speed = 1; /* 0: as fast as possible */
  bool salvage = false;
  std::string device; /* of several in the file */
  ColourMode colour = ColourMode::automatic;
  TimeSpan interval;
};

/* --from and --to. */
void with_time_span(CLI::App *command, TimeSpan &interval) {
  const auto seconds = [command](const char *name, double &to, const char *help) {
    const auto set = [name, &to](const std::string &text) {
      const auto s = to_double(text);
      if (!s || *s < 0) {
        wrong_value(name, text, "seconds since the recording began, 0 or more");
      }
      to = *s;
    };
    command->add_option_function<std::string>(name, set, help)->type_name("S");
  };
  seconds("--from", interval.from_s, "Leave out what is before, in seconds since the recording began");
  seconds("--to", interval.to_s, "Leave out what is after");
}

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
  Playback playback(options.file, options.salvage, options.device, options.speed, options.interval);
  std::string name = printable(options.file);
  std::unique_ptr<View> view = playback.grip() ? make_grasp_view(options.colour, *playback.grip()) : make_monitor_view(options.colour);
  while (!playback.is_over() && !stop_requested() && is_standard_output_read()) {
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
      throw no_frames(options.file, options.interval);
    }
    report_losses(options.file, track.file().recording(), track.file().is_cut_short());
    bool several = playback.tracks().size() > 1;
    std::printf("%s: %s%s\n", name.c_str(), several && model.info() ? (text_field(model.info()->serial) + ": ").c_str() : "",
                summary_text(model).c_str());
  }
  return 0;
}

} // namespace

void add_replay(CommandLine &line) {
  auto options = std::make_shared<ReplayOptions>();
  CLI::App *command = line.add("replay", "Show a recording or a capture of bytes", [options] { return show(*options); });
  command->footer("Example: fingertip replay press.csv --speed 2");
  with_value(command, "FILE", "file", options->file, "Recording (.csv, .mcap) or bytes of the line (.ftr)")->required();
  command
      ->add_option_function<std::string>(
          "--speed", [options](const std::string &text) { options->speed = speed_from_text(text); },
          "Times the recorded speed, or max; default 1")
      ->type_name("X|max");
  with_value(command, "SERIAL", "--device", options->device,
             "Serial number of one of several fingertips in the recording; default: show all");
  command->add_flag("--salvage", options->salvage, "Skip damaged lines and count them");
  with_time_span(command, options->interval);
  with_colour(command, options->colour);
}

void add_convert(CommandLine &line) {
  auto options = std::make_shared<Conversion>();
  CLI::App *command = line.add("convert", "Turn a recording or a capture into another kind", [options] { return convert(*options); });
  command->footer("Example: fingertip convert press.csv press.mcap");
  with_value(command, "FILE", "from", options->from, "Recording (.csv, .mcap) or bytes of the line (.ftr)")->required();
  with_value(command, "OUT.csv|OUT.mcap|OUT.ftr", "to", options->to, "File to write; its ending selects the format")->required();
  with_value(command, "SERIAL", "--device", options->device, "Serial number of one of several fingertips in the recording; only this one");
  command->add_flag("--salvage", options->salvage, "Read what is readable of a damaged file, and report the rest");
  command->add_flag("--overwrite", options->overwrite, "Replace OUT if it exists");
  command->add_flag("--every-row", options->every_row,
                    "Into OUT.mcap: repeat each row as wrench, location and pressures, not 100 a second");
  with_time_span(command, options->interval);
}

} // namespace fingertip
