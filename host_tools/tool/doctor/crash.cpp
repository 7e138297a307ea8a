#include "tool/doctor/crash.hpp"

#include "libfingertip/error.hpp"
#include "libfingertip/names.hpp"
#include "libfingertip/text.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <elf.h>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <utility>

namespace fingertip {

namespace {

/* An assembler's label without a size reaches to the next function, but no farther than this. */
constexpr std::uint32_t UNSIZED_MAX_bytes = 4096;

template <typename Part> Part part_at(const std::vector<std::uint8_t> &file, std::size_t at, const std::string &name) {
  Part part;
  if (at > file.size() || file.size() - at < sizeof part) {
    throw Error(name + ": is cut short; give the ELF file of this firmware");
  }
  std::memcpy(&part, file.data() + at, sizeof part);
  return part;
}

constexpr unsigned FIRST_INTERRUPT = 16;
/* What an exception leaves in lr (ARMv6-M B1.5.8) */
constexpr std::uint32_t EXC_RETURN_MIN = 0xfffffff0;

std::string hex_text(std::uint32_t value) {
  char text[16];
  std::snprintf(text, sizeof text, "0x%08x", static_cast<unsigned>(value));
  return text;
}

std::string duration_text(double seconds) {
  return seconds < 10          ? fixed(seconds, 2) + " s"
         : seconds < 120       ? fixed(seconds, 0) + " s"
         : seconds < 7200      ? fixed(seconds / 60, 0) + " min"
         : seconds < 2 * 86400 ? fixed(seconds / 3600, 0) + " h"
                               : fixed(seconds / 86400, 1) + " days";
}

std::string exception_text(unsigned number) {
  if (number < FIRST_INTERRUPT) {
    return number == 3 ? "the fault handler" : "exception " + std::to_string(number);
  }
  /* RP2040 datasheet 2.3.2, and boards/rp2040/nvic.h for the last */
  static constexpr std::pair<unsigned, const char *> names[] = {
      {0, "sensors' timer"}, {1, "USB's timer"}, {5, "USB"}, {7, "PIO"}, {11, "DMA"}, {23, "I2C"}, {26, "USB service"}};
  std::string text = "interrupt " + std::to_string(number - FIRST_INTERRUPT);
  for (auto [interrupt, name] : names) {
    if (interrupt == number - FIRST_INTERRUPT) {
      text += std::string(" (") + name + ")";
    }
  }
  return text;
}

std::string activity_text(unsigned activity) {
  static constexpr const char *names[] = {"starting",
                                          "at rest",
                                          "obeying commands",
                                          "taking readings",
                                          "following the zero",
                                          "fitting",
                                          "judging the contact",
                                          "sending a packet",
                                          "counting the second",
                                          "storing"};
  return activity < std::size(names) ? names[activity] : "doing " + std::to_string(activity);
}

std::string stuck_text(unsigned stuck) {
  static constexpr std::pair<unsigned, const char *> names[] = {
      {CRASH_STUCK_MAIN, "the main loop"}, {CRASH_STUCK_SCAN, "the scan of the sensors"}, {CRASH_STUCK_USB, "USB"}};
  std::string text;
  for (auto [bit, name] : names) {
    if (stuck & bit) {
      text += (text.empty() ? "" : " and ") + std::string(name);
    }
  }
  return text;
}

std::string place_text(std::uint32_t address, const std::string &place) {
  return place.empty() ? hex_text(address) : place + " (" + hex_text(address) + ")";
}

std::string at_text(const Crash &crash) {
  const crash_record &record = crash.record;
  if (record.pc == 0 && record.sp == 0) {
    return "";
  }
  bool is_call = record.kind != CRASH_PANIC && record.lr != 0 && record.lr < EXC_RETURN_MIN;
  return " at " + place_text(record.pc, crash.place) +
         (is_call ? ", called from " + place_text(record.lr & ~1u, crash.caller) : "");
}

std::string where_text(const crash_record &record) {
  return record.exception == 0
             ? ", in the main loop, " + activity_text(record.activity)
             : ", in " + exception_text(record.exception) + ", the main loop " + activity_text(record.activity);
}

std::string event_text(unsigned code, unsigned detail) {
  const std::string in_a_second = " (" + std::to_string(detail) + " in a second)";
  const std::pair<unsigned, std::string> texts[] = {
      {CRASH_EVENT_START, "started"},
      {CRASH_EVENT_COMMAND, "command " + command_name(static_cast<std::uint8_t>(detail))},
      {CRASH_EVENT_CLOSED, "port closed"},
      {CRASH_EVENT_ASLEEP, "bus asleep"},
      {CRASH_EVENT_AWAKE, "bus awake"},
      {CRASH_EVENT_STORED, detail == 0 ? "stored" : "could not store"},
      {CRASH_EVENT_SENSORS, "other sensors answer"},
      {CRASH_EVENT_BUS, "timeouts on the sensor bus" + in_a_second},
      {CRASH_EVENT_WORKER, "second processor started again"},
      {CRASH_EVENT_SKIPPED, "frames skipped" + in_a_second}};
  for (const auto &[known, text] : texts) {
    if (known == code) {
      return text;
    }
  }
  return "event " + std::to_string(code) + "." + std::to_string(detail);
}

} // namespace

Symbols Symbols::of_file(const std::string &path) {
  if (std::filesystem::is_directory(path)) {
    throw Error(ErrorCode::is_folder, path + ": is a folder");
  }
  std::ifstream stream(path, std::ios::binary);
  std::vector<std::uint8_t> file((std::istreambuf_iterator<char>(stream)), std::istreambuf_iterator<char>());
  if (!stream.is_open() || stream.bad()) {
    throw Error(ErrorCode::cannot_read, path + ": cannot be read (" + std::strerror(errno) + ")");
  }
  return Symbols(std::move(file), path);
}

Symbols::Symbols(std::vector<std::uint8_t> file, const std::string &name) : file_(std::move(file)) {
  bool is_elf = file_.size() > EI_DATA && std::memcmp(file_.data(), ELFMAG, SELFMAG) == 0 &&
                file_[EI_CLASS] == ELFCLASS32 && file_[EI_DATA] == ELFDATA2LSB;
  if (!is_elf || part_at<Elf32_Ehdr>(file_, 0, name).e_machine != EM_ARM) {
    throw Error(name + ": no ELF file of a fingertip; give fingertip-BOARD.elf");
  }
  auto header = part_at<Elf32_Ehdr>(file_, 0, name);
  auto section = [&](std::size_t i) {
    return part_at<Elf32_Shdr>(file_, header.e_shoff + i * sizeof(Elf32_Shdr), name);
  };
  for (unsigned i = 0; i < header.e_shnum; i++) {
    Elf32_Shdr table = section(i);
    if (table.sh_type != SHT_SYMTAB || table.sh_link >= header.e_shnum) {
      continue;
    }
    Elf32_Shdr names = section(table.sh_link);
    for (std::size_t at = 0; at + sizeof(Elf32_Sym) <= table.sh_size; at += sizeof(Elf32_Sym)) {
      auto symbol = part_at<Elf32_Sym>(file_, table.sh_offset + at, name);
      std::size_t text_at = std::size_t{names.sh_offset} + symbol.st_name;
      if (ELF32_ST_TYPE(symbol.st_info) != STT_FUNC || symbol.st_name >= names.sh_size || text_at >= file_.size()) {
        continue;
      }
      auto text = file_.begin() + static_cast<std::ptrdiff_t>(text_at);
      functions_[symbol.st_value & ~1u] = {symbol.st_size, std::string(text, std::find(text, file_.end(), '\0'))};
    }
  }
}

std::optional<std::string> Symbols::place(std::uint32_t address) const {
  auto after = functions_.upper_bound(address);
  if (after == functions_.begin()) {
    return std::nullopt;
  }
  const auto &[start, function] = *std::prev(after);
  std::uint32_t offset = address - start;
  if (offset >= (function.bytes ? function.bytes : UNSIZED_MAX_bytes)) {
    return std::nullopt;
  }
  char text[16];
  std::snprintf(text, sizeof text, "+0x%x", static_cast<unsigned>(offset));
  return function.name + text;
}

bool Symbols::holds(std::string_view text) const {
  return std::search(file_.begin(), file_.end(), text.begin(), text.end()) != file_.end();
}

std::string crash_text(const Crash &crash) {
  const crash_record &record = crash.record;
  std::string since = ", " + duration_text(static_cast<double>(record.t_us) / 1e6) + " after its start";
  switch (record.kind) {
  case CRASH_FAULT:
    return "a hard fault" + at_text(crash) + where_text(record) + since;
  case CRASH_OVERFLOW:
    return "the stack overflowed" + at_text(crash) + where_text(record) + since;
  case CRASH_PANIC:
    return "a panic" + at_text(crash) + where_text(record) + since;
  case CRASH_EXCEPTION:
    return exception_text(record.vector) + " came, which has no handler," + at_text(crash) + where_text(record) + since;
  case CRASH_WATCHDOG:
    if (record.stuck & CRASH_STUCK_INTERRUPTS) {
      return "the watchdog struck: nothing went on, interrupts neither, the main loop " +
             activity_text(record.activity) + since;
    }
    return "the watchdog struck: " + stuck_text(record.stuck) + " made no progress; the processor was" +
           at_text(crash) + where_text(record) + since;
  case CRASH_START:
    return "a start that gave up: clocks that did not come, or a fault in the start-up code";
  default:
    return "an end of kind " + std::to_string(record.kind) + ", which this tool does not know";
  }
}

double event_age_s(const crash_record &record, unsigned event) { return record.event_ages_1024us[event] * 1024e-6; }

std::string events_text(const crash_record &record) {
  std::string text;
  for (unsigned i = 0; i < CRASH_EVENTS && record.event_codes[i] != CRASH_EVENT_NONE; i++) {
    text += (text.empty() ? "" : ", ") + event_text(record.event_codes[i], record.event_details[i]) + " " +
            duration_text(event_age_s(record, i));
  }
  return text;
}

std::vector<std::pair<const char *, std::uint32_t>> registers_of(const crash_record &record) {
  return {{"r0", record.r0}, {"r1", record.r1}, {"r2", record.r2},     {"r3", record.r3}, {"r12", record.r12},
          {"lr", record.lr}, {"pc", record.pc}, {"xpsr", record.xpsr}, {"sp", record.sp}};
}

std::string registers_text(const crash_record &record) {
  std::string text;
  for (auto [name, value] : registers_of(record)) {
    if (name != std::string("pc")) {
      text += (text.empty() ? "" : " ") + std::string(name) + " " + hex_text(value);
    }
  }
  return record.sp == 0 ? "" : text;
}

} // namespace fingertip
