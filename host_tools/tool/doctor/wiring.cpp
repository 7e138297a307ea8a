#include "tool/doctor/wiring.hpp"

#include <cstdio>

namespace fingertip {

static std::string address_text(unsigned address) {
  char text[8];
  std::snprintf(text, sizeof text, "0x%02x", address);
  return text;
}

std::string pin_text(unsigned gpio) {
  /* GP0 and GP1 are pins 1 and 2; from there every fifth pin is a ground. */
  return "GP" + std::to_string(gpio) + " (pin " + std::to_string(gpio + 1 + (gpio + 2) / 4) + ")";
}

const std::vector<Wiring> &Wiring::all() {
  static const std::vector<Wiring> boards = {
#include "boards.inc"
  };
  return boards;
}

std::optional<Wiring> Wiring::of_board(const std::string &board) {
  for (const Wiring &wiring : all()) {
    if (wiring.board == board) {
      return wiring;
    }
  }
  return std::nullopt;
}

Place Wiring::place(unsigned sensor) const {
  Place place = {sensor / sensors_of_strip, sensor % sensors_of_strip, {}, {}};
  if (mux_address_0) {
    place.multiplexer = *mux_address_0 + place.strip;
  } else {
    place.gpio = sensor;
  }
  return place;
}

std::uint64_t Wiring::sensors_of(unsigned strip) const {
  return ((std::uint64_t{1} << sensors_of_strip) - 1) << (strip * sensors_of_strip);
}

std::string Wiring::place_text(unsigned sensor) const {
  Place at = place(sensor);
  std::string text = "strip " + std::to_string(at.strip) + ", ";
  return at.multiplexer ? text + "channel " + std::to_string(at.position) + " of multiplexer " + address_text(*at.multiplexer)
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
  return "check the supply and address pins of that multiplexer, its RESET on " + pin_text(*pin_mux_reset_0 + strip) +
         ", and its SDA and SCL";
}

std::string Wiring::check_all() const {
  return "check 3V3 and GND of the sensors" + std::string(pin_sda ? " and multiplexers" : "") +
         (pin_sda ? ", SDA on " + pin_text(*pin_sda) : "") + ", SCL on " + pin_text(pin_scl) + ", and the pull-ups: 3.3 V at rest";
}

} // namespace fingertip
