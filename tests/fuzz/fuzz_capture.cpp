// Captures of the line; what is in one is written as a recording, and reads the same there.
#include "fuzz.h"
#include "line.hpp"
#include "packet_file.hpp"

#include <filesystem>

using namespace fingertip;

// Without what a recording has elsewhere, or not at all: commands, raw packets of another number of
// sensors, and how the firmware last ended, which only who asks is told.
static bool is_recorded(const wire_packet &packet, std::uint8_t sensors) {
  return packet.type < WIRE_CMD_STREAM && packet.type != WIRE_CRASH && (packet.type != WIRE_RAW || packet.body.raw.sensor_count == sensors);
}

// The blanks that editors may leave behind a line end none of its texts.
static fuzz::Item as_recorded(fuzz::Item item) {
  wire_info &info = item.packet.body.info;
  for (char *text : {info.serial, info.board, info.scene, info.git_hash}) {
    for (std::size_t i = WIRE_TEXT_BYTES; item.packet.type == WIRE_INFO && i-- > 0 && (text[i] == 0 || text[i] == ' ');) {
      text[i] = 0;
    }
  }
  return item;
}

static void check_recording_of(const std::vector<fuzz::Item> &items, bool raw_expected) {
  std::uint8_t sensors = 0;
  const wire_info *info = nullptr;
  for (const auto &item : items) {
    if (sensors == 0 && item.packet.type == WIRE_RAW) {
      sensors = item.packet.body.raw.sensor_count;
    }
    if (!info && item.packet.type == WIRE_INFO) {
      info = &item.packet.body.info;
    }
  }
  const std::string path = "/dev/shm/fingertip_fuzz_" + std::to_string(getpid()) + ".csv";
  RecordingWriter writer(make_lines(path, true, OutputFile::Appears::at_once), info, sensors, {}, raw_expected);
  std::vector<fuzz::Item> written;
  for (const auto &item : items) {
    if (is_recorded(item.packet, sensors)) {
      writer.packet(item.packet);
      written.push_back(as_recorded(item));
    }
  }
  writer.finish({LineStatistics()}, "end");
  PacketFile recording(path, false);
  const auto read = fuzz::rest_of(recording);
  std::filesystem::remove(path);
  FUZZ_CHECK(!recording.is_cut_short());
  FUZZ_CHECK(read.size() == written.size());
  for (std::size_t i = 0; i < read.size(); i++) {
    FUZZ_CHECK(fuzz::is_same(read[i], written[i]));
  }
}

void fuzz_one(const uint8_t *bytes, size_t length) {
  fuzz_input input = {bytes, bytes + length};
  const std::uint8_t how = fuzz_u8(&input);
  const Bytes line = fuzz::line_of(input);
  const fuzz::MemoryFile file(line.data(), line.size());
  std::vector<fuzz::Item> items;
  try {
    items = fuzz::read_twice(file.path(), how & 1, "", how >> 4);
  } catch (const Error &error) {
    FUZZ_CHECK(error.code() == ErrorCode::not_a_recording || error.code() == ErrorCode::unread_kind ||
               error.code() == ErrorCode::damaged_line || error.code() == ErrorCode::damaged_head ||
               error.code() == ErrorCode::other_format);
    return;
  }
  check_recording_of(items, how & 2);
}
