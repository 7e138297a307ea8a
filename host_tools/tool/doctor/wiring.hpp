/* Which pins lead to which sensor, by the descriptor of each board: boards/README.md. */
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace fingertip {

/* Where a sensor sits, and its own part of the way to it. */
struct Place {
  unsigned strip;
  unsigned position;                   /* along the strip */
  std::optional<unsigned> gpio;        /* its data line, where it has one of its own */
  std::optional<unsigned> multiplexer; /* address; the channel is the position */
};

struct Wiring {
  static const std::vector<Wiring> &all();
  /* Nothing for a board that this tool does not know. */
  static std::optional<Wiring> of_board(const std::string &board);

  Place place(unsigned sensor) const;
  /* The sensors of a strip. */
  std::uint64_t sensors_of(unsigned strip) const;
  /* Whether a strip can fail as a whole. */
  bool has_multiplexers() const { return mux_address_0.has_value(); }

  /* For people: "strip 1, channel 2 of multiplexer 0x71"; and what to look at where one sensor, all
   * of a strip behind a multiplexer, or all sensors do not answer. */
  std::string place_text(unsigned sensor) const;
  std::string check_sensor(unsigned sensor) const;
  std::string check_multiplexer(unsigned strip) const;
  std::string check_all() const;

  /* The name in the descriptor. */
  std::string board;
  unsigned sensor_count, sensors_of_strip;
  unsigned pin_scl;
  std::optional<unsigned> pin_sda, mux_address_0, pin_mux_reset_0;
  double overhead_us;
};

/* "GP7 (pin 10)": a pin of the Pico and its place on the board's edge. */
std::string pin_text(unsigned gpio);

} // namespace fingertip
