#include "support/validation_array.hpp"
#include "tool/validation/protocol.hpp"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <set>

namespace fingertip::validating {
namespace {

TEST(Protocol, FifteenMarksWithinTheSensorsEachFarFromTheOneBefore) {
  const calibrating::Array array = validation_array();
  const std::vector<Mark> marks = marks_of(array);
  ASSERT_EQ(marks.size(), 15u);
  std::set<std::pair<double, double>> places;
  for (std::size_t m = 0; m < marks.size(); m++) {
    places.insert({marks[m].x_mm, marks[m].y_mm});
    EXPECT_LE(std::abs(marks[m].x_mm), 9.0);
    EXPECT_LE(std::abs(marks[m].y_mm), 18.0);
    if (m > 0) {
      EXPECT_GT(std::hypot(marks[m].x_mm - marks[m - 1].x_mm, marks[m].y_mm - marks[m - 1].y_mm),
                8.5);
    }
  }
  EXPECT_EQ(places.size(), 15u);
}

TEST(Protocol, StepsAreTheSameFromTheirEvents) {
  const std::vector<Step> steps = steps_of(marks_of(validation_array()), 312.5, 11.0);
  EXPECT_EQ(std::count_if(steps.begin(), steps.end(),
                          [](const Step &step) { return step.kind == Step::Kind::press; }),
            static_cast<std::ptrdiff_t>(15 * TURNS));
  for (const Step &step : steps) {
    const auto read = step_of(event_of(step));
    ASSERT_TRUE(read) << event_of(step);
    EXPECT_EQ(read->kind, step.kind);
    EXPECT_EQ(read->mark, step.mark);
    EXPECT_EQ(read->at.x_mm, step.at.x_mm);
    EXPECT_EQ(read->at.y_mm, step.at.y_mm);
    EXPECT_EQ(read->weight_g, step.weight_g);
    EXPECT_EQ(read->skin_mm, step.skin_mm);
  }
}

TEST(Protocol, OtherEventsAreNoSteps) {
  for (const char *text : {"gone 2026-01-01", "validate: dance", "validate: press mark=1 x_mm=3",
                           "validate: press mark=0 x_mm=1 y_mm=", "validate: begin",
                           "validate:hold", "validate: begin weight_g=0 skin_mm=12", ""}) {
    EXPECT_FALSE(step_of(text)) << text;
  }
}

} // namespace
} // namespace fingertip::validating
