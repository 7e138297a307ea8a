#include "emulated_plant.hpp"

#include <nlohmann/json.hpp>
#include <stdexcept>

namespace soak {
namespace {

constexpr int MUXES = 3;

const Target OF_ALL[] = {
    {"sensor_dead", SENSORS, 20000, 3000000},
    {"sensor_nack", SENSORS, 0, 0},
    {"sensor_prom_corrupt", SENSORS, 500000, 3000000},
    {"sensor_adc_zero", SENSORS, 20000, 2000000},
    {"sensor_brown_out", SENSORS, 0, 0},
    {"sensor_d2_corrupt", SENSORS, 500000, 3000000},
    {"sda_stuck_low", SENSORS, 0, 0},
    {"line_stuck_low", SENSORS, 20000, 2000000},
    {"host_stall", 0, 20000, 2000000},
    {"port_closed", 0, 20000, 500000},
    {"usb_unplug", 0, 20000, 500000},
    {"suspend", 0, 10000, 2000000},
    {"usb_late_resume", 0, 100000, 1000000},
    {"usb_deaf", 0, 0, 0},
    {"usb_dead", 0, 0, 0},
    {"power_cut", 0, 3000, 300000},
    {"chip_reset", 0, 3000, 100000},
    {"start_crystal_weak", 0, 3000, 100000},
    {"start_crystal_dead", 0, 3000, 100000},
    {"start_pll_late", 0, 3000, 100000},
};
const Target OF_MUXES[] = {
    {"mux_stuck", MUXES, 0, 0},
    {"mux_dead", MUXES, 20000, 2000000},
};
const Target OF_LINES[] = {
    {"sensor_missing", SENSORS, 20000, 3000000},
    {"line_stuck_high", SENSORS, 20000, 2000000},
    {"scl_stuck_low", 0, 20000, 1000000},
    {"scl_stuck_high", 0, 20000, 1000000},
    {"clock_glitch", SENSORS, 0, 0},
};

int digit(char c) {
  return c <= '9' ? c - '0' : c - 'a' + 10;
}

} // namespace

EmulatedPlant::EmulatedPlant(const World &world, const std::string &board, std::istream &from, std::ostream &to)
    : world_(world), from_(from), to_(to), faults_(std::begin(OF_ALL), std::end(OF_ALL)) {
  if (board == "pico_mux") {
    faults_.insert(faults_.end(), std::begin(OF_MUXES), std::end(OF_MUXES));
  } else {
    faults_.insert(faults_.end(), std::begin(OF_LINES), std::end(OF_LINES));
  }
}

void EmulatedPlant::write(const std::vector<std::uint8_t> &bytes) {
  static const char digits[] = "0123456789abcdef";
  for (const std::uint8_t byte : bytes) {
    to_send_ += digits[byte >> 4];
    to_send_ += digits[byte & 15];
  }
}

void EmulatedPlant::run_to(std::uint64_t t_us, Judge &judge) {
  nlohmann::json faults = nlohmann::json::array();
  for (const Fault &fault : scheduled_) {
    nlohmann::json one = {{"type", fault.kind}, {"from_s", 1e-6 * static_cast<double>(fault.from_us)}};
    if (fault.to_us > fault.from_us) {
      one["to_s"] = 1e-6 * static_cast<double>(fault.to_us);
    }
    if (fault.target >= 0) {
      one[fault.kind.rfind("mux_", 0) == 0 ? "mux" : "sensor"] = fault.target;
    }
    faults.push_back(std::move(one));
  }
  scheduled_.clear();
  // All rows that were told since: at first there are several.
  nlohmann::json rows = nlohmann::json::array();
  for (; told_us_ <= world_.told_us(); told_us_ += STEP_us) {
    const Row row = world_.at(told_us_);
    rows.push_back({{"t_us", told_us_}, {"Pa", row.pressure_Pa}, {"degC", row.temperature_degC}});
  }
  to_ << nlohmann::json{{"to_us", t_us}, {"rows", rows}, {"faults", faults}, {"write", to_send_}} << std::endl;
  to_send_.clear();

  std::string line;
  if (!std::getline(from_, line)) {
    throw std::runtime_error("the emulator has gone");
  }
  const nlohmann::json answer = nlohmann::json::parse(line);
  std::vector<std::uint8_t> bytes;
  for (const nlohmann::json &event : answer["events"]) {
    const std::string what = event[0];
    const std::uint64_t at_us = event[1];
    if (what == "start") {
      judge.begin_life(at_us);
    } else if (what == "zero") {
      judge.set_clock_zero(event[2]);
    } else if (what == "open") {
      open_ = true;
      judge.open(at_us);
    } else if (what == "close") {
      open_ = false;
      judge.close(at_us);
    } else {
      const std::string hex = event[2];
      bytes.clear();
      for (std::size_t i = 0; i + 1 < hex.size(); i += 2) {
        bytes.push_back(static_cast<std::uint8_t>(digit(hex[i]) << 4 | digit(hex[i + 1])));
      }
      judge.received(at_us, bytes.data(), bytes.size());
    }
  }
  unasked_ = answer["unasked"];
  ended_ = answer["ended"];
}

} // namespace soak
