/* A crash in words. */
#pragma once

#include "libfingertip/wire.hpp"

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace fingertip {

/* The functions of a firmware image, from the ELF file that it was linked into: 32 bits,
 * little-endian (Tool Interface Standard, Executable and Linking Format 1.2). */
class Symbols {
public:
  /* Throws Error: cannot_read, or other if it is no such file. */
  static Symbols of_file(const std::string &path);
  /* name: of the file, for errors. */
  Symbols(std::vector<std::uint8_t> file, const std::string &name);

  /* "fit_frame+0x1a"; nothing where no function is. */
  std::optional<std::string> place(std::uint32_t address) const;

  /* Whether these bytes are anywhere in the file. */
  bool holds(std::string_view text) const;

private:
  struct Function {
    std::uint32_t bytes;
    std::string name;
  };
  std::vector<std::uint8_t> file_;
  std::map<std::uint32_t, Function> functions_; /* by address */
};

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
