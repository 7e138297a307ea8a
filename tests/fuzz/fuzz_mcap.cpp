// MCAP files, whole and damaged, of ours and of others; salvaged or not. Whatever lines are in one,
// another holds the same.
#include "fuzz.h"
#include "grasp/grip_row.hpp"
#include "libfingertip/line_sink.hpp"
#include "packet_file.hpp"

#include <filesystem>

using namespace fingertip;

namespace {

std::vector<std::string> lines_of(const std::string &path, bool salvage) {
  std::vector<std::string> lines;
  const auto source = open_lines(path);
  LineSource::Line line;
  for (;;) {
    try {
      if (!source->next(line)) {
        return lines;
      }
      lines.push_back(line.text);
    } catch (const Error &error) {
      if (!salvage || error.code() != ErrorCode::damaged_line) {
        throw;
      }
    }
  }
}

// The sink writes a file of its own name: a folder of this process, in memory where there is one.
std::string written(const std::vector<std::string> &lines) {
  static const std::string path = (std::filesystem::exists("/dev/shm") ? "/dev/shm/" : "/tmp/") +
                                  std::string("fuzz_mcap_") + std::to_string(getpid()) + ".mcap";
  const auto sink = make_lines(path, true, OutputFile::Appears::at_once);
  for (const std::string &line : lines) {
    sink->line(line);
  }
  sink->finish();
  return path;
}

} // namespace

void fuzz_one(const uint8_t *bytes, size_t length) {
  fuzz_input input = {bytes, bytes + length};
  const std::uint8_t how = fuzz_u8(&input);
  const bool salvage = how & 1;
  const std::string device = how & 2 ? "BBBB" : "";
  const fuzz::MemoryFile file(input.at, fuzz_left(&input));
  if (!is_mcap(file.path())) {
    return;
  }
  fingertips_in(file.path());
  try {
    GripRowReader reader(file.path(), salvage);
    while (reader.next()) {
    }
  } catch (const Error &error) {
    FUZZ_CHECK(!salvage || error.code() != ErrorCode::damaged_line);
  }
  try {
    fuzz::read_twice(file.path(), salvage, device, how >> 4);
  } catch (const Error &error) {
    FUZZ_CHECK(!salvage || error.code() != ErrorCode::damaged_line);
  }
  std::vector<std::string> lines;
  std::string path;
  try {
    lines = lines_of(file.path(), salvage);
    path = written(lines);
  } catch (const Error &) { // damaged, or no text
    return;
  }
  if (!lines.empty()) {
    FUZZ_CHECK(lines_of(path, false) == lines);
  }
  std::filesystem::remove(path);
}
