/* Asks computer and fingertip for the facts. */
#pragma once

#include "libfingertip/connection.hpp"
#include "tool/doctor/judge.hpp"

#include <functional>
#include <string>

namespace fingertip {

struct Examination {
  Choice choice;
  double seconds = 10;    /* of the measurement, device time */
  std::string root = "/"; /* of the system's files */
  std::string elf;        /* of the firmware, for the names in a crash; empty: where it is built */
};

/* Whatever ends it early is one of the facts, but for an ELF file that was named and is none:
 * Error. stop: asked while waiting; true throws Interrupted. progress: called with the share of the
 * measurement that is over, 0..1. Leaves the streams off. */
Facts gather(const Examination &examination, const std::function<bool()> &stop,
             const std::function<void(double)> &progress);

} // namespace fingertip
