#include "fake_i2c.h"

#include "rp2040/event.h"
#include "rp2040/gpio.h"

#include <string.h>

struct fake_i2c fake;

static struct {
  uint8_t open[BOARD_MUX_COUNT];
  bool in_reset[BOARD_MUX_COUNT];
} mux;

static struct {
  bool active;
  uint8_t address, byte, read_count;
  unsigned number;
  unsigned busy_polls;
  uint64_t end_us;
} transaction;

static struct i2c_owner owner;
static uint8_t heard[BOARD_SENSOR_COUNT];

static bool low[2]; /* [enum i2c_line] pulled by us */

void fake_i2c_power_up(void) {
  memset(&fake, 0, sizeof fake);
  memset(&mux, 0, sizeof mux);
  memset(&transaction, 0, sizeof transaction);
  memset(low, 0, sizeof low);
  memset(heard, 0, sizeof heard);
}

void rp2040_event(void) { fake.events++; }

void fake_i2c_interrupt(void) { owner.on_event(owner.context); }

uint8_t fake_byte(unsigned sensor, uint8_t command, unsigned index) { return (uint8_t)(0x35u + 11u * sensor + 3u * command + 71u * index); }

static uint32_t open_channels(void) {
  uint32_t sensors = 0;
  for (unsigned m = 0; m < BOARD_MUX_COUNT; m++) {
    sensors |= (uint32_t)mux.open[m] << m * BOARD_SENSORS_OF_STRIP;
  }
  return sensors;
}

static bool hangs(void) { return transaction.number == fake.hang_at || (open_channels() & fake.tied_low) != 0; }

uint64_t fake_i2c_next_event_us(void) {
  const bool will_end = transaction.active && transaction.busy_polls == 0 && !hangs();
  return will_end ? transaction.end_us : UINT64_MAX;
}

enum ft_status i2c_open(const struct i2c_pins *pins, struct i2c_owner new_owner) {
  owner = new_owner;
  fake.misuses += pins->sda != BOARD_PIN_SDA || pins->scl != BOARD_PIN_SCL;
  fake.open = true;
  fake.opened++;
  transaction.active = false;
  return FT_OK;
}

void i2c_close_to_lines(const struct i2c_pins *pins) {
  (void)pins;
  fake.open = false;
  transaction.active = false;
  low[I2C_LINE_SDA] = low[I2C_LINE_SCL] = false;
}

static enum ft_status start(uint8_t address, uint8_t byte, uint8_t byte_count) {
  fake.misuses += !fake.open || transaction.active;
  transaction.active = true;
  transaction.address = address;
  transaction.byte = byte;
  transaction.read_count = byte_count;
  transaction.number = ++fake.transactions;
  transaction.busy_polls = fake.busy_polls;
  transaction.end_us = fake.now_us + (byte_count == 0 ? I2C_WRITE_us : I2C_READ_us(byte_count));
  return transaction.busy_polls > 0 ? FT_ERR_BUSY : FT_PENDING;
}

enum ft_status i2c_start_write(uint8_t address, uint8_t byte) { return start(address, byte, 0); }

enum ft_status i2c_start_read(uint8_t address, uint8_t byte_count) { return start(address, 0, byte_count); }

static uint32_t reachable(void) {
  uint32_t sensors = 0;
  for (unsigned k = 0; k < BOARD_SENSOR_COUNT; k++) {
    const unsigned m = k / BOARD_SENSORS_OF_STRIP;
    if ((mux.open[m] >> k % BOARD_SENSORS_OF_STRIP & 1) != 0 && !fake.mux_missing[m] && !fake.sensor_missing[k]) {
      sensors |= UINT32_C(1) << k;
    }
  }
  return sensors;
}

static enum ft_status write_mux(unsigned m) {
  fake.selects++;
  if (m >= BOARD_MUX_COUNT || fake.mux_missing[m] || mux.in_reset[m] || transaction.number == fake.nack_select_at) {
    return FT_ERR_NACK;
  }
  mux.open[m] = transaction.byte;
  return FT_OK;
}

static enum ft_status write_sensors(void) {
  fake.commands++;
  fake.command_reached = reachable();
  fake.last_command = transaction.byte;
  for (unsigned k = 0; k < BOARD_SENSOR_COUNT; k++) {
    heard[k] = (fake.command_reached >> k & 1) != 0 ? transaction.byte : heard[k];
  }
  return fake.command_reached != 0 ? FT_OK : FT_ERR_NACK;
}

static enum ft_status read_sensors(uint8_t *bytes) {
  const uint32_t sensors = reachable();
  fake.reads++;
  if (sensors == 0 || transaction.number == fake.nack_read_at) {
    return FT_ERR_NACK;
  }
  if ((sensors & (sensors - 1)) != 0) {
    fake.collisions++;
  }
  for (unsigned i = 0; i < transaction.read_count; i++) {
    bytes[i] = 0xFF;
    for (unsigned k = 0; k < BOARD_SENSOR_COUNT; k++) {
      if ((sensors >> k & 1) != 0) {
        bytes[i] &= fake_byte(k, heard[k], i);
      }
    }
  }
  return FT_OK;
}

enum ft_status i2c_poll(uint8_t bytes[I2C_MAX_READ_BYTES]) {
  fake.misuses += !fake.open || !transaction.active;
  if (transaction.busy_polls > 0 && --transaction.busy_polls > 0) {
    return FT_ERR_BUSY;
  }
  if (hangs() || fake.now_us < transaction.end_us) {
    return FT_PENDING;
  }
  transaction.active = false;
  if (transaction.number == fake.arbitration_lost_at) {
    return FT_ERR_TIMEOUT;
  }
  if (transaction.address != BOARD_SENSOR_ADDRESS) {
    return write_mux((unsigned)transaction.address - BOARD_MUX_ADDRESS_0);
  }
  return transaction.read_count == 0 ? write_sensors() : read_sensors(bytes);
}

bool i2c_line_is_high(const struct i2c_pins *pins, enum i2c_line line) {
  (void)pins;
  const bool tied = (open_channels() & fake.tied_low) != 0;
  return !low[line] && !(line == I2C_LINE_SDA ? fake.sda_held || tied : fake.scl_held);
}

void i2c_line_pull_low(const struct i2c_pins *pins, enum i2c_line line) {
  (void)pins;
  fake.misuses += fake.open;
  low[line] = true;
}

void i2c_line_release(const struct i2c_pins *pins, enum i2c_line line) {
  const bool was_low = low[line];
  low[line] = false;
  fake.misuses += fake.open;
  if (!was_low) {
    return;
  }
  if (line == I2C_LINE_SDA) {
    if (i2c_line_is_high(pins, I2C_LINE_SDA) && i2c_line_is_high(pins, I2C_LINE_SCL)) {
      fake.stops++;
    }
  } else if (!low[I2C_LINE_SDA] && !fake.scl_held) {
    fake.clocks++;
    if (fake.clocks == fake.sda_free_after_clocks) {
      fake.sda_held = false;
    }
  }
}

void gpio_write(unsigned pin, bool high) {
  const unsigned m = pin - BOARD_PIN_MUX_RESET_0;
  if (m >= BOARD_MUX_COUNT) {
    fake.misuses++;
    return;
  }
  mux.in_reset[m] = !high;
  if (high) {
    return;
  }
  mux.open[m] = 0;
  if (fake.sda_free_by_mux_reset) {
    fake.sda_held = false;
  }
}

void gpio_drive(unsigned pin, bool enabled) {
  const unsigned m = pin - BOARD_PIN_MUX_RESET_0;
  if (m >= BOARD_MUX_COUNT || !enabled || !mux.in_reset[m]) {
    fake.misuses++;
    return;
  }
  fake.driven |= (uint8_t)(1u << m);
}

void gpio_set_pad(unsigned pin, enum gpio_pull pull) {
  fake.misuses += pin - BOARD_PIN_MUX_RESET_0 >= BOARD_MUX_COUNT || pull != GPIO_PULL_NONE;
}

void gpio_set_function(unsigned pin, enum gpio_function function) {
  fake.misuses += pin - BOARD_PIN_MUX_RESET_0 >= BOARD_MUX_COUNT || function != GPIO_FUNCTION_SIO;
}
