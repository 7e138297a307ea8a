#include "libfingertip/command.hpp"
#include "libfingertip/session.hpp"
#include "support/host_packets.hpp"

#include <deque>
#include <gtest/gtest.h>

using namespace fingertip;
using std::chrono::milliseconds;

/* A line in memory: what the host writes is answered by a function. */
class FakeTransport : public Transport {
public:
  std::function<void(const wire_packet &)> on_command = [](const wire_packet &) {};
  std::vector<wire_packet> commands;
  bool gone = false;

  void answer(const wire_packet &command, std::uint8_t result = WIRE_RESULT_DONE, std::uint64_t t_us = 5000) {
    say(test::make_ack(1, t_us, command.type, result, command.sequence, command.t_us));
  }
  void say(const wire_packet &packet) {
    for (std::uint8_t byte : frame_bytes(packet)) {
      waiting_.push_back(byte);
    }
  }
  Result read(std::uint8_t *bytes, std::size_t capacity, std::size_t *length, milliseconds) override {
    *length = 0;
    while (*length < capacity && !waiting_.empty()) {
      bytes[(*length)++] = waiting_.front();
      waiting_.pop_front();
    }
    return *length ? Result::data : gone ? Result::gone : Result::timeout;
  }
  bool write(const std::uint8_t *bytes, std::size_t length) override {
    for (std::size_t i = 0; i < length; i++) {
      wire_packet packet;
      if (wire_receive(&receiver_, bytes[i], &packet) == FT_OK) {
        commands.push_back(packet);
        on_command(packet);
      }
    }
    return true;
  }
  bool reopen() override { return !gone; }
  std::string description() const override { return "fake"; }
  FakeTransport() { wire_receiver_init(&receiver_, wire_commands); }

private:
  std::deque<std::uint8_t> waiting_;
  wire_receiver receiver_;
};

const Session::Policy QUICK = {milliseconds(20), 3};

static std::string error_of(const std::function<void()> &action) {
  try {
    action();
  } catch (const Error &error) {
    return error.what();
  }
  return "";
}

TEST(Session, RepeatsACommandUntilItIsAcknowledged) {
  FakeTransport line;
  int deaf = 2;
  line.on_command = [&](const wire_packet &command) {
    if (deaf-- <= 0) {
      line.answer(command);
    }
  };
  Session session(line);
  session.command(command_tare(), QUICK);
  ASSERT_EQ(line.commands.size(), 3u);
  EXPECT_NE(line.commands[0].sequence, line.commands[2].sequence);
}

TEST(Session, TakesALateAnswerToAnEarlierAttempt) {
  FakeTransport line;
  line.on_command = [&](const wire_packet &) {
    if (line.commands.size() == 2) {
      line.answer(line.commands[0]);
    }
  };
  Session session(line);
  session.command(command_tare(), QUICK);
  EXPECT_EQ(line.commands.size(), 2u);
}

TEST(Session, ARepeatThatIsRefusedWhileTheFirstIsObeyedIsNoRefusal) {
  for (bool first_is_obeyed : {true, false}) {
    FakeTransport line;
    line.on_command = [&](const wire_packet &command) {
      if (line.commands.size() > 1) {
        line.answer(command, WIRE_RESULT_NOT_NOW);
      }
      if (line.commands.size() == 3 && first_is_obeyed) {
        line.answer(line.commands[0]);
      }
    };
    Session session(line);
    EXPECT_EQ(error_of([&] { session.command(command_keep(true), QUICK); }).find("refused"), first_is_obeyed ? std::string::npos : 14);
    EXPECT_EQ(line.commands.size(), 3u);
  }
}

TEST(Session, AnswersToOthersDoNotCount) {
  FakeTransport line;
  line.on_command = [&](const wire_packet &command) {
    auto stale = static_cast<std::uint16_t>(command.sequence - 1000);
    line.say(test::make_ack(1, 1, command.type, WIRE_RESULT_DONE, stale, 1));
    line.say(test::make_ack(2, 2, WIRE_CMD_OSR, WIRE_RESULT_DONE, command.sequence, 1));
  };
  Session session(line);
  EXPECT_NE(error_of([&] { session.command(command_tare(), QUICK); }).find("no answer to \"tare\""), std::string::npos);
  EXPECT_EQ(line.commands.size(), 3u);
}

TEST(Session, ARefusalIsAnErrorAtOnce) {
  FakeTransport line;
  line.on_command = [&](const wire_packet &command) { line.answer(command, WIRE_RESULT_NOT_NOW); };
  Session session(line);
  EXPECT_NE(error_of([&] { session.command(command_tare(), QUICK); }).find("refused \"tare\": not possible now"), std::string::npos);
  EXPECT_EQ(line.commands.size(), 1u);
}

TEST(Session, NoPacketIsLostToWaiting) {
  FakeTransport line;
  std::uint16_t sequence = 0;
  line.on_command = [&](const wire_packet &command) {
    line.say(test::make_contact(sequence++, 1, 1));
    line.say(test::make_ack(sequence++, 2, command.type, WIRE_RESULT_DONE, command.sequence, command.t_us));
    line.say(test::make_contact(sequence++, 3, 2));
    line.say(test::make_info(sequence++, 4));
    line.say(test::make_contact(sequence++, 5, 3));
  };
  Session session(line);
  std::vector<int> types;
  session.on_packet([&](const wire_packet &packet) { types.push_back(packet.type); });
  wire_packet info = session.info();
  EXPECT_EQ(info.sequence, 3);
  EXPECT_EQ(info.body.info.osr, 1024);
  EXPECT_EQ(types, (std::vector<int>{WIRE_CONTACT, WIRE_ACK, WIRE_CONTACT, WIRE_INFO, WIRE_CONTACT}));
  EXPECT_EQ(session.statistics().dropped_packets, 0u);
}

/* The difference of the last two has no room for a sign, of which the sanitizers tell. */
TEST(Session, RelatesTheClocksWhateverTimeADeviceReports) {
  for (const std::uint64_t device_us :
       {static_cast<std::uint64_t>(steady_now_us()) - 1000000u, std::uint64_t{1} << 63, std::uint64_t{UINT64_MAX}}) {
    FakeTransport line;
    line.on_command = [&](const wire_packet &command) { line.answer(command, WIRE_RESULT_DONE, device_us); };
    Session session(line);
    EXPECT_FALSE(session.clock());
    const auto sent_us = static_cast<std::uint64_t>(steady_now_us());
    session.command(command_tare(), QUICK);
    ASSERT_TRUE(session.clock());
    const auto host_us = device_us - static_cast<std::uint64_t>(session.clock()->device_minus_host_us);
    EXPECT_LE(host_us - sent_us, 1000000u);
    EXPECT_LE(session.clock()->uncertainty_us, 1000000);
  }
}
