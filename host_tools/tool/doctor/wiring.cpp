#include "tool/doctor/wiring.hpp"

#include <cstdio>

/* Each names its pins alike. */
namespace pico_mux {
#include "pico_mux/board.h"
}
namespace pico_parallel {
#include "pico_parallel/board.h"
}

namespace fingertip {

namespace {

/* Five sensors along each strip: boards/pico_parallel/board.h says so in words. */
constexpr unsigned PARALLEL_SENSORS_OF_STRIP = 5;

/* The release images in the emulator, 3 s at each OSR: 2571 to 2589 and 156 to 176 us, the longest
 * at OSR 256. */
constexpr double MUX_OVERHEAD_us = 2589;
constexpr double PARALLEL_OVERHEAD_us = 176;

std::string address_text(unsigned address) {
  char text[8];
  std::snprintf(text, sizeof text, "0x%02x", address);
  return text;
}

} // namespace

std::string pin_text(unsigned gpio) {
  /* GP0 and GP1 are pins 1 and 2; from there every fifth pin is a ground. */
  return "GP" + std::to_string(gpio) + " (pin " + std::to_string(gpio + 1 + (gpio + 2) / 4) + ")";
}

std::optional<Wiring> Wiring::of_board(const std::string &board) {
  Wiring wiring;
  if (board == "pico_mux") {
    wiring.sensor_count_ = pico_mux::BOARD_SENSOR_COUNT;
    wiring.sensors_of_strip_ = pico_mux::BOARD_CHANNELS_PER_MUX;
    wiring.scl_gpio_ = pico_mux::BOARD_PIN_SCL;
    wiring.sda_gpio_ = pico_mux::BOARD_PIN_SDA;
    wiring.first_multiplexer_ = pico_mux::BOARD_MUX_ADDRESS_0;
    wiring.first_reset_gpio_ = pico_mux::BOARD_PIN_MUX_RESET_0;
    wiring.overhead_us_ = MUX_OVERHEAD_us;
    return wiring;
  }
  if (board == "pico_parallel") {
    wiring.sensor_count_ = pico_parallel::BOARD_SENSOR_COUNT;
    wiring.sensors_of_strip_ = PARALLEL_SENSORS_OF_STRIP;
    wiring.scl_gpio_ = pico_parallel::BOARD_PIN_SCL;
    wiring.overhead_us_ = PARALLEL_OVERHEAD_us;
    return wiring;
  }
  return std::nullopt;
}

Place Wiring::place(unsigned sensor) const {
  Place place = {sensor / sensors_of_strip_, sensor % sensors_of_strip_, {}, {}};
  if (first_multiplexer_) {
    place.multiplexer = *first_multiplexer_ + place.strip;
  } else {
    place.gpio = sensor;
  }
  return place;
}

std::uint32_t Wiring::sensors_of(unsigned strip) const {
  return ((1u << sensors_of_strip_) - 1u) << (strip * sensors_of_strip_);
}

std::string Wiring::place_text(unsigned sensor) const {
  Place at = place(sensor);
  std::string text = "strip " + std::to_string(at.strip) + ", ";
  return at.multiplexer
             ? text + "channel " + std::to_string(at.position) + " of multiplexer " +
                   address_text(*at.multiplexer)
             : text + "position " + std::to_string(at.position) + ", SDA on " + pin_text(*at.gpio);
}

std::string Wiring::check_sensor(unsigned sensor) const {
  Place at = place(sensor);
  if (at.multiplexer) {
    std::string channel = std::to_string(at.position);
    return "check its supply and solder joints, and the lines SD" + channel + " and SC" + channel +
           " of its multiplexer with their pull-ups";
  }
  return "check its supply and solder joints, and its data line on " + pin_text(*at.gpio) +
         ": 3.3 V at rest, else it is held low or has no pull-up";
}

std::string Wiring::check_multiplexer(unsigned strip) const {
  return "check the supply and address pins of that multiplexer, its RESET on " +
         pin_text(first_reset_gpio_ + strip) + ", and its SDA and SCL";
}

std::string Wiring::check_all() const {
  return "check 3V3 and GND of the sensors" + std::string(sda_gpio_ ? " and multiplexers" : "") +
         (sda_gpio_ ? ", SDA on " + pin_text(*sda_gpio_) : "") + ", SCL on " + pin_text(scl_gpio_) +
         ", and the pull-ups: 3.3 V at rest";
}

} // namespace fingertip
