/* A crash in words. */
#pragma once

#include "libfingertip/wire.hpp"
#include "tool/doctor/symbols.hpp"

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace fingertip {

struct Crash {
  crash_record record;
  std::string place, caller; /* of pc and lr, "fit_frame+0x1a"; empty where it is not known */
  std::string symbols_note;  /* why not; empty if they are known or there are none */
};

/* symbols: of the firmware that crashed; none: addresses only. */
inline Crash with_places(const crash_record &record, const std::optional<Symbols> &symbols) {
  const auto place = [&](std::uint32_t address) { return symbols ? symbols->place(address).value_or("") : ""; };
  return {record, place(record.pc), place(record.lr & ~1u), ""};
}

/* "a hard fault at fit_frame+0x1a (0x20001234), ..., 3 min after its start" */
std::string crash_text(const Crash &crash);
/* "command stream 0.20 s, started 3 min": how long before; empty: none. */
std::string events_text(const crash_record &record);
/* The age of an event at the end. */
double event_age_s(const crash_record &record, unsigned event);
/* By name, as the exception left them. */
std::vector<std::pair<const char *, std::uint32_t>> registers_of(const crash_record &record);
/* "r0 0x00000001 r1 ...", without pc; empty where none are known. */
std::string registers_text(const crash_record &record);

} // namespace fingertip
