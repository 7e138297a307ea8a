/* rp2040/i2c.h, rp2040/event.h and the reset pins of rp2040/gpio.h without a chip: three TCA9548A and fifteen sensors
 * in place of the controller, at the speed of a 400 kHz bus, with faults on request.
 *
 * A sensor answers a read with fake_byte() of the command it got last. If several answer at once the bytes are
 * wired-AND, as on the bus, and counted in `collisions`. */
#pragma once

#include "pico_mux/mux_bus.h"

#include <stdbool.h>
#include <stdint.h>

struct fake_i2c {
  /* Set by the test */
  uint64_t now_us;
  bool mux_missing[BOARD_MUX_COUNT];
  bool sensor_missing[BOARD_SENSOR_COUNT];
  unsigned hang_at;             /* the transaction with this number, from 1, never ends */
  unsigned arbitration_lost_at; /* the same, loses arbitration */
  unsigned nack_select_at;      /* the same, the addressed multiplexer misses its address */
  unsigned nack_read_at;        /* the same, the sensor that is read */
  unsigned busy_polls;          /* polls of each transaction that find the controller not yet idle */
  bool sda_held, scl_held;
  uint32_t tied_low;              /* bitmap: sensors whose SDA is at ground, which the bus feels while it is on */
  unsigned sda_free_after_clocks; /* 0: no number of clocks frees it */
  bool sda_free_by_mux_reset;

  /* Seen */
  unsigned transactions, selects, commands, reads;
  unsigned collisions;
  unsigned misuses;         /* calls that the real controller forbids in its state */
  uint32_t command_reached; /* bitmap: sensors that heard the last command */
  uint8_t last_command;
  unsigned clocks, stops; /* on the lines as plain pins */
  unsigned opened;
  bool open;
  unsigned events; /* calls of rp2040_event() */
  uint8_t driven;  /* bitmap of multiplexers whose RESET line is one, and began low */
};

extern struct fake_i2c fake;

/* Powers everything up again: no faults, time 0, all channels closed. */
void fake_i2c_power_up(void);

uint8_t fake_byte(unsigned sensor, uint8_t command, unsigned index);

/* When the transaction under way ends; UINT64_MAX if none does. */
uint64_t fake_i2c_next_event_us(void);

/* The interrupt of that end. */
void fake_i2c_interrupt(void);

/* Time on the bus of the two kinds of transaction at 400 kHz: 9 clocks a byte, 1 for START and for STOP. */
#define I2C_WRITE_us 50u
#define I2C_READ_us(byte_count) ((11u * 5u + 9u * 5u * (byte_count) + 1u) / 2u)
