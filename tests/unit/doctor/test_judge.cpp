#include "libfingertip/packet_fields.hpp"
#include "libfingertip/text.hpp"
#include "support/host_packets.hpp"
#include "tool/doctor/judge.hpp"

#include <gtest/gtest.h>

using namespace fingertip;

constexpr unsigned SENSORS = 15;

static void set_board(Facts &facts, const char *board) {
  std::memset(facts.info->board, 0, sizeof facts.info->board);
  std::strcpy(facts.info->board, board);
}

/* A fingertip with which all is well, at rest for ten seconds. */
static Facts good(const char *board = "pico_mux") {
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
  health.stack_free_bytes = FT_STACK_RESERVED_bytes - FT_STACK_USED_MAX_bytes(15);
  facts.before = health;
  health.uptime_s = 70;
  facts.after = health;
  Baseline baseline;
  baseline.seconds = 10;
  baseline.frames_made = static_cast<std::uint32_t>(*expected_rate_Hz(*facts.info) * 10);
  baseline.frames_received = baseline.frames_made + 1;
  baseline.last_flags = CONTACT_FLAG_TARED;
  SensorBaseline sensor;
  sensor.readings = baseline.frames_made;
  sensor.valid_share = 1;
  sensor.mean_Pa = 101325;
  sensor.noise_Pa = 3.9;
  sensor.drift = Slope{0.05, 0.03};
  baseline.sensors.assign(SENSORS, sensor);
  baseline.common_drift = Slope{-0.02, 0.01};
  facts.baseline = baseline;
  facts.line.packets = 4000;
  return facts;
}

static std::vector<Finding> wrong(const Facts &facts) {
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

static std::string kinds(const std::vector<Finding> &findings) {
  return joined(findings, ", ", [](const Finding &finding) { return verdict_text(finding.verdict) + " " + finding.check; });
}

/* The only thing that is wrong. */
static Finding only(const Facts &facts, Verdict verdict, const std::string &check) {
  auto findings = wrong(facts);
  EXPECT_EQ(kinds(findings), verdict_text(verdict) + " " + check);
  EXPECT_EQ(worst_of(judge(facts)), verdict);
  return findings.empty() ? Finding{} : findings[0];
}

static bool contains(const std::string &text, const std::string &part) { return text.find(part) != std::string::npos; }

static void fail(Facts &facts, ErrorCode code) {
  facts.failure = Failure{code, "/dev/ttyACM0: ..."};
  facts.info.reset();
  facts.before.reset();
  facts.after.reset();
  facts.baseline.reset();
}

static void set_rate(Facts &facts, double share) {
  facts.baseline->frames_made = static_cast<std::uint32_t>(*expected_rate_Hz(*facts.info) * 10 * share);
}

static void scale_pressures(Facts &facts, double factor) {
  for (SensorBaseline &sensor : facts.baseline->sensors) {
    sensor.mean_Pa *= factor;
    sensor.saturated_share = factor > 10 ? 1 : 0;
  }
}

static void miss(Facts &facts, std::uint32_t sensors) { facts.after->sensors_present &= ~sensors; }

static void hold(Facts &facts) { facts.holders.seen.push_back({123, "screen"}); }

static void drift(Facts &facts, double Pa_per_s, double sd_Pa_per_s) { facts.baseline->sensors[5].drift = Slope{Pa_per_s, sd_Pa_per_s}; }

/* The only finding, with these words and of the sensors of these bits, where this is changed of a good one. */
struct Case {
  Verdict verdict;
  const char *check, *words;
  std::uint32_t sensors;
  void (*change)(Facts &facts);
};

constexpr Verdict warn = Verdict::warn, bad = Verdict::bad;

const Case CASES[] = {
    {warn, "rule", "no udev rule", 0, [](Facts &f) { f.rule.clear(); }},
    {bad, "port", "plugdev", 0, [](Facts &f) { fail(f, ErrorCode::permission_denied); }},
    {warn, "port", "screen (process 123)", 0, [](Facts &f) { hold(f); }},
    {bad, "port", "screen (process 123)", 0,
     [](Facts &f) {
       hold(f);
       fail(f, ErrorCode::port_in_use);
     }},
    {bad, "port", "sudo", 0,
     [](Facts &f) {
       f.holders.all_seen = false;
       fail(f, ErrorCode::port_in_use);
     }},
    {bad, "port", "...", 0, [](Facts &f) { fail(f, ErrorCode::no_fingertip); }},
    {bad, "protocol", "flash", 0, [](Facts &f) { fail(f, ErrorCode::other_version); }},
    {bad, "protocol", "unplug", 0, [](Facts &f) { fail(f, ErrorCode::no_answer); }},
    {bad, "port", "vanished", 0,
     [](Facts &f) {
       f.failure = Failure{ErrorCode::gone, "/dev/ttyACM0: vanished while it was examined"};
       f.after.reset();
       f.baseline.reset();
     }},
    {warn, "firmware", "this tool is of version 1.20.4", 0, [](Facts &f) { f.tool_version[2] = 4; }},
    {warn, "board", "unknown", 0, [](Facts &f) { set_board(f, "mine"); }},
    {bad, "sensors", "strip 1, channel 2 of multiplexer 0x71", 0x80,
     [](Facts &f) {
       miss(f, 1u << 7);
       f.baseline->sensors[7].valid_share = 0;
     }},
    {bad, "sensors", "GP7 (pin 10)", 0x80,
     [](Facts &f) {
       set_board(f, "pico_parallel");
       set_rate(f, 1);
       miss(f, 1u << 7);
     }},
    {bad, "sensors", "multiplexer 0x72 does not answer", 0x7c00, [](Facts &f) { miss(f, 0x7C00); }},
    {bad, "sensors", "held low", 0x7c00,
     [](Facts &f) {
       miss(f, 0x7C00);
       f.after->bus_timeouts = f.before->bus_timeouts = 3;
     }},
    {bad, "sensors", "SCL on GP5 (pin 7)", 0x7fff, [](Facts &f) { miss(f, 0x7FFF); }},
    {warn, "sensors", "of the frames only", 0x4, [](Facts &f) { f.baseline->sensors[2].valid_share = 0.95; }},
    {warn, "sensors", "temperature", 0x4, [](Facts &f) { f.baseline->sensors[2].doubtful_share = 0.2; }},
    {warn, "sensors", "range", 0x4, [](Facts &f) { f.baseline->sensors[2].saturated_share = 0.2; }},
    {warn, "sensors", "-25 kPa apart", 0x4, [](Facts &f) { f.baseline->sensors[2].mean_Pa -= 25000; }},
    {bad, "sensors", "not those of the firmware", 0, [](Facts &f) { scale_pressures(f, 0.05); }},
    {bad, "sensors", "not those of the firmware", 0, [](Facts &f) { scale_pressures(f, 20); }},
    {bad, "prom", "check sum", 0x8,
     [](Facts &f) {
       f.after->sensors_prom_bad = 1u << 3;
       f.baseline->sensors[3].doubtful_share = 1;
     }},
    {warn, "noise", "8.2 Pa rms", 0x200, [](Facts &f) { f.baseline->sensors[9].noise_Pa = 2.1 * 3.9; }},
    {bad, "noise", "39.0 Pa rms", 0x200, [](Facts &f) { f.baseline->sensors[9].noise_Pa = 39; }},
    {warn, "noise", "39.0 Pa rms", 0x200,
     [](Facts &f) {
       f.baseline->sensors[9].noise_Pa = 39;
       f.info->osr = 256; /* 11 Pa are its noise */
       set_rate(f, 1);
     }},
    {bad, "noise", "do not change", 0x200, [](Facts &f) { f.baseline->sensors[9].noise_Pa = 0; }},
    {warn, "noise", "--seconds", 0,
     [](Facts &f) {
       f.info->rate_mHz = 1000;
       f.baseline->frames_made = 10;
       for (SensorBaseline &sensor : f.baseline->sensors) {
         sensor.readings = 11;
         sensor.noise_Pa = 39;
       }
     }},
    {warn, "noise", "scene", 0,
     [](Facts &f) {
       f.baseline->sensors.clear();
       f.info->capabilities &= ~static_cast<std::uint32_t>(WIRE_CAPABILITY_RAW_STREAM);
     }},
    {bad, "processor", "the second one does not run", 0,
     [](Facts &f) { f.after->capabilities |= static_cast<std::uint32_t>(WIRE_CAPABILITY_TANGENTIAL); }},
    {warn, "drift", "-3.0 Pa/s", 0x20, [](Facts &f) { drift(f, -3, 0.05); }},
    {warn, "drift", "all sensors together", 0, [](Facts &f) { f.baseline->common_drift->Pa_per_s = 3; }},
    {warn, "zero", "something touches the pad", 0,
     [](Facts &f) {
       f.baseline->frames_touched = 400;
       drift(f, 300, 0.1);
     }},
    {warn, "zero", "not every sensor has one", 0, [](Facts &f) { f.baseline->last_flags = 0; }},
    {warn, "zero", "may be a zero that has moved", 0, [](Facts &f) { f.baseline->last_flags |= CONTACT_FLAG_ZERO_DOUBTFUL; }},
    {warn, "rate", "expected", 0, [](Facts &f) { set_rate(f, 0.9); }},
    {bad, "rate", "expected", 0, [](Facts &f) { set_rate(f, 0.5); }},
    {warn, "bus", "2.0 NACKs/s", 0, [](Facts &f) { f.after->bus_nacks = 20; }},
    {warn, "bus", "1 recovery", 0, [](Facts &f) { f.after->bus_recoveries = 1; }},
    {warn, "packets", "cable", 0, [](Facts &f) { f.line.dropped_packets = 5; }},
    {warn, "packets", "computer", 0, [](Facts &f) { f.line.dropped_packets = f.after->packets_dropped = 5; }},
    {warn, "packets", "1 damaged", 0, [](Facts &f) { f.line.crc_errors = 1; }},
    {warn, "sync", "600 edges at the sync pin in 10.0 s, 3 missing", 0,
     [](Facts &f) {
       f.info->sync = 1;
       f.baseline->edges = 600;
       f.baseline->edges_missing = 3;
     }},
    {warn, "sync", "0 edges at the sync pin in 10.0 s; join the pin", 0, [](Facts &f) { f.info->sync = 1; }},
    {warn, "sync", "set sync=off", 0, [](Facts &f) { f.info->sync = 1; }},
    {warn, "restarts", "1 reset by the watchdog", 0, [](Facts &f) { f.after->watchdog_resets = 1; }},
    {bad, "restarts", "while it was examined", 0, [](Facts &f) { f.after->uptime_s = 3; }},
    {warn, "processor", "99.0 % busy", 0, [](Facts &f) { f.after->cpu_busy_permille = 990; }},
    {warn, "processor", "4 frames skipped", 0, [](Facts &f) { f.after->frames_skipped = 4; }},
    {warn, "stack", "bytes never used", 0, [](Facts &f) { f.after->stack_free_bytes--; }},
    {bad, "stack", "0 bytes never used", 0, [](Facts &f) { f.after->stack_free_bytes = 0; }},
    {bad, "stored", "calibrate again", 0, [](Facts &f) { f.info->stored = WIRE_STORED_DAMAGED; }},
};

/* What makes no finding. */
static void (*const FINE[])(Facts &) = {
    [](Facts &) {},
    [](Facts &f) {
      set_board(f, "pico_parallel");
      set_rate(f, 1);
    },
    [](Facts &f) { f.baseline->edges = 600; },
    [](Facts &f) { f.info->sync = 2; }, /* pulses at each frame, which are no packets */
    [](Facts &f) {
      f.info->sync = 1;
      f.baseline->edges = 600;
    },
    [](Facts &f) { f.baseline->sensors[2].valid_share = 0.991; },
    [](Facts &f) { scale_pressures(f, 5); }, /* it is pressed */
    [](Facts &f) { f.baseline->sensors[9].noise_Pa = 1.9 * 3.9; },
    [](Facts &f) { drift(f, -3, 1); }, /* not sure */
    [](Facts &f) {
      drift(f, -3, 0.05);
      f.baseline->seconds = 5; /* too short */
      f.baseline->frames_made /= 2;
    },
    [](Facts &f) { set_rate(f, 0.98); },
    [](Facts &f) {
      f.info->rate_mHz = 20000; /* as asked for */
      f.baseline->frames_made = 200;
    },
    [](Facts &f) { f.before->bus_nacks = f.after->bus_nacks = 100; }, /* long ago */
};

TEST(Judge, EachFaultIsNamedWithWhatToDo) {
  for (const Case &each : CASES) {
    SCOPED_TRACE(each.words);
    Facts facts = good();
    each.change(facts);
    const Finding finding = only(facts, each.verdict, each.check);
    EXPECT_TRUE(contains(finding.text + "; " + finding.advice, each.words)) << finding.text << "; " << finding.advice;
    std::uint32_t sensors = 0;
    for (unsigned sensor : finding.sensors) {
      sensors |= 1u << sensor;
    }
    EXPECT_EQ(sensors, each.sensors);
  }
}

TEST(Judge, WhatIsNoFaultIsNotNamed) {
  for (std::size_t i = 0; i < std::size(FINE); i++) {
    Facts facts = good();
    FINE[i](facts);
    for (const Finding &finding : wrong(facts)) {
      ADD_FAILURE() << i << ": " << finding.check << ": " << finding.text;
    }
    EXPECT_EQ(worst_of(judge(facts)), Verdict::ok);
    EXPECT_EQ(judge(facts).size(), judge(good()).size() + (facts.info->sync == 1)) << i;
  }
  EXPECT_GE(judge(good()).size(), 15u);
  Facts simulated = good();
  set_board(simulated, "native");
  simulated.rule.clear();
  EXPECT_TRUE(wrong(simulated).empty());
}

TEST(Judge, WithoutTheRuleTwoThingsAreWrong) {
  Facts facts = good();
  facts.rule.clear();
  fail(facts, ErrorCode::permission_denied);
  EXPECT_EQ(kinds(wrong(facts)), "bad rule, bad port");
}

TEST(Judge, SensorsAreNamedOneByOneWithoutMultiplexersOrABoard) {
  Facts facts = good("pico_parallel");
  miss(facts, 0x7C00);
  EXPECT_EQ(wrong(facts).size(), 5u);
  facts = good();
  set_board(facts, "mine");
  miss(facts, 1u << 4);
  EXPECT_TRUE(contains(wrong(facts)[1].text, "sensor 4 does not answer"));
}

TEST(Judge, NoiseIsNamedBeforeATouchThatItLooksLike) {
  Facts facts = good();
  facts.baseline->frames_touched = 400;
  facts.baseline->sensors[5].noise_Pa = 100;
  auto findings = wrong(facts);
  ASSERT_EQ(kinds(findings), "bad noise, warn zero");
  EXPECT_FALSE(contains(findings[1].text, "something touches"));
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
  facts.baseline = Baseline();
  EXPECT_EQ(kinds(wrong(facts)), "bad rate, warn noise");
}

TEST(Judge, ACrashIsToldWithItsPlaceEventsAndRegisters) {
  Facts facts = good();
  facts.after->watchdog_resets = 1;
  facts.crash = with_places(test::make_crash(0, 0).body.crash, std::nullopt);
  facts.crash->symbols_note = "x.elf is of other firmware: no names";
  auto findings = wrong(facts);
  ASSERT_EQ(kinds(findings), "warn restarts, bad crash");
  for (const char *part : {"a hard fault at 0x20001000", "before that: command stream", "sp 0x20041f00", "other firmware"}) {
    EXPECT_TRUE(contains(findings[1].text, part)) << findings[1].text;
  }
  facts.crash->record.kind = CRASH_START;
  EXPECT_EQ(wrong(facts)[1].verdict, Verdict::warn);
}
