#include "tool/cli/gripper_options.hpp"

#include "grasp/gripper/serial_line.hpp"
#include "libfingertip/share_socket.hpp"
#include "tool/advice.hpp"

namespace fingertip {

static std::string only_port() {
  const std::vector<GripperPort> ports = find_gripper_ports();
  if (ports.size() == 1) {
    return ports.front().path;
  }
  std::string names;
  for (const GripperPort &port : ports) {
    names += " " + port.path;
  }
  throw WrongUsage(ports.empty() ? "no serial port on USB is here; name the gripper's with --port (of grasp, --gripper-port)"
                                 : "choose one with --port (of grasp, --gripper-port):" + names);
}

void with_gripper_line(CLI::App *command, GripperWay &way) {
  with_value(command, "N", "--slave", way.slave, "Its address on a serial line; default: 9, of a servo 6");
  with_value(command, "COUNT", "--closed", way.closed_count, "Position that it reports when its pads touch; default: 230, of a servo 2048");
  with_value(command, "COUNT", "--open", way.open_count, "Position that it reports when it is open; default: 3, of a servo 2700");
  with_value(command, "MM", "--jaw", way.jaw_mm, "Of a servo: from its axis to the middle of the pad; default: 100 mm");
  command
      ->add_option_function<double>(
          "--timeout", [&way](double timeout_ms) { way.timeout_s = timeout_ms / 1000; }, "Of one answer; default: 50 ms")
      ->type_name("MS");
}

Error with_gripper_advice(const Error &error) {
  const std::string what_to_do = gripper_advice(error.code());
  return Error(error.what() + (what_to_do.empty() ? "" : "; " + what_to_do));
}

std::unique_ptr<Gripper> reach_gripper(GripperWay &way) {
  if (way.port.empty()) {
    way.port = only_port();
  }
  way.port = port_of(way.port);
  try {
    return open_gripper(way);
  } catch (const Error &error) {
    if (error.code() == ErrorCode::bad_value) {
      throw WrongUsage(error.what());
    }
    throw with_gripper_advice(error);
  }
}

} // namespace fingertip
