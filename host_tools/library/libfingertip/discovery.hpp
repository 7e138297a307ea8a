/* Finds fingertips in the list of USB devices of Linux, and in the environment. Nothing is opened. */
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#pragma GCC visibility push(default)
namespace fingertip {

struct UsbPlace {
  unsigned bus, address;
};

struct Found {
  std::string serial;  /* as USB reports it; empty for a path from the environment */
  std::string product; /* of a path from the environment: that, and whether it exists */
  std::string port;    /* the stable name under /dev/serial/by-id where there is one, else under
                          /dev; empty: no driver serves it as a serial port */
  std::optional<UsbPlace> usb;
  std::string socket = ""; /* of its server; find_usb and find_in_environment do not ask */
};

/* Devices with our USB ids, sorted by serial number. root: where to look for sys/ and dev/, "/" except in tests. */
std::vector<Found> find_usb(const std::string &root = "/");

/* Finds a board that runs its boot ROM, as BOOTSEL makes it: which, and what to do. Empty: there is none. */
std::string find_boot_rom(const std::string &root = "/");

/* The paths in the environment variable FINGERTIP_PORT, separated by colons. */
std::vector<Found> find_in_environment();

/* Trimmed; empty where there is none. */
std::string first_line(const std::filesystem::path &path);

/* The stable name of a device below /dev, or the path itself. */
std::string stable_port(const std::string &path, const std::string &root = "/");

} // namespace fingertip
#pragma GCC visibility pop
