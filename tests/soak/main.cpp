// One episode of a soak: see --help.
#include "emulated_plant.hpp"
#include "judge.hpp"
#include "native_plant.hpp"
#include "storm.hpp"
#include "worker_thread.hpp"
#include "world.hpp"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

namespace soak {
namespace {

// Simulated time that the second processor takes, of boards/native: the chip's own for a load.
constexpr std::uint64_t WORKER_us = 350;
// Of a location's own: one frame in sixty million is further off by noise alone.
constexpr double STEADY_SDS = 6;
constexpr double CLOCK_WRAPS_us = 4294967296.0;

nlohmann::json told(const Storm &storm, const Judge &judge, std::uint64_t seed) {
  const Figures &f = judge.figures();
  nlohmann::json recovery = nlohmann::json::object();
  for (const auto &[kind, found] : storm.recovery()) {
    recovery[kind] = {{"bouts", found.bouts}, {"worst_s", found.worst_s}};
  }
  nlohmann::json findings = nlohmann::json::array();
  for (const Finding &finding : judge.findings()) {
    findings.push_back(finding.kind + " at " + std::to_string(1e-6 * static_cast<double>(finding.t_us)) +
                       " s: " + finding.text);
  }
  return {{"seed", seed},
          {"seconds", 1e-6 * static_cast<double>(storm.now_us())},
          {"bouts", storm.bouts()},
          {"frames", f.frames},
          {"unwarned", f.unwarned},
          {"at_rest", f.at_rest},
          {"readings", f.readings},
          {"missing", f.missing},
          {"skipped", f.skipped},
          {"loads", f.loads},
          {"late", f.late},
          {"sequence_wraps", f.wraps},
          {"answered", f.answered},
          {"excused", f.excused},
          {"hangs", storm.hangs()},
          {"wrong_unflagged", f.wrong},
          {"uncounted_losses", f.loss},
          {"disorder", f.time + f.damaged + f.answer},
          {"worst_mm", f.worst_mm},
          {"worst_force", f.worst_force},
          {"worst_Pa", f.worst_Pa},
          {"recovery", recovery},
          {"findings", findings}};
}

// What each line of hexadecimal bytes, of one life each, says last of what is kept and of sensors.
int tell_packets() {
  for (std::string line; std::getline(std::cin, line);) {
    wire_receiver receiver;
    wire_receiver_init(&receiver, wire_all_layouts);
    nlohmann::json told;
    unsigned frames = 0, complete = 0;
    for (std::size_t i = 0; i + 1 < line.size(); i += 2) {
      wire_packet packet;
      const auto byte = static_cast<std::uint8_t>(std::stoul(line.substr(i, 2), nullptr, 16));
      if (wire_receive(&receiver, byte, &packet) != FT_OK) {
        continue;
      }
      if (packet.type == WIRE_INFO) {
        told["osr"] = packet.body.info.osr;
        told["stored"] = packet.body.info.stored;
      } else if (packet.type == WIRE_HEALTH) {
        told["present"] = packet.body.health.sensors_present;
        told["prom_bad"] = packet.body.health.sensors_prom_bad;
      } else if (packet.type == WIRE_RAW) {
        frames++;
        complete += packet.body.raw.valid == (1u << SENSORS) - 1;
      }
    }
    told["frames"] = frames;
    told["complete"] = complete;
    std::cout << told << '\n';
  }
  return 0;
}

int run(int argc, char **argv) {
  CLI::App app("One episode of a soak: a host uses a fingertip while one thing after another goes "
               "wrong, and what the fingertip says is held against the truth. The same each time "
               "for a seed. Prints one JSON object. Exit status 1 if anything was found");
  std::uint64_t seed = 1;
  double seconds = 600;
  std::vector<double> show;
  std::string board;
  app.add_option("--seed", seed, "Of everything")->check(CLI::Range(1.0, 1e9));
  app.add_option("--seconds", seconds, "Of device time")->check(CLI::Range(1.0, 86400.0));
  app.add_option("--show", show, "What comes within these times, on standard error")
      ->expected(2)
      ->type_name("FROM_s TO_s");
  app.add_option("--emulated", board,
                 "Board; the bench is emulated.mjs at standard input and output, which starts this "
                 "program. Default: boards/native, in this process")
      ->check(CLI::IsMember({"pico_mux", "pico_parallel"}));
  bool steady = false;
  app.add_flag("--steady", steady,
               "Nothing goes wrong: the highest rate and a 12 mm pad's profile, over a wrap of the "
               "clock's 32 bits in the middle. Natively the second processor is a thread");
  bool packets = false;
  app.add_flag("--packets", packets,
               "No episode: of each line of hexadecimal bytes on standard input one JSON object, what "
               "its packets say last of what is kept and of the sensors");
  CLI11_PARSE(app, argc, argv);
  if (packets) {
    return tell_packets();
  }

  World world(seed);
  Judge judge(world);
  if (show.size() == 2) {
    judge.show(static_cast<std::uint64_t>(1e6 * show[0]), static_cast<std::uint64_t>(1e6 * show[1]));
  }
  std::unique_ptr<Plant> plant;
  std::optional<WorkerThread> worker;
  if (board.empty() && steady) {
    worker.emplace(WORKER_us);
    const auto clock_us = static_cast<std::uint64_t>(CLOCK_WRAPS_us - 5e5 * seconds);
    plant = std::make_unique<NativePlant>(world, seed, clock_us, true);
    judge.set_clock_zero(-static_cast<double>(clock_us));
  } else if (board.empty()) {
    plant = std::make_unique<NativePlant>(world, seed);
  } else {
    plant = std::make_unique<EmulatedPlant>(world, board, std::cin, std::cout);
  }
  Storm storm(*plant, world, judge, seed);
  if (steady) {
    storm.keep_steady();
    judge.allow_standard_deviations(STEADY_SDS);
  }
  storm.run_to(static_cast<std::uint64_t>(1e6 * seconds));
  judge.close(storm.now_us());
  const nlohmann::json result = told(storm, judge, seed);
  std::cout << result << std::endl;
  return judge.findings().empty() ? 0 : 1;
}

} // namespace
} // namespace soak

int main(int argc, char **argv) {
  return soak::run(argc, argv);
}
