// The seam to a gripper with two parallel fingers, whatever its maker and its line.
//
//   auto gripper = open_gripper({.model = "2f85", .port = "/dev/ttyUSB0"});
//   gripper->activate();
//   while (!gripper->poll().active) { ... }
//   gripper->move({.width_mm = 20, .speed_mm_s = 50, .force_N = 20});
//   GripperStatus now = gripper->poll();
//
// No function waits longer than one exchange on the line, unless its comment states otherwise. GripperWay has the
// timeout of an exchange. To wait for the end of a motion, poll for it. Not for two threads at once.
//
// A function throws Error for these reasons, unless its comment has its own list:
//   gripper_silent    no answer in time; the next call may have one
//   gripper_garbled   an answer that is none: damaged, of another slave, or to another question
//   gripper_refused   the gripper refuses; the text has its code
//   gone              the port vanished; only open_gripper brings it back
#pragma once

#include "grasp/fingertip_grip.h"
#include "libfingertip/error.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace fingertip {

/* A gripper's kind: a Robotiq's screw drive, or a servo that turns a jaw. */
enum class GripperDriver { robotiq, feetech };

struct GripperTraits : fingertip_grip_traits {
  std::string model; // "2f85"
  GripperDriver driver = GripperDriver::robotiq;
};

struct GripperStatus {
  std::int64_t host_us = 0;   // of the exchange's middle, on std::chrono::steady_clock
  bool active = false;        // it has been activated and takes commands
  bool moving = false;        // or activating
  std::optional<bool> object; // what the gripper itself believes; empty while it moves
  double width_mm = 0.0;
  double current_A = 0.0; // of its motor, as a number without sign; NaN: unknown, as by a URCap
  std::uint8_t fault = 0; // the maker's code; 0: none
  // The gripper got no question for a second or more before this exchange. No fault: a gripper that reports this goes on.
  bool was_left_alone = false;
  double t_s() const { return 1e-6 * static_cast<double>(host_us); }
};

struct GripCommand {
  double width_mm = 0.0, speed_mm_s = 0.0; // beyond its ends and limits: as far as it can
  double force_N = 0.0;                    // its own limit; 0: its least
  std::uint32_t motion = GRIP_STAY;        // fingertip_grip_motion
};

class Gripper {
public:
  virtual ~Gripper() = default;
  virtual const GripperTraits &traits() const = 0;
  // What the line is and what limits it, for people: "Modbus RTU at 115200 baud, slave 9, ...".
  virtual std::string line() const = 0;
  // Begins the activation that the gripper needs before it moves. It drops what it holds and clears its faults. poll
  // reports when it is done. Nothing else ever activates it, or clears a fault. Takes some exchanges, 0.1 s.
  virtual void activate() = 0;
  virtual GripperStatus poll() = 0;
  // Sends and polls in one exchange where the line can do that, else in two. A gripper that is not
  // active ignores it, as the status shows. Also throws Error: bad_value, of what is no number.
  virtual GripperStatus move(const GripCommand &move) = 0;
  // What a fault code of poll means; "" for 0.
  virtual std::string fault_text(std::uint8_t fault) const = 0;
};

struct GripperWay {
  std::string model = {}; // one of gripper_models()
  std::string port = {};  // of a serial line; of a Robotiq on a UR arm: "ur:HOST" (robotiq_urcap.hpp)
  int slave = 0;          // 0: the model's usual; "ur:" has none
  // Positions that the gripper reports when its pads touch and when it is open; empty: the model's
  // defaults. Of a Robotiq 0 to 255, of a servo 0 to 4095, which may turn either way.
  std::optional<int> closed_count = {}, open_count = {};
  double jaw_mm = 100.0;   // of a servo: from its axis to the middle of the pad
  double timeout_s = 0.05; // of one exchange, from 5 ms to 10 s
};

// Each with its usual counts and jaw. The first is the default of programs.
const std::vector<GripperTraits> &gripper_models();
// "2f85, 2f140, ...", for people.
std::string gripper_model_names();
// Throws Error: bad_value, an unknown model.
const GripperTraits &gripper_traits(const std::string &model);

// Asks it for its status, commands nothing. Also throws Error: bad_value, an unknown model or impossible counts;
// no_port, not_a_port, port_in_use, permission_denied, cannot_open. Takes up to five exchanges.
std::unique_ptr<Gripper> open_gripper(const GripperWay &way);

} // namespace fingertip
