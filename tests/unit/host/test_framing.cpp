#include "libfingertip/command.hpp"
#include "libfingertip/decoder.hpp"
#include "libfingertip/framing.hpp"
#include "support/host_packets.hpp"

#include <algorithm>
#include <gtest/gtest.h>

using namespace fingertip;

namespace {

Bytes body_of(std::size_t length, int pattern) {
  Bytes packet{WIRE_VERSION};
  packet.resize(WIRE_HEADER_BYTES + length);
  for (std::size_t i = 0; i < length; i++) {
    packet[WIRE_HEADER_BYTES + i] = static_cast<std::uint8_t>(pattern == 0 ? 0 : pattern == 1 ? 0xAA : i % 7);
  }
  return packet;
}

} // namespace

TEST(Framing, AgreesWithTheCodecOfTheFirmware) {
  for (wire_packet packet :
       {test::make_contact(7, 1u << 20, 3), test::make_raw(300, 5, 9, FT_MAX_SENSORS), test::make_info(1, 2),
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

TEST(Framing, DamageIsFound) {
  Bytes frame = frame_bytes(test::make_contact(7, 1000, 3));
  frame.pop_back();
  for (std::size_t i = 0; i < frame.size(); i++) {
    Bytes damaged = frame;
    damaged[i] = static_cast<std::uint8_t>(damaged[i] ^ 0x10);
    if (damaged[i] != 0) {
      EXPECT_FALSE(Envelope::opened(damaged)) << i;
    }
  }
  EXPECT_FALSE(Envelope::opened({}));
  EXPECT_FALSE(Envelope::opened({5, 1}));
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

TEST(Framing, WhatIsTooLongStaysTooLongAndNoMore) {
  Bytes line(100000, 7);
  line.push_back(0);
  FrameCutter cutter;
  std::size_t length = 0;
  cutter.feed(line.data(), line.size(), [&](const Bytes &frame, bool) { length = frame.size(); });
  EXPECT_EQ(length, static_cast<std::size_t>(WIRE_MAX_FRAME_BYTES) + 1);
}
