#include "libfingertip/random.hpp"
#include "models.hpp"

#include <algorithm>

using namespace fingertip;
using namespace fingertip::test;

/* One of each maker. */
class GripperTest : public ::testing::TestWithParam<const char *> {
protected:
  std::unique_ptr<Served> served_ = std::make_unique<Served>(served(GetParam()));
  Served &simulated_ = *served_;
  std::unique_ptr<Gripper> gripper_ = activated(GetParam(), simulated_);
};

TEST_P(GripperTest, SaysWhatIsWrongWithAnAnswerAndGoesOn) {
  const GripCommand move = {.width_mm = 50, .speed_mm_s = 100};
  gripper_->move(move);
  gripper_->move(move);
  const std::string line = gripper_->line();
  const struct {
    LineFault fault;
    ErrorCode code;
  } CASES[] = {{LineFault::silent, ErrorCode::gripper_silent},
               {LineFault::garbage, ErrorCode::gripper_garbled},
               {LineFault::damaged, ErrorCode::gripper_garbled},
               {LineFault::other_slave, ErrorCode::gripper_garbled},
               {LineFault::refused, ErrorCode::gripper_refused}};
  for (const auto &one : CASES) {
    if (one.fault == LineFault::refused && GetParam() == std::string("sts3215")) {
      continue; /* its answers have no such word */
    }
    for (const bool polls : {true, false}) {
      simulated_.with([&](GripperServer &server, GripperMotion &) { server.trouble({.fault = one.fault, .answers = 1}); });
      EXPECT_EQ(code_of([&] { polls ? gripper_->poll() : gripper_->move(move); }), one.code) << static_cast<int>(one.fault) << polls;
      EXPECT_TRUE(gripper_->poll().active);
    }
  }
  EXPECT_EQ(gripper_->line(), line);
}

/* Nor by the very exchange after which the tool knows of it, where nothing polled meanwhile. */
TEST_P(GripperTest, IsNotActivatedByAMoveAfterItsPowerWasLost) {
  for (const bool polls : {true, false}) {
    moved(simulated_, *gripper_, {.width_mm = 40, .speed_mm_s = 150});
    simulated_.with([](GripperServer &server, GripperMotion &) { server.power(false); });
    if (polls) {
      EXPECT_EQ(code_of([&] { gripper_->poll(); }), ErrorCode::gripper_silent);
    }
    simulated_.with([](GripperServer &server, GripperMotion &) { server.power(true); });
    for (int i = 0; i < 20; i++) {
      EXPECT_FALSE(gripper_->move({.width_mm = 85, .speed_mm_s = 150}).moving);
    }
    EXPECT_FALSE(gripper_->poll().active);
    EXPECT_NEAR(gripper_->poll().width_mm, 40, 0.19);
    simulated_.with([](GripperServer &, GripperMotion &motion) { EXPECT_FALSE(motion.activating()); });
    gripper_->activate();
    wait_for(simulated_, *gripper_, is_active);
  }
}

/* An exchange waits for 50 ms; half of the answers are up to 150 ms late while it closes and opens. Where the question
 * to be sure was asked again before its own answer had come, one status in thirty was an older one. */
TEST_P(GripperTest, NoStatusIsOlderThanItsQuestionHoweverLateAnswersCome) {
  constexpr double NEAR_mm = 0.4; // a step, and how far it moves within a poll's own time
  const auto width_mm = [&] { return simulated_.with([](GripperServer &, GripperMotion &motion) { return motion.reported_width_mm(); }); };
  Random random(7, 0, 0);
  int answers = 0;
  for (int i = 0; i < 2000; i++) {
    const double late_s = std::max(0.0, random.uniform(-0.15, 0.15));
    simulated_.with([&](GripperServer &server, GripperMotion &) { server.trouble({.late_s = late_s}); });
    const double before_mm = width_mm();
    try {
      if (i % 100 == 0) {
        gripper_->move({.width_mm = i % 200 == 0 ? 0.0 : 85.0, .speed_mm_s = 20});
      } else {
        const double told_mm = gripper_->poll().width_mm, now_mm = width_mm();
        EXPECT_LE(told_mm, std::max(before_mm, now_mm) + NEAR_mm) << i;
        EXPECT_GE(told_mm, std::min(before_mm, now_mm) - NEAR_mm) << i;
        answers++;
      }
    } catch (const Error &) { // none in time
    }
  }
  EXPECT_GT(answers, 500);
}

TEST_P(GripperTest, SaysWhenItsPortIsGone) {
  served_.reset();
  for (int i = 0; i < 3; i++) {
    EXPECT_EQ(code_of([&] { gripper_->poll(); }), ErrorCode::gone);
  }
  EXPECT_EQ(code_of([&] { gripper_->move({}); }), ErrorCode::gone);
}

INSTANTIATE_TEST_SUITE_P(Models, GripperTest, ::testing::Values("2f85", "sts3215"));
