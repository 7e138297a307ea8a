// The common base of simulations of fingertips in real time, whatever touches their rubber: a folder
// with their ports, a process for each, the server that shares them, the file of the truth.
#pragma once

#include "libfingertip/output_file.hpp"
#include "library/share/server.hpp"
#include "simulation/cell/fingertip_cell_finger.hpp"

#include <array>
#include <csignal>
#include <optional>
#include <string>
#include <vector>

namespace fingertip::cell {

constexpr std::array<const char *, 2> SIDES = {"left", "right"};

// Signals that end a simulation set it.
extern volatile std::sig_atomic_t interrupted;

// Of every simulation.
struct SimulationOptions {
  std::string truth, cache;
  std::optional<double> seconds, gain_spread; // gain_spread: standard deviation; none: the simulation's usual one
  std::uint64_t seed = 1;
  bool overwrite = false;
};

// The ports' folder, for one simulation at a time.
class Place {
public:
  // folder empty: that of simulated ports (discovery.hpp), and fingertips are shared with every
  // program as by `fingertip serve`. Throws Error: another simulation is there.
  explicit Place(const std::string &folder);
  ~Place();
  Place(const Place &) = delete;
  Place &operator=(const Place &) = delete;

  bool is_shared() const { return is_shared_; }
  std::string port(const std::string &name) const { return folder_ + "/" + name; }
  // The processes of the first sides, on their ports, with gains of their own.
  std::vector<FingerProcess> fingers(std::size_t count, std::uint64_t seed, double gain_sd, bool parallel_bus,
                                     std::optional<double> calibrated_sd = {}) const;
  // Prints their ports, and of what else is there.
  void print_ready(std::size_t fingers, const std::string &more = "") const;

private:
  std::string folder_;
  bool is_shared_;
  int lock_ = -1;
};

// Their processes.
class Fingers {
public:
  // Before there are threads. Throws Error.
  Fingers(const Place &place, const std::vector<FingerProcess> &fingers);
  ~Fingers();
  Fingers(const Fingers &) = delete;
  Fingers &operator=(const Fingers &) = delete;

  // Once they know their zeros, and are shared where they are to be. Throws Error: one cannot start, or a signal came.
  void wait_until_ready();
  // At this time, later than all before; [finger].
  void put(std::int64_t host_us, const std::vector<Pressures> &pressures) {
    for (std::size_t i = 0; i < count(); i++) {
      shared_[i].put(host_us, pressures[i]);
    }
  }
  // Serves the programs that share them, waiting at most this long for one.
  void share(std::chrono::milliseconds longest_wait);

  std::size_t count() const { return fingers_.size(); }
  std::uint32_t rates_set(std::size_t finger) const { return shared_[finger].rates_set; }
  std::int64_t reached_us(std::size_t finger) const { return shared_[finger].reached_us; }
  // In the fingertip's own time.
  std::int64_t device_us(std::size_t finger, std::int64_t host_us) const { return host_us - shared_[finger].zero_us; }
  bool is_there(std::size_t finger) const { return processes_[finger] > 0; }
  bool is_frozen(std::size_t finger) const { return shared_[finger].frozen; }
  void freeze(std::size_t finger, bool frozen) { shared_[finger].frozen = frozen; }
  void end(std::size_t finger);
  // Throws Error: one has ended by itself.
  void look();

private:
  void forget(std::size_t finger);

  std::vector<FingerProcess> fingers_;
  std::vector<pid_t> processes_;
  SharedPressures *shared_ = nullptr; // [finger]
  std::optional<Server> server_;
};

// The truth as a CSV file with comments.
class Truth {
public:
  // path empty: it is not kept. head: comments and the names of the columns after the first.
  Truth(const std::string &path, bool overwrite, const std::string &head);

  // Every 2 ms at most.
  void row(std::int64_t host_us, const std::string &cells);
  void event(std::int64_t host_us, const std::string &text);

private:
  void put(const std::string &lines);

  std::optional<OutputFile> file_;
  std::int64_t written_us_ = 0;
};

} // namespace fingertip::cell
