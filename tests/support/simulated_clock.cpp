// libfingertip's clock, simulated: programs that are linked with this one instead live on the time of a time keeper (time_keeper.cpp),
// whose socket the environment names. One thread of all those programs runs at a time; time passes only while all of them wait.
#include "libfingertip/clock.hpp"
#include "libfingertip/descriptor_transport.hpp"
#include "support/time_keeper.hpp"

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <sys/socket.h>
#include <sys/un.h>
#include <thread>
#include <unistd.h>

namespace fingertip {

namespace {

using std::chrono::microseconds;
using test::Order;

// The wall clock of a simulated world begins on 1 January 2026.
constexpr std::int64_t WALL_ZERO_s = 1767225600;
// So often without a wait means that somebody counts on time to pass by itself.
constexpr int MOST_LOOKS = 1'000'000;

std::atomic<std::int64_t> now_us{0};
std::atomic<int> looks{0};

[[noreturn]] void fail(const char *what) {
  std::fprintf(stderr, "simulated clock: %s (%s)\n", what, std::strerror(errno));
  std::_Exit(125);
}

int connected() {
  const char *path = std::getenv(test::KEEPER_VARIABLE);
  sockaddr_un address;
  if (path == nullptr || !unix_address(path, &address)) {
    fail(test::KEEPER_VARIABLE);
  }
  const int fd = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
  if (fd < 0 || connect(fd, reinterpret_cast<const sockaddr *>(&address), sizeof address) != 0) {
    fail(path);
  }
  return fd;
}

// A thread's connection.
class Line {
public:
  Line() = default;
  // Without a goodbye its process ends, which a main thread's end means.
  ~Line() {
    if (fd_ >= 0 && pid_ == getpid()) {
      if (gettid() != pid_) {
        say({Order::BYE, 0, 0, 0, {}});
      }
      close(fd_);
    }
  }

  void adopt(int fd) {
    fd_ = fd;
    pid_ = getpid();
  }
  void say(const Order &order, const pollfd *descriptors = nullptr) {
    alignas(cmsghdr) char control[CMSG_SPACE(sizeof(int) * test::MOST_DESCRIPTORS)] = {};
    iovec part = {const_cast<Order *>(&order), sizeof order};
    msghdr message = {};
    message.msg_iov = &part;
    message.msg_iovlen = 1;
    if (order.count > 0) {
      message.msg_control = control;
      message.msg_controllen = CMSG_SPACE(sizeof(int) * order.count);
      cmsghdr *rights = CMSG_FIRSTHDR(&message);
      rights->cmsg_level = SOL_SOCKET;
      rights->cmsg_type = SCM_RIGHTS;
      rights->cmsg_len = CMSG_LEN(sizeof(int) * order.count);
      int *to = reinterpret_cast<int *>(CMSG_DATA(rights));
      for (std::uint32_t i = 0; i < order.count; i++) {
        to[i] = descriptors[i].fd;
      }
    }
    while (sendmsg(fd_, &message, MSG_NOSIGNAL) < 0) {
      if (errno == EPIPE || errno == ECONNRESET) {
        std::_Exit(125); // the test is over
      }
      if (errno != EINTR) {
        fail("the keeper");
      }
    }
  }
  // Says so and waits until it is this thread's turn; false: after a signal. Signals come in the
  // wait alone, so that none falls between the two.
  bool wait(const Order &order, const pollfd *descriptors = nullptr) {
    sigset_t all, before;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    say(order, descriptors);
    const bool is_whole = take_turn(before);
    pthread_sigmask(SIG_SETMASK, &before, nullptr);
    return is_whole;
  }
  bool take_turn(const sigset_t &signals) {
    bool is_whole = true;
    pollfd turn = {fd_, POLLIN, 0};
    while (ppoll(&turn, 1, nullptr, &signals) < 0) {
      if (errno != EINTR) {
        std::_Exit(125);
      }
      is_whole = false;
      say({Order::INTERRUPTED, 0, 0, 0, {}});
    }
    test::Turn told = {};
    if (recv(fd_, &told, sizeof told, 0) != sizeof told) {
      std::_Exit(125); // the test is over
    }
    now_us = told.now_us;
    looks = 0;
    return is_whole;
  }
  // Of a thread that has been announced.
  void take_first_turn() {
    sigset_t signals;
    pthread_sigmask(SIG_SETMASK, nullptr, &signals);
    take_turn(signals);
  }
  void be_there() {
    if (fd_ < 0 || pid_ != getpid()) { // the first time, or after a fork
      if (fd_ >= 0) {
        close(fd_); // the parent's
      }
      adopt(connected());
      wait({Order::HELLO, 0, 0, 0, {}});
    }
  }

private:
  int fd_ = -1;
  pid_t pid_ = 0;
};

thread_local Line line;

} // namespace

HostTime host_now() {
  line.be_there();
  return HostTime(microseconds(now_us));
}

std::chrono::system_clock::time_point wall_now() {
  return std::chrono::system_clock::time_point(std::chrono::seconds(WALL_ZERO_s)) +
         std::chrono::duration_cast<std::chrono::system_clock::duration>(host_now().time_since_epoch());
}

int wait_for(pollfd *descriptors, std::size_t count, HostTime until) {
  const HostTime now = host_now();
  if (until <= now) {
    if (++looks > MOST_LOOKS) {
      errno = 0;
      fail("somebody looks for ever without waiting");
    }
    return std::max(0, ::poll(descriptors, count, 0));
  }
  Order order = {Order::WAIT, 0, INT64_MAX, 0, {}};
  if (until != HostTime::max()) {
    order.until_us = std::chrono::ceil<microseconds>(until.time_since_epoch()).count();
  }
  pollfd asked[test::MOST_DESCRIPTORS];
  for (std::size_t i = 0; i < count; i++) {
    if (descriptors[i].fd >= 0) {
      if (order.count == test::MOST_DESCRIPTORS) {
        fail("too many descriptors");
      }
      asked[order.count] = descriptors[i];
      order.events[order.count++] = descriptors[i].events;
    }
  }
  if (!line.wait(order, asked)) {
    return 0;
  }
  return std::max(0, ::poll(descriptors, count, 0));
}

struct Thread::State {
  std::thread thread;
  Wake ended;
};

Thread::Thread(std::function<void()> run) : state_(std::make_shared<State>()) {
  line.be_there();
  const int fd = connected();
  Line early; // says hello in its name: it is there from now on
  early.adopt(fd);
  early.say({Order::HELLO, 0, 0, 0, {}});
  early.adopt(-1);
  Wake &ended = state_->ended;
  state_->thread = std::thread([fd, run = std::move(run), &ended] {
    sigset_t all; // signals are the main thread's, which waits for them in the keeper's sight
    sigfillset(&all);
    pthread_sigmask(SIG_BLOCK, &all, nullptr);
    line.adopt(fd);
    line.take_first_turn();
    run();
    ended.set();
  });
}

void Thread::join() {
  while (!state_->ended.wait(HostTime::max())) {
  }
  state_->thread.join();
  state_.reset();
}

void clock_expects(pid_t child) {
  line.be_there();
  line.say({Order::SPAWNED, child, 0, 0, {}});
}

} // namespace fingertip
