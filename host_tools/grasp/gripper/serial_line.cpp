#include "grasp/gripper/serial_line.hpp"

#include "libfingertip/discovery.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/text.hpp"

#include <algorithm>
#include <sys/socket.h>
#include <sys/stat.h>
#include <termios.h>

namespace fingertip {

namespace fs = std::filesystem;

SerialLine::SerialLine(const std::string &path, unsigned baud) : SerialTransport(path) {
  termios settings;
  struct stat status;
  const bool is_simulated = fstat(fd_, &status) == 0 && S_ISSOCK(status.st_mode);
  const speed_t speed = baud == 1000000 ? B1000000 : B115200;
  if (!is_simulated && (tcgetattr(fd_, &settings) != 0 || cfsetspeed(&settings, speed) != 0 || tcsetattr(fd_, TCSANOW, &settings) != 0)) {
    throw Error(ErrorCode::cannot_open, path + ": cannot go at " + std::to_string(baud) + " baud");
  }
  drop_input();
}

void SerialLine::drop_input() {
  std::uint8_t bytes[256];
  if (tcflush(fd_, TCIFLUSH) != 0) {
    while (recv(fd_, bytes, sizeof bytes, MSG_DONTWAIT) > 0) { // of a simulated port
    }
  }
}

std::optional<int> latency_timer_ms(const std::string &port, const std::string &root) {
  std::error_code none;
  const fs::path device = fs::canonical(port, none);
  const auto timer_ms = to_i64(first_line(fs::path(root) / "sys/bus/usb-serial/devices" / device.filename() / "latency_timer"));
  return none || !timer_ms ? std::nullopt : std::optional(static_cast<int>(*timer_ms));
}

std::vector<GripperPort> find_gripper_ports(const std::string &root) {
  std::vector<std::string> fingertips;
  for (const Found &found : find_usb(root)) {
    fingertips.push_back(found.port);
  }
  std::vector<GripperPort> ports;
  std::error_code none;
  for (const auto &entry : fs::directory_iterator(fs::path(root) / "sys/class/tty", none)) {
    const std::string name = entry.path().filename().string();
    const fs::path interface = fs::canonical(entry.path() / "device", none);
    if (none || (name.rfind("ttyUSB", 0) != 0 && name.rfind("ttyACM", 0) != 0)) {
      none.clear();
      continue;
    }
    const std::string device = (fs::path(root) / "dev" / name).string();
    GripperPort port;
    port.path = stable_port(device, root);
    if (std::find(fingertips.begin(), fingertips.end(), port.path) != fingertips.end()) {
      continue;
    }
    // Up from the tty to the USB device, which has the names.
    for (fs::path usb = interface; usb.has_relative_path(); usb = usb.parent_path()) {
      if (fs::exists(usb / "idVendor", none)) {
        port.adapter = std::string(trim(first_line(usb / "manufacturer") + " " + first_line(usb / "product")));
        break;
      }
    }
    port.latency_timer_ms = latency_timer_ms(device, root);
    ports.push_back(port);
  }
  std::sort(ports.begin(), ports.end(), [](const GripperPort &a, const GripperPort &b) { return a.path < b.path; });
  return ports;
}

} // namespace fingertip
