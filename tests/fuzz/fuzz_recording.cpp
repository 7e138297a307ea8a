// Recordings of both formats, whole and damaged, with the gripper's rows; salvaged or not.
#include "fuzz.h"
#include "grasp/grip_row.hpp"
#include "packet_file.hpp"

#include <cmath>

using namespace fingertip;

namespace {

// A row that reads is written and read the same; the second time to the last digit.
void check_row(const GripRow &row) {
  const std::string cells = grip_cells(row);
  const GripRow again = grip_row("0," + cells);
  FUZZ_CHECK(grip_cells(again) == cells);
  FUZZ_CHECK(std::isfinite(row.time_us));
}

void read_rows(const std::string &path, bool salvage) {
  try {
    GripRowReader reader(path, salvage);
    while (auto row = reader.next()) {
      check_row(*row);
    }
  } catch (const Error &error) {
    FUZZ_CHECK(!salvage || error.code() != ErrorCode::damaged_line);
  }
}

} // namespace

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
}
