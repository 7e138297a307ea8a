/* Which pins lead to which sensor, by the name of the board: boards/BOARD/board.h as text. */
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace fingertip {

/* Where a sensor sits, and its own part of the way to it. */
struct Place {
  unsigned strip;
  unsigned position;                   /* along the strip */
  std::optional<unsigned> gpio;        /* its data line, where it has one of its own */
  std::optional<unsigned> multiplexer; /* address; the channel is the position */
};

class Wiring {
public:
  /* Nothing for a board that this tool does not know. */
  static std::optional<Wiring> of_board(const std::string &board);

  unsigned sensor_count() const { return sensor_count_; }
  unsigned sensors_of_strip() const { return sensors_of_strip_; }
  /* From the end of a conversion to the end of the next one, less the conversion: us. */
  double overhead_us() const { return overhead_us_; }

  Place place(unsigned sensor) const;
  /* The sensors of a strip. */
  std::uint32_t sensors_of(unsigned strip) const;
  /* Whether a strip can fail as a whole. */
  bool has_multiplexers() const { return first_multiplexer_.has_value(); }

  /* For people: "strip 1, channel 2 of multiplexer 0x71"; and what to look at where one sensor, all
   * of a strip behind a multiplexer, or all sensors do not answer. */
  std::string place_text(unsigned sensor) const;
  std::string check_sensor(unsigned sensor) const;
  std::string check_multiplexer(unsigned strip) const;
  std::string check_all() const;

private:
  Wiring() = default;

  unsigned sensor_count_ = 0, sensors_of_strip_ = 0;
  unsigned scl_gpio_ = 0;
  std::optional<unsigned> sda_gpio_; /* of all */
  std::optional<unsigned> first_multiplexer_;
  unsigned first_reset_gpio_ = 0;
  double overhead_us_ = 0;
};

/* "GP7 (pin 10)": a pin of the Pico and its place on the board's edge. */
std::string pin_text(unsigned gpio);

} // namespace fingertip
