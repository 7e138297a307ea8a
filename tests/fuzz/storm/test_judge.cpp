// The judge of storms finds what is wrong, each kind of it, and nothing where nothing is.
#include "judge.hpp"
#include "libfingertip/command.hpp"
#include "support/host_packets.hpp"

#include <algorithm>
#include <functional>
#include <gtest/gtest.h>

namespace storm {

constexpr std::uint64_t FRAME_us = 5000, ZERO_us = 1000;

// A device that reports the truth about the world, whose packets a test spoils.
class Line {
public:
  Line() : world_(7), judge_(world_) {
    judge_.begin_life(ZERO_us);
    judge_.open(ZERO_us);
  }

  // Spoils the frame that comes at or after this time, once.
  std::function<void(wire_packet &)> spoil;
  std::uint64_t spoil_at_us = UINT64_MAX;
  bool spoil_contact_only = true;

  void run_to(std::uint64_t end_us) {
    for (; now_us_ < end_us; now_us_ += FRAME_us) {
      world_.extend_to(now_us_);
      send_frame();
      if (now_us_ % 1000000 == 0) {
        send_health();
      }
    }
  }

  void say(wire_packet packet, bool lost = false) {
    packet.sequence = sequence_++;
    if (lost) {
      return;
    }
    const std::vector<std::uint8_t> bytes = fingertip::frame_bytes(packet);
    judge_.received(now_us_, bytes.data(), bytes.size());
  }

  // One frame is not sent, and counted or not.
  void lose_packet(bool counted) {
    say(test::make_packet(WIRE_HEALTH, 0, 0), true);
    sent_ += counted ? 0 : 1;
    dropped_ += counted ? 1 : 0;
  }
  void skip_frame(bool counted) {
    frame_++;
    now_us_ += FRAME_us;
    world_.extend_to(now_us_);
    skipped_ += counted ? 1 : 0;
  }
  void acknowledge(std::uint16_t number, std::uint8_t command) {
    say(test::make_ack(0, device_us(), command, WIRE_RESULT_DONE, number, 0));
    sent_++;
  }

  std::uint64_t device_us() const { return now_us_ - ZERO_us; }
  std::uint64_t now_us() const { return now_us_; }
  Judge &judge() { return judge_; }
  // A moment well within a firm touch, or one that is weaker than such a part of those before.
  std::uint64_t pressed_at_us(double share = 1) {
    double strongest_Pa = share < 1 ? 0 : 1e9;
    for (std::uint64_t t_us = 3000000;; t_us += STEP_us) {
      world_.extend_to(t_us);
      const Row row = world_.at(t_us);
      strongest_Pa = std::max(strongest_Pa, row.peak_Pa);
      if (row.peak_Pa > 1500 && row.peak_Pa < share * strongest_Pa && row.p0_Pa == world_.at(t_us - 200000).p0_Pa) {
        return t_us;
      }
    }
  }

private:
  void send_frame() {
    const std::uint64_t measured_us = now_us_ - 2000;
    const Row truth = world_.at(measured_us);
    wire_packet packet = test::make_packet(WIRE_CONTACT, 0, measured_us - ZERO_us);
    wire_contact &contact = packet.body.contact;
    contact.frame = frame_;
    contact.flags = CONTACT_FLAG_TARED;
    if (truth.peak_Pa > 200) {
      contact.flags |= CONTACT_FLAG_CONTACT | CONTACT_FLAG_FIT_VALID | CONTACT_FLAG_UNCERTAINTY_VALID;
      contact.x_mm = static_cast<float>(truth.x_mm);
      contact.y_mm = static_cast<float>(truth.y_mm);
      contact.force_N = static_cast<float>(truth.force_N());
    }
    contact.stages = {1, 2, 3, 4, 5, 6, 21};
    wire_packet raw = test::make_packet(WIRE_RAW, 0, packet.t_us);
    raw.body.raw.frame = frame_;
    raw.body.raw.flags = CONTACT_FLAG_TARED;
    raw.body.raw.sensor_count = SENSORS;
    raw.body.raw.valid = 0x7FFF;
    for (unsigned k = 0; k < SENSORS; k++) {
      raw.body.raw.pressure_Pa_q10[k] = static_cast<std::int32_t>(1024 * truth.pressure_Pa[k]);
    }
    const bool spoils = spoil && now_us_ >= spoil_at_us;
    if (spoils) {
      spoil(spoil_contact_only ? packet : raw);
      spoil = nullptr;
    }
    say(packet);
    say(raw);
    sent_ += 2;
    frame_++;
    taken_++;
  }

  void send_health() {
    wire_packet packet = test::make_packet(WIRE_HEALTH, 0, device_us());
    wire_health &health = packet.body.health;
    health.uptime_s = static_cast<std::uint32_t>(packet.t_us / 1000000);
    health.packets_sent = sent_;
    health.packets_dropped = dropped_;
    health.frames = taken_ + skipped_;
    health.frames_skipped = skipped_;
    say(packet);
    sent_++;
  }

  World world_;
  Judge judge_;
  std::uint64_t now_us_ = FRAME_us;
  std::uint16_t sequence_ = 0;
  std::uint32_t frame_ = 0, sent_ = 0, dropped_ = 0, taken_ = 0, skipped_ = 0;
};

static std::string found(Line &line) {
  std::string kinds;
  for (const Finding &finding : line.judge().findings()) {
    kinds += finding.kind + "; ";
  }
  return kinds;
}

TEST(Judge, FindsNothingOnATrueLine) {
  Line line;
  line.run_to(30000000);
  line.lose_packet(true);
  line.run_to(32000000);
  line.skip_frame(true);
  line.run_to(60000000);
  EXPECT_EQ(found(line), "");
  const Figures &figures = line.judge().figures();
  EXPECT_GT(figures.judged, 100000u);
  EXPECT_EQ(figures.missing, 1u);
  EXPECT_EQ(figures.skipped, 1u);
}

// A packet that is spoilt, in a firm touch or before the first one, and the first finding.
struct Spoilt {
  const char *name;
  bool pressed, contact;
  std::function<void(wire_packet &)> spoil;
  std::string finding;
};

TEST(Judge, FindsWhatIsSpoilt) {
  const auto off = [](wire_packet &packet) { packet.body.contact.x_mm += 1.5f; };
  const auto nothing_touches = [](wire_packet &packet) { packet.body.contact.flags = CONTACT_FLAG_TARED; };
  const Spoilt all[] = {
      {"time steps back", false, true, [](wire_packet &packet) { packet.t_us -= 6000; }, "time; "},
      {"from the future", false, true, [](wire_packet &packet) { packet.t_us += 10000; }, "time; "},
      {"numbers step back", false, true, [](wire_packet &packet) { packet.body.contact.frame -= 5; }, "time; "},
      {"a location", true, true, off, "wrong; "},
      {"a force", true, true, [](wire_packet &packet) { packet.body.contact.force_N *= 1.5f; }, "wrong; "},
      {"a contact that is missed", true, true, nothing_touches, "wrong; "},
      {"a contact that is none", false, true,
       [](wire_packet &packet) {
         packet.body.contact.flags |= CONTACT_FLAG_CONTACT | CONTACT_FLAG_FIT_VALID;
         packet.body.contact.force_N = 1;
       },
       "wrong; "},
      {"a reading", false, false, [](wire_packet &packet) { packet.body.raw.pressure_Pa_q10[3] += 2000 * 1024; }, "wrong; "},
      {"a location with a warning", true, true,
       [&](wire_packet &packet) {
         off(packet);
         packet.body.contact.flags |= CONTACT_FLAG_MODEL;
       },
       ""},
  };
  for (const Spoilt &each : all) {
    Line line;
    line.spoil_contact_only = each.contact;
    line.spoil_at_us = each.pressed ? line.pressed_at_us() : 1500000; // nothing touches in the first three seconds
    line.spoil = each.spoil;
    line.run_to(line.spoil_at_us + 100000);
    EXPECT_EQ(found(line).substr(0, each.finding.empty() ? std::string::npos : each.finding.size()), each.finding) << each.name;
  }
}

TEST(Judge, AnExcuseCounts) {
  Line line;
  line.spoil_at_us = line.pressed_at_us();
  line.spoil = [](wire_packet &packet) { packet.body.contact.x_mm += 1.5f; };
  line.judge().excuse_until(line.spoil_at_us + 50000);
  line.run_to(line.spoil_at_us + 100000);
  EXPECT_EQ(found(line), "");
  EXPECT_EQ(line.judge().figures().excused, 1u);
}

TEST(Judge, FindsPacketsAndFramesThatAreMissingAndNotCounted) {
  for (const bool packet : {true, false}) {
    Line line;
    line.run_to(5000000);
    for (int i = 0; i < 2; i++) { // one frame might still wait for the processor
      packet ? line.lose_packet(false) : line.skip_frame(false);
    }
    line.run_to(8000000);
    EXPECT_EQ(found(line), "loss; ");
  }
}

TEST(Judge, FindsACommandWithoutAnAnswerAndAnAnswerWithoutACommand) {
  Line line;
  line.run_to(1000000);
  wire_packet command = fingertip::command_info();
  for (std::uint16_t number = 11; number <= 12; number++) {
    command.sequence = number;
    line.judge().sent(line.now_us(), command);
  }
  line.acknowledge(11, WIRE_CMD_INFO);
  line.run_to(5000000);
  EXPECT_EQ(found(line), "");
  line.acknowledge(11, WIRE_CMD_INFO);
  EXPECT_EQ(found(line), "answer; ");
  line.judge().close(line.now_us());
  EXPECT_EQ(found(line), "answer; loss; ");
}

TEST(Judge, AWeakTouchAfterAStrongOneMayGoUndetectedButNotBeWrong) {
  Line line;
  line.spoil_at_us = line.pressed_at_us(0.1);
  line.spoil = [](wire_packet &packet) { packet.body.contact.flags = CONTACT_FLAG_TARED; };
  line.run_to(line.spoil_at_us + 50000);
  EXPECT_EQ(found(line), "");
  line.spoil = [](wire_packet &packet) { packet.body.contact.force_N *= 0.6f; };
  line.run_to(line.now_us() + 50000);
  EXPECT_EQ(found(line), "wrong; ");
}

TEST(Judge, FindsDamagedPacketsButTheOneThatOpeningCut) {
  Line line;
  line.run_to(1000000);
  std::vector<std::uint8_t> bytes = fingertip::frame_bytes(test::make_info(0, 1));
  bytes[5] ^= 0x40;
  line.judge().received(line.now_us(), bytes.data(), bytes.size());
  EXPECT_EQ(found(line), "damaged; ");
  line.judge().close(line.now_us());
  line.judge().open(line.now_us());
  line.judge().received(line.now_us(), bytes.data(), bytes.size());
  EXPECT_EQ(found(line), "damaged; ");
}

TEST(Judge, RecoveryIsFiveGoodFramesInARow) {
  Line line;
  line.run_to(1000000);
  line.judge().expect_recovery();
  line.run_to(1000000 + 4 * FRAME_us);
  EXPECT_FALSE(line.judge().has_recovered());
  line.spoil_at_us = 0;
  line.spoil = [](wire_packet &packet) { packet.body.contact.flags |= CONTACT_FLAG_SENSOR_MASKED; };
  line.run_to(line.now_us() + FRAME_us);
  line.run_to(line.now_us() + 5 * FRAME_us);
  EXPECT_TRUE(line.judge().has_recovered());
}

} // namespace storm
