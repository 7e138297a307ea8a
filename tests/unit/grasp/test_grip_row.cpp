#include "grasp/grip_row.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/text.hpp"
#include "support/host_packets.hpp"

#include <algorithm>
#include <gtest/gtest.h>

using namespace fingertip;

static GripRow row_with_everything() {
  GripRow row;
  row.time_us = 1530022.5;
  row.report.state = GRIP_SLIPPING;
  row.report.trouble = GRIP_FINGER_1_STALE | GRIP_AT_CAP;
  row.report.gripper_fault = 9;
  row.report.wanted_N = 4.101;
  row.report.force_N = 4.019;
  row.report.load_N = 1.022;
  row.report.margin = 1.573;
  row.report.friction = 0.4;
  row.report.width_mm = 34.217;
  row.report.delay_s = 0.012;
  row.report.slides = 3;
  row.command = {34.201, 150.0, 20.0, GRIP_MOVE};
  row.status = GripperStatus{-17, true, false, true, 34.217, 0.125, 9};
  return row;
}

static std::string error_of(const std::string &value) {
  try {
    grip_row(value);
  } catch (const Error &error) {
    EXPECT_EQ(error.code(), ErrorCode::damaged_line);
    return error.what();
  }
  return "";
}

/* The value of a line whose cell of this column is another. */
static std::string with_cell(const std::string &column, const std::string &cell) {
  const std::string header = "time_us," + grip_columns();
  const std::string value = "1530022.5," + grip_cells(row_with_everything());
  const auto names = split(header, ',');
  auto cells = split(value, ',');
  cells[static_cast<std::size_t>(std::find(names.begin(), names.end(), column) - names.begin())] = cell;
  std::string all;
  for (const std::string_view each : cells) {
    all += (all.empty() ? "" : ",") + std::string(each);
  }
  return all;
}

class GripRowFile : public ::testing::Test {
protected:
  void write(const std::vector<std::string> &lines) {
    std::ofstream file(path_, std::ios::binary);
    for (const std::string &line : lines) {
      file << line;
    }
  }
  test::TemporaryFolder folder_;
  std::string path_ = folder_ / "g.csv";
};

TEST(GripRow, ReadsWhatItWrote) {
  const std::string cells = grip_cells(row_with_everything());
  EXPECT_EQ(cells, "slipping,finger_1_stale at_cap,34.217,0,1,1,9,0.125,-17,2,34.201,150.000,20.000,4.101,4.019,1.022,1.573,0.400,"
                   "0.012,3");
  const GripRow read = grip_row("1530022.5," + cells);
  EXPECT_EQ(read.time_us, 1530022.5);
  EXPECT_EQ(grip_cells(read), cells);
  EXPECT_NE(grip_cells(grip_row(with_cell("current_A", ""))).find(",9,,-17,"), std::string::npos); // unknown
}

TEST(GripRow, BeforeTheFirstAnswerTheGrippersCellsAreEmpty) {
  GripRow row = row_with_everything();
  row.status.reset();
  const std::string cells = grip_cells(row);
  EXPECT_NE(cells.find("slipping,finger_1_stale at_cap,,,,,,,,2,"), std::string::npos) << cells;
  EXPECT_FALSE(grip_row("1," + cells).status);
  row.status = GripperStatus{};
  EXPECT_EQ(grip_row("1," + grip_cells(row)).status->object, std::nullopt);
}

TEST(GripRow, EveryWrongCellIsNamed) {
  EXPECT_EQ(error_of(with_cell("time_us", "1530022.5")), "");
  const std::string columns = "time_us," + grip_columns();
  for (const std::string_view column : split(columns, ',')) {
    EXPECT_EQ(error_of(with_cell(std::string(column), "x")), std::string(column) + " is \"x\"");
  }
  EXPECT_EQ(error_of(with_cell("fault", "256")), "fault is \"256\"");
  EXPECT_EQ(error_of(with_cell("slides", "-1")), "slides is \"-1\"");
  EXPECT_EQ(error_of(with_cell("wanted_N", "inf")), "wanted_N is \"inf\"");
  EXPECT_EQ(error_of(with_cell("moving", "")), "moving is \"\"");
  EXPECT_NE(error_of("1,2,3").find("3 columns of the gripper"), std::string::npos);
}

TEST_F(GripRowFile, RowsAreFoundBetweenOthersAndFromAnyPlace) {
  const std::string row = grip_cells(row_with_everything());
  write({"# fingertip-recording 2\n", "# grip: time_us," + grip_columns() + "\n", "0,1,2\n", "# grip: 100.0," + row + "\n",
         "# grip_event: 1.0,hold\n", "# grip: 200.0," + row + "\r\n"});
  GripRowReader reader(path_, false);
  EXPECT_EQ(reader.next()->time_us, 100);
  const auto place = reader.place();
  EXPECT_EQ(reader.next()->time_us, 200);
  EXPECT_FALSE(reader.next());
  reader.go_to(place);
  EXPECT_EQ(reader.next()->time_us, 200);
}

TEST_F(GripRowFile, DamageIsSaidWithItsLineOrSkipped) {
  const std::string row = grip_cells(row_with_everything());
  write({"# grip: time_us," + grip_columns() + "\n", "# grip: 100.0,nonsense\n", "# grip: 200.0," + row + "\n", "# grip: 300.0," + row});
  GripRowReader strict(path_, false);
  try {
    strict.next();
    FAIL();
  } catch (const Error &error) {
    EXPECT_EQ(std::string(error.what()).find(path_ + ":2: "), 0u) << error.what();
  }
  GripRowReader salvaging(path_, true);
  EXPECT_EQ(salvaging.next()->time_us, 200);
  EXPECT_FALSE(salvaging.next()) << "a torn line";
  write({"# grip: time_us,other\n"});
  GripRowReader other(path_, true);
  try {
    other.next();
    FAIL();
  } catch (const Error &error) {
    EXPECT_EQ(error.code(), ErrorCode::other_format);
  }
  EXPECT_THROW(GripRowReader(folder_ / "absent", false), Error);
}
