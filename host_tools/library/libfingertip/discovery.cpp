#include "libfingertip/discovery.hpp"

#include "libfingertip/text.hpp"

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <fstream>

namespace fingertip {

namespace fs = std::filesystem;

std::string first_line(const std::filesystem::path &path) {
  std::ifstream file(path);
  std::string text;
  std::getline(file, text);
  return std::string(trim(text));
}

namespace {

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

/* The terminal that serves one of the interfaces of this USB device. */
std::string port_of(const fs::path &usb, const fs::path &root) {
  std::error_code none;
  for (const auto &interface : fs::directory_iterator(usb, none)) {
    for (const auto &tty : fs::directory_iterator(interface.path() / "tty", none)) {
      return stable_path(root / "dev" / tty.path().filename(), root);
    }
  }
  return "";
}

struct BootRom {
  unsigned vendor, product;
  const char *what;
};
constexpr BootRom BOOT_ROMS[] = {
    {0x2e8a, 0x0003, "a Pico that waits for firmware: install it with `fingertip flash`"},
    {0x2e8a, 0x000f, "a Pico 2 (RP2350): there is firmware for a Pico or a Pico W only"},
};

bool is_device(const fs::path &usb, unsigned vendor, unsigned product) {
  return is_hex(first_line(usb / "idVendor"), vendor) && is_hex(first_line(usb / "idProduct"), product);
}

} // namespace

std::string find_boot_rom(const std::string &root) {
  std::error_code none;
  for (const auto &entry : fs::directory_iterator(fs::path(root) / "sys/bus/usb/devices", none)) {
    const BootRom *rom = find_in(BOOT_ROMS, [&](const BootRom &each) { return is_device(entry.path(), each.vendor, each.product); });
    if (rom) {
      return rom->what;
    }
  }
  return "";
}

std::vector<Found> find_usb(const std::string &root) {
  std::vector<Found> found;
  std::error_code none;
  for (const auto &entry : fs::directory_iterator(fs::path(root) / "sys/bus/usb/devices", none)) {
    const fs::path &usb = entry.path();
    if (!is_device(usb, FINGERTIP_USB_VID, FINGERTIP_USB_PID)) {
      continue;
    }
    auto number = [&](const char *name) { return static_cast<unsigned>(to_u64(first_line(usb / name)).value_or(0)); };
    found.push_back(
        {first_line(usb / "serial"), first_line(usb / "product"), port_of(usb, root), UsbPlace{number("busnum"), number("devnum")}});
  }
  std::sort(found.begin(), found.end(), [](const Found &a, const Found &b) { return a.serial < b.serial; });
  return found;
}

std::vector<Found> find_in_environment() {
  std::vector<Found> found;
  const char *paths = std::getenv("FINGERTIP_PORT");
  for (std::string_view path : split(paths ? paths : "", ':')) {
    if (!path.empty()) {
      std::error_code none;
      found.push_back({"", fs::exists(path, none) ? "from FINGERTIP_PORT" : "from FINGERTIP_PORT, no such port", std::string(path), {}});
    }
  }
  return found;
}

std::string stable_port(const std::string &path, const std::string &root) {
  std::error_code none;
  return fs::exists(path, none) && fs::path(path).parent_path() == fs::path(root) / "dev" ? stable_path(path, root) : path;
}

} // namespace fingertip
