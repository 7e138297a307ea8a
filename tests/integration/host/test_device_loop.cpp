#include "libfingertip/device_loop.hpp"
#include "support/soft_fingertip.hpp"

#include <gtest/gtest.h>

using namespace fingertip;
using std::chrono::milliseconds;
using Kind = DeviceNews::Kind;

/* Its port is a link in a folder of its own. */
struct Streamer {
  explicit Streamer(int rate_Hz = 10000) : fingertip(folder / "tty", "A", rate_Hz, [] { return test::Feel{}; }) {}

  test::TemporaryFolder folder;
  test::SoftFingertip fingertip;
};

static DeviceLoop::Options streaming() {
  DeviceLoop::Options options;
  options.streams = WIRE_STREAM_CONTACT;
  return options;
}

TEST(DeviceLoop, AFullFeedHoldsItBackAndDoesNotKeepItFromEnding) {
  Streamer streamer;
  DeviceFeed feed;
  std::uint64_t before = 0, after = 0;
  auto begun = host_now();
  {
    DeviceLoop loop(0, {"", streamer.fingertip.link(), false}, streaming(), feed);
    loop.start();
    wait_until(host_now() + milliseconds(1500)); /* no news are taken */
    before = loop.statistics().packets;
    wait_until(host_now() + milliseconds(300));
    after = loop.statistics().packets;
    begun = host_now();
  }
  EXPECT_EQ(before, after);
  EXPECT_LT(host_now() - begun, std::chrono::seconds(5));
  auto held = feed.take(milliseconds(0));
  EXPECT_GT(held.size(), 1000u);
  EXPECT_LT(held.size(), 10000u);
}

TEST(DeviceLoop, NothingOfSixteenIsLostWhileADiskStallsForTwoSeconds) {
  constexpr int PACKETS_per_s = 2 * 1308; /* contact and raw, here all of them contacts */
  DeviceFeed feed;
  std::vector<std::unique_ptr<Streamer>> streamers;
  std::vector<std::unique_ptr<DeviceLoop>> loops;
  for (std::size_t i = 0; i < 16; i++) {
    streamers.push_back(std::make_unique<Streamer>(PACKETS_per_s));
    const Way way = {"", streamers.back()->fingertip.link(), false};
    loops.push_back(std::make_unique<DeviceLoop>(i, way, streaming(), feed));
    loops.back()->start();
  }
  wait_until(host_now() + milliseconds(2100)); /* no news are taken */
  std::vector<int> taken(loops.size());
  for (const auto end = host_now() + milliseconds(400); host_now() < end;) {
    for (const DeviceNews &news : feed.take(milliseconds(20))) {
      taken[news.device] += news.kind == Kind::packet;
    }
  }
  for (std::size_t i = 0; i < loops.size(); i++) {
    EXPECT_EQ(loops[i]->statistics().dropped_packets, 0u) << i;
    EXPECT_GT(taken[i], 2 * PACKETS_per_s) << i;
  }
}

TEST(DeviceLoop, AnErrorEndsItAndIsThrownToWhoAsks) {
  Streamer streamer;
  streamer.fingertip.refuses = true;
  DeviceFeed feed;
  DeviceLoop loop(0, {"", streamer.fingertip.link(), false}, streaming(), feed);
  std::vector<Kind> kinds;
  auto patience = host_now() + std::chrono::seconds(20);
  while ((kinds.empty() || kinds.back() != Kind::ended) && host_now() < patience) {
    for (const DeviceNews &news : feed.take(milliseconds(100))) {
      kinds.push_back(news.kind);
      if (news.kind == Kind::ready) {
        loop.start();
      }
    }
  }
  ASSERT_EQ(kinds.back(), Kind::ended);
  try {
    loop.rethrow();
    FAIL();
  } catch (const Error &error) {
    EXPECT_EQ(error.code(), ErrorCode::not_now);
  }
}
