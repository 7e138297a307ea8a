#include "libfingertip/command.hpp"
#include "libfingertip/device_loop.hpp"
#include "support/host_packets.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <thread>
#include <unistd.h>

using namespace fingertip;
using std::chrono::milliseconds;
using Kind = DeviceNews::Kind;

namespace {

/* Answers every command on a pseudo-terminal; while it streams, frames as fast as they are read. */
class Answering {
public:
  explicit Answering(bool refuses = false) : refuses_(refuses) {
    master_ = posix_openpt(O_RDWR | O_NOCTTY);
    grantpt(master_);
    unlockpt(master_);
    path_ = ptsname(master_);
    slave_ = open(path_.c_str(), O_RDWR | O_NOCTTY); /* so that the master does not hang up */
    fcntl(master_, F_SETFL, O_NONBLOCK);
    thread_ = std::thread([this] { run(); });
  }
  ~Answering() {
    ended_ = true;
    thread_.join();
    close(slave_);
    if (master_ >= 0) {
      close(master_);
    }
  }
  const std::string &path() const { return path_; }

private:
  void run() {
    wire_receiver receiver;
    wire_receiver_init(&receiver, wire_commands);
    while (!ended_) {
      pollfd waiting = {master_, POLLIN, 0};
      if (poll(&waiting, 1, streams_ ? 0 : 10) > 0) {
        std::uint8_t bytes[256];
        ssize_t count = read(master_, bytes, sizeof bytes);
        for (ssize_t i = 0; i < count; i++) {
          wire_packet command;
          if (wire_receive(&receiver, bytes[i], &command) == FT_OK) {
            obey(command);
          }
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
    say(test::make_ack(0, 1, command.type, refused ? WIRE_RESULT_NOT_NOW : WIRE_RESULT_DONE,
                       command.sequence, command.t_us));
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
      ssize_t count = write(master_, bytes.data() + done, bytes.size() - done);
      done += static_cast<std::size_t>(std::max<ssize_t>(count, 0));
      if (count < 0) {
        std::this_thread::sleep_for(milliseconds(1));
      }
    }
  }

  bool refuses_; /* to stream */
  int master_, slave_;
  std::string path_;
  std::atomic<bool> ended_{false};
  std::uint8_t streams_ = 0;
  std::uint16_t sequence_ = 0;
  std::uint32_t frame_ = 0;
  std::thread thread_;
};

DeviceLoop::Options streaming() {
  DeviceLoop::Options options;
  options.streams = WIRE_STREAM_CONTACT;
  return options;
}

} // namespace

TEST(DeviceLoop, FromTheFirstAnswerToTheEndNoPacketIsMissing) {
  Answering fingertip;
  DeviceFeed feed;
  DeviceLoop loop(3, {"", fingertip.path(), false}, streaming(), feed);
  std::vector<std::uint16_t> sequences;
  bool ready = false, ended = false;
  auto patience = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (!ended && std::chrono::steady_clock::now() < patience) {
    for (const DeviceNews &news : feed.take(milliseconds(20))) {
      EXPECT_EQ(news.device, 3u);
      EXPECT_FALSE(ended) << "news after the last";
      if (news.kind == Kind::packet) {
        sequences.push_back(news.packet.sequence);
      } else if (news.kind == Kind::ready) {
        EXPECT_FALSE(ready);
        ready = true;
        EXPECT_EQ(news.packet.sequence, sequences.back()) << "the last packet before it";
        EXPECT_EQ(news.health.sensors_present, 0x7FFFu);
        loop.start();
      }
      ended = news.kind == Kind::ended;
    }
    if (sequences.size() > 500) {
      loop.stop();
    }
  }
  EXPECT_TRUE(ready);
  EXPECT_TRUE(ended);
  loop.rethrow();
  for (std::size_t i = 1; i < sequences.size(); i++) {
    ASSERT_EQ(sequences[i], static_cast<std::uint16_t>(sequences[i - 1] + 1));
  }
  EXPECT_EQ(loop.statistics().packets, sequences.size());
}

TEST(DeviceLoop, AFullFeedHoldsItBackAndDoesNotKeepItFromEnding) {
  Answering fingertip;
  DeviceFeed feed;
  std::uint64_t before = 0, after = 0;
  auto begun = std::chrono::steady_clock::now();
  {
    DeviceLoop loop(0, {"", fingertip.path(), false}, streaming(), feed);
    loop.start();
    std::this_thread::sleep_for(milliseconds(1500)); /* nobody takes */
    before = loop.statistics().packets;
    std::this_thread::sleep_for(milliseconds(300));
    after = loop.statistics().packets;
    begun = std::chrono::steady_clock::now();
  }
  EXPECT_EQ(before, after);
  EXPECT_LT(std::chrono::steady_clock::now() - begun, std::chrono::seconds(5));
  auto held = feed.take(milliseconds(0));
  EXPECT_GT(held.size(), 1000u);
  EXPECT_LT(held.size(), 10000u);
}

TEST(DeviceLoop, AnErrorEndsItAndIsThrownToWhoAsks) {
  Answering fingertip(true);
  DeviceFeed feed;
  DeviceLoop loop(0, {"", fingertip.path(), false}, streaming(), feed);
  std::vector<Kind> kinds;
  auto patience = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while ((kinds.empty() || kinds.back() != Kind::ended) &&
         std::chrono::steady_clock::now() < patience) {
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
