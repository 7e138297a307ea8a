/* A fingertip from its first answer to the end of its streams. The loop greets it, streams, waits for it when its port
 * vanishes, and greets it again. Each has a thread of its own, so that none waits for another and arrivals are timed as
 * they happen. The updates of all of them come out of one feed. One fingertip and many work alike.
 *
 *   DeviceFeed feed;
 *   DeviceLoop loop(0, endpoint, options, feed);
 *   for (bool over = false; !over;) {
 *     for (const DeviceUpdate &update : feed.take(20ms)) {
 *       if (update.kind == DeviceUpdate::Kind::ready) loop.start();
 *       ...
 *       over = over || update.kind == DeviceUpdate::Kind::ended;
 *     }
 *     if (enough) loop.stop();
 *   }
 *   loop.rethrow(); */
#pragma once

#include "libfingertip/clock.hpp"
#include "libfingertip/clock_fit.hpp"
#include "libfingertip/connection.hpp"
#include "libfingertip/session.hpp"

#include <atomic>
#include <chrono>
#include <cstdint>
#include <deque>
#include <exception>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#pragma GCC visibility push(default)
namespace fingertip {

struct DeviceUpdate {
  enum class Kind {
    packet, /* every one that came, in order */
    ready,  /* it answered for the first time: packet is the last info packet; it waits for start */
    gone,   /* its port vanished */
    back,   /* it answered again: as ready, but its streams follow */
    mute,   /* it did not answer to the end of its streams */
    bytes,  /* of the line, before the packets in them; only if they are wanted */
    clock,  /* another estimate; only if clocks are followed */
    ended,  /* the last one */
  };

  DeviceUpdate(Kind what, std::size_t number) : kind(what), device(number) {}

  Kind kind;
  std::size_t device;
  wire_packet packet{};
  double host_us = 0;                    /* of the packet's t_us on the host's steady clock; of its
                                            arrival where the clock is not known or followed */
  wire_health health{};                  /* ready, back */
  std::optional<ClockRelation> relation; /* ready */
  std::vector<std::uint8_t> bytes;
  ClockEstimate estimate{}; /* clock */
  unsigned jumps = 0;       /* clock */
};

/* A queue from the loops' threads to the one that takes. It holds three seconds of each fingertip's updates at 1308 frames/s.
 * A loop whose share is full stops reading, and its fingertip drops and counts what it cannot send. */
class DeviceFeed {
public:
  /* All there is, waiting at most this long for the first. */
  std::vector<DeviceUpdate> take(std::chrono::milliseconds timeout);

private:
  friend class DeviceLoop;

  void put(DeviceUpdate update, const std::atomic<bool> &abandoned);
  void wake();

  std::mutex mutex_;
  Wake filled_, drained_;
  std::deque<DeviceUpdate> updates_;
  std::map<std::size_t, std::size_t> waiting_; /* of them, by fingertip */
};

class DeviceLoop {
public:
  struct Options {
    std::uint8_t streams = 0;  /* those wanted: of them come those that its firmware has */
    bool follow_clock = false; /* exchanges ten times a second, updates of kind clock */
    bool bytes = false;        /* updates of kind bytes */
    bool wait_for_back = true; /* else it ends where the port vanishes */
  };

  /* number: of its updates. Throws Error if the port cannot be opened. The feed must outlive it. */
  DeviceLoop(std::size_t number, const Endpoint &endpoint, const Options &options, DeviceFeed &feed);
  /* Ends the streams first; what is in the feed stays there. */
  ~DeviceLoop();
  DeviceLoop(const DeviceLoop &) = delete;
  DeviceLoop &operator=(const DeviceLoop &) = delete;

  /* Once ready: stream. */
  void start() { started_ = true; }
  /* End the streams, and then itself; packets come until it has ended. */
  void stop() { stop_ = true; }
  /* A command without a wait; its acknowledgement is among the packets. */
  void send(const wire_packet &command);

  std::string name() const;
  LineStatistics statistics() const;
  /* The time until which everything was read, on the host's steady clock; endless while nothing is
   * expected: gone, or ended. */
  double read_until_us() const;
  /* After updates of kind ended: throws what ended it, if it was an error. */
  void rethrow() const;

private:
  void run();
  void stream();
  void greet(bool again);
  void follow();
  void wait_for_port();
  void end_streams();
  void take(const wire_packet &packet);
  void send_wanted();
  void put(DeviceUpdate update);
  void put(DeviceUpdate::Kind kind);
  void publish();

  std::size_t number_;
  Options options_;
  DeviceFeed &feed_;
  std::unique_ptr<Transport> transport_;
  Session session_;
  ClockFit fit_;
  std::uint8_t streams_ = 0; /* those wanted that its firmware has */
  std::optional<wire_info> info_;
  HostTime asked_{}, last_frame_{};
  bool gone_ = false;              /* and not back yet */
  std::vector<DeviceUpdate> held_; /* until it is back */
  bool ending_ = false;            /* its last command is not interrupted */

  std::atomic<bool> started_{false}, stop_{false}, abandoned_{false};
  std::atomic<bool> nothing_expected_{false};
  std::atomic<std::int64_t> read_until_us_{0};
  mutable std::mutex mutex_; /* of what follows */
  LineStatistics statistics_;
  std::string name_;
  std::deque<wire_packet> wanted_; /* commands */

  std::exception_ptr failure_;
  Thread thread_;
};

} // namespace fingertip
#pragma GCC visibility pop
