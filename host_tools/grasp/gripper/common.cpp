#include "grasp/gripper/common.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace fingertip {

void check_move(const GripCommand &move) {
  if (!std::isfinite(move.width_mm) || !std::isfinite(move.speed_mm_s) || !std::isfinite(move.force_N) || move.speed_mm_s < 0 ||
      move.force_N < 0) {
    throw Error(ErrorCode::bad_value, "a move needs numbers, and speed and force are not negative");
  }
}

GripperWay complete(GripperWay way, const GripperUsual &usual) {
  way.slave = way.slave == 0 ? usual.slave : way.slave;
  if (way.slave < 1 || way.slave > usual.most_slave) {
    throw Error(ErrorCode::bad_value, "a slave is a number from 1 to " + std::to_string(usual.most_slave));
  }
  way.closed_count = way.closed_count.value_or(usual.closed_count);
  way.open_count = way.open_count.value_or(usual.open_count);
  for (int count : {*way.closed_count, *way.open_count}) {
    if (count < 0 || count > usual.most_count || way.closed_count == way.open_count) {
      throw Error(ErrorCode::bad_value, "counts of the ends are two numbers from 0 to " + std::to_string(usual.most_count));
    }
  }
  if (!(way.jaw_mm >= 10 && way.jaw_mm <= 500)) {
    throw Error(ErrorCode::bad_value, "a jaw is 10 to 500 mm long");
  }
  if (!(way.timeout_s >= 0.005 && way.timeout_s <= 10)) {
    throw Error(ErrorCode::bad_value, "an exchange's timeout is 0.005 to 10 s");
  }
  return way;
}

RequestLine::Bytes RequestLine::exchange(const Bytes &question, std::size_t length) {
  resynchronise();
  send(question);
  doubtful_ = true; // until it is answered: who answers late answers the next question
  probe_ = 0;
  Bytes answer = receive(question, length);
  doubtful_ = false;
  return answer;
}

void RequestLine::resynchronise() {
  if (!doubtful_) {
    return;
  }
  const bool again = probe_ == 0 || host_now() >= probe_until_;
  probe_ = !again ? probe_ : probe_ == 1 ? 2 : 1;
  const auto [question, length] = probe(probe_);
  if (again) {
    probe_until_ = host_now() + PROBE_TIMEOUTS * timeout();
    send(question);
  }
  receive(question, length);
  doubtful_ = false;
}

void RequestLine::send(const Bytes &question) {
  line_.drop_input();
  asked_us_ = steady_now_us();
  if (!line_.write(question.data(), question.size())) {
    throw Error(ErrorCode::gone, way_.port + ": gone");
  }
}

RequestLine::Bytes RequestLine::receive(const Bytes &question, std::size_t length) {
  Bytes came, payload;
  std::size_t noise = 0;
  bool other_slave = false, other_answer = false, echo_gone = false;
  const HostTime until = host_now() + timeout();
  for (;;) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - host_now());
    std::uint8_t bytes[256];
    std::size_t count = 0;
    if (left.count() <= 0) {
      break;
    }
    if (line_.read(bytes, sizeof bytes, &count, left) == Transport::Result::gone) {
      throw Error(ErrorCode::gone, way_.port + ": gone");
    }
    came.insert(came.end(), bytes, bytes + count);
    if (!echo_gone && came.size() >= question.size()) {
      echo_gone = true;
      if (std::equal(question.begin(), question.end(), came.begin())) {
        came.erase(came.begin(), came.begin() + static_cast<std::ptrdiff_t>(question.size()));
      }
    } else if (!echo_gone && std::equal(came.begin(), came.end(), question.begin())) {
      continue;
    }
    for (Reply reply; (reply = take(question, length, &came, &noise, &payload)) != Reply::none;) {
      if (reply == Reply::matches) {
        return payload;
      }
      other_slave = other_slave || reply == Reply::other_slave;
      other_answer = other_answer || reply == Reply::other_answer;
    }
  }
  if (other_slave || other_answer) {
    throw Error(ErrorCode::gripper_garbled,
                way_.port + (other_slave ? ": another slave answers" : ": an answer is not one to the question"));
  }
  if (noise + came.size() > 0) {
    throw Error(ErrorCode::gripper_garbled, way_.port + ": an answer is damaged (checksum)");
  }
  throw Error(ErrorCode::gripper_silent, way_.port + ": no answer from slave " + std::to_string(way_.slave) + " within " +
                                             std::to_string(std::lround(way_.timeout_s * 1000)) + " ms");
}

std::string RequestLine::limited_by(int exchanges) const {
  const std::optional<int> timer_ms = latency_timer_ms(way_.port);
  if (!timer_ms || *timer_ms <= 1) {
    return "";
  }
  return "; the USB adapter's latency timer of " + std::to_string(*timer_ms) + " ms allows " +
         std::to_string(1000 / (*timer_ms * exchanges)) + " commands a second";
}

} // namespace fingertip
