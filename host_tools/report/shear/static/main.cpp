// shear_static: what the firmware says of touches that pull along the rubber, beside the truth.
//
// Touches of the twin's objects (pulled.hpp) go through the firmware's fit and its estimate of
// tangential load. One JSON object on the standard output: the keys that are judged, and the tables
// and samples behind them. If nothing else is said: calibrated pads of 10 % gain spread, 12 mm of
// rubber without end, the noise of OSR 1024, 1 to 10 N, seven objects at any angle, anywhere on the
// array (|x| <= 9 mm, |y| <= 18 mm), the load risen under a constant normal force at a friction of
// 0.5, in any direction.
#include "report/reference/options.hpp"
#include "shear/static/tables.hpp"

#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace {

using namespace fingertip;
using namespace fingertip::shear;
using nlohmann::ordered_json;

constexpr char HELP[] = "usage: shear_static [--seed S] [--pads N] [--only TABLE] [--few] [--cache DIR]\n"
                        "  --seed S     of pads and touches, 20221015 by default\n"
                        "  --pads N     pads of each case, 1500 by default; a fifth for some\n"
                        "  --only pads  only by pad and load, and by place\n"
                        "  --only cast  only pads like those that are cast\n"
                        "  --only objects  only by object\n"
                        "  --few        no pads of other thicknesses than 12 mm\n"
                        "  --cache DIR  folder of the contact tables\n";

ordered_json measure(const Options &options) {
  ordered_json out;
  out["shear_seed"] = options.seed;
  out["shear_pads"] = options.pads;
  const std::map<std::string, void (*)(Bench &, ordered_json &)> tables{
      {"pads", judge_pads}, {"cast", judge_cast}, {"objects", judge_objects}};
  const auto only = tables.find(options.only);
  if (!options.only.empty() && only == tables.end()) {
    throw std::runtime_error("--only " + options.only + " is no table; give pads, cast or objects");
  }
  Bench bench(options);
  if (!options.only.empty()) {
    only->second(bench, out);
    return out;
  }
  for (const auto judge :
       {judge_pads, judge_objects, judge_elongated, judge_limits, judge_thickness, judge_learned, judge_cast,
        judge_bounds, judge_rubber, judge_screws, judge_taps, judge_overhang, draw_arrows}) {
    judge(bench, out);
  }
  return out;
}

} // namespace

int main(int argc, char **argv) {
  Options options;
  return reference::print_found("shear_static", argc, argv,
                                {{"--cache", &options.cache},
                                 {"--only", &options.only},
                                 {"--seed", nullptr, &options.seed},
                                 {"--pads", nullptr, &options.pads},
                                 {"--few", nullptr, nullptr, &options.few}},
                                HELP, [&] { return measure(options); });
}
