#include "grasp/grip_row.hpp"

#include "grasp/words.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/text.hpp"

#include <cmath>
#include <vector>

namespace fingertip {

namespace {

// One walk serves the header, the rows and the reader. The order is that of the columns; a status
// that is not there leaves its cells empty.
template <typename Visitor> void visit(Visitor &visitor, GripRow &row, GripperStatus *status) {
  GripReport &report = row.report;
  visitor.state("state", report.state);
  visitor.trouble("trouble", report.trouble);
  visitor.number("width_mm", status ? &status->width_mm : nullptr, 3);
  visitor.flag("moving", status ? &status->moving : nullptr);
  visitor.object("object", status ? &status->object : nullptr);
  visitor.flag("active", status ? &status->active : nullptr);
  visitor.integer("fault", status ? &status->fault : nullptr);
  visitor.number("current_A", status ? &status->current_A : nullptr, 3);
  visitor.integer("status_us", status ? &status->host_us : nullptr);
  visitor.integer("motion", &row.command.motion);
  visitor.thousandths("command_mm", row.command.width_mm);
  visitor.thousandths("command_mm_s", row.command.speed_mm_s);
  visitor.thousandths("command_N", row.command.force_N);
  visitor.thousandths("wanted_N", report.wanted_N);
  visitor.thousandths("force_N", report.force_N);
  visitor.thousandths("load_N", report.load_N);
  visitor.thousandths("margin", report.margin);
  visitor.thousandths("friction", report.friction);
  visitor.thousandths("delay_s", report.delay_s);
  visitor.integer("slides", &report.slides);
}

struct Namer {
  std::string text;
  void put(const char *name) { text += (text.empty() ? "" : ",") + std::string(name); }
  void state(const char *name, std::uint8_t) { put(name); }
  void trouble(const char *name, std::uint32_t) { put(name); }
  void number(const char *name, const double *, int) { put(name); }
  void flag(const char *name, const bool *) { put(name); }
  void object(const char *name, const std::optional<bool> *) { put(name); }
  template <typename Integer> void integer(const char *name, const Integer *) { put(name); }
  void thousandths(const char *name, double) { put(name); }
};

struct Writer {
  std::string text;
  bool first = true;
  void put(const std::string &cell) {
    text += (first ? "" : ",") + cell;
    first = false;
  }
  void state(const char *, std::uint8_t value) { put(state_name(value)); }
  void trouble(const char *, std::uint32_t value) { put(trouble_names(value)); }
  void number(const char *, const double *value, int digits) { put(value ? fixed(*value, digits) : ""); }
  void flag(const char *, const bool *value) { put(value ? (*value ? "1" : "0") : ""); }
  void object(const char *, const std::optional<bool> *value) {
    put(!value ? "" : !*value ? "-1" : **value ? "1" : "0");
  }
  template <typename Integer> void integer(const char *, const Integer *value) {
    put(value ? std::to_string(*value) : "");
  }
  void thousandths(const char *, double value) { put(fixed(value, 3)); }
};

struct Reader {
  const std::vector<std::string_view> &cells;
  std::size_t at = 1;

  [[noreturn]] static void wrong(const char *name, std::string_view cell) {
    throw Error(ErrorCode::damaged_line, std::string(name) + " is \"" + std::string(cell) + "\"");
  }
  std::string_view next() { return cells[at++]; }
  static std::int64_t integer_of(const char *name, std::string_view cell) {
    const auto value = to_i64(cell);
    if (!value) {
      wrong(name, cell);
    }
    return *value;
  }
  void state(const char *name, std::uint8_t &value) {
    const auto state = state_of_name(next());
    if (!state) {
      wrong(name, cells[at - 1]);
    }
    value = *state;
  }
  void trouble(const char *name, std::uint32_t &value) {
    const auto trouble = trouble_of_names(next());
    if (!trouble) {
      wrong(name, cells[at - 1]);
    }
    value = *trouble;
  }
  void number(const char *name, double *value, int) {
    const auto cell = next();
    if (value) {
      const auto read = to_double(cell);
      if (!read) {
        wrong(name, cell);
      }
      *value = *read;
    }
  }
  void flag(const char *name, bool *value) {
    const auto cell = next();
    if (value) {
      if (cell != "0" && cell != "1") {
        wrong(name, cell);
      }
      *value = cell == "1";
    }
  }
  void object(const char *name, std::optional<bool> *value) {
    const auto cell = next();
    if (value) {
      if (cell != "0" && cell != "1" && cell != "-1") {
        wrong(name, cell);
      }
      *value = cell == "-1" ? std::nullopt : std::optional<bool>(cell == "1");
    }
  }
  template <typename Integer> void integer(const char *name, Integer *value) {
    const auto cell = next();
    if (value) {
      const std::int64_t read = integer_of(name, cell);
      *value = static_cast<Integer>(read);
      if (static_cast<std::int64_t>(*value) != read) {
        wrong(name, cell);
      }
    }
  }
  void thousandths(const char *name, double &value) {
    const auto cell = next();
    const auto read = to_double(cell);
    if (!read || !std::isfinite(*read)) {
      wrong(name, cell);
    }
    value = *read;
  }
};

std::size_t status_column(const std::vector<std::string_view> &columns) {
  std::size_t at = 0;
  while (at < columns.size() && columns[at] != "status_us") {
    at++;
  }
  return at;
}

} // namespace

std::string grip_columns() {
  GripRow row;
  GripperStatus status;
  Namer namer;
  visit(namer, row, &status);
  return namer.text;
}

std::string grip_cells(const GripRow &row) {
  GripRow copy = row;
  Writer writer;
  visit(writer, copy, copy.status ? &*copy.status : nullptr);
  return writer.text;
}

GripRow grip_row(std::string_view value) {
  static const std::string header = "time_us," + grip_columns();
  static const auto columns = split(header, ',');
  static const std::size_t status_us = status_column(columns);
  const auto cells = split(value, ',');
  if (cells.size() != columns.size()) {
    throw Error(ErrorCode::damaged_line,
                std::to_string(cells.size()) + " columns of the gripper instead of " + std::to_string(columns.size()));
  }
  GripRow row;
  const auto time_us = to_double(cells[0]);
  if (!time_us) {
    Reader::wrong("time_us", cells[0]);
  }
  row.time_us = *time_us;
  if (!cells[status_us].empty()) {
    row.status.emplace();
  }
  Reader reader{cells};
  visit(reader, row, row.status ? &*row.status : nullptr);
  row.report.gripper_fault = row.status ? row.status->fault : 0;
  row.report.width_mm = row.status ? row.status->width_mm : 0.0;
  return row;
}

GripRowReader::GripRowReader(const std::string &path, bool salvage)
    : path_(path), salvage_(salvage), lines_(open_lines(path)) {}

std::optional<GripRow> GripRowReader::next() {
  static const std::string beginning = std::string("# ") + GRIP_ROW_KEY + ": ";
  LineSource::Line line;
  for (;;) {
    try {
      if (!lines_->next(line)) {
        return std::nullopt;
      }
    } catch (const Error &error) {
      if (!salvage_ || error.code() != ErrorCode::damaged_line) {
        throw;
      }
      continue;
    }
    if (line.text.compare(0, beginning.size(), beginning) != 0) {
      continue;
    }
    const std::string_view value = trim(std::string_view(line.text).substr(beginning.size()));
    if (value.substr(0, 8) == "time_us,") {
      if (value != "time_us," + grip_columns()) {
        throw Error(ErrorCode::other_format,
                    path_ + ":" + std::to_string(line.number) + ": other columns of the gripper than this version's");
      }
      continue;
    }
    try {
      if (line.torn) {
        throw Error(ErrorCode::damaged_line, "the last line is torn");
      }
      return grip_row(value);
    } catch (const Error &error) {
      if (!salvage_) {
        throw Error(ErrorCode::damaged_line, path_ + ":" + std::to_string(line.number) + ": " + error.what());
      }
    }
  }
}

} // namespace fingertip
