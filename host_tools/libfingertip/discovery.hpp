/* Finds fingertips among the serial ports of a Linux system. */
#pragma once

#include <string>
#include <vector>

namespace fingertip {

struct Port {
  std::string path;   /* the stable name under /dev/serial/by-id where there is one */
  std::string serial; /* as USB reports it; empty for a path from the environment */
  std::string product; /* of a path from the environment: that, and whether it exists */
};

/* Ports with our USB ids, then the paths in the environment variable FINGERTIP_PORT (separated by
 * colons). root: where to look for sys/ and dev/, "/" but in tests. */
std::vector<Port> find_ports(const std::string &root = "/");

/* The wanted path, or the only one there is: FINGERTIP_PORT first, then USB. Throws Error if there
 * is none, or a choice. */
std::string choose_port(const std::string &wanted, const std::string &root = "/");

} // namespace fingertip
