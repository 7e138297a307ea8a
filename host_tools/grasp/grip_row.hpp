// The gripper's and the controller's rows in a recording of a grasp. Such a recording is a joint recording of its two
// fingertips (libfingertip/RECORDING.md), 0 the left and 1 the right, with these lines between:
//
//   # grip: time_us,state,trouble,width_mm,...    once, before the first
//   # grip: 1530022.0,holding,,34.217,...         the time is the rows', by the recorder's clock
//   # grip_event: text                            a request, or a failure
//
// So `sed -n 's/^# grip: //p' grasp.csv` is a CSV file. There is a row for each change of state,
// trouble, command or answer, and otherwise for every 10 ms.
//
// - state and trouble: names (words.hpp).
// - width_mm, moving, object (-1: unknown), active, fault and current_A: the gripper's answer at
//   status_us. Before its first answer status_us is empty. The fault that led to state fault stays.
// - motion: 0 stay, 1 activate, 2 move. command_*: of move.
// - Forces are of one fingertip. margin: 0 without a load. delay_s: from a fingertip's measurement
//   to the controller, the later of both. slides: counted since the grasp began.
#pragma once

#include "grasp/control/grip.hpp"
#include "libfingertip/line_source.hpp"

#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace fingertip {

inline constexpr const char *GRIP_ROW_KEY = "grip";
inline constexpr const char *GRIP_EVENT_KEY = "grip_event";

struct GripRow {
  double time_us = 0; // from the recording's zero
  GripReport report{};
  GripCommand command{};
  std::optional<GripperStatus> status; // host_us from the recording's zero too
};

// Without time_us, which the writer of the recording puts before them.
std::string grip_columns();
std::string grip_cells(const GripRow &row);
// Parses the cells of a line, time_us first. Throws Error that names the cell that is wrong.
GripRow grip_row(std::string_view value);

// The rows of a file; none in any other file.
class GripRowReader {
public:
  // salvage: damaged rows are skipped, else next throws Error with file and line.
  GripRowReader(const std::string &path, bool salvage, const TimeSpan &interval = {});

  std::optional<GripRow> next();

  using Place = LineSource::Place;
  Place place() { return lines_->place(); }
  void go_to(const Place &place) { lines_->go_to(place); }

private:
  std::string path_;
  bool salvage_;
  std::unique_ptr<LineSource> lines_;
};

} // namespace fingertip
