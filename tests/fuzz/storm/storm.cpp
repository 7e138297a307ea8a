#include "storm.hpp"

#include "config/defaults.h"
#include "libfingertip/command.hpp"
#include "libfingertip/text.hpp"
#include "support/pad.h"

#include <algorithm>
#include <cstdio>

namespace storm {

// A fault begins after the part of the world that is fixed already, so that a hand can be off the pad in time.
constexpr std::uint64_t LEAD_us = AHEAD_us + 2 * STEP_us;
// The zero is taken at the start: nothing may touch then.
constexpr std::uint64_t STARTS_WITHIN_us = 3000000;
// A host that receives nothing asks again.
constexpr std::uint64_t ASK_AGAIN_us = 200000;
constexpr std::uint64_t FIRST_ASK_us = 10000;
// Of a steady run. The first frames come after the tare.
constexpr std::uint64_t FRAMES_FROM_us = 2000000, FRAME_WITHIN_us = 100000;

// A wrong frame may follow inverted bits until the next temperature but one.
constexpr std::uint64_t EXCUSED_us = 5000000;
// At a time.
constexpr unsigned MOST_FAULTS = 5;

static bool inverts_bits(const std::string &kind) { return kind == "inverted_bits" || kind == "d2_corrupt"; }

static bool takes_power(const std::string &kind) { return kind == "power_cut" || kind == "chip_reset"; }

// What is done to the line.
constexpr Target ON_THE_LINE[] = {
    {"command_flood", 100000, 1500000},
    {"garbage", 50000, 800000},
    {"store_writes", 100000, 1500000},
};

static wire_packet set(const std::string &text) {
  wire_info now{};
  now.slip_window_ms = DEFAULT_SLIP_WINDOW_ms; // travels with the threshold
  return fingertip::setting_commands({fingertip::setting_from_text(text)}, now)[0];
}

Storm::Storm(NativePlant &plant, World &world, Judge &judge, std::uint64_t seed, fuzz_input input)
    : plant_(plant), world_(world), judge_(judge), input_(input), random_{seed * 2 + 0x5EED} {
  for (int i = 0; i < 8; i++) {
    random_u64(&random_);
  }
  judge_.set_scene("start");
}

bool Storm::find(const std::string &why) {
  judge_.find("hang", now_us_, why);
  return false;
}

void Storm::write(wire_packet packet) {
  packet.sequence = sequence_++;
  packet.t_us = now_us_;
  judge_.sent(now_us_, packet);
  plant_.write(fingertip::frame_bytes(packet));
}

// Ends with a delimiter, so that the next command begins again.
void Storm::write_garbage() {
  std::vector<std::uint8_t> bytes;
  if (random_below(&random_, 3) == 0) { // a packet with a few bits wrong
    wire_packet packet = set("osr=256");
    packet.sequence = static_cast<std::uint16_t>(random_u32(&random_));
    bytes = fingertip::frame_bytes(packet);
    bytes[random_below(&random_, static_cast<std::uint32_t>(bytes.size() - 1))] ^=
        static_cast<std::uint8_t>(1u << random_below(&random_, 8));
  } else {
    const std::uint32_t length = random_below(&random_, 8) == 0 ? 2000 : 200;
    bytes.resize(1 + random_below(&random_, length));
    for (std::uint8_t &byte : bytes) {
      byte = static_cast<std::uint8_t>(random_u32(&random_));
    }
  }
  bytes.push_back(0);
  plant_.write(bytes);
}

void Storm::write_some_command() {
  struct random *r = &random_;
  wire_packet packet{};
  switch (random_below(r, 12)) {
  case 0: return write(set("osr=" + std::to_string(256u << random_below(r, 6))));
  case 1: return write(set("rate=" + (random_below(r, 2) ? "max" : fingertip::fixed(20 + 1e-3 * random_below(r, 1980000), 3))));
  case 2:
    packet = set("slip_threshold=" + fingertip::fixed(random_between(r, 0.05, 5), 6));
    packet.body.cmd_slip.window_ms = static_cast<std::uint16_t>(5 + random_below(r, 900));
    return write(packet);
  case 3: return write(set(random_below(r, 2) ? "prior=none" : "prior=6.5:3"));
  case 4: return write(set("limit=" + fingertip::fixed(random_between(r, 0.3, 0.6), 6)));
  case 5: return write(fingertip::command_health());
  case 6: return write(fingertip::command_info());
  case 7: streams_ = random_below(r, 2) ? 7 : WIRE_STREAM_CONTACT | WIRE_STREAM_HEALTH; return write(fingertip::command_stream(streams_));
  case 8: // out of range
    packet.type = WIRE_CMD_OSR;
    packet.body.cmd_osr.osr = static_cast<std::uint16_t>(random_u32(r) | 1);
    return write(packet);
  case 9:
    packet.type = WIRE_CMD_LOADER;
    packet.body.cmd_loader.magic = random_u32(r) & 0x7FFFFF;
    return write(packet);
  case 10:
    packet.type = WIRE_CMD_RATE;
    packet.body.cmd_rate.rate_mHz = 1 + random_below(r, WIRE_RATE_MIN_mHz - 1);
    return write(packet);
  default:
    if (!loses_power_ && world_.resting_since_us() != UINT64_MAX && now_us_ > world_.resting_since_us() + 1000000) {
      world_.keep_off(world_.fixed_us() + STEP_us, std::max(world_.fixed_us(), ends_us_) + STARTS_WITHIN_us);
      write(fingertip::command_tare());
    }
  }
}

// Gains and scales stay 1, so that the truth stays what it is.
void Storm::write_something_to_store() {
  struct random *r = &random_;
  calibration calibration{};
  calibration.date_s = random_u32(r);
  calibration.placements = 20;
  calibration.force_scale = 1;
  calibration.force_scale_sd = 0.02f;
  for (unsigned k = 0; k < SENSORS; k++) {
    calibration.sensors[k] = {1.0f, 0.01f, 0, 0, 0};
  }
  switch (random_below(r, 4)) {
  case 0: return write(fingertip::command_calibrate(calibration, SENSORS));
  case 1: return write(fingertip::command_erase_calibration());
  default: return write(fingertip::command_keep(random_below(r, 3) != 0));
  }
}

void Storm::add_fault(const Target &target, std::uint64_t from_us) {
  Fault fault;
  fault.kind = target.kind;
  fault.sensor = fuzz_u8(&input_) % SENSORS;
  fault.from_us = from_us;
  fault.to_us = from_us;
  if (target.most_us > 0) {
    fault.to_us += target.least_us + (target.most_us - target.least_us) * fuzz_u8(&input_) / 255;
  }
  ends_us_ = std::max(ends_us_, fault.to_us);
  char text[120];
  std::snprintf(text, sizeof text, "%s%s %u %.3f to %.3f s", scene_.empty() ? "" : ", ", fault.kind.c_str(), fault.sensor,
                1e-6 * static_cast<double>(fault.from_us), 1e-6 * static_cast<double>(fault.to_us));
  scene_ += text;
  if (fault.kind == "command_flood") {
    commands_until_us_ = fault.to_us;
  } else if (fault.kind == "garbage") {
    garbage_until_us_ = fault.to_us;
  } else if (fault.kind == "store_writes") {
    store_until_us_ = fault.to_us;
  } else {
    plant_.schedule(fault);
  }
  if (fault.kind == "sensor_brown_out") {
    judge_.excuse_readings_until(fault.to_us + EXCUSED_us);
  }
  if (inverts_bits(fault.kind)) {
    judge_.excuse_until(fault.to_us + EXCUSED_us);
  }
  if (takes_power(fault.kind)) {
    loses_power_ = true;
    power_lost_us_ = fault.from_us;
  }
}

// Of the input: how many faults, their kinds, and when each begins.
void Storm::begin_bout() {
  const std::vector<Target> &own = NativePlant::faults();
  const std::size_t kinds = own.size() + std::size(ON_THE_LINE);
  in_bout_ = true;
  loses_power_ = false;
  ends_us_ = now_us_;
  scene_.clear();
  begins_us_ = std::max(now_us_, world_.fixed_us()) + LEAD_us;
  for (unsigned left = 1 + fuzz_u8(&input_) % MOST_FAULTS; left > 0 && fuzz_left(&input_) > 0; left--) {
    const std::size_t kind = fuzz_u8(&input_) % kinds;
    const Target &target = kind < own.size() ? own[kind] : ON_THE_LINE[kind - own.size()];
    if (!takes_power(target.kind) || !loses_power_) {
      add_fault(target, begins_us_ + 1200u * fuzz_u8(&input_));
    }
  }
  if (loses_power_) { // a start may be held up by whatever else goes wrong, as by a suspend
    world_.keep_off(power_lost_us_, ends_us_ + STARTS_WITHIN_us);
  }
  judge_.set_scene(scene_);
}

void Storm::set_for_most_frames() {
  streams_ = WIRE_STREAM_CONTACT | WIRE_STREAM_HEALTH;
  write(set("osr=256"));
  write(set("rate=max"));
  write(fingertip::command_pad(pad_of_12_mm()));
}

// What the host sends.
void Storm::talk() {
  const bool open = plant_.port_is_open();
  if (open && !was_open_) {
    ask_at_us_ = now_us_ + FIRST_ASK_us;
    has_asked_ = false;
  }
  was_open_ = open;
  if (!open) {
    return;
  }
  if (now_us_ >= ask_at_us_) {
    if (!has_asked_ || now_us_ > judge_.last_frame_us() + ASK_AGAIN_us) {
      if (steady_ && !has_asked_) {
        set_for_most_frames();
      }
      write(fingertip::command_stream(streams_));
      has_asked_ = true;
    }
    ask_at_us_ = now_us_ + ASK_AGAIN_us;
  }
  if (!in_bout_ || now_us_ < begins_us_) {
    return;
  }
  if (now_us_ < commands_until_us_) {
    for (unsigned left = random_below(&random_, 8); left > 0; left--) {
      write_some_command();
    }
  }
  if (now_us_ < garbage_until_us_) {
    write_garbage();
  }
  if (now_us_ < store_until_us_ && random_below(&random_, 4) == 0) {
    write_something_to_store();
  }
}

// False: nothing comes any more.
bool Storm::step() {
  world_.extend_to(now_us_ + STEP_us);
  talk();
  plant_.run_to(now_us_ + STEP_us, judge_);
  now_us_ += STEP_us;
  return plant_.ended().empty() || find("it ended: " + plant_.ended());
}

void Storm::run() {
  constexpr std::uint64_t QUIET_us = 1000000;
  while (now_us_ < FRAMES_FROM_us) {
    if (!step()) {
      return;
    }
  }
  while (fuzz_left(&input_) > 0) {
    begin_bout();
    for (; in_bout_; in_bout_ = now_us_ < ends_us_) {
      if (!step()) {
        return;
      }
    }
    judge_.expect_recovery();
    while (!judge_.has_recovered()) {
      if (!step() || (now_us_ > ends_us_ + RECOVERY_LIMIT_us && !find("no good frames within 20 s"))) {
        return;
      }
    }
    for (const std::uint64_t end_us = now_us_ + QUIET_us; now_us_ < end_us;) {
      if (!step()) {
        return;
      }
    }
  }
}

void Storm::run_steady(std::uint64_t end_us) {
  steady_ = true;
  while (now_us_ < end_us && step()) {
    if (now_us_ > FRAMES_FROM_us && now_us_ > judge_.last_frame_us() + FRAME_WITHIN_us) {
      find("no frame for 0.1 s");
      return;
    }
  }
}

} // namespace storm
