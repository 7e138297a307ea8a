/* Names of what the wire protocol numbers, as people read and type them. */
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#pragma GCC visibility push(default)
namespace fingertip {

struct FlagName {
  std::uint32_t bit;
  const char *name;
  bool warning; /* the numbers deserve less trust */
};

/* Every flag of the contact packet, lowest bit first. */
const std::vector<FlagName> &flag_names();

/* The bits of all warnings: trust a contact only without them. */
std::uint32_t warning_flags();

/* "CONTACT FIT_VALID", an unknown bit as "bit9". */
std::string flags_text(std::uint32_t flags);

/* "stream", "tare", ...: a command's type; "0x9a" if unknown. */
std::string command_name(std::uint8_t type);

/* What an acknowledgement's result means, for the end of a sentence. */
std::string result_text(std::uint8_t result);

/* "fit,slip,raw,tangential": what a firmware can do; "none". */
std::string capabilities_text(std::uint32_t capabilities);

/* "calibration,settings,pad": what a fingertip keeps without power; "nothing". */
std::string stored_text(std::uint32_t stored);

/* "contact,raw": what a fingertip sends unasked; "none". */
std::string streams_text(std::uint8_t streams);

} // namespace fingertip
#pragma GCC visibility pop
