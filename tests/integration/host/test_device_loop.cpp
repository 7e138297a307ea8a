#include "libfingertip/command.hpp"
#include "libfingertip/device_loop.hpp"
#include "libfingertip/served_port.hpp"
#include "support/host_packets.hpp"

#include <atomic>
#include <chrono>
#include <gtest/gtest.h>

using namespace fingertip;
using std::chrono::milliseconds;
using Kind = DeviceNews::Kind;

namespace {

/* Answers every command on a port; while it streams, ten frames a millisecond. */
class Answering {
public:
  explicit Answering(bool refuses = false) : refuses_(refuses), port_(""), thread_([this] { run(); }) {}
  ~Answering() {
    ended_ = true;
    thread_.join();
  }
  const std::string &path() const { return port_.path(); }

private:
  void run() {
    wire_receiver receiver;
    wire_receiver_init(&receiver, wire_commands);
    while (!ended_) {
      port_.wait(host_now() + std::chrono::microseconds(streams_ ? 100 : 10000));
      std::uint8_t bytes[256];
      const std::size_t count = port_.read(bytes, sizeof bytes);
      for (std::size_t i = 0; i < count; i++) {
        wire_packet command;
        if (wire_receive(&receiver, bytes[i], &command) == FT_OK) {
          obey(command);
        }
      }
      if (streams_) {
        frame_++;
        say(test::make_contact(0, 1000u * frame_, frame_));
      }
    }
  }
  void obey(const wire_packet &command) {
    bool refused = refuses_ && command.type == WIRE_CMD_STREAM;
    say(test::make_ack(0, 1, command.type, refused ? WIRE_RESULT_NOT_NOW : WIRE_RESULT_DONE, command.sequence,
                       command.t_us));
    if (command.type == WIRE_CMD_INFO) {
      say(test::make_info(0, 1));
    } else if (command.type == WIRE_CMD_HEALTH) {
      say(test::make_health(0, 1));
    } else if (command.type == WIRE_CMD_STREAM && !refused) {
      streams_ = command.body.cmd_stream.streams;
    }
  }
  void say(wire_packet packet) {
    packet.sequence = sequence_++;
    auto bytes = frame_bytes(packet);
    for (std::size_t done = 0; done < bytes.size() && !ended_;) {
      done += port_.write(bytes.data() + done, bytes.size() - done);
      if (done < bytes.size()) {
        wait_until(host_now() + milliseconds(1));
      }
    }
  }

  bool refuses_; /* to stream */
  ServedPort port_;
  std::atomic<bool> ended_{false};
  std::uint8_t streams_ = 0;
  std::uint16_t sequence_ = 0;
  std::uint32_t frame_ = 0;
  Thread thread_;
};

DeviceLoop::Options streaming() {
  DeviceLoop::Options options;
  options.streams = WIRE_STREAM_CONTACT;
  return options;
}

} // namespace

TEST(DeviceLoop, AFullFeedHoldsItBackAndDoesNotKeepItFromEnding) {
  Answering fingertip;
  DeviceFeed feed;
  std::uint64_t before = 0, after = 0;
  auto begun = host_now();
  {
    DeviceLoop loop(0, {"", fingertip.path(), false}, streaming(), feed);
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

TEST(DeviceLoop, AnErrorEndsItAndIsThrownToWhoAsks) {
  Answering fingertip(true);
  DeviceFeed feed;
  DeviceLoop loop(0, {"", fingertip.path(), false}, streaming(), feed);
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
