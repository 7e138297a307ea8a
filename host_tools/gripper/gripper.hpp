// The seam to a gripper with two parallel fingers, whatever its maker and its line.
//
//   auto gripper = open_gripper({"2f85", "/dev/ttyUSB0"});
//   gripper->activate();
//   gripper->move({.width_mm = 20, .speed_mm_s = 50, .force_N = 20});
//   GripperStatus now = gripper->poll();
//
// Nothing here waits longer than one exchange on the line (its timeout: 50 ms); whoever wants the
// end of a motion polls for it. Not for two threads at once.
#pragma once

#include "libfingertip/error.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace fingertip {

struct GripperTraits {
  std::string model;                                 // "2f85"
  double stroke_mm = 0.0;                            // width between the pads when open
  double step_mm = 0.0;                              // of the commanded width
  double deadband_mm = 0.0;                          // moves shorter than this are not made
  double speed_min_mm_s = 0.0, speed_max_mm_s = 0.0; // of the width
  double force_min_N = 0.0, force_max_N = 0.0;       // of its own limit of force; 0: it has none
  double latency_s = 0.0;                            // from a command to motion
  double poll_s = 0.0;                               // of one exchange, at the least
};

struct GripperStatus {
  std::int64_t host_us = 0; // of the exchange's middle, on std::chrono::steady_clock
  bool active = false;      // it has been activated and takes commands
  bool moving = false;
  std::optional<bool> object; // what the gripper itself believes; empty while it moves
  double width_mm = 0.0;
  double current_A = 0.0;
  std::uint8_t fault = 0; // the maker's code; 0: none
};

struct GripperMove {
  double width_mm = 0.0;
  double speed_mm_s = 0.0;
  double force_N = 0.0; // its own limit; 0: its least
};

class Gripper {
public:
  virtual ~Gripper() = default;
  virtual const GripperTraits &traits() const = 0;
  // What the line is and what limits it, for people: "Modbus RTU at 115200 baud, slave 9".
  virtual std::string line() const = 0;
  // Begins what the gripper needs before it moves, dropping what it holds; poll tells when it is
  // done.
  virtual void activate() = 0;
  // Throw Error: ErrorCode::gone without an answer in time, or where the port vanished.
  virtual GripperStatus poll() = 0;
  // Sends and polls in one exchange where the line can do that.
  virtual GripperStatus move(const GripperMove &move) = 0;
  // What a fault code of poll means, in the maker's terms.
  virtual std::string fault_text(std::uint8_t fault) const = 0;
};

struct GripperWay {
  std::string model; // one of gripper_models()
  std::string port;  // of a serial line
  int slave = 0;     // 0: the model's usual
};

std::vector<GripperTraits> gripper_models();
// Throws Error: an unknown model.
const GripperTraits &gripper_traits(const std::string &model);

// Throws Error: an unknown model, a port that cannot be opened, no answer.
std::unique_ptr<Gripper> open_gripper(const GripperWay &way);

} // namespace fingertip
