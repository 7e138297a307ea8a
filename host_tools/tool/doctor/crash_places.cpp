#include "tool/doctor/crash.hpp"

namespace fingertip {

Crash with_places(const crash_record &record, const std::optional<Symbols> &symbols) {
  Crash crash{record, "", "", ""};
  if (symbols) {
    crash.place = symbols->place(record.pc).value_or("");
    crash.caller = symbols->place(record.lr & ~1u).value_or("");
  }
  return crash;
}

} // namespace fingertip
