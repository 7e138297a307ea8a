/* The computer's own facts about a fingertip's port. root: the folder with etc, usr, run, dev and proc. */
#pragma once

#include <string>
#include <vector>

namespace fingertip {

/* The file with a udev rule for serial ports of our USB ids, of the folders that udev reads;
 * empty: none. */
std::string find_rule(const std::string &root);

struct Holder {
  int process;
  std::string name;
};

struct Holders {
  std::vector<Holder> seen; /* other processes that have the device open */
  bool all_seen;            /* false: this user may not look into every process */
};

/* device: a path below dev, or of a pseudo-terminal. */
Holders holders_of(const std::string &device, const std::string &root);

} // namespace fingertip
