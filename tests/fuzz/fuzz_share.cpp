// The share socket's hub: clients that say anything, a fingertip that answers, or says anything.
#include "fuzz.h"
#include "libfingertip/command.hpp"
#include "libfingertip/decoder.hpp"
#include "library/share/hub.hpp"
#include "line.hpp"

#include <map>
#include <set>

using namespace fingertip;

constexpr std::size_t QUEUE_BYTES = 4096;

struct Program {
  Decoder decoder;
  std::set<std::pair<std::uint8_t, std::uint16_t>> asked;
};

class Scene {
public:
  explicit Scene(fuzz_input input) : input_(input) { wire_receiver_init(&commands_, wire_commands); }

  void run() {
    while (fuzz_left(&input_) > 0) {
      step();
      hub_.tick(now_);
      follow_line();
    }
    for (auto &[client, program] : programs_) {
      take(client, SIZE_MAX);
    }
  }

private:
  void step() {
    switch (fuzz_u8(&input_) % 10) {
    case 0:
      if (programs_.size() < 5) {
        programs_[hub_.join()];
      }
      break;
    case 1:
      if (Program *program = some()) {
        (void)program;
        hub_.leave(client_);
        programs_.erase(client_);
      }
      break;
    case 2:
    case 3: command(); break;
    case 4: {
      Bytes line;
      fuzz::append_part(line, input_);
      said_anything_ = true;
      hub_.from_line(line.data(), line.size());
      break;
    }
    case 5: now_ += std::chrono::milliseconds(fuzz_u16(&input_)); break;
    case 6:
      if (some()) {
        take(client_, fuzz_u16(&input_));
      }
      break;
    case 7: stream(); break;
    default: answer();
    }
  }

  Program *some() {
    if (programs_.empty()) {
      return nullptr;
    }
    auto at = programs_.begin();
    std::advance(at, fuzz_u8(&input_) % programs_.size());
    client_ = at->first;
    return &at->second;
  }

  void command() {
    Program *program = some();
    if (!program) {
      return;
    }
    Bytes line;
    fuzz::append_part(line, input_);
    FrameCutter cutter;
    const auto note = [&](const Bytes &frame, bool) {
      if (const auto packet = Envelope::opened(frame)) {
        program->asked.insert({packet->type(), packet->sequence()});
      }
    };
    line.push_back(0);
    cutter.feed(line.data(), line.size(), note);
    hub_.from_client(client_, line.data(), line.size(), now_);
  }

  void follow_line() {
    for (const std::uint8_t byte : hub_.take_for_line()) {
      wire_packet packet;
      const ft_status status = wire_receive(&commands_, byte, &packet);
      if (status == FT_OK) {
        pending_.push_back(packet);
      }
    }
    if (pending_.size() > 64) {
      pending_.erase(pending_.begin(), pending_.end() - 64);
    }
  }

  void say(wire_packet packet) {
    packet.sequence = sequence_++;
    const auto bytes = frame_bytes(packet);
    hub_.from_line(bytes.data(), bytes.size());
  }

  // To one of the commands, not always the first, and sometimes with a loss before it.
  void answer() {
    if (pending_.empty()) {
      return;
    }
    const std::uint8_t how = fuzz_u8(&input_);
    const auto at = pending_.begin() + (how & 7) % static_cast<std::ptrdiff_t>(pending_.size());
    const wire_packet asked = *at;
    pending_.erase(at);
    sequence_ = static_cast<std::uint16_t>(sequence_ + (how & 8 ? fuzz_u8(&input_) : 0));
    wire_packet packet{};
    packet.type = WIRE_ACK;
    packet.body.ack.command = asked.type;
    packet.body.ack.sequence = asked.sequence;
    packet.body.ack.result = how & 16 ? fuzz_u8(&input_) : 0;
    say(packet);
    if (asked.type == WIRE_CMD_INFO) {
      packet = {};
      packet.type = WIRE_INFO;
      packet.body.info.sensor_count = 1;
      packet.body.info.capabilities = fuzz_u8(&input_);
      say(packet);
    } else if (asked.type == WIRE_CMD_HEALTH) {
      packet = {};
      packet.type = WIRE_HEALTH;
      say(packet);
    }
  }

  void stream() {
    wire_packet packet{};
    packet.type = fuzz_u8(&input_) & 1 ? WIRE_CONTACT : WIRE_RAW;
    packet.body.raw.sensor_count = packet.type == WIRE_RAW ? 15 : 0;
    say(packet);
  }

  // What a client hears is whole, and of answers only those to its own commands.
  void take(Hub::Client client, std::size_t most) {
    Program &program = programs_.at(client);
    std::size_t length = 0;
    const std::uint8_t *bytes = hub_.waiting(client, &length);
    FUZZ_CHECK(length <= QUEUE_BYTES);
    length = std::min(length, most);
    program.decoder.feed(bytes, length, [&](const wire_packet &packet) {
      if (packet.type == WIRE_ACK) {
        FUZZ_CHECK(program.asked.count({packet.body.ack.command, packet.body.ack.sequence}) != 0);
      }
    });
    if (!said_anything_) {
      FUZZ_CHECK(program.decoder.statistics().crc_errors == 0);
      FUZZ_CHECK(program.decoder.statistics().format_errors == 0);
      FUZZ_CHECK(program.decoder.statistics().out_of_order == 0 || hub_.lost(client) > 0);
    }
    hub_.took(client, length);
  }

  fuzz_input input_;
  Hub hub_{QUEUE_BYTES};
  Hub::Time now_{std::chrono::seconds(100)};
  std::map<Hub::Client, Program> programs_;
  Hub::Client client_ = 0;
  wire_receiver commands_;
  std::vector<wire_packet> pending_;
  std::uint16_t sequence_ = 0; // of the fingertip
  bool said_anything_ = false;
};

void fuzz_one(const uint8_t *bytes, size_t length) { Scene({bytes, bytes + length}).run(); }
