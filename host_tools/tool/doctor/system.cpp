#include "tool/doctor/system.hpp"

#include "libfingertip/text.hpp"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sys/stat.h>
#include <unistd.h>

namespace fingertip {

namespace fs = std::filesystem;

/* udev(7), and where a local cmake --install puts it. */
constexpr const char *RULE_FOLDERS[] = {"etc/udev/rules.d", "run/udev/rules.d", "usr/local/lib/udev/rules.d", "usr/lib/udev/rules.d",
                                        "lib/udev/rules.d"};

static bool is_of_our_ports(const std::string &line) {
  char vendor[32], product[32];
  std::snprintf(vendor, sizeof vendor, "{idVendor}==\"%04x\"", FINGERTIP_USB_VID);
  std::snprintf(product, sizeof product, "{idProduct}==\"%04x\"", FINGERTIP_USB_PID);
  return trim(line).substr(0, 1) != "#" && line.find("SUBSYSTEM==\"tty\"") != std::string::npos && line.find(vendor) != std::string::npos &&
         line.find(product) != std::string::npos;
}

static bool holds(const fs::path &descriptors, dev_t device, bool *readable) {
  std::error_code error;
  fs::directory_iterator all(descriptors, error);
  if (error) {
    *readable = error != std::errc::permission_denied;
    return false;
  }
  return std::any_of(begin(all), end(all), [&](const fs::directory_entry &descriptor) {
    struct stat status;
    return stat(descriptor.path().c_str(), &status) == 0 && S_ISCHR(status.st_mode) && status.st_rdev == device;
  });
}

std::string find_rule(const std::string &root) {
  for (const char *folder : RULE_FOLDERS) {
    std::error_code none;
    for (const auto &file : fs::directory_iterator(fs::path(root) / folder, none)) {
      std::ifstream rules(file.path());
      for (std::string line; file.path().extension() == ".rules" && std::getline(rules, line);) {
        if (is_of_our_ports(line)) {
          return file.path().string();
        }
      }
    }
  }
  return "";
}

Holders holders_of(const std::string &device, const std::string &root) {
  Holders holders = {{}, true};
  struct stat status;
  if (stat(device.c_str(), &status) != 0 || !S_ISCHR(status.st_mode)) {
    return holders;
  }
  std::error_code none;
  for (const auto &process : fs::directory_iterator(fs::path(root) / "proc", none)) {
    auto number = to_u64(process.path().filename().string());
    bool readable = true;
    if (number && *number != static_cast<std::uint64_t>(getpid()) && holds(process.path() / "fd", status.st_rdev, &readable)) {
      std::ifstream file(process.path() / "comm");
      std::string name;
      std::getline(file, name);
      holders.seen.push_back({static_cast<int>(*number), name});
    }
    holders.all_seen = holders.all_seen && readable;
  }
  std::sort(holders.seen.begin(), holders.seen.end(), [](const Holder &a, const Holder &b) { return a.process < b.process; });
  return holders;
}

} // namespace fingertip
