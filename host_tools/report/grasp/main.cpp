// fingertip_grasp_trials: many grasps in the simulated cell (host_tools/simulation/cell), one set of them.
//
// One JSON object on the standard output: what was asked for, then how the grasps went, all of it
// and by object, friction and disturbance. All simulated.
#include "grasp/summary.hpp"
#include "libfingertip/text.hpp"
#include "report/grasp/options.hpp"

#include <chrono>
#include <cstdio>
#include <exception>
#include <iostream>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace {

using namespace fingertip;
using namespace fingertip::grasp;
using nlohmann::ordered_json;

constexpr char HELP[] = "usage: fingertip_grasp_trials [options]\n"
                        "  --gripper NAME    a model that `fingertip gripper list` names (usual: the first), or ideal\n"
                        "  --mode NAME       hold (usual), fixed; on the table, no lift: still, still-fixed,\n"
                        "                    still-oracle: knows the true force, stiffness and relaxation\n"
                        "  --objects NAME    round (usual: balls and cylinders), balls, cylinders, faces, flats; or\n"
                        "                    faces of the twin, split by commas\n"
                        "  --rate HZ         frames of a fingertip a second, 410; above 600 at OSR 256, else 1024\n"
                        "  --effect SHARE    of a tangential force's field that reaches the readings, 1\n"
                        "  --still S         length of a still grasp, 12\n"
                        "  --set NAME=VALUE  of the controller's settings, split by commas: margin=1.4\n"
                        "  --seed S          another set of scenes, pads and noise; 1 to 999 are there to choose\n"
                        "                    constants by, the report judges by others; 1\n"
                        "  --count N         grasps, 100\n"
                        "  --first N         number of the first, 0\n"
                        "  --jobs N          threads, 2\n"
                        "  --each            adds a line for each grasp\n"
                        "  --trace N         instead: all that is known of that grasp, every 2 ms\n"
                        "  --cache DIR       folder of the contact tables\n";

struct Options {
  SetOptions set;
  std::string rate = "410", effect = "1", still = "12", trace;
  std::uint64_t count = 100, first = 0, jobs = 2;
  bool each = false;
};

double number_of(const std::string &name, const std::string &text) {
  const auto value = to_double(text);
  if (!value) {
    throw std::runtime_error(name + " needs a number, not \"" + printable(text) + "\"");
  }
  return *value;
}

int measure(const Options &options) {
  using Clock = std::chrono::steady_clock;
  const auto began = Clock::now();
  const Set set(options.set);
  ordered_json out;
  if (!options.trace.empty()) {
    std::cout << trace_of(set, static_cast<std::uint64_t>(number_of("--trace", options.trace))) << '\n';
    return std::cout.flush() ? 0 : 1;
  }
  const auto ready = Clock::now();
  const std::vector<Done> done = run_all(set, options.first, options.count, options.jobs);
  const std::chrono::duration<double> prepared = ready - began, ran = Clock::now() - ready;
  out["gripper"] = options.set.gripper;
  out["mode"] = options.set.mode;
  out["objects"] = options.set.objects;
  out["rate_Hz"] = options.set.rate_Hz;
  out["effect"] = options.set.effect;
  out["seed"] = options.set.seed;
  out["set"] = options.set.settings;
  out.update(summary_of(done, set.is_still()));
  if (options.each) {
    for (std::size_t i = 0; i < done.size(); i++) {
      out["each"].push_back(line_of(options.first + i, done[i]));
    }
  }
  out["prepared_s"] = prepared.count();
  out["ran_s"] = ran.count();
  std::cout << out.dump(1) << '\n';
  return std::cout.flush() ? 0 : 1;
}

} // namespace

int main(int argc, char **argv) {
  try {
    Options options;
    options.set.cache = FINGERTIP_TABLES_DIR;
    reference::parse_options(argc, argv,
                             {{"--gripper", &options.set.gripper},
                              {"--mode", &options.set.mode},
                              {"--objects", &options.set.objects},
                              {"--rate", &options.rate},
                              {"--effect", &options.effect},
                              {"--still", &options.still},
                              {"--set", &options.set.settings},
                              {"--trace", &options.trace},
                              {"--cache", &options.set.cache},
                              {"--seed", nullptr, &options.set.seed},
                              {"--count", nullptr, &options.count},
                              {"--first", nullptr, &options.first},
                              {"--jobs", nullptr, &options.jobs},
                              {"--each", nullptr, nullptr, &options.each}},
                             HELP);
    if (options.count == 0 || options.jobs == 0 || options.jobs > 64) {
      throw std::runtime_error("--count needs 1 or more, --jobs 1 to 64");
    }
    options.set.rate_Hz = number_of("--rate", options.rate);
    options.set.effect = number_of("--effect", options.effect);
    options.set.still_s = number_of("--still", options.still);
    return measure(options);
  } catch (const std::exception &error) {
    std::fprintf(stderr, "fingertip_grasp_trials: %s\n", error.what());
    return 1;
  }
}
