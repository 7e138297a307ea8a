// Recordings of both formats, CSV and MCAP, whole and damaged, with the gripper's rows; salvaged or not.
#include "fuzz.h"
#include "grasp/grip_row.hpp"
#include "libfingertip/line_sink.hpp"
#include "libfingertip/mcap.hpp"
#include "packet_file.hpp"

#include <cmath>
#include <filesystem>

using namespace fingertip;

// A row that reads is written and read the same; the second time to the last digit.
static void check_row(const GripRow &row) {
  const std::string cells = grip_cells(row);
  const GripRow again = grip_row("0," + cells);
  FUZZ_CHECK(grip_cells(again) == cells);
  FUZZ_CHECK(std::isfinite(row.time_us));
}

static void read_rows(const std::string &path, bool salvage) {
  try {
    GripRowReader reader(path, salvage);
    while (auto row = reader.next()) {
      check_row(*row);
    }
  } catch (const Error &error) {
    FUZZ_CHECK(!salvage || error.code() != ErrorCode::damaged_line);
  }
}

static std::vector<std::string> lines_of(const std::string &path, bool salvage) {
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
static std::string written(const std::vector<std::string> &lines) {
  static const std::string path =
      (std::filesystem::exists("/dev/shm") ? "/dev/shm/" : "/tmp/") + std::string("fuzz_mcap_") + std::to_string(getpid()) + ".mcap";
  const auto sink = make_lines(path, true, OutputFile::Appears::at_once);
  for (const std::string &line : lines) {
    sink->line(line);
  }
  sink->finish();
  return path;
}

// Whatever lines are in an MCAP file, another holds the same.
static void check_lines(const std::string &path, bool salvage) {
  std::vector<std::string> lines;
  std::string copy;
  try {
    lines = lines_of(path, salvage);
    copy = written(lines);
  } catch (const Error &) { // damaged, or no text
    return;
  }
  if (!lines.empty()) {
    FUZZ_CHECK(lines_of(copy, false) == lines);
  }
  std::filesystem::remove(copy);
}

void fuzz_one(const uint8_t *bytes, size_t length) {
  fuzz_input input = {bytes, bytes + length};
  const std::uint8_t how = fuzz_u8(&input);
  const bool salvage = how & 1;
  const std::string device = how & 2 ? "BBBB" : "";
  const fuzz::MemoryFile file(input.at, fuzz_left(&input));
  fingertips_in(file.path());
  read_rows(file.path(), salvage);
  try {
    fuzz::read_twice(file.path(), salvage, device, how >> 4);
  } catch (const Error &error) {
    FUZZ_CHECK(!salvage || error.code() != ErrorCode::damaged_line);
  }
  const std::string_view magic(mcap::MAGIC, sizeof mcap::MAGIC);
  if (std::string_view(reinterpret_cast<const char *>(input.at), fuzz_left(&input)).substr(0, magic.size()) == magic) {
    check_lines(file.path(), salvage);
  }
}
