#include "grasp/gripper/robotiq_urcap.hpp"

#include "libfingertip/text.hpp"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <netdb.h>
#include <sys/socket.h>

namespace fingertip {

using namespace robotiq;

constexpr const char *PORT = "63352";
constexpr double POLL_s = 0.02;
constexpr int RESET_READS = 50, LARGEST = 255;
constexpr std::chrono::milliseconds PAUSE{20}, QUIET{5};
constexpr std::chrono::milliseconds SETTLES{500}; // after a reset, as public drivers wait

RobotiqUrcap::RobotiqUrcap(const GripperWay &given) : way_(complete_way(given)), traits_(gripper_traits(given.model)) {
  if (given.slave != 0) {
    throw Error(ErrorCode::bad_value, way_.port + ": a gripper behind a robot has no slave number");
  }
  traits_.step_mm = step_mm(way_, traits_);
  traits_.poll_s = POLL_s;
  const std::string address = way_.port.substr(3);
  const std::size_t colon = address.rfind(':');
  const std::string host = address.substr(0, colon), port = colon == std::string::npos ? PORT : address.substr(colon + 1);
  addrinfo hints{}, *found = nullptr;
  hints.ai_family = AF_INET;
  hints.ai_socktype = SOCK_STREAM;
  const int failed = getaddrinfo(host.c_str(), port.c_str(), &hints, &found);
  if (failed != 0) {
    throw Error(ErrorCode::no_port, way_.port + ": " + gai_strerror(failed));
  }
  std::memcpy(&controller_, found->ai_addr, sizeof controller_);
  freeaddrinfo(found);
  connect();
  poll();
}

bool RobotiqUrcap::is_ready(short events, HostTime until) const {
  pollfd one = {line_.get(), events, 0};
  while (wait_for(&one, 1, until) == 0 && host_now() < until) { // a signal came
  }
  return one.revents != 0;
}

HostTime RobotiqUrcap::until() const {
  return host_now() + std::chrono::duration_cast<HostTime::duration>(std::chrono::duration<double>(way_.timeout_s));
}

void RobotiqUrcap::connect() {
  line_ = Descriptor(socket(AF_INET, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  int error = ::connect(line_.get(), reinterpret_cast<const sockaddr *>(&controller_), sizeof controller_) == 0 ? 0 : errno;
  if (error == EINPROGRESS) {
    socklen_t size = sizeof error;
    error = is_ready(POLLOUT, until()) && getsockopt(line_.get(), SOL_SOCKET, SO_ERROR, &error, &size) == 0 ? error : ETIMEDOUT;
  }
  if (error != 0) {
    throw Error(ErrorCode::gripper_silent, way_.port + ": " + std::strerror(error));
  }
  doubtful_ = false;
}

std::string RobotiqUrcap::ask(const std::string &line) {
  if (doubtful_) {
    connect();
  }
  char bytes[64];
  while (recv(line_.get(), bytes, sizeof bytes, 0) > 0) { // an end of line that came late
  }
  doubtful_ = true; // until it is answered
  const std::string sent = line + "\n";
  ssize_t count = send(line_.get(), sent.data(), sent.size(), MSG_NOSIGNAL);
  std::string heard;
  // Public drivers expect no end of line. A number may be whole then, if nothing follows.
  const auto waits = [&, last = until()] {
    return heard.empty() || !std::isdigit(heard.back()) ? last : std::min(last, host_now() + QUIET);
  };
  while (count > 0 && is_ready(POLLIN, waits())) {
    count = recv(line_.get(), bytes, sizeof bytes, 0);
    heard.append(bytes, static_cast<std::size_t>(std::max<ssize_t>(count, 0)));
    heard.erase(0, heard.find_first_not_of(" \r\n"));
    if (heard == "ack" || heard.find('\n') != std::string::npos) {
      break;
    }
  }
  if (count <= 0) {
    throw Error(ErrorCode::gripper_silent, way_.port + ": the robot's controller has closed the connection");
  }
  if (heard.empty()) {
    throw Error(ErrorCode::gripper_silent, way_.port + ": no answer to " + line + " in time");
  }
  doubtful_ = false;
  return heard.substr(0, heard.find_last_not_of(" \r\n") + 1);
}

int RobotiqUrcap::get(const std::string &name) {
  const std::string answer = ask("GET " + name);
  const auto value = answer.rfind(name + " ", 0) == 0 ? to_i64(std::string_view(answer).substr(name.size() + 1)) : std::nullopt;
  if (!value || *value < 0 || *value > LARGEST) {
    doubtful_ = true;
    throw Error(ErrorCode::gripper_garbled, way_.port + ": answers GET " + name + " with \"" + printable(answer) + "\"");
  }
  return static_cast<int>(*value);
}

void RobotiqUrcap::set(const std::string &values) {
  const std::string answer = ask("SET " + values);
  if (answer != "ack") {
    doubtful_ = true;
    throw Error(ErrorCode::gripper_refused, way_.port + ": answers SET " + values + " with \"" + printable(answer) + "\"");
  }
}

void RobotiqUrcap::activate() {
  active_ = false;
  asked_.reset();
  // Only a rise of ACT activates: it must have seen the reset. GTO and ATR, lest it move by itself then.
  for (int left = RESET_READS; left == RESET_READS || get("STA") != RESET || get("ACT") != 0; left--) {
    if (left == 0) {
      throw Error(ErrorCode::gripper_refused, way_.port + ": does not reset");
    }
    set("ACT 0 GTO 0 ATR 0");
    wait_until(host_now() + PAUSE);
  }
  wait_until(host_now() + SETTLES);
  set("ACT 1");
}

GripperStatus RobotiqUrcap::poll() {
  const int gsta = get("STA");
  const bool goes = get("GTO") == 1;
  // What the controller has is not yet what the gripper has.
  const bool begins = asked_ && get("PRE") != *asked_;
  const int gobj = get("OBJ"), gflt = get("FLT");
  const std::int64_t asked_us = steady_now_us();
  active_ = gsta == ACTIVATED;
  GripperStatus status = status_of({active_, goes, gsta, begins ? IN_MOTION : gobj, get("POS"), gflt}, asked_us, way_, traits_);
  status.current_A = std::nan("");
  return status;
}

GripperStatus RobotiqUrcap::move(const GripCommand &move) {
  const Request request = request_of(move, way_, traits_);
  if (!active_) {
    const GripperStatus now = poll();
    if (!active_) {
      return now;
    }
  }
  asked_ = request.position;
  set("POS " + std::to_string(request.position) + " SPE " + std::to_string(request.speed) + " FOR " + std::to_string(request.force) +
      " GTO 1");
  return poll();
}

} // namespace fingertip
