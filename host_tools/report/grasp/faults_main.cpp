// fingertip_grasp_faults: every fault in every state of a grasp in the simulated cell.
//
// One JSON object on the standard output: a row each of what was said, how far the fingers opened,
// the largest true force, whether the object was crushed; and how many of them broke a rule.
#include "grasp/fault_trials.hpp"
#include "grasp/words.hpp"
#include "libfingertip/in_parallel.hpp"
#include "report/grasp/options.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace {

using namespace fingertip;
using namespace fingertip::grasp;
using nlohmann::ordered_json;

constexpr char HELP[] = "usage: fingertip_grasp_faults [options]\n"
                        "  --jobs N          threads, 2\n"
                        "  --fault NAME      this fault alone\n"
                        "  --state NAME      in this state alone\n"
                        "  --cache DIR       folder of the contact tables\n";

ordered_json row_of(const FaultTrial &one, const FaultOutcome &done) {
  const cell::Failed &failed = done.outcome.failed;
  ordered_json row;
  row["fault"] = one.fault;
  row["state"] = one.state;
  row["gripper"] = one.gripper;
  row["object"] = one.object;
  row["begun"] = failed.begun;
  row["untold"] = one.is_untold;
  row["said"] = trouble_names(failed.trouble);
  row["ends"] = state_name(failed.state);
  row["opened_mm"] = failed.opened_mm;
  row["peak_N"] = done.outcome.peak_N;
  row["cap_N"] = one.cap_N;
  row["dropped"] = done.outcome.dropped;
  row["crushed"] = done.outcome.crushed;
  row["opened"] = done.opened;
  row["beyond_cap"] = done.beyond_cap;
  row["unsaid"] = done.unsaid;
  return row;
}

std::vector<FaultOutcome> run_all(const FaultRunner &runner, const std::vector<FaultTrial> &trials,
                                  std::uint64_t jobs) {
  std::vector<FaultOutcome> done(trials.size());
  const auto one = [&](std::size_t i) { done[i] = runner.run(trials[i]); };
  twin::in_parallel(trials.size(), one, jobs);
  return done;
}

struct Options {
  std::string cache = FINGERTIP_TABLES_DIR, fault, state;
  std::uint64_t jobs = 2;
};

ordered_json measure(const Options &options) {
  if (options.jobs == 0 || options.jobs > 64) {
    throw std::runtime_error("--jobs needs 1 to 64");
  }
  std::vector<FaultTrial> trials = fault_trials();
  const auto is_other = [&](const FaultTrial &one) {
    return (!options.fault.empty() && one.fault != options.fault) ||
           (!options.state.empty() && one.state != options.state);
  };
  trials.erase(std::remove_if(trials.begin(), trials.end(), is_other), trials.end());
  if (trials.empty()) {
    throw std::runtime_error("there is no such fault in such a state");
  }
  const std::vector<FaultOutcome> done = run_all(FaultRunner(options.cache), trials, options.jobs);
  ordered_json out;
  for (std::size_t i = 0; i < trials.size(); i++) {
    out["rows"].push_back(row_of(trials[i], done[i]));
  }
  return out;
}

} // namespace

int main(int argc, char **argv) {
  Options options;
  return reference::print_found("fingertip_grasp_faults", argc, argv,
                                {{"--cache", &options.cache},
                                 {"--fault", &options.fault},
                                 {"--state", &options.state},
                                 {"--jobs", nullptr, &options.jobs}},
                                HELP, [&] { return measure(options); });
}
