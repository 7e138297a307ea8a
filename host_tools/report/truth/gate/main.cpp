// truth_gate: whether the zero follows drifts and nothing else, and whether the gate says what
// touches.
//
// Simulated pads (bench.hpp) at both boards' rates, and recordings of real strips (strip.hpp) where
// they are at hand, through the firmware's condition and fit. One JSON object on the standard
// output: the keys that are judged, and the tables behind them.
#include "libfingertip/random.hpp"
#include "report/reference/options.hpp"
#include "truth/gate/bench.hpp"
#include "truth/gate/strip.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace {

using namespace fingertip;
using namespace fingertip::truth;
using nlohmann::ordered_json;

constexpr char HELP[] = "usage: truth_gate [--seed S] [--pads N] [--recordings DIR]\n"
                        "  --seed S          of pads and places, 20230706 by default\n"
                        "  --pads N          pads of each case, 8 by default; with 1 only OSR 8192,\n"
                        "                    with 0 the recordings alone\n"
                        "  --recordings DIR  folder of the strips' recordings, *.csv; the environment's\n"
                        "                    FINGERTIP_RECORDINGS by default\n";

struct Options {
  std::string recordings;
  std::uint64_t seed = 20230706, pads = 8;
};

constexpr double FORCE_N = 5.0, CALM_s = 60.0, HOUR_s = 3600.0;
constexpr double RAMPS_N_s[] = {0.005, 0.02, 0.1};
constexpr double TEN_MINUTES_s = 600.0, RECOVERED_Pa = 30.0, RECOVERY_WATCHED_s = 10.0;
constexpr double WARMING_FROM_degC = 5.0, WARMING_TO_degC = 25.0, WARMING_K_s = 0.1;
// As the twin warms 12 mm of silicone rubber by a hand.
constexpr double ROOM_degC = 25.0, HAND_K = 6.0, HAND_s = 486.0;
constexpr double RETURN_TIMES_s[] = {0.5, 1.0, 2.0, 5.0, 10.0};
constexpr double STAND_OFFS[] = {-0.15, -0.09, -0.03, 0.004, 0.03, 0.08};
constexpr double STAND_OFF_HOLDS_s[] = {1.0, 10.0};
constexpr double LEFT_SHARES[] = {0.02, 0.05, 0.1, 0.2};
constexpr struct { double frames_per_s, noise_Pa; } STRIP_RATES[] = {{57.0, 2.0}, {315.0, 4.0}, {1308.0, 11.0}};

struct Place {
  double x_mm, y_mm;
};

// Above a sensor, between two and between four; then anywhere inside the array.
Place place_of(std::uint64_t seed, std::size_t pad) {
  constexpr Place FIRST[] = {{4.5, 4.5}, {0.0, 0.0}, {4.5, 0.0}, {-4.5, -13.5}};
  if (pad < std::size(FIRST)) {
    return FIRST[pad];
  }
  Random random(seed, 311, pad);
  return {random.uniform(-6.75, 6.75), random.uniform(-13.5, 13.5)};
}

// Of the cases of one kind, on two threads, in order of their number.
template <typename Result>
std::vector<Result> each(const char *what, std::size_t count, const std::function<Result(std::size_t)> &work) {
  std::fprintf(stderr, "truth_gate: %s\n", what);
  std::vector<Result> results(count);
  std::atomic<std::size_t> next{0};
  std::vector<std::thread> threads;
  for (int i = 0; i < 2; i++) {
    threads.emplace_back([&] {
      for (std::size_t k; (k = next.fetch_add(1)) < count;) {
        results[k] = work(k);
      }
    });
  }
  for (std::thread &thread : threads) {
    thread.join();
  }
  return results;
}

struct Judge {
  Options options;
  std::vector<Mode> all;
  ordered_json out;

  std::uint64_t seed_of(std::size_t mode, std::size_t pad) const { return options.seed + 1000 * mode + pad; }

  ordered_json row(const Mode &mode) const {
    return {{"board", mode.board}, {"osr", mode.osr}, {"frames_per_s", mode.frames_per_s}};
  }

  double force_error_percent(Bench &bench, const Place &at) const {
    double sum_N = 0;
    int frames = 0;
    bench.run(
        0.2, [&](double, Pressures &felt) { press(felt, at.x_mm, at.y_mm, FORCE_N); },
        [&](double, const Said &) {
          sum_N += bench.force_N();
          frames++;
        });
    return 100.0 * std::abs(sum_N / frames / FORCE_N - 1.0);
  }

  double ramp(std::size_t mode, std::size_t pad, double N_s) const {
    const Place at = place_of(options.seed, pad);
    Bench bench(all[mode], seed_of(mode, pad));
    bench.run(CALM_s);
    bench.run(FORCE_N / N_s, [&](double t_s, Pressures &felt) { press(felt, at.x_mm, at.y_mm, N_s * t_s); });
    return force_error_percent(bench, at);
  }

  double hold(std::size_t mode, std::size_t pad, double calm_s) const {
    const Place at = place_of(options.seed, pad);
    Bench bench(all[mode], seed_of(mode, pad));
    bench.drift();
    bench.run(calm_s);
    bench.run(HOUR_s, [&](double, Pressures &felt) { press(felt, at.x_mm, at.y_mm, FORCE_N); });
    return force_error_percent(bench, at);
  }

  // The worst of the pads at each mode.
  double judge_forces(const char *what, const char *key, const std::vector<double> &values,
                      const std::function<double(std::size_t, std::size_t, double)> &error) {
    const std::size_t pads = options.pads;
    const auto errors = each<double>(what, values.size() * all.size() * pads, [&](std::size_t i) {
      return error(i / pads % all.size(), i % pads, values[i / pads / all.size()]);
    });
    double worst = 0;
    for (std::size_t v = 0; v < values.size(); v++) {
      for (std::size_t m = 0; m < all.size(); m++) {
        const auto first = errors.begin() + static_cast<std::ptrdiff_t>((v * all.size() + m) * pads);
        ordered_json one = row(all[m]);
        one[key] = values[v];
        one["worst_percent"] = *std::max_element(first, first + static_cast<std::ptrdiff_t>(pads));
        worst = std::max(worst, one["worst_percent"].get<double>());
        out[what].push_back(one);
      }
    }
    return worst;
  }

  void judge_slow_forces() {
    const double ramps =
        judge_forces("ramps", "N_s", {std::begin(RAMPS_N_s), std::end(RAMPS_N_s)},
                     [&](std::size_t mode, std::size_t pad, double N_s) { return ramp(mode, pad, N_s); });
    const double holds =
        judge_forces("hour_holds", "calm_s", {CALM_s},
                     [&](std::size_t mode, std::size_t pad, double calm_s) { return hold(mode, pad, calm_s); });
    out["slow_force_error_percent"] = std::max(ramps, holds);
  }

  // Contacts that began although nothing touched, doubted or not.
  static int contacts_in(Bench &bench, double seconds) {
    int contacts = 0;
    bool before = false;
    bench.run(seconds, nullptr, [&](double, const Said &said) {
      contacts += said.contact && !before ? 1 : 0;
      before = said.contact;
    });
    return contacts;
  }

  void judge_rest() {
    constexpr std::size_t KINDS = 3;
    const auto contacts = each<int>("rest", KINDS * all.size(), [&](std::size_t i) {
      Bench bench(all[i / KINDS], seed_of(i / KINDS, i % KINDS));
      if (i % KINDS == 0) {
        bench.drift();
        bench.warm([](double t_s) { return ROOM_degC + HAND_K * (1.0 - std::exp(-t_s / HAND_s)); });
        return contacts_in(bench, HOUR_s);
      }
      const double sign = i % KINDS == 1 ? 1.0 : -1.0;
      const double from = i % KINDS == 1 ? WARMING_FROM_degC : WARMING_TO_degC;
      bench.warm([=](double t_s) { return from + sign * WARMING_K_s * t_s; });
      return contacts_in(bench, (WARMING_TO_degC - WARMING_FROM_degC) / WARMING_K_s);
    });
    int sum = 0;
    for (std::size_t i = 0; i < contacts.size(); i++) {
      ordered_json one = row(all[i / KINDS]);
      one["case"] = i % KINDS == 0   ? "an hour of drift, warming by 6 K"
                    : i % KINDS == 1 ? "from 5 to 25 degC"
                                     : "from 25 to 5 degC";
      one["contacts"] = contacts[i];
      out["rest"].push_back(one);
      sum += contacts[i];
    }
    out["false_contacts"] = sum;
  }

  // Time from the release until no zero is off by more than RECOVERED_Pa, for good.
  void judge_recovery() {
    const std::size_t pads = options.pads;
    const auto times_s = each<double>("recovery", all.size() * pads, [&](std::size_t i) {
      const Place at = place_of(options.seed, i % pads);
      Bench bench(all[i / pads], seed_of(i / pads, i % pads));
      bench.drift();
      bench.run(i % 2 == 0 ? 5.0 : CALM_s);
      bench.run(TEN_MINUTES_s,
                [&](double, Pressures &felt) { press(felt, at.x_mm, at.y_mm, i % 4 < 2 ? FORCE_N : 0.1 * FORCE_N); });
      double wrong_s = 0;
      bench.run(RECOVERY_WATCHED_s, nullptr, [&](double t_s, const Said &) {
        wrong_s = bench.worst_zero_error_Pa() > RECOVERED_Pa ? t_s : wrong_s;
      });
      return wrong_s;
    });
    double worst_s = 0;
    for (std::size_t m = 0; m < all.size(); m++) {
      const auto first = times_s.begin() + static_cast<std::ptrdiff_t>(m * pads);
      ordered_json one = row(all[m]);
      one["worst_s"] = *std::max_element(first, first + static_cast<std::ptrdiff_t>(pads));
      worst_s = std::max(worst_s, one["worst_s"].get<double>());
      out["recovery"].push_back(one);
    }
    out["zero_recovery_s"] = worst_s;
  }

  struct StandOff {
    double longest_s = 0, contact_s = 0, next_error_percent = 0;
  };

  // After a press every sensor stands off by up to this share of its peak.
  StandOff stand_off(std::size_t mode, double share, double time_s, double hold_s) const {
    const Place at = place_of(options.seed, 0);
    Bench bench(all[mode], seed_of(mode, 0));
    bench.run(CALM_s);
    Pressures off{};
    press(off, at.x_mm, at.y_mm, FORCE_N);
    for (std::size_t k = 0; k < SENSORS; k++) {
      off[k] *= share * Random(options.seed, 313, k).uniform(0.5, 1.0);
    }
    bench.run(hold_s,
              [&](double t_s, Pressures &felt) { press(felt, at.x_mm, at.y_mm, FORCE_N * std::min(1.0, t_s / 0.2)); });
    StandOff found;
    double since_s = 0;
    bench.run(
        40.0,
        [&](double t_s, Pressures &felt) {
          for (std::size_t k = 0; k < SENSORS; k++) {
            felt[k] += off[k] * std::exp(-t_s / time_s);
          }
          press(felt, at.x_mm, at.y_mm, FORCE_N * std::max(0.0, 1.0 - t_s / 0.1));
        },
        [&](double t_s, const Said &said) {
          since_s = said.certain() && t_s > 0.3 ? since_s : t_s;
          found.longest_s = std::max(found.longest_s, t_s - since_s);
          found.contact_s += said.contact && t_s > 0.3 ? 1.0 / bench.mode().frames_per_s : 0.0;
        });
    bench.run(0.5,
              [&](double t_s, Pressures &felt) { press(felt, at.x_mm, at.y_mm, FORCE_N * std::min(1.0, t_s / 0.2)); });
    found.next_error_percent = force_error_percent(bench, at);
    return found;
  }

  void judge_stand_offs() {
    constexpr std::size_t TIMES = std::size(RETURN_TIMES_s), HOLDS = std::size(STAND_OFF_HOLDS_s);
    constexpr std::size_t RUNS = TIMES * HOLDS, SHARES = std::size(STAND_OFFS);
    const auto found = each<StandOff>("stand_offs", all.size() * SHARES * RUNS, [&](std::size_t i) {
      return stand_off(i / RUNS / SHARES, STAND_OFFS[i / RUNS % SHARES], RETURN_TIMES_s[i % TIMES],
                       STAND_OFF_HOLDS_s[i / TIMES % HOLDS]);
    });
    double longest_s = 0;
    for (std::size_t m = 0; m < all.size(); m++) {
      for (std::size_t s = 0; s < SHARES; s++) {
        StandOff worst;
        for (std::size_t r = 0; r < RUNS; r++) {
          const StandOff &one = found[(m * SHARES + s) * RUNS + r];
          worst.longest_s = std::max(worst.longest_s, one.longest_s);
          worst.contact_s = std::max(worst.contact_s, one.contact_s);
          worst.next_error_percent = std::max(worst.next_error_percent, one.next_error_percent);
        }
        ordered_json one = row(all[m]);
        one["share"] = STAND_OFFS[s];
        one["phantom_longest_s"] = worst.longest_s;
        one["contact_s"] = worst.contact_s;
        one["next_force_error_percent"] = worst.next_error_percent;
        out["stand_offs"].push_back(one);
        longest_s = std::max(longest_s, worst.longest_s);
      }
    }
    out["phantom_force_longest_s"] = longest_s;
  }

  // A share of the force that is left for a minute: certain, doubted, or neither.
  void judge_left_forces() {
    struct Left {
      double certain = 0, doubted = 0;
    };
    constexpr std::size_t SHARES = std::size(LEFT_SHARES);
    const auto found = each<Left>("left_forces", all.size() * SHARES, [&](std::size_t i) {
      const Place at = place_of(options.seed, 0);
      const double share = LEFT_SHARES[i % SHARES];
      Bench bench(all[i / SHARES], seed_of(i / SHARES, 0));
      bench.run(CALM_s);
      bench.run(5.0, [&](double, Pressures &felt) { press(felt, at.x_mm, at.y_mm, FORCE_N); });
      Left left;
      double frames = 0;
      bench.run(
          60.0,
          [&](double t_s, Pressures &felt) {
            press(felt, at.x_mm, at.y_mm, FORCE_N * std::max(share, 1.0 - t_s / 0.3));
          },
          [&](double t_s, const Said &said) {
            if (t_s > 0.5) {
              frames++;
              left.certain += said.certain() ? 1 : 0;
              left.doubted += said.doubtful ? 1 : 0;
            }
          });
      left.certain *= 100.0 / frames;
      left.doubted *= 100.0 / frames;
      return left;
    });
    for (std::size_t i = 0; i < found.size(); i++) {
      ordered_json one = row(all[i / SHARES]);
      one["share"] = LEFT_SHARES[i % SHARES];
      one["certain_percent"] = found[i].certain;
      one["doubted_percent"] = found[i].doubted;
      out["left_forces"].push_back(one);
    }
  }

  void judge_strips() {
    for (const char *key :
         {"real_phantom_percent_worst", "real_phantom_longest_s", "real_held_missed", "real_held_doubted_percent_worst",
          "real_median_mm_worst_test", "real_median_mm_worst_other"}) {
      out[key] = nullptr;
    }
    if (options.recordings.empty()) {
      return;
    }
    const std::vector<Strip> strips = read_strips(options.recordings);
    if (strips.empty()) {
      return;
    }
    constexpr std::size_t RATES = std::size(STRIP_RATES);
    const auto touches = each<Touches>("strips", strips.size() * RATES, [&](std::size_t i) {
      const auto &rate = STRIP_RATES[i % RATES];
      return gate_on(strips[i / RATES], rate.frames_per_s, rate.noise_Pa);
    });
    Touches worst;
    for (std::size_t i = 0; i < touches.size(); i++) {
      const Touches &one = touches[i];
      const Strip &strip = strips[i / RATES];
      out["strips"].push_back({{"name", strip.name},
                               {"frames_per_s", STRIP_RATES[i % RATES].frames_per_s},
                               {"free_rows", std::count(strip.is_free.begin(), strip.is_free.end(), true)},
                               {"holds", strip.holds.size()},
                               {"phantom_percent", one.phantom_percent},
                               {"phantom_longest_s", one.longest_s},
                               {"doubted_percent", one.doubted_percent},
                               {"held_doubted_percent", one.doubted_in_hold_percent},
                               {"held_missed", one.holds_missed}});
      worst.phantom_percent = std::max(worst.phantom_percent, one.phantom_percent);
      worst.longest_s = std::max(worst.longest_s, one.longest_s);
      worst.doubted_in_hold_percent = std::max(worst.doubted_in_hold_percent, one.doubted_in_hold_percent);
      worst.holds_missed += one.holds_missed;
    }
    out["real_phantom_percent_worst"] = worst.phantom_percent;
    out["real_phantom_longest_s"] = worst.longest_s;
    out["real_held_missed"] = worst.holds_missed;
    out["real_held_doubted_percent_worst"] = worst.doubted_in_hold_percent;
    std::fprintf(stderr, "truth_gate: locations\n");
    for (const Located &one : locate(strips)) {
      ordered_json located{{"name", one.name}, {"fits", one.fits}};
      if (one.fits > 0) {
        located["sigma_mm"] = one.sigma_mm;
        located["prior_width_mm"] = one.prior_width_mm;
        located["median_mm"] = one.median_mm;
        located["others_sigma_mm"] = one.others_sigma_mm;
        located["median_by_others_mm"] = one.median_by_others_mm;
        located["median_without_prior_mm"] = one.median_without_prior_mm;
        const char *key = one.is_test ? "real_median_mm_worst_test" : "real_median_mm_worst_other";
        out[key] = out[key].is_null() ? one.median_mm : std::max(out[key].get<double>(), one.median_mm);
      }
      out["locations"].push_back(located);
    }
  }

  ordered_json operator()() {
    if (options.pads > 0) {
      judge_slow_forces();
      judge_rest();
      judge_recovery();
      judge_stand_offs();
      judge_left_forces();
    }
    judge_strips();
    return out;
  }
};

ordered_json measure(const Options &options) {
  if (!options.recordings.empty() && !std::filesystem::is_directory(options.recordings)) {
    throw std::runtime_error(options.recordings + " is no folder");
  }
  Judge judge{options, modes(), {}};
  if (options.pads == 1) { // a quick look
    const auto is_left_out = [](const Mode &mode) { return mode.osr != 8192; };
    judge.all.erase(std::remove_if(judge.all.begin(), judge.all.end(), is_left_out), judge.all.end());
  }
  judge.out["seed"] = options.seed;
  judge.out["pads"] = options.pads;
  return judge();
}

} // namespace

int main(int argc, char **argv) {
  Options options;
  if (const char *folder = std::getenv("FINGERTIP_RECORDINGS")) {
    options.recordings = folder;
  }
  return reference::print_found(
      "truth_gate", argc, argv,
      {{"--recordings", &options.recordings}, {"--seed", nullptr, &options.seed}, {"--pads", nullptr, &options.pads}},
      HELP, [&] { return measure(options); });
}
