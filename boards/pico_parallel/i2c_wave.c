#include "pico_parallel/i2c_wave.h"

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
  AT_TURN = AT_COMMAND + I2C_WAVE_BYTE_CELLS,
  AT_ADDRESS_AGAIN = AT_TURN + I2C_WAVE_TURN_CELLS,
  AT_BYTES = AT_ADDRESS_AGAIN + I2C_WAVE_BYTE_CELLS,
  ACK = 8, /* cell of a byte */
  RECOVERY_CLOCKS = 9,
};
_Static_assert(I2C_WAVE_CELLS_WITH_BYTE(0) == AT_BYTES + ACK, "cells of a byte");
_Static_assert(AT_STOP_OF_COMMAND + 1 == I2C_WAVE_COMMAND_CELLS, "cells of a command");
_Static_assert(AT_BYTES + ARRAY_BUS_MAX_READ_BYTES * I2C_WAVE_BYTE_CELLS + 1 + FT_READ_STOPS == I2C_WAVE_READ_CELLS,
               "cells of a read, made even");
_Static_assert(1 + RECOVERY_CLOCKS + 2 == I2C_WAVE_RECOVERY_CELLS, "cells of a recovery");
_Static_assert(I2C_WAVE_COMMAND_CELLS % 2 == 0 && I2C_WAVE_READ_CELLS % 2 == 0 && I2C_WAVE_RECOVERY_CELLS % 2 == 0,
               "the player takes pairs of cells");

/* Where the steps of a cell's bit begin: with the low phase before it. */
static uint16_t *bit_at(uint16_t *steps, unsigned cell) { return &steps[cell * WAVE_STEPS_PER_CELL - 1]; }

static void put(uint16_t *steps, unsigned step0, unsigned step1, unsigned step2, unsigned step3) {
  steps[0] = (uint16_t)step0;
  steps[1] = (uint16_t)step1;
  steps[2] = (uint16_t)step2;
  steps[3] = (uint16_t)step3;
}

static void put_bit(uint16_t *bit, bool one) {
  const unsigned low = one ? NONE : SDA;
  put(bit, SCL | low, low, low, SCL | low);
}

static void put_bits(uint16_t *bit, uint8_t byte) {
  for (unsigned i = 0; i < ACK; i++) {
    put_bit(bit, (byte >> (ACK - 1 - i) & 1) != 0);
    bit += WAVE_STEPS_PER_CELL;
  }
}

/* A byte of ours; the sensors acknowledge. */
static void put_byte(uint16_t *bit, uint8_t byte) {
  put_bits(bit, byte);
  put_bit(bit + ACK * WAVE_STEPS_PER_CELL, true);
}

/* Leaves SCL and SDA released. */
static void put_stop(uint16_t *bit, unsigned lines) { put(bit, SCL | lines, lines, lines, NONE); }

/* From the command to the answer. */
static void put_turn(uint16_t *steps) {
#if FT_READ_STOPS
  put_stop(bit_at(steps, AT_TURN), SDA);
  put(bit_at(steps, AT_TURN + 1), NONE, NONE, NONE, NONE);
  put(bit_at(steps, AT_TURN + 2), NONE, SDA, SDA, SCL | SDA);
#else
  put(bit_at(steps, AT_TURN), SCL, NONE, NONE, NONE);
  put(bit_at(steps, AT_TURN + 1), SDA, SDA, SDA, SCL | SDA);
#endif
}

static void put_start_address_command(uint16_t *steps, uint8_t command) {
  put(&steps[AT_START], SDA, SDA, SCL | SDA, NONE); /* the fourth is the first bit's */
  put_byte(bit_at(steps, AT_ADDRESS), ADDRESS_WRITE);
  put_byte(bit_at(steps, AT_COMMAND), command);
}

void i2c_wave_set_command(uint16_t *steps, uint8_t command) { put_bits(bit_at(steps, AT_COMMAND), command); }

void i2c_wave_command(uint16_t steps[I2C_WAVE_COMMAND_STEPS], uint8_t command) {
  put_start_address_command(steps, command);
  put_stop(bit_at(steps, AT_STOP_OF_COMMAND), SDA);
  steps[I2C_WAVE_COMMAND_STEPS - 1] = NONE;
}

unsigned i2c_wave_read(uint16_t steps[I2C_WAVE_READ_STEPS], uint8_t command, uint8_t byte_count) {
  put_start_address_command(steps, command);
  put_turn(steps);
  put_byte(bit_at(steps, AT_ADDRESS_AGAIN), ADDRESS_READ);
  unsigned at = AT_BYTES;
  for (unsigned i = 1; i <= byte_count; i++) {
    put_bits(bit_at(steps, at), 0xFF);
    put_bit(bit_at(steps, at + ACK), i == byte_count);
    at += I2C_WAVE_BYTE_CELLS;
  }
  put_stop(bit_at(steps, at), SDA);
  at++;
  const unsigned cells = at + at % 2;
  for (unsigned step = at * WAVE_STEPS_PER_CELL - 1; step < cells * WAVE_STEPS_PER_CELL; step++) {
    steps[step] = NONE;
  }
  return cells;
}

void i2c_wave_recovery(uint16_t steps[I2C_WAVE_RECOVERY_STEPS], uint16_t stop_lines) {
  put(steps, NONE, NONE, SCL, NONE);
  unsigned at = 1;
  for (unsigned clock = 0; clock < RECOVERY_CLOCKS; clock++) {
    put_bit(bit_at(steps, at++), true);
  }
  put_stop(bit_at(steps, at++), stop_lines);
  put(bit_at(steps, at), NONE, NONE, NONE, NONE);
  steps[I2C_WAVE_RECOVERY_STEPS - 1] = NONE;
}

/* AND of the samples of an address where all lines are released: at its ones, and, as SCL alone is sure to be, at its acknowledgement. */
static unsigned levels_in_address(const uint16_t *samples) {
  _Static_assert(BOARD_SENSOR_ADDRESS == 0x76, "its ones are the bits 0, 1, 2, 4 and 5 sent");
  return samples[0] & samples[1] & samples[2] & samples[4] & samples[5] & (samples[ACK] | SDA);
}

/* Exchanges a block of bits between two words. */
#define EXCHANGE(low, high, bits, mask)                                                                                                    \
  do {                                                                                                                                     \
    const uint32_t differ = ((low) >> (bits) ^ (high)) & (mask);                                                                           \
    (high) ^= differ;                                                                                                                      \
    (low) ^= differ << (bits);                                                                                                             \
  } while (0)

/* Of two rows of each matrix, the bytes of four sensors: those at first, first + 1 and eight on. */
static inline __attribute__((always_inline)) void put_four(uint32_t rows, uint8_t bytes[][ARRAY_BUS_MAX_READ_BYTES], unsigned first) {
  const uint32_t differ = (rows >> 1 ^ rows >> 16) & 0x5555u;
  rows ^= differ << 1 ^ differ << 16;
  bytes[first][0] = (uint8_t)rows;
  bytes[first + 8][0] = (uint8_t)(rows >> 8);
  bytes[first + 1][0] = (uint8_t)(rows >> 16);
  if (first + 9 < BOARD_SENSOR_COUNT) {
    bytes[first + 9][0] = (uint8_t)(rows >> 24);
  }
}

/* Each sensor's byte gets the bits of its line in eight samples, the highest first: a matrix of 8 x 16 bits is two of 8 x 8 side by side,
 * transposed together by exchanging blocks of 4, 2 and 1 bits (Warren, Hacker's Delight, 7-3). Rows are samples, two to a word. */
uint16_t i2c_wave_byte(const uint16_t *samples, unsigned index, uint8_t bytes[][ARRAY_BUS_MAX_READ_BYTES]) {
  samples += AT_BYTES + index * I2C_WAVE_BYTE_CELLS;
  bytes = (uint8_t(*)[ARRAY_BUS_MAX_READ_BYTES]) & bytes[0][index];
  uint32_t rows10 = samples[7] | (uint32_t)samples[6] << 16;
  uint32_t rows32 = samples[5] | (uint32_t)samples[4] << 16;
  uint32_t rows54 = samples[3] | (uint32_t)samples[2] << 16;
  uint32_t rows76 = samples[1] | (uint32_t)samples[0] << 16;
  const uint32_t all = rows10 & rows32 & rows54 & rows76;
  EXCHANGE(rows10, rows54, 4, 0x0F0F0F0Fu);
  EXCHANGE(rows32, rows76, 4, 0x0F0F0F0Fu);
  EXCHANGE(rows10, rows32, 2, 0x33333333u);
  EXCHANGE(rows54, rows76, 2, 0x33333333u);
  put_four(rows10, bytes, 0);
  put_four(rows32, bytes, 2);
  put_four(rows54, bytes, 4);
  put_four(rows76, bytes, 6);
  return (uint16_t)(all & all >> 16);
}

struct i2c_reply i2c_wave_reply(const uint16_t *samples, uint8_t byte_count, uint16_t in_bytes) {
  unsigned released = levels_in_address(&samples[AT_ADDRESS]) & (in_bytes | SDA);
  unsigned refused = samples[AT_ADDRESS + ACK] | samples[AT_COMMAND + ACK];
  if (byte_count > 0) {
    released &= levels_in_address(&samples[AT_ADDRESS_AGAIN]);
    refused |= samples[AT_ADDRESS_AGAIN + ACK];
    /* A sensor that has missed a clock is still at its last bit when the others have let go. */
    released &= samples[AT_BYTES + byte_count * I2C_WAVE_BYTE_CELLS - 1];
  }
  return (struct i2c_reply){
      .acknowledged = (uint16_t)(~refused & released & SDA),
      .held = (uint16_t)(~released & SDA),
      .scl_follows = (released & SCL) != 0,
  };
}
