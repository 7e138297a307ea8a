#include "libfingertip/session.hpp"

#include "libfingertip/command.hpp"
#include "libfingertip/names.hpp"

#include <algorithm>

namespace fingertip {

constexpr std::chrono::milliseconds POLL_INTERVAL{50};
/* A fingertip does not answer a version that it does not speak: it is asked in these too. */
constexpr int NEWER_VERSIONS = 2;

static ErrorCode refusal_code(std::uint8_t result) {
  switch (result) {
  case WIRE_RESULT_UNKNOWN_COMMAND: return ErrorCode::unknown_command;
  case WIRE_RESULT_OUT_OF_RANGE: return ErrorCode::refused_value;
  case WIRE_RESULT_NOT_NOW: return ErrorCode::not_now;
  default: return ErrorCode::refused;
  }
}

Session::Session(Transport &transport, std::function<bool()> stop) : transport_(transport), stop_(std::move(stop)) {}

Transport::Result Session::poll(std::chrono::milliseconds timeout) {
  std::uint8_t bytes[4096];
  std::size_t length = 0;
  Transport::Result result = transport_.read(bytes, sizeof bytes, &length, timeout);
  if (result == Transport::Result::data) {
    if (tap_) {
      tap_(bytes, length);
    }
    decoder_.feed(bytes, length, [this](const wire_packet &packet) { take(packet); });
  }
  return result;
}

void Session::take(const wire_packet &packet) {
  if (packet.type == WIRE_ACK) {
    const wire_ack &ack = packet.body.ack;
    std::int64_t now_us = steady_now_us();
    auto sent_us = static_cast<std::int64_t>(ack.host_time_us);
    if (sent_us > 0 && sent_us <= now_us) {
      /* Without a sign until it is known: any time of a device is possible. */
      auto middle_us = static_cast<std::uint64_t>((sent_us + now_us) / 2);
      ClockRelation relation = {static_cast<std::int64_t>(packet.t_us - middle_us), (now_us - sent_us + 1) / 2};
      if (!clock_ || relation.uncertainty_us < clock_->uncertainty_us) {
        clock_ = relation;
      }
      if (exchange_handler_) {
        exchange_handler_({sent_us, now_us, packet.t_us});
      }
    }
    /* The sequence numbers of this exchange's attempts are consecutive. */
    auto attempt = static_cast<std::uint16_t>(ack.sequence - awaited_first_sequence_);
    auto attempts = static_cast<std::uint16_t>(sequence_ - awaited_first_sequence_);
    if (awaited_command_ && ack.command == awaited_command_ && attempt < attempts) {
      if (attempt > 0 && ack.result == WIRE_RESULT_NOT_NOW) {
        repeat_refused_ = true;
      } else {
        ack_ = ack;
      }
    }
  } else if (awaited_answer_ && packet.type == awaited_answer_ && ack_) {
    answer_ = packet;
  }
  if (handler_) {
    handler_(packet);
  }
}

bool Session::send(wire_packet command) {
  command.sequence = sequence_++;
  command.t_us = static_cast<std::uint64_t>(steady_now_us());
  auto bytes = frame_bytes(command);
  return transport_.write(bytes.data(), bytes.size());
}

void Session::look_for_other_versions() {
  for (int version = 1; version <= WIRE_VERSION + NEWER_VERSIONS; version++) {
    if (version != WIRE_VERSION) {
      auto bytes = info_frame_of_version(static_cast<std::uint8_t>(version));
      transport_.write(bytes.data(), bytes.size());
    }
  }
}

wire_packet Session::exchange(const wire_packet &command, std::uint8_t answer_type, Policy policy) {
  std::string name = command_name(command.type);
  awaited_command_ = command.type;
  awaited_answer_ = answer_type;
  awaited_first_sequence_ = sequence_;
  ack_.reset();
  answer_.reset();
  repeat_refused_ = false;
  std::uint64_t version_errors = statistics().version_errors;
  const auto refused = [&](std::uint8_t result) {
    return Error(refusal_code(result), "the fingertip refused \"" + name + "\": " + result_text(result));
  };
  for (int attempt = 0; attempt < policy.attempts; attempt++) {
    send(command);
    if (attempt > 0) {
      look_for_other_versions();
    }
    auto deadline = host_now() + policy.answer_timeout;
    for (auto now = host_now(); now < deadline; now = host_now()) {
      if (stop_()) {
        throw Interrupted();
      }
      auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - now) + std::chrono::milliseconds(1);
      if (poll(std::min(left, POLL_INTERVAL)) == Transport::Result::gone) {
        throw Gone(transport_.description() + ": vanished before it answered \"" + name + "\"");
      }
      if (ack_ && ack_->result != WIRE_RESULT_DONE) {
        throw refused(ack_->result);
      }
      if (ack_ && (answer_ || answer_type == 0)) {
        awaited_command_ = 0;
        awaited_answer_ = 0;
        return answer_.value_or(command);
      }
    }
    if (statistics().version_errors > version_errors) {
      throw Error(ErrorCode::other_version, transport_.description() + ": speaks protocol version " +
                                                std::to_string(decoder_.other_version()) + ", not " + std::to_string(WIRE_VERSION));
    }
  }
  if (repeat_refused_) {
    throw refused(WIRE_RESULT_NOT_NOW);
  }
  throw Error(ErrorCode::no_answer, transport_.description() + ": no answer to \"" + name + "\"");
}

void Session::command(const wire_packet &command, Policy policy) { exchange(command, 0, policy); }

wire_packet Session::info(Policy policy) { return exchange(command_info(), WIRE_INFO, policy); }

wire_packet Session::health() { return exchange(command_health(), WIRE_HEALTH, Policy()); }

wire_packet Session::crash() { return exchange(command_crash(), WIRE_CRASH, Policy()); }

bool Session::reopen() {
  if (!transport_.reopen()) {
    return false;
  }
  decoder_.restart();
  clock_.reset();
  return true;
}

} // namespace fingertip
