#include "libfingertip/discovery.hpp"

#include "libfingertip/error.hpp"
#include "libfingertip/text.hpp"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <filesystem>
#include <fstream>

namespace fingertip {

namespace {

namespace fs = std::filesystem;

std::string file_text(const fs::path &path) {
  std::ifstream file(path);
  std::string text;
  std::getline(file, text);
  return std::string(trim(text));
}

bool is_hex(const std::string &text, unsigned expected) {
  unsigned value = 0;
  auto result = std::from_chars(text.data(), text.data() + text.size(), value, 16);
  return result.ec == std::errc() && result.ptr == text.data() + text.size() && value == expected;
}

/* The link below dev/serial/by-id that leads to this device, or the device itself. */
std::string stable_path(const fs::path &device, const fs::path &root) {
  std::error_code none;
  for (const auto &link : fs::directory_iterator(root / "dev/serial/by-id", none)) {
    if (fs::equivalent(link.path(), device, none)) {
      return link.path().string();
    }
  }
  return device.string();
}

std::vector<Port> usb_ports(const fs::path &root) {
  std::vector<Port> ports;
  std::error_code none;
  for (const auto &tty : fs::directory_iterator(root / "sys/class/tty", none)) {
    fs::path interface = fs::canonical(tty.path() / "device", none);
    if (none) {
      none.clear();
      continue;
    }
    fs::path usb = interface.parent_path();
    if (is_hex(file_text(usb / "idVendor"), FINGERTIP_USB_VID) &&
        is_hex(file_text(usb / "idProduct"), FINGERTIP_USB_PID)) {
      ports.push_back({stable_path(root / "dev" / tty.path().filename(), root),
                       file_text(usb / "serial"), file_text(usb / "product")});
    }
  }
  std::sort(ports.begin(), ports.end(),
            [](const Port &a, const Port &b) { return a.path < b.path; });
  return ports;
}

std::vector<Port> environment_ports() {
  std::vector<Port> ports;
  const char *paths = std::getenv("FINGERTIP_PORT");
  for (std::string_view path : split(paths ? paths : "", ':')) {
    if (!path.empty()) {
      std::error_code none;
      ports.push_back({std::string(path), "",
                       fs::exists(path, none) ? "from FINGERTIP_PORT"
                                              : "from FINGERTIP_PORT, no such port"});
    }
  }
  return ports;
}

} // namespace

std::vector<Port> find_ports(const std::string &root) {
  std::vector<Port> ports = usb_ports(root);
  for (Port &port : environment_ports()) {
    ports.push_back(port);
  }
  return ports;
}

std::string choose_port(const std::string &wanted, const std::string &root) {
  if (!wanted.empty()) {
    std::error_code none;
    return fs::exists(wanted, none) && fs::path(wanted).parent_path() == "/dev"
               ? stable_path(wanted, root)
               : wanted;
  }
  std::vector<Port> ports = environment_ports();
  if (ports.empty()) {
    ports = usb_ports(root);
  }
  if (ports.empty()) {
    throw Error("no fingertip found; plug one in, or name its port with --port PATH");
  }
  if (ports.size() > 1) {
    std::string names;
    for (const Port &port : ports) {
      names += " " + port.path;
    }
    throw Error("several fingertips found; choose one with --port:" + names);
  }
  return ports[0].path;
}

} // namespace fingertip
