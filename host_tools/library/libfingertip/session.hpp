/* A conversation with one fingertip: commands and their acknowledgements, while packets stream.
 *
 * A command is repeated if no acknowledgement comes in time. Each may arrive twice without harm. No
 * packet is lost while a command waits: the handler gets every one, in order. */
#pragma once

#include "libfingertip/clock.hpp"
#include "libfingertip/clock_fit.hpp"
#include "libfingertip/decoder.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/transport.hpp"

#include <chrono>
#include <functional>
#include <optional>

#pragma GCC visibility push(default)
namespace fingertip {

/* The port vanished in the middle of a command. */
class Gone : public Error {
public:
  explicit Gone(const std::string &facts) : Error(ErrorCode::gone, facts) {}
};

/* The stop function of the session returned true in the middle of a command. */
class Interrupted : public std::exception {};

/* device time = host time + offset, good to the uncertainty (half the best round trip). Host time is std::chrono::steady_clock in us. */
struct ClockRelation {
  std::int64_t device_minus_host_us;
  std::int64_t uncertainty_us;
};

class Session {
public:
  using Handler = std::function<void(const wire_packet &)>;
  using ExchangeHandler = std::function<void(const ClockExchange &)>;
  using Tap = std::function<void(const std::uint8_t *bytes, std::size_t length)>;

  struct Policy {
    std::chrono::milliseconds answer_timeout{1000};
    int attempts = 10;
  };

  /* The transport must outlive the session. stop: asked while waiting; true throws Interrupted. */
  explicit Session(
      Transport &transport, std::function<bool()> stop = [] { return false; });

  void on_packet(Handler handler) { handler_ = std::move(handler); }
  void on_bytes(Tap tap) { tap_ = std::move(tap); }
  /* Each acknowledgement as a relation of the two clocks. */
  void on_exchange(ExchangeHandler handler) { exchange_handler_ = std::move(handler); }

  /* Takes packets, and waits at most this long for the first. */
  Transport::Result poll(std::chrono::milliseconds timeout);

  /* Returns once the fingertip has done it. Throws Error if it refuses or does not answer, Gone, Interrupted. */
  void command(const wire_packet &command, Policy policy);
  void command(const wire_packet &command) { this->command(command, Policy()); }

  /* Sends without waiting for the answer. False: the port is gone or takes nothing. */
  bool send(wire_packet command);

  /* The whole packets, since recordings keep their header. */
  wire_packet info(Policy policy);
  wire_packet info() { return info(Policy()); }
  wire_packet health();
  wire_packet crash();

  /* After gone; the line begins again. */
  bool reopen();

  const LineStatistics &statistics() const { return decoder_.statistics(); }
  /* The clocks' relation by the acknowledgements since the port was opened. */
  std::optional<ClockRelation> clock() const { return clock_; }

private:
  void take(const wire_packet &packet);
  void look_for_other_versions();
  /* Sends until the acknowledgement and, unless 0, a packet of the answer's type came. */
  wire_packet exchange(const wire_packet &command, std::uint8_t answer_type, Policy policy);

  Transport &transport_;
  std::function<bool()> stop_;
  Decoder decoder_;
  Handler handler_;
  Tap tap_;
  ExchangeHandler exchange_handler_;
  std::uint16_t sequence_ = 0;
  std::optional<ClockRelation> clock_;

  /* The exchange under way. */
  std::uint8_t awaited_command_ = 0;
  std::uint8_t awaited_answer_ = 0;
  std::uint16_t awaited_first_sequence_ = 0;
  std::optional<wire_ack> ack_;
  bool repeat_refused_ = false; // not possible now: the attempt before may be under way
  std::optional<wire_packet> answer_;
};

} // namespace fingertip
#pragma GCC visibility pop
