/* rp2040/wave_player.h without a chip: sixteen wired-AND lines and fifteen sensors that follow the edges on them bit by
 * bit, with faults on request.
 *
 * Every edge is held against UM10204, fast mode, with a rise of 300 ns from 0.3 to 0.7 VDD, 426 ns from the release on,
 * and a fall of 180 ns; what breaks it is a misuse. */
#pragma once

#include "pico_parallel/i2c_wave.h"

#include <stdbool.h>
#include <stdint.h>

struct fake_lines {
  /* Set by the test */
  uint64_t now_us;
  bool opens;          /* the blocks leave reset */
  bool hangs;          /* the wave under way never ends */
  uint16_t missing;    /* bitmap of sensors */
  uint16_t held_low;   /* bitmap of lines, SCL included */
  uint16_t held_high;  /* the same */
  uint16_t deaf;       /* bitmap: sensors that acknowledge their address but not the command */
  uint16_t slips;      /* bitmap: sensors whose clock is disturbed, once ... */
  unsigned slip_clock; /* ... at this clock of the next wave, from 1 ... */
  bool slip_doubles;   /* ... which they see twice instead of not at all */

  /* Seen */
  unsigned misuses;
  const char *misuse;
  unsigned opened, waves, clocks;
  uint16_t starts, stops;               /* bitmaps of the lines that had one in the last wave */
  unsigned stops_of_first;              /* on the line of sensor 0, in the last wave */
  uint8_t commands[BOARD_SENSOR_COUNT]; /* [sensor] the last one it got */
  unsigned received[BOARD_SENSOR_COUNT];
};

extern struct fake_lines fake;

/* Powers everything up again: no faults, time 0. */
void fake_lines_power_up(void);

uint8_t fake_byte(unsigned sensor, uint8_t command, unsigned index);

/* Leaves the sensor in the middle of sending a byte of zeros, its line low. */
void fake_lose_its_place(unsigned sensor);

/* When the wave under way ends; UINT64_MAX if none does. */
uint64_t fake_lines_next_event_us(void);
