/* Other ends of a gripper's line for tests, on simulated time. */
#pragma once

#include "libfingertip/clock.hpp"
#include "libfingertip/served_port.hpp"
#include "simulation/cell/gripper_server.hpp"

#include <cstdint>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace fingertip {

/* A thread that does this over and over, as long as it is there. act waits a little each time. */
class Repeated {
public:
  explicit Repeated(std::function<void()> act);
  ~Repeated() { end(); }
  void end();

private:
  bool ended_ = false;
  Thread thread_;
};

/* A simulated gripper served by a thread, as long as this is there. */
class Served {
public:
  explicit Served(const GripperServer::Options &options);

  std::string port() const { return server_.port(); }
  /* What act(server, motion) returns, between two steps: one thread runs at a time. */
  template <typename Act> auto with(Act act) { return act(server_, motion_); }

  void pass(double seconds);

private:
  GripperMotion motion_;
  GripperServer server_;
  Repeated steps_;
};

/* A line on which exactly these questions come and get these answers, in hexadecimal digits with blanks between bytes; "" is no answer. */
class Tape {
public:
  explicit Tape(std::vector<std::pair<std::string, std::string>> exchanges);
  const std::string &port() const { return port_.path(); }
  /* What went otherwise; also where not all of it came. */
  std::string complaint();

private:
  void play();

  std::vector<std::pair<std::string, std::string>> exchanges_;
  ServedPort port_;
  std::vector<std::uint8_t> came_;
  std::string complaint_;
  std::size_t played_ = 0;
  Repeated plays_;
};

/* Bytes in hexadecimal digits; the same with Modbus' checksum after them. */
std::string digits(const std::vector<std::uint8_t> &bytes);
std::string with_crc(const std::string &bytes);

/* The first so many bytes that come after this question. */
std::string asked(const std::string &port, const std::string &question, std::size_t answer_length);

} // namespace fingertip
