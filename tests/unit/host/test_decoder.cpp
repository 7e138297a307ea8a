#include "libfingertip/command.hpp"
#include "libfingertip/decoder.hpp"
#include "libfingertip/framing.hpp"
#include "support/host_packets.hpp"

#include <algorithm>
#include <gtest/gtest.h>

using namespace fingertip;

static Bytes frame(std::uint16_t sequence) { return frame_bytes(test::make_contact(sequence, 1000u * sequence, sequence)); }

static Bytes joined(std::initializer_list<Bytes> parts) {
  Bytes all;
  for (const Bytes &part : parts) {
    all.insert(all.end(), part.begin(), part.end());
  }
  return all;
}

struct Result {
  std::vector<std::uint16_t> sequences;
  LineStatistics statistics;
};

static Result decode(const Bytes &bytes, std::size_t chunk = 4096) {
  Decoder decoder;
  Result result;
  for (std::size_t at = 0; at < bytes.size(); at += chunk) {
    decoder.feed(bytes.data() + at, std::min(chunk, bytes.size() - at),
                 [&](const wire_packet &packet) { result.sequences.push_back(packet.sequence); });
  }
  result.statistics = decoder.statistics();
  return result;
}

static Bytes body_of(std::size_t length, int pattern) {
  Bytes packet{WIRE_VERSION};
  packet.resize(WIRE_HEADER_BYTES + length);
  for (std::size_t i = 0; i < length; i++) {
    packet[WIRE_HEADER_BYTES + i] = static_cast<std::uint8_t>(pattern == 0 ? 0 : pattern == 1 ? 0xAA : i % 7);
  }
  return packet;
}

static std::uint64_t errors(const LineStatistics &statistics) {
  return statistics.crc_errors + statistics.format_errors + statistics.version_errors + statistics.unknown_types;
}

/* Versions, types, damage, noise and what is too long: the streams of tests/formats have them, also for Python. */
TEST(Decoder, FindsPacketsHoweverTheBytesArePartitioned) {
  Bytes bytes = joined({frame(7), frame(8), {0, 0}, frame(9)});
  for (std::size_t chunk : {std::size_t{1}, std::size_t{3}, std::size_t{17}, bytes.size()}) {
    Result result = decode(bytes, chunk);
    EXPECT_EQ(result.sequences, (std::vector<std::uint16_t>{7, 8, 9}));
    EXPECT_EQ(errors(result.statistics), 0u);
    EXPECT_EQ(result.statistics.dropped_packets, 0u);
    EXPECT_EQ(result.statistics.bytes, bytes.size());
  }
}

TEST(Decoder, AfterARestartAnySequenceIsFine) {
  Decoder decoder;
  auto feed = [&](const Bytes &bytes) { decoder.feed(bytes.data(), bytes.size(), [](const wire_packet &) {}); };
  feed(frame(1000));
  Bytes torn = frame(1001);
  torn.resize(torn.size() / 2);
  feed(torn);
  decoder.restart();
  feed(frame(3));
  EXPECT_EQ(decoder.statistics().packets, 2u);
  EXPECT_EQ(errors(decoder.statistics()), 0u);
  EXPECT_EQ(decoder.statistics().dropped_packets + decoder.statistics().out_of_order, 0u);
}

TEST(Framing, AgreesWithTheCodecOfTheFirmware) {
  for (wire_packet packet : {test::make_contact(7, 1u << 20, 3), test::make_raw(300, 5, 9, FT_MAX_SENSORS), test::make_info(1, 2),
                             test::make_health(0xFFFF, 3), test::make_ack(0, 1, 0x80, 0, 2, 3)}) {
    Bytes frame = frame_bytes(packet);
    auto envelope = Envelope::opened(Bytes(frame.begin(), frame.end() - 1));
    ASSERT_TRUE(envelope);
    EXPECT_EQ(envelope->version(), WIRE_VERSION);
    EXPECT_EQ(envelope->type(), packet.type);
    EXPECT_EQ(envelope->sequence(), packet.sequence);
    Bytes again;
    envelope->append_frame(again);
    EXPECT_EQ(again, frame);
    packet.sequence = 0;
    envelope->set_sequence(0);
    again.clear();
    envelope->append_frame(again);
    EXPECT_EQ(again, frame_bytes(packet));
  }
}

TEST(Framing, AnyLengthComesBackAsItWas) {
  for (std::size_t length = 0; length < 600; length++) {
    for (int pattern : {0, 1, 2}) {
      Bytes packet = body_of(length, pattern);
      Bytes frame;
      Envelope(packet).append_frame(frame);
      ASSERT_EQ(std::count(frame.begin(), frame.end(), 0), 1);
      frame.pop_back();
      auto envelope = Envelope::opened(frame);
      ASSERT_TRUE(envelope) << length << " " << pattern;
      ASSERT_EQ(Bytes(envelope->body(), envelope->body() + envelope->body_length()),
                Bytes(packet.begin() + WIRE_HEADER_BYTES, packet.end()));
    }
  }
}

TEST(Framing, CutsAtDelimitersHoweverTheBytesCome) {
  Bytes line = {9, 9, 0, 0, 1, 2, 0, 3, 0, 4};
  for (std::size_t step : {1u, 3u, 10u}) {
    FrameCutter cutter;
    std::vector<std::pair<Bytes, bool>> frames;
    for (std::size_t at = 0; at < line.size(); at += step) {
      cutter.feed(line.data() + at, std::min(step, line.size() - at), [&](const Bytes &frame, bool joining) {
        frames.push_back({frame, joining});
      });
    }
    EXPECT_EQ(frames, (std::vector<std::pair<Bytes, bool>>{{{9, 9}, true}, {{1, 2}, false}, {{3}, false}}));
  }
}
