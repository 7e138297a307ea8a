#include "grasp/grip_row.hpp"

#include "grasp/words.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/text.hpp"

#include <cmath>
#include <functional>
#include <type_traits>
#include <vector>

namespace fingertip {

namespace {

// A cell as text and back; false: it is none. A status that is not there leaves its cells empty.
struct Column {
  const char *name;
  bool is_of_status;
  std::function<std::string(const GripRow &row)> write;
  std::function<bool(std::string_view cell, GripRow &row)> read;
};

// field(row): a reference to it. Not a number: unknown, where it may be; its cell is empty.
template <typename Field> Column number(const char *name, Field field, bool is_of_status = false, bool may_be_unknown = false) {
  return {name, is_of_status, [=](const GripRow &row) { return std::isnan(field(row)) ? "" : fixed(field(row), 3); },
          [=](std::string_view cell, GripRow &row) {
            const auto read = to_double(cell);
            field(row) = read.value_or(cell.empty() ? std::nan("") : 0.0);
            return cell.empty() ? may_be_unknown : read && std::isfinite(*read);
          }};
}

template <typename Field> Column integer(const char *name, Field field, bool is_of_status = false) {
  return {name, is_of_status, [=](const GripRow &row) { return std::to_string(field(row)); },
          [=](std::string_view cell, GripRow &row) {
            const auto read = to_i64(cell);
            field(row) = static_cast<std::remove_reference_t<decltype(field(row))>>(read.value_or(0));
            return read && std::int64_t{field(row)} == *read;
          }};
}

// "-1": unknown.
Column object() {
  return {"object", true, [](const GripRow &row) { return row.status->object ? std::to_string(*row.status->object) : "-1"; },
          [](std::string_view cell, GripRow &row) {
            row.status->object = cell == "-1" ? std::nullopt : std::optional(cell == "1");
            return cell == "0" || cell == "1" || cell == "-1";
          }};
}

template <typename Field, typename Parse>
Column word(const char *name, Field field, std::string (*text)(std::decay_t<decltype(field(std::declval<GripRow &>()))>), Parse parse) {
  return {name, false, [=](const GripRow &row) { return text(field(row)); },
          [=](std::string_view cell, GripRow &row) {
            const auto read = parse(cell);
            field(row) = read.value_or(0);
            return read.has_value();
          }};
}

#define FIELD(member)                                                                                                                      \
  [](auto &row) -> auto & { return row.member; }

const std::vector<Column> &columns() {
  static const std::vector<Column> all = {
      word("state", FIELD(report.state), state_name, state_of_name),
      word("trouble", FIELD(report.trouble), trouble_names, trouble_of_names),
      number("width_mm", FIELD(status->width_mm), true),
      integer("moving", FIELD(status->moving), true),
      object(),
      integer("active", FIELD(status->active), true),
      integer("fault", FIELD(status->fault), true),
      number("current_A", FIELD(status->current_A), true, true),
      integer("status_us", FIELD(status->host_us), true),
      integer("motion", FIELD(command.motion)),
      number("command_mm", FIELD(command.width_mm)),
      number("command_mm_s", FIELD(command.speed_mm_s)),
      number("command_N", FIELD(command.force_N)),
      number("wanted_N", FIELD(report.wanted_N)),
      number("force_N", FIELD(report.force_N)),
      number("load_N", FIELD(report.load_N)),
      number("margin", FIELD(report.margin)),
      number("friction", FIELD(report.friction)),
      number("delay_s", FIELD(report.delay_s)),
      integer("slides", FIELD(report.slides)),
  };
  return all;
}

[[noreturn]] void wrong(const char *name, std::string_view cell) {
  throw Error(ErrorCode::damaged_line, std::string(name) + " is \"" + std::string(cell) + "\"");
}

} // namespace

std::string grip_columns() {
  return joined(columns(), ",", [](const Column &column) { return column.name; });
}

std::string grip_cells(const GripRow &row) {
  std::string text;
  for (const Column &column : columns()) {
    text += (&column == &columns().front() ? "" : ",") + (column.is_of_status && !row.status ? std::string() : column.write(row));
  }
  return text;
}

GripRow grip_row(std::string_view value) {
  const auto cells = split(value, ',');
  if (cells.size() != columns().size() + 1) {
    throw Error(ErrorCode::damaged_line,
                std::to_string(cells.size()) + " columns of the gripper instead of " + std::to_string(columns().size() + 1));
  }
  GripRow row;
  const auto time_us = to_double(cells[0]);
  if (!time_us) {
    wrong("time_us", cells[0]);
  }
  row.time_us = *time_us;
  const Column *since = find_in(columns(), [](const Column &column) { return std::string_view(column.name) == "status_us"; });
  if (!cells[static_cast<std::size_t>(since - columns().data()) + 1].empty()) {
    row.status.emplace();
  }
  for (std::size_t i = 0; i < columns().size(); i++) {
    const Column &column = columns()[i];
    if ((row.status || !column.is_of_status) && !column.read(cells[i + 1], row)) {
      wrong(column.name, cells[i + 1]);
    }
  }
  row.report.gripper_fault = row.status ? row.status->fault : 0;
  row.report.width_mm = row.status ? row.status->width_mm : 0.0;
  return row;
}

GripRowReader::GripRowReader(const std::string &path, bool salvage, const TimeSpan &interval)
    : path_(path), salvage_(salvage), lines_(within(open_lines(path), interval)) {}

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
