// What a thread on simulated time and the keeper of that time tell one another: one of these a message, over a
// connection of its own to the keeper's socket (AF_UNIX, SOCK_SEQPACKET). With a wait come the descriptors that may end
// it, as SCM_RIGHTS. Each wait and each hello is answered, once this thread is to go on, by a Turn.
#pragma once

#include <cstdint>

namespace fingertip::test {

constexpr char KEEPER_VARIABLE[] = "FINGERTIP_TIME_KEEPER"; // holds the socket's path
constexpr unsigned MOST_DESCRIPTORS = 128;

struct Order {
  enum Kind : std::uint32_t {
    HELLO,       // a thread is there, and waits for its turn
    WAIT,        // until until_us, or until a descriptor has one of its events
    INTERRUPTED, // by a signal, while it waits
    BYE,         // a thread has ended, its process goes on
    SPAWNED,     // a process, pid, which will say hello or end
    HELD,        // a process, pid, which gets no turn before until_us: a machine that is busy
    TURNS,       // how many turns had a process, pid? Answered at once
    SIGNALLED,   // a process, pid, which will be interrupted or end: said before the signal is sent
  };
  std::uint32_t kind;
  std::int32_t pid;
  std::int64_t until_us;
  std::uint32_t count; // of descriptors
  std::int16_t events[MOST_DESCRIPTORS];
};

struct Turn {
  std::int64_t now_us;
  std::int64_t others_us; // the first moment that another thread goes on by itself, INT64_MAX: none
};

} // namespace fingertip::test
