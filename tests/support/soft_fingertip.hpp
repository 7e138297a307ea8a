// A fingertip on a port that feels what a test says, frame by frame: answers commands,
// streams, can be unplugged and plugged in again. A thread of its own serves it.
#pragma once

#include "libfingertip/clock.hpp"
#include "libfingertip/command.hpp"
#include "libfingertip/framing.hpp"
#include "libfingertip/served_port.hpp"
#include "support/host_packets.hpp"
#include "support/pad.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <functional>
#include <optional>

namespace test {

struct Feel {
  float force_N = 0;
  float qy_N = 0;
  std::uint32_t flags = 0; // besides those that the numbers need
};

class SoftFingertip {
public:
  // link: made to its port. feel: asked for each frame, in its thread.
  SoftFingertip(std::string link, const std::string &serial, int rate_Hz, std::function<Feel()> feel)
      : link_(std::move(link)), rate_Hz_(rate_Hz), feel_(std::move(feel)) {
    wire_info &info = info_.body.info;
    std::memset(info.serial, 0, sizeof info.serial);
    std::memcpy(info.serial, serial.data(), std::min(serial.size(), sizeof info.serial));
    info.rate_mHz = 0;
    info.capabilities |= WIRE_CAPABILITY_TANGENTIAL;
    info.stored = WIRE_STORED_PAD | WIRE_STORED_CALIBRATION;
    info.pad = pad_of_12_mm();
    info.calibration = make_calibration();
    plug_in();
  }
  ~SoftFingertip() { unplug(); }
  SoftFingertip(const SoftFingertip &) = delete;
  SoftFingertip &operator=(const SoftFingertip &) = delete;

  const std::string &link() const { return link_; }
  // Before anybody asks for it.
  wire_info &info() { return info_.body.info; }
  std::atomic<bool> refuses{false}; // to stream

  void unplug() {
    if (thread_.joinable()) {
      ended_ = true;
      thread_.join();
      port_.reset();
    }
  }
  void plug_in() {
    if (thread_.joinable()) {
      return;
    }
    port_.emplace(link_);
    streams_ = 0;
    sequence_ = 0;
    frame_ = 0;
    started_us_ = fingertip::steady_now_us();
    ended_ = false;
    thread_ = fingertip::Thread([this] { run(); });
  }

private:
  std::uint64_t now_us() const { return static_cast<std::uint64_t>(fingertip::steady_now_us() - started_us_); }

  void run() {
    wire_receiver receiver;
    wire_receiver_init(&receiver, wire_commands);
    std::uint64_t next_us = 0;
    while (!ended_) {
      const std::uint64_t look_us = now_us() + LOOK_us;
      const std::uint64_t until_us = streams_ == 0 ? look_us : std::min(look_us, next_us);
      port_->wait(fingertip::HostTime(std::chrono::microseconds(started_us_ + static_cast<std::int64_t>(until_us))));
      std::uint8_t bytes[256];
      const std::size_t count = port_->read(bytes, sizeof bytes);
      for (std::size_t i = 0; i < count; i++) {
        wire_packet command;
        if (wire_receive(&receiver, bytes[i], &command) == FT_OK) {
          obey(command);
        }
      }
      if (streams_ != 0 && now_us() >= next_us) {
        next_us = now_us() + static_cast<std::uint64_t>(1000000 / rate_Hz_);
        send_frame();
      }
    }
  }

  void obey(const wire_packet &command) {
    const bool refused = refuses && command.type == WIRE_CMD_STREAM;
    if (command.type == WIRE_CMD_STREAM && !refused) {
      streams_ = command.body.cmd_stream.streams;
    }
    const std::uint8_t result = refused ? WIRE_RESULT_NOT_NOW : WIRE_RESULT_DONE;
    say(make_ack(0, now_us(), command.type, result, command.sequence, command.t_us));
    if (command.type == WIRE_CMD_INFO) {
      info_.t_us = now_us();
      say(info_);
    } else if (command.type == WIRE_CMD_HEALTH) {
      say(make_health(0, now_us()));
    }
  }

  void send_frame() {
    frame_++;
    const Feel feel = feel_();
    wire_packet packet = make_contact(0, now_us(), frame_);
    wire_contact &contact = packet.body.contact;
    const bool touches = feel.force_N > 0.02f;
    const float noise = 1e-3f * static_cast<float>(frame_ % 17);
    contact.flags = CONTACT_FLAG_TARED | feel.flags;
    if (touches) {
      contact.flags |= CONTACT_FLAG_CONTACT | CONTACT_FLAG_FIT_VALID | CONTACT_FLAG_UNCERTAINTY_VALID | CONTACT_FLAG_TANGENTIAL_VALID |
                       CONTACT_FLAG_VELOCITY_VALID;
      contact.force_N = feel.force_N + noise;
      contact.x_mm = noise;
      contact.y_mm = 2;
      contact.force_sd_N = 0.05f;
      contact.location_sd_mm = 0.1f;
      contact.qx_N = noise;
      contact.qy_N = feel.qy_N;
      contact.q_sd_N = 0.05f;
      contact.vx_mm_s = 0;
      contact.vy_mm_s = (feel.flags & CONTACT_FLAG_SLIDING) != 0 ? 20.0f : 0.0f;
      contact.tangential_ratio = feel.qy_N / feel.force_N;
    }
    say(packet);
    wire_packet raw = make_raw(0, packet.t_us, frame_);
    raw.body.raw.flags = contact.flags & (CONTACT_FLAG_CONTACT | CONTACT_FLAG_TARED);
    say(raw);
  }

  // Whole packets or none: a host that reads too late loses them.
  void say(wire_packet packet) {
    packet.sequence = sequence_++;
    const auto bytes = fingertip::frame_bytes(packet);
    for (std::size_t done = 0; done < bytes.size() && !ended_;) {
      done += port_->write(bytes.data() + done, bytes.size() - done);
      if (done < bytes.size()) {
        fingertip::wait_until(fingertip::host_now() + std::chrono::milliseconds(1));
      }
    }
  }

  static constexpr std::uint64_t LOOK_us = 5000; // for an end

  std::string link_;
  int rate_Hz_;
  std::function<Feel()> feel_;
  wire_packet info_ = make_info(0, 0);
  std::optional<fingertip::ServedPort> port_;
  std::int64_t started_us_ = 0;
  std::atomic<bool> ended_{false};
  std::uint8_t streams_ = 0;
  std::uint16_t sequence_ = 0;
  std::uint32_t frame_ = 0;
  fingertip::Thread thread_;
};

} // namespace test
