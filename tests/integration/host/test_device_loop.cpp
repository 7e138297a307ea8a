#include "libfingertip/device_loop.hpp"
#include "support/soft_fingertip.hpp"

#include <gtest/gtest.h>

using namespace fingertip;
using std::chrono::milliseconds;
using Kind = DeviceUpdate::Kind;

/* Its port is a link in a folder of its own. */
struct Streamer {
  test::TemporaryFolder folder;
  test::SoftFingertip fingertip{folder / "tty", "A", 10000, [] { return test::Feel{}; }};
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
    wait_until(host_now() + milliseconds(1500)); /* no updates are taken */
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

TEST(DeviceLoop, AnErrorEndsItAndIsThrownToWhoAsks) {
  Streamer streamer;
  streamer.fingertip.refuses = true;
  DeviceFeed feed;
  DeviceLoop loop(0, {"", streamer.fingertip.link(), false}, streaming(), feed);
  std::vector<Kind> kinds;
  auto patience = host_now() + std::chrono::seconds(20);
  while ((kinds.empty() || kinds.back() != Kind::ended) && host_now() < patience) {
    for (const DeviceUpdate &update : feed.take(milliseconds(100))) {
      kinds.push_back(update.kind);
      if (update.kind == Kind::ready) {
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
