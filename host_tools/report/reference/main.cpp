// reference: the least-squares optimum in double precision of presses, recordings and scenarios.
// Exit status: 0 done; 1 something went wrong, said in one line; 2 wrong usage.
#include "libfingertip/text.hpp"
#include "report/reference/dataset.hpp"
#include "report/reference/whole_number.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <fstream>
#include <functional>
#include <iostream>
#include <optional>
#include <stdexcept>

namespace {

using namespace fingertip;
using namespace fingertip::reference;

struct Options {
  std::string set = "A", input = "-";
  std::uint64_t seed = 1;
  std::size_t count = 10;
  double noise_Pa = 5.0; // of a sensor at the default oversampling
};

constexpr std::size_t PRESSES_MAX = 1'000'000;

int presses(const Options &options) {
  const Array array = firmware_array();
  const PressSet set = ALL_PRESS_SETS.at(static_cast<std::size_t>(options.set[0] - 'A'));
  std::printf("press,x_mm,y_mm,force_N,noise_Pa");
  for (std::size_t k = 0; k < array.x_mm.size(); k++) {
    std::printf(",s%zu_Pa", k);
  }
  std::putchar('\n');
  for (std::size_t i = 0; i < options.count; i++) {
    const Press press = make_press(set, array, options.seed, i);
    std::printf("%zu,%.9g,%.9g,%.9g,%.9g", i, press.x_mm, press.y_mm, press.force_N, press.noise_Pa);
    for (std::int32_t q10 : quantise(press.pressure_Pa)) {
      std::printf(",%.10g", q10 / 1024.0);
    }
    std::putchar('\n');
  }
  return 0;
}

// One table of readings, row by row.
class Readings {
public:
  Readings(std::istream &file, std::string path, std::size_t sensors)
      : file_(file), path_(std::move(path)), gain_(sensors, 1.0) {
    while (names_.empty() && next_line()) {
      names_ = split(line_);
    }
    if (column("device")) {
      throw std::runtime_error(path_ + ": holds several fingertips; record each alone");
    }
    for (std::size_t k = 0; k < sensors; k++) {
      sensor_.push_back(column("s" + std::to_string(k) + "_Pa"));
      tare_.push_back(column("tare" + std::to_string(k) + "_Pa"));
      if (!sensor_[k]) {
        throw std::runtime_error(path_ + ": has no column s" + std::to_string(k) + "_Pa; give readings of all " +
                                 std::to_string(sensors) + " sensors, a recording with the raw stream, or a scenario");
      }
    }
  }

  bool next() {
    if (!next_line()) {
      return false;
    }
    cells_ = split(line_);
    if (cells_.size() != names_.size()) {
      fail("has " + std::to_string(cells_.size()) + " cells, its header " + std::to_string(names_.size()));
    }
    return true;
  }

  const std::string &first_name() const { return names_.front(); }
  const std::string &first_cell() const { return cells_.front(); }
  std::optional<std::size_t> column(const std::string &name) const {
    const auto at = std::find(names_.begin(), names_.end(), name);
    return at == names_.end() ? std::nullopt : std::make_optional<std::size_t>(at - names_.begin());
  }
  // Nothing where the column or the cell is empty.
  std::optional<double> number(std::optional<std::size_t> column) const {
    if (!column || cells_[*column].empty()) {
      return std::nullopt;
    }
    const std::optional<double> value = to_double(cells_[*column]);
    if (!value) {
      fail("'" + cells_[*column] + "' is not a number");
    }
    return value;
  }
  // As the fit gets it: above the zero, over the gain.
  std::optional<double> pressure_Pa(std::size_t k) const {
    const std::optional<double> reading_Pa = number(sensor_[k]), tare_Pa = number(tare_[k]);
    if (!reading_Pa || (tare_[k] && !tare_Pa)) {
      return std::nullopt;
    }
    return (*reading_Pa - tare_Pa.value_or(0.0)) / gain_[k];
  }

private:
  static std::vector<std::string> split(const std::string &line) {
    std::vector<std::string> cells;
    for (std::string_view cell : fingertip::split(line, ',')) {
      cells.emplace_back(cell);
    }
    return cells;
  }

  [[noreturn]] void fail(const std::string &what) const {
    throw std::runtime_error(path_ + ":" + std::to_string(number_) + ": " + what);
  }

  // Comments are read past, but for the gains of a calibrated fingertip.
  bool next_line() {
    while (std::getline(file_, line_)) {
      number_++;
      constexpr std::string_view GAINS = "# gains: ";
      if (line_.rfind(GAINS, 0) == 0) {
        read_gains(line_.substr(GAINS.size()));
      }
      if (!line_.empty() && line_.front() != '#') {
        return true;
      }
    }
    if (names_.empty()) {
      fail("no header; the first line names the columns");
    }
    return false;
  }

  void read_gains(const std::string &text) {
    const auto gains = fingertip::split(text, ' ');
    if (gains.size() != gain_.size()) {
      fail(std::to_string(gains.size()) + " gains for " + std::to_string(gain_.size()) + " sensors");
    }
    for (std::size_t k = 0; k < gains.size(); k++) {
      const std::optional<double> gain = to_double(gains[k]);
      if (!gain || *gain <= 0.0) {
        fail("'" + std::string(gains[k]) + "' is no gain");
      }
      gain_[k] = *gain;
    }
  }

  std::istream &file_;
  std::string path_, line_;
  std::size_t number_ = 0;
  std::vector<double> gain_;
  std::vector<std::string> names_, cells_;
  std::vector<std::optional<std::size_t>> sensor_, tare_;
};

int fit_rows(const Options &options) {
  constexpr double ABSOLUTE_Pa = 50e3; // no pad weighs on all of its sensors so
  constexpr std::size_t SENSORS_MIN = 4;
  std::ifstream file;
  const bool standard = options.input == "-";
  if (!standard) {
    file.open(options.input);
    if (!file) {
      throw std::runtime_error(options.input + ": cannot read it; does it exist?");
    }
  }
  const Array array = firmware_array();
  Readings rows(standard ? std::cin : file, standard ? "standard input" : options.input, array.x_mm.size());
  const auto noise = rows.column("noise_Pa"), x = rows.column("x_mm"), y = rows.column("y_mm");
  std::printf("%s,best_x_mm,best_y_mm,best_p0_Pa,best_sigma_mm,best_force_N,location_sd_mm,"
              "condition_number,observable,at_bound,distance_mm\n",
              rows.first_name().c_str());
  while (rows.next()) {
    std::vector<double> pressure_Pa(array.x_mm.size(), 0.0);
    std::uint32_t usable = 0;
    double least_Pa = HUGE_VAL, largest_Pa = 0.0;
    for (std::size_t k = 0; k < pressure_Pa.size(); k++) {
      if (const auto reading_Pa = rows.pressure_Pa(k)) {
        pressure_Pa[k] = *reading_Pa;
        usable |= std::uint32_t{1} << k;
        least_Pa = std::min(least_Pa, pressure_Pa[k]);
        largest_Pa = std::max(largest_Pa, pressure_Pa[k]);
      }
    }
    const bool no_zero = usable != 0 && least_Pa > ABSOLUTE_Pa;
    if (no_zero && !rows.column("tare0_Pa")) {
      throw std::runtime_error("the readings are absolute pressures; subtract each sensor's zero, or give its column "
                               "tare0_Pa, ...");
    }
    const std::string &row = rows.first_cell();
    if (__builtin_popcount(usable) < static_cast<int>(SENSORS_MIN) || largest_Pa <= 0.0 || no_zero) {
      std::printf("%s,,,,,,,,,,\n", row.c_str());
      continue;
    }
    const double noise_Pa = rows.number(noise).value_or(options.noise_Pa);
    const Fit best = fit(array, pressure_Pa, usable, noise_Pa);
    const bool located = observable(best) && !best.at_bound && largest_Pa >= GATE_SIGMAS * noise_Pa;
    std::printf("%s,%.7g,%.7g,%.7g,%.7g,%.7g,%.4g,%.4g,%d,%d,", row.c_str(), best.theta.x_mm, best.theta.y_mm,
                best.theta.p0_Pa, best.theta.sigma_mm, best.force_N, best.location_sd_mm, best.condition_number,
                located, best.at_bound);
    const auto there_x = rows.number(x), there_y = rows.number(y);
    if (located && there_x && there_y) {
      std::printf("%.5g", std::hypot(best.theta.x_mm - *there_x, best.theta.y_mm - *there_y));
    }
    std::putchar('\n');
  }
  return 0;
}

int run(int argc, char **argv) {
  Options options;
  std::function<int()> action;
  CLI::App app("The optimum that the fingertip's fit is measured against, in double precision.", "reference");
  app.set_version_flag("--version", "reference " FINGERTIP_VERSION);
  app.require_subcommand(1);
  app.failure_message([](const CLI::App *, const CLI::Error &error) {
    return printable("reference: " + std::string(error.what()) + "; see reference --help") + "\n";
  });

  CLI::App *draw = app.add_subcommand("presses", "Print presses of a set: truth and readings");
  draw->add_option("--set", options.set, "A, B: Gaussians; C, D: on rubber of 12 and 6 mm")
      ->check(CLI::IsMember({"A", "B", "C", "D"}))
      ->capture_default_str();
  draw->add_option("--count", options.count, "How many")
      ->check(CLI::Range(std::size_t{1}, PRESSES_MAX))
      ->capture_default_str();
  draw->add_option("--seed", options.seed, "Of the presses")->check(whole_number())->capture_default_str();
  draw->callback([&] { action = [&] { return presses(options); }; });

  CLI::App *solve =
      app.add_subcommand("fit", "Print the optimum of each row of readings: a recording with the raw stream, a\n"
                                "scenario, or what presses prints. A row keeps its first cell; distance_mm is from\n"
                                "its x_mm, y_mm; a sensor with an empty cell is left out.");
  solve->add_option("file", options.input, "The readings; - is standard input, the default")->type_name("FILE.csv");
  solve->add_option("--noise", options.noise_Pa, "Of a sensor, Pa rms, without a column noise_Pa")
      ->check(CLI::Range(0.01, 10000.0))
      ->capture_default_str();
  solve->callback([&] { action = [&] { return fit_rows(options); }; });

  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError &error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  const int status = action();
  if (std::fflush(stdout) != 0 || std::ferror(stdout)) {
    throw std::runtime_error("cannot write standard output; is the disk full?");
  }
  return status;
}

} // namespace

int main(int argc, char **argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception &error) {
    std::fprintf(stderr, "reference: %s\n", printable(error.what()).c_str());
    return 1;
  }
}
