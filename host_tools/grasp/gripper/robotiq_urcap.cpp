#include "grasp/gripper/robotiq_urcap.hpp"

#include "libfingertip/text.hpp"

#include <cerrno>
#include <cstring>
#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>

namespace fingertip {

using namespace robotiq;

constexpr const char *PORT = "63352";
constexpr double POLL_s = 0.02;
constexpr int RESET_READS = 50, LARGEST = 255;
constexpr std::chrono::milliseconds PAUSE{20};

RobotiqUrcap::RobotiqUrcap(const GripperWay &given) : way_(complete_way(given)), traits_(gripper_traits(given.model)) {
  if (given.slave != 0) {
    throw Error(ErrorCode::bad_value, way_.port + ": a gripper behind a robot has no slave number");
  }
  traits_.step_mm = step_mm(way_, traits_);
  traits_.poll_s = POLL_s;
  poll();
  failure_ = ErrorCode::gripper_silent;
}

bool RobotiqUrcap::is_ready(short events) const {
  pollfd one = {line_.get(), events, 0};
  return ::poll(&one, 1, static_cast<int>(1e3 * way_.timeout_s)) == 1;
}

void RobotiqUrcap::connect() {
  const std::string address = way_.port.substr(3);
  const std::size_t colon = address.rfind(':');
  const std::string host = address.substr(0, colon), port = colon == std::string::npos ? PORT : address.substr(colon + 1);
  addrinfo hints{}, *found = nullptr;
  hints.ai_socktype = SOCK_STREAM;
  const int failed = getaddrinfo(host.c_str(), port.c_str(), &hints, &found);
  if (failed != 0) {
    throw Error(failure_, way_.port + ": " + gai_strerror(failed));
  }
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> all(found, freeaddrinfo);
  line_ = Descriptor(socket(found->ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  int error = ::connect(line_.get(), found->ai_addr, found->ai_addrlen) == 0 ? 0 : errno;
  if (error == EINPROGRESS) {
    socklen_t size = sizeof error;
    error = is_ready(POLLOUT) && getsockopt(line_.get(), SOL_SOCKET, SO_ERROR, &error, &size) == 0 ? error : ETIMEDOUT;
  }
  if (error != 0) {
    throw Error(failure_, way_.port + ": " + std::strerror(error));
  }
}

std::string RobotiqUrcap::ask(const std::string &line) {
  if (doubtful_) {
    connect();
  }
  doubtful_ = true; // until it is answered
  const std::string sent = line + "\n";
  char answer[64];
  ssize_t count = send(line_.get(), sent.data(), sent.size(), MSG_NOSIGNAL);
  if (count == static_cast<ssize_t>(sent.size())) {
    if (!is_ready(POLLIN)) {
      throw Error(ErrorCode::gripper_silent, way_.port + ": no answer to " + line + " in time");
    }
    count = recv(line_.get(), answer, sizeof answer, 0);
  }
  if (count <= 0) {
    throw Error(ErrorCode::gripper_silent, way_.port + ": the robot's controller has closed the connection");
  }
  doubtful_ = false;
  const std::string heard(answer, static_cast<std::size_t>(count));
  return heard.substr(0, heard.find_last_not_of(" \r\n") + 1);
}

int RobotiqUrcap::get(const std::string &name) {
  const std::string answer = ask("GET " + name);
  const auto value = answer.rfind(name + " ", 0) == 0 ? to_i64(std::string_view(answer).substr(name.size() + 1)) : std::nullopt;
  if (!value || *value < 0 || *value > LARGEST) {
    doubtful_ = true;
    throw Error(ErrorCode::gripper_garbled, way_.port + ": no answer to GET " + name);
  }
  return static_cast<int>(*value);
}

void RobotiqUrcap::set(const std::string &values) {
  if (ask("SET " + values) != "ack") {
    doubtful_ = true;
    throw Error(ErrorCode::gripper_refused, way_.port + ": does not take SET " + values);
  }
}

void RobotiqUrcap::activate() {
  set("ACT 0");
  // Only a rise of ACT activates: it must have seen the reset.
  for (int left = RESET_READS; get("STA") != RESET; left--) {
    if (left == 0) {
      throw Error(ErrorCode::gripper_refused, way_.port + ": does not reset");
    }
    wait_until(host_now() + PAUSE);
  }
  set("ACT 1");
}

GripperStatus RobotiqUrcap::poll() {
  const std::int64_t asked_us = steady_now_us();
  const int gsta = get("STA");
  const bool goes = get("GTO") == 1;
  const int gobj = get("OBJ"), gpo = get("POS"), gflt = get("FLT");
  return status_of({gsta == ACTIVATED, goes, gsta, gobj, gpo, gflt}, asked_us, way_, traits_);
}

GripperStatus RobotiqUrcap::move(const GripperMove &move) {
  const Request request = request_of(move, way_, traits_);
  set("POS " + std::to_string(request.position) + " SPE " + std::to_string(request.speed) + " FOR " + std::to_string(request.force) +
      " GTO 1");
  return poll();
}

} // namespace fingertip
