// A conversation with what may be a fingertip: answers that are right, late, damaged or none.
#include "fuzz.h"
#include "libfingertip/command.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/session.hpp"
#include "line.hpp"

using namespace fingertip;

// Nothing waits: each reading takes what the input has next, and at its end the port is gone.
class Said : public Transport {
public:
  explicit Said(fuzz_input &input) : input_(input) { wire_receiver_init(&commands_, wire_commands); }

  Result read(std::uint8_t *bytes, std::size_t capacity, std::size_t *length, std::chrono::milliseconds) override {
    *length = 0;
    if (fuzz_left(&input_) == 0) {
      return Result::gone;
    }
    Bytes line;
    const std::uint8_t how = fuzz_u8(&input_);
    if (how < 0x10) {
      return Result::timeout;
    }
    if (how < 0x80) {
      answer(line, how);
    } else {
      fuzz::append_part(line, input_);
    }
    *length = std::min(capacity, line.size());
    std::copy_n(line.begin(), *length, bytes);
    return *length > 0 ? Result::data : Result::timeout;
  }

  bool write(const std::uint8_t *bytes, std::size_t length) override {
    for (std::size_t i = 0; i < length; i++) {
      wire_packet packet;
      if (wire_receive(&commands_, bytes[i], &packet) == FT_OK) {
        asked_ = packet;
      }
    }
    return true;
  }

  bool reopen() override { return true; }
  std::string description() const override { return "fuzz"; }

private:
  void answer(Bytes &line, std::uint8_t how) {
    wire_packet packet{};
    packet.type = WIRE_ACK;
    packet.t_us = how & 1 ? fuzz_u64(&input_) : 5;
    packet.body.ack.command = asked_.type;
    packet.body.ack.sequence = static_cast<std::uint16_t>(asked_.sequence - (how & 2 ? fuzz_u8(&input_) : 0));
    packet.body.ack.result = how & 4 ? fuzz_u8(&input_) : 0;
    packet.body.ack.host_time_us = how & 8 ? fuzz_u64(&input_) : asked_.t_us;
    line = frame_bytes(packet);
    if (how & 0x10) {
      packet = {};
      packet.type = asked_.type == WIRE_CMD_INFO ? WIRE_INFO : WIRE_HEALTH;
      packet.body.info.sensor_count = 15;
      const auto more = frame_bytes(packet);
      line.insert(line.end(), more.begin(), more.end());
    }
  }

  fuzz_input &input_;
  wire_receiver commands_;
  wire_packet asked_{};
};

void fuzz_one(const uint8_t *bytes, size_t length) {
  fuzz_input input = {bytes, bytes + length};
  Said said(input);
  Session session(said);
  const Session::Policy patient = {std::chrono::minutes(10), 3};
  while (fuzz_left(&input) > 0) {
    try {
      switch (fuzz_u8(&input) % 4) {
      case 0: {
        const wire_packet packet = session.info(patient);
        FUZZ_CHECK(packet.type == WIRE_INFO);
        FUZZ_CHECK(packet.body.info.sensor_count >= 1 && packet.body.info.sensor_count <= FT_MAX_SENSORS);
        break;
      }
      case 1: FUZZ_CHECK(session.health().type == WIRE_HEALTH); break;
      case 2: session.command(command_tare(), patient); break;
      default: session.poll(std::chrono::milliseconds(1));
      }
    } catch (const Gone &) {
    } catch (const Error &error) {
      FUZZ_CHECK(error.what()[0] != 0);
    }
    FUZZ_CHECK(!session.clock() || session.clock()->uncertainty_us >= 0);
  }
}
