#include "libfingertip/packet_fields.hpp"
#include "support/host_packets.hpp"
#include "tool/doctor/judge.hpp"

#include <gtest/gtest.h>

namespace {

using namespace fingertip;

constexpr unsigned SENSORS = 15;

void set_board(Facts &facts, const char *board) {
  std::memset(facts.info->board, 0, sizeof facts.info->board);
  std::strcpy(facts.info->board, board);
}

/* A fingertip with which all is well, at rest for ten seconds. */
Facts good(const char *board = "pico_mux") {
  Facts facts;
  facts.tool_version = {1, 20, 3};
  facts.rule = "/etc/udev/rules.d/60-fingertip.rules";
  facts.port = "/dev/ttyACM0";
  facts.info = test::make_info(0, 0).body.info;
  set_board(facts, board);
  facts.info->osr = 1024;
  facts.info->rate_mHz = 0;
  wire_health health{};
  health.uptime_s = 60;
  health.sensors_present = 0x7FFF;
  health.cpu_busy_permille = 40;
  health.stack_free_bytes = FT_STACK_RESERVED_bytes - FT_STACK_USED_MAX_bytes;
  facts.before = health;
  health.uptime_s = 70;
  facts.after = health;
  Rest rest;
  rest.seconds = 10;
  rest.frames_made = static_cast<std::uint32_t>(*expected_rate_Hz(*facts.info) * 10);
  rest.frames_received = rest.frames_made + 1;
  rest.last_flags = CONTACT_FLAG_TARED;
  SensorAtRest sensor;
  sensor.readings = rest.frames_made;
  sensor.valid_share = 1;
  sensor.mean_Pa = 101325;
  sensor.noise_Pa = 3.9;
  sensor.drift = Slope{0.05, 0.03};
  rest.sensors.assign(SENSORS, sensor);
  rest.common_drift = Slope{-0.02, 0.01};
  facts.rest = rest;
  facts.line.packets = 4000;
  return facts;
}

std::vector<Finding> wrong(const Facts &facts) {
  std::vector<Finding> findings;
  for (const Finding &finding : judge(facts)) {
    EXPECT_EQ(finding.verdict == Verdict::ok, finding.advice.empty()) << finding.text;
    EXPECT_EQ(finding.text.find('\n'), std::string::npos);
    if (finding.verdict != Verdict::ok) {
      findings.push_back(finding);
    }
  }
  return findings;
}

/* The only thing that is wrong. */
Finding only(const Facts &facts, Verdict verdict, const std::string &check) {
  auto findings = wrong(facts);
  std::string all;
  for (const Finding &finding : findings) {
    all += finding.check + ": " + finding.text + "\n";
  }
  EXPECT_EQ(findings.size(), 1u) << all;
  if (findings.empty()) {
    return {Verdict::ok, "", "", "", {}};
  }
  EXPECT_EQ(findings[0].verdict, verdict) << all;
  EXPECT_EQ(findings[0].check, check) << all;
  EXPECT_EQ(worst_of(judge(facts)), verdict);
  return findings[0];
}

bool contains(const std::string &text, const std::string &part) { return text.find(part) != std::string::npos; }

void fail(Facts &facts, ErrorCode code, const std::string &text) {
  facts.failure = Failure{code, text};
  facts.info.reset();
  facts.before.reset();
  facts.after.reset();
  facts.rest.reset();
}

} // namespace

TEST(Judge, EdgesOfASyncPinThatStampsThem) {
  Facts facts = good();
  facts.rest->edges = 600;
  EXPECT_TRUE(wrong(facts).empty());
  for (const Finding &finding : judge(facts)) {
    EXPECT_NE(finding.check, "sync"); /* it is not set */
  }
  facts.info->sync = 2; /* pulses at each frame, which are no packets */
  EXPECT_EQ(judge(facts).size(), judge(good()).size());
  facts.info->sync = 1;
  EXPECT_TRUE(wrong(facts).empty());
  EXPECT_EQ(judge(facts).size(), judge(good()).size() + 1);
  facts.rest->edges_missing = 3;
  EXPECT_EQ(only(facts, Verdict::warn, "sync").text, "600 edges at the sync pin in 10.0 s, 3 missing");
  facts.rest->edges = facts.rest->edges_missing = 0;
  const Finding silent = only(facts, Verdict::warn, "sync");
  EXPECT_EQ(silent.text, "0 edges at the sync pin in 10.0 s");
  EXPECT_NE(silent.advice.find("set sync=off"), std::string::npos);
}

TEST(Judge, NothingIsWrongWithAGoodOne) {
  for (const char *board : {"pico_mux", "pico_parallel"}) {
    auto findings = wrong(good(board));
    EXPECT_TRUE(findings.empty()) << findings[0].text;
    EXPECT_EQ(worst_of(judge(good(board))), Verdict::ok);
    EXPECT_GE(judge(good(board)).size(), 15u);
  }
}

TEST(Judge, MissingRule) {
  Facts facts = good();
  facts.rule.clear();
  only(facts, Verdict::warn, "rule");
  fail(facts, ErrorCode::permission_denied, "/dev/ttyACM0: permission denied");
  auto findings = wrong(facts);
  ASSERT_EQ(findings.size(), 2u);
  EXPECT_EQ(findings[0].check, "rule");
  EXPECT_EQ(findings[0].verdict, Verdict::bad);
  EXPECT_EQ(findings[1].check, "port");
}

TEST(Judge, PermissionDeniedDespiteTheRule) {
  Facts facts = good();
  fail(facts, ErrorCode::permission_denied, "/dev/ttyACM0: permission denied");
  EXPECT_TRUE(contains(only(facts, Verdict::bad, "port").advice, "plugdev"));
}

TEST(Judge, PortInUseNamesItsHolder) {
  Facts facts = good();
  facts.holders.seen = {{123, "screen"}};
  EXPECT_TRUE(contains(only(facts, Verdict::warn, "port").text, "screen (process 123)"));
  fail(facts, ErrorCode::port_in_use, "/dev/ttyACM0: in use by another program");
  EXPECT_TRUE(contains(only(facts, Verdict::bad, "port").text, "screen (process 123)"));
  facts.holders = {{}, false};
  EXPECT_TRUE(contains(only(facts, Verdict::bad, "port").advice, "sudo"));
}

TEST(Judge, NoFingertip) {
  Facts facts;
  facts.rule = "/etc/udev/rules.d/60-fingertip.rules";
  fail(facts, ErrorCode::no_fingertip, "no fingertip found");
  only(facts, Verdict::bad, "port");
}

TEST(Judge, OtherProtocolOrNoAnswer) {
  for (ErrorCode code : {ErrorCode::other_version, ErrorCode::no_answer}) {
    Facts facts = good();
    fail(facts, code, "/dev/ttyACM0: ...");
    only(facts, Verdict::bad, "protocol");
  }
}

TEST(Judge, OtherFirmware) {
  Facts facts = good();
  facts.tool_version = {1, 20, 4};
  auto finding = only(facts, Verdict::warn, "firmware");
  EXPECT_TRUE(contains(finding.text, "1.20.3") && contains(finding.text, "1.20.4"));
}

TEST(Judge, UnknownBoardHasNoPins) {
  Facts facts = good();
  set_board(facts, "native");
  only(facts, Verdict::warn, "board");
  facts.after->sensors_present &= ~(1u << 4);
  EXPECT_TRUE(contains(wrong(facts)[1].text, "sensor 4 does not answer"));
}

TEST(Judge, MissingSensorWithItsPlace) {
  Facts facts = good();
  facts.after->sensors_present &= ~(1u << 7);
  facts.rest->sensors[7] = {};
  auto finding = only(facts, Verdict::bad, "sensors");
  EXPECT_EQ(finding.sensors, std::vector<unsigned>{7});
  EXPECT_TRUE(contains(finding.text, "strip 1, channel 2 of multiplexer 0x71"));
  facts = good("pico_parallel");
  facts.after->sensors_present &= ~(1u << 7);
  finding = only(facts, Verdict::bad, "sensors");
  EXPECT_TRUE(contains(finding.text, "GP7 (pin 10)"));
}

TEST(Judge, StripsOfOneBoardFailAsAWhole) {
  Facts facts = good();
  facts.after->sensors_present &= ~0x7C00u;
  auto finding = only(facts, Verdict::bad, "sensors");
  EXPECT_TRUE(contains(finding.text, "multiplexer 0x72 does not answer"));
  EXPECT_EQ(finding.sensors.size(), 5u);
  facts.after->bus_timeouts = facts.before->bus_timeouts = 3;
  EXPECT_TRUE(contains(only(facts, Verdict::bad, "sensors").text, "held low"));
  facts = good("pico_parallel");
  facts.after->sensors_present &= ~0x7C00u;
  EXPECT_EQ(wrong(facts).size(), 5u);
}

TEST(Judge, NoSensorAnswers) {
  Facts facts = good();
  facts.after->sensors_present = 0;
  auto finding = only(facts, Verdict::bad, "sensors");
  EXPECT_EQ(finding.sensors.size(), SENSORS);
  EXPECT_TRUE(contains(finding.advice, "SCL on GP5 (pin 7)"));
}

TEST(Judge, SensorThatAnswersNowAndThen) {
  Facts facts = good();
  facts.rest->sensors[2].valid_share = 0.991;
  EXPECT_TRUE(wrong(facts).empty());
  facts.rest->sensors[2].valid_share = 0.95;
  EXPECT_EQ(only(facts, Verdict::warn, "sensors").sensors, std::vector<unsigned>{2});
}

TEST(Judge, DoubtfulSaturatedAndApart) {
  Facts facts = good();
  facts.rest->sensors[2].doubtful_share = 0.2;
  EXPECT_TRUE(contains(only(facts, Verdict::warn, "sensors").text, "temperature"));
  facts = good();
  facts.rest->sensors[2].saturated_share = 0.2;
  EXPECT_TRUE(contains(only(facts, Verdict::warn, "sensors").text, "range"));
  facts = good();
  facts.rest->sensors[2].mean_Pa -= 25000;
  EXPECT_TRUE(contains(only(facts, Verdict::warn, "sensors").text, "-25 kPa apart"));
}

TEST(Judge, SensorsOfAnotherType) {
  for (double factor : {0.05, 20.0}) {
    Facts facts = good();
    for (SensorAtRest &sensor : facts.rest->sensors) {
      sensor.mean_Pa *= factor;
      sensor.saturated_share = factor > 1 ? 1 : 0;
    }
    EXPECT_TRUE(contains(only(facts, Verdict::bad, "sensors").text, "not those of the firmware"));
  }
  Facts pressed = good();
  for (SensorAtRest &sensor : pressed.rest->sensors) {
    sensor.mean_Pa *= 5;
  }
  EXPECT_TRUE(wrong(pressed).empty());
}

TEST(Judge, BadCalibrationMemory) {
  Facts facts = good();
  facts.after->sensors_prom_bad = 1u << 3;
  facts.rest->sensors[3].doubtful_share = 1;
  EXPECT_EQ(only(facts, Verdict::bad, "prom").sensors, std::vector<unsigned>{3});
}

TEST(Judge, Noise) {
  Facts facts = good();
  facts.rest->sensors[9].noise_Pa = 1.9 * 3.9;
  EXPECT_TRUE(wrong(facts).empty());
  facts.rest->sensors[9].noise_Pa = 2.1 * 3.9;
  EXPECT_EQ(only(facts, Verdict::warn, "noise").sensors, std::vector<unsigned>{9});
  facts.rest->sensors[9].noise_Pa = 39;
  only(facts, Verdict::bad, "noise");
  facts.info->osr = 256;
  facts.rest->frames_made = static_cast<std::uint32_t>(*expected_rate_Hz(*facts.info) * 10);
  only(facts, Verdict::warn, "noise"); /* 11 Pa are its noise */
  facts = good();
  facts.rest->sensors[9].noise_Pa = 0;
  EXPECT_TRUE(contains(only(facts, Verdict::bad, "noise").text, "do not change"));
}

TEST(Judge, NoiseOfTooFewOrNoReadings) {
  Facts facts = good();
  facts.info->rate_mHz = 1000;
  facts.rest->frames_made = 10;
  for (auto &sensor : facts.rest->sensors) {
    sensor.readings = 11;
    sensor.noise_Pa = 39;
  }
  EXPECT_TRUE(contains(only(facts, Verdict::warn, "noise").advice, "--seconds"));
  facts.rest->sensors.clear();
  facts.info->capabilities &= ~static_cast<std::uint32_t>(WIRE_CAPABILITY_RAW_STREAM);
  EXPECT_TRUE(contains(only(facts, Verdict::warn, "noise").advice, "scene"));
}

TEST(Judge, Drift) {
  Facts facts = good();
  facts.rest->sensors[5].drift = Slope{-3, 0.05};
  EXPECT_EQ(only(facts, Verdict::warn, "drift").sensors, std::vector<unsigned>{5});
  facts.rest->sensors[5].drift = Slope{-3, 1};
  EXPECT_TRUE(wrong(facts).empty()) << "not sure";
  facts.rest->sensors[5].drift = Slope{-3, 0.05};
  facts.rest->seconds = 5;
  facts.rest->frames_made /= 2;
  EXPECT_TRUE(wrong(facts).empty()) << "too short";
  facts = good();
  facts.rest->common_drift = Slope{3, 0.05};
  EXPECT_TRUE(only(facts, Verdict::warn, "drift").sensors.empty());
}

TEST(Judge, TouchedPadHasNoDrift) {
  Facts facts = good();
  facts.rest->frames_touched = 400;
  facts.rest->sensors[5].drift = Slope{300, 0.1};
  EXPECT_TRUE(contains(only(facts, Verdict::warn, "zero").text, "something touches the pad"));
  facts.rest->sensors[5].noise_Pa = 100;
  auto findings = wrong(facts);
  ASSERT_EQ(findings.size(), 2u);
  EXPECT_EQ(findings[0].check, "noise");
  EXPECT_FALSE(contains(findings[1].text, "something touches"));
}

TEST(Judge, ZeroThatIsMissingOrDoubtful) {
  Facts facts = good();
  facts.rest->last_flags = 0;
  only(facts, Verdict::warn, "zero");
  facts.rest->last_flags = CONTACT_FLAG_TARED | CONTACT_FLAG_ZERO_DOUBTFUL;
  only(facts, Verdict::warn, "zero");
}

TEST(Judge, Rate) {
  Facts facts = good();
  std::uint32_t expected = facts.rest->frames_made;
  facts.rest->frames_made = expected * 98 / 100;
  EXPECT_TRUE(wrong(facts).empty());
  facts.rest->frames_made = expected * 9 / 10;
  only(facts, Verdict::warn, "rate");
  facts.rest->frames_made = expected / 2;
  only(facts, Verdict::bad, "rate");
  facts.info->rate_mHz = 20000;
  facts.rest->frames_made = 200;
  EXPECT_TRUE(wrong(facts).empty()) << "what was asked for";
}

TEST(Judge, RatesAreThoseOfTheReleaseImages) {
  /* frames a second in the emulator, 3 s at each: board, OSR */
  struct {
    const char *board;
    std::uint16_t osr;
    double rate_Hz;
  } measured[] = {{"pico_mux", 256, 314.8},       {"pico_mux", 1024, 206.2},      {"pico_mux", 8192, 48.47},
                  {"pico_parallel", 256, 1308.9}, {"pico_parallel", 1024, 410.8}, {"pico_parallel", 8192, 54.9}};
  for (const auto &each : measured) {
    Facts facts = good(each.board);
    facts.info->osr = each.osr;
    EXPECT_NEAR(*expected_rate_Hz(*facts.info) / each.rate_Hz, 1, 0.01) << each.board << each.osr;
  }
}

TEST(Judge, NoFrames) {
  Facts facts = good();
  facts.rest = Rest();
  auto findings = wrong(facts);
  ASSERT_EQ(findings.size(), 2u);
  EXPECT_EQ(findings[0].check, "rate");
  EXPECT_EQ(findings[0].verdict, Verdict::bad);
  EXPECT_EQ(findings[1].check, "noise");
}

TEST(Judge, BusAtRest) {
  Facts facts = good();
  facts.before->bus_nacks = facts.after->bus_nacks = 100;
  EXPECT_TRUE(wrong(facts).empty()) << "long ago";
  facts.after->bus_nacks = 120;
  EXPECT_TRUE(contains(only(facts, Verdict::warn, "bus").text, "2.0 NACKs/s"));
  facts.after->bus_recoveries = 1;
  EXPECT_TRUE(contains(only(facts, Verdict::warn, "bus").text, "1 recovery"));
}

TEST(Judge, Packets) {
  Facts facts = good();
  facts.line.dropped_packets = 5;
  EXPECT_TRUE(contains(only(facts, Verdict::warn, "packets").advice, "cable"));
  facts.after->packets_dropped = 5;
  EXPECT_TRUE(contains(only(facts, Verdict::warn, "packets").advice, "computer"));
  facts = good();
  facts.line.crc_errors = 1;
  only(facts, Verdict::warn, "packets");
}

TEST(Judge, RestartsProcessorStackStored) {
  Facts facts = good();
  facts.after->watchdog_resets = 1;
  only(facts, Verdict::warn, "restarts");
  facts.crash = with_places(test::make_crash(0, 0).body.crash, std::nullopt);
  facts.crash->symbols_note = "x.elf is of other firmware: no names";
  auto findings = wrong(facts);
  ASSERT_EQ(findings.size(), 2u);
  EXPECT_EQ(findings[0].check, "restarts");
  EXPECT_TRUE(contains(findings[0].text, "1 reset by the watchdog"));
  EXPECT_EQ(findings[1].check, "crash");
  EXPECT_EQ(findings[1].verdict, Verdict::bad);
  for (const char *part :
       {"a hard fault at 0x20001000", "before that: command stream", "sp 0x20041f00", "other firmware"}) {
    EXPECT_TRUE(contains(findings[1].text, part)) << findings[1].text;
  }
  facts.crash->record.kind = CRASH_START;
  EXPECT_EQ(wrong(facts)[1].verdict, Verdict::warn);
  facts = good();
  facts.after->uptime_s = 3;
  only(facts, Verdict::bad, "restarts");
  facts = good();
  facts.after->cpu_busy_permille = 990;
  only(facts, Verdict::warn, "processor");
  facts = good();
  facts.after->frames_skipped = 4;
  only(facts, Verdict::warn, "processor");
  facts = good();
  facts.after->stack_free_bytes = FT_STACK_RESERVED_bytes - FT_STACK_USED_MAX_bytes - 1;
  only(facts, Verdict::warn, "stack");
  facts.after->stack_free_bytes = 0;
  only(facts, Verdict::bad, "stack");
  facts = good();
  facts.info->stored = WIRE_STORED_DAMAGED;
  only(facts, Verdict::bad, "stored");
}

TEST(Judge, VanishedMeanwhile) {
  Facts facts = good();
  facts.failure = Failure{ErrorCode::gone, "/dev/ttyACM0: vanished while it was examined"};
  facts.after.reset();
  facts.rest.reset();
  only(facts, Verdict::bad, "port");
}
