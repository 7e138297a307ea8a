// A simulated gripper on a port of its own, with its own protocol: Modbus RTU for Robotiq's, packets
// for Feetech's. What its line can suffer is part of it.
//
// Answers come when the bytes of question and answer would have crossed the line, no sooner. One thread at a time.
#pragma once

#include "grasp/gripper/gripper.hpp"
#include "libfingertip/served_port.hpp"
#include "simulation/cell/gripper_motion.hpp"

#include <chrono>
#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <vector>

namespace fingertip {

enum class LineFault {
  none,
  silent,      // no answer
  garbage,     // bytes that are none
  damaged,     // a checksum is wrong
  other_slave, // another's answer
  refused,     // Modbus: exception 1; Feetech: bits of trouble
};
const std::vector<std::pair<std::string, LineFault>> &line_faults(); // and their names

struct LineTrouble {
  LineFault fault = LineFault::none;
  int answers = -1;           // number of answers with the fault; -1: all
  double late_s = 0.0;        // delay of each of them
  double latency_timer_s = 0; // of a USB adapter: answers go on only at its ticks
};

class GripperServer {
public:
  struct Options {
    std::string model = {};
    int slave = 0;         // 0: the model's usual
    std::string link = {}; // made to its port; "": none
    // Whether step moves the fingers on as real time passes; else the driver of the motion does.
    bool real_time = true;
    std::vector<int> functions = {3, 4, 16, 23}; // of Modbus, that it answers
  };

  // gripper_mechanics for a motion behind registers, which are its steps.
  static GripperMechanics mechanics(const std::string &model);

  // motion outlives it; a gripper whose motion is active has been activated. Throws Error: an unknown model; no port to be had.
  GripperServer(GripperMotion &motion, const Options &options);
  GripperServer(const GripperServer &) = delete;
  GripperServer &operator=(const GripperServer &) = delete;

  const std::string &port() const { return port_.path(); }

  // Waits at most this long for something to do, and does it.
  void step(std::chrono::microseconds longest_wait);

  void trouble(const LineTrouble &trouble) { trouble_ = trouble; }
  // Without power it does not answer, and afterwards it is not active.
  void power(bool on);
  // When bytes last came.
  HostTime heard_at() const { return came_at_; }
  // The gripper's own fault, by the maker's code.
  void fail(std::uint8_t fault) { slave_->fail(fault); }

  // What is behind the line: a protocol and its registers.
  class Slave {
  public:
    using Bytes = std::vector<std::uint8_t>;
    virtual ~Slave() = default;
    virtual double baud() const = 0;
    // Takes a whole frame out of what came; false: there is none yet.
    virtual bool take_frame(Bytes *came, Bytes *frame) = 0;
    // Empty: it does not answer.
    virtual Bytes answer(const Bytes &frame, bool refuse) = 0;
    virtual Bytes of_other_slave(Bytes answer) = 0;
    // Without power all that was written is lost.
    virtual void lose_power() = 0;
    virtual void fail(std::uint8_t fault) = 0;
  };

private:
  struct Answer {
    HostTime due;
    std::vector<std::uint8_t> bytes;
  };

  void take();

  GripperMotion &motion_;
  bool real_time_;
  std::unique_ptr<Slave> slave_;
  ServedPort port_;
  LineTrouble trouble_;
  bool power_ = true;
  std::vector<std::uint8_t> came_;
  HostTime came_at_{}, stepped_at_;
  std::deque<Answer> answers_;
};

std::unique_ptr<GripperServer::Slave> robotiq_slave(GripperMotion &motion, const GripperServer::Options &options);
std::unique_ptr<GripperServer::Slave> feetech_slave(GripperMotion &motion, const GripperServer::Options &options);

} // namespace fingertip
