/* I2C0 as the bus master of single short transactions at 400 kHz, and its two lines as plain pins for the recovery of a stuck bus.
 *
 * A transaction fits into the FIFO whole, so it is loaded at once and needs no code until its STOP, whose interrupt
 * calls the owner, who may start the next one from there. Nothing here waits, but for a block to leave reset (a few
 * cycles) and for the bus-free time after a STOP (2 us), both bounded. One context: the event handler's.
 *
 * Source: RP2040 datasheet 4.3; I2C-bus specification UM10204, fast mode. */
#pragma once

#include "common/status.h"

#include <stdbool.h>
#include <stdint.h>

enum { I2C_MAX_READ_BYTES = 3 };

struct i2c_pins {
  uint8_t sda; /* a pin whose function 3 is I2C0 SDA */
  uint8_t scl;
};

/* Whom to call, in interrupt context, when a transaction may have ended. */
struct i2c_owner {
  void (*on_event)(void *context);
  void *context;
};

/* Connects controller and pins, ready for a transaction. FT_ERR_TIMEOUT: a block does not leave reset. */
enum ft_status i2c_open(const struct i2c_pins *pins, struct i2c_owner owner);

/* Puts the controller into reset, in the middle of a transaction too, which lets go of both lines,
 * and turns them into open-drain pins, not pulled low. */
void i2c_close_to_lines(const struct i2c_pins *pins);

/* START, address, one byte, STOP. Any earlier transaction must have ended. Answers like i2c_poll(): FT_PENDING or FT_ERR_BUSY. */
enum ft_status i2c_start_write(uint8_t address, uint8_t byte);

/* START, address, byte_count (1..I2C_MAX_READ_BYTES) bytes read, STOP. */
enum ft_status i2c_start_read(uint8_t address, uint8_t byte_count);

/* FT_PENDING: under way, the owner will be called. FT_ERR_BUSY: the controller is still leaving the transaction before;
 * no call will come, ask again after I2C_IDLE_us. FT_OK: ended, the bytes read are in bytes. FT_ERR_NACK: ended, the
 * address or the byte was not acknowledged. FT_ERR_TIMEOUT: ended without its STOP, as when arbitration is lost. */
enum ft_status i2c_poll(uint8_t bytes[I2C_MAX_READ_BYTES]);
#define I2C_IDLE_us 5u

/* After i2c_close_to_lines(). */
enum i2c_line { I2C_LINE_SDA, I2C_LINE_SCL };
void i2c_line_pull_low(const struct i2c_pins *pins, enum i2c_line line);
void i2c_line_release(const struct i2c_pins *pins, enum i2c_line line);
bool i2c_line_is_high(const struct i2c_pins *pins, enum i2c_line line);

/* Interrupt vector of I2C0. */
void i2c0_irq_handler(void);
