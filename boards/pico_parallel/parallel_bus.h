/* array_bus over one SCL and a data line for each sensor, by PIO and DMA.
 *
 * A command takes 49 us and a read of three bytes 146 us on the bus at 397 kHz, for all sensors at once: they sample at
 * the same moment, and the skew between them is that of their own oscillators.
 *
 * A line that is low while all should be high is stuck: its sensor does not acknowledge, and the others go on. Before
 * the next command the stuck lines, and only they, get the nine clocks and the STOP that free a sensor which has lost
 * its place, and, while that does not help, ever more rarely. Clocks that do not follow are a failure of the whole bus:
 * the operation ends with FT_ERR_TIMEOUT and a recovery must free SCL. */
#pragma once

#include "array_bus/array_bus.h"
#include "pico_parallel/i2c_wave.h"

#include <stdbool.h>
#include <stdint.h>

/* Private, but caller-owned. */
struct parallel_bus {
  enum parallel_bus_operation {
    PARALLEL_BUS_IDLE,
    PARALLEL_BUS_COMMAND,
    PARALLEL_BUS_READ,
    PARALLEL_BUS_RECOVERY,
  } operation;
  bool freeing; /* the wave under way is the one for the stuck lines, before the command's own */
  bool failed;  /* until a recovery succeeds, every operation ends with FT_ERR_TIMEOUT */
  uint64_t deadline_us;
  uint64_t look_us;    /* when to check what a read has so far */
  uint8_t bytes_taken; /* of a read */
  uint16_t in_bytes;   /* AND of what i2c_wave_byte() returned */

  uint16_t stuck;         /* bitmap of lines, by the last wave */
  uint16_t free_interval; /* commands between two attempts to free them */
  uint16_t free_wait;     /* commands until the next one */

  /* What the tables hold */
  uint8_t command;
  uint8_t read_command, read_count, read_cells;
  uint8_t read_look_us; /* from its start until all bytes but the last are there */
  _Alignas(uint32_t) uint16_t command_steps[I2C_WAVE_COMMAND_STEPS];
  _Alignas(uint32_t) uint16_t read_steps[I2C_WAVE_READ_STEPS];
  _Alignas(uint32_t) uint16_t recovery_steps[I2C_WAVE_RECOVERY_STEPS];
  _Alignas(uint32_t) uint16_t samples[I2C_WAVE_READ_CELLS];
};

/* Opens the lines. FT_ERR_TIMEOUT: a block of the chip does not start. Fills *array_bus, which refers to *bus. */
enum ft_status parallel_bus_init(struct parallel_bus *bus, struct array_bus *array_bus);
