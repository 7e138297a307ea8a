#include "libfingertip/error.hpp"
#include "support/host_packets.hpp"
#include "tool/cli/live_recording.hpp"
#include "tool/cli/terminal.hpp"

#include <csignal>
#include <gtest/gtest.h>

using namespace fingertip;
using namespace std::chrono_literals;

struct Disk {
  std::chrono::milliseconds stall{0};
  std::string full_at = "-", written;
};

struct DiskSink : ByteSink {
  explicit DiskSink(Disk &of) : disk(of) {}
  void append(const void *bytes, std::size_t length) override {
    const std::string text(static_cast<const char *>(bytes), length);
    for (const HostTime until = host_now() + std::exchange(disk.stall, 0ms); host_now() < until;) {
      wait_until(until); /* a signal ends it */
    }
    if (text == disk.full_at) {
      throw Error("full");
    }
    disk.written += text;
  }
  void finish() override { disk.written += "end"; }
  const std::string &path() const override { return disk.full_at; }

  Disk &disk;
};

static void append(QueuedSink &sink, const std::string &text) { sink.append(text.data(), text.size()); }

TEST(QueuedSink, WritesWhatItHasWhenNothingMoreComes) {
  Disk disk;
  {
    QueuedSink sink(std::make_unique<DiskSink>(disk));
    for (const char *all : {"", "a", "aa"}) {
      wait_until(host_now() + 20ms);
      EXPECT_EQ(disk.written, all);
      append(sink, "a");
    }
  }
  EXPECT_EQ(disk.written, "aaa");
}

TEST(QueuedSink, TellsAnErrorEachTimeAndWritesNothingAfterIt) {
  Disk disk = {0ms, "b", ""};
  {
    QueuedSink sink(std::make_unique<DiskSink>(disk));
    for (const char *text : {"a", "b", "c"}) {
      append(sink, text);
    }
    for (int i = 0; i < 2; i++) {
      EXPECT_THROW(sink.finish(), Error);
      EXPECT_THROW(append(sink, "d"), Error);
    }
  }
  EXPECT_EQ(disk.written, "a");
}

TEST(QueuedSink, AStalledDiskHoldsUpOnlyWhatItHasNoRoomFor) {
  Disk disk = {2s, "-", ""};
  QueuedSink sink(std::make_unique<DiskSink>(disk));
  const std::string second(16 * 1308 * 640, 'x'); /* of sixteen fingertips */
  const HostTime before = host_now();
  append(sink, second);
  wait_until(before + 100ms); /* under way, and not written */
  for (int i = 0; i < 5; i++) {
    append(sink, second);
  }
  EXPECT_EQ(host_now(), before + 100ms);
  append(sink, second);
  EXPECT_GE(host_now(), before + 2s);
  sink.finish();
  EXPECT_EQ(disk.written.size(), 7 * second.size() + 3);
}

TEST(QueuedSink, ADiskThatHangsDoesNotKeepAnotherInterruptFromEndingIt) {
  catch_signals();
  static Disk disk = {1h, "-", ""};
  auto *sink = new QueuedSink(std::make_unique<DiskSink>(disk)); /* its destructor would end this program */
  append(*sink, "a");
  kill(getpid(), SIGINT);
  Thread user([until = host_now() + 3s] {
    wait_until(until);
    kill(getpid(), SIGINT);
  });
  EXPECT_THROW(sink->finish(), Interrupted);
  user.join();
}

TEST(LiveRecording, BeginsOnlyWithItsHeadOnTheDisk) {
  test::TemporaryFolder folder;
  std::vector<DeviceUpdate> ready(1, DeviceUpdate(DeviceUpdate::Kind::ready, 0));
  ready[0].packet = test::make_info(0, 0);
  for (const char *name : {"a.csv", "a.mcap"}) {
    LiveRecording recording(folder / name, true, ready, "port", 0);
    EXPECT_GT(test::contents(folder / name).size(), 800u) << name;
    const std::string full = folder / ("full_" + std::string(name));
    ASSERT_EQ(symlink("/dev/full", full.c_str()), 0);
    EXPECT_THROW(LiveRecording(full, true, ready, "port", 0), Error) << name;
  }
}
