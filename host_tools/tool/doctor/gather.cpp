#include "tool/doctor/gather.hpp"

#include "libfingertip/command.hpp"
#include "libfingertip/packet_fields.hpp"
#include "libfingertip/session.hpp"

#include <cstdio>
#include <filesystem>

namespace fingertip {

namespace {

/* One that starts answers within a second. */
constexpr Session::Policy PATIENCE = {std::chrono::milliseconds(1000), 4};
/* The slowest frame rate is one in 10 s. */
constexpr std::int64_t SILENCE_MAX_us = 12000000;

/* What somebody who has it has open. */
std::string device_of(const Way &way, const std::string &root) {
  if (!way.port.empty()) {
    return way.port;
  }
  for (const Found &found : find_usb(root)) {
    if (found.usb && is_same_serial(found.serial, way.serial)) {
      char name[32];
      std::snprintf(name, sizeof name, "dev/bus/usb/%03u/%03u", found.usb->bus, found.usb->address);
      return (std::filesystem::path(root) / name).string();
    }
  }
  return "";
}

LineStatistics less(LineStatistics now, const LineStatistics &then) {
  now.bytes -= then.bytes;
  now.packets -= then.packets;
  now.dropped_packets -= then.dropped_packets;
  now.out_of_order -= then.out_of_order;
  now.crc_errors -= then.crc_errors;
  now.format_errors -= then.format_errors;
  return now;
}

/* What it was built into, seen from the source's folder. */
std::string usual_elf(const wire_info &info) {
  std::string board = text_field(info.board);
  return "build/" + board + "/fingertip-" + board + ".elf";
}

/* An image is known by what cmake/write_build_info.cmake marks in it. */
Crash read_crash(const crash_record &record, const wire_info &info, const std::string &elf) {
  std::string path = elf.empty() ? usual_elf(info) : elf;
  std::error_code ignored;
  if (elf.empty() && !std::filesystem::exists(path, ignored)) {
    return with_places(record, std::nullopt);
  }
  Symbols symbols = Symbols::of_file(path);
  auto is_marked = [&](const std::string &mark, const char *field) {
    return symbols.holds("fingertip-" + mark + "=" + text_field(field) + '\0');
  };
  if (is_marked("git", info.git_hash) && is_marked("board", info.board) && is_marked("scene", info.scene)) {
    return with_places(record, symbols);
  }
  Crash crash = with_places(record, std::nullopt);
  crash.symbols_note = path + " is of other firmware: no names";
  return crash;
}

/* Nothing of firmware that does not know the question. */
void ask_for_crash(Session &session, Facts &facts, const std::string &elf) {
  try {
    crash_record record = session.crash().body.crash;
    if (record.kind != CRASH_NONE) {
      facts.crash = read_crash(record, *facts.info, elf);
    }
  } catch (const Error &error) {
    if (error.code() != ErrorCode::unknown_command) {
      throw;
    }
  }
}

void measure(Session &session, Facts &facts, const std::string &elf, double seconds, const std::function<bool()> &stop,
             const std::function<void(double)> &progress) {
  RestMeter meter;
  std::int64_t last_us = steady_now_us();
  session.on_packet([&](const wire_packet &packet) {
    if (packet.type == WIRE_CONTACT || packet.type == WIRE_RAW) {
      last_us = steady_now_us();
    }
    meter.add(packet);
  });
  facts.before = session.health().body.health;
  ask_for_crash(session, facts, elf);
  LineStatistics before = session.statistics();
  session.command(command_stream(possible_streams(*facts.info, WIRE_STREAM_CONTACT | WIRE_STREAM_RAW)), PATIENCE);
  while (meter.seconds() < seconds && steady_now_us() - last_us < SILENCE_MAX_us) {
    if (stop()) {
      throw Interrupted();
    }
    if (session.poll(std::chrono::milliseconds(50)) == Transport::Result::gone) {
      throw Gone(facts.port + ": vanished while it was examined");
    }
    progress(meter.seconds() / seconds);
  }
  facts.line = less(session.statistics(), before);
  facts.rest = meter.result();
  facts.after = session.health().body.health;
  ask_for_crash(session, facts, elf); /* it may have crashed meanwhile */
  session.on_packet({});
  session.command(command_stream(0), PATIENCE);
}

} // namespace

Facts gather(const Examination &examination, const std::function<bool()> &stop,
             const std::function<void(double)> &progress) {
  if (!examination.elf.empty()) {
    Symbols::of_file(examination.elf);
  }
  Facts facts;
  facts.rule = find_rule(examination.root);
  try {
    facts.port = examination.choice.port;
    Way way = choose_way(examination.choice, examination.root);
    facts.is_shared = !way.socket.empty();
    facts.port = device_of(way, examination.root);
    facts.holders = holders_of(facts.port, examination.root);
    auto transport = open_way(way, examination.root);
    facts.port = transport->description();
    Session session(*transport, stop);
    facts.info = session.info(PATIENCE).body.info;
    measure(session, facts, examination.elf, examination.seconds, stop, progress);
  } catch (const Error &error) {
    facts.failure = Failure{error.code(), error.what()};
    if (!facts.port.empty() && facts.holders.seen.empty()) {
      facts.holders = holders_of(facts.port, examination.root);
    }
  }
  return facts;
}

} // namespace fingertip
