#include "pico_parallel/i2c_wave.h"

#include "pico_parallel/board.h"

#define SDA ((uint16_t)BOARD_SDA_LINES)
#define SCL ((uint16_t)BOARD_SCL_LINE)
#define NONE 0u

#define ADDRESS_WRITE (BOARD_SENSOR_ADDRESS << 1)
#define ADDRESS_READ (BOARD_SENSOR_ADDRESS << 1 | 1)

/* The cells of a transaction */
enum {
  AT_START = 0,
  AT_ADDRESS = 1,
  AT_COMMAND = AT_ADDRESS + I2C_WAVE_BYTE_CELLS,
  AT_STOP_OF_COMMAND = AT_COMMAND + I2C_WAVE_BYTE_CELLS,
  AT_RESTART = AT_COMMAND + I2C_WAVE_BYTE_CELLS,
  AT_ADDRESS_AGAIN = AT_RESTART + 2,
  AT_BYTES = AT_ADDRESS_AGAIN + I2C_WAVE_BYTE_CELLS,
  ACK = 8, /* cell of a byte */
  RECOVERY_CLOCKS = 9,
};
_Static_assert(AT_STOP_OF_COMMAND + 1 == I2C_WAVE_COMMAND_CELLS, "cells of a command");
_Static_assert(AT_BYTES + ARRAY_BUS_MAX_READ_BYTES * I2C_WAVE_BYTE_CELLS + 1 == I2C_WAVE_READ_CELLS,
               "cells of a read");
_Static_assert(1 + RECOVERY_CLOCKS + 2 == I2C_WAVE_RECOVERY_CELLS, "cells of a recovery");
_Static_assert(I2C_WAVE_COMMAND_CELLS % 2 == 0 && I2C_WAVE_READ_CELLS % 2 == 0 &&
                   I2C_WAVE_RECOVERY_CELLS % 2 == 0,
               "the player takes pairs of cells");

static void put_cell(uint16_t cell[WAVE_STEPS_PER_CELL], unsigned step0, unsigned step1,
                     unsigned step2, unsigned step3) {
  cell[0] = (uint16_t)step0;
  cell[1] = (uint16_t)step1;
  cell[2] = (uint16_t)step2;
  cell[3] = (uint16_t)step3;
}

static void put_bit(uint16_t cell[WAVE_STEPS_PER_CELL], bool one) {
  const unsigned low = one ? NONE : SDA;
  put_cell(cell, SCL | low, low, low, SCL | low);
}

static void put_start(uint16_t cell[WAVE_STEPS_PER_CELL]) {
  put_cell(cell, SDA, SCL | SDA, SCL | SDA, SCL | SDA);
}

/* SCL comes down in the bit after it, or, where there is none, stays up. */
static void put_stop(uint16_t cell[WAVE_STEPS_PER_CELL], unsigned lines) {
  put_cell(cell, SCL | lines, lines, lines, NONE);
}

static void put_idle(uint16_t cell[WAVE_STEPS_PER_CELL]) {
  put_cell(cell, NONE, NONE, NONE, NONE);
}

static void put_bits(uint16_t cells[][WAVE_STEPS_PER_CELL], uint8_t byte) {
  for (unsigned i = 0; i < ACK; i++) {
    put_bit(cells[i], (byte >> (ACK - 1 - i) & 1) != 0);
  }
}

/* A byte of ours; the sensors acknowledge. */
static void put_byte(uint16_t cells[][WAVE_STEPS_PER_CELL], uint8_t byte) {
  put_bits(cells, byte);
  put_bit(cells[ACK], true);
}

static void put_address_and_command(uint16_t steps[][WAVE_STEPS_PER_CELL], uint8_t command) {
  put_start(steps[AT_START]);
  put_byte(&steps[AT_ADDRESS], ADDRESS_WRITE);
  put_byte(&steps[AT_COMMAND], command);
}

void i2c_wave_set_command(uint16_t steps[][WAVE_STEPS_PER_CELL], uint8_t command) {
  put_bits(&steps[AT_COMMAND], command);
}

void i2c_wave_command(uint16_t steps[I2C_WAVE_COMMAND_CELLS][WAVE_STEPS_PER_CELL],
                      uint8_t command) {
  put_address_and_command(steps, command);
  put_stop(steps[AT_STOP_OF_COMMAND], SDA);
}

unsigned i2c_wave_read(uint16_t steps[I2C_WAVE_READ_CELLS][WAVE_STEPS_PER_CELL], uint8_t command,
                       uint8_t byte_count) {
  put_address_and_command(steps, command);
  put_cell(steps[AT_RESTART], SCL, NONE, NONE, SDA);
  put_start(steps[AT_RESTART + 1]);
  put_byte(&steps[AT_ADDRESS_AGAIN], ADDRESS_READ);
  unsigned at = AT_BYTES;
  for (unsigned i = 1; i <= byte_count; i++) {
    put_bits(&steps[at], 0xFF);
    put_bit(steps[at + ACK], i == byte_count);
    at += I2C_WAVE_BYTE_CELLS;
  }
  put_stop(steps[at++], SDA);
  if (at % 2 != 0) {
    put_idle(steps[at++]);
  }
  return at;
}

void i2c_wave_recovery(uint16_t steps[I2C_WAVE_RECOVERY_CELLS][WAVE_STEPS_PER_CELL],
                       uint16_t stop_lines) {
  unsigned at = 0;
  put_cell(steps[at++], NONE, NONE, NONE, SCL);
  for (unsigned clock = 0; clock < RECOVERY_CLOCKS; clock++) {
    put_bit(steps[at++], true);
  }
  put_stop(steps[at++], stop_lines);
  put_idle(steps[at]);
}

/* AND of the samples of an address where all lines are released: at its ones, and, as SCL alone is
 * sure to be, at its acknowledgement. */
static unsigned levels_in_address(const uint16_t *samples) {
  _Static_assert(BOARD_SENSOR_ADDRESS == 0x76, "its ones are the bits 0, 1, 2, 4 and 5 sent");
  return samples[0] & samples[1] & samples[2] & samples[4] & samples[5] & (samples[ACK] | SDA);
}

/* Gives each sensor's byte the bits of its line in eight samples, the highest first: a matrix of
 * 8 x 16 bits is two of 8 x 8 side by side, transposed together by exchanging blocks of 4, 2 and 1
 * bits (Warren, Hacker's Delight, 7-3). Rows are samples, two to a word. Returns SCL where it was
 * high in all of them. */
static unsigned transpose(const uint16_t samples[8], uint8_t *bytes) {
  uint32_t rows10 = samples[7] | (uint32_t)samples[6] << 16;
  uint32_t rows32 = samples[5] | (uint32_t)samples[4] << 16;
  uint32_t rows54 = samples[3] | (uint32_t)samples[2] << 16;
  uint32_t rows76 = samples[1] | (uint32_t)samples[0] << 16;
  const uint32_t all = rows10 & rows32 & rows54 & rows76;

#define EXCHANGE(low, high, bits, mask)                                                            \
  do {                                                                                             \
    const uint32_t differ = ((low) >> (bits) ^ (high)) & (mask);                                   \
    (high) ^= differ;                                                                              \
    (low) ^= differ << (bits);                                                                     \
  } while (0)
  EXCHANGE(rows10, rows54, 4, 0x0F0F0F0Fu);
  EXCHANGE(rows32, rows76, 4, 0x0F0F0F0Fu);
  EXCHANGE(rows10, rows32, 2, 0x33333333u);
  EXCHANGE(rows54, rows76, 2, 0x33333333u);
#undef EXCHANGE
  uint32_t *const words[] = {&rows10, &rows32, &rows54, &rows76};
  for (unsigned i = 0; i < 4; i++) {
    const uint32_t word = *words[i];
    const uint32_t differ = (word >> 1 ^ word >> 16) & 0x5555u;
    const uint32_t transposed = word ^ differ << 1 ^ differ << 16;
    uint8_t *byte = bytes + 2 * i * ARRAY_BUS_MAX_READ_BYTES;
    byte[0] = (uint8_t)transposed;
    byte[ARRAY_BUS_MAX_READ_BYTES] = (uint8_t)(transposed >> 16);
    byte[8 * ARRAY_BUS_MAX_READ_BYTES] = (uint8_t)(transposed >> 8);
    if (i < 3) { /* line 15 is SCL */
      byte[9 * ARRAY_BUS_MAX_READ_BYTES] = (uint8_t)(transposed >> 24);
    }
  }
  return all & all >> 16 & SCL;
}

struct i2c_reply i2c_wave_reply(const uint16_t *samples, uint8_t byte_count,
                                uint8_t bytes[][ARRAY_BUS_MAX_READ_BYTES]) {
  unsigned released = levels_in_address(&samples[AT_ADDRESS]);
  unsigned refused = samples[AT_ADDRESS + ACK] | samples[AT_COMMAND + ACK];
  if (byte_count > 0) {
    released &= levels_in_address(&samples[AT_ADDRESS_AGAIN]);
    refused |= samples[AT_ADDRESS_AGAIN + ACK];
    const uint16_t *at = &samples[AT_BYTES];
    for (unsigned i = 0; i < byte_count; i++) {
      released &= transpose(at, &bytes[0][i]) | SDA;
      at += I2C_WAVE_BYTE_CELLS;
    }
    released &= at[-1]; /* a sensor that has missed a clock is still at its last bit */
  }
  const bool started = (samples[AT_START] & SCL) == 0;
  return (struct i2c_reply){
      .acknowledged = (uint16_t)(~refused & released & SDA),
      .held = (uint16_t)(~released & SDA),
      .scl_follows = started && (released & SCL) != 0,
  };
}
