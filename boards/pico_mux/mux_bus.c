#include "pico_mux/mux_bus.h"

#include "rp2040/gpio.h"

#include <string.h>

enum {
  ALL_CHANNELS = (1 << BOARD_CHANNELS_PER_MUX) - 1,
  ALL_MUXES = (1 << BOARD_MUX_COUNT) - 1,
  RECOVERY_CLOCKS = 9, /* UM10204 3.1.16: a device that holds SDA lets go within nine */
};
#define RECOVERY_HALF_PERIOD_us 5u /* 100 kHz, for whatever is on the bus */

/* Twice the time on the bus, for slow edges, and the way from interrupt to event handler. */
#define MARGIN_us(bus_us) (2u * (bus_us) + 50u)

static const struct i2c_pins PINS = {.sda = BOARD_PIN_SDA, .scl = BOARD_PIN_SCL};

static void drive_resets(uint8_t muxes, bool released) {
  for (unsigned mux = 0; mux < BOARD_MUX_COUNT; mux++) {
    if ((muxes >> mux & 1) != 0) {
      gpio_write(BOARD_PIN_MUX_RESET_0 + mux, released);
    }
  }
}

static void reset_muxes(struct mux_bus *bus, uint8_t muxes) {
  drive_resets(muxes, false);
  for (unsigned mux = 0; mux < BOARD_MUX_COUNT; mux++) {
    if ((muxes >> mux & 1) != 0) {
      bus->open[mux] = 0;
    }
  }
}

static uint32_t sensors_of(uint8_t muxes) {
  uint32_t sensors = 0;
  for (unsigned mux = 0; mux < BOARD_MUX_COUNT; mux++) {
    if ((muxes >> mux & 1) != 0) {
      sensors |= (uint32_t)ALL_CHANNELS << mux * BOARD_CHANNELS_PER_MUX;
    }
  }
  return sensors;
}

static void expect_end(struct mux_bus *bus, enum ft_status status, uint64_t now_us) {
  bus->wake_us = status == FT_ERR_BUSY ? now_us + I2C_IDLE_us : bus->deadline_us;
}

/* Starts the next selection towards wanted, channels of each multiplexer; false if none is left. */
static bool select_one(struct mux_bus *bus, const uint8_t wanted[BOARD_MUX_COUNT],
                       uint64_t now_us) {
  /* Off before on: at no moment may two sensors answer a read. */
  for (int turn_off = 1; turn_off >= 0; turn_off--) {
    for (unsigned mux = 0; mux < BOARD_MUX_COUNT; mux++) {
      if (bus->open[mux] == wanted[mux] || (bus->absent >> mux & 1) != 0 ||
          (wanted[mux] == 0) != (turn_off != 0)) {
        continue;
      }
      bus->under_way = MUX_BUS_SELECT;
      bus->select_mux = (uint8_t)mux;
      bus->select_channels = wanted[mux];
      bus->deadline_us = now_us + MARGIN_us(I2C_WRITE_us);
      expect_end(bus, i2c_start_write((uint8_t)(BOARD_MUX_ADDRESS_0 + mux), wanted[mux]), now_us);
      return true;
    }
  }
  return false;
}

static bool select_all(struct mux_bus *bus, uint64_t now_us) {
  const uint8_t wanted[BOARD_MUX_COUNT] = {ALL_CHANNELS, ALL_CHANNELS, ALL_CHANNELS};
  return select_one(bus, wanted, now_us);
}

static bool select_sensor(struct mux_bus *bus, unsigned sensor, uint64_t now_us) {
  uint8_t wanted[BOARD_MUX_COUNT] = {0};
  wanted[sensor / BOARD_CHANNELS_PER_MUX] = (uint8_t)(1u << sensor % BOARD_CHANNELS_PER_MUX);
  return select_one(bus, wanted, now_us);
}

/* Starts the next transaction of the operation; false if there is none left. */
static bool start_next(struct mux_bus *bus, uint64_t now_us) {
  switch (bus->operation) {
  case MUX_BUS_COMMAND:
    if (!select_all(bus, now_us)) {
      if (bus->absent == ALL_MUXES) {
        return false;
      }
      bus->under_way = MUX_BUS_WRITE;
      bus->deadline_us = now_us + MARGIN_us(I2C_WRITE_us);
      expect_end(bus, i2c_start_write(BOARD_SENSOR_ADDRESS, bus->command), now_us);
    }
    return true;
  case MUX_BUS_READ:
    for (; bus->sensor < BOARD_SENSOR_COUNT; bus->sensor++) {
      if (select_sensor(bus, bus->sensor, now_us)) {
        return true;
      }
      if ((bus->absent >> bus->sensor / BOARD_CHANNELS_PER_MUX & 1) != 0) {
        continue;
      }
      bus->under_way = MUX_BUS_FETCH;
      bus->deadline_us = now_us + MARGIN_us(I2C_WRITE_READ_us(bus->read_count));
      expect_end(bus, i2c_start_write_read(BOARD_SENSOR_ADDRESS, bus->command, bus->read_count),
                 now_us);
      return true;
    }
    return false;
  default:
    /* Between a command and the read that usually follows. */
    return select_sensor(bus, 0, now_us);
  }
}

/* Takes note of how a transaction ended. */
static void account(struct mux_bus *bus, bool acknowledged, const uint8_t *bytes) {
  if (!acknowledged) {
    bus->result.nacks++;
  }
  switch (bus->under_way) {
  case MUX_BUS_SELECT:
    if (acknowledged) {
      bus->open[bus->select_mux] = bus->select_channels;
    } else {
      bus->absent |= (uint8_t)(1u << bus->select_mux);
      reset_muxes(bus, (uint8_t)(1u << bus->select_mux));
    }
    break;
  case MUX_BUS_WRITE:
    if (acknowledged) {
      bus->result.acknowledged = sensors_of(ALL_MUXES & (uint8_t)~bus->absent);
    }
    break;
  case MUX_BUS_FETCH:
    if (acknowledged) {
      bus->result.acknowledged |= UINT32_C(1) << bus->sensor;
      memcpy(bus->result.bytes[bus->sensor], bytes, bus->read_count);
    }
    bus->sensor++;
    break;
  case MUX_BUS_NOTHING:
    break;
  }
}

/* Advances by at most one transaction that has ended. FT_OK: the operation has no more to do. */
static enum ft_status advance(struct mux_bus *bus, uint64_t now_us, uint64_t *wake_us) {
  if (bus->under_way != MUX_BUS_NOTHING) {
    uint8_t bytes[I2C_MAX_READ_BYTES];
    const enum ft_status status = i2c_poll(bytes);
    if (status == FT_PENDING || status == FT_ERR_BUSY) {
      if (now_us >= bus->deadline_us) {
        return FT_ERR_TIMEOUT;
      }
      expect_end(bus, status, now_us);
      *wake_us = bus->wake_us;
      return FT_PENDING;
    }
    if (status != FT_OK && status != FT_ERR_NACK) {
      return FT_ERR_TIMEOUT;
    }
    const bool command_sent = bus->under_way == MUX_BUS_WRITE;
    account(bus, status == FT_OK, bytes);
    bus->under_way = MUX_BUS_NOTHING;
    if (command_sent) {
      return FT_OK;
    }
  }
  if (!start_next(bus, now_us)) {
    return FT_OK;
  }
  *wake_us = bus->wake_us;
  return FT_PENDING;
}

/* One half period of the recovery; *wake_us is when the next one is due. */
static enum ft_status recover_step(struct mux_bus *bus, uint64_t now_us, uint64_t *wake_us) {
  if (now_us < bus->recovery_due_us) {
    *wake_us = bus->recovery_due_us;
    return FT_PENDING;
  }
  switch (bus->recovery_step) {
  case MUX_BUS_CLOCK_LOW:
    i2c_line_release(&PINS, I2C_LINE_SCL);
    bus->recovery_clocks++;
    bus->recovery_step = MUX_BUS_CLOCK_HIGH;
    break;
  case MUX_BUS_CLOCK_HIGH:
    bus->recovery_step =
        i2c_line_is_high(&PINS, I2C_LINE_SDA) || bus->recovery_clocks == RECOVERY_CLOCKS
            ? MUX_BUS_STOP_LOW
            : MUX_BUS_CLOCK_LOW;
    i2c_line_pull_low(&PINS, I2C_LINE_SCL);
    break;
  case MUX_BUS_STOP_LOW:
    i2c_line_pull_low(&PINS, I2C_LINE_SDA);
    bus->recovery_step = MUX_BUS_STOP_RISE;
    break;
  case MUX_BUS_STOP_RISE:
    i2c_line_release(&PINS, I2C_LINE_SCL);
    bus->recovery_step = MUX_BUS_STOP_DONE;
    break;
  case MUX_BUS_STOP_DONE:
    i2c_line_release(&PINS, I2C_LINE_SDA);
    reset_muxes(bus, ALL_MUXES);
    bus->recovery_step = MUX_BUS_MUX_RESET;
    break;
  case MUX_BUS_MUX_RESET:
    drive_resets(ALL_MUXES, true);
    bus->recovery_step = MUX_BUS_REOPEN;
    break;
  case MUX_BUS_REOPEN:
    if (!i2c_line_is_high(&PINS, I2C_LINE_SDA) || !i2c_line_is_high(&PINS, I2C_LINE_SCL)) {
      return FT_ERR_STUCK;
    }
    return i2c_open(&PINS) == FT_OK ? FT_OK : FT_ERR_STUCK;
  }
  bus->recovery_due_us = now_us + RECOVERY_HALF_PERIOD_us;
  *wake_us = bus->recovery_due_us;
  return FT_PENDING;
}

static enum ft_status start(struct mux_bus *bus, enum mux_bus_operation operation, uint8_t command,
                            uint8_t byte_count, uint64_t now_us) {
  if (bus->operation != MUX_BUS_IDLE) {
    return FT_ERR_BUSY;
  }
  bus->operation = operation;
  bus->command = command;
  bus->read_count = byte_count;
  bus->sensor = 0;
  drive_resets(bus->absent, true);
  bus->absent = 0;
  bus->result.acknowledged = 0;
  if (bus->failed) {
    return FT_OK;
  }
  if (bus->under_way == MUX_BUS_NOTHING) {
    start_next(bus, now_us);
  } else { /* left over from the last command, and perhaps nobody has watched it */
    bus->deadline_us = now_us + MARGIN_us(I2C_WRITE_us);
  }
  return FT_OK;
}

static enum ft_status start_command(void *context, uint8_t command, uint64_t now_us) {
  return start(context, MUX_BUS_COMMAND, command, 0, now_us);
}

static enum ft_status start_read(void *context, uint8_t command, uint8_t byte_count,
                                 uint64_t now_us) {
  if (byte_count < 1 || byte_count > ARRAY_BUS_MAX_READ_BYTES) {
    return FT_ERR_ARGUMENT;
  }
  return start(context, MUX_BUS_READ, command, byte_count, now_us);
}

static enum ft_status start_recovery(void *context, uint64_t now_us) {
  struct mux_bus *bus = context;
  bus->failed = true;
  bus->under_way = MUX_BUS_NOTHING;
  bus->operation = MUX_BUS_RECOVERY;
  bus->recovery_step = MUX_BUS_CLOCK_HIGH;
  bus->recovery_clocks = 0;
  bus->recovery_due_us = now_us + RECOVERY_HALF_PERIOD_us;
  bus->absent = 0;
  bus->result.acknowledged = 0;
  i2c_close_to_lines(&PINS);
  return FT_OK;
}

static enum ft_status poll(void *context, uint64_t now_us, struct array_bus_result *result,
                           uint64_t *wake_us) {
  struct mux_bus *bus = context;
  enum ft_status status;
  if (bus->operation == MUX_BUS_IDLE) {
    return FT_ERR_ARGUMENT;
  }
  if (bus->operation == MUX_BUS_RECOVERY) {
    status = recover_step(bus, now_us, wake_us);
  } else if (bus->failed) {
    status = FT_ERR_TIMEOUT;
  } else {
    status = advance(bus, now_us, wake_us);
  }
  if (status == FT_PENDING) {
    return FT_PENDING;
  }

  bus->failed = status != FT_OK;
  const bool conversion_may_run = bus->operation == MUX_BUS_COMMAND && !bus->failed;
  bus->operation = MUX_BUS_IDLE;
  if (status == FT_OK) {
    *result = bus->result;
    bus->result.nacks = 0;
  }
  if (conversion_may_run) {
    start_next(bus, now_us);
  }
  return status;
}

void mux_bus_service(struct mux_bus *bus, uint64_t now_us) {
  uint64_t wake_us;
  if (bus->operation == MUX_BUS_IDLE && bus->under_way != MUX_BUS_NOTHING && !bus->failed) {
    bus->failed = advance(bus, now_us, &wake_us) == FT_ERR_TIMEOUT;
  }
}

enum ft_status mux_bus_init(struct mux_bus *bus, struct array_bus *array_bus) {
  memset(bus, 0, sizeof *bus);
  const enum ft_status status = i2c_open(&PINS);
  if (status != FT_OK) {
    return status;
  }
  for (unsigned mux = 0; mux < BOARD_MUX_COUNT; mux++) {
    const unsigned pin = BOARD_PIN_MUX_RESET_0 + mux;
    gpio_set_pad(pin, GPIO_PULL_NONE);
    gpio_write(pin, false);
    gpio_drive(pin, true);
    gpio_set_function(pin, GPIO_FUNCTION_SIO);
  }
  drive_resets(ALL_MUXES, true);

  *array_bus = (struct array_bus){
      .context = bus,
      .start_command = start_command,
      .start_read = start_read,
      .start_recovery = start_recovery,
      .poll = poll,
  };
  return FT_OK;
}
