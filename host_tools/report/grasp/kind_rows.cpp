#include "grasp/kind_rows.hpp"

#include "grasp/figures.hpp"
#include "grasp/oracle.hpp"
#include "grasp/settings.hpp"
#include "grasp/textbook.hpp"
#include "grasp/trials.hpp"
#include "libfingertip/in_parallel.hpp"
#include "libfingertip/random.hpp"
#include "libfingertip/text.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <stdexcept>

namespace fingertip::grasp {

using namespace cell;
using nlohmann::ordered_json;

namespace {

enum Stream : std::uint64_t { NOISE = 881 };

constexpr double FIXED_N = 15.0, PAPER_N = 6.0;
constexpr double NEEDS_LEAST_N = 1.5; // of a catch that counts
constexpr double MUCH = 3.0, FIRST_MUCH = 2.0;

struct KindDone {
  KindOfGrasp grasp;
  KindOutcome outcome;
  double start_N, cap_N;
  double step_us;
};

KindTrial trial_of(const KindOptions &options, std::uint64_t n) {
  const auto kinds = split(options.kind, ',');
  const Kind kind = kind_of(std::string(kinds[n % kinds.size()]));
  return {draw_grasp(kind, options.seed, n / kinds.size()), gripper_mechanics(options.gripper),
          Random(options.seed, NOISE, n).next(), options.later_s};
}

GripSettings settings_with(const KindOptions &options, const KindTrial &trial) {
  std::map<std::string, double> values;
  if (trial.grasp.kind == Kind::fragile) {
    values = preset_values(trial.grasp.object);
  }
  if (options.controller == "fixed" || options.controller == "paper") {
    values["fixed"] = options.controller == "fixed" ? FIXED_N : PAPER_N;
    values.erase("cap");
  } else if (options.controller != "ours" && options.controller != "textbook" && options.controller != "oracle") {
    throw std::runtime_error("there is no controller \"" + options.controller +
                             "\"; choose one of: ours textbook fixed paper oracle");
  }
  for (const auto &[name, value] : settings_of(options.settings)) {
    values[name] = value;
  }
  return settings_for(trial.gripper.traits, values);
}

// Counts what a step takes.
class Timed : public Controller {
public:
  explicit Timed(Controller &inner) : inner_(inner) {}
  void take_touch(std::size_t finger, const GripTouch &touch) override { inner_.take_touch(finger, touch); }
  void take_status(const GripperStatus &status) override { inner_.take_status(status); }
  GripReport step(double now_s, GripCommand &command) override {
    using Clock = std::chrono::steady_clock;
    const auto began = Clock::now();
    const GripReport report = inner_.step(now_s, command);
    seconds_ += std::chrono::duration<double>(Clock::now() - began).count();
    steps_++;
    return report;
  }
  double mean_us() const { return steps_ > 0 ? 1e6 * seconds_ / steps_ : 0.0; }

private:
  Controller &inner_;
  double seconds_ = 0.0, steps_ = 0.0;
};

KindDone run_one(const KindOptions &options, std::uint64_t n,
                 const std::function<void(const KindMoment &)> &trace = {}) {
  const KindTrial trial = trial_of(options, n);
  const GripperTraits &traits = trial.gripper.traits;
  const GripSettings settings = settings_with(options, trial);
  std::unique_ptr<Controller> controller;
  std::function<void(const KindMoment &)> seen = trace;
  if (options.controller == "oracle") {
    auto oracle = std::make_unique<Oracle>(trial.grasp, trial.gripper, settings);
    seen = [&trace, &knowing = *oracle](const KindMoment &moment) {
      knowing.see(moment);
      trace ? trace(moment) : void();
    };
    controller = std::move(oracle);
  } else if (options.controller == "textbook") {
    controller = std::make_unique<Textbook>(traits);
  } else {
    controller = std::make_unique<CoreController>(settings, traits);
  }
  Timed timed(*controller);
  const KindOutcome outcome = run_kind(trial, timed, seen);
  return {trial.grasp, outcome, settings.start_N, settings.cap_N, timed.mean_us()};
}

ordered_json line_of(std::uint64_t n, const KindDone &one) {
  const KindOutcome &o = one.outcome;
  ordered_json line{{"n", n},
                    {"kind", name_of(one.grasp.kind)},
                    {"mass_kg", rounded(one.grasp.mass_kg)},
                    {"friction", rounded(one.grasp.pads[0].friction)},
                    {"kinetic_share", rounded(one.grasp.kinetic_share)},
                    {"exponent", rounded(one.grasp.exponent)},
                    {"at_1_mm_N", rounded(one.grasp.pads[0].at_1_mm_N)},
                    {"off_mm", rounded(one.grasp.off_mm)},
                    {"delay_ms", rounded(1e3 * one.grasp.pads[0].delay_s)},
                    {"gone", one.grasp.gone},
                    {"object", one.grasp.object},
                    {"lift_s", rounded(one.grasp.lift_s)},
                    {"dropped", o.dropped},
                    {"never_held", o.never_held},
                    {"crushed", o.crushed},
                    {"margin", rounded(o.margin)},
                    {"slid_mm", rounded(o.slid_mm)},
                    {"first_N", rounded(o.first_N)},
                    {"peak_N", rounded(o.peak_N)},
                    {"held_s", rounded(o.held_s)},
                    {"reversals_s", rounded(o.reversals_s)}};
  line["events"] = ordered_json::array();
  for (const Event &event : one.grasp.events) {
    line["events"].push_back({{"kind", name_of(event.kind)},
                              {"begin_s", rounded(event.begin_s)},
                              {"amount", rounded(event.amount)},
                              {"seconds", rounded(event.seconds)}});
  }
  line["catches"] = ordered_json::array();
  for (const Catch &one_catch : o.catches) {
    line["catches"].push_back({{"begin_s", rounded(one_catch.begin_s)},
                               {"way_mm", rounded(one_catch.way_mm)},
                               {"peak_N", rounded(one_catch.peak_N)},
                               {"least_N", rounded(one_catch.least_N)},
                               {"reaction_ms", one_catch.reaction_s ? ordered_json(rounded(1e3 * *one_catch.reaction_s))
                                                                    : ordered_json(nullptr)}});
  }
  return line;
}

ordered_json summary_of_kinds(const std::vector<KindDone> &done) {
  double drops = 0, never = 0, crushed = 0, hunts = 0, over_cap = 0, firm = 0, held = 0;
  std::vector<double> margins, over_need, slid_mm, reaction_ms, step_us, held_s;
  double much = 0;
  for (const KindDone &one : done) {
    const KindOutcome &o = one.outcome;
    drops += o.dropped || o.never_held;
    never += o.never_held;
    crushed += o.crushed;
    hunts += o.hunts;
    over_cap += o.peak_N > one.cap_N;
    firm += o.first_N > FIRST_MUCH * one.start_N;
    step_us.push_back(one.step_us);
    for (const Catch &one_catch : o.catches) {
      if (one_catch.reaction_s) {
        reaction_ms.push_back(1e3 * *one_catch.reaction_s);
      }
      if (!o.dropped && one_catch.least_N >= NEEDS_LEAST_N) {
        over_need.push_back(one_catch.peak_N / one_catch.least_N);
        much += over_need.back() > MUCH;
      }
    }
    if (!o.dropped && !o.never_held) {
      held++;
      held_s.push_back(o.held_s);
      margins.push_back(o.margin);
      slid_mm.push_back(o.slid_mm);
    }
  }
  const double count = static_cast<double>(done.size());
  return {{"grasps", done.size()},
          {"drops_percent", percent(drops, count)},
          {"never_held", never},
          {"margin_p50", quantile(margins, 0.5)},
          {"margin_p95", quantile(margins, 0.95)},
          {"catches", over_need.size()},
          {"peak_over_need_p50", quantile(over_need, 0.5)},
          {"peak_over_need_p95", quantile(over_need, 0.95)},
          {"peak_over_3_percent", percent(much, double(over_need.size()))},
          {"slid_p50_mm", quantile(slid_mm, 0.5)},
          {"slid_p95_mm", quantile(slid_mm, 0.95)},
          {"reaction_p50_ms", quantile(reaction_ms, 0.5)},
          {"hunting_percent", percent(hunts, held)},
          {"crushed_percent", percent(crushed, count)},
          {"over_cap", over_cap},
          {"first_grip_over_2x_percent", percent(firm, count)},
          {"held_p50_s", quantile(held_s, 0.5)},
          {"step_us", quantile(step_us, 0.5)}};
}

} // namespace

ordered_json kind_row(const KindOptions &options) {
  std::vector<KindDone> done(options.count);
  twin::in_parallel(
      options.count, [&](std::size_t i) { done[i] = run_one(options, options.first + i); }, options.jobs);
  ordered_json row{{"kind", options.kind},
                   {"gripper", options.gripper},
                   {"controller", options.controller},
                   {"later_ms", 1e3 * options.later_s},
                   {"seed", options.seed}};
  row.update(summary_of_kinds(done));
  if (options.each) {
    for (std::size_t i = 0; i < done.size(); i++) {
      row["each"].push_back(line_of(options.first + i, done[i]));
    }
  }
  return row;
}

ordered_json kind_trace(const KindOptions &options) {
  ordered_json series;
  const auto add = [&](const char *name, double value) { series[name].push_back(rounded(value)); };
  const KindDone done = run_one(options, options.first, [&](const KindMoment &m) {
    add("t_s", m.t_s);
    add("lift_s", std::max(m.lift_s, -1.0));
    add("width_mm", m.width_mm);
    add("sent_mm", m.sent_mm);
    add("left_N", m.left_N);
    add("right_N", m.right_N);
    add("least_N", m.least_N);
    add("load_N", m.load_N);
    add("slid_mm", m.slid_mm);
    add("slips", m.slips ? 1.0 : 0.0);
    add("felt_N", m.report.force_N);
    add("felt_load_N", m.report.load_N);
    add("wanted_N", m.report.wanted_N);
    add("friction", m.report.friction);
    add("state", m.report.state);
    add("trouble", m.report.trouble);
  });
  ordered_json out = line_of(options.first, done);
  out["series"] = series;
  return out;
}

} // namespace fingertip::grasp
