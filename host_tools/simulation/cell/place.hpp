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

// The ports' folder, for one simulation at a time.
class PortFolder {
public:
  // folder empty: that of simulated ports (discovery.hpp), and fingertips are shared with every
  // program as by `fingertip serve`. Throws Error: another simulation is there.
  explicit PortFolder(const std::string &folder);
  ~PortFolder();
  PortFolder(const PortFolder &) = delete;
  PortFolder &operator=(const PortFolder &) = delete;

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

class FingertipProcesses {
public:
  // Before there are threads. Throws Error.
  FingertipProcesses(const PortFolder &place, const std::vector<FingerProcess> &fingers);
  ~FingertipProcesses();
  FingertipProcesses(const FingertipProcesses &) = delete;
  FingertipProcesses &operator=(const FingertipProcesses &) = delete;

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
  // What is shared with its process, while it is there.
  SharedPressures &shared(std::size_t finger) const { return shared_[finger]; }
  // In the fingertip's own time.
  std::int64_t device_us(std::size_t finger, std::int64_t host_us) const { return host_us - shared_[finger].zero_us; }
  bool is_there(std::size_t finger) const { return processes_[finger] > 0; }
  void end(std::size_t finger);
  // Throws Error: one has ended by itself.
  void check();

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
