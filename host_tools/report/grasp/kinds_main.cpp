// fingertip_grasp_kinds: many grasps of a kind in simulated time
// (host_tools/simulation/cell/kinds.hpp).
//
// One JSON object on the standard output: what was asked for, and how the grasps went.
#include "grasp/kind_rows.hpp"
#include "libfingertip/text.hpp"
#include "report/grasp/options.hpp"

#include <cstdio>
#include <exception>
#include <iostream>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace {

using namespace fingertip;
using namespace fingertip::grasp;

constexpr char HELP[] = "usage: fingertip_grasp_kinds [options]\n"
                        "  --kind NAME        gentle, usual (usual), rough, slick, fragile; several, split by commas,\n"
                        "                     by turns\n"
                        "  --gripper NAME     a model that `fingertip gripper list` names (usual: the first), or\n"
                        "                     ideal\n"
                        "  --controller NAME  ours (usual), textbook, fixed (15 N), paper: eq. (5) and (6) at 6 N,\n"
                        "                     oracle: knows the true load, friction and stiffness\n"
                        "  --set NAME=VALUE   of our settings, split by commas\n"
                        "  --later MS         all frames come later by MS, 0\n"
                        "  --seed S           another set of grasps; 1 to 999 are there to choose constants by, the\n"
                        "                     report judges by others; 1\n"
                        "  --count N          grasps, 100\n"
                        "  --first N          number of the first, 0\n"
                        "  --jobs N           threads, 2\n"
                        "  --each             adds each grasp\n"
                        "  --trace            instead: all that is known of the first, every 2 ms\n";

} // namespace

int main(int argc, char **argv) {
  try {
    KindOptions options;
    std::string later_ms = "0";
    bool trace = false;
    reference::parse_options(argc, argv,
                             {{"--kind", &options.kind},
                              {"--gripper", &options.gripper},
                              {"--controller", &options.controller},
                              {"--set", &options.settings},
                              {"--later", &later_ms},
                              {"--seed", nullptr, &options.seed},
                              {"--count", nullptr, &options.count},
                              {"--first", nullptr, &options.first},
                              {"--jobs", nullptr, &options.jobs},
                              {"--each", nullptr, nullptr, &options.each},
                              {"--trace", nullptr, nullptr, &trace}},
                             HELP);
    const auto later = to_double(later_ms);
    if (options.count == 0 || options.jobs == 0 || options.jobs > 64 || !later || *later < 0.0) {
      throw std::runtime_error("--count needs 1 or more, --jobs 1 to 64, --later milliseconds");
    }
    options.later_s = 1e-3 * *later;
    std::cout << (trace ? kind_trace(options) : kind_row(options)).dump(trace ? -1 : 1) << '\n';
    return std::cout.flush() ? 0 : 1;
  } catch (const std::exception &error) {
    std::fprintf(stderr, "fingertip_grasp_kinds: %s\n", error.what());
    return 1;
  }
}
