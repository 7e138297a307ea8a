#include "libfingertip/recording_writer.hpp"
#include "support/host_packets.hpp"
#include "tool/cli/playback.hpp"

#include <cstdio>
#include <gtest/gtest.h>

using namespace fingertip;
using std::chrono::milliseconds;

/* A minute at 50 frames a second, in which the device restarts after half of it, two seconds after frame 1399. */
class PlaybackTest : public ::testing::Test {
protected:
  static constexpr std::uint32_t FRAMES = 3000;

  void SetUp() override {
    path_ = testing::TempDir() + "playback-" + std::to_string(getpid()) + ".csv";
    wire_packet info = test::make_info(0, 0);
    RecordingWriter writer(make_lines(path_, true, OutputFile::Appears::at_once), &info.body.info, 15, {}, true);
    std::uint16_t sequence = 0;
    for (std::uint32_t frame = 0; frame < FRAMES; frame++) {
      std::uint64_t t_us = 5000 + std::uint64_t{20000} * (frame % (FRAMES / 2) + (frame / 100 == 14 ? 100 : 0));
      writer.packet(test::make_contact(sequence++, t_us, frame));
      writer.packet(test::make_raw(sequence++, t_us, frame));
    }
    writer.finish({LineStatistics()}, "converted");
  }
  void TearDown() override { std::remove(path_.c_str()); }

  /* Lets so much time pass. */
  void pass(Playback &playback, milliseconds time) {
    for (milliseconds passed{0}; passed <= time; passed += milliseconds(20)) {
      playback.step(now_ + passed);
    }
    now_ += time;
  }
  void settle(Playback &playback) {
    for (int i = 0; i < 100; i++) {
      playback.step(now_);
    }
  }
  std::uint32_t frame_of(const Playback &playback) const { return playback.models()[0].contact()->frame; }

  std::string path_;
  HostTime now_{};
};

TEST_F(PlaybackTest, KeepsTheRecordedPace) {
  Playback playback(path_, false, "", 1);
  pass(playback, milliseconds(1000));
  EXPECT_NEAR(frame_of(playback), 50, 1);
  EXPECT_FALSE(playback.is_over());
  Playback fast(path_, false, "", 10);
  pass(fast, milliseconds(1000));
  EXPECT_NEAR(frame_of(fast), 500, 10);
}

TEST_F(PlaybackTest, ShowsNothingWhereNothingWasRecorded) {
  Playback playback(path_, false, "", 1);
  for (const bool is_there : {true, false, true}) {
    pass(playback, milliseconds(is_there ? 28000 : 1000));
    EXPECT_EQ(playback.models()[0].is_current(), is_there);
  }
}

TEST_F(PlaybackTest, SpacePausesAndGoesOn) {
  Playback playback(path_, false, "", 1);
  pass(playback, milliseconds(1000));
  playback.key(' ');
  std::uint32_t there = frame_of(playback);
  pass(playback, milliseconds(5000));
  EXPECT_EQ(frame_of(playback), there);
  EXPECT_NE(playback.caption("x").note.find("PAUSED"), std::string::npos);
  playback.key(' ');
  pass(playback, milliseconds(1000));
  EXPECT_NEAR(frame_of(playback), there + 50, 2);
}

TEST_F(PlaybackTest, SeeksToWhatPlayingShows) {
  Playback playback(path_, false, "", 1);
  pass(playback, milliseconds(42000)); /* beyond the restart */
  playback.key(' ');
  settle(playback);
  const Model there = playback.models()[0];
  playback.key(KEY_RIGHT);
  settle(playback);
  EXPECT_NEAR(frame_of(playback), there.contact()->frame + 250, 1);
  playback.key(KEY_LEFT);
  settle(playback);
  EXPECT_EQ(frame_of(playback), there.contact()->frame);
  EXPECT_EQ(playback.models()[0].frames(), there.frames());
  EXPECT_EQ(playback.models()[0].seconds(), there.seconds());
  EXPECT_EQ(playback.models()[0].samples().size(), there.samples().size());
  EXPECT_EQ(playback.models()[0].statistics().packets, there.statistics().packets);
  playback.key(KEY_HOME);
  settle(playback);
  EXPECT_EQ(frame_of(playback), 0u);
  playback.key(KEY_END);
  settle(playback);
  EXPECT_EQ(frame_of(playback), FRAMES - 1);
  EXPECT_FALSE(playback.is_over()) << "to be looked at";
  playback.key(KEY_LEFT);
  settle(playback);
  EXPECT_NEAR(frame_of(playback), FRAMES - 1 - 250, 1);
  playback.key(KEY_DOWN);
  settle(playback);
  EXPECT_EQ(frame_of(playback), 0u);
  playback.key('q');
  EXPECT_TRUE(playback.is_over());
}

TEST_F(PlaybackTest, EndsByItselfAndAsFastAsItCan) {
  Playback playback(path_, false, "", 0);
  settle(playback);
  EXPECT_TRUE(playback.is_over());
  EXPECT_EQ(playback.models()[0].frames(), FRAMES);
}
