// fit_bench: time and error of one fit, our kernels and host libraries on the same presses.
#include "report/fit/json_file.hpp"
#include "report/fit/kernels.hpp"
#include "report/fit/libraries.hpp"
#include "report/reference/dataset.hpp"
#include "report/reference/options.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <stdexcept>
#include <string>
#include <time.h>
#include <vector>

namespace {

namespace fitting = fingertip::fitting;
namespace reference = fingertip::reference;
using fitting::Kernel;
using reference::Case;

const char USAGE[] =
    R"(fit_bench: time and error of one fit, our kernels and host libraries on the same presses.

usage: fit_bench [--limit N] [--passes N] [--seed S] [--out DIR] [--cache DIR]

Takes the observable ones of the first N presses (12 000 by default, the sets A to D mixed), cuts
them into blocks and lets every kernel fit block after block, in an order that rotates, so that all
of them see the same machine. A fit starts at the readings as the firmware receives them and ends at
location, peak, width and force. Kernels that run a number of iterations run seven; separable goes
on until it has settled, twelve at the most, which leaves it no more error than any library; what
those do is in report/fit/libraries.hpp. Writes fit_bench.json to --out, prints:
  us          processor time of one fit: median over blocks and passes, 10 % and 90 % quantiles
  ratio       the same block's time by this kernel over that by separable: median, 10 %, 90 %
  p50_um ..   distance of the location from the reference optimum; not a number counts as
              infinitely far
Times depend on the machine and its load; the ratios are what is comparable.
)";

constexpr std::size_t BLOCK = 400;
constexpr int ITERATIONS = 7;
// The kernel made for the host, which the others are compared with, and its most iterations.
constexpr char HOST_KERNEL[] = "separable";
constexpr int HOST_ITERATIONS = 12;

int iterations_of(const char *kernel) {
  return std::strcmp(kernel, HOST_KERNEL) == 0 ? HOST_ITERATIONS : ITERATIONS;
}

struct Measured {
  const char *name;
  std::vector<double> block_us; // [pass * blocks + block], time per fit
  std::vector<double> error_um; // [press]
};

// Of this thread: what others run meanwhile does not count.
double processor_time_us() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e6 * static_cast<double>(now.tv_sec) + 1e-3 * static_cast<double>(now.tv_nsec);
}

double quantile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

std::vector<Case> mixed_cases(std::uint64_t limit, std::uint64_t seed, const std::string &cache) {
  std::vector<Case> mixed;
  std::vector<std::vector<Case>> sets;
  for (reference::PressSet set : reference::ALL_PRESS_SETS) {
    const bool gaussian = set == reference::PressSet::A || set == reference::PressSet::B;
    sets.push_back(reference::load_cases(set, reference::Mask::none, seed, limit / (gaussian ? 3 : 6), cache));
  }
  for (std::size_t i = 0; i < limit; i++) {
    // A B C A B D: each set keeps its share in every block.
    const std::size_t six = i % 6;
    const std::size_t set = six % 3 < 2 ? six % 3 : six == 2 ? 2 : 3;
    const std::size_t at = set < 2 ? i / 6 * 2 + six / 3 : i / 6;
    if (at < sets[set].size() && sets[set][at].observable) {
      mixed.push_back(sets[set][at]);
    }
  }
  return mixed;
}

std::vector<Measured> measure(const std::vector<Kernel> &kernels, const std::vector<Case> &cases,
                              std::uint64_t passes) {
  const fit_array array = fitting::firmware_fit_array();
  std::vector<Measured> all;
  for (const Kernel &kernel : kernels) {
    all.push_back({kernel.name, {}, std::vector<double>(cases.size())});
  }
  std::size_t turn = 0;
  for (std::uint64_t pass = 0; pass < passes; pass++) {
    for (std::size_t start = 0; start + BLOCK <= cases.size(); start += BLOCK, turn++) {
      for (std::size_t i = 0; i < kernels.size(); i++) {
        const std::size_t k = (i + turn) % kernels.size();
        const int iterations = iterations_of(kernels[k].name);
        fitting::KernelResult results[BLOCK];
        const double before_us = processor_time_us();
        for (std::size_t n = 0; n < BLOCK; n++) {
          const Case &c = cases[start + n];
          results[n] = kernels[k].fit(array, c.pressure_Pa_q10.data(), c.usable, {iterations, c.press.noise_Pa});
        }
        all[k].block_us.push_back((processor_time_us() - before_us) / BLOCK);
        for (std::size_t n = 0; n < BLOCK; n++) {
          const auto &best = cases[start + n].best.theta;
          const double um = 1e3 * std::hypot(results[n].x_mm - best.x_mm, results[n].y_mm - best.y_mm);
          all[k].error_um[start + n] = std::isfinite(um) ? um : std::numeric_limits<double>::infinity();
        }
      }
    }
    std::fprintf(stderr, "\rpass %llu of %llu ", static_cast<unsigned long long>(pass + 1),
                 static_cast<unsigned long long>(passes));
  }
  std::fputc('\n', stderr);
  return all;
}

std::string processor() {
  std::ifstream file("/proc/cpuinfo");
  for (std::string line; std::getline(file, line);) {
    if (line.rfind("model name", 0) == 0) {
      return line.substr(line.find(": ") + 2);
    }
  }
  return "unknown";
}

int bench(int argc, char **argv) {
  std::string out = FINGERTIP_REPORT_DIR, cache = FINGERTIP_CACHE_DIR;
  std::uint64_t limit = 12000, passes = 3, seed = 20221015;
  reference::parse_options(argc, argv,
                           {{"--out", &out},
                            {"--cache", &cache},
                            {"--limit", nullptr, &limit},
                            {"--passes", nullptr, &passes},
                            {"--seed", nullptr, &seed}},
                           USAGE);
  std::filesystem::create_directories(out);
  std::vector<Case> cases = mixed_cases(limit, seed, cache);
  cases.resize(cases.size() / BLOCK * BLOCK);
  if (cases.empty() || passes == 0) {
    throw std::runtime_error("too few presses: raise --limit to 1000 at least, --passes to 1");
  }
  std::vector<Kernel> kernels = fitting::all_kernels();
  std::stable_partition(kernels.begin(), kernels.end(),
                        [](const Kernel &kernel) { return std::strcmp(kernel.name, HOST_KERNEL) == 0; });
  for (const Kernel &kernel : fitting::library_kernels()) {
    kernels.push_back(kernel);
  }
  const std::vector<Measured> all = measure(kernels, cases, passes);

  auto rows = nlohmann::ordered_json::array();
  std::printf("%zu observable presses, %s\n", cases.size(), processor().c_str());
  std::printf("%-13s %8s %17s %8s %17s %10s %10s %7s\n", "kernel", "us", "10 %..90 %", "ratio", "10 %..90 %", "p50_um",
              "p99.9_um", ">100um");
  for (const Measured &m : all) {
    std::vector<double> ratio;
    for (std::size_t i = 0; i < m.block_us.size(); i++) {
      ratio.push_back(m.block_us[i] / all.front().block_us[i]);
    }
    const double values[] = {quantile(m.block_us, 0.5), quantile(m.block_us, 0.1),  quantile(m.block_us, 0.9),
                             quantile(ratio, 0.5),      quantile(ratio, 0.1),       quantile(ratio, 0.9),
                             quantile(m.error_um, 0.5), quantile(m.error_um, 0.999)};
    const auto above = std::count_if(m.error_um.begin(), m.error_um.end(), [](double um) { return um > 100.0; });
    std::printf("%-13s %8.3f %8.3f..%7.3f %8.3f %8.3f..%7.3f %10.4g %10.4g %7td\n", m.name, values[0], values[1],
                values[2], values[3], values[4], values[5], values[6], values[7], above);
    const char *names[] = {"us", "us_p10", "us_p90", "ratio", "ratio_p10", "ratio_p90", "p50_um", "p999_um"};
    nlohmann::ordered_json row{{"kernel", m.name}};
    for (std::size_t i = 0; i < std::size(names); i++) {
      row[names[i]] = values[i];
    }
    row["above_100um"] = above;
    rows.push_back(std::move(row));
  }
  fitting::write_json(out + "/fit_bench.json", {{"processor", processor()},
                                                {"compiler", __VERSION__},
                                                {"presses", cases.size()},
                                                {"passes", passes},
                                                {"seed", seed},
                                                {"rows", std::move(rows)}});
  return 0;
}

} // namespace

int main(int argc, char **argv) {
  try {
    return bench(argc, argv);
  } catch (const std::exception &error) {
    std::fprintf(stderr, "fit_bench: %s\n", error.what());
    return 1;
  }
}
