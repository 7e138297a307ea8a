/* One of the programs on a fingertip, for the measurement of tools.py.
 *
 *   serve_client SERIAL|PATH LAST_FRAME ARRIVALS
 *
 * SERIAL: of a fingertip that is shared; reads contact and raw until after LAST_FRAME and sends a
 * command ten times a second, at the same moments as every other client. PATH: of a terminal that
 * is only listened to. ARRIVALS: "frame us" of each contact packet, us of CLOCK_MONOTONIC. Prints
 * what it got as JSON. */
#include "libfingertip/command.hpp"
#include "libfingertip/connection.hpp"
#include "libfingertip/session.hpp"
#include "libfingertip/text.hpp"

#include <cstdio>
#include <fstream>
#include <iterator>
#include <poll.h>
#include <string>
#include <unistd.h>
#include <vector>

using namespace fingertip;
using std::chrono::milliseconds;

namespace {

constexpr std::int64_t TICK_us = 100000;
/* For the last answers, and where nothing comes any more. */
constexpr std::int64_t LAST_ANSWERS_us = 3000000, SILENCE_us = 10000000;

wire_packet nth_command(std::int64_t n) {
  const wire_packet all[] = {command_health(),          command_slip(0.5F, 100), command_tare(true),
                             command_rate_mHz(1308000), command_info(),          command_location_limit(0.5F)};
  return all[static_cast<std::size_t>(n) % std::size(all)];
}

struct Got {
  std::uint32_t last_frame;
  std::uint32_t first = 0;
  std::uint64_t contacts = 0, raws = 0, acks = 0;
  bool is_complete = false; /* nothing before the end can come any more */
  std::vector<std::pair<std::uint32_t, std::int64_t>> arrivals;

  void take(const wire_packet &packet) {
    std::int64_t now_us = steady_now_us();
    if (packet.type == WIRE_CONTACT) {
      std::uint32_t frame = packet.body.contact.frame;
      is_complete = is_complete || frame > last_frame;
      if (frame <= last_frame) {
        first = first ? first : frame;
        contacts++;
        arrivals.emplace_back(frame, now_us);
      }
    } else if (packet.type == WIRE_RAW && first && packet.body.raw.frame <= last_frame) {
      raws++;
    } else if (packet.type == WIRE_ACK) {
      acks++;
    }
  }
};

bool is_over() {
  pollfd waiting = {STDIN_FILENO, POLLIN, 0};
  return poll(&waiting, 1, 0) > 0;
}

} // namespace

int main(int argc, char **argv) {
  if (argc != 4 || !to_u64(argv[2])) {
    std::fprintf(stderr, "usage: serve_client SERIAL|PATH LAST_FRAME ARRIVALS\n");
    return 2;
  }
  try {
    std::string name = argv[1];
    bool listens = name[0] == '/';
    auto transport = open_way(listens ? Way{"", name, false} : choose_way({"", name, Reach::socket}));
    Session session(*transport);
    Got got;
    got.last_frame = static_cast<std::uint32_t>(*to_u64(argv[2]));
    if (!listens) {
      session.info();
      session.command(command_stream(WIRE_STREAM_CONTACT | WIRE_STREAM_RAW));
    }
    session.on_packet([&](const wire_packet &packet) { got.take(packet); });
    std::uint64_t sent = 0;
    bool gone = false;
    std::int64_t heard_us = steady_now_us();
    for (std::int64_t tick = heard_us / TICK_us; !got.is_complete && !gone;) {
      std::int64_t now_us = steady_now_us();
      if (!listens && now_us / TICK_us > tick) {
        tick = now_us / TICK_us;
        sent += session.send(nth_command(tick)) ? 1 : 0;
      }
      auto wait = milliseconds((TICK_us - now_us % TICK_us) / 1000 + 1);
      auto result = session.poll(wait);
      gone = result == Transport::Result::gone || (!listens && now_us - heard_us > SILENCE_us);
      heard_us = result == Transport::Result::data ? now_us : heard_us;
    }
    std::int64_t until_us = steady_now_us() + LAST_ANSWERS_us;
    while (!gone && (listens ? !is_over() : got.acks < sent && steady_now_us() < until_us)) {
      gone = session.poll(milliseconds(50)) == Transport::Result::gone;
    }
    std::ofstream arrivals(argv[3]);
    for (const auto &[frame, us] : got.arrivals) {
      arrivals << frame << " " << us << "\n";
    }
    if (!arrivals.flush()) {
      throw Error(ErrorCode::cannot_write, std::string(argv[3]) + ": cannot write");
    }
    const LineStatistics &line = session.statistics();
    std::printf("{\"first\": %u, \"contacts\": %llu, \"raws\": %llu, \"sent\": %llu, \"answered\": "
                "%llu, \"dropped\": %llu, \"damaged\": %llu, \"gone\": %s}\n",
                got.first, static_cast<unsigned long long>(got.contacts), static_cast<unsigned long long>(got.raws),
                static_cast<unsigned long long>(sent), static_cast<unsigned long long>(got.acks),
                static_cast<unsigned long long>(line.dropped_packets + line.out_of_order),
                static_cast<unsigned long long>(line.crc_errors + line.format_errors), gone ? "true" : "false");
    return 0;
  } catch (const Error &error) {
    std::fprintf(stderr, "serve_client: %s\n", error.what());
    return 1;
  }
}
