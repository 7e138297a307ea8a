// The wire codec, in C and in C++: whatever comes down a line.
#include "fuzz.h"
#include "libfingertip/decoder.hpp"
#include "line.hpp"

#include <vector>

using namespace fingertip;

struct Heard {
  std::vector<Bytes> packets; // encoded again
  LineStatistics statistics;
};

// In pieces of these lengths, over and over.
static Heard decoded(const Bytes &line, const std::vector<std::size_t> &pieces) {
  Decoder decoder;
  Heard heard;
  for (std::size_t at = 0, i = 0; at < line.size(); i++) {
    const std::size_t length = std::min(pieces[i % pieces.size()], line.size() - at);
    decoder.feed(line.data() + at, length, [&](const wire_packet &packet) { heard.packets.push_back(fuzz::encoded(packet)); });
    at += length;
  }
  heard.statistics = decoder.statistics();
  return heard;
}

// What C++ opens, C decodes, and both stuff alike.
static void check_frame(const Bytes &frame, LineStatistics &statistics) {
  const auto envelope = Envelope::opened(frame);
  if (frame.size() > WIRE_MAX_FRAME_BYTES) {
    statistics.format_errors++;
    return;
  }
  Bytes copy = frame;
  wire_packet packet;
  const ft_status status = wire_decode(wire_all_layouts, copy.data(), copy.size(), &packet);
  FUZZ_CHECK(envelope || status == FT_ERR_FORMAT || status == FT_ERR_CRC);
  FUZZ_CHECK(!envelope || status != FT_ERR_CRC);
  statistics.packets += status == FT_OK;
  statistics.crc_errors += status == FT_ERR_CRC;
  statistics.format_errors += status == FT_ERR_FORMAT;
  statistics.version_errors += status == FT_ERR_VERSION;
  statistics.unknown_types += status == FT_ERR_TYPE;
  if (!envelope) {
    return;
  }
  FUZZ_CHECK((status == FT_ERR_VERSION) == (envelope->version() != WIRE_VERSION));
  Bytes again;
  envelope->append_frame(again);
  FUZZ_CHECK(again.back() == 0);
  if (status == FT_OK) {
    FUZZ_CHECK(packet.type == envelope->type() && packet.sequence == envelope->sequence());
    FUZZ_CHECK(fuzz::encoded(packet) == again);
  }
}

void fuzz_one(const uint8_t *bytes, size_t length) {
  fuzz_input input = {bytes, bytes + length};
  const std::vector<std::size_t> pieces = {1 + fuzz_u8(&input) % 67u, 1 + fuzz_u16(&input) % 4099u};
  const Bytes line = fuzz::line_of(input);
  const Heard whole = decoded(line, {line.size() + 1}), cut = decoded(line, pieces);
  FUZZ_CHECK(whole.packets == cut.packets);
  FUZZ_CHECK(whole.statistics.text() == cut.statistics.text());
  LineStatistics counted;
  FrameCutter cutter;
  const auto take = [&](const Bytes &frame, bool joining) {
    LineStatistics before = counted;
    check_frame(frame, counted);
    if (joining) { // its damage counts as nothing
      counted.crc_errors = before.crc_errors;
      counted.format_errors = before.format_errors;
    }
  };
  cutter.feed(line.data(), line.size(), take);
  FUZZ_CHECK(counted.packets == whole.packets.size());
  FUZZ_CHECK(counted.packets == whole.statistics.packets);
  FUZZ_CHECK(counted.crc_errors == whole.statistics.crc_errors);
  FUZZ_CHECK(counted.format_errors == whole.statistics.format_errors);
  FUZZ_CHECK(counted.version_errors == whole.statistics.version_errors);
  FUZZ_CHECK(counted.unknown_types == whole.statistics.unknown_types);
}
