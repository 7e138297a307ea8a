/* Bit-parallel I2C in tables: the waves of the transactions that the array needs, and what their samples show. SCL is common, so every
 * sensor gets the same byte at the same moment and answers on its own line: a sample holds one bit of each.
 *
 * Cells, steps and samples are those of rp2040/wave_player.h. A bit, a START and a STOP take a cell each, a repeated START takes two, and
 * where a build has STOP and START instead (FT_READ_STOPS) they take three. The last step of a cell prepares the bit of the next one; after
 * a STOP it leaves the bus free for 1.4 us. Pure functions. Sources: UM10204; MS5840-02BA datasheet. */
#pragma once

#include "array_bus/array_bus.h"
#include "pico_parallel/board.h"
#include "rp2040/wave_player.h"

#include <stdbool.h>
#include <stdint.h>

/* Bitmaps of lines: the SDA of sensor k is GPIO k. */
#define BOARD_SDA_LINES ((1u << BOARD_SENSOR_COUNT) - 1u)
#define BOARD_SCL_LINE (1u << BOARD_PIN_SCL)

enum {
  I2C_WAVE_BYTE_CELLS = 9,
  I2C_WAVE_COMMAND_CELLS = 20, /* START, address, command, STOP */
  I2C_WAVE_TURN_CELLS = 2 + FT_READ_STOPS,
  I2C_WAVE_READ_CELLS = 58 + 2 * FT_READ_STOPS, /* of ARRAY_BUS_MAX_READ_BYTES bytes */
  I2C_WAVE_RECOVERY_CELLS = 12,                 /* SCL down, nine clocks, STOP, idle */
};

enum {
  I2C_WAVE_COMMAND_STEPS = I2C_WAVE_COMMAND_CELLS * WAVE_STEPS_PER_CELL,
  I2C_WAVE_READ_STEPS = I2C_WAVE_READ_CELLS * WAVE_STEPS_PER_CELL,
  I2C_WAVE_RECOVERY_STEPS = I2C_WAVE_RECOVERY_CELLS * WAVE_STEPS_PER_CELL,
};

/* From the first step to the sample of the acknowledged command, in waves of either kind */
#define I2C_WAVE_COMMAND_ns ((1u + 2u * I2C_WAVE_BYTE_CELLS - 1u) * WAVE_CELL_ns + WAVE_STEP0_ns)

/* START, sensor address, command, STOP. */
void i2c_wave_command(uint16_t steps[I2C_WAVE_COMMAND_STEPS], uint8_t command);

/* START, sensor address, command, repeated START or STOP and START, sensor address, byte_count
 * (1..ARRAY_BUS_MAX_READ_BYTES) bytes read, STOP. Returns the number of cells. */
unsigned i2c_wave_read(uint16_t steps[I2C_WAVE_READ_STEPS], uint8_t command, uint8_t byte_count);

/* Another command in a wave of either kind. */
void i2c_wave_set_command(uint16_t steps[], uint8_t command);

/* UM10204 3.1.16: nine clocks, in which a sensor that was left in the middle of a byte lets go, and
 * a STOP on these lines (bitmap). The other lines stay released: sensors take no notice of clocks
 * without a START. The last cell is idle, so its sample shows which lines are held low. */
void i2c_wave_recovery(uint16_t steps[I2C_WAVE_RECOVERY_STEPS], uint16_t stop_lines);

/* Cells after which the samples of this byte of a read (0 is the first) are complete. */
#define I2C_WAVE_CELLS_WITH_BYTE(index) (36u + I2C_WAVE_TURN_CELLS + I2C_WAVE_BYTE_CELLS * (index))

/* Gives each sensor its byte with this index. Returns the lines that were high in all of its bits;
 * of those only SCL has to be. About 180 Cortex-M0+ cycles. */
uint16_t i2c_wave_byte(const uint16_t *samples, unsigned index, uint8_t bytes[][ARRAY_BUS_MAX_READ_BYTES]);

struct i2c_reply {
  uint16_t acknowledged; /* bitmap: acknowledged every byte, and let go of the line where it should */
  uint16_t held;         /* bitmap of lines that were low without a reason */
  bool scl_follows;      /* SCL was high in every sample that was checked */
};

/* What all the other samples show, with the AND of what i2c_wave_byte() returned for byte_count
 * bytes; 0 and UINT16_MAX for a command. The bytes count for those that acknowledged. */
struct i2c_reply i2c_wave_reply(const uint16_t *samples, uint8_t byte_count, uint16_t in_bytes);
