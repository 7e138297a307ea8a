#include "tool/arrays/entry.hpp"

#include <cstdio>
#include <cstdlib>

namespace fingertip::measure {

static thread_local std::string last_failure;

static std::vector<Record> &records() {
  static std::vector<Record> all;
  return all;
}

bool list_record(Record record) {
  for (const Record &other : records()) {
    if (other.name == record.name) {
      std::fprintf(stderr, "measure: two records have the name %s\n", record.name.c_str());
      std::abort(); // while the object is loaded, nothing can catch an exception
    }
  }
  records().push_back(std::move(record));
  return true;
}

void failed(const char *entry, const char *what) { last_failure = entry + std::string(": ") + what; }

} // namespace fingertip::measure

extern "C" {

__attribute__((visibility("default"))) const char *measure_failure() { return fingertip::measure::last_failure.c_str(); }

// A line for each: name, bytes, and name:offset:kind:bytes:count of each field.
__attribute__((visibility("default"))) const char *measure_records() {
  static const std::string text = [] {
    std::string all;
    for (const auto &record : fingertip::measure::records()) {
      all += record.name + " " + std::to_string(record.bytes);
      for (const auto &field : record.fields) {
        all += " " + field.name + ":" + std::to_string(field.offset) + ":" + field.kind + ":" + std::to_string(field.item_bytes) + ":" +
               std::to_string(field.count);
      }
      all += "\n";
    }
    return all;
  }();
  return text.c_str();
}
}
