#include "libfingertip/command.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/names.hpp"
#include "libfingertip/text.hpp"

#include <gtest/gtest.h>

using namespace fingertip;

namespace {

wire_packet decoded(const wire_packet &command) {
  auto bytes = frame_bytes(command);
  wire_packet packet{};
  EXPECT_EQ(wire_decode(wire_commands, bytes.data(), bytes.size() - 1, &packet), FT_OK);
  return packet;
}

} // namespace

TEST(Command, CarriesItsValue) {
  EXPECT_EQ(decoded(command_stream(7)).body.cmd_stream.streams, 7);
  EXPECT_EQ(decoded(command_rate_mHz(20000)).body.cmd_rate.rate_mHz, 20000u);
  EXPECT_EQ(decoded(command_osr(8192)).body.cmd_osr.osr, 8192);
  wire_packet slip = decoded(command_slip(0.5f, 250));
  EXPECT_EQ(slip.body.cmd_slip.threshold_mm, 0.5f);
  EXPECT_EQ(slip.body.cmd_slip.window_ms, 250);
  EXPECT_EQ(decoded(command_loader()).body.cmd_loader.magic, WIRE_LOADER_MAGIC);
}

TEST(Command, RangesEndWhereThePacketSays) {
  EXPECT_EQ(rate_mHz_from_text("max"), 0u);
  EXPECT_EQ(rate_mHz_from_text("0.1"), 100u);
  EXPECT_EQ(rate_mHz_from_text("2000"), 2000000u);
  for (const char *text : {"0", "0.099", "2000.001", "-1", "nan", "inf", "", "1e99", "20Hz"}) {
    EXPECT_THROW(rate_mHz_from_text(text), Error) << text;
  }
  for (const char *text : {"256", "512", "1024", "2048", "4096", "8192"}) {
    EXPECT_EQ(std::to_string(osr_from_text(text)), text);
  }
  for (const char *text : {"0", "128", "257", "1000", "16384", "65792", "-256", "1024.0"}) {
    EXPECT_THROW(osr_from_text(text), Error) << text;
  }
  EXPECT_EQ(slip_threshold_mm_from_text("0.01"), 0.01f);
  EXPECT_EQ(slip_threshold_mm_from_text("50"), 50.0f);
  for (const char *text : {"0.009", "50.1", "-1", "nan", "x"}) {
    EXPECT_THROW(slip_threshold_mm_from_text(text), Error) << text;
  }
  EXPECT_EQ(slip_window_ms_from_text("5"), 5u);
  EXPECT_EQ(slip_window_ms_from_text("1000"), 1000u);
  for (const char *text : {"4", "1001", "65541", "-5", "99999999999999999999"}) {
    EXPECT_THROW(slip_window_ms_from_text(text), Error) << text;
  }
}

TEST(Command, TheErrorNamesTheAllowedRange) {
  try {
    rate_mHz_from_text("3000");
    FAIL();
  } catch (const Error &error) {
    EXPECT_STREQ(error.what(), "rate 3000 is out of range; give 0.1 to 2000 Hz, or max");
  }
}

TEST(Names, StreamsBothWays) {
  EXPECT_EQ(streams_from_text("none"), 0);
  EXPECT_EQ(streams_from_text("health,contact"), WIRE_STREAM_CONTACT | WIRE_STREAM_HEALTH);
  for (std::uint8_t streams = 0; streams <= WIRE_STREAM_ALL; streams++) {
    EXPECT_EQ(streams_from_text(streams_text(streams)), streams);
  }
  EXPECT_THROW(streams_from_text("contact,"), Error);
  EXPECT_THROW(streams_from_text(""), Error);
}

TEST(Names, EveryFlagBitHasAName) {
  EXPECT_EQ(flags_text(0), "");
  EXPECT_EQ(flags_text(CONTACT_FLAG_CONTACT | CONTACT_FLAG_SLIP), "CONTACT SLIP");
  EXPECT_EQ(flags_text(1u << 7 | 1u << 31), "bit7 bit31");
}

TEST(Text, NumbersReadBackTheSame) {
  for (float value : {0.1f, 1.0e-38f, 3.4028235e38f, -5.7000003f, 16777217.0f}) {
    EXPECT_EQ(to_float(shortest(value)), value);
  }
  EXPECT_FALSE(to_float("1 "));
  EXPECT_FALSE(to_u64("-1"));
  EXPECT_FALSE(to_u64("18446744073709551616"));
  EXPECT_EQ(to_u64("18446744073709551615"), ~0ull);
}
