#include "native_plant.hpp"

extern "C" {
#include "native/native_cdc.h"
#include "native/native_flash.h"
}

#include "native_firmware.h"

#include <algorithm>

namespace storm {
namespace {

// What waits for the device goes on in pieces of its queue.
constexpr std::uint64_t PIECE_us = 1000;

const std::vector<Target> FAULTS = {
    {"sensor_nack", 0, 0},
    {"nacks", 100000, 3000000},
    {"sensor_dead", 20000, 3000000},
    {"sensor_missing", 20000, 3000000},
    {"bus_timeout", 0, 0},
    {"sda_stuck", 0, 0},
    {"adc_zero", 0, 0},
    {"adc_ones", 0, 0},
    {"inverted_bits", 0, 0},
    {"sensor_power_cycle", 0, 0},
    {"sensor_brown_out", 0, 0},
    {"d2_corrupt", 500000, 4000000},
    {"host_stall", 20000, 4000000},
    {"port_closed", 20000, 1000000},
    {"suspend", 10000, 3000000},
    {"power_cut", 3000, 500000},
    {"chip_reset", 3000, 100000},
};

struct Bench {
  const World *world;
  std::uint64_t zero_us;
} bench;

double pressure_Pa(void *, unsigned sensor, std::uint64_t t_us) { return bench.world->pressure_Pa(sensor, bench.zero_us + t_us); }

double temperature_degC(void *, unsigned, std::uint64_t t_us) { return bench.world->temperature_degC(bench.zero_us + t_us); }

} // namespace

NativePlant::NativePlant(const World &world, std::uint64_t seed, std::uint64_t clock_us, bool has_line_each)
    : world_(world), random_{seed * 2 + 0xB0A2D} {
  native_flash_reset(seed);
  storm_firmware_power_sensors(seed);
  struct sim_array *array = storm_firmware_array();
  array->noise = 1;
  array->parallel = has_line_each;
  array->world = {nullptr, pressure_Pa, temperature_degC};
  start(0, clock_us, nullptr);
}

NativePlant::~NativePlant() { native_cdc_reset(); }

const std::vector<Target> &NativePlant::faults() { return FAULTS; }

void NativePlant::start(std::uint64_t t_us, std::uint64_t clock_us, Judge *judge) {
  const std::uint64_t elapsed_us = t_us - zero_us_;
  zero_us_ = t_us - clock_us;
  bench = {&world_, zero_us_};
  has_power_ = true;
  storm_firmware_start(elapsed_us, clock_us);
  if (judge) {
    judge->begin_life(t_us);
  }
}

void NativePlant::schedule(const Fault &fault) {
  const auto add = [&](const Change &change) {
    changes_.insert(
        std::upper_bound(changes_.begin(), changes_.end(), change, [](const Change &a, const Change &b) { return a.t_us < b.t_us; }),
        change);
  };
  add({fault.from_us, fault, true});
  if (fault.to_us > fault.from_us) {
    add({fault.to_us, fault, false});
  }
}

void NativePlant::write(const std::vector<std::uint8_t> &bytes) { to_send_.insert(to_send_.end(), bytes.begin(), bytes.end()); }

void NativePlant::update_port(std::uint64_t t_us, Judge &judge) {
  const bool open = has_power_ && closed_ == 0 && asleep_ == 0;
  if (open == open_) {
    return;
  }
  open_ = open;
  if (open) {
    native_cdc_open();
    judge.open(t_us);
  } else {
    listen(t_us, judge);
    native_cdc_close();
    to_send_.clear();
    judge.close(t_us);
  }
}

void NativePlant::act(const Change &change, Judge &judge) {
  const std::string &kind = change.fault.kind;
  const unsigned sensor = change.fault.sensor;
  struct sim_array *array = storm_firmware_array();
  const auto strike = [&](enum sim_fault_kind what, std::uint32_t count = 1, std::uint32_t mask = 0) {
    array->fault = {what, array->transfers + 1 + random_below(&random_, 2 * SENSORS), count, mask, static_cast<std::uint8_t>(sensor)};
  };
  if (kind == "sensor_nack") {
    strike(SIM_FAULT_NACK);
  } else if (kind == "nacks") {
    array->nack_share = change.begins ? 0.02 : 0;
  } else if (kind == "sensor_dead") {
    array->absent[sensor] = change.begins;
  } else if (kind == "sensor_missing") {
    array->absent[sensor] = change.begins;
    sim_ms5840_power_cycle(&array->sensor[sensor]);
  } else if (kind == "bus_timeout") {
    strike(SIM_FAULT_TIMEOUT);
  } else if (kind == "sda_stuck") {
    strike(SIM_FAULT_STUCK, 1 + random_below(&random_, 6));
  } else if (kind == "adc_zero") {
    strike(SIM_FAULT_ZERO);
  } else if (kind == "adc_ones") {
    strike(SIM_FAULT_ONES);
  } else if (kind == "inverted_bits") {
    strike(SIM_FAULT_FLIP, 1, 1u << random_below(&random_, 24));
  } else if (kind == "sensor_power_cycle") {
    strike(SIM_FAULT_POWER_CYCLE);
  } else if (kind == "sensor_brown_out") {
    strike(SIM_FAULT_BROWN_OUT);
  } else if (kind == "d2_corrupt") {
    array->wrong_temperature_share = change.begins ? 0.2 : 0;
  } else if (kind == "host_stall") {
    stalled_ += change.begins ? 1 : -1;
    native_cdc_stall(stalled_ > 0);
  } else if (kind == "port_closed") {
    closed_ += change.begins ? 1 : -1;
  } else if (kind == "suspend") {
    asleep_ += change.begins ? 1 : -1;
    native_cdc_suspend(asleep_ > 0);
  } else if (kind == "power_cut" || kind == "chip_reset") {
    if (change.begins) {
      has_power_ = false;
      update_port(change.t_us, judge);
      if (kind == "power_cut") {
        native_flash_power_up(); // what was under way is cut short
        storm_firmware_cut_sensors();
      }
    } else {
      start(change.t_us, 0, &judge);
      native_cdc_suspend(asleep_ > 0);
      native_cdc_stall(stalled_ > 0);
    }
  }
  update_port(change.t_us, judge);
}

void NativePlant::listen(std::uint64_t t_us, Judge &judge) {
  std::uint8_t bytes[4096];
  for (std::size_t count; (count = native_cdc_receive(bytes, sizeof bytes)) > 0;) {
    judge.received(t_us, bytes, count);
  }
}

void NativePlant::run_firmware(std::uint64_t t_us) {
  if (!has_power_ || t_us <= now_us_) {
    return;
  }
  switch (storm_firmware_run_until(t_us - zero_us_)) {
  case NATIVE_PANIC: ended_ = "panic"; break;
  case NATIVE_LOADER: ended_ = "it left for the loader"; break;
  default:
    if (native_watchdog_expired()) {
      ended_ = "the watchdog was not fed";
    }
  }
}

void NativePlant::run_to(std::uint64_t t_us, Judge &judge) {
  update_port(now_us_, judge);
  while (now_us_ < t_us && ended_.empty()) {
    while (open_ && !to_send_.empty()) {
      const std::size_t count = std::min<std::size_t>(to_send_.size(), 64);
      if (native_cdc_send(to_send_.data(), count) != FT_OK) {
        break;
      }
      to_send_.erase(to_send_.begin(), to_send_.begin() + static_cast<std::ptrdiff_t>(count));
    }
    std::uint64_t next_us = to_send_.empty() ? t_us : std::min(t_us, now_us_ + PIECE_us);
    if (!changes_.empty()) {
      next_us = std::max(now_us_, std::min(next_us, changes_.front().t_us));
    }
    run_firmware(next_us);
    now_us_ = next_us;
    listen(now_us_, judge);
    while (!changes_.empty() && changes_.front().t_us <= now_us_) {
      const Change change = changes_.front();
      changes_.erase(changes_.begin());
      act(change, judge);
    }
  }
}

} // namespace storm
