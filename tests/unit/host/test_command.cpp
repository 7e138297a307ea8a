#include "libfingertip/command.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/names.hpp"
#include "libfingertip/text.hpp"
#include "support/host_packets.hpp"
#include "support/pad.h"

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
  EXPECT_EQ(decoded(command_keep(true)).body.cmd_keep.keep, 1);
  EXPECT_EQ(decoded(command_keep(false)).body.cmd_keep.keep, 0);
  wire_packet prior = decoded(command_prior(3.1f, 0.4f));
  EXPECT_EQ(prior.body.cmd_prior.sigma_mm, 3.1f);
  EXPECT_EQ(prior.body.cmd_prior.width_mm, 0.4f);
  EXPECT_EQ(decoded(command_location_limit(0.8f)).body.cmd_location_limit.limit_mm, 0.8f);
  EXPECT_EQ(decoded(command_erase_calibration()).type, WIRE_CMD_ERASE_CALIBRATION);
  pad_profile pad = pad_of_12_mm();
  EXPECT_EQ(decoded(command_pad(pad)).body.cmd_pad.profile.tangential[2].sd_mm, 20.39f);
  pad.force_ratio = 3;
  EXPECT_THROW(command_pad(pad), Error);
  EXPECT_EQ(decoded(command_erase_pad()).type, WIRE_CMD_ERASE_PAD);
  wire_packet calibrate = decoded(command_calibrate(test::make_calibration(), 15));
  EXPECT_EQ(calibrate.body.cmd_calibrate.sensor_count, 15);
  EXPECT_EQ(calibrate.body.cmd_calibrate.calibration.sensors[14].gain,
            test::make_calibration().sensors[14].gain);
}

TEST(Command, ACalibrationOutOfRangeIsNotSent) {
  struct calibration bad = test::make_calibration();
  bad.sensors[7].gain = 4.1f;
  EXPECT_THROW(command_calibrate(bad, 15), Error);
  EXPECT_NO_THROW(command_calibrate(bad, 7)) << "the sensor is not among them";
  EXPECT_THROW(command_calibrate(test::make_calibration(), 0), Error);
  EXPECT_THROW(command_calibrate(test::make_calibration(), 33), Error);
}

TEST(Command, PriorsAndLimitsAsTyped) {
  EXPECT_EQ(prior_text(prior_from_text("none")), "none");
  EXPECT_EQ(prior_text(prior_from_text("3.1")), "3.1:0.5");
  EXPECT_EQ(prior_text(prior_from_text("100:0.01")), "100:0.01");
  for (const char *text : {"", "x", "3.1:", ":0.5", "0", "0:0", "0.4", "101", "3:0", "3:101",
                           "3:nan", "inf", "3:0.5:1", "-3"}) {
    EXPECT_THROW(prior_from_text(text), Error) << text;
  }
  EXPECT_EQ(location_limit_mm_from_text("0.6"), 0.6f);
  for (const char *text : {"", "0", "0.009", "101", "nan", "none"}) {
    EXPECT_THROW(location_limit_mm_from_text(text), Error) << text;
  }
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
  EXPECT_EQ(flags_text(CONTACT_FLAG_TANGENTIAL_VALID | CONTACT_FLAG_SLIDING),
            "TANGENTIAL_VALID SLIDING");
  EXPECT_EQ(flags_text(1u << 25 | 1u << 31), "bit25 bit31");
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
