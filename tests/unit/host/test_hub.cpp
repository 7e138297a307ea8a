#include "libfingertip/command.hpp"
#include "libfingertip/decoder.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/share_socket.hpp"
#include "library/share/hub.hpp"
#include "library/share/line_server.hpp"
#include "support/host_packets.hpp"

#include <algorithm>
#include <gtest/gtest.h>
#include <unistd.h>

using namespace fingertip;
using std::chrono::milliseconds;
using std::chrono::seconds;

/* A fingertip that says what a test has it say, and a hub with clients around it. */
class HubTest : public ::testing::Test {
protected:
  struct Program {
    Hub::Client client = 0;
    Decoder decoder;
    std::uint16_t sequence = 100;
    std::vector<wire_packet> heard;

    std::size_t count_of(std::uint8_t type) const {
      return static_cast<std::size_t>(
          std::count_if(heard.begin(), heard.end(), [&](const wire_packet &packet) { return packet.type == type; }));
    }
  };

  HubTest() { wire_receiver_init(&receiver_, wire_commands); }

  Program join() {
    Program program;
    program.client = hub.join();
    return program;
  }
  void command(Program &program, wire_packet packet) {
    packet.sequence = program.sequence++;
    packet.t_us = 5000u + packet.sequence;
    auto bytes = frame_bytes(packet);
    hub.from_client(program.client, bytes.data(), bytes.size(), now);
  }
  /* Commands that reached the line since the last time. */
  std::vector<wire_packet> commands() {
    std::vector<wire_packet> all;
    for (std::uint8_t byte : hub.take_for_line()) {
      wire_packet packet;
      if (wire_receive(&receiver_, byte, &packet) == FT_OK) {
        all.push_back(packet);
      }
    }
    return all;
  }
  /* The only one. */
  wire_packet command_on_line(wire_type type) {
    auto all = commands();
    EXPECT_EQ(all.size(), 1u);
    EXPECT_EQ(all.at(0).type, type);
    return all.at(0);
  }
  wire_packet streams_on_line(int streams) {
    const wire_packet asked = command_on_line(WIRE_CMD_STREAM);
    EXPECT_EQ(asked.body.cmd_stream.streams, streams);
    return asked;
  }
  void say(wire_packet packet) {
    packet.sequence = line_sequence++;
    auto bytes = frame_bytes(packet);
    hub.from_line(bytes.data(), bytes.size());
  }
  /* As a fingertip does. */
  void answer(const wire_packet &to, std::uint8_t result = WIRE_RESULT_DONE) {
    say(test::make_ack(0, 777, to.type, result, to.sequence, to.t_us));
    if (to.type == WIRE_CMD_INFO) {
      say(test::make_info(0, 1));
    } else if (to.type == WIRE_CMD_HEALTH) {
      say(test::make_health(0, 1));
    }
  }
  void answer_all() {
    for (auto all = commands(); !all.empty(); all = commands()) {
      for (const wire_packet &each : all) {
        answer(each);
      }
      hub.tick(now);
    }
  }
  /* The hub has asked what it asks by itself. */
  void greet() {
    hub.tick(now);
    answer_all();
  }
  void stream(Program &program, std::uint8_t streams) {
    command(program, command_stream(streams));
    answer_all();
    read(program);
    program.heard.clear();
  }
  void frame(std::uint32_t number) {
    say(test::make_contact(0, number, number));
    say(test::make_raw(0, number, number));
  }
  void read(Program &program, std::size_t most = SIZE_MAX) {
    std::size_t length = 0;
    const std::uint8_t *bytes = hub.waiting(program.client, &length);
    length = std::min(length, most);
    program.decoder.feed(bytes, length, [&](const wire_packet &packet) { program.heard.push_back(packet); });
    hub.took(program.client, length);
  }

  Hub hub{20000};
  Hub::Time now{std::chrono::hours(5)};
  std::uint16_t line_sequence = 0xFFF0;

private:
  wire_receiver receiver_;
};

constexpr std::uint8_t BOTH = WIRE_STREAM_CONTACT | WIRE_STREAM_RAW;

class GreetedHubTest : public HubTest {
protected:
  void SetUp() override { greet(); }
};

TEST_F(HubTest, AsksWhoIsThereAndForNoStreams) {
  hub.tick(now);
  auto asked = commands();
  ASSERT_EQ(asked.size(), 2u);
  EXPECT_EQ(asked[0].type, WIRE_CMD_INFO);
  EXPECT_EQ(asked[1].type, WIRE_CMD_STREAM);
  EXPECT_EQ(asked[1].body.cmd_stream.streams, 0);
  EXPECT_FALSE(hub.info());
  hub.tick(now + milliseconds(900));
  EXPECT_TRUE(commands().empty()) << "the answer may still come";
  hub.tick(now + seconds(2));
  EXPECT_EQ(commands().size(), 2u) << "no answer came";
  answer(asked[0]);
  ASSERT_TRUE(hub.info());
  EXPECT_EQ(std::string(hub.info()->serial, WIRE_TEXT_BYTES), "E660583883265A2C");
}

TEST_F(GreetedHubTest, AnswersGoToWhoAskedUnderTheirOwnNumbers) {
  Program one = join(), other = join();
  other.sequence = 100; /* the same as the one's */
  command(one, command_info());
  command(other, command_tare(true));
  command(other, command_health());
  auto asked = commands();
  ASSERT_EQ(asked.size(), 3u);
  EXPECT_EQ(asked[1].body.cmd_tare.force, 1);
  answer(asked[0]);
  answer(asked[1], WIRE_RESULT_NOT_NOW);
  answer(asked[2]);
  read(one);
  read(other);
  ASSERT_EQ(one.heard.size(), 2u);
  EXPECT_EQ(one.heard[0].body.ack.command, WIRE_CMD_INFO);
  EXPECT_EQ(one.heard[0].body.ack.sequence, 100);
  EXPECT_EQ(one.heard[0].body.ack.host_time_us, 5100u);
  EXPECT_EQ(one.heard[0].t_us, 777u);
  EXPECT_EQ(one.heard[1].type, WIRE_INFO);
  ASSERT_EQ(other.heard.size(), 3u);
  EXPECT_EQ(other.heard[0].body.ack.result, WIRE_RESULT_NOT_NOW);
  EXPECT_EQ(other.heard[0].body.ack.sequence, 100);
  EXPECT_EQ(other.heard[1].body.ack.sequence, 101);
  EXPECT_EQ(other.heard[2].type, WIRE_HEALTH);
  EXPECT_EQ(one.decoder.statistics().dropped_packets, 0u);
  EXPECT_EQ(other.decoder.statistics().dropped_packets, 0u);
}

TEST_F(GreetedHubTest, TheLineStreamsWhatAnyWantsAndEachGetsItsOwn) {
  Program one = join(), other = join(), idle = join();
  command(one, command_stream(WIRE_STREAM_CONTACT));
  answer(streams_on_line(WIRE_STREAM_CONTACT));
  command(other, command_stream(WIRE_STREAM_RAW | WIRE_STREAM_HEALTH));
  answer(streams_on_line(WIRE_STREAM_ALL));
  frame(1);
  say(test::make_health(0, 1));
  for (Program *each : {&one, &other, &idle}) {
    read(*each);
    EXPECT_EQ(each->decoder.statistics().dropped_packets, 0u);
  }
  EXPECT_EQ(one.count_of(WIRE_CONTACT), 1u);
  EXPECT_EQ(one.heard.size(), 2u) << "with the acknowledgement";
  EXPECT_EQ(other.count_of(WIRE_RAW), 1u);
  EXPECT_EQ(other.count_of(WIRE_HEALTH), 1u);
  EXPECT_EQ(other.heard.size(), 3u);
  EXPECT_TRUE(idle.heard.empty());

  command(one, command_stream(0));
  const wire_packet asked = streams_on_line(WIRE_STREAM_RAW | WIRE_STREAM_HEALTH);
  frame(2);
  answer(asked);
  say(test::make_contact(0, 3, 3));
  read(one);
  EXPECT_EQ(one.count_of(WIRE_CONTACT), 2u) << "until it was acknowledged";
}

TEST_F(GreetedHubTest, WhoeverLeavesWantsNothing) {
  Program one = join(), other = join();
  stream(one, BOTH);
  stream(other, WIRE_STREAM_CONTACT);
  command(one, command_health());
  hub.leave(one.client);
  hub.tick(now);
  auto asked = commands();
  ASSERT_EQ(asked.size(), 2u);
  EXPECT_EQ(asked[1].body.cmd_stream.streams, WIRE_STREAM_CONTACT);
  answer(asked[0]); /* to no client */
  answer(asked[1]);
  hub.tick(now);
  EXPECT_TRUE(commands().empty());
  read(other);
  EXPECT_TRUE(other.heard.empty());
  EXPECT_EQ(other.decoder.statistics().dropped_packets, 0u);
}

TEST_F(GreetedHubTest, WishesThatCrossOneAnotherAllComeTrue) {
  Program one = join(), other = join();
  stream(one, BOTH);
  command(one, command_stream(0)); /* not answered yet */
  command(other, command_stream(WIRE_STREAM_HEALTH));
  for (const wire_packet &each : commands()) {
    answer(each);
  }
  hub.tick(now);
  streams_on_line(WIRE_STREAM_HEALTH); /* the second still held what the first gave up */
  command(one, command_stream(WIRE_STREAM_CONTACT));
  command(other, command_stream(WIRE_STREAM_RAW));
  EXPECT_EQ(commands().at(1).body.cmd_stream.streams & BOTH, BOTH);
}

TEST_F(GreetedHubTest, ARefusedWishIsItsOwnersAlone) {
  Program one = join(), other = join();
  command(one, command_stream(0x40)); /* no firmware has it */
  command(other, command_stream(WIRE_STREAM_CONTACT));
  auto asked = commands();
  ASSERT_EQ(asked.size(), 2u);
  EXPECT_EQ(asked[1].body.cmd_stream.streams, WIRE_STREAM_CONTACT);
  answer(asked[0], WIRE_RESULT_OUT_OF_RANGE);
  answer(asked[1]);
  frame(1);
  read(one);
  read(other);
  ASSERT_EQ(one.heard.size(), 1u);
  EXPECT_EQ(one.heard[0].body.ack.result, WIRE_RESULT_OUT_OF_RANGE);
  EXPECT_EQ(other.count_of(WIRE_CONTACT), 1u);
}

TEST_F(GreetedHubTest, LossesOfTheLineAreEverybodys) {
  Program one = join(), other = join();
  stream(one, BOTH);
  stream(other, WIRE_STREAM_CONTACT);
  frame(1);
  line_sequence = static_cast<std::uint16_t>(line_sequence + 3);
  frame(2);
  auto damaged = frame_bytes(test::make_contact(line_sequence++, 3, 3));
  damaged[20] = static_cast<std::uint8_t>(damaged[20] ^ 0x80);
  hub.from_line(damaged.data(), damaged.size());
  frame(4);
  for (Program *each : {&one, &other}) {
    read(*each);
    EXPECT_EQ(each->decoder.statistics().dropped_packets, 4u);
    EXPECT_EQ(each->decoder.statistics().crc_errors + each->decoder.statistics().format_errors, 1u);
    EXPECT_EQ(each->decoder.statistics().out_of_order, 0u);
    EXPECT_EQ(hub.lost(each->client), 0u);
  }
  EXPECT_EQ(one.heard.size(), 6u);
  EXPECT_EQ(other.heard.size(), 3u);
}

TEST_F(GreetedHubTest, ARestartLooksAsItDoesOnTheLine) {
  Program one = join();
  stream(one, BOTH);
  Decoder direct;
  auto say_to_both = [&](std::uint32_t number) {
    auto bytes = frame_bytes(test::make_contact(line_sequence, number, number));
    direct.feed(bytes.data(), bytes.size(), [](const wire_packet &) {});
    say(test::make_contact(0, number, number));
  };
  say_to_both(1);
  for (int restarted : {0, 0x9000, 0x10, 0x0F}) {
    line_sequence = static_cast<std::uint16_t>(restarted);
    say_to_both(2);
    say_to_both(3);
  }
  read(one);
  EXPECT_EQ(one.decoder.statistics().dropped_packets, direct.statistics().dropped_packets);
  EXPECT_EQ(one.decoder.statistics().out_of_order, direct.statistics().out_of_order);
  EXPECT_GE(direct.statistics().out_of_order, 2u);
  EXPECT_GT(direct.statistics().dropped_packets, 1000u);
}

TEST_F(GreetedHubTest, ASlowClientLosesItsOwnPacketsCountedAndNobodyElses) {
  for (std::size_t bytes : {0u, 97u}) { /* it reads with each frame */
    Program slow = join(), quick = join();
    stream(slow, BOTH);
    stream(quick, BOTH);
    for (std::uint32_t i = 0; i < 2000; i++) {
      frame(i);
      read(quick);
      read(slow, bytes);
    }
    std::size_t length = 0;
    hub.waiting(slow.client, &length);
    EXPECT_LE(length, 20000u);
    EXPECT_GT(length, 19000u);
    read(slow);
    frame(2000);
    read(slow);
    read(quick);
    EXPECT_EQ(quick.heard.size(), 4002u);
    EXPECT_EQ(quick.decoder.statistics().dropped_packets, 0u);
    EXPECT_EQ(hub.lost(quick.client), 0u);
    EXPECT_GT(hub.lost(slow.client), 1000u);
    EXPECT_EQ(slow.decoder.statistics().dropped_packets, hub.lost(slow.client));
    EXPECT_EQ(slow.heard.size() + hub.lost(slow.client), 4002u);
    EXPECT_EQ(slow.heard.back().body.raw.frame, 2000u);
    EXPECT_EQ(slow.decoder.statistics().crc_errors + slow.decoder.statistics().format_errors, 0u) << "whole packets";
    hub.leave(slow.client);
    hub.leave(quick.client);
  }
}

TEST_F(GreetedHubTest, AStoppedClientBeginsAnewBeforeItsNumbersLie) {
  Program stopped = join();
  stream(stopped, WIRE_STREAM_CONTACT);
  std::uint32_t frames = 0;
  for (; !hub.is_lost_for_good(stopped.client) && frames < 100000; frames++) {
    say(test::make_contact(0, frames, frames));
  }
  EXPECT_LT(hub.lost(stopped.client), 0x8000u) << "or a gap would look like packets out of order";
  EXPECT_GT(hub.lost(stopped.client), Hub::MOST_LOST_IN_A_ROW);
}

TEST_F(GreetedHubTest, HealthOfTheStreamIsNoAnswer) {
  Program streaming = join(), asking = join();
  stream(streaming, WIRE_STREAM_HEALTH);
  say(test::make_health(0, 1));
  command(asking, command_health());
  for (const wire_packet &each : commands()) {
    answer(each);
  }
  read(asking);
  read(streaming);
  EXPECT_EQ(asking.count_of(WIRE_HEALTH), 1u);
  EXPECT_EQ(streaming.count_of(WIRE_HEALTH), 1u) << "the other was not for it";

  /* The answer got lost: what comes next may be the stream's. */
  command(asking, command_health());
  say(test::make_ack(0, 1, WIRE_CMD_HEALTH, WIRE_RESULT_DONE, command_on_line(WIRE_CMD_HEALTH).sequence, 0));
  line_sequence++;
  say(test::make_health(0, 1));
  read(streaming);
  EXPECT_EQ(streaming.count_of(WIRE_HEALTH), 2u);
}

TEST_F(GreetedHubTest, ALostAnswerIsNotTakenForTheNext) {
  Program one = join(), other = join();
  command(one, command_info());
  say(test::make_ack(0, 1, WIRE_CMD_INFO, WIRE_RESULT_DONE, command_on_line(WIRE_CMD_INFO).sequence, 0));
  line_sequence++; /* its info */
  command(other, command_info());
  answer(commands().at(0));
  read(one);
  read(other);
  EXPECT_EQ(one.count_of(WIRE_INFO), 0u);
  EXPECT_EQ(other.count_of(WIRE_INFO), 1u);
}

TEST_F(GreetedHubTest, TypesOfALaterFirmwareGoThrough) {
  Program streaming = join(), idle = join();
  stream(streaming, WIRE_STREAM_CONTACT);
  Bytes later(WIRE_HEADER_BYTES + 5, 0x33);
  later[0] = WIRE_VERSION;
  later[1] = 0x60;
  Envelope packet(later);
  packet.set_sequence(line_sequence++);
  Bytes bytes;
  packet.append_frame(bytes);
  hub.from_line(bytes.data(), bytes.size());
  frame(1);
  read(streaming);
  read(idle);
  EXPECT_EQ(streaming.decoder.statistics().unknown_types, 1u);
  EXPECT_EQ(streaming.decoder.statistics().dropped_packets, 0u);
  EXPECT_EQ(idle.decoder.statistics().bytes, 0u);

  /* and a later program's commands */
  later[1] = 0xE0;
  Bytes command;
  Envelope(later).append_frame(command);
  hub.from_client(idle.client, command.data(), command.size(), now);
  Bytes line = hub.take_for_line();
  line.pop_back();
  auto went = Envelope::opened(line);
  ASSERT_TRUE(went);
  EXPECT_EQ(went->type(), 0xE0);
  say(test::make_ack(0, 1, 0xE0, WIRE_RESULT_UNKNOWN_COMMAND, went->sequence(), 0));
  read(idle);
  EXPECT_EQ(idle.heard.at(0).body.ack.sequence, 0x3333);
}

TEST_F(HubTest, AnotherVersionIsAskedAndHeardAsItIs) {
  Program one = join();
  auto asked = info_frame_of_version(WIRE_VERSION + 1);
  hub.from_client(one.client, asked.data(), asked.size(), now);
  EXPECT_EQ(hub.take_for_line(), asked);
  hub.from_line(asked.data(), asked.size());
  read(one);
  EXPECT_EQ(one.decoder.statistics().version_errors, 1u);
  EXPECT_EQ(one.decoder.other_version(), WIRE_VERSION + 1);

  /* Such a fingertip knows the loader's baud rate only. */
  EXPECT_FALSE(hub.take_loader_wish());
  command(one, command_loader());
  EXPECT_TRUE(hub.take_loader_wish());
  EXPECT_FALSE(hub.take_loader_wish());
  commands();
  greet();
  command(one, command_loader());
  EXPECT_EQ(command_on_line(WIRE_CMD_LOADER).body.cmd_loader.magic, WIRE_LOADER_MAGIC);
  EXPECT_FALSE(hub.take_loader_wish()) << "one that speaks this version";
}

TEST_F(GreetedHubTest, DamageOfAClientDoesNotReachTheLine) {
  Program one = join();
  auto bytes = frame_bytes(command_info());
  bytes[5] = static_cast<std::uint8_t>(bytes[5] ^ 0x44);
  hub.from_client(one.client, bytes.data(), bytes.size(), now);
  Bytes noise(5000, 0x55);
  hub.from_client(one.client, noise.data(), noise.size(), now);
  EXPECT_TRUE(hub.take_for_line().empty());
  noise = {0};
  hub.from_client(one.client, noise.data(), noise.size(), now);
  command(one, command_info());
  EXPECT_EQ(commands().size(), 1u);
}

TEST_F(GreetedHubTest, ALineThatDoesNotAnswerIsNotFlooded) {
  Program one = join();
  std::size_t sent = 0;
  for (; hub.takes_commands(now) && sent < 1000; sent++) {
    command(one, command_info());
  }
  EXPECT_EQ(sent, Hub::MOST_UNANSWERED);
  auto asked = commands();
  answer(asked[0]);
  EXPECT_TRUE(hub.takes_commands(now)) << "one was answered";
  EXPECT_TRUE(hub.takes_commands(now + seconds(2))) << "the others never may be";
  now += seconds(2);
  answer(asked[1]);
  read(one);
  EXPECT_EQ(one.count_of(WIRE_ACK), 2u) << "late is not lost";
  now += seconds(20);
  hub.tick(now);
  answer(asked[2]);
  read(one);
  EXPECT_EQ(one.count_of(WIRE_ACK), 2u) << "but once it is forgotten";
}

TEST_F(HubTest, AJoinInTheMiddleOfAFrameIsNoDamage) {
  Program one = join();
  auto bytes = frame_bytes(test::make_contact(1, 1, 1));
  hub.from_line(bytes.data() + 30, bytes.size() - 30);
  read(one);
  EXPECT_EQ(one.decoder.statistics().bytes, 0u);
}

TEST(LineServer, LeavesTheSocketOfALiveOne) {
  const std::string path = testing::TempDir() + "fingertip-lines-" + std::to_string(getpid());
  const LineServer first(path, {});
  EXPECT_THROW(LineServer(path, {}), Error);
  EXPECT_TRUE(SocketTransport::is_served(path));
}
