// A validation on a simulated pad (validated.hpp), as `fingertip validate` records it, and faster
// than real: the firmware's own code on this machine.
#include "libfingertip/command.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/output_file.hpp"
#include "libfingertip/recording_writer.hpp"
#include "library/pad/profile.hpp"
#include "library/pad/table_file.hpp"
#include "report/measure/sessions.hpp"
#include "simulation/cell/place.hpp"
#include "simulation/cell/validated.hpp"
#include "simulation/player/native_fingertip.h"
#include "tool/calibration/gain_session.hpp"
#include "tool/plain_help.hpp"

extern "C" {
#include "native/native_cdc.h"
}

#include <CLI/CLI.hpp>
#include <algorithm>
#include <nlohmann/json.hpp>

namespace fingertip::cell {
namespace {

constexpr std::uint32_t DATE_s = 1767225600;
constexpr std::uint64_t SLICE_us = 5'000, COMMAND_us = 100'000;
constexpr std::size_t PLACEMENTS = 20; // of a calibration
// Of the pad that is validated: the same seed draws the same one.
constexpr measure::PadOptions LIKE_REAL{10.0, 1.0, 0.1, 5.0, 3.5}, PLAIN{10.0};

struct Options {
  ValidatedOptions pad;
  std::string recording, truth, fault = "none";
  bool calibrated = false, knows_pad = false, plain = false, overwrite = false;
};

class Play {
public:
  Play(const Options &options, ValidatedPad &pad) : options_(options), pad_(pad) {
    native_fingertip_settings settings{};
    settings.seed = options.pad.seed;
    settings.noise = 1.0;
    settings.prom_spread = 0.03;
    settings.world = {&pad,
                      [](void *context, unsigned sensor, std::uint64_t t_us) {
                        return AIR_Pa + static_cast<ValidatedPad *>(context)->pressure_Pa(sensor, 1e-6 * static_cast<double>(t_us));
                      },
                      nullptr};
    for (std::size_t k = 0; k < SENSORS; k++) {
      settings.absent |= pad.is_absent(k) ? sensor_bit(static_cast<unsigned>(k)) : 0;
    }
    native_fingertip_start(&settings);
    native_cdc_open();
    for (const wire_packet &command : setting_commands({setting_from_text("rate=50")}, {})) {
      send(command);
    }
    if (options.calibrated) {
      calibrate();
    }
    send(command_stream(WIRE_STREAM_CONTACT | WIRE_STREAM_RAW | WIRE_STREAM_HEALTH));
    send(command_info());
  }

  void run() {
    std::size_t next = 0;
    const auto &plan = pad_.plan();
    const double end_s = pad_.end_s();
    for (std::uint64_t t_us = SLICE_us;; t_us += SLICE_us) {
      run_to(t_us);
      const double t_s = 1e-6 * static_cast<double>(t_us);
      while (next < plan.size() && plan[next].first <= t_s && writer_) {
        writer_->event(0, plan[next++].second);
      }
      if (t_s >= end_s && next == plan.size()) {
        break;
      }
    }
    writer_->finish({decoder_.statistics()}, "done");
  }

private:
  void send(wire_packet packet) {
    packet.sequence = sequence_++;
    const std::vector<std::uint8_t> bytes = frame_bytes(packet);
    if (native_cdc_send(bytes.data(), bytes.size()) != FT_OK) {
      throw Error("the firmware does not take its commands");
    }
    run_to(reached_us_ + COMMAND_us);
  }

  // As `fingertip calibrate --weight` makes it of the healthy pad, some day before.
  void calibrate() {
    const measure::Feet feet(LAYER_mm, options_.pad.cache);
    measure::SessionPad pad(options_.plain ? PLAIN : LIKE_REAL, LAYER_mm, options_.pad.seed);
    measure::Session session(feet, measure::SessionKind::good, options_.pad.seed, PLACEMENTS);
    const calibrating::Array array = measure::session_array();
    std::vector<calibrating::Placement> placements;
    std::optional<calibrating::Wanted> wanted;
    calibrating::Solution solution;
    while (auto placement = session.next(pad, wanted)) {
      placements.push_back(*placement);
      if (placements.size() >= calibrating::PLACEMENTS_MIN) {
        solution = calibrating::solve(array, placements);
        wanted = calibrating::next_place(array, placements, solution);
      }
    }
    calibrating::Shape shape = calibrating::shape_of(solution);
    if (options_.knows_pad) {
      shape = calibrating::without_width(std::move(shape));
      const pad::Thickness thickness = pad::thickness_of(solution.sigma_mm, solution.sigma_sd_mm);
      send(command_pad(pad::profile_over_own_sensors({thickness.shown_mm()})));
    }
    send(command_calibrate(
        calibrating::calibration_of(solution, calibrating::force_scale(array, placements, solution, measure::WEIGHT_N, shape), DATE_s),
        geometry.sensor_count));
  }

  void run_to(std::uint64_t t_us) {
    while (reached_us_ < t_us) {
      reached_us_ = std::min(reached_us_ + SLICE_us, t_us);
      if (!native_fingertip_run_until(reached_us_)) {
        throw Error("the firmware ended itself");
      }
      std::uint8_t bytes[NATIVE_CDC_TRANSMIT_BYTES];
      for (std::size_t count; (count = native_cdc_receive(bytes, sizeof bytes)) > 0;) {
        decoder_.feed(bytes, count, [&](const wire_packet &packet) { take(packet); });
      }
    }
  }

  void take(const wire_packet &packet) {
    if (packet.type == WIRE_ACK && packet.body.ack.result != WIRE_RESULT_DONE) {
      throw Error("the firmware refused command " + std::to_string(packet.body.ack.command));
    }
    if (!writer_ && packet.type == WIRE_INFO) {
      writer_.emplace(make_lines(options_.recording, options_.overwrite, OutputFile::Appears::when_finished), &packet.body.info, SENSORS,
                      Metadata{{"recorded_by", "simulated_pad"},
                               {"simulated", "the firmware's code on simulated rubber"},
                               {"fault", options_.fault},
                               {"seed", std::to_string(options_.pad.seed)}},
                      true);
    }
    if (writer_) {
      writer_->packet(packet);
    }
  }

  const Options &options_;
  ValidatedPad &pad_;
  Decoder decoder_;
  std::optional<RecordingWriter> writer_;
  std::uint16_t sequence_ = 0;
  std::uint64_t reached_us_ = 0;
};

void keep_truth(const Options &options, const ValidatedPad &pad) {
  nlohmann::json truth = {{"fault", options.fault},
                          {"faulty", pad.faulty()},
                          {"gains", pad.gains()},
                          {"presses", nlohmann::json::array()},
                          {"pulls", nlohmann::json::array()}};
  for (const ValidatedPad::Truth &press : pad.presses()) {
    truth["presses"].push_back({{"x_mm", press.x_mm}, {"y_mm", press.y_mm}, {"force_N", press.force_N}});
  }
  for (const ValidatedPad::TruePull &pull : pad.pulls()) {
    truth["pulls"].push_back(
        {{"toward_deg", pull.toward_deg}, {"pull_N", pull.pull_N}, {"force_N", pull.force_N}, {"way_mm", pull.way_mm}});
  }
  OutputFile file(options.truth, options.overwrite, OutputFile::Appears::when_finished);
  const std::string text = truth.dump(1) + "\n";
  file.append(text.data(), text.size());
  file.finish();
}

int run(int argc, char **argv) {
  CLI::App app("Simulates a validation of a fingertip, and records it as `fingertip validate` does.", "simulated_pad");
  Options options;
  options.pad.cache = twin::default_cache_directory();
  app.add_option("-o,--output", options.recording, "The recording")->required()->type_name("FILE.csv");
  app.add_option("--truth", options.truth, "Keeps what is true")->type_name("FILE.json");
  app.add_option("--fault", options.fault, "What is wrong with the pad")->check(CLI::IsMember(pad_fault_names()))->capture_default_str();
  app.add_option("--seed", options.pad.seed, "Of the pad, its fault and the hand")->type_name("N")->capture_default_str();
  CLI::Option *calibrated = app.add_flag("--calibrated", options.calibrated, "The fingertip was calibrated before");
  app.add_flag("--known-pad", options.knows_pad, "The calibration set the pad's profile, so that pulls are estimated")->needs(calibrated);
  app.add_flag("--plain", options.plain, "Rubber as its profile has it: sensors' gains differ, and nothing else");
  app.add_option("--pull", options.pad.pulling.weight_g, "Mass on a thread that pulls at the end")
      ->check(within(10.0, 1000.0))
      ->type_name("GRAMS");
  app.add_option("--thread-height", options.pad.pulling.height_mm, "Of the thread above the rubber")
      ->check(within(0.0, 10.0))
      ->type_name("MM")
      ->capture_default_str();
  app.add_option("--cache", options.pad.cache, "Of contact tables")->type_name("FOLDER");
  app.add_flag("--overwrite", options.overwrite, "Replace files that exist");
  return run_program(app, argc, argv, [&] {
    const auto &names = pad_fault_names();
    options.pad.fault = static_cast<PadFault>(std::find(names.begin(), names.end(), options.fault) - names.begin());
    if (options.plain) {
      options.pad.effects = twin::parse_effects("gain");
    }
    ValidatedPad pad(options.pad);
    Play play(options, pad);
    play.run();
    if (!options.truth.empty()) {
      keep_truth(options, pad);
    }
    return 0;
  });
}

} // namespace
} // namespace fingertip::cell

int main(int argc, char **argv) { return fingertip::cell::run(argc, argv); }
