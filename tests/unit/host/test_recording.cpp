#include "libfingertip/command.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/packet_file.hpp"
#include "libfingertip/recording.hpp"
#include "support/host_packets.hpp"
#include "support/pad.h"

#include <algorithm>
#include <csignal>
#include <fstream>
#include <functional>
#include <gtest/gtest.h>
#include <sstream>
#include <sys/resource.h>

using namespace fingertip;

namespace {

std::string contents(const std::string &path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

void write(const std::string &path, const std::string &text) { std::ofstream(path, std::ios::binary) << text; }

/* Two packets are the same if their frames are. */
std::vector<std::vector<std::uint8_t>> frames_of(const std::vector<wire_packet> &packets) {
  std::vector<std::vector<std::uint8_t>> frames;
  for (const wire_packet &packet : packets) {
    frames.push_back(frame_bytes(packet));
  }
  return frames;
}

std::vector<wire_packet> all_kinds() {
  return {
      test::make_info(0, 10),         test::make_ack(1, 20, WIRE_CMD_STREAM, WIRE_RESULT_OUT_OF_RANGE, 65535, ~0ull),
      test::make_contact(2, 1000, 1), test::make_raw(3, 1000, 1),
      test::make_contact(4, 2000, 2), /* its raw packet was lost */
      test::make_contact(6, 3000, 3), test::make_raw(7, 3000, 3),
      test::make_health(8, 3500),     test::make_raw(10, 4000, 4)}; /* its contact packet was lost */
}

constexpr auto AT_ONCE = OutputFile::Appears::at_once;

void record(const std::string &path, const std::vector<wire_packet> &packets, bool finish = true) {
  wire_info info = test::make_info(0, 0).body.info;
  RecordingWriter writer(path, false, &info, 15, {{"note", "a: b"}}, true, AT_ONCE);
  for (const wire_packet &packet : packets) {
    writer.packet(packet);
  }
  if (finish) {
    writer.finish(LineStatistics(), "test");
  }
}

std::vector<wire_packet> read_all(const std::string &path, bool salvage = false, std::uint64_t *skipped = nullptr) {
  RecordingReader reader(path, salvage);
  std::vector<wire_packet> packets;
  while (auto item = reader.next()) {
    if (item->kind == RecordingReader::Item::Kind::packet) {
      packets.push_back(item->packet);
    }
  }
  if (skipped) {
    *skipped = reader.skipped_lines();
  }
  return packets;
}

Error thrown_by(const std::string &path, bool salvage = false) {
  try {
    read_all(path, salvage);
  } catch (const Error &error) {
    return error;
  }
  return Error("");
}

std::string error_of(const std::string &path) { return thrown_by(path).what(); }

} // namespace

TEST(Recording, GivesBackEveryFieldOfEveryPacket) {
  test::TemporaryFolder folder;
  record(folder / "r.csv", all_kinds());
  EXPECT_EQ(frames_of(read_all(folder / "r.csv")), frames_of(all_kinds()));
}

TEST(Recording, OneRowPerFrame) {
  test::TemporaryFolder folder;
  record(folder / "r.csv", all_kinds());
  std::istringstream text(contents(folder / "r.csv"));
  int rows = -1; /* the header */
  for (std::string line; std::getline(text, line);) {
    rows += line[0] != '#';
  }
  EXPECT_EQ(rows, 4);
}

TEST(Recording, APacketFileGivesTheSamePacketsAgainAndTheGapsCount) {
  test::TemporaryFolder folder;
  record(folder / "r.csv", all_kinds(), false);
  PacketFile file(folder / "r.csv", false);
  std::vector<wire_packet> packets;
  while (auto item = file.next()) {
    packets.push_back(item->packet);
  }
  EXPECT_EQ(frames_of(packets), frames_of(all_kinds()));
  EXPECT_EQ(file.statistics().packets, all_kinds().size());
  EXPECT_EQ(file.statistics().dropped_packets, 2u);
  EXPECT_EQ(file.statistics().out_of_order, 0u);
}

TEST(Recording, ACaptureGivesThePacketsAndTheDamageOfItsBytes) {
  test::TemporaryFolder folder;
  std::string bytes(1, '\0');
  for (const wire_packet &packet : all_kinds()) {
    for (std::uint8_t byte : frame_bytes(packet)) {
      bytes += static_cast<char>(byte);
    }
  }
  bytes[bytes.size() - 20] = static_cast<char>(bytes[bytes.size() - 20] ^ 0x40);
  write(folder / "r.ftr", bytes);
  PacketFile file(folder / "r.ftr", false);
  std::size_t packets = 0;
  while (file.next()) {
    packets++;
  }
  EXPECT_EQ(packets, all_kinds().size() - 1);
  EXPECT_EQ(file.statistics().crc_errors, 1u);
  EXPECT_FALSE(file.is_cut_short());
}

TEST(Recording, AtTheEndTheRecordersCountsHold) {
  test::TemporaryFolder folder;
  {
    RecordingWriter writer(folder / "r.csv", false, nullptr, 15, {}, true, AT_ONCE);
    writer.packet(test::make_contact(1, 1000, 1));
    LineStatistics counted;
    counted.packets = 7;
    counted.dropped_packets = 5;
    counted.crc_errors = 3;
    writer.finish(counted, "test");
  }
  PacketFile file(folder / "r.csv", false);
  ASSERT_TRUE(file.next());
  EXPECT_EQ(file.statistics().packets, 1u);
  EXPECT_FALSE(file.next());
  EXPECT_EQ(file.statistics().packets, 7u);
  EXPECT_EQ(file.statistics().dropped_packets, 5u);
  EXPECT_EQ(file.statistics().crc_errors, 3u);
}

TEST(Recording, OverAGonePortNothingIsMissing) {
  test::TemporaryFolder folder;
  {
    RecordingWriter writer(folder / "r.csv", false, nullptr, 0, {}, false, AT_ONCE);
    writer.packet(test::make_contact(1000, 1, 1));
    writer.event(std::string(EVENT_GONE) + " 12:00");
    writer.event("back 12:01");
    writer.packet(test::make_contact(3, 1, 1));
  }
  PacketFile file(folder / "r.csv", false);
  std::vector<std::string> events;
  while (auto item = file.next()) {
    events.push_back(item->event);
  }
  EXPECT_EQ(events, (std::vector<std::string>{"", "gone 12:00", "back 12:01", ""}));
  EXPECT_EQ(file.statistics().dropped_packets + file.statistics().out_of_order, 0u);
}

TEST(Recording, TheEndCountsTheTimeOfEveryRunOfTheDevice) {
  test::TemporaryFolder folder;
  record(folder / "r.csv", {test::make_contact(1, 5000000, 1), test::make_contact(2, 7500000, 2),
                            test::make_contact(1, 1000, 1), test::make_contact(2, 251000, 2)});
  EXPECT_NE(contents(folder / "r.csv").find(" frames=4 seconds=2.750000 "), std::string::npos);
}

TEST(Recording, TheReaderTellsWhetherTheEndIsThere) {
  test::TemporaryFolder folder;
  for (bool finished : {true, false}) {
    std::string path = folder / (finished ? "whole.csv" : "cut.csv");
    record(path, all_kinds(), finished);
    PacketFile file(path, false);
    EXPECT_FALSE(file.is_cut_short()) << "not at its end yet";
    while (file.next()) {
    }
    EXPECT_EQ(file.is_cut_short(), !finished);
  }
}

TEST(Recording, NamesThatOthersChoseCannotBreakALine) {
  test::TemporaryFolder folder;
  RecordingWriter(folder / "r.csv", false, nullptr, 0, {{"source", "a\nb\x1b\xff"}}, true, AT_ONCE);
  EXPECT_NE(contents(folder / "r.csv").find("# source: a\\x0ab\\x1b\\xff\n"), std::string::npos);
}

TEST(Recording, TextThatNoPacketCanHoldIsDamage) {
  test::TemporaryFolder folder;
  record(folder / "r.csv", all_kinds());
  std::string whole = contents(folder / "r.csv");
  for (std::string bad : {"\x1b", "\xc3\xa4", "\x7f"}) {
    std::string text = whole;
    text.insert(text.find("# scene: ") + 9, bad);
    write(folder / "bad.csv", text);
    EXPECT_NE(error_of(folder / "bad.csv").find("scene is no printable ASCII"), std::string::npos);
  }
}

TEST(Recording, ChangedInfoAfterAReturnIsKept) {
  test::TemporaryFolder folder;
  wire_packet later = test::make_info(0, 5);
  later.body.info.osr = 256;
  later.body.info.x_mm[3] = 1.25f;
  std::vector<wire_packet> packets = {test::make_info(1, 2), test::make_contact(2, 3, 1), later,
                                      test::make_contact(1, 9, 1)};
  record(folder / "r.csv", packets);
  EXPECT_EQ(frames_of(read_all(folder / "r.csv")), frames_of(packets));
}

TEST(Recording, TheCalibrationIsKeptWithItsChanges) {
  test::TemporaryFolder folder;
  wire_packet calibrated = test::make_info(1, 2);
  calibrated.body.info.stored = WIRE_STORED_CALIBRATION | WIRE_STORED_SETTINGS;
  calibrated.body.info.calibration = test::make_calibration();
  wire_packet again = calibrated, erased = test::make_info(5, 6);
  again.body.info.calibration.sensors[14].gain_sd = 0.125f;
  again.body.info.calibration.sensors[14].off_x_um = -2000;
  again.body.info.calibration.sensors[14].wider_q15 = 9830;
  again.body.info.calibration.force_scale = 0.9375f;
  erased.body.info.stored = WIRE_STORED_SETTINGS;
  std::vector<wire_packet> packets = {calibrated, test::make_contact(2, 3, 1), again, erased, again};
  record(folder / "r.csv", packets);
  EXPECT_EQ(frames_of(read_all(folder / "r.csv")), frames_of(packets));
  EXPECT_NE(contents(folder / "r.csv").find("\n# gains: 0.86 0.88 "), std::string::npos);
  EXPECT_NE(contents(folder / "r.csv").find("\n# off_x_um: -700 -600 "), std::string::npos);
}

TEST(Recording, EdgesAtTheSyncPinAreKeptAndCounted) {
  test::TemporaryFolder folder;
  std::vector<wire_packet> packets = {test::make_info(1, 2), test::make_contact(2, 3, 1)};
  for (std::uint32_t number : {7u, 8u, 11u, 12u}) {
    wire_packet edge = test::make_packet(WIRE_SYNC, static_cast<std::uint16_t>(number), 100 * number);
    edge.body.sync = {number, static_cast<std::uint8_t>(number % 2)};
    packets.push_back(edge);
  }
  record(folder / "r.csv", packets);
  EXPECT_EQ(frames_of(read_all(folder / "r.csv")), frames_of(packets));
  EXPECT_NE(contents(folder / "r.csv")
                .find("\n# packet: sync sequence=11 t_us=1100 number=11 "
                      "level=1\n"),
            std::string::npos);
  EXPECT_NE(contents(folder / "r.csv").find(" edges=4 edges_missing=2 "), std::string::npos);
}

TEST(Recording, ThePadIsKeptWithItsChanges) {
  test::TemporaryFolder folder;
  wire_packet known = test::make_info(1, 2);
  known.body.info.stored = WIRE_STORED_PAD;
  known.body.info.pad = pad_of_12_mm();
  wire_packet again = known, erased = test::make_info(5, 6);
  again.body.info.pad.tangential[1].moment_mm = 4.125f;
  again.body.info.pad.from_touch = 1;
  std::vector<wire_packet> packets = {known, test::make_contact(2, 3, 1), again, erased, again};
  record(folder / "r.csv", packets);
  EXPECT_EQ(frames_of(read_all(folder / "r.csv")), frames_of(packets));
  EXPECT_EQ(read_all(folder / "r.csv")[3].body.info.pad.thickness_mm, 0);
  EXPECT_NE(contents(folder / "r.csv").find("\n# pad_moment_sds_mm: 4.8537 7.9913 20.39\n"), std::string::npos);
  std::string four = contents(folder / "r.csv");
  four.insert(four.find("\n# pad_moment_sds_mm: ") + 21, " 3.5");
  write(folder / "four.csv", four);
  EXPECT_NE(error_of(folder / "four.csv").find("too many values"), std::string::npos);
}

/* Without the columns from this one to the last, as they were written before there were any. */
std::string without_columns(const std::string &whole, const char *from, std::size_t &columns) {
  std::istringstream lines(whole);
  std::string text;
  std::size_t first = 0;
  for (std::string line; std::getline(lines, line);) {
    if (line[0] != '#') {
      std::vector<std::string> cells;
      std::string cell;
      std::istringstream row(line + ",");
      while (std::getline(row, cell, ',')) {
        cells.push_back(cell);
      }
      if (first == 0) {
        auto at = [&](const char *name) { return std::find(cells.begin(), cells.end(), name); };
        first = static_cast<std::size_t>(at(from) - cells.begin());
        columns = static_cast<std::size_t>(at("edge_length_mm") - at(from)) + 1;
      }
      cells.erase(cells.begin() + static_cast<std::ptrdiff_t>(first),
                  cells.begin() + static_cast<std::ptrdiff_t>(first + columns));
      line.clear();
      for (const std::string &each : cells) {
        line += (line.empty() ? "" : ",") + each;
      }
    }
    text += line + "\n";
  }
  return text;
}

TEST(Recording, EarlierOnesAreRead) {
  for (bool tangential : {false, true}) {
    test::TemporaryFolder folder;
    std::vector<wire_packet> expected = all_kinds();
    for (wire_packet &packet : expected) {
      if (packet.type == WIRE_CONTACT) {
        wire_contact &contact = packet.body.contact;
        contact.flags &= ~static_cast<std::uint32_t>(CONTACT_FLAG_SHAPE_VALID | CONTACT_FLAG_EDGE);
        contact.shape_age_ms = 0;
        contact.edge_angle_deg = contact.edge_angle_sd_deg = contact.edge_length_mm = 0;
        if (!tangential) {
          contact.flags &= ~static_cast<std::uint32_t>(CONTACT_FLAG_TANGENTIAL_VALID | CONTACT_FLAG_VELOCITY_VALID);
          contact.qx_N = contact.qy_N = contact.q_sd_N = contact.tangential_ratio = 0;
          contact.vx_mm_s = contact.vy_mm_s = 0;
        }
      }
    }
    record(folder / "r.csv", expected);
    std::size_t columns = 0;
    write(folder / "earlier.csv",
          without_columns(contents(folder / "r.csv"), tangential ? "shape_age_ms" : "qx_N", columns));
    EXPECT_EQ(columns, tangential ? 14u : 20u);
    EXPECT_EQ(frames_of(read_all(folder / "earlier.csv")), frames_of(expected));
  }
}

TEST(Recording, AKilledRecorderLosesAtMostTheLastFrame) {
  test::TemporaryFolder folder;
  record(folder / "r.csv", all_kinds(), false);
  EXPECT_EQ(frames_of(read_all(folder / "r.csv")), frames_of(all_kinds()));
}

TEST(Recording, EveryTornTailIsReportedWithItsLineOrSalvaged) {
  test::TemporaryFolder folder;
  record(folder / "r.csv",
         {test::make_contact(1, 1000, 1), test::make_raw(2, 1000, 1), test::make_contact(3, 2000, 2),
          test::make_raw(4, 2000, 2)},
         false);
  std::string whole = contents(folder / "r.csv");
  std::size_t last_line = whole.rfind('\n', whole.size() - 2) + 1;
  std::size_t line_number = static_cast<std::size_t>(std::count(whole.begin(), whole.end(), '\n'));
  for (std::size_t length = last_line + 1; length < whole.size(); length++) {
    write(folder / "torn.csv", whole.substr(0, length));
    std::string error = error_of(folder / "torn.csv");
    EXPECT_EQ(error.rfind(folder / "torn.csv" + ":" + std::to_string(line_number) + ": ", 0), 0u) << error;
    EXPECT_EQ(thrown_by(folder / "torn.csv").code(), ErrorCode::damaged_line);
    std::uint64_t skipped = 0;
    EXPECT_EQ(read_all(folder / "torn.csv", true, &skipped).size(), 2u);
    EXPECT_EQ(skipped, 1u);
  }
}

TEST(Recording, DamagedCellsAreNamed) {
  test::TemporaryFolder folder;
  record(folder / "r.csv", {test::make_contact(1, 1000, 1), test::make_contact(2, 2000, 2)});
  std::string whole = contents(folder / "r.csv");
  std::size_t row = whole.find("\n1000,1,") + 1;
  struct {
    const char *from, *to, *named;
  } cases[] = {{"1000,", "-1000,", "t_us"},      {"1000,", "nan,", "t_us"},     {"5.7000003", "nan", "sigma_mm"},
               {"5.7000003", "inf", "sigma_mm"}, {"5.7000003", "", "sigma_mm"}, {"2501", "70000", "convert_us"},
               {"2501", "2501x", "convert_us"},  {"2501", "2501,1", "columns"}, {"2501,", "", "columns"}};
  for (const auto &damage : cases) {
    std::string text = whole;
    std::size_t at = text.find(damage.from, row);
    ASSERT_NE(at, std::string::npos) << damage.from;
    text.replace(at, std::string(damage.from).size(), damage.to);
    write(folder / "bad.csv", text);
    std::string error = error_of(folder / "bad.csv");
    EXPECT_NE(error.find(damage.named), std::string::npos) << damage.from << " " << error;
    std::uint64_t skipped = 0;
    EXPECT_EQ(read_all(folder / "bad.csv", true, &skipped).size(), 1u);
    EXPECT_EQ(skipped, 1u);
  }
}

TEST(Recording, OtherFilesAreRefused) {
  test::TemporaryFolder folder;
  write(folder / "x.csv", "t_us,frame\n1,2\n");
  EXPECT_NE(error_of(folder / "x.csv").find(":1: no recording"), std::string::npos);
  EXPECT_NE(error_of(folder / "absent.csv").find("No such file"), std::string::npos);
  write(folder / "h.csv", "# fingertip-recording 1\nt_us,frame,colour\n");
  EXPECT_NE(error_of(folder / "h.csv").find(":2: unknown header"), std::string::npos);
  write(folder / "e.csv", "# fingertip-recording 1\n");
  EXPECT_NE(error_of(folder / "e.csv").find("no header line"), std::string::npos);
}

TEST(Recording, TheErrorSaysWhatKindOfFileItIs) {
  test::TemporaryFolder folder;
  write(folder / "s.csv", "# fingertip-scenario 1\nt_s\n");
  EXPECT_EQ(thrown_by(folder / "s.csv").code(), ErrorCode::not_a_recording);
  EXPECT_NE(error_of(folder / "s.csv").find("a scenario, not a recording"), std::string::npos);
  write(folder / "n.csv", "# fingertip-recording 3\n");
  EXPECT_EQ(thrown_by(folder / "n.csv").code(), ErrorCode::other_format);
  EXPECT_NE(error_of(folder / "n.csv").find("format \"3\" is unknown"), std::string::npos);
}

/* Skipping lines helps where lines are damaged, not where the head is. */
TEST(Recording, ADamagedHeadIsToldFromADamagedLine) {
  test::TemporaryFolder folder;
  record(folder / "r.csv", all_kinds());
  std::string whole = contents(folder / "r.csv");
  std::string headless = whole;
  headless.replace(headless.find("t_us,frame"), 4, "t_xx");
  write(folder / "head.csv", headless);
  EXPECT_EQ(thrown_by(folder / "head.csv").code(), ErrorCode::damaged_head);
  EXPECT_EQ(thrown_by(folder / "head.csv", true).code(), ErrorCode::damaged_head);
  std::string damaged = whole;
  damaged.replace(damaged.find("\n1000,") + 1, 4, "1x00");
  write(folder / "line.csv", damaged);
  EXPECT_EQ(thrown_by(folder / "line.csv").code(), ErrorCode::damaged_line);
}

TEST(Recording, LinesMayEndAsOnWindows) {
  test::TemporaryFolder folder;
  record(folder / "r.csv", all_kinds());
  std::string windows;
  for (char c : contents(folder / "r.csv")) {
    windows += c == '\n' ? "\r\n" : std::string(1, c);
  }
  write(folder / "w.csv", windows);
  EXPECT_EQ(frames_of(read_all(folder / "w.csv")), frames_of(all_kinds()));
  PacketFile file(folder / "w.csv", false);
  while (file.next()) {
  }
  EXPECT_FALSE(file.is_cut_short());
}

TEST(Recording, WithoutAFitItsCellsAreEmptyAndNothingIsLost) {
  test::TemporaryFolder folder;
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
  std::vector<wire_packet> packets = {none, fitted, odd};
  record(folder / "r.csv", packets);
  std::string text = contents(folder / "r.csv");
  EXPECT_NE(text.find("\n1000,1,1,32,0,,,,,,,,,,,,,0,0,0,0,0,0,0,,,,,,,"), std::string::npos) << text;
  EXPECT_NE(text.find("\n2000,2,2,340787367,32767,0,-3.3333333,41234.566,5.7000003,1e-07,,12.5,"), std::string::npos)
      << text;
  EXPECT_EQ(frames_of(read_all(folder / "r.csv")), frames_of(packets));
  /* an empty cell under its flag is damage */
  text.replace(text.find(",5.7000003,"), 11, ",,");
  write(folder / "bad.csv", text);
  EXPECT_NE(error_of(folder / "bad.csv").find("sigma_mm is \"\""), std::string::npos);
}

TEST(Recording, PressuresWithoutSensorsAreDamage) {
  test::TemporaryFolder folder;
  { RecordingWriter(folder / "r.csv", false, nullptr, 0, {}, false, AT_ONCE); }
  std::ofstream(folder / "r.csv", std::ios::app) << "1000,1" << std::string(42, ',') << ",7,0,0,0,0,20.00\n";
  EXPECT_NE(error_of(folder / "r.csv").find("pressures in a recording without sensors"), std::string::npos)
      << error_of(folder / "r.csv");
}

TEST(Recording, TheRecordersOwnKeysAreKept) {
  test::TemporaryFolder folder;
  record(folder / "r.csv", all_kinds());
  PacketFile file(folder / "r.csv", false);
  file.next();
  EXPECT_EQ(file.recorder_metadata(), (Metadata{{"note", "a: b"}}));
}

/* The counts of a joint recording, from its lines alone and at its end. */
LineStatistics counts_of_joint(const std::vector<wire_packet> &packets, bool finish,
                               const std::function<double(const wire_packet &)> &host_us,
                               std::vector<std::uint64_t> *t_us = nullptr) {
  test::TemporaryFolder folder;
  {
    wire_packet one = test::make_info(0, 0), two = test::make_info(0, 0);
    one.body.info.serial[0] = 'A';
    two.body.info.serial[0] = 'B';
    JointRecordingWriter writer(folder / "j.csv", false, {one.body.info, two.body.info}, {}, 0, true, AT_ONCE);
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
    LineStatistics counts = counts_of_joint(everything_in_sequence(), finish,
                                            [](const wire_packet &packet) { return static_cast<double>(packet.t_us); });
    EXPECT_EQ(counts.dropped_packets, 0u) << finish;
    EXPECT_EQ(counts.out_of_order, 0u) << finish;
  }
}

TEST(Recording, AClockThatJumpsBackTurnsNoRowsAround) {
  std::vector<std::uint64_t> t_us;
  LineStatistics counts = counts_of_joint(
      everything_in_sequence(), false,
      [](const wire_packet &packet) { return static_cast<double>(packet.t_us) - (packet.t_us > 20000 ? 7500.0 : 0.0); },
      &t_us);
  EXPECT_TRUE(std::is_sorted(t_us.begin(), t_us.end()));
  EXPECT_EQ(t_us.size(), 50u);
  EXPECT_EQ(counts.out_of_order, 0u);
}

TEST(Recording, ExistingFilesAreKeptUnlessReplaced) {
  test::TemporaryFolder folder;
  write(folder / "r.csv", "precious");
  EXPECT_THROW(RecordingWriter(folder / "r.csv", false, nullptr, 0, {}, false, AT_ONCE), Error);
  EXPECT_EQ(contents(folder / "r.csv"), "precious");
  RecordingWriter(folder / "r.csv", true, nullptr, 0, {}, false, AT_ONCE);
  EXPECT_EQ(contents(folder / "r.csv").rfind("# fingertip-recording 1\n", 0), 0u);
}

TEST(Recording, AnotherNumberOfSensorsEndsIt) {
  test::TemporaryFolder folder;
  RecordingWriter writer(folder / "r.csv", false, nullptr, 15, {}, true, AT_ONCE);
  EXPECT_THROW(writer.packet(test::make_raw(1, 1, 1, 12)), Error);
}

/* A limit on the file's size stands in for a full disk: write stops in mid-line. */
TEST(Recording, AFullDiskIsAnErrorAndLeavesWholeLines) {
  test::TemporaryFolder folder;
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  rlimit small = {5000, before.rlim_max};
  std::string error;
  std::uint64_t frames = 0;
  {
    RecordingWriter writer(folder / "r.csv", false, nullptr, 15, {}, false, AT_ONCE);
    setrlimit(RLIMIT_FSIZE, &small);
    try {
      for (std::uint16_t i = 0; i < 1000; i++) {
        writer.packet(test::make_contact(i, 1000u * i, i));
      }
    } catch (const Error &thrown) {
      error = thrown.what();
    }
    setrlimit(RLIMIT_FSIZE, &before);
    frames = writer.frames();
  }
  EXPECT_NE(error.find("stays readable"), std::string::npos) << error;
  EXPECT_GT(frames, 10u);
  EXPECT_EQ(read_all(folder / "r.csv").size(), frames);
}
