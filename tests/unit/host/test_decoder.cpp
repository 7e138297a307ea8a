#include "libfingertip/command.hpp"
#include "libfingertip/decoder.hpp"
#include "support/host_packets.hpp"

#include <gtest/gtest.h>
#include <random>

extern "C" {
#include "common/crc32.h"
}

using namespace fingertip;
using Bytes = std::vector<std::uint8_t>;

namespace {

Bytes frame(std::uint16_t sequence) { return frame_bytes(test::make_contact(sequence, 1000u * sequence, sequence)); }

Bytes joined(std::initializer_list<Bytes> parts) {
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

Result decode(const Bytes &bytes, std::size_t chunk = 4096) {
  Decoder decoder;
  Result result;
  for (std::size_t at = 0; at < bytes.size(); at += chunk) {
    decoder.feed(bytes.data() + at, std::min(chunk, bytes.size() - at),
                 [&](const wire_packet &packet) { result.sequences.push_back(packet.sequence); });
  }
  result.statistics = decoder.statistics();
  return result;
}

/* A frame such as no encoder of ours makes: one header byte altered, the CRC made right again. */
Bytes frame_with_header_byte(std::uint16_t sequence, std::size_t index, std::uint8_t value) {
  Bytes coded = frame(sequence);
  Bytes packet;
  for (std::size_t at = 0; at + 1 < coded.size(); at += coded[at]) {
    if (at > 0) {
      packet.push_back(0);
    }
    packet.insert(packet.end(), coded.begin() + static_cast<std::ptrdiff_t>(at) + 1,
                  coded.begin() + static_cast<std::ptrdiff_t>(at + coded[at]));
  }
  packet[index] = value;
  std::size_t checked = packet.size() - WIRE_CRC_BYTES;
  std::uint32_t crc = crc32_iso_hdlc(packet.data(), checked);
  for (std::size_t i = 0; i < WIRE_CRC_BYTES; i++) {
    packet[checked + i] = static_cast<std::uint8_t>(crc >> 8 * i);
  }
  coded.assign(1, 1);
  std::size_t code_at = 0;
  for (std::uint8_t byte : packet) {
    if (byte == 0) {
      code_at = coded.size();
      coded.push_back(1);
    } else {
      coded.push_back(byte);
      coded[code_at]++;
    }
  }
  coded.push_back(0);
  return coded;
}

std::uint64_t errors(const LineStatistics &statistics) {
  return statistics.crc_errors + statistics.format_errors + statistics.version_errors + statistics.unknown_types;
}

} // namespace

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

TEST(Decoder, JoiningAtAnyByteIsNoError) {
  Bytes first = frame(1);
  for (std::size_t torn = 1; torn < first.size(); torn++) {
    Bytes bytes = joined({Bytes(first.begin() + static_cast<std::ptrdiff_t>(torn), first.end()), frame(2), frame(3)});
    Result result = decode(bytes);
    EXPECT_EQ(result.sequences, (std::vector<std::uint16_t>{2, 3})) << torn;
    EXPECT_EQ(errors(result.statistics), 0u) << torn;
    EXPECT_EQ(result.statistics.dropped_packets, 0u) << torn;
  }
}

TEST(Decoder, AFlippedBitCostsOnePacketOrTwoAndIsCounted) {
  Bytes clean = joined({frame(1), frame(2), frame(3), frame(4)});
  std::size_t begin = frame(1).size();
  std::size_t end = begin + frame(2).size();
  for (std::size_t at = begin; at < end; at++) {
    for (int bit = 0; bit < 8; bit++) {
      Bytes bytes = clean;
      bytes[at] = static_cast<std::uint8_t>(bytes[at] ^ 1 << bit);
      Result result = decode(bytes);
      /* A flip into or out of 0x00 moves a frame boundary: the neighbour may go too. */
      EXPECT_GE(result.sequences.size(), 2u);
      EXPECT_LE(result.sequences.size(), 3u);
      EXPECT_EQ(result.sequences.back(), 4);
      EXPECT_GE(errors(result.statistics), 1u);
      EXPECT_EQ(result.statistics.dropped_packets + result.sequences.size(), 4u);
    }
  }
}

TEST(Decoder, AMissingByteCostsOnePacket) {
  Bytes second = frame(2);
  for (std::size_t at = 0; at + 1 < second.size(); at++) {
    Bytes torn = second;
    torn.erase(torn.begin() + static_cast<std::ptrdiff_t>(at));
    Result result = decode(joined({frame(1), torn, frame(3)}));
    EXPECT_EQ(result.sequences, (std::vector<std::uint16_t>{1, 3})) << at;
    EXPECT_EQ(errors(result.statistics), 1u) << at;
    EXPECT_EQ(result.statistics.dropped_packets, 1u) << at;
  }
}

TEST(Decoder, RepeatedAndOldPacketsAreOutOfOrderAndNoLoss) {
  Result result = decode(joined({frame(1), frame(2), frame(2), frame(3), frame(1), frame(2)}));
  EXPECT_EQ(result.sequences.size(), 6u);
  EXPECT_EQ(result.statistics.out_of_order, 2u);
  EXPECT_EQ(result.statistics.dropped_packets, 0u);
}

TEST(Decoder, InterleavedFramesAreLostAndTheNextIsFound) {
  Bytes a = frame(1), b = frame(2), mixed;
  for (std::size_t i = 0; i < a.size(); i++) {
    mixed.push_back(a[i]);
    if (i < b.size()) {
      mixed.push_back(b[i]);
    }
  }
  Result result = decode(joined({frame(0), mixed, {0}, frame(3)}));
  EXPECT_EQ(result.sequences, (std::vector<std::uint16_t>{0, 3}));
  EXPECT_GE(errors(result.statistics), 1u);
  EXPECT_EQ(result.statistics.dropped_packets, 2u);
}

TEST(Decoder, CountsGapsAcrossTheWrapOfTheSequence) {
  Result result = decode(joined({frame(65533), frame(65535), frame(2)}));
  EXPECT_EQ(result.statistics.dropped_packets, 1u + 2u);
  EXPECT_EQ(result.statistics.out_of_order, 0u);
}

TEST(Decoder, AnotherVersionAndUnknownTypesHaveCountersOfTheirOwn) {
  ASSERT_EQ(frame_with_header_byte(5, 0, WIRE_VERSION), frame(5));
  Result other_version = decode(joined({frame(4), frame_with_header_byte(5, 0, WIRE_VERSION + 1), frame(6)}));
  EXPECT_EQ(other_version.statistics.version_errors, 1u);
  EXPECT_EQ(errors(other_version.statistics), 1u);
  Result new_type = decode(joined({frame(4), frame_with_header_byte(5, 1, 0x3F), frame(6)}));
  EXPECT_EQ(new_type.statistics.unknown_types, 1u);
  EXPECT_EQ(errors(new_type.statistics), 1u);
  EXPECT_EQ(new_type.statistics.dropped_packets, 0u);
}

TEST(Decoder, AnOverlongFrameIsOneFormatError) {
  Result result = decode(joined({frame(1), Bytes(5000, 0x55), {0}, frame(2)}));
  EXPECT_EQ(result.sequences, (std::vector<std::uint16_t>{1, 2}));
  EXPECT_EQ(result.statistics.format_errors, 1u);
}

TEST(Decoder, SurvivesNoiseAndFindsWhatFollows) {
  std::mt19937 random(1);
  Bytes noise(200000);
  for (std::uint8_t &byte : noise) {
    byte = static_cast<std::uint8_t>(random());
  }
  Result result = decode(joined({noise, {0}, frame(1), frame(2)}));
  EXPECT_EQ(result.sequences, (std::vector<std::uint16_t>{1, 2}));
  EXPECT_GT(errors(result.statistics), 100u);
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
