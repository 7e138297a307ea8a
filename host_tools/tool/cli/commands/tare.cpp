#include "libfingertip/command.hpp"
#include "libfingertip/text.hpp"
#include "tool/cli/command_line.hpp"
#include "tool/cli/device.hpp"

#include <cstdio>
#include <memory>

namespace fingertip {

namespace {

struct TareOptions {
  Choice choice;
  bool force = false;
};

/* Follows the frames around the command. */
class Tare {
public:
  explicit Tare(Device &device) : device_(device) {
    device.session.on_packet([this](const wire_packet &packet) { take(packet); });
  }

  void run(bool force) {
    try {
      device_.session.command(command_tare(force));
    } catch (const Error &error) {
      if (error.code() != ErrorCode::not_now) {
        throw;
      }
      wait_for([this] { return frames_ > 0; });
      if (!(flags_ & CONTACT_FLAG_CONTACT)) {
        throw;
      }
      throw Error("not tared, it reports a contact" + force_text() +
                  "; let go of the pad, or --force where nothing touches it");
    }
    wait_for([this] { return tared_; });
  }

private:
  void take(const wire_packet &packet) {
    if (packet.type == WIRE_ACK && packet.body.ack.command == WIRE_CMD_TARE) {
      acknowledged_ = true;
    } else if (packet.type == WIRE_CONTACT || packet.type == WIRE_RAW) {
      bool raw = packet.type == WIRE_RAW;
      flags_ = raw ? packet.body.raw.flags : packet.body.contact.flags;
      if (!raw) {
        force_N_ = packet.body.contact.force_N;
      }
      last_frame_us_ = steady_now_us();
      frames_++;
      tared_ = acknowledged_ && (flags_ & CONTACT_FLAG_TARED);
    }
  }

  std::string force_text() const { return force_N_ > 0 ? " of " + fixed(force_N_, 2) + " N" : ""; }

  template <typename Condition> void wait_for(Condition condition) {
    constexpr std::int64_t patience_us = 12000000; /* the slowest frame rate is one in 10 s */
    while (!condition()) {
      if (stop_requested()) {
        throw Interrupted();
      }
      if (device_.session.poll(std::chrono::milliseconds(50)) == Transport::Result::gone) {
        throw Gone(device_.transport->description() + ": vanished while taring");
      }
      if (steady_now_us() - last_frame_us_ > patience_us) {
        throw Error("no frames while taring; see that its sensors answer (fingertip info)");
      }
    }
  }

  Device &device_;
  std::int64_t last_frame_us_ = steady_now_us();
  std::uint32_t flags_ = 0;
  float force_N_ = 0;
  int frames_ = 0;
  bool acknowledged_ = false, tared_ = false;
};

int tare(const TareOptions &options) {
  Device device(options.choice);
  wire_info info = device.session.info().body.info;
  Tare taring(device);
  device.session.command(command_stream(possible_streams(info, WIRE_STREAM_CONTACT | WIRE_STREAM_RAW)));
  taring.run(options.force);
  device.session.command(command_stream(0));
  std::printf("tared\n");
  return 0;
}

} // namespace

void add_tare(CommandLine &line) {
  auto options = std::make_shared<TareOptions>();
  CLI::App *tare_command = line.add("tare", "Measure the zero of every sensor; nothing may touch the pad",
                                    [options] { return tare(*options); });
  with_port(tare_command, options->choice);
  tare_command->add_flag("--force", options->force,
                         "Tare even if a contact is reported, though nothing touches the pad");
}

} // namespace fingertip
