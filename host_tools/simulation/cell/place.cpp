#include "simulation/cell/place.hpp"

#include "libfingertip/clock.hpp"
#include "libfingertip/discovery.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/random.hpp"
#include "libfingertip/session.hpp"
#include "libfingertip/share_socket.hpp"
#include "libfingertip/text.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <new>
#include <sys/file.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

namespace fingertip::cell {

namespace fs = std::filesystem;

constexpr const char *SERIALS[SIDES.size()] = {"00000000000CE110", "00000000000CE111"};
enum Stream : std::uint64_t { GAINS = 851 };
constexpr std::chrono::milliseconds CHECK_INTERVAL{10};
constexpr std::int64_t ROW_us = 2'000;

volatile std::sig_atomic_t interrupted = 0;

PortFolder::PortFolder(const std::string &folder) : folder_(folder.empty() ? simulated_folder() : folder), is_shared_(folder.empty()) {
  std::error_code error;
  if (is_shared_) {
    make_own_folder(own_share_folder());
    make_own_folder(folder_);
  } else if (fs::create_directories(folder_, error); error) {
    throw Error(ErrorCode::cannot_write, folder_ + ": " + error.message());
  }
  lock_ = open((folder_ + "/lock").c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0600);
  if (lock_ < 0) {
    throw Error(ErrorCode::cannot_write, folder_ + ": " + std::strerror(errno));
  }
  if (flock(lock_, LOCK_EX | LOCK_NB) != 0) {
    close(lock_);
    throw Error(folder_ + ": another simulation has its ports there; end that one, or choose another folder (--ports)");
  }
}

PortFolder::~PortFolder() {
  unlink((folder_ + "/lock").c_str());
  close(lock_);
}

std::vector<FingerProcess> PortFolder::fingers(std::size_t count, std::uint64_t seed, double gain_sd, bool parallel_bus,
                                               std::optional<double> calibrated_sd) const {
  std::vector<FingerProcess> fingers;
  for (std::size_t i = 0; i < count; i++) {
    FingerProcess &finger = fingers.emplace_back(FingerProcess{SERIALS[i], port(SIDES[i]), 2 * seed + i, {}, calibrated_sd, parallel_bus});
    Random random(finger.seed, GAINS, 0);
    for (std::size_t k = 0; k < SENSORS; k++) {
      finger.gain.push_back(1.0 + std::clamp(gain_sd * random.normal(), -0.5, 0.5));
    }
  }
  return fingers;
}

void PortFolder::print_ready(std::size_t fingers, const std::string &more) const {
  std::printf("ready: %s%s%s\n", port(SIDES[0]).c_str(), fingers > 1 ? (", " + port(SIDES[1])).c_str() : "", more.c_str());
  std::fflush(stdout);
}

FingertipProcesses::FingertipProcesses(const PortFolder &place, const std::vector<FingerProcess> &fingers)
    : fingers_(fingers), processes_(fingers.size()) {
  if (place.is_shared()) {
    server_.emplace(Server::Options{own_share_folder(), {}}, [](const std::string &line) {
      if (line.find(": shared as ") == std::string::npos) {
        std::fprintf(stderr, "%s\n", printable(line).c_str());
      }
    });
  }
  void *memory = mmap(nullptr, count() * sizeof(SharedPressures), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) {
    throw std::bad_alloc();
  }
  shared_ = new (memory) SharedPressures[count()];
  for (std::size_t i = 0; i < count(); i++) {
    processes_[i] = start_finger(fingers_[i], shared_[i]);
  }
}

FingertipProcesses::~FingertipProcesses() {
  server_.reset();
  for (std::size_t i = 0; i < count(); i++) {
    end(i);
  }
  munmap(shared_, count() * sizeof(SharedPressures));
}

void FingertipProcesses::wait_until_ready() {
  const auto goes_on = [&] {
    put(steady_now_us(), std::vector<Pressures>(count(), Pressures(SENSORS)));
    check();
    if (interrupted) {
      throw Error("interrupted");
    }
  };
  for (std::size_t i = 0; i < count(); i++) {
    while (shared_[i].reached_us == 0) {
      goes_on();
      wait_until(host_now() + CHECK_INTERVAL);
    }
  }
  for (std::size_t i = 0; server_ && i < count(); i++) {
    server_->add({fingers_[i].serial, fingers_[i].link, false});
    const std::string socket = own_share_folder() + "/" + share_socket_name(fingers_[i].serial);
    while (!SocketTransport::is_served(socket)) { // a killed simulation may have left one
      goes_on();
      server_->step(CHECK_INTERVAL);
    }
  }
}

void FingertipProcesses::share(std::chrono::milliseconds longest_wait) {
  if (server_) {
    server_->step(longest_wait);
  } else if (longest_wait.count() > 0) {
    wait_until(host_now() + longest_wait);
  }
}

void FingertipProcesses::end(std::size_t finger) {
  if (is_there(finger)) {
    kill(processes_[finger], SIGKILL);
    waitpid(processes_[finger], nullptr, 0);
    forget(finger);
  }
}

void FingertipProcesses::check() {
  for (std::size_t i = 0; i < count(); i++) {
    if (is_there(i) && waitpid(processes_[i], nullptr, WNOHANG) != 0) {
      forget(i);
      throw Error("a fingertip has ended by itself");
    }
  }
}

void FingertipProcesses::forget(std::size_t finger) {
  processes_[finger] = 0;
  std::error_code none;
  fs::remove(fingers_[finger].link, none);
}

Truth::Truth(const std::string &path, bool overwrite, const std::string &head) {
  if (!path.empty()) {
    file_.emplace(path, overwrite, OutputFile::Appears::at_once);
    put(head);
  }
}

void Truth::row(std::int64_t host_us, const std::string &cells) {
  if (host_us - written_us_ >= ROW_us) {
    written_us_ = host_us;
    put(std::to_string(host_us) + "," + cells + "\n");
  }
}

void Truth::event(std::int64_t host_us, const std::string &text) {
  put("# event: " + std::to_string(host_us) + "," + printable(text) + "\n");
}

void Truth::put(const std::string &lines) {
  if (file_) {
    file_->append(lines.data(), lines.size());
  }
}

} // namespace fingertip::cell
