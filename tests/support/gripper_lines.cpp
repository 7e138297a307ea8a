#include "support/gripper_lines.hpp"

#include "grasp/gripper/robotiq.hpp"

#include <cmath>
#include <csignal>
#include <cstdio>

namespace fingertip {

namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes bytes_of(const std::string &text) {
  Bytes bytes;
  for (std::size_t at = 0; at + 1 < text.size(); at += 3) {
    bytes.push_back(static_cast<std::uint8_t>(std::stoi(text.substr(at, 2), nullptr, 16)));
  }
  return bytes;
}

constexpr std::chrono::milliseconds ROUND{10};

} // namespace

std::string digits(const Bytes &bytes) {
  std::string text;
  char two[4];
  for (std::uint8_t byte : bytes) {
    std::snprintf(two, sizeof two, "%02X", byte);
    text += (text.empty() ? "" : " ") + std::string(two);
  }
  return text;
}

Repeated::Repeated(std::function<void()> act)
    : thread_([this, act = std::move(act)] {
        while (!ended_) {
          act();
        }
      }) {}

void Repeated::end() {
  ended_ = true;
  if (thread_.joinable()) {
    thread_.join();
  }
}

Served::Served(const GripperServer::Options &options)
    : motion_(GripperServer::mechanics(options.model)), server_(motion_, options), steps_([this] { server_.step(ROUND); }) {
  std::signal(SIGPIPE, SIG_IGN); // of a port that is gone, which is a socket here
}

void Served::pass(double seconds) { wait_until(host_now() + std::chrono::microseconds(std::llround(1e6 * seconds))); }

Tape::Tape(std::vector<std::pair<std::string, std::string>> exchanges)
    : exchanges_(std::move(exchanges)), port_(""), plays_([this] { play(); }) {}

void Tape::play() {
  port_.wait(host_now() + ROUND);
  std::uint8_t bytes[256];
  const std::size_t count = port_.read(bytes, sizeof bytes);
  came_.insert(came_.end(), bytes, bytes + count);
  if (count == 0 || !complaint_.empty() || played_ == exchanges_.size()) {
    return;
  }
  const auto &[question, answer] = exchanges_[played_];
  const std::size_t length = bytes_of(question).size();
  if (came_.size() < length) {
    return;
  }
  const Bytes asked(came_.begin(), came_.begin() + static_cast<std::ptrdiff_t>(length));
  came_.erase(came_.begin(), came_.begin() + static_cast<std::ptrdiff_t>(length));
  if (digits(asked) != question) {
    complaint_ = "instead of " + question + " came " + digits(asked);
    return;
  }
  const Bytes reply = bytes_of(answer);
  port_.write(reply.data(), reply.size());
  played_++;
}

std::string Tape::complaint() {
  plays_.end();
  if (complaint_.empty() && played_ != exchanges_.size()) {
    complaint_ = "never came " + exchanges_[played_].first;
  }
  if (complaint_.empty() && !came_.empty()) {
    complaint_ = "more came";
  }
  return complaint_;
}

std::string with_crc(const std::string &bytes) { return digits(robotiq::with_crc(bytes_of(bytes))); }

std::string asked(const std::string &port, const std::string &question, std::size_t answer_length) {
  SerialLine line(port, 115200);
  const Bytes sent = bytes_of(question);
  line.write(sent.data(), sent.size());
  Bytes came;
  while (came.size() < answer_length) {
    std::uint8_t bytes[64];
    std::size_t length = 0;
    if (line.read(bytes, sizeof bytes, &length, std::chrono::milliseconds(2000)) != Transport::Result::data) {
      break;
    }
    came.insert(came.end(), bytes, bytes + length);
  }
  return digits(came);
}

} // namespace fingertip
