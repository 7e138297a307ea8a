#include "libfingertip/command.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/names.hpp"
#include "libfingertip/text.hpp"
#include "support/host_packets.hpp"
#include "support/pad.h"

#include <gtest/gtest.h>
#include <map>

using namespace fingertip;

static wire_packet decoded(const wire_packet &command) {
  auto bytes = frame_bytes(command);
  wire_packet packet{};
  EXPECT_EQ(wire_decode(wire_commands, bytes.data(), bytes.size() - 1, &packet), FT_OK);
  return packet;
}

static wire_packet set(const std::string &text) { return setting_commands({setting_from_text(text)}, {})[0]; }

TEST(Command, CarriesItsValue) {
  EXPECT_EQ(decoded(command_stream(7)).body.cmd_stream.streams, 7);
  EXPECT_EQ(decoded(set("rate=20")).body.cmd_rate.rate_mHz, 20000u);
  EXPECT_EQ(decoded(set("osr=8192")).body.cmd_osr.osr, 8192);
  EXPECT_EQ(decoded(command_loader()).body.cmd_loader.magic, WIRE_LOADER_MAGIC);
  EXPECT_EQ(decoded(command_keep(true)).body.cmd_keep.keep, 1);
  EXPECT_EQ(decoded(command_keep(false)).body.cmd_keep.keep, 0);
  wire_packet prior = decoded(set("prior=3.1:0.4"));
  EXPECT_EQ(prior.body.cmd_prior.sigma_mm, 3.1f);
  EXPECT_EQ(prior.body.cmd_prior.width_mm, 0.4f);
  EXPECT_EQ(decoded(set("limit=0.8")).body.cmd_location_limit.limit_mm, 0.8f);
  EXPECT_EQ(decoded(command_erase_calibration()).type, WIRE_CMD_ERASE_CALIBRATION);
  pad_profile pad = pad_of_12_mm();
  EXPECT_EQ(decoded(command_pad(pad)).body.cmd_pad.profile.tangential[2].sd_mm, 20.39f);
  pad.force_ratio = 3;
  EXPECT_THROW(command_pad(pad), Error);
  EXPECT_EQ(decoded(command_erase_pad()).type, WIRE_CMD_ERASE_PAD);
  wire_packet calibrate = decoded(command_calibrate(test::make_calibration(), 15));
  EXPECT_EQ(calibrate.body.cmd_calibrate.sensor_count, 15);
  EXPECT_EQ(calibrate.body.cmd_calibrate.calibration.sensors[14].gain, test::make_calibration().sensors[14].gain);
}

TEST(Command, BytesOnTheLine) {
  // COBS of version, type, sequence, time, body and CRC, worked out by zlib.crc32 and hand.
  EXPECT_EQ(hex(frame_bytes(command_tare())), "0309810101010101010101010105e56f837300");
  EXPECT_EQ(hex(frame_bytes(command_erase_pad())), "03098e0101010101010101010567e2ebc300");
  wire_packet timed = set("osr=8192");
  timed.sequence = 258;
  timed.t_us = 1;
  EXPECT_EQ(hex(frame_bytes(timed)).rfind("0609830201", 0), 0u);
  // 12 and 9 mm; COBS has a code for each zero.
  const std::string pad = hex(frame_bytes(command_pad(pad_of_12_mm())));
  const auto at = pad.find("4041");
  ASSERT_LT(at + 12, pad.size());
  EXPECT_EQ(pad.substr(at + 8, 4), "1041");
}

TEST(Command, ACalibrationOutOfRangeIsNotSent) {
  struct calibration bad = test::make_calibration();
  bad.sensors[7].gain = 4.1f;
  EXPECT_THROW(command_calibrate(bad, 15), Error);
  EXPECT_NO_THROW(command_calibrate(bad, 7)) << "the sensor is not among them";
  EXPECT_THROW(command_calibrate(test::make_calibration(), 0), Error);
  EXPECT_THROW(command_calibrate(test::make_calibration(), 33), Error);
}

/* What is typed goes through the library, Python and the page in tests/formats. */
TEST(Command, WhatOnlyTheToolTakesApart) {
  for (const char *text : {"prior=3.1:", "prior=3:0.5:1", "sync=in ", "rate", "osr"}) {
    EXPECT_THROW(setting_from_text(text), Error) << text;
  }
  EXPECT_EQ(decoded(set("prior=3.1")).body.cmd_prior.width_mm, 0.5f);
}

TEST(Command, WhatTravelsWithASettingStaysAsItIs) {
  wire_info now{};
  now.slip_threshold_mm = 0.75f;
  now.slip_window_ms = 100;
  auto commands = setting_commands({setting_from_text("slip_window=250"), setting_from_text("limit=1"), setting_from_text("limit=2")}, now);
  ASSERT_EQ(commands.size(), 2u);
  EXPECT_EQ(decoded(commands[0]).body.cmd_slip.threshold_mm, 0.75f);
  EXPECT_EQ(decoded(commands[0]).body.cmd_slip.window_ms, 250);
  EXPECT_EQ(decoded(commands[1]).body.cmd_location_limit.limit_mm, 2.0f) << "the last one counts";
  commands = setting_commands({setting_from_text("slip_threshold=1"), setting_from_text("slip_window=9")}, now);
  ASSERT_EQ(commands.size(), 1u);
  EXPECT_EQ(decoded(commands[0]).body.cmd_slip.threshold_mm, 1.0f);
  EXPECT_EQ(decoded(commands[0]).body.cmd_slip.window_ms, 9);
  EXPECT_TRUE(setting_commands({}, now).empty());
}

TEST(Command, OnlyWhatTheFirmwareHasIsShown) {
  wire_info info{};
  info.osr = 1024;
  EXPECT_EQ(settings_text(info), "rate=max osr=1024");
  info.capabilities = WIRE_CAPABILITY_FIT;
  info.location_limit_mm = 0.5f;
  EXPECT_EQ(settings_text(info), "rate=max osr=1024 prior=none limit=0.5");
  info.capabilities |= WIRE_CAPABILITY_SLIP | WIRE_CAPABILITY_SYNC;
  info.rate_mHz = 1005;
  info.slip_threshold_mm = 0.01f;
  info.slip_window_ms = 1000;
  info.prior_sigma_mm = 3.1f;
  info.prior_width_mm = 0.5f;
  info.sync = 2;
  EXPECT_EQ(settings_text(info), "rate=1.005 osr=1024 slip_threshold=0.01 slip_window=1000 prior=3.1:0.5 limit=0.5 "
                                 "sync=frame");
}

TEST(Command, TheErrorNamesTheAllowedRange) {
  const std::map<std::string, std::string> said = {
      {"rate=3000", "rate 3000 is out of range; give 0.1 to 2000 Hz, or max"},
      {"rate=x", "rate \"x\" is no number; give 0.1 to 2000 Hz, or max"},
      {"osr=x", "osr \"x\" is no whole number; give 256, 512, 1024, 2048, 4096 or 8192"},
      {"slip_threshold=0", "slip threshold 0 is out of range; give 0.01 to 50 mm"},
      {"slip_window=1001", "slip window 1001 is out of range; give 5 to 1000 ms"},
      {"prior=3:0", "prior 3:0 is out of range; give SIGMA or SIGMA:WIDTH, 0.5 to 100 and 0.01 to "
                    "100 mm, or none"},
      {"limit=x", "limit \"x\" is no number; give 0.01 to 100 mm"},
      {"gain=1", "setting \"gain=1\" is unknown; give rate=HZ|max, osr=N, slip_threshold=MM, "
                 "slip_window=MS, prior=SIGMA[:WIDTH]|none, limit=MM or sync=MODE|off"},
      {"sync=out", "sync \"out\" is unknown; give in, frame, second, or off"},
  };
  for (const auto &[text, what] : said) {
    try {
      setting_from_text(text);
      ADD_FAILURE() << text;
    } catch (const Error &error) {
      EXPECT_EQ(error.what(), what);
    }
  }
  EXPECT_EQ(settings_help(), "rate=HZ|max (0.1 to 2000), osr=256|512|1024|2048|4096|8192, "
                             "slip_threshold=MM (0.01 to 50), slip_window=MS (5 to "
                             "1000, and 160 frames at most), prior=SIGMA[:WIDTH]|none (mm, 0.5 to "
                             "100, 0.01 to 100; width 0.5), limit=MM (of "
                             "location_sd_mm, 0.01 to 100), sync=in|frame|second|off");
}

TEST(Names, StreamsHaveNames) {
  EXPECT_EQ(streams_text(0), "none");
  EXPECT_EQ(streams_text(WIRE_STREAM_ALL), "contact,raw,health");
}

TEST(Names, EveryFlagBitHasAName) {
  EXPECT_EQ(flags_text(0), "");
  EXPECT_EQ(flags_text(CONTACT_FLAG_CONTACT | CONTACT_FLAG_SLIP), "CONTACT SLIP");
  EXPECT_EQ(flags_text(CONTACT_FLAG_TANGENTIAL_VALID | CONTACT_FLAG_SLIDING), "TANGENTIAL_VALID SLIDING");
  EXPECT_EQ(flags_text(1u << 30 | 1u << 31), "bit30 bit31");
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

TEST(Printable, LeavesTextAlone) {
  for (std::string text : {"", "a b\\c~", "\u00b5\u03c3\u25cf", "\U0001F600"}) {
    EXPECT_EQ(printable(text), text);
  }
}

TEST(Printable, EscapesControlCharacters) {
  EXPECT_EQ(printable("a\n\x1b[2J\x7f"), "a\\x0a\\x1b[2J\\x7f");
  EXPECT_EQ(printable(std::string(1, '\0')), "\\x00");
  EXPECT_EQ(printable("\xc2\x9b[2J"), "\\xc2\\x9b[2J") << "the one-character CSI";
}

TEST(Printable, EscapesWhatIsNoUtf8) {
  EXPECT_EQ(printable("\xff\x80"), "\\xff\\x80");
  EXPECT_EQ(printable("\xc0\x9b"), "\\xc0\\x9b") << "overlong";
  EXPECT_EQ(printable("\xe0\x82\x9b"), "\\xe0\\x82\\x9b") << "overlong";
  EXPECT_EQ(printable("\xed\xa0\x80"), "\\xed\\xa0\\x80") << "a surrogate";
  EXPECT_EQ(printable("\xf4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80") << "beyond Unicode";
  EXPECT_EQ(printable("\xe2\x97"), "\\xe2\\x97") << "cut off";
}
