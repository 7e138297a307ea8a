#include "grasp/grasp_loop.hpp"
#include "grasp/settings.hpp"
#include "support/fake_gripper.hpp"
#include "support/soft_fingertip.hpp"

#include <gtest/gtest.h>

using namespace fingertip;
using std::chrono::milliseconds;
using Kind = GraspNews::Kind;

/* Two fingertips on ports and a gripper without a line, an object of 40 mm between. */
class GraspLoopTest : public ::testing::Test {
protected:
  static constexpr double OBJECT_mm = 40.0, STIFFNESS_N_mm = 2.0;

  test::Feel feel() {
    test::Feel feel;
    feel.force_N = static_cast<float>(std::max(0.0, STIFFNESS_N_mm * (OBJECT_mm - state_->width_mm()) / 2));
    feel.qy_N = load_N_;
    return feel;
  }
  OpenGripper open() {
    return [state = state_] { return std::make_unique<test::FakeGripper>(state); };
  }
  void begin(GraspLoop::Options options = {}) {
    loop_ = std::make_unique<GraspLoop>(std::array<Endpoint, 2>{Endpoint{"", left_.link(), false}, Endpoint{"", right_.link(), false}},
                                        options);
    const auto met = loop_->meet([] { return false; });
    EXPECT_EQ(met[0].packet.body.info.serial[0], 'A');
    EXPECT_EQ(met[1].packet.body.info.serial[0], 'B');
    auto gripper = open()();
    const GripSettings settings = settings_for(gripper->traits(), {{"cap", 10}, {"travel-cap", 20}});
    loop_->begin(std::move(gripper), open(), settings);
  }
  /* Takes news until it is so. */
  bool until(const std::function<bool(const GraspNews &)> &is_so) {
    const HostTime patience = host_now() + std::chrono::seconds(60);
    while (host_now() < patience) {
      for (GraspNews &news : loop_->take(milliseconds(20))) {
        frames_ += news.kind == Kind::device && news.device->kind == DeviceUpdate::Kind::packet && news.device->packet.type == WIRE_CONTACT;
        last_ = news.kind == Kind::step ? news : last_;
        if (is_so(news)) {
          return true;
        }
      }
    }
    ADD_FAILURE() << "waited too long in state " << int{last_.report.state} << ", trouble " << last_.report.trouble;
    return false;
  }
  bool until_state(std::uint8_t state) {
    return until([state](const GraspNews &news) { return news.kind == Kind::step && news.report.state == state; });
  }
  bool until_frames(int more) {
    const int goal = frames_ + more;
    return until([&](const GraspNews &) { return frames_ >= goal; });
  }
  /* From both fingertips' first frames. */
  bool grasp() {
    until_frames(10);
    EXPECT_TRUE(loop_->request(GRIP_REQUEST_GRASP));
    return until_state(GRIP_HOLDING);
  }
  void end() {
    loop_->end();
    until([](const GraspNews &news) { return news.kind == Kind::ended; });
    loop_->rethrow();
  }

  test::TemporaryFolder folder_;
  std::shared_ptr<test::FakeGripperState> state_ = std::make_shared<test::FakeGripperState>();
  std::atomic<float> load_N_{0};
  test::SoftFingertip left_{folder_ / "left", "AAAA", 200, [this] { return feel(); }};
  test::SoftFingertip right_{folder_ / "right", "BBBB", 200, [this] { return feel(); }};
  std::unique_ptr<GraspLoop> loop_;
  GraspNews last_{Kind::step};
  int frames_ = 0;
};

TEST_F(GraspLoopTest, InterruptsHoldAndThenOpenWithoutAnybodyTakingNews) {
  std::atomic<unsigned> interrupts{0};
  GraspLoop::Options options;
  options.interrupts = [&interrupts] { return interrupts.load(); };
  begin(options);
  ASSERT_TRUE(grasp());
  interrupts = 1;
  ASSERT_TRUE(until_state(GRIP_STILL));
  const std::size_t moves = state_->moves().size();
  load_N_ = 3.0f;
  until_frames(100);
  EXPECT_EQ(state_->moves().size(), moves) << "moves while it is to be still";
  interrupts = 2;
  wait_until(host_now() + milliseconds(300)); /* no news are taken */
  ASSERT_TRUE(until_state(GRIP_OPEN));
  EXPECT_GT(state_->width_mm(), 45.0);
  end();
}

TEST_F(GraspLoopTest, ASlowGripperDelaysNoFrame) {
  state_->delay_ms = 400;
  begin();
  until_frames(10);
  EXPECT_TRUE(loop_->request(GRIP_REQUEST_GRASP));
  const int before = state_->exchanges, frames = frames_;
  until([&](const GraspNews &) { return state_->exchanges >= before + 4; });
  EXPECT_GT(frames_ - frames, 50 * 2);
  end();
}

TEST_F(GraspLoopTest, EndsInTheMiddle) {
  begin();
  until_frames(10);
  loop_.reset(); /* ends in the middle, whatever is under way */
  EXPECT_TRUE(state_->moves().empty());
}
