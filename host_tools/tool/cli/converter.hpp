/* Recordings and captures turned into one another. */
#pragma once

#include "libfingertip/packet_file.hpp"

#include <string>

namespace fingertip {

struct Conversion {
  std::string from, to;
  std::string device; /* of several in the file; empty: all, or the only one */
  bool salvage = false;
  bool overwrite = false;
};

/* To a recording of one fingertip, packet by packet, with counts of its own in the end line. Throws Error. */
void convert_packets(const Conversion &conversion);

/* On standard error: damaged lines, a missing end. */
void report_losses(const std::string &path, const PacketFile &file);

} // namespace fingertip
