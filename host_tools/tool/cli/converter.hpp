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

/* To a recording, line by line: nothing is lost, nothing changed. Throws Error. */
void convert_lines(const Conversion &conversion);
/* To a recording of one fingertip, packet by packet, with counts of its own in the end line. */
void convert_packets(const Conversion &conversion);
/* To the bytes of the line. */
void convert_to_capture(const Conversion &conversion);

/* On standard error: damaged lines, a missing end. */
void report_losses(const std::string &path, const PacketFile &file);

} // namespace fingertip
