/* Prints where a fingertip is touched, and how hard. */
#include <cstdio>
#include <fingertip/command.hpp>
#include <fingertip/connection.hpp>
#include <fingertip/names.hpp>

int main() try {
  auto transport = fingertip::open_endpoint(fingertip::choose_endpoint({}));
  fingertip::Session session(*transport);
  session.on_packet([](const wire_packet &packet) {
    const wire_contact &contact = packet.body.contact;
    if (packet.type != WIRE_CONTACT || !(contact.flags & CONTACT_FLAG_FIT_VALID)) {
      return; // no contact, or nothing that could be fitted
    }
    std::uint32_t warnings = contact.flags & fingertip::warning_flags();
    if (warnings == 0) {
      std::printf("%.2f mm %.2f mm %.2f N\n", contact.x_mm, contact.y_mm, contact.force_N);
    } else {
      std::printf("not to be trusted: %s\n", fingertip::flags_text(warnings).c_str());
    }
  });
  session.command(fingertip::command_stream(WIRE_STREAM_CONTACT));
  while (session.poll(std::chrono::milliseconds(100)) != fingertip::Transport::Result::gone) {
    std::fflush(stdout);
  }
} catch (const fingertip::Error &error) {
  std::fprintf(stderr, "follow: %s\n", error.what());
  return 1;
}
