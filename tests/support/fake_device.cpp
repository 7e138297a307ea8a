/* A fingertip without firmware, for tests of the host tools: serves a port with the wire protocol's own codec.
 *
 *   fake_device LINK [key=value]...
 *     rate=HZ          frames a second, default 200
 *     frames=N         leave after this many frames, once they were read
 *     vanish=AT,BACK   the port goes after AT frames, once they were read, and is back BACK ms
 *                      later, restarted
 *     pulled=1         leaves at the first byte that it hears
 *     heard=FILE       made at the first byte that it hears
 *     drop=N           every Nth frame loses its packets
 *     flip=N           every Nth frame has a flipped bit
 *     stall=N          says nothing more after N frames
 *     flags=BITS       of every contact packet; and whether they are tared, of raw packets
 *     absent=K,K...    these sensors are not there
 *     health=N         a health packet after every Nth frame, before its raw packet is sent; else
 *                      one after the first frame
 *     edges=N          an edge at the sync pin after every Nth frame, but for the third of them
 *     tared=FILE       made when a tare is asked for
 *     mute=1           never says anything
 *     refuse=1         answers every command but stream, info, health and crash with "not now"
 *     calibrated=1     a calibration is stored
 *     pad=1            a pad's profile is stored
 *     capabilities=BITS  of its firmware
 *     play=FILE        its raw and contact packets, and its sensors, are those of this recording,
 *                      as fast as they are read; then nothing more
 *     serial=HEX       its serial number; board=NAME, git=HASH, firmware=A.B.C: the same
 *     loader=1         ends when it is asked into the loader, by the command or by 1200 baud
 *     version=V        speaks this protocol version, answers nothing else
 *     clock_ppm=P      its clock is fast by so much, over the whole of its life
 *     zero_log=FILE    writes there when its clock was zero, us of CLOCK_MONOTONIC
 *     started=S        its clock was started S seconds before
 *     mirror=LINK      the same bytes, a moment before, on a second port that hears nothing
 *     tap=FILE         keeps there what it says
 *     life=S           ends after this time, default 60
 *
 * Ends by SIGTERM too. */
#include "libfingertip/command.hpp"
#include "libfingertip/recording_reader.hpp"
#include "libfingertip/served_port.hpp"
#include "libfingertip/text.hpp"
#include "support/host_packets.hpp"
#include "support/pad.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <fcntl.h>
#include <map>
#include <memory>
#include <optional>
#include <termios.h>

using Time = fingertip::HostTime;
using std::chrono::milliseconds;

static volatile std::sig_atomic_t ended = 0;

class FakeDevice {
public:
  FakeDevice(std::string link, std::map<std::string, std::string> options) : link_(std::move(link)), options_(std::move(options)) {
    wire_info &info = info_.body.info;
    set_text("serial", info.serial);
    set_text("board", info.board);
    set_text("git", info.git_hash);
    std::string firmware = options_["firmware"];
    if (!firmware.empty()) {
      auto parts = fingertip::split(firmware, '.');
      for (std::size_t i = 0; i < 3; i++) {
        info.firmware_version[i] = static_cast<std::uint8_t>(fingertip::to_u64(parts.at(i)).value_or(0));
      }
    }
    if (number("calibrated", 0)) {
      info.calibration = test::make_calibration();
      store(WIRE_STORED_CALIBRATION, true);
    }
    if (number("pad", 0)) {
      info.pad = pad_of_12_mm();
      store(WIRE_STORED_PAD, true);
    }
    if (number("capabilities", -1) >= 0) {
      info.capabilities = static_cast<std::uint32_t>(number("capabilities", 0));
    }
    if (!options_["play"].empty()) {
      read_recording(options_["play"]);
    }
    power_on();
    if (!options_["mirror"].empty()) {
      mirror_.emplace(options_["mirror"]);
    }
    if (!options_["tap"].empty()) {
      tap_.reset(std::fopen(options_["tap"].c_str(), "wb"));
    }
  }

  void run() {
    auto end = fingertip::host_now() + std::chrono::seconds(number("life", 60));
    auto next_frame = fingertip::host_now();
    auto interval = std::chrono::microseconds(1000000 / number("rate", 200));
    while (!ended && fingertip::host_now() < end) {
      if (serve(next_frame)) {
        next_frame = fingertip::host_now();
      }
      if (streams_ == 0) {
        next_frame = fingertip::host_now() + milliseconds(5);
        continue;
      }
      if (!options_["play"].empty()) {
        if (played_ < recorded_.size()) {
          const wire_packet &packet = recorded_[played_++];
          if (streams_ & (packet.type == WIRE_RAW ? WIRE_STREAM_RAW : WIRE_STREAM_CONTACT)) {
            send(packet);
          }
          next_frame = fingertip::host_now();
        } else {
          next_frame = fingertip::host_now() + milliseconds(5);
        }
        continue;
      }
      for (; next_frame <= fingertip::host_now() && streams_ != 0; next_frame += interval) {
        send_frame(next_frame);
        long vanish = number("vanish", 0);
        if (vanish && frame_ == vanish && !vanished_) {
          vanished_ = true;
          std::string text = options_["vanish"];
          wait_for_reader();
          power_off();
          fingertip::wait_until(fingertip::host_now() + milliseconds(std::atol(text.c_str() + text.find(',') + 1)));
          power_on();
        }
        if (frame_ == number("frames", -1)) {
          wait_for_reader();
          return;
        }
      }
    }
  }

private:
  long number(const char *key, long otherwise) const {
    auto option = options_.find(key);
    return option == options_.end() ? otherwise : std::atol(option->second.c_str());
  }

  void read_recording(const std::string &path) {
    fingertip::RecordingReader reader(path, false);
    while (auto item = reader.next()) {
      if (item->kind != fingertip::RecordingReader::Item::Kind::packet) {
        continue;
      }
      if (item->packet.type == WIRE_RAW || item->packet.type == WIRE_CONTACT) {
        recorded_.push_back(item->packet);
      } else if (item->packet.type == WIRE_INFO) {
        wire_info &info = info_.body.info;
        info.sensor_count = item->packet.body.info.sensor_count;
        std::copy(std::begin(item->packet.body.info.x_mm), std::end(item->packet.body.info.x_mm), info.x_mm);
        std::copy(std::begin(item->packet.body.info.y_mm), std::end(item->packet.body.info.y_mm), info.y_mm);
      }
    }
  }

  void set_text(const char *key, char *field) {
    std::string text = options_[key];
    if (!text.empty()) {
      std::memset(field, 0, WIRE_TEXT_BYTES);
      std::memcpy(field, text.data(), std::min<std::size_t>(text.size(), WIRE_TEXT_BYTES));
    }
  }

  void send_health() {
    wire_packet packet = test::make_health(0, now_us());
    for (std::string_view absent : fingertip::split(options_["absent"], ',')) {
      if (auto sensor = fingertip::to_u64(absent)) {
        packet.body.health.sensors_present &= ~(1u << *sensor);
      }
    }
    send(packet);
  }

  void power_on() {
    port_.emplace(link_);
    wire_receiver_init(&receiver_, wire_commands);
    started_ = fingertip::host_now();
    if (!options_["zero_log"].empty()) {
      double ago_us = static_cast<double>(number("started", 0)) * 1e6 / clock_rate();
      std::FILE *log = std::fopen(options_["zero_log"].c_str(), "w");
      double now_us = std::chrono::duration<double, std::micro>(started_.time_since_epoch()).count();
      std::fprintf(log, "%.3f\n", now_us - ago_us);
      std::fclose(log);
    }
    streams_ = 0;
    sequence_ = 0;
    frame_ = 0;
  }

  /* A port that goes takes along what was not read yet. */
  void wait_for_reader() {
    constexpr milliseconds step{10}, settled{200}, limit{20000};
    milliseconds empty{0};
    for (milliseconds waited{0}; empty < settled && waited < limit && !ended; waited += step) {
      empty = port_->unread() > 0 ? milliseconds(0) : empty + step;
      fingertip::wait_until(fingertip::host_now() + step);
    }
  }

  void power_off() { port_.reset(); }

  double clock_rate() const { return 1 + static_cast<double>(number("clock_ppm", 0)) / 1e6; }

  std::uint64_t now_us() const { return device_us(fingertip::host_now()); }

  std::uint64_t device_us(Time at) const {
    double us = std::chrono::duration<double, std::micro>(at - started_).count();
    return static_cast<std::uint64_t>(us * clock_rate() + static_cast<double>(number("started", 0)) * 1e6);
  }

  void send(wire_packet packet, bool flip = false) {
    packet.sequence = sequence_++;
    auto bytes = fingertip::frame_bytes(packet);
    if (flip) {
      std::uint8_t &byte = bytes[bytes.size() / 2];
      byte = static_cast<std::uint8_t>(byte ^ (byte == 0x80 ? 0x40 : 0x80)); /* no delimiter */
    }
    if (mirror_) {
      write_all(*mirror_, bytes);
    }
    if (tap_) {
      std::fwrite(bytes.data(), 1, bytes.size(), tap_.get());
    }
    if (!number("mute", 0)) {
      write_all(*port_, bytes);
    }
  }

  /* Waits for who does not read. */
  static void write_all(fingertip::ServedPort &port, const std::vector<std::uint8_t> &bytes) {
    for (std::size_t done = 0; !ended;) {
      done += port.write(bytes.data() + done, bytes.size() - done);
      if (done == bytes.size()) {
        return;
      }
      port.wait(fingertip::host_now() + milliseconds(1));
    }
  }

  /* measured: when, however late it is sent. */
  void send_frame(Time measured) {
    frame_++;
    long stall = number("stall", 0), drop = number("drop", 0), flip = number("flip", 0);
    if (stall && frame_ > stall) {
      return;
    }
    std::uint64_t t_us = device_us(measured);
    auto frame = static_cast<std::uint32_t>(frame_);
    wire_packet contact = test::make_contact(0, t_us, frame);
    float angle = static_cast<float>(frame % 400) * 0.0157f;
    contact.body.contact.x_mm = 8 * std::cos(angle);
    contact.body.contact.y_mm = 16 * std::sin(angle);
    contact.body.contact.force_N = 5;
    contact.body.contact.flags = static_cast<std::uint32_t>(number("flags", contact.body.contact.flags));
    if (drop && frame_ % drop == 0) {
      sequence_ = static_cast<std::uint16_t>(sequence_ + 2);
      return;
    }
    send(contact, flip && frame_ % flip == 0);
    long health = number("health", 0);
    if (health && frame_ % health == 0) {
      send_health();
    }
    wire_packet raw = test::make_raw(0, t_us, frame);
    if (!(contact.body.contact.flags & CONTACT_FLAG_TARED)) {
      raw.body.raw.flags &= ~std::uint32_t{CONTACT_FLAG_TARED};
    }
    send(raw);
    const long edges = number("edges", 0);
    if (edges && frame_ % edges == 0 && frame_ / edges != 3) {
      wire_packet edge = test::make_packet(WIRE_SYNC, 0, t_us);
      edge.body.sync.number = static_cast<std::uint32_t>(frame_ / edges);
      edge.body.sync.level = edge.body.sync.number % 2;
      send(edge);
    }
    if (!health && frame_ == 1) {
      send_health();
    }
  }

  /* True if the streams changed. */
  bool serve(Time until) {
    port_->wait(until);
    if (number("loader", 0) && port_->speed() == B1200) {
      ended = 1;
    }
    if (!port_->is_open()) {
      streams_ = 0;
    }
    std::uint8_t bytes[256];
    const std::size_t count = port_->read(bytes, sizeof bytes);
    if (count == 0) {
      return false;
    }
    if (!options_["heard"].empty()) {
      close(open(options_["heard"].c_str(), O_WRONLY | O_CREAT, 0644));
    }
    if (number("pulled", 0)) {
      ended = 1;
      return false;
    }
    bool changed = false;
    if (long version = number("version", 0)) {
      auto known = fingertip::info_frame_of_version(static_cast<std::uint8_t>(version));
      if (std::search(bytes, bytes + count, known.begin(), known.end()) != bytes + count) {
        write_all(*port_, known); /* an empty packet will do: the version is judged first */
      }
      return false;
    }
    for (std::size_t i = 0; i < count; i++) {
      wire_packet command;
      if (wire_receive(&receiver_, bytes[i], &command) == FT_OK) {
        changed = obey(command) || changed;
      }
    }
    return changed;
  }

  bool obey(const wire_packet &command) {
    bool known = command.type == WIRE_CMD_STREAM || command.type == WIRE_CMD_INFO || command.type == WIRE_CMD_HEALTH ||
                 command.type == WIRE_CMD_CRASH;
    std::uint8_t result = number("refuse", 0) && !known ? WIRE_RESULT_NOT_NOW : WIRE_RESULT_DONE;
    send(test::make_ack(0, now_us(), command.type, result, command.sequence, command.t_us));
    if (result != WIRE_RESULT_DONE) {
      return false;
    }
    if (command.type == WIRE_CMD_TARE && !options_["tared"].empty()) {
      close(open(options_["tared"].c_str(), O_WRONLY | O_CREAT, 0644));
    }
    switch (command.type) {
    case WIRE_CMD_STREAM: {
      const bool changed = streams_ != command.body.cmd_stream.streams;
      streams_ = command.body.cmd_stream.streams;
      return changed;
    }
    case WIRE_CMD_RATE: info_.body.info.rate_mHz = command.body.cmd_rate.rate_mHz; return false;
    case WIRE_CMD_OSR: info_.body.info.osr = command.body.cmd_osr.osr; return false;
    case WIRE_CMD_SLIP:
      info_.body.info.slip_threshold_mm = command.body.cmd_slip.threshold_mm;
      info_.body.info.slip_window_ms = command.body.cmd_slip.window_ms;
      return false;
    case WIRE_CMD_PRIOR:
      info_.body.info.prior_sigma_mm = command.body.cmd_prior.sigma_mm;
      info_.body.info.prior_width_mm = command.body.cmd_prior.width_mm;
      return false;
    case WIRE_CMD_LOCATION_LIMIT: info_.body.info.location_limit_mm = command.body.cmd_location_limit.limit_mm; return false;
    case WIRE_CMD_SYNC: info_.body.info.sync = command.body.cmd_sync.mode; return false;
    case WIRE_CMD_KEEP: store(WIRE_STORED_SETTINGS, command.body.cmd_keep.keep != 0); return false;
    case WIRE_CMD_CALIBRATE:
      info_.body.info.calibration = command.body.cmd_calibrate.calibration;
      store(WIRE_STORED_CALIBRATION, true);
      return false;
    case WIRE_CMD_ERASE_CALIBRATION:
      info_.body.info.calibration = {};
      store(WIRE_STORED_CALIBRATION, false);
      return false;
    case WIRE_CMD_PAD:
      info_.body.info.pad = command.body.cmd_pad.profile;
      store(WIRE_STORED_PAD, true);
      return false;
    case WIRE_CMD_ERASE_PAD:
      info_.body.info.pad = {};
      store(WIRE_STORED_PAD, false);
      return false;
    case WIRE_CMD_INFO:
      info_.t_us = now_us();
      info_.body.info.streams = streams_;
      send(info_);
      return false;
    case WIRE_CMD_LOADER:
      ended = number("loader", 0) != 0;
      /* the answer is read before the port goes */
      fingertip::wait_until(fingertip::host_now() + milliseconds(50));
      return false;
    case WIRE_CMD_HEALTH: send_health(); return false;
    case WIRE_CMD_CRASH: send(test::make_crash(0, now_us())); return false;
    default: return false;
    }
  }

  void store(std::uint32_t bit, bool there) {
    std::uint32_t &stored = info_.body.info.stored;
    stored = there ? stored | bit : stored & ~bit;
  }

  std::string link_;
  std::map<std::string, std::string> options_;
  std::optional<fingertip::ServedPort> port_, mirror_;
  std::unique_ptr<std::FILE, int (*)(std::FILE *)> tap_{nullptr, std::fclose};
  wire_receiver receiver_;
  wire_packet info_ = test::make_info(0, 0);
  Time started_;
  std::uint8_t streams_ = 0;
  std::uint16_t sequence_ = 0;
  long frame_ = 0;
  bool vanished_ = false;
  std::vector<wire_packet> recorded_; /* to play */
  std::size_t played_ = 0;
};

int main(int argc, char **argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: fake_device LINK [key=value]...\n");
    return 2;
  }
  std::map<std::string, std::string> options;
  for (int i = 2; i < argc; i++) {
    std::string text = argv[i];
    options[text.substr(0, text.find('='))] = text.substr(text.find('=') + 1);
  }
  struct sigaction action = {}; /* without SA_RESTART: a write that is not taken ends too */
  action.sa_handler = [](int) { ended = 1; };
  sigaction(SIGTERM, &action, nullptr);
  FakeDevice(argv[1], options).run();
  return 0;
}
