// real_strips: the firmware's gate on recordings of real strips, at the rates it runs at. Argument:
// the folder of the recordings (truth/gate/strip.hpp says which); one JSON object on stdout.
//
//   {"strips": [{"name", "rates": [{"frames_per_s", "noise_Pa", "phantom_percent",
//                "longest_s", "doubted_percent", "holds_missed"}], "holds"}]}
//
// Exit status: 0 done; 1 something went wrong, said in one line; 2 wrong usage.
#include "libfingertip/in_parallel.hpp"
#include "truth/gate/strip.hpp"

#include <cstdio>
#include <exception>
#include <iostream>
#include <nlohmann/json.hpp>

namespace {

using namespace fingertip::truth;
using nlohmann::json;

struct Rate {
  double frames_per_s, noise_Pa; // of OSR 256, 1024 and 8192
};
constexpr Rate RATES[] = {{1308.0, 11.0}, {315.0, 4.0}, {57.0, 2.0}};

json judge(const Strip &strip) {
  json rates = json::array();
  for (const Rate &rate : RATES) {
    const Touches touches = gate_on(strip, rate.frames_per_s, rate.noise_Pa);
    json one;
    one["frames_per_s"] = rate.frames_per_s;
    one["noise_Pa"] = rate.noise_Pa;
    one["phantom_percent"] = touches.phantom_percent;
    one["longest_s"] = touches.longest_s;
    one["doubted_percent"] = touches.doubted_percent;
    one["holds_missed"] = touches.holds_missed;
    rates.push_back(one);
  }
  json said;
  said["name"] = strip.name;
  said["holds"] = strip.holds.size();
  said["rates"] = rates;
  return said;
}

} // namespace

int main(int argc, char **argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: real_strips FOLDER\n");
    return 2;
  }
  try {
    const std::vector<Strip> strips = read_strips(argv[1]);
    std::vector<json> said(strips.size());
    fingertip::twin::in_parallel(strips.size(), [&](std::size_t i) { said[i] = judge(strips[i]); });
    json found;
    found["strips"] = said;
    std::cout << found << '\n';
    return 0;
  } catch (const std::exception &error) {
    std::fprintf(stderr, "real_strips: %s\n", error.what());
    return 1;
  }
}
