#include "tool/doctor/crash.hpp"

#include "libfingertip/names.hpp"
#include "libfingertip/text.hpp"

#include <cstdio>
#include <iterator>

namespace fingertip {

constexpr unsigned FIRST_INTERRUPT = 16;
/* What an exception leaves in lr (ARMv6-M B1.5.8) */
constexpr std::uint32_t EXC_RETURN_MIN = 0xfffffff0;

static std::string hex_text(std::uint32_t value) {
  char text[16];
  std::snprintf(text, sizeof text, "0x%08x", static_cast<unsigned>(value));
  return text;
}

static std::string duration_text(double seconds) {
  return seconds < 10          ? fixed(seconds, 2) + " s"
         : seconds < 120       ? fixed(seconds, 0) + " s"
         : seconds < 7200      ? fixed(seconds / 60, 0) + " min"
         : seconds < 2 * 86400 ? fixed(seconds / 3600, 0) + " h"
                               : fixed(seconds / 86400, 1) + " days";
}

static std::string exception_text(unsigned number) {
  if (number < FIRST_INTERRUPT) {
    return number == 3 ? "the fault handler" : "exception " + std::to_string(number);
  }
  /* RP2040 datasheet 2.3.2, and boards/rp2040/nvic.h for the last */
  static constexpr std::pair<unsigned, const char *> names[] = {{0, "sensors' timer"}, {1, "USB's timer"}, {5, "USB"},         {7, "PIO"},
                                                                {11, "DMA"},           {23, "I2C"},        {26, "USB service"}};
  std::string text = "interrupt " + std::to_string(number - FIRST_INTERRUPT);
  for (auto [interrupt, name] : names) {
    if (interrupt == number - FIRST_INTERRUPT) {
      text += std::string(" (") + name + ")";
    }
  }
  return text;
}

static std::string activity_text(unsigned activity) {
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

static std::string stuck_text(unsigned stuck) {
  static constexpr std::pair<unsigned, const char *> names[] = {
      {CRASH_STUCK_MAIN, "the main loop"}, {CRASH_STUCK_SCAN, "the scan of the sensors"}, {CRASH_STUCK_USB, "USB"}};
  return joined(names, " and ", [&](const auto &each) { return stuck & each.first ? each.second : ""; });
}

static std::string place_text(std::uint32_t address, const std::string &place) {
  return place.empty() ? hex_text(address) : place + " (" + hex_text(address) + ")";
}

static std::string at_text(const Crash &crash) {
  const crash_record &record = crash.record;
  if (record.pc == 0 && record.sp == 0) {
    return "";
  }
  bool is_call = record.kind != CRASH_PANIC && record.lr != 0 && record.lr < EXC_RETURN_MIN;
  return " at " + place_text(record.pc, crash.place) + (is_call ? ", called from " + place_text(record.lr & ~1u, crash.caller) : "");
}

static std::string where_text(const crash_record &record) {
  return record.exception == 0 ? ", in the main loop, " + activity_text(record.activity)
                               : ", in " + exception_text(record.exception) + ", the main loop " + activity_text(record.activity);
}

static std::string event_text(unsigned code, unsigned detail) {
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
      {CRASH_EVENT_WORKER, detail == 0 ? "second processor started again" : "second processor does not start"},
      {CRASH_EVENT_SKIPPED, "frames skipped" + in_a_second}};
  const auto *found = find_in(texts, [&](const auto &each) { return each.first == code; });
  return found ? found->second : "event " + std::to_string(code) + "." + std::to_string(detail);
}

std::string crash_text(const Crash &crash) {
  const crash_record &record = crash.record;
  std::string since = ", " + duration_text(static_cast<double>(record.t_us) / 1e6) + " after its start";
  switch (record.kind) {
  case CRASH_FAULT: return "a hard fault" + at_text(crash) + where_text(record) + since;
  case CRASH_OVERFLOW: return "the stack overflowed" + at_text(crash) + where_text(record) + since;
  case CRASH_PANIC: return "a panic" + at_text(crash) + where_text(record) + since;
  case CRASH_EXCEPTION: return exception_text(record.vector) + " came, which has no handler," + at_text(crash) + where_text(record) + since;
  case CRASH_WATCHDOG:
    if (record.stuck & CRASH_STUCK_INTERRUPTS) {
      return "the watchdog struck: nothing went on, interrupts neither, the main loop " + activity_text(record.activity) + since;
    }
    return "the watchdog struck: " + stuck_text(record.stuck) + " made no progress; the processor was" + at_text(crash) +
           where_text(record) + since;
  case CRASH_START: return "a start that gave up: clocks that did not come, or a fault in the start-up code";
  default: return "an end of kind " + std::to_string(record.kind) + ", which this tool does not know";
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
  return record.sp == 0 ? "" : joined(registers_of(record), " ", [](const auto &each) {
    return each.first == std::string("pc") ? "" : std::string(each.first) + " " + hex_text(each.second);
  });
}

} // namespace fingertip
