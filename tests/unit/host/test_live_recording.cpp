#include "libfingertip/line_source.hpp"
#include "support/host_packets.hpp"
#include "tool/cli/live_recording.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

using namespace fingertip;

/* A pipe of one page is the disk: no one reads it until two seconds are recorded. */
static void record_while_it_stalls(std::size_t devices, const std::string &name) {
  constexpr std::uint32_t FRAMES = 2 * 1308;
  test::TemporaryFolder folder;
  const std::string path = folder / name;
  mkfifo(path.c_str(), 0600);
  const int pipe = open(path.c_str(), O_RDONLY | O_NONBLOCK);
  fcntl(pipe, F_SETPIPE_SZ, 4096);
  Wake goes_on;
  bool went_on = false;
  std::string written;
  Thread disk([&] {
    went_on = goes_on.wait(host_now() + std::chrono::seconds(20));
    written = test::contents(path);
  });
  std::vector<DeviceNews> ready;
  for (std::size_t i = 0; i < devices; i++) {
    ready.emplace_back(DeviceNews::Kind::ready, i).packet = test::make_info(0, 0);
    ready[i].packet.body.info.serial[0] = static_cast<char>('A' + i);
  }
  {
    LiveRecording recording(path, true, ready, "port", 0);
    for (std::uint32_t frame = 0; frame < FRAMES; frame++) {
      for (DeviceNews &news : ready) {
        news.host_us = 1e6 * frame / 1308;
        news.packet = test::make_raw(0, static_cast<std::uint64_t>(news.host_us), frame);
        recording.packet(news);
      }
      recording.writer().settle(ready[0].host_us);
    }
    goes_on.set();
    recording.finish(std::vector<LineStatistics>(devices), "stopped");
  }
  disk.join();
  close(pipe);
  EXPECT_TRUE(went_on) << name << ": recording waits for the disk";
  const std::string copy = folder / ("copy_" + name);
  std::ofstream(copy, std::ios::binary) << written;
  const auto lines = open_lines(copy);
  std::size_t frames = 0;
  for (LineSource::Line line; lines->next(line);) {
    frames += line.text[0] != '#' && line.text.find("frame") == std::string::npos;
  }
  EXPECT_EQ(frames, FRAMES * devices) << name;
}

TEST(LiveRecording, NothingOfManyIsLostWhileADiskStallsForTwoSeconds) {
  for (std::size_t devices : {1, 16}) {
    record_while_it_stalls(devices, "a.csv");
    record_while_it_stalls(devices, "a.mcap");
  }
}
