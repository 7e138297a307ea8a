#include "cli/commands/commands.hpp"
#include "cli/device.hpp"
#include "libfingertip/command.hpp"

#include <cstdio>
#include <memory>

namespace fingertip {

namespace {

int tare(const Choice &choice) {
  Device device(choice);
  wire_info info = device.session.info().body.info;
  device.session.command(
      command_stream(possible_streams(info, WIRE_STREAM_CONTACT | WIRE_STREAM_RAW)));
  bool tared = false;
  bool acknowledged = false;
  std::int64_t last_frame_us = steady_now_us();
  device.session.on_packet([&](const wire_packet &packet) {
    if (packet.type == WIRE_ACK && packet.body.ack.command == WIRE_CMD_TARE) {
      acknowledged = true;
    } else if (packet.type == WIRE_CONTACT || packet.type == WIRE_RAW) {
      std::uint32_t flags =
          packet.type == WIRE_RAW ? packet.body.raw.flags : packet.body.contact.flags;
      last_frame_us = steady_now_us();
      tared = acknowledged && (flags & CONTACT_FLAG_TARED);
    }
  });
  device.session.command(command_tare());
  constexpr std::int64_t patience_us = 12000000; /* the slowest frame rate is one in 10 s */
  while (!tared) {
    if (stop_requested()) {
      throw Interrupted();
    }
    if (device.session.poll(std::chrono::milliseconds(50)) == Transport::Result::gone) {
      throw Gone(device.transport->description() + ": vanished while taring");
    }
    if (steady_now_us() - last_frame_us > patience_us) {
      throw Error("no frames while taring; see that its sensors answer (fingertip info)");
    }
  }
  device.session.command(command_stream(0));
  std::printf("tared\n");
  return 0;
}

} // namespace

void add_tare(CommandLine &line) {
  auto choice = std::make_shared<Choice>();
  with_port(line.add("tare", "Measure the zero of every sensor anew; nothing may touch the pad",
                     [choice] { return tare(*choice); }),
            *choice);
}

} // namespace fingertip
