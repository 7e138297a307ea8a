#include "grasp/gripper_thread.hpp"
#include "support/fake_gripper.hpp"

#include <functional>
#include <gtest/gtest.h>

using namespace fingertip;
using std::chrono::milliseconds;

class GripperThreadTest : public ::testing::Test {
protected:
  static constexpr std::chrono::seconds PATIENCE{20};

  OpenGripper open() {
    return [state = state_] { return std::make_unique<test::FakeGripper>(state); };
  }
  /* Takes news until one of them is so. */
  bool comes(GripperThread &thread, const std::function<bool(const GripperThread::News &)> &is_so) {
    for (const HostTime patience = host_now() + PATIENCE; host_now() < patience; pass()) {
      for (const GripperThread::News &news : thread.take()) {
        all_.push_back(news);
        if (is_so(news)) {
          return true;
        }
      }
    }
    return false;
  }
  static void pass(milliseconds time = milliseconds(1)) { wait_until(host_now() + time); }
  static bool is_answer(const GripperThread::News &news) { return news.status.has_value(); }
  static bool is_trouble(const GripperThread::News &news) { return !news.status; }

  std::shared_ptr<test::FakeGripperState> state_ = std::make_shared<test::FakeGripperState>();
  std::vector<GripperThread::News> all_;
};

TEST_F(GripperThreadTest, TheNewestCommandGoesOutOnceAndAnswersComeBack) {
  state_->delay_ms = 5;
  GripperThread thread(open()(), open());
  EXPECT_TRUE(comes(thread, is_answer));
  for (const double width_mm : {40.0, 39.0, 38.0}) {
    thread.command({width_mm, 50.0, 0.0, GRIP_MOVE});
  }
  const HostTime patience = host_now() + PATIENCE;
  while (!thread.is_done() && host_now() < patience) {
    pass();
  }
  EXPECT_TRUE(thread.is_done());
  EXPECT_TRUE(comes(thread, [](const auto &news) { return news.status && news.status->width_mm < 50; }));
  for (int i = 0; i < 5; i++) {
    thread.command({38.0, 50.0, 0.0, GRIP_MOVE}); /* the same */
    EXPECT_TRUE(comes(thread, is_answer));
  }
  const auto moves = state_->moves();
  ASSERT_GE(moves.size(), 1u);
  EXPECT_LE(moves.size(), 3u);
  EXPECT_EQ(moves.back().width_mm, 38.0);
  EXPECT_EQ(state_->activations, 0);
  /* staying sends nothing */
  const std::size_t before = moves.size();
  thread.command({.width_mm = 10000});
  EXPECT_TRUE(comes(thread, is_answer));
  EXPECT_EQ(state_->moves().size(), before);
}

TEST_F(GripperThreadTest, ActivatesOnceForEachCommand) {
  GripperThread thread(open()(), open());
  for (int i = 0; i < 10; i++) {
    thread.command({.motion = GRIP_ACTIVATE});
    EXPECT_TRUE(comes(thread, is_answer));
  }
  EXPECT_EQ(state_->activations, 1);
}

TEST_F(GripperThreadTest, SilenceIsToldOnceAndTheNewestCommandWaitsForTheEndOfIt) {
  GripperThread thread(open()(), open());
  EXPECT_TRUE(comes(thread, is_answer));
  state_->silent = true;
  EXPECT_TRUE(comes(thread, is_trouble));
  thread.command({30.0, 50.0, 0.0, GRIP_MOVE});
  thread.command({20.0, 50.0, 0.0, GRIP_MOVE});
  const int before = state_->exchanges;
  while (state_->exchanges < before + 20) {
    pass();
  }
  EXPECT_FALSE(thread.is_done());
  EXPECT_EQ(thread.take().size(), 0u) << "told again";
  state_->silent = false;
  EXPECT_TRUE(comes(thread, is_answer));
  EXPECT_TRUE(comes(thread, [&](const auto &) { return !state_->moves().empty(); }));
  EXPECT_EQ(state_->moves().size(), 1u);
  EXPECT_EQ(state_->moves().back().width_mm, 20.0);
}

TEST_F(GripperThreadTest, APortThatVanishedIsOpenedAgainWhereItIsBack) {
  GripperThread thread(open()(), open());
  EXPECT_TRUE(comes(thread, is_answer));
  EXPECT_EQ(state_->opened, 1);
  state_->unplugged = true;
  EXPECT_TRUE(comes(thread, is_trouble));
  const int before = state_->exchanges;
  while (state_->exchanges < before + 3) {
    pass(); /* attempts to open it */
  }
  state_->unplugged = false;
  EXPECT_TRUE(comes(thread, is_answer));
  EXPECT_EQ(state_->opened, 2);
  EXPECT_EQ(state_->activations, 0);
}

TEST_F(GripperThreadTest, AFaultIsExplained) {
  state_->fault = 9;
  GripperThread thread(open()(), open());
  EXPECT_TRUE(
      comes(thread, [](const auto &news) { return news.status && news.status->fault == 9 && news.trouble == "fault 9, text of 9"; }));
}

TEST_F(GripperThreadTest, ThatNobodySpokeToItIsToldAndNoFault) {
  state_->was_left_alone = true;
  GripperThread thread(open()(), open());
  EXPECT_TRUE(
      comes(thread, [](const auto &news) { return news.status && news.status->fault == 0 && news.trouble == "no command for a second"; }));
  state_->was_left_alone = false;
  EXPECT_TRUE(comes(thread, [](const auto &news) { return news.status && news.trouble.empty(); }));
}

TEST_F(GripperThreadTest, EndsWhileTheLineIsSlow) {
  state_->delay_ms = 30;
  {
    GripperThread thread(open()(), open());
    thread.command({30.0, 50.0, 0.0, GRIP_MOVE});
  }
  const int after = state_->exchanges;
  pass(milliseconds(100));
  EXPECT_EQ(state_->exchanges, after) << "goes on after its end";
}
