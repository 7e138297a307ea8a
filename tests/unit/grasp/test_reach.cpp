#include "grasp/control/reach.hpp"

#include <cmath>
#include <gtest/gtest.h>

using namespace fingertip;

constexpr double STIFFNESS_N = 2.0, POWER = 1.6; // of a pad at 1 mm: softer than is expected
constexpr double OBJECT_mm = 40.0, CAP_N = 6.0;
constexpr double PRESSED_mm = OBJECT_mm - 1.0, AIR_mm = OBJECT_mm + 1.0; // widths

static double pad_N(double width_mm) { return STIFFNESS_N * std::pow(std::max(0.5 * (OBJECT_mm - width_mm), 0.0), POWER); }

// A gripper that cannot limit its own force to the cap, between two fingertips.
class Bench {
public:
  explicit Bench(double begins_mm = PRESSED_mm) : reach(gripper_traits("2f85")), width_mm(begins_mm) {
    settings.cap_N = CAP_N;
    answer(width_mm, false, 0.3);
    reach.first_touch(t_s);
  }

  // It was sent there, and answers for so long.
  void send(double steps, bool moving = false) {
    width_mm -= steps * gripper_traits("2f85").step_mm;
    reach.send(width_mm);
    reach.approach_ends(t_s);
    answer(width_mm, moving, 0.3);
  }
  void answer(double at_mm, bool moving, double seconds) {
    for (const double end_s = t_s + seconds; t_s < end_s; t_s += 0.005) {
      GripperStatus status;
      status.host_us = std::llround(1e6 * t_s);
      status.active = true;
      status.moving = moving;
      status.width_mm = at_mm;
      reach.take(status, settings.silent_s);
    }
  }
  // Frames of both fingertips, so old, which ask for no move.
  void feel(double low_N, double high_N, double old_s = 0.006) {
    readings.fingers = readings.touches = 2;
    readings.t_s = t_s - old_s;
    readings.low_N = low_N;
    readings.high_N = high_N;
    readings.grip_N = low_N < 0.7 * high_N ? low_N : 0.5 * (low_N + high_N);
    readings.has_load = true;
    reach.aim({0.1, GripAim::Haste::patient}, readings, settings, t_s);
  }
  void feel() { feel(pad_N(width_mm), pad_N(width_mm)); }
  // How far it may close now.
  double room_mm() const { return width_mm - reach.last_below_cap_mm(readings, settings); }

  GripReach reach;
  GripSettings settings;
  GripReadings readings;
  double t_s = 1.0, width_mm;
};

static double room_of_stiff_mm() {
  Bench bench;
  bench.send(2);
  bench.feel();
  return bench.room_mm();
}

static double room_as_shown_mm() {
  Bench bench;
  bench.feel();
  bench.send(2);
  bench.feel();
  return bench.room_mm();
}

TEST(GripReach, AMoveThatBeginsAndEndsAtRestOnTheObjectShowsHowStiffItIs) {
  EXPECT_GT(room_as_shown_mm(), room_of_stiff_mm() + gripper_traits("2f85").step_mm - 1e-9);
}

// Most of such a move is in the air: it shows a contact softer than it is.
TEST(GripReach, AMoveThatBeginsBeforeBothFingertipsTouchShowsNothing) {
  const double touch_N = GripSettings().touch_N;
  Bench unseen(AIR_mm);
  unseen.send(6);
  unseen.feel();
  for (const auto &[low_N, high_N] : {std::pair(0.6 * touch_N, 0.8 * touch_N), // hardly touched
                                      std::pair(1.2 * touch_N, 1.0)}) {        // one presses
    Bench bench(AIR_mm);
    bench.feel(low_N, high_N);
    bench.send(6);
    bench.feel();
    EXPECT_EQ(bench.room_mm(), unseen.room_mm()) << low_N;
  }
}

TEST(GripReach, AMoveThatEndsOnOneFingertipShowsNothing) {
  Bench bench;
  bench.feel();
  bench.send(2);
  const double high_N = pad_N(bench.width_mm);
  bench.feel(0.4 * high_N, high_N);
  bench.feel();
  EXPECT_EQ(bench.room_mm(), room_of_stiff_mm());
}

// The force of a frame that was measured before the move had ended is less than that of its width.
TEST(GripReach, AFrameOfAMovingGripperShowsNothing) {
  for (const double stood_s : {0.0, 0.01}) {
    Bench bench;
    bench.feel();
    const double before_N = pad_N(bench.width_mm);
    bench.send(2, true);
    bench.answer(bench.width_mm, false, stood_s);
    bench.feel(1.3 * before_N, 1.3 * before_N, 0.02);
    bench.answer(bench.width_mm, false, 0.3);
    bench.feel();
    EXPECT_EQ(bench.room_mm(), room_as_shown_mm()) << stood_s;
  }
}

// A gripper that moves tells its width to a step only. Where a slide slows down, nothing less is
// added to the move under way; a load that rises is answered at once.
TEST(GripReach, NothingLessThanAStepIsAddedToAMoveThatCatchesASlide) {
  for (const bool slides : {true, false}) {
    Bench bench;
    bench.settings.cap_N = 30.0; // the gripper limits itself, so it need not wait for a move
    bench.feel();
    bench.send(2);
    bench.answer(bench.width_mm + 0.5, true, 0.1);
    bench.readings.slides = slides;
    bench.readings.t_s = bench.t_s - 0.006;
    const double sent_mm = bench.reach.target_mm();
    const double comes_N = bench.reach.coming_N(bench.readings, bench.t_s);
    const double step_N = 0.5 * bench.reach.least_move_N(comes_N);
    const double wanted_N = comes_N + 0.6 * step_N;
    bench.reach.aim({wanted_N, GripAim::Haste::usual}, bench.readings, bench.settings, bench.t_s);
    EXPECT_EQ(bench.reach.target_mm() < sent_mm, !slides);
  }
}
