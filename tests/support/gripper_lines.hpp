/* Other ends of a gripper's line for tests. */
#pragma once

#include "cell/gripper_server.hpp"

#include <array>
#include <atomic>
#include <cstdint>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace fingertip {

/* A simulated gripper served by a thread, as long as this is there. */
class Served {
public:
  explicit Served(const GripperServer::Options &options);
  ~Served();

  std::string port() const { return server_.port(); }
  /* What act(server, motion) returns, between two steps. */
  template <typename Act> auto with(Act act) {
    std::lock_guard<std::mutex> turn(turn_), lock(mutex_);
    return act(server_, motion_);
  }

  /* Lets simulated time pass, at once. */
  void pass(double seconds);

private:
  std::mutex turn_, mutex_; // whoever waits has its turn before the thread
  GripperMotion motion_;
  GripperServer server_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

/* A line on which exactly these questions come and get these answers, in hexadecimal digits with
 * blanks between bytes; "" is no answer. */
class Tape {
public:
  explicit Tape(std::vector<std::pair<std::string, std::string>> exchanges);
  ~Tape();
  const std::string &port() const { return port_; }
  /* What went otherwise; also where not all of it came. */
  std::string complaint();

private:
  void play();

  std::vector<std::pair<std::string, std::string>> exchanges_;
  int master_, held_open_;
  std::string port_, complaint_;
  std::size_t played_ = 0;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

/* Bytes in hexadecimal digits, with Modbus' checksum after them. */
std::string with_crc(const std::string &bytes);

/* The first so many bytes that come after this question. */
std::string asked(const std::string &port, const std::string &question, std::size_t answer_length);

/* A Modbus slave of libmodbus' own making, whose status says active, going, at 100, 0.42 A. */
class PlainSlave {
public:
  PlainSlave();
  ~PlainSlave();
  const std::string &port() const { return port_; }
  /* What is in the command registers. Activation shows in the status, as far as gACT goes. */
  std::array<int, 3> command();

private:
  struct Mapped;
  int master_, held_open_;
  std::string port_;
  std::unique_ptr<Mapped> mapped_;
  std::mutex mutex_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

} // namespace fingertip
