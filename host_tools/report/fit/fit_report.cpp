// fit_report: how far the on-chip fit lies from the reference optimum, and how well its flags tell.
#include "common/contact_flags.h"
#include "libfingertip/in_parallel.hpp"
#include "report/fit/json_file.hpp"
#include "report/fit/kernels.hpp"
#include "report/reference/dataset.hpp"
#include "report/reference/options.hpp"

extern "C" {
#include "config/defaults.h"
}

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>

namespace {

namespace fitting = fingertip::fitting;
namespace reference = fingertip::reference;
using fitting::Guess;
using reference::Case;
using reference::Mask;
using reference::PressSet;

const char USAGE[] =
    R"(fit_report: how far fits lie from the reference optimum, and how well their flags tell.

usage: fit_report [--kernel NAME] [--variant TEXT] [--set A|B|C|D] [--limit N] [--seed S]
                  [--out DIR] [--cache DIR] [--jobs FILE.json]

--kernel (report/fit/kernels.hpp), --variant (part of a variant's name) and --set choose rows;
--limit takes N presses in all (120 000 by default: A, B a third each, C, D a sixth each), with one
sensor masked half of them, with two and three a tenth. Writes fit_error.json to --out and prints
the same. One row per kernel, variant, set (ABCD: all together) and observability; variants
that a kernel does not have are left out:
  presses       of the set that are (not) observable (reference/dataset.hpp)
  p50_um ..     distance of the location from the reference optimum of the presses as received at
                1/1024 Pa, with the sensors usable that the variant leaves; where there is no fit it
                is infinite
  above_10um    presses farther than that from the reference
  without_fit   presses that gave no fit
  outlier       presses of which the fit left out a sensor by itself
  truth_p50_mm  distance from where the contact truly is, of those with a fit
  bad_unflagged share more than 1 mm wrong without a warning (UNCERTAIN, MODEL, FLAT, AT_BOUND,
                LOW_SIGNAL, or no fit): against the reference in A and B, the truth in C and D
  good_flagged  share within 1 mm with a warning

--jobs writes the variants and some of the presses for on_chip/bench.mjs, and does nothing else.
)";

constexpr int USUAL_ITERATIONS = 7;
constexpr double BAD_mm = 1.0;
constexpr std::uint32_t WARNINGS =
    CONTACT_FLAG_UNCERTAIN | CONTACT_FLAG_MODEL | CONTACT_FLAG_FLAT | CONTACT_FLAG_AT_BOUND | CONTACT_FLAG_LOW_SIGNAL;

struct Variant {
  std::string name;
  int iterations = USUAL_ITERATIONS;
  int n_largest = 0;
  double lsb_Pa = 1.0 / 1024.0;
  Mask mask = Mask::none;
  double prior_sigma_mm = 0.0, prior_width_mm = 0.0;
  Guess guess = Guess::log_linear;
  unsigned needs = 0;  // of enum Capability
  bool on_chip = true; // worth counting its cycles
};

std::vector<Variant> all_variants() {
  std::vector<Variant> variants;
  const auto add = [&](const std::string &name) -> Variant & {
    variants.emplace_back();
    variants.back().name = name;
    return variants.back();
  };
  for (int k = 0; k <= 10; k++) {
    add("iterations=" + std::to_string(k)).iterations = k;
  }
  for (int k : {20, 50}) {
    Variant &variant = add("iterations=" + std::to_string(k));
    variant.iterations = k;
    variant.needs = fitting::ENDS_EARLY;
  }
  for (int n = 4; n <= 15; n++) {
    Variant &variant = add("n_largest=" + std::to_string(n));
    variant.n_largest = n;
    variant.needs = fitting::N_LARGEST;
  }
  for (int denominator : {1, 16, 100, 1024}) {
    Variant &variant = add("lsb_Pa=1/" + std::to_string(denominator));
    variant.lsb_Pa = 1.0 / denominator;
    variant.on_chip = false;
  }
  // The width that set D's layer gives a contact, one that is 20 % off, and set C's.
  for (double prior_sigma_mm : {3.2, 3.8, 5.7}) {
    Variant &variant = add("prior_mm=" + std::to_string(prior_sigma_mm).substr(0, 3));
    variant.prior_sigma_mm = prior_sigma_mm;
    variant.prior_width_mm = 0.5;
    variant.needs = fitting::PRIOR;
  }
  for (Guess guess : {Guess::maximum, Guess::centroid, Guess::firmware}) {
    Variant &variant = add(std::string("guess=") + fitting::name_of(guess));
    variant.guess = guess;
    variant.needs = guess == Guess::firmware ? fitting::FIRMWARE_GUESS : fitting::GUESSES;
  }
  for (Mask mask : reference::ALL_MASKS) {
    if (mask != Mask::none) {
      Variant &variant = add(std::string("mask=") + reference::name_of(mask));
      variant.mask = mask;
      variant.needs = fitting::ANY_SUBSET;
    }
  }
  for (Mask mask : {Mask::random, Mask::peak}) { // as built
    Variant &variant =
        add(std::string("mask=") + reference::name_of(mask) + " iterations=" + std::to_string(DEFAULT_FIT_ITERATIONS));
    variant.mask = mask;
    variant.iterations = DEFAULT_FIT_ITERATIONS;
    variant.needs = fitting::ANY_SUBSET;
  }
  for (Mask mask : {Mask::random, Mask::peak}) {
    Variant &variant = add(std::string("mask=") + reference::name_of(mask) + " guess=firmware");
    variant.mask = mask;
    variant.guess = Guess::firmware;
    variant.needs = fitting::ANY_SUBSET | fitting::FIRMWARE_GUESS;
  }
  return variants;
}

bool has(const fitting::Kernel &kernel, const Variant &variant) {
  return (variant.needs & ~kernel.capabilities) == 0;
}

std::size_t presses_of(PressSet set, Mask mask, std::uint64_t limit) {
  const bool gaussian = set == PressSet::A || set == PressSet::B;
  const bool one = mask == Mask::random || mask == Mask::peak;
  const unsigned share = mask == Mask::none ? 1 : one ? 2 : 10;
  return limit / (gaussian ? 3 : 6) / share;
}

struct Options {
  std::string kernel, variant, set, jobs, out = FINGERTIP_REPORT_DIR, cache = FINGERTIP_CACHE_DIR;
  std::uint64_t limit = 120000;
  std::uint64_t seed = 20221015;
};

Options parse(int argc, char **argv) {
  Options o;
  reference::parse_options(argc, argv,
                           {{"--kernel", &o.kernel},
                            {"--variant", &o.variant},
                            {"--set", &o.set},
                            {"--jobs", &o.jobs},
                            {"--out", &o.out},
                            {"--cache", &o.cache},
                            {"--limit", nullptr, &o.limit},
                            {"--seed", nullptr, &o.seed}},
                           USAGE);
  return o;
}

struct Outcome {
  double from_reference_um, from_truth_mm;
  std::uint32_t flags;
  bool outlier;
};

struct Row {
  std::string kernel, variant, set;
  bool observable = false;
  std::size_t presses = 0, without_fit = 0, outlier = 0, above_10um = 0, above_100um = 0;
  double p50_um = 0, p99_um = 0, p999_um = 0, worst_um = 0;
  double truth_p50_mm = 0, truth_p99_mm = 0;
  double bad_unflagged = 0, good_flagged = 0;
};

double quantile(const std::vector<double> &sorted, double share) {
  if (sorted.empty()) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
}

// What a row is made from; sets may be added together.
class Tally {
public:
  void add(const std::vector<Case> &cases, const std::vector<Outcome> &outcomes, PressSet set, bool observable) {
    const bool gaussian = set == PressSet::A || set == PressSet::B;
    for (std::size_t i = 0; i < cases.size(); i++) {
      if (cases[i].observable != observable) {
        continue;
      }
      const Outcome &outcome = outcomes[i];
      counts_.presses++;
      um_.push_back(outcome.from_reference_um);
      counts_.above_10um += outcome.from_reference_um > 10.0;
      counts_.above_100um += outcome.from_reference_um > 100.0;
      if (!(outcome.flags & CONTACT_FLAG_FIT_VALID)) {
        counts_.without_fit++;
        continue;
      }
      counts_.outlier += outcome.outlier;
      truth_mm_.push_back(outcome.from_truth_mm);
      const double wrong_mm = gaussian ? outcome.from_reference_um * 1e-3 : outcome.from_truth_mm;
      const bool warned = (outcome.flags & WARNINGS) != 0;
      bad_unflagged_ += wrong_mm > BAD_mm && !warned;
      good_flagged_ += wrong_mm <= BAD_mm && warned;
    }
  }

  Row row(const char *kernel, const std::string &variant, const std::string &set, bool observable) {
    Row row = counts_;
    row.kernel = kernel;
    row.variant = variant;
    row.set = set;
    row.observable = observable;
    std::sort(um_.begin(), um_.end());
    std::sort(truth_mm_.begin(), truth_mm_.end());
    row.p50_um = quantile(um_, 0.5);
    row.p99_um = quantile(um_, 0.99);
    row.p999_um = quantile(um_, 0.999);
    row.worst_um = quantile(um_, 1.0);
    row.truth_p50_mm = quantile(truth_mm_, 0.5);
    row.truth_p99_mm = quantile(truth_mm_, 0.99);
    const auto presses = static_cast<double>(row.presses);
    row.bad_unflagged = static_cast<double>(bad_unflagged_) / presses;
    row.good_flagged = static_cast<double>(good_flagged_) / presses;
    return row;
  }

private:
  Row counts_;
  std::size_t bad_unflagged_ = 0, good_flagged_ = 0;
  std::vector<double> um_, truth_mm_;
};

std::vector<Outcome> run(const fitting::Kernel &kernel, const fit_array &array, const Variant &variant,
                         const std::vector<Case> &cases) {
  std::vector<Outcome> outcomes(cases.size());
  fingertip::twin::in_parallel(cases.size(), [&](std::size_t i) {
    const Case &c = cases[i];
    const auto readings = reference::quantise(c.press.pressure_Pa, variant.lsb_Pa);
    const auto result = kernel.fit(array, readings.data(), c.usable,
                                   {variant.iterations, c.press.noise_Pa, variant.n_largest, variant.prior_sigma_mm,
                                    variant.prior_width_mm, variant.guess});
    const double um = 1e3 * std::hypot(result.x_mm - c.best.theta.x_mm, result.y_mm - c.best.theta.y_mm);
    const bool fitted = (result.flags & CONTACT_FLAG_FIT_VALID) && std::isfinite(um);
    outcomes[i] = {fitted ? um : std::numeric_limits<double>::infinity(),
                   std::hypot(result.x_mm - c.press.x_mm, result.y_mm - c.press.y_mm), result.flags,
                   variant.n_largest == 0 && result.used != c.usable};
  });
  return outcomes;
}

void print_header() {
  std::printf("%-12s %-18s set  obs %7s %9s %9s %9s %9s %6s %6s %8s %8s %8s %8s\n", "kernel", "variant", "presses",
              "p50_um", "p99_um", "p99.9_um", "worst_um", ">10um", ">100um", "tru50_mm", "tru99_mm", "bad!flag",
              "good&fl");
}

void print(const Row &row) {
  std::printf("%-12s %-18s %-4s %s %7zu %9.4g %9.4g %9.4g %9.4g %6zu %6zu %8.3g %8.3g %7.3f%% "
              "%7.3f%%\n",
              row.kernel.c_str(), row.variant.c_str(), row.set.c_str(), row.observable ? "yes" : " no", row.presses,
              row.p50_um, row.p99_um, row.p999_um, row.worst_um, row.above_10um, row.above_100um, row.truth_p50_mm,
              row.truth_p99_mm, 100.0 * row.bad_unflagged, 100.0 * row.good_flagged);
  std::fflush(stdout);
}

void write_rows(const std::vector<Row> &rows, const Options &options) {
  auto list = nlohmann::ordered_json::array();
  for (const Row &r : rows) {
    list.push_back({{"kernel", r.kernel},
                    {"variant", r.variant},
                    {"set", r.set},
                    {"observable", r.observable},
                    {"presses", r.presses},
                    {"without_fit", r.without_fit},
                    {"outlier", r.outlier},
                    {"above_10um", r.above_10um},
                    {"above_100um", r.above_100um},
                    {"p50_um", r.p50_um},
                    {"p99_um", r.p99_um},
                    {"p999_um", r.p999_um},
                    {"worst_um", r.worst_um},
                    {"truth_p50_mm", r.truth_p50_mm},
                    {"truth_p99_mm", r.truth_p99_mm},
                    {"bad_unflagged", r.bad_unflagged},
                    {"good_flagged", r.good_flagged}});
  }
  fitting::write_json(options.out + "/fit_error.json",
                      {{"seed", options.seed}, {"presses", options.limit}, {"rows", std::move(list)}});
}

// {"variants": [{"kernel": .., "variant": .., settings}], "presses": {mask: [press]}}
void write_jobs(const Options &options) {
  constexpr std::size_t SHARE = 1000; // of the presses
  auto variants = nlohmann::ordered_json::array();
  for (const fitting::Kernel &kernel : fitting::all_kernels()) {
    for (const Variant &v : all_variants()) {
      if (has(kernel, v) && v.on_chip) {
        variants.push_back({{"kernel", kernel.name},
                            {"variant", v.name},
                            {"iterations", v.iterations},
                            {"n_largest", v.n_largest},
                            {"guess", fitting::name_of(v.guess)},
                            {"mask", reference::name_of(v.mask)},
                            {"prior_sigma_mm", v.prior_sigma_mm},
                            {"prior_width_mm", v.prior_width_mm}});
      }
    }
  }
  nlohmann::ordered_json presses;
  for (Mask mask : reference::ALL_MASKS) {
    auto &of_mask = presses[reference::name_of(mask)];
    for (PressSet set : reference::ALL_PRESS_SETS) {
      const std::size_t count = std::max<std::size_t>(1, presses_of(set, Mask::none, options.limit) / SHARE);
      for (const Case &c : reference::load_cases(set, mask, options.seed, count, options.cache)) {
        of_mask.push_back({{"set", std::string(1, reference::name_of(set))},
                           {"observable", c.observable},
                           {"usable", c.usable},
                           {"noise_Pa_q10", static_cast<std::int32_t>(c.press.noise_Pa * 1024.0)},
                           {"best_x_mm", c.best.theta.x_mm},
                           {"best_y_mm", c.best.theta.y_mm},
                           {"readings", c.pressure_Pa_q10}});
      }
    }
  }
  fitting::write_json(options.jobs, {{"variants", std::move(variants)}, {"presses", std::move(presses)}});
}

int report(const Options &options) {
  if (!options.jobs.empty()) {
    write_jobs(options);
    return 0;
  }
  std::filesystem::create_directories(options.out);
  const fit_array array = fitting::firmware_fit_array();
  std::map<std::pair<PressSet, Mask>, std::vector<Case>> loaded;
  const auto cases_of = [&](PressSet set, Mask mask) -> const std::vector<Case> & {
    auto &cases = loaded[{set, mask}];
    if (cases.empty()) {
      cases = reference::load_cases(set, mask, options.seed, presses_of(set, mask, options.limit), options.cache);
    }
    return cases;
  };
  std::vector<Row> rows;
  print_header();
  for (const fitting::Kernel &kernel : fitting::all_kernels()) {
    if (!options.kernel.empty() && options.kernel != kernel.name) {
      continue;
    }
    for (const Variant &variant : all_variants()) {
      if (variant.name.find(options.variant) == std::string::npos || !has(kernel, variant)) {
        continue;
      }
      Tally together[2];
      const auto keep = [&](const Row &row) {
        if (row.presses > 0) {
          print(row);
          rows.push_back(row);
        }
      };
      for (PressSet set : reference::ALL_PRESS_SETS) {
        const std::string name(1, reference::name_of(set));
        if (!options.set.empty() && options.set != name) {
          continue;
        }
        const std::vector<Case> &cases = cases_of(set, variant.mask);
        const std::vector<Outcome> outcomes = run(kernel, array, variant, cases);
        for (bool observable : {true, false}) {
          Tally tally;
          tally.add(cases, outcomes, set, observable);
          together[observable].add(cases, outcomes, set, observable);
          keep(tally.row(kernel.name, variant.name, name, observable));
        }
      }
      if (options.set.empty()) {
        for (bool observable : {true, false}) {
          keep(together[observable].row(kernel.name, variant.name, "ABCD", observable));
        }
      }
    }
  }
  if (rows.empty()) {
    throw std::runtime_error("no kernel, variant and set match");
  }
  write_rows(rows, options);
  return 0;
}

} // namespace

int main(int argc, char **argv) {
  try {
    return report(parse(argc, argv));
  } catch (const std::exception &error) {
    std::fprintf(stderr, "fit_report: %s\n", error.what());
    return 1;
  }
}
