#include "support/validation_array.hpp"
#include "tool/validation/protocol.hpp"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <set>

namespace fingertip::validating {
namespace {

constexpr std::size_t MARKS = 23; // fifteen sensors, and eight cells of four

TEST(Protocol, MarksLieOnEachSensorAndBetweenEachFour) {
  const calibrating::Array array = validation_array();
  const std::vector<Mark> marks = marks_of(array);
  ASSERT_EQ(marks.size(), MARKS);
  for (std::size_t k = 0; k < array.sensors(); k++) {
    std::size_t on = 0, nearest = 0;
    for (const Mark &mark : marks) {
      const auto off_mm = [&](std::size_t sensor) {
        return std::hypot(array.x_mm[sensor] - mark.x_mm, array.y_mm[sensor] - mark.y_mm);
      };
      on += off_mm(k) < 0.25;
      bool is_nearest = true;
      for (std::size_t j = 0; j < array.sensors(); j++) {
        is_nearest = is_nearest && off_mm(k) < off_mm(j) + 0.1;
      }
      nearest += is_nearest;
    }
    EXPECT_EQ(on, 1u) << k;
    EXPECT_GE(nearest, 2u) << k; /* at a corner; 5 in the middle */
  }
}

TEST(Protocol, EachMarkIsAnotherAndFarFromTheOneBefore) {
  for (std::size_t sensors : {15u, 14u, 8u}) {
    calibrating::Array array = validation_array();
    array.x_mm.resize(sensors);
    array.y_mm.resize(sensors);
    const std::vector<Mark> marks = marks_of(array);
    std::set<std::pair<double, double>> places;
    for (std::size_t m = 0; m < marks.size(); m++) {
      places.insert({marks[m].x_mm, marks[m].y_mm});
      if (m > 0 && sensors == 15u) {
        EXPECT_GT(std::hypot(marks[m].x_mm - marks[m - 1].x_mm, marks[m].y_mm - marks[m - 1].y_mm),
                  2.0 * array.pitch_mm);
      }
    }
    EXPECT_EQ(places.size(), marks.size()) << sensors;
  }
}

TEST(Protocol, StepsAreTheSameFromTheirEvents) {
  const std::vector<Step> steps = steps_of(marks_of(validation_array()), 312.5, 11.0, {104.5, 1.5});
  EXPECT_EQ(steps.size(), steps_of(marks_of(validation_array()), 312.5, 11.0).size() + PULLS_TOWARD_deg.size());
  EXPECT_EQ(std::count_if(steps.begin(), steps.end(), [](const Step &step) { return step.kind == Step::Kind::press; }),
            static_cast<std::ptrdiff_t>(MARKS * TURNS));
  for (const Step &step : steps) {
    const auto read = step_of(event_of(step));
    ASSERT_TRUE(read) << event_of(step);
    EXPECT_EQ(read->kind, step.kind);
    EXPECT_EQ(read->mark, step.mark);
    EXPECT_EQ(read->at.x_mm, step.at.x_mm);
    EXPECT_EQ(read->at.y_mm, step.at.y_mm);
    EXPECT_EQ(read->weight_g, step.weight_g);
    EXPECT_EQ(read->skin_mm, step.skin_mm);
    EXPECT_EQ(read->toward_deg, step.toward_deg);
    EXPECT_EQ(read->pulling.weight_g, step.pulling.weight_g);
    EXPECT_TRUE(step.kind != Step::Kind::pull || read->pulling.height_mm == 1.5);
  }
}

TEST(Protocol, OtherEventsAreNoSteps) {
  for (const char *text : {"gone 2026-01-01", "validate: dance", "validate: press mark=1 x_mm=3",
                           "validate: press mark=0 x_mm=1 y_mm=", "validate: begin", "validate:hold",
                           "validate: begin weight_g=0 skin_mm=12", "validate: pull toward_deg=0 height_mm=2",
                           "validate: pull toward_deg=0 weight_g=0 height_mm=2", ""}) {
    EXPECT_FALSE(step_of(text)) << text;
  }
}

} // namespace
} // namespace fingertip::validating
