// Keeps the time of a simulated world of several processes:
//
//   time_keeper SOCKET              prints "ready" once it listens there
//   time_keeper --run TEST [...]    starts a test that is such a process, ends with its status
//
// and ends with its first connection, the test's. Of all the threads that are connected (simulated_clock.cpp, simulated_time.py) one runs
// at a time. When it waits, the next is one that has something to go on with, longest not run first; where none has, time jumps to the
// first moment that somebody waits for. So what happens, and when, is the same however fast the machine is, and silence takes no time.
//
// A thread that runs for two minutes of real time, and a world in which everybody waits for ever, end it with a word on standard error.
#include "support/time_keeper.hpp"

#include "libfingertip/descriptor_transport.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <list>
#include <poll.h>
#include <string>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <vector>

using fingertip::Descriptor;
using fingertip::test::MOST_DESCRIPTORS;
using fingertip::test::Order;
using fingertip::test::Turn;

constexpr std::int64_t BEGIN_us = 1'000'000'000;
constexpr int PATIENCE_ms = 120'000;   // of real time, with a thread that runs
constexpr int SIGNAL_ms = 5'000;       // of real time, until a signal has arrived
constexpr long MOST_TURNS = 5'000'000; // without time passing

[[noreturn]] void fail(const char *what) {
  std::fprintf(stderr, "time_keeper: %s\n", what);
  std::exit(1);
}

// A process; of those that go on without a word nothing is known but that they have not ended.
struct Process {
  pid_t pid;
  Descriptor handle; // pidfd
  long born;         // which of all that began
  bool is_awaited;   // its hello, or its end
  bool is_dying = false;
  bool expects_signal = false;
  std::int64_t held_us = 0; // no turn before
  std::int64_t turns = 0;
};

struct Awaited {
  Descriptor fd;
  short events;
};

struct Client {
  Descriptor line;
  pid_t pid;
  long born; // its process; several that begin at once say hello in any order
  bool runs = true;
  bool is_interrupted = false;
  std::int64_t until_us = 0;
  std::vector<Awaited> awaited = {};
  long ran = 0; // turn
};

class Keeper {
public:
  explicit Keeper(const char *path) {
    sockaddr_un address = {};
    address.sun_family = AF_UNIX;
    if (std::strlen(path) >= sizeof address.sun_path) {
      fail("the socket's path is too long");
    }
    std::strcpy(address.sun_path, path);
    listener_ = Descriptor(socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    if (bind(listener_.get(), reinterpret_cast<const sockaddr *>(&address), sizeof address) != 0 || listen(listener_.get(), 64) != 0) {
      fail(std::strerror(errno));
    }
  }

  // end: once its first connection is gone; does not come back.
  void on_end(std::function<void()> end) { end_ = std::move(end); }

  [[noreturn]] void run() {
    do {
      hear(-1);
    } while (clients_.empty());
    for (;;) {
      while (is_somebody_running()) {
        hear(PATIENCE_ms);
      }
      hear(0); // who ended unasked
      if (!is_somebody_running()) {
        next();
      }
    }
  }

private:
  bool is_somebody_running() const {
    return std::any_of(clients_.begin(), clients_.end(), [](const Client &each) { return each.runs; }) ||
           std::any_of(processes_.begin(), processes_.end(),
                       [](const Process &each) { return each.is_awaited || each.is_dying || each.expects_signal; });
  }

  Process *process(pid_t pid) {
    for (Process &each : processes_) {
      if (each.pid == pid) {
        return &each;
      }
    }
    return nullptr;
  }

  void expect(pid_t pid) {
    if (process(pid) == nullptr) {
      Descriptor handle(static_cast<int>(syscall(SYS_pidfd_open, pid, 0)));
      if (handle.get() >= 0) { // else it has ended already
        processes_.push_back({pid, std::move(handle), ++born_, true});
      }
    }
  }

  void forget(pid_t pid) {
    if (!clients_.empty() && clients_.front().pid == pid) {
      end_(); // with the test
    }
    clients_.remove_if([pid](const Client &each) { return each.pid == pid; });
    processes_.remove_if([pid](const Process &each) { return each.pid == pid; });
  }

  // What they say, waiting for it so long.
  void hear(int timeout_ms) {
    std::vector<pollfd> ears = {{listener_.get(), POLLIN, 0}};
    std::vector<Client *> clients;
    for (Client &each : clients_) {
      ears.push_back({each.line.get(), POLLIN, 0});
      clients.push_back(&each);
    }
    std::vector<pid_t> pids;
    for (const Process &each : processes_) {
      ears.push_back({each.handle.get(), POLLIN, 0});
      pids.push_back(each.pid);
    }
    const bool is_signal_expected =
        std::any_of(processes_.begin(), processes_.end(), [](const Process &each) { return each.expects_signal; });
    const int patience_ms = is_signal_expected ? std::min(timeout_ms, SIGNAL_ms) : timeout_ms;
    if (poll(ears.data(), ears.size(), patience_ms) == 0 && timeout_ms != 0) {
      if (is_signal_expected) { // it was ignored
        for (Process &each : processes_) {
          each.expects_signal = false;
        }
        return;
      }
      name_who_runs();
      fail("somebody runs for ever");
    }
    std::size_t at = 1;
    for (Client *each : clients) {
      if (ears[at++].revents != 0) {
        take(*each);
      }
    }
    for (const pid_t pid : pids) {
      if (ears[at++].revents != 0) {
        forget(pid);
      }
    }
    clients_.remove_if([](const Client &each) { return each.line.get() < 0; });
    if (ears[0].revents != 0) {
      accept_one();
    }
  }

  void name_who_runs() const {
    for (const Client &each : clients_) {
      if (each.runs) {
        std::fprintf(stderr, "time_keeper: process %d runs\n", each.pid);
      }
    }
    for (const Process &each : processes_) {
      if (each.is_awaited || each.is_dying) {
        std::fprintf(stderr, "time_keeper: process %d %s\n", each.pid, each.is_dying ? "ends" : "begins");
      }
    }
  }

  void accept_one() {
    Descriptor line(accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC));
    ucred peer = {};
    socklen_t size = sizeof peer;
    if (line.get() < 0 || getsockopt(line.get(), SOL_SOCKET, SO_PEERCRED, &peer, &size) != 0) {
      return;
    }
    expect(peer.pid);
    Process *its = process(peer.pid);
    clients_.push_back({std::move(line), peer.pid, its == nullptr ? 0 : its->born});
    // Until it has said hello it runs; its process need not be waited for any more.
    if (its != nullptr) {
      its->is_awaited = false;
    }
  }

  void take(Client &client) {
    Order order;
    alignas(cmsghdr) char control[CMSG_SPACE(sizeof(int) * MOST_DESCRIPTORS)];
    iovec part = {&order, sizeof order};
    msghdr message = {};
    message.msg_iov = &part;
    message.msg_iovlen = 1;
    message.msg_control = control;
    message.msg_controllen = sizeof control;
    const ssize_t size = recvmsg(client.line.get(), &message, MSG_CMSG_CLOEXEC);
    if (size != sizeof order) { // the process ends
      client.awaited.clear();
      client.runs = false;
      client.line = Descriptor();
      Process *its = process(client.pid);
      if (&client == &clients_.front()) {
        end_();
      }
      if (its != nullptr) {
        its->is_dying = true;
      }
      return;
    }
    switch (order.kind) {
    case Order::HELLO:
      client.runs = false;
      client.until_us = now_us_;
      break;
    case Order::WAIT: {
      client.runs = false;
      client.until_us = order.until_us;
      const cmsghdr *rights = CMSG_FIRSTHDR(&message);
      for (std::uint32_t i = 0; rights != nullptr && i < order.count; i++) {
        int fd;
        std::memcpy(&fd, CMSG_DATA(rights) + i * sizeof fd, sizeof fd);
        client.awaited.push_back({Descriptor(fd), order.events[i]});
      }
      break;
    }
    case Order::INTERRUPTED:
      client.is_interrupted = true;
      if (Process *its = process(client.pid)) {
        its->expects_signal = false;
      }
      break;
    case Order::BYE:
      client.runs = false;
      client.line = Descriptor();
      break;
    case Order::SPAWNED: expect(order.pid); break;
    case Order::HELD:
      for (Process &each : processes_) {
        each.held_us = each.pid == order.pid ? order.until_us : each.held_us;
      }
      break;
    case Order::TURNS: {
      const Process *its = process(order.pid);
      const std::int64_t turns = its != nullptr ? its->turns : 0;
      (void)send(client.line.get(), &turns, sizeof turns, MSG_NOSIGNAL);
      break;
    }
    case Order::SIGNALLED:
      if (Process *its = process(order.pid)) {
        its->expects_signal = true;
      }
      break;
    default: fail("an order that is none");
    }
  }

  // One of those who wait goes on.
  void next() {
    std::vector<pollfd> asked;
    for (const Client &each : clients_) {
      for (const Awaited &what : each.awaited) {
        asked.push_back({what.fd.get(), what.events, 0});
      }
    }
    poll(asked.data(), asked.size(), 0);
    Client *best = nullptr;
    std::int64_t first_us = INT64_MAX, others_us = INT64_MAX; // others: all but the best
    std::size_t at = 0;
    for (Client &each : clients_) {
      const Process *its = process(each.pid);
      const std::int64_t held_us = its != nullptr ? its->held_us : 0;
      bool may = each.is_interrupted || each.until_us <= now_us_;
      for (std::size_t i = 0; i < each.awaited.size(); i++) {
        may = asked[at++].revents != 0 || may;
      }
      if (held_us > now_us_) {
        first_us = std::min(first_us, held_us);
        others_us = std::min(others_us, held_us);
        continue;
      }
      const std::int64_t each_us = may ? now_us_ : each.until_us;
      if (may && (best == nullptr || std::pair(each.ran, each.born) < std::pair(best->ran, best->born))) {
        others_us = first_us; // of those before; those behind follow
        best = &each;
      } else {
        others_us = std::min(others_us, each_us);
      }
      first_us = std::min(first_us, each_us);
    }
    if (best == nullptr) {
      if (first_us == INT64_MAX) {
        fail("everybody waits for ever");
      }
      now_us_ = first_us;
      turns_ = 0;
      return;
    }
    if (++turns_ > MOST_TURNS) {
      std::fprintf(stderr, "time_keeper: process %d\n", best->pid);
      fail("time stands still");
    }
    if (Process *its = process(best->pid)) {
      its->turns++;
    }
    best->runs = true;
    best->is_interrupted = false;
    best->awaited.clear();
    best->ran = ++turn_;
    const Turn turn = {now_us_, others_us};
    if (send(best->line.get(), &turn, sizeof turn, MSG_NOSIGNAL) < 0) {
      // It has ended, which its line will tell.
    }
  }

  std::function<void()> end_ = [] { std::exit(0); };
  Descriptor listener_;
  std::list<Client> clients_; // the first is the test's
  std::list<Process> processes_;
  std::int64_t now_us_ = BEGIN_us;
  long turn_ = 0, turns_ = 0, born_ = 0;
};

[[noreturn]] int run_test(char **arguments) {
  char folder[] = "/tmp/fingertip-time-XXXXXX";
  if (mkdtemp(folder) == nullptr) {
    fail(std::strerror(errno));
  }
  const std::string path = std::string(folder) + "/socket";
  Keeper keeper(path.c_str());
  const pid_t test = fork();
  if (test == 0) {
    setenv(fingertip::test::KEEPER_VARIABLE, path.c_str(), 1);
    execv(arguments[0], arguments);
    std::perror(arguments[0]);
    std::_Exit(127);
  }
  keeper.on_end([folder = std::string(folder), path, test] {
    int status = 0;
    waitpid(test, &status, 0);
    unlink(path.c_str());
    rmdir(folder.c_str());
    if (WIFSIGNALED(status)) {
      std::fprintf(stderr, "time_keeper: the test was ended by signal %d (%s)\n", WTERMSIG(status), strsignal(WTERMSIG(status)));
    }
    std::exit(WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status));
  });
  keeper.run();
}

int main(int argc, char **argv) {
  if (argc >= 3 && std::strcmp(argv[1], "--run") == 0) {
    return run_test(argv + 2);
  }
  if (argc != 2) {
    std::fprintf(stderr, "usage: time_keeper SOCKET\n       time_keeper --run TEST [...]\n");
    return 2;
  }
  Keeper keeper(argv[1]);
  std::puts("ready");
  std::fflush(stdout);
  keeper.run();
}
