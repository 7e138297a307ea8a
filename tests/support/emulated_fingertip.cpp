// An emulated fingertip in a simulated world (time_keeper.cpp):
//
//   emulated_fingertip PORT [--wait-open] NODE MAIN.MJS [option of the emulator...]
//
// runs the emulator with --stepped and serves its CDC port as PORT (simulated_port.cpp). Emulated
// time passes with the world's: what the board sends arrives at its time, what a client does
// reaches the board TRANSFER later, always. So the emulator may be ahead of the world, by TRANSFER
// beyond the first moment that anybody else goes on, and two runs are the same byte for byte.
//
// --wait-open: power comes when the port is first opened. With the power comes a line on standard
// output, the world's time then in us: "1000002500". Ends with the emulator and its exit status;
// SIGTERM and SIGINT end the emulator's run.
#include "libfingertip/error.hpp"
#include "libfingertip/served_port.hpp"
#include "support/simulated_clock.hpp"

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <fcntl.h>
#include <spawn.h>
#include <string>
#include <sys/wait.h>
#include <unistd.h>
#include <vector>

using fingertip::host_now;
using fingertip::HostTime;
using std::chrono::microseconds;

namespace {

// Less than the millisecond between two frames of the bus, which is what a client's bytes may wait.
constexpr microseconds TRANSFER{250};
constexpr microseconds FULL_WAIT{1000}; // until a client that does not read is looked at again
constexpr microseconds LONGEST_RUN{1'000'000};

volatile std::sig_atomic_t is_interrupted = 0;

[[noreturn]] void fail(const char *what) {
  std::fprintf(stderr, "emulated_fingertip: %s (%s)\n", what, std::strerror(errno));
  std::exit(1);
}

using Bytes = std::vector<std::uint8_t>;

struct Sent {
  microseconds at; // since power-on
  Bytes bytes;
};

// The emulator as a process; its frames: host_tools/simulation/emulator/port/stepped_port.mjs.
class Emulator {
public:
  explicit Emulator(std::vector<char *> arguments) {
    int to[2], from[2];
    if (pipe2(to, O_CLOEXEC) != 0 || pipe2(from, O_CLOEXEC) != 0) {
      fail("pipe");
    }
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, to[0], 0);
    posix_spawn_file_actions_adddup2(&actions, from[1], 1);
    arguments.push_back(nullptr);
    errno = posix_spawnp(&pid_, arguments[0], &actions, nullptr, arguments.data(), environ);
    if (errno != 0) {
      fail(arguments[0]);
    }
    posix_spawn_file_actions_destroy(&actions);
    close(to[0]);
    close(from[1]);
    to_ = to[1];
    from_ = from[0];
  }

  // At a time since power-on that has not come.
  void say(char kind, microseconds at, const Bytes &bytes = {}) {
    Bytes payload = words({at});
    payload.insert(payload.end(), bytes.begin(), bytes.end());
    frame(kind, payload);
  }

  // Runs until then, or until TRANSFER beyond the first bytes out; those that came are added.
  void run(microseconds until, std::deque<Sent> *out) {
    frame('R', words({until, TRANSFER}));
    for (;;) {
      const Bytes head = take(5);
      std::uint32_t length = 0;
      for (int i = 0; i < 4; i++) {
        length |= static_cast<std::uint32_t>(head[1 + i]) << 8 * i;
      }
      const Bytes payload = take(length);
      std::int64_t at_ns = 0;
      for (int i = 0; i < 8; i++) {
        at_ns |= static_cast<std::int64_t>(payload[i]) << 8 * i;
      }
      const microseconds at = std::chrono::ceil<microseconds>(std::chrono::nanoseconds(at_ns));
      if (head[0] == 'T') {
        now_ = at;
        has_ended_ = payload[8] != 0;
        return;
      }
      out->push_back({at, Bytes(payload.begin() + 8, payload.end())});
    }
  }

  microseconds now() const { return now_; }
  bool has_ended() const { return has_ended_; }

  // Its status, once it has written what it writes; its power is cut if it still ran.
  int end() {
    if (!has_ended_) {
      frame('E', {});
    }
    return status();
  }

private:
  static Bytes words(std::initializer_list<std::chrono::nanoseconds> times) {
    Bytes bytes;
    for (const std::chrono::nanoseconds time : times) {
      for (int i = 0; i < 8; i++) {
        bytes.push_back(static_cast<std::uint8_t>(time.count() >> 8 * i));
      }
    }
    return bytes;
  }

  void frame(char kind, const Bytes &payload) {
    Bytes bytes = {static_cast<std::uint8_t>(kind)};
    for (int i = 0; i < 4; i++) {
      bytes.push_back(static_cast<std::uint8_t>(payload.size() >> 8 * i));
    }
    bytes.insert(bytes.end(), payload.begin(), payload.end());
    for (std::size_t at = 0; at < bytes.size();) {
      const ssize_t count = write(to_, bytes.data() + at, bytes.size() - at);
      if (count < 0 && errno != EINTR) {
        std::exit(status()); // it has ended, and said why
      }
      at += static_cast<std::size_t>(std::max<ssize_t>(count, 0));
    }
  }

  Bytes take(std::size_t length) {
    while (received_.size() < length) {
      std::uint8_t chunk[65536];
      const ssize_t count = read(from_, chunk, sizeof chunk);
      if (count == 0) {
        std::exit(status());
      }
      if (count < 0 && errno != EINTR) {
        fail("read");
      }
      received_.insert(received_.end(), chunk, chunk + std::max<ssize_t>(count, 0));
    }
    const auto end = received_.begin() + static_cast<std::ptrdiff_t>(length);
    Bytes taken(received_.begin(), end);
    received_.erase(received_.begin(), end);
    return taken;
  }

  int status() {
    int status = 0;
    while (waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
    }
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  }

  pid_t pid_ = 0;
  int to_ = -1, from_ = -1;
  Bytes received_;
  microseconds now_{0};
  bool has_ended_ = false;
};

class Fingertip {
public:
  Fingertip(const std::string &port, bool waits_open, std::vector<char *> emulator)
      : port_(port), emulator_(std::move(emulator)) {
    emulator_.run(microseconds(0), &sent_); // is there, or has ended with a word why
    while (waits_open && !port_.is_open() && !is_interrupted) {
      port_.wait(HostTime::max());
    }
    zero_ = host_now();
    emulator_.say('Z', std::chrono::duration_cast<microseconds>(zero_.time_since_epoch()));
    std::printf("%lld\n", static_cast<long long>(zero_.time_since_epoch() / microseconds(1)));
    std::fflush(stdout);
  }

  int run() {
    while (!is_interrupted && !is_over()) {
      hear();
      put();
      if (!emulator_.has_ended()) {
        advance();
      }
      HostTime until = zero_ + (sent_.empty() ? emulator_.now() : sent_.front().at);
      if (!unread_.empty()) {
        until = std::min(std::max(until, host_now() + microseconds(1)), host_now() + FULL_WAIT);
      }
      port_.wait(until);
    }
    return emulator_.end();
  }

private:
  bool is_over() const { return emulator_.has_ended() && sent_.empty() && now() >= emulator_.now(); }

  microseconds now() const { return std::chrono::duration_cast<microseconds>(host_now() - zero_); }

  // What the client does.
  void hear() {
    const microseconds at = now() + TRANSFER;
    if (emulator_.has_ended()) {
      return;
    }
    if (port_.is_open() != is_open_) {
      is_open_ = !is_open_;
      unread_.clear();
      is_full_ = false;
      emulator_.say(is_open_ ? 'O' : 'C', at);
    }
    std::uint8_t chunk[4096];
    while (const std::size_t count = port_.read(chunk, sizeof chunk)) {
      emulator_.say('D', at, Bytes(chunk, chunk + count));
    }
  }

  // What is due for it.
  void put() {
    for (; !sent_.empty() && sent_.front().at <= now(); sent_.pop_front()) {
      unread_.insert(unread_.end(), sent_.front().bytes.begin(), sent_.front().bytes.end());
    }
    const std::size_t count = unread_.empty() ? 0 : port_.write(unread_.data(), unread_.size());
    unread_.erase(unread_.begin(), unread_.begin() + static_cast<std::ptrdiff_t>(count));
    if (is_full_ != !unread_.empty() && !emulator_.has_ended()) {
      is_full_ = !is_full_;
      emulator_.say('W', now() + TRANSFER, {is_full_});
    }
  }

  // As far as no other can interfere.
  void advance() {
    const HostTime others = fingertip::test::others_wait_until();
    microseconds until = now() + LONGEST_RUN;
    if (others != HostTime::max()) {
      until = std::min(until, std::chrono::duration_cast<microseconds>(others - zero_) + TRANSFER);
    }
    if (!sent_.empty()) {
      until = std::min(until, sent_.front().at + TRANSFER);
    }
    if (until > emulator_.now()) {
      emulator_.run(until, &sent_);
    }
  }

  fingertip::ServedPort port_;
  Emulator emulator_;
  HostTime zero_;
  bool is_open_ = false, is_full_ = false;
  std::deque<Sent> sent_; // not due yet
  Bytes unread_;          // due, and not taken by the client's end yet
};

} // namespace

int main(int argc, char **argv) {
  const bool waits_open = argc > 2 && std::strcmp(argv[2], "--wait-open") == 0;
  std::vector<char *> emulator(argv + std::min(argc, waits_open ? 3 : 2), argv + argc);
  if (emulator.size() < 2) {
    std::fprintf(stderr, "usage: emulated_fingertip PORT [--wait-open] NODE MAIN.MJS [option...]\n");
    return 2;
  }
  static char stepped[] = "--stepped";
  emulator.push_back(stepped);
  struct sigaction action = {}; // without SA_RESTART: it ends a wait
  action.sa_handler = [](int) { is_interrupted = 1; };
  sigaction(SIGTERM, &action, nullptr);
  sigaction(SIGINT, &action, nullptr);
  action.sa_handler = SIG_IGN;
  sigaction(SIGPIPE, &action, nullptr);
  try {
    return Fingertip(argv[1], waits_open, std::move(emulator)).run();
  } catch (const fingertip::Error &error) {
    std::fprintf(stderr, "emulated_fingertip: %s\n", error.what());
    return 1;
  }
}
