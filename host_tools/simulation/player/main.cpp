// The fingertip without a chip: the firmware's own code, compiled for this machine.
#include "libfingertip/command.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/line_source.hpp"
#include "libfingertip/output_file.hpp"
#include "libfingertip/progress_bar.hpp"
#include "libfingertip/recording_writer.hpp"
#include "libfingertip/text.hpp"
#include "library/pad/edges.hpp"
#include "library/pad/profile.hpp"
#include "library/pad/table_file.hpp"
#include "simulation/player/native_fingertip.h"
#include "simulation/player/native_stages.h"
#include "simulation/player/scenario.hpp"
#include "tool/calibration/from_recording.hpp"
#include "tool/plain_help.hpp"

extern "C" {
#include "config/defaults.h"
#include "native/native_cdc.h"
#include "native/native_port.h"
}

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <cstring>
#include <functional>
#include <memory>
#include <optional>
namespace fingertip {
namespace {

// Small enough that the queue of the line, 4096 bytes, does not fill up at any rate.
constexpr std::uint64_t SLICE_us = 5000;
constexpr std::uint64_t FIRST_us = 100000; // for each of the first commands
constexpr double SECONDS_MAX = 24 * 3600;
constexpr std::uint32_t CALIBRATED_s = 1767225600; // 2026-01-01: the same bytes every day

struct PlayOptions {
  std::string scenario, recording, raw_bytes, commands, first, serial = "0000000000000001";
  std::string osr = "1024", rate = "max";
  std::vector<std::string> settings;
  double noise = 1.0, seconds = 0.0;
  std::uint64_t seed = 1;
  std::optional<double> pad_mm;
  bool from_touch = false;
  bool raw = false, replace = false, quiet = false;
};

double pressure_Pa(void *context, unsigned sensor, std::uint64_t t_us) {
  return static_cast<Scenario *>(context)->pressure_Pa(sensor, t_us);
}

double temperature_degC(void *context, unsigned, std::uint64_t t_us) { return static_cast<Scenario *>(context)->temperature_degC(t_us); }

/* The commands, each with a number of its own. */
class Commands {
public:
  void send(wire_packet packet) {
    packet.sequence = sequence_++;
    const std::vector<std::uint8_t> frame = frame_bytes(packet);
    if (native_cdc_send(frame.data(), frame.size()) != FT_OK) {
      throw Error("the firmware does not take its commands");
    }
    bytes_.insert(bytes_.end(), frame.begin(), frame.end());
  }
  const std::vector<std::uint8_t> &bytes() const { return bytes_; }

private:
  std::uint16_t sequence_ = 0;
  std::vector<std::uint8_t> bytes_;
};

// The file's bytes go to the decoder. Throws Error where it cannot be read.
void feed_file(const std::string &path, Decoder &decoder, const std::function<void(const wire_packet &)> &on_packet) {
  const std::vector<std::uint8_t> bytes = all_bytes(path);
  decoder.feed(bytes.data(), bytes.size(), on_packet);
}

std::vector<wire_packet> commands_in(const std::string &path) {
  std::vector<wire_packet> commands;
  Decoder decoder;
  feed_file(path, decoder, [&](const wire_packet &packet) { commands.push_back(packet); });
  if (commands.empty()) {
    throw Error(path + ": holds no commands; make it with fingertip_player calibrate");
  }
  return commands;
}

struct CalibrateOptions {
  std::string placements, commands;
  double force_N = 0.0, overhang_mm = 0.0;
  bool replace = false;
};

// Calibrates like fingertip calibrate --from: the thickness that is found makes the pad's profile.
int calibrate(const CalibrateOptions &options) {
  check_output(options.commands, options.replace);
  auto [info, session] = calibrating::gain_session_from(options.placements, "", [](const auto &, double) {});
  calibrating::refuse_unless_good(session.judgement());
  calibration made = session.made(options.force_N, CALIBRATED_s);
  const auto for_profile = pad::thickness_for_profile(info, made);
  if (for_profile) {
    session.expect_profile();
    made = session.made(options.force_N, CALIBRATED_s);
  }
  OutputFile file(options.commands, options.replace, OutputFile::Appears::when_finished);
  const auto write = [&](const wire_packet &packet) {
    const std::vector<std::uint8_t> frame = frame_bytes(packet);
    file.append(frame.data(), frame.size());
  };
  write(command_calibrate(made, info.sensor_count));
  if (for_profile) {
    pad_profile profile = pad::profile_of({for_profile->shown_mm(), options.overhang_mm}, info);
    info.calibration = made;
    info.stored |= WIRE_STORED_CALIBRATION;
    if (options.overhang_mm > 0.0) {
      profile.edges = pad::edges_of(profile, info, twin::default_cache_directory());
    }
    write(command_pad(profile));
  }
  file.finish();
  return 0;
}

int play(const PlayOptions &options) {
  // Everything that can be wrong is, before anything takes time.
  std::vector<WantedSetting> more;
  std::transform(options.settings.begin(), options.settings.end(), std::back_inserter(more), setting_from_text);
  std::vector<wire_packet> wanted;
  wire_info now{}; // what travels with a setting
  now.slip_threshold_mm = DEFAULT_SLIP_THRESHOLD_mm;
  now.slip_window_ms = DEFAULT_SLIP_WINDOW_ms;
  for (const auto &settings : {std::vector{setting_from_text("osr=" + options.osr)}, {setting_from_text("rate=" + options.rate)}, more}) {
    const std::vector<wire_packet> commands = setting_commands(settings, now);
    wanted.insert(wanted.end(), commands.begin(), commands.end());
  }
  std::optional<pad_profile> pad;
  if (options.pad_mm) {
    pad = pad::profile_over_own_sensors({*options.pad_mm, 0.0, options.from_touch});
  }
  const std::vector<wire_packet> first = options.first.empty() ? std::vector<wire_packet>() : commands_in(options.first);
  for (const std::string *path : {&options.recording, &options.raw_bytes, &options.commands}) {
    if (!path->empty()) {
      check_output(*path, options.replace);
    }
  }
  Scenario scenario(options.scenario);
  const double seconds = options.seconds > 0.0 ? options.seconds : scenario.end_s();

  native_fingertip_settings settings{};
  settings.seed = options.seed;
  settings.noise = options.noise;
  settings.prom_spread = 0.03;
  settings.world = {&scenario, pressure_Pa, temperature_degC};
  settings.pad = pad ? &*pad : nullptr;
  native_set_serial_number(options.serial.c_str());
  if (!native_fingertip_start(&settings)) {
    throw Error("--pad: this player reports no tangential force; build it with "
                "-DFINGERTIP_SCENE=grasp");
  }
  native_cdc_open();
  Commands commands;
  std::uint64_t begin_us = 0;
  for (const wire_packet &command : first) {
    commands.send(command);
    begin_us += FIRST_us;
    native_fingertip_run_until(begin_us);
  }
  for (const wire_packet &command : wanted) {
    commands.send(command);
  }
  std::uint8_t streams = WIRE_STREAM_CONTACT | WIRE_STREAM_HEALTH;
  streams |= options.raw ? WIRE_STREAM_RAW : 0;
  commands.send(command_stream(streams));
  commands.send(command_info());
  if (!options.commands.empty()) {
    OutputFile sent(options.commands, options.replace, OutputFile::Appears::when_finished);
    sent.append(commands.bytes().data(), commands.bytes().size());
    sent.finish();
  }
  std::optional<OutputFile> raw_bytes;
  if (!options.raw_bytes.empty()) {
    raw_bytes.emplace(options.raw_bytes, options.replace, OutputFile::Appears::when_finished);
  }

  Decoder decoder;
  std::optional<RecordingWriter> writer;
  std::string refused;
  const auto on_packet = [&](const wire_packet &packet) {
    if (packet.type == WIRE_ACK && packet.body.ack.result != WIRE_RESULT_DONE) {
      refused = "the firmware refused command " + std::to_string(packet.body.ack.command);
    }
    if (!writer && packet.type == WIRE_INFO) {
      const wire_info &info = packet.body.info;
      if (scenario.sensors() != info.sensor_count) {
        throw Error(options.scenario + ": has " + std::to_string(scenario.sensors()) + " sensors; this firmware has " +
                    std::to_string(info.sensor_count));
      }
      writer.emplace(make_lines(options.recording, options.replace, OutputFile::Appears::when_finished), &info, info.sensor_count,
                     Metadata{{"recorded_by", "fingertip_player"},
                              {"simulated", "the firmware's code on simulated sensors"},
                              {"scenario", scenario.name()},
                              {"seed", std::to_string(options.seed)}},
                     options.raw);
    }
    if (writer) {
      writer->packet(packet);
    }
  };
  std::optional<ProgressBar> progress;
  if (!options.quiet) {
    progress.emplace("playing " + scenario.name());
  }
  const auto end_us = static_cast<std::uint64_t>(1e6 * seconds);
  for (std::uint64_t t_us = begin_us + SLICE_us;; t_us += SLICE_us) {
    if (!native_fingertip_run_until(t_us < end_us ? t_us : end_us)) {
      throw Error("the firmware ended itself at " + std::to_string(t_us) + " us");
    }
    std::uint8_t bytes[NATIVE_CDC_TRANSMIT_BYTES];
    for (std::size_t count; (count = native_cdc_receive(bytes, sizeof bytes)) > 0;) {
      decoder.feed(bytes, count, on_packet);
      if (raw_bytes) {
        raw_bytes->append(bytes, count);
      }
    }
    if (!refused.empty()) {
      throw Error(refused);
    }
    if (progress) {
      progress->show(static_cast<double>(t_us) / static_cast<double>(end_us));
    }
    if (t_us >= end_us) {
      break;
    }
  }
  if (!writer) {
    throw Error(options.scenario + ": ends before the fingertip answers; make it longer than 0.1 s");
  }
  writer->finish({decoder.statistics()}, "seconds");
  if (raw_bytes) {
    raw_bytes->finish();
  }
  return 0;
}

// What a capture has, and how much of it this code gives again.
struct Repeated {
  std::uint64_t frames = 0, in_contact = 0, held = 0, equal = 0;
  std::string first_difference;
};

class Repeater {
public:
  void packet(const wire_packet &packet) {
    switch (packet.type) {
    case WIRE_INFO:
      if (!firmware_) {
        firmware_.reset(native_stages_of(&packet.body.info));
        if (!firmware_) {
          throw Error("the capture's info packet describes no array that this code can fit");
        }
      }
      break;
    case WIRE_ACK:
      if (packet.body.ack.result == WIRE_RESULT_DONE) {
        if (packet.body.ack.command == WIRE_CMD_TARE && firmware_) {
          native_stages_tare(firmware_.get());
          tared_ = true;
        } else if (packet.body.ack.command == WIRE_CMD_SLIP || packet.body.ack.command == WIRE_CMD_OSR) {
          throw Error("settings change within the capture; make one without \"set\"");
        }
      }
      break;
    case WIRE_CONTACT: contact_ = packet; break;
    case WIRE_RAW: frame(packet); break;
    default: break;
    }
  }
  const Repeated &result() const { return result_; }
  bool tared() const { return tared_; }
  // The first frame that has a raw packet only.
  std::optional<std::uint32_t> lonely_frame() const { return lonely_frame_; }

private:
  void frame(const wire_packet &raw) {
    if (!tared_) {
      return; // what came before decides about the zero, and is not known
    }
    if (!contact_ || contact_->body.contact.frame != raw.body.raw.frame) {
      lonely_frame_ = lonely_frame_.value_or(raw.body.raw.frame);
      return;
    }
    const bool held = contact_->body.contact.flags & CONTACT_FLAG_HELD;
    if (held && result_.frames == 0) {
      return; // it shows what was found before the tare
    }
    wire_packet ours = *contact_;
    native_stages_repeat(firmware_.get(), &raw, held, &ours.body.contact);
    result_.frames++;
    result_.held += held;
    result_.in_contact += (contact_->body.contact.flags & CONTACT_FLAG_CONTACT) != 0;
    if (frame_bytes(ours) == frame_bytes(*contact_)) {
      result_.equal++;
    } else if (result_.first_difference.empty()) {
      const wire_contact &a = contact_->body.contact, &b = ours.body.contact;
      char text[240];
      std::snprintf(text, sizeof text,
                    "frame %u: flags %08x %08x, x %.9g %.9g mm, y %.9g %.9g mm, force %.9g %.9g N, "
                    "slip %.9g %.9g mm",
                    static_cast<unsigned>(a.frame), static_cast<unsigned>(a.flags), static_cast<unsigned>(b.flags),
                    static_cast<double>(a.x_mm), static_cast<double>(b.x_mm), static_cast<double>(a.y_mm), static_cast<double>(b.y_mm),
                    static_cast<double>(a.force_N), static_cast<double>(b.force_N), static_cast<double>(a.slip_mm),
                    static_cast<double>(b.slip_mm));
      result_.first_difference = text;
    }
  }

  std::unique_ptr<native_stages, void (*)(native_stages *)> firmware_{nullptr, native_stages_free};
  bool tared_ = false;
  std::optional<std::uint32_t> lonely_frame_;
  std::optional<wire_packet> contact_;
  Repeated result_;
};

int repeat_capture(const std::string &capture) {
  Decoder decoder;
  Repeater repeater;
  feed_file(capture, decoder, [&](const wire_packet &packet) { repeater.packet(packet); });
  const Repeated &r = repeater.result();
  if (decoder.statistics().dropped_packets > 0 || decoder.statistics().crc_errors > 0) {
    throw Error(capture + ": packets are missing (" + decoder.statistics().text() + "); what follows them cannot be repeated");
  }
  if (repeater.lonely_frame()) {
    throw Error("frame " + std::to_string(*repeater.lonely_frame()) + " has no contact packet; stream both contact and raw");
  }
  if (r.frames == 0) {
    throw Error(capture + (repeater.tared() ? ": no frame after the tare"
                                            : ": no tare; have one within the capture, "
                                              "before anything has touched the pad since its start"));
  }
  std::printf("{\"frames\": %llu, \"in_contact\": %llu, \"held\": %llu, \"equal\": %llu}\n", static_cast<unsigned long long>(r.frames),
              static_cast<unsigned long long>(r.in_contact), static_cast<unsigned long long>(r.held),
              static_cast<unsigned long long>(r.equal));
  if (r.equal != r.frames) {
    throw Error(capture + ": " + std::to_string(r.frames - r.equal) + " contact packets differ, the first " + r.first_difference);
  }
  return 0;
}

int run(int argc, char **argv) {
  CLI::App app("The fingertip without a chip: the firmware's own code, compiled for this machine", "fingertip_player");
  app.require_subcommand(1);
  const auto option = [](CLI::App *command, const char *name, auto &value, const char *type, const char *help) {
    return command->add_option(name, value, help)->type_name(type);
  };
  PlayOptions given;
  CLI::App *player = app.add_subcommand("play", "Apply a scenario to simulated sensors and record the firmware's packets");
  option(player, "scenario", given.scenario, "FILE.csv", "CSV file, from twin or fingertip-scenario")->required();
  option(player, "-o,--output", given.recording, "FILE.csv", "Recording, as of fingertip record")->required();
  player->add_flag("--overwrite", given.replace, "Replace a recording that exists");
  option(player, "--osr", given.osr, "N", "Oversampling, 256 to 8192; default 1024");
  option(player, "--rate", given.rate, "HZ", "Frames a second, or max (default)");
  option(player, "--set", given.settings, "NAME=VALUE", "One more setting, as of fingertip set")->allow_extra_args(false);
  CLI::Option *pad = option(player, "--pad", given.pad_mm, "MM", "Thickness of the pad: the firmware estimates tangential force");
  player->add_flag("--from-touch", given.from_touch, "As of fingertip pad")->needs(pad);
  option(player, "--first", given.first, "FILE", "Commands that it is sent first, of fingertip_player calibrate");
  option(player, "--noise", given.noise, "FACTOR", "Times the datasheet's; default 1")->check(within(0.0, 1000.0));
  option(player, "--serial", given.serial, "HEX16", "Serial number of the fingertip")
      ->check([](const std::string &text) {
        const bool is_one = text.size() == 16 && text.find_first_not_of("0123456789ABCDEF") == std::string::npos;
        return is_one ? std::string() : "give 16 hexadecimal digits, as 000000000000B0BB";
      })
      ->capture_default_str();
  option(player, "--seed", given.seed, "N", "Of noise and calibration; default 1");
  option(player, "--seconds", given.seconds, "S", "Default: to the scenario's end")->check(within(0.1, SECONDS_MAX));
  player->add_flag("--raw", given.raw, "Record the pressures too");
  option(player, "--raw-bytes", given.raw_bytes, "FILE.ftr", "Keep the bytes of the line too, as of fingertip record");
  option(player, "--commands", given.commands, "FILE", "And those that it was sent, before 0 s");
  player->add_flag("--quiet", given.quiet, "No progress");

  CalibrateOptions calibrated;
  CLI::App *calibrater = app.add_subcommand("calibrate", "Judge a weight's placements, as fingertip calibrate does, and write the "
                                                         "commands that bring what it found: play --first");
  option(calibrater, "placements", calibrated.placements, "FILE.csv", "Recording of them, with --raw")->required();
  option(calibrater, "--force", calibrated.force_N, "N", "That weight, N")->required()->check(within(0.1, 100.0));
  option(calibrater, "-o,--output", calibrated.commands, "FILE", "The commands")->required();
  option(calibrater, "--overhang", calibrated.overhang_mm, "MM", "Rubber beyond the outer sensors, as of fingertip pad");
  calibrater->add_flag("--overwrite", calibrated.replace, "Replace a file that exists");

  std::string capture;
  CLI::App *repeater = app.add_subcommand("repeat", "Compute the contact packets of a capture once more from its pressures, and compare "
                                                    "them byte by byte, stage times apart");
  option(repeater, "capture", capture, "FILE",
         "Bytes of the line (fingertip record --raw-bytes, or the emulator's --capture) with contact and raw packets, "
         "an info packet and a tare")
      ->required();
  return run_program(app, argc, argv, [&] {
    return *player ? play(given) : *calibrater ? calibrate(calibrated) : repeat_capture(capture);
  });
}

} // namespace
} // namespace fingertip

int main(int argc, char **argv) { return fingertip::run(argc, argv); }
