#include "libfingertip/command.hpp"
#include "libfingertip/packet_file.hpp"
#include "libfingertip/recording_writer.hpp"
#include "support/host_packets.hpp"
#include "support/pad.h"

#include <algorithm>
#include <functional>
#include <gtest/gtest.h>

using namespace fingertip;

using Frames = std::vector<std::vector<std::uint8_t>>;

/* Two packets are the same if their frames are. */
static Frames frames_of(const std::vector<wire_packet> &packets) {
  Frames frames;
  for (const wire_packet &packet : packets) {
    frames.push_back(frame_bytes(packet));
  }
  return frames;
}

static std::vector<wire_packet> all_kinds() {
  return {test::make_info(0, 10),         test::make_ack(1, 20, WIRE_CMD_STREAM, WIRE_RESULT_OUT_OF_RANGE, 65535, ~0ull),
          test::make_contact(2, 1000, 1), test::make_raw(3, 1000, 1),
          test::make_contact(4, 2000, 2), /* its raw packet was lost */
          test::make_contact(6, 3000, 3), test::make_raw(7, 3000, 3),
          test::make_health(8, 3500),     test::make_raw(10, 4000, 4)}; /* its contact packet was lost */
}

constexpr auto AT_ONCE = OutputFile::Appears::at_once;

/* A file that is made anew for each. */
struct Recorded {
  test::TemporaryFolder folder;
  std::string path = folder / "r.csv";

  explicit Recorded(const std::vector<wire_packet> &packets = {}, bool finish = true) {
    wire_info info = test::make_info(0, 0).body.info;
    RecordingWriter writer(make_lines(path, true, AT_ONCE), &info, 15, {{"note", "a: b"}}, true);
    for (const wire_packet &packet : packets) {
      writer.packet(packet);
    }
    if (finish) {
      writer.finish({LineStatistics()}, "test");
    }
  }
  bool has(const std::string &text) const { return test::contents(path).find(text) != std::string::npos; }
  void write(const std::string &text) const { std::ofstream(path, std::ios::binary) << text; }
  Frames frames() const {
    RecordingReader reader(path, false);
    std::vector<wire_packet> packets;
    for (auto item = reader.next(); item; item = reader.next()) {
      packets.insert(packets.end(), item->made ? 0 : 1, item->packet);
    }
    return frames_of(packets);
  }
};

/* What a reader makes of other and of damaged files is compared with Python and the page in tests/formats. */
TEST(Recording, GivesBackEveryFieldOfEveryPacketInARowPerFrame) {
  const Recorded recorded(all_kinds());
  EXPECT_EQ(recorded.frames(), frames_of(all_kinds()));
  std::istringstream text(test::contents(recorded.path));
  int rows = -1; /* the header */
  for (std::string line; std::getline(text, line);) {
    rows += line[0] != '#';
  }
  EXPECT_EQ(rows, 4);
}

TEST(Recording, APacketFileGivesTheSamePacketsAgainAndTheGapsCount) {
  for (bool finished : {true, false}) {
    const Recorded recorded(all_kinds(), finished);
    PacketFile file(recorded.path, false);
    EXPECT_FALSE(file.is_cut_short()) << "not at its end yet";
    std::vector<wire_packet> packets;
    while (auto item = file.next()) {
      packets.push_back(item->packet);
      EXPECT_EQ(file.statistics().packets, packets.size());
    }
    EXPECT_EQ(frames_of(packets), frames_of(all_kinds()));
    EXPECT_EQ(file.recorder_metadata(), (Metadata{{"note", "a: b"}}));
    EXPECT_EQ(file.is_cut_short(), !finished);
    EXPECT_EQ(file.statistics().dropped_packets, finished ? 0u : 2u) << "at the end the recorder's counts hold";
    EXPECT_EQ(file.statistics().out_of_order, 0u);
  }
}

TEST(Recording, OverAGonePortNothingIsMissing) {
  const Recorded recorded;
  {
    RecordingWriter writer(make_lines(recorded.path, true, AT_ONCE), nullptr, 0, {}, false);
    writer.packet(test::make_contact(1000, 1, 1));
    writer.event(0, std::string(EVENT_GONE) + " 12:00");
    writer.event(0, "back 12:01");
    writer.packet(test::make_contact(3, 1, 1));
  }
  PacketFile file(recorded.path, false);
  std::vector<std::string> events;
  while (auto item = file.next()) {
    events.push_back(item->event);
  }
  EXPECT_EQ(events, (std::vector<std::string>{"", "gone 12:00", "back 12:01", ""}));
  EXPECT_EQ(file.statistics().dropped_packets + file.statistics().out_of_order, 0u);
}

TEST(Recording, TheEndCountsTheTimeOfEveryRunOfTheDevice) {
  EXPECT_TRUE(Recorded({test::make_contact(1, 5000000, 1), test::make_contact(2, 7500000, 2), test::make_contact(1, 1000, 1),
                        test::make_contact(2, 251000, 2)})
                  .has(" frames=4 seconds=2.750000 "));
}

TEST(Recording, NamesThatOthersChoseCannotBreakALine) {
  const Recorded recorded;
  RecordingWriter(make_lines(recorded.path, true, AT_ONCE), nullptr, 0, {{"source", "a\nb\x1b\xff"}}, true);
  EXPECT_TRUE(recorded.has("# source: a\\x0ab\\x1b\\xff\n"));
}

TEST(Recording, ChangedInfoIsKept) {
  wire_packet plain = test::make_info(1, 2), changed = test::make_info(0, 5);
  changed.body.info.osr = 256;
  changed.body.info.x_mm[3] = 1.25f;
  wire_packet calibrated = plain, recalibrated, padded = plain, repadded;
  calibrated.body.info.stored = WIRE_STORED_CALIBRATION | WIRE_STORED_SETTINGS;
  calibrated.body.info.calibration = test::make_calibration();
  recalibrated = calibrated;
  recalibrated.body.info.calibration.sensors[14].gain_sd = 0.125f;
  recalibrated.body.info.calibration.sensors[14].off_x_um = -2000;
  recalibrated.body.info.calibration.sensors[14].wider_q15 = 9830;
  recalibrated.body.info.calibration.force_scale = 0.9375f;
  padded.body.info.stored = WIRE_STORED_PAD;
  padded.body.info.pad = pad_of_12_mm();
  repadded = padded;
  repadded.body.info.pad.tangential[1].moment_mm = 4.125f;
  repadded.body.info.pad.from_touch = 1;
  const std::vector<wire_packet> packets = {plain,        test::make_contact(2, 3, 1),
                                            changed,      calibrated,
                                            recalibrated, test::make_contact(1, 9, 1),
                                            plain,        recalibrated,
                                            padded,       repadded,
                                            plain,        repadded};
  const Recorded recorded(packets);
  EXPECT_EQ(recorded.frames(), frames_of(packets));
  for (const char *line : {"# gains: 0.86 0.88 ", "# off_x_um: -700 -600 ", "# pad_moment_sds_mm: 4.8537 7.9913 20.39\n"}) {
    EXPECT_TRUE(recorded.has(std::string("\n") + line)) << line;
  }
}

TEST(Recording, EdgesAtTheSyncPinAreKeptAndCounted) {
  std::vector<wire_packet> packets = {test::make_info(1, 2), test::make_contact(2, 3, 1)};
  for (std::uint32_t number : {7u, 8u, 11u, 12u}) {
    wire_packet edge = test::make_packet(WIRE_SYNC, static_cast<std::uint16_t>(number), 100 * number);
    edge.body.sync = {number, static_cast<std::uint8_t>(number % 2)};
    packets.push_back(edge);
  }
  const Recorded recorded(packets);
  EXPECT_EQ(recorded.frames(), frames_of(packets));
  EXPECT_TRUE(recorded.has("\n# packet: sync sequence=11 t_us=1100 number=11 level=1\n"));
  EXPECT_TRUE(recorded.has(" edges=4 edges_missing=2 "));
}

TEST(Recording, WithoutAFitItsCellsAreEmptyAndNothingIsLost) {
  wire_packet none = test::make_packet(WIRE_CONTACT, 1, 1000);
  none.body.contact.frame = 1;
  none.body.contact.flags = CONTACT_FLAG_TARED;
  wire_packet fitted = test::make_contact(2, 2000, 2);
  fitted.body.contact.flags &= ~static_cast<std::uint32_t>(CONTACT_FLAG_SLIP_VALID);
  fitted.body.contact.x_mm = 0;
  fitted.body.contact.slip_mm = 0;
  /* no firmware of ours, but what came is kept */
  wire_packet odd = test::make_contact(3, 3000, 3);
  odd.body.contact.flags = 0;
  odd.body.contact.y_mm = -0.0f;
  const std::vector<wire_packet> packets = {none, fitted, odd};
  const Recorded recorded(packets);
  EXPECT_TRUE(recorded.has("\n1000,1,1,32,0,,,,,,,,,,,,,0,0,0,0,0,0,0,,,,,,,"));
  EXPECT_TRUE(recorded.has("\n2000,2,2,340787367,32767,0,-3.3333333,41234.566,5.7000003,1e-07,,12.5,"));
  EXPECT_EQ(recorded.frames(), frames_of(packets));
  EXPECT_TRUE(RecordingReader(recorded.path, false).next()->made) << "no info packet came: one is made";
}

/* The counts of a joint recording, from its lines alone and at its end. */
LineStatistics counts_of_joint(const std::vector<wire_packet> &packets, bool finish,
                               const std::function<double(const wire_packet &)> &host_us, std::vector<std::uint64_t> *t_us = nullptr) {
  test::TemporaryFolder folder;
  {
    wire_packet one = test::make_info(0, 0), two = test::make_info(0, 0);
    one.body.info.serial[0] = 'A';
    two.body.info.serial[0] = 'B';
    RecordingWriter writer(make_lines(folder / "j.csv", false, AT_ONCE), {one.body.info, two.body.info}, {}, 0, true);
    for (const wire_packet &packet : packets) {
      writer.packet(0, packet, host_us(packet));
      writer.settle(host_us(packet) - 3000);
      writer.packet(1, packet, host_us(packet));
    }
    if (finish) {
      writer.finish(std::vector<LineStatistics>(2), "test");
    }
  }
  PacketFile file(folder / "j.csv", false, std::string("A") + "660583883265A2C");
  while (auto item = file.next()) {
    if (t_us && item->packet.type == WIRE_CONTACT) {
      t_us->push_back(item->packet.t_us);
    }
  }
  return file.statistics();
}

std::vector<wire_packet> everything_in_sequence() {
  std::vector<wire_packet> packets;
  std::uint16_t sequence = 0;
  for (std::uint32_t frame = 1; frame <= 50; frame++) {
    std::uint64_t t_us = 1000u * frame;
    packets.push_back(test::make_contact(sequence++, t_us, frame));
    packets.push_back(test::make_raw(sequence++, t_us, frame));
    if (frame % 5 == 0) {
      /* said after the frames of that time were measured, before they are sent */
      packets.push_back(test::make_health(sequence++, t_us + 3500));
      packets.push_back(test::make_ack(sequence++, t_us + 200, WIRE_CMD_STREAM, WIRE_RESULT_DONE, frame & 0xFFFF, 7));
    }
  }
  return packets;
}

TEST(Recording, AJointOneInventsNoLosses) {
  for (bool finish : {false, true}) {
    LineStatistics counts =
        counts_of_joint(everything_in_sequence(), finish, [](const wire_packet &packet) { return static_cast<double>(packet.t_us); });
    EXPECT_EQ(counts.dropped_packets, 0u) << finish;
    EXPECT_EQ(counts.out_of_order, 0u) << finish;
  }
}

TEST(Recording, AClockThatJumpsBackTurnsNoRowsAround) {
  std::vector<std::uint64_t> t_us;
  LineStatistics counts = counts_of_joint(
      everything_in_sequence(), false,
      [](const wire_packet &packet) { return static_cast<double>(packet.t_us) - (packet.t_us > 20000 ? 7500.0 : 0.0); }, &t_us);
  EXPECT_TRUE(std::is_sorted(t_us.begin(), t_us.end()));
  EXPECT_EQ(t_us.size(), 50u);
  EXPECT_EQ(counts.out_of_order, 0u);
}
