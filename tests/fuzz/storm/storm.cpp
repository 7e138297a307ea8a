#include "storm.hpp"

#include "libfingertip/command.hpp"
#include "pad/profile.hpp"

#include <algorithm>
#include <cstdio>

namespace soak {
namespace {

// A fault begins after what is told of the world, so that a hand can be off the pad in time.
constexpr std::uint64_t LEAD_us = AHEAD_us + 2 * STEP_us;
// The zero is taken at the start: nothing may touch then.
constexpr std::uint64_t STARTS_WITHIN_us = 3000000;
// A host that hears nothing asks again.
constexpr std::uint64_t ASK_AGAIN_us = 200000;
constexpr std::uint64_t FIRST_ASK_us = 10000;
// Of a steady one. The first frames come after the tare.
constexpr double PAD_mm = 12;
constexpr std::uint64_t FRAMES_FROM_us = 2000000, FRAME_WITHIN_us = 100000;

// So long a wrong frame may follow inverted bits: until the next temperature but one.
constexpr std::uint64_t EXCUSED_us = 5000000;

bool inverts_bits(const std::string &kind) {
  return kind == "inverted_bits" || kind == "d2_corrupt" || kind == "sensor_d2_corrupt";
}

bool takes_power(const std::string &kind) {
  return kind == "power_cut" || kind == "chip_reset" || kind.rfind("start_", 0) == 0;
}

// What is done to the line; every bench has it.
constexpr Target ON_THE_LINE[] = {
    {"command_flood", 0, 100000, 1500000},
    {"garbage", 0, 50000, 800000},
    {"store_writes", 0, 100000, 1500000},
};
constexpr const char *STORE_CUT = "store_cut";

} // namespace

Storm::Storm(Plant &plant, World &world, Judge &judge, std::uint64_t seed)
    : plant_(plant), world_(world), judge_(judge), random_{seed * 2 + 0x5EED} {
  for (int i = 0; i < 8; i++) {
    random_u64(&random_);
  }
  kind_ = "start";
  judge_.set_scene(kind_);
}

void Storm::hang(const std::string &why) {
  hangs_++;
  judge_.find("hang", now_us_, why);
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
    wire_packet packet = fingertip::command_osr(256);
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
  case 0:
    return write(fingertip::command_osr(256u << random_below(r, 6)));
  case 1:
    return write(fingertip::command_rate_mHz(random_below(r, 2) ? 0 : 20000 + random_below(r, 1980000)));
  case 2:
    return write(fingertip::command_slip(static_cast<float>(random_between(r, 0.05, 5)), 5 + random_below(r, 900)));
  case 3:
    return write(random_below(r, 2) ? fingertip::command_prior(0, 0) : fingertip::command_prior(6.5f, 3));
  case 4:
    return write(fingertip::command_location_limit(static_cast<float>(random_between(r, 0.3, 0.6))));
  case 5:
    return write(fingertip::command_health());
  case 6:
    return write(fingertip::command_info());
  case 7:
    streams_ = random_below(r, 2) ? 7 : WIRE_STREAM_CONTACT | WIRE_STREAM_HEALTH;
    return write(fingertip::command_stream(streams_));
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
      world_.keep_off(world_.told_us() + STEP_us, std::max(world_.told_us(), ends_us_) + STARTS_WITHIN_us);
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
  case 0:
    return write(fingertip::command_calibrate(calibration, SENSORS));
  case 1:
    return write(fingertip::command_erase_calibration());
  default:
    return write(fingertip::command_keep(random_below(r, 3) != 0));
  }
}

void Storm::add_fault(const Target &target, std::uint64_t from_us) {
  Fault fault;
  fault.kind = target.kind;
  fault.target =
      target.targets ? static_cast<int>(random_below(&random_, static_cast<std::uint32_t>(target.targets))) : -1;
  fault.from_us = from_us;
  fault.to_us = from_us;
  if (target.most_us > 0) {
    fault.to_us +=
        target.least_us + random_below(&random_, static_cast<std::uint32_t>(target.most_us - target.least_us) + 1);
  }
  ends_us_ = std::max(ends_us_, fault.to_us);
  char told[120];
  std::snprintf(told, sizeof told, "%s%s%s %.3f to %.3f s", scene_.empty() ? "" : ", ", fault.kind.c_str(),
                fault.target < 0 ? "" : (" " + std::to_string(fault.target)).c_str(),
                1e-6 * static_cast<double>(fault.from_us), 1e-6 * static_cast<double>(fault.to_us));
  scene_ += told;
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

void Storm::begin_bout() {
  struct random *r = &random_;
  const std::vector<Target> &own = plant_.faults();
  const std::uint32_t kinds = static_cast<std::uint32_t>(own.size() + std::size(ON_THE_LINE)) + 1; // and STORE_CUT
  bouts_++;
  in_bout_ = true;
  loses_power_ = false;
  ends_us_ = now_us_;
  scene_.clear();
  const std::uint64_t from_us = std::max(now_us_, world_.told_us()) + LEAD_us + random_below(r, 20000);
  begins_us_ = from_us;
  const bool several = random_below(r, 3) == 0;
  const unsigned count = several ? 2 + random_below(r, 4) : 1;
  for (unsigned i = 0; i < count; i++) {
    const std::uint32_t kind = random_below(r, kinds);
    const std::uint64_t later_us = several ? from_us + random_below(r, 300000) : from_us;
    if (kind == kinds - 1) { // power is cut at some moment of the writing, or of its erase
      kind_ = STORE_CUT;
      if (!loses_power_) {
        store_until_us_ = from_us + 200000;
        add_fault({"power_cut", 0, 3000, 50000}, from_us + random_below(r, 150000));
      }
      continue;
    }
    const Target &target = kind < own.size() ? own[kind] : ON_THE_LINE[kind - own.size()];
    if (takes_power(target.kind) && loses_power_) {
      continue;
    }
    kind_ = target.kind;
    add_fault(target, later_us);
  }
  if (loses_power_) { // a start may be held up by whatever else goes wrong, as by a suspend
    world_.keep_off(power_lost_us_, ends_us_ + STARTS_WITHIN_us);
  }
  kind_ = several ? "several" : kind_;
  judge_.set_scene(scene_);
}

void Storm::set_for_most_frames() {
  streams_ = WIRE_STREAM_CONTACT | WIRE_STREAM_HEALTH;
  write(fingertip::command_osr(256));
  write(fingertip::command_rate_mHz(0));
  write(fingertip::command_pad(fingertip::pad::profile_over_own_sensors({PAD_mm})));
}

// What the host says.
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

bool Storm::over() {
  if (!plant_.ended().empty()) {
    hang("it ended: " + plant_.ended());
    return true;
  }
  if (plant_.unasked_starts() > unasked_starts_) {
    unasked_starts_ = plant_.unasked_starts();
    hang("it restarted by itself, in or after " + kind_);
  }
  if (steady_ && now_us_ > FRAMES_FROM_us && now_us_ > judge_.last_frame_us() + FRAME_WITHIN_us) {
    hang("no frame for 0.1 s");
    return true;
  }
  return false;
}

void Storm::run_to(std::uint64_t end_us) {
  while (now_us_ < end_us) {
    world_.extend_to(now_us_ + STEP_us);
    talk();
    plant_.run_to(now_us_ + STEP_us, judge_);
    now_us_ += STEP_us;
    if (over()) {
      return;
    }
    if (in_bout_) {
      if (now_us_ >= ends_us_) {
        in_bout_ = false;
        recovers_ = true;
        judge_.expect_recovery();
      }
    } else if (recovers_) {
      if (judge_.has_recovered()) {
        Recovery &recovery = recovery_[kind_];
        const std::uint64_t since_us = std::max(judge_.good_since_us(), ends_us_);
        recovery.bouts++;
        recovery.worst_s = std::max(recovery.worst_s, 1e-6 * static_cast<double>(since_us - ends_us_));
        recovers_ = false;
        next_us_ = now_us_ + random_below(&random_, 1500000);
      } else if (now_us_ > ends_us_ + RECOVERY_LIMIT_us) {
        hang("no good frames within 20 s of " + kind_);
        return;
      }
    } else if (!steady_ && now_us_ >= next_us_) {
      begin_bout();
    }
  }
}

} // namespace soak
