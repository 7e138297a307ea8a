#include "pico_mux/mux_bus.h"

#include "rp2040/event.h"
#include "rp2040/gpio.h"

#include <string.h>

enum {
  ALL_CHANNELS = (1 << BOARD_SENSORS_OF_STRIP) - 1,
  ALL_MUXES = (1 << BOARD_MUX_COUNT) - 1,
  NO_MUX = BOARD_MUX_COUNT,
  /* UM10204 3.1.16: a device that holds SDA lets go within nine; one of them is the clock of an acknowledge, and it is not given. */
  RECOVERY_CLOCKS = 9,
};
/* From a START to the acknowledge of address and command, at the least: hold time and eighteen
 * clocks of 2.5 us up to the rise of the last (UM10204, fast mode). */
#define COMMAND_us 44u
#define RECOVERY_HALF_PERIOD_us 5u /* 100 kHz, for whatever is on the bus */

/* Interrupts lead from one transaction to the next; a poll only checks that they move on. A transaction takes 110 us. */
#define STALL_us 1000u
#define SHUT_MIN_us 1000000u
#define SHUT_MAX_us 16000000u

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

static sensor_map sensors_of(uint8_t muxes) {
  sensor_map sensors = 0;
  for (unsigned mux = 0; mux < BOARD_MUX_COUNT; mux++) {
    if ((muxes >> mux & 1) != 0) {
      sensors |= (sensor_map)ALL_CHANNELS << mux * BOARD_SENSORS_OF_STRIP;
    }
  }
  return sensors;
}

/* Switches off by RESET, which takes no transaction. Its shortest pulse, 6 ns, is less than the time between two writes to the pins. */
static void shut_all_but(struct mux_bus *bus, unsigned kept) {
  for (unsigned mux = 0; mux < BOARD_MUX_COUNT; mux++) {
    if (mux != kept && bus->open[mux] != 0) {
      reset_muxes(bus, (uint8_t)(1u << mux));
      drive_resets((uint8_t)(1u << mux), true);
    }
  }
}

static void begin(struct mux_bus *bus, enum mux_bus_transaction what, enum ft_status status) {
  bus->under_way = what;
  bus->controller_busy = status == FT_ERR_BUSY;
}

/* Starts the selection of these channels unless they are on already or the multiplexer is absent. */
static bool select(struct mux_bus *bus, unsigned mux, uint8_t channels) {
  if (bus->open[mux] == channels || (bus->absent >> mux & 1) != 0) {
    return false;
  }
  bus->select_mux = (uint8_t)mux;
  bus->select_channels = channels;
  begin(bus, MUX_BUS_SELECT, i2c_start_write((uint8_t)(BOARD_MUX_ADDRESS_0 + mux), channels));
  return true;
}

static bool select_all(struct mux_bus *bus) {
  for (unsigned mux = 0; mux < BOARD_MUX_COUNT; mux++) {
    if (select(bus, mux, ALL_CHANNELS)) {
      return true;
    }
  }
  return false;
}

/* Starts the next transaction of the operation; false if there is none left. */
static bool start_next(struct mux_bus *bus) {
  if (!bus->command_sent) {
    if (select_all(bus)) {
      return true;
    }
    if (bus->absent == ALL_MUXES) {
      return false;
    }
    begin(bus, MUX_BUS_WRITE, i2c_start_write(BOARD_SENSOR_ADDRESS, bus->command));
    return true;
  }
  if (bus->operation != MUX_BUS_READ) {
    return false;
  }
  while (bus->sensor < BOARD_SENSOR_COUNT) {
    const unsigned mux = bus->sensor / BOARD_SENSORS_OF_STRIP;
    shut_all_but(bus, mux);
    if (select(bus, mux, (uint8_t)(1u << bus->sensor % BOARD_SENSORS_OF_STRIP))) {
      return true;
    }
    if ((bus->absent >> mux & 1) == 0) {
      begin(bus, MUX_BUS_FETCH, i2c_start_read(BOARD_SENSOR_ADDRESS, bus->read_count));
      return true;
    }
    bus->sensor++;
  }
  return false;
}

static void account_select(struct mux_bus *bus, bool acknowledged) {
  const uint8_t bit = (uint8_t)(1u << bus->select_mux);
  if (acknowledged) {
    bus->mux_answers |= bit;
    bus->open[bus->select_mux] = bus->select_channels;
    bus->just_opened = bus->select_mux;
    return;
  }
  reset_muxes(bus, bit);
  if ((bus->mux_answers & bit) != 0) {
    bus->mux_answers &= (uint8_t)~bit;
    drive_resets(bit, true);
  } else {
    bus->absent |= bit;
  }
}

/* A sensor that answered last time and now does not is asked once more. */
static void account_fetch(struct mux_bus *bus, bool acknowledged, const uint8_t *bytes) {
  const sensor_map bit = sensor_bit(bus->sensor);
  if (!acknowledged && (bus->answers & bit) != 0) {
    bus->answers &= ~bit;
    return;
  }
  if (acknowledged) {
    bus->answers |= bit;
    bus->result.acknowledged |= bit;
    memcpy(bus->result.bytes[bus->sensor], bytes, bus->read_count);
  }
  bus->sensor++;
}

/* Takes note of how a transaction ended. */
static void account(struct mux_bus *bus, bool acknowledged, const uint8_t *bytes) {
  if (!acknowledged) {
    bus->result.nacks++;
  }
  bus->just_opened = NO_MUX;
  switch (bus->under_way) {
  case MUX_BUS_SELECT: account_select(bus, acknowledged); break;
  case MUX_BUS_WRITE:
    bus->command_sent = true;
    if (!acknowledged) {
      bus->sensor = BOARD_SENSOR_COUNT; /* there is none */
    } else if (bus->operation == MUX_BUS_COMMAND) {
      bus->result.acknowledged = sensors_of(ALL_MUXES & (uint8_t)~bus->absent);
    }
    break;
  case MUX_BUS_FETCH: account_fetch(bus, acknowledged, bytes); break;
  case MUX_BUS_NOTHING: break;
  }
}

/* Moves from a transaction that has ended to the next one. */
static void advance(struct mux_bus *bus) {
  uint8_t bytes[I2C_MAX_READ_BYTES];
  const enum ft_status status = i2c_poll(bytes);
  bus->controller_busy = status == FT_ERR_BUSY;
  if (status == FT_PENDING || status == FT_ERR_BUSY) {
    return;
  }
  bus->moves++;
  if (status != FT_OK && status != FT_ERR_NACK) {
    bus->failed = true;
    return;
  }
  account(bus, status == FT_OK, bytes);
  bus->under_way = MUX_BUS_NOTHING;
  bus->ended = !start_next(bus);
}

static bool is_moving(const struct mux_bus *bus) {
  return (bus->operation == MUX_BUS_COMMAND || bus->operation == MUX_BUS_READ) && !bus->failed && !bus->ended;
}

static void on_i2c_event(void *context) {
  struct mux_bus *bus = context;
  if (is_moving(bus)) {
    advance(bus);
    if (!is_moving(bus) || bus->controller_busy) {
      rp2040_event();
    }
  }
}

static enum ft_status open_controller(struct mux_bus *bus) {
  return i2c_open(&PINS, (struct i2c_owner){.on_event = on_i2c_event, .context = bus});
}

static enum ft_status look(struct mux_bus *bus, uint64_t now_us, uint64_t *wake_us) {
  if (is_moving(bus)) {
    advance(bus);
  }
  if (!is_moving(bus)) {
    return bus->failed ? FT_ERR_TIMEOUT : FT_OK;
  }
  if (bus->moves != bus->moves_seen) {
    bus->moves_seen = bus->moves;
    bus->deadline_us = now_us + STALL_us;
  } else if (now_us >= bus->deadline_us) {
    return FT_ERR_TIMEOUT;
  }
  *wake_us = bus->controller_busy ? now_us + I2C_IDLE_us : bus->deadline_us;
  return FT_PENDING;
}

/* Twice in a row the bus stalled as soon as this multiplexer had opened: a line behind it is held, and opening it loses the others too. */
static void judge_failure(struct mux_bus *bus, uint64_t now_us) {
  if (bus->just_opened == NO_MUX) {
    return;
  }
  if (bus->just_opened == bus->suspect) {
    bus->shut |= (uint8_t)(1u << bus->suspect);
    bus->shut_until_us = now_us + bus->shut_us;
    bus->shut_us = bus->shut_us < SHUT_MAX_us ? 2 * bus->shut_us : SHUT_MAX_us;
  }
  bus->suspect = bus->just_opened;
  bus->just_opened = NO_MUX;
}

static void judge_success(struct mux_bus *bus) {
  if (bus->shut == 0) {
    bus->suspect = NO_MUX;
    bus->shut_us = SHUT_MIN_us;
  }
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
    bus->recovery_step = bus->recovery_clocks == RECOVERY_CLOCKS ? MUX_BUS_STOP_LOW : MUX_BUS_CLOCK_LOW;
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
    drive_resets(ALL_MUXES & (uint8_t)~bus->shut, true);
    bus->recovery_step = MUX_BUS_REOPEN;
    break;
  case MUX_BUS_REOPEN:
    if (!i2c_line_is_high(&PINS, I2C_LINE_SDA) || !i2c_line_is_high(&PINS, I2C_LINE_SCL)) {
      return FT_ERR_STUCK;
    }
    return open_controller(bus) == FT_OK ? FT_OK : FT_ERR_STUCK;
  }
  bus->recovery_due_us = now_us + RECOVERY_HALF_PERIOD_us;
  *wake_us = bus->recovery_due_us;
  return FT_PENDING;
}

static enum ft_status start(struct mux_bus *bus, enum mux_bus_operation operation, uint8_t command, uint8_t byte_count, uint64_t now_us) {
  if (bus->operation != MUX_BUS_IDLE) {
    return FT_ERR_BUSY;
  }
  bus->operation = operation;
  bus->command = command;
  bus->command_sent = false;
  bus->read_count = byte_count;
  bus->sensor = 0;
  if (now_us >= bus->shut_until_us) {
    bus->shut = 0;
  }
  drive_resets(bus->absent & (uint8_t)~bus->shut, true);
  bus->absent = bus->shut;
  bus->result.acknowledged = 0;
  bus->moves_seen = bus->moves;
  bus->deadline_us = now_us + STALL_us;
  if (!bus->failed) {
    bus->ended = !start_next(bus);
  }
  return FT_OK;
}

static enum ft_status start_command(void *context, uint8_t command, uint64_t now_us) {
  return start(context, MUX_BUS_COMMAND, command, 0, now_us);
}

static enum ft_status start_read(void *context, uint8_t command, uint8_t byte_count, uint64_t now_us) {
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
  bus->just_opened = NO_MUX;
  bus->recovery_due_us = now_us + RECOVERY_HALF_PERIOD_us;
  bus->result.acknowledged = 0;
  i2c_close_to_lines(&PINS);
  return FT_OK;
}

static enum ft_status poll(void *context, uint64_t now_us, struct array_bus_result *result, uint64_t *wake_us) {
  struct mux_bus *bus = context;
  enum ft_status status;
  if (bus->operation == MUX_BUS_IDLE) {
    return FT_ERR_ARGUMENT;
  }
  const bool recovers = bus->operation == MUX_BUS_RECOVERY;
  status = recovers ? recover_step(bus, now_us, wake_us) : look(bus, now_us, wake_us);
  if (status == FT_PENDING) {
    return FT_PENDING;
  }
  bus->failed = status != FT_OK;
  if (bus->failed) {
    judge_failure(bus, now_us);
  } else if (!recovers) {
    judge_success(bus);
  }
  bus->operation = MUX_BUS_IDLE;
  if (status == FT_OK) {
    *result = bus->result;
    bus->result.nacks = 0;
  }
  return status;
}

enum ft_status mux_bus_init(struct mux_bus *bus, struct array_bus *array_bus) {
  memset(bus, 0, sizeof *bus);
  bus->just_opened = NO_MUX;
  bus->suspect = NO_MUX;
  bus->shut_us = SHUT_MIN_us;
  const enum ft_status status = open_controller(bus);
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
      .read_lead_us = COMMAND_us,
      .start_command = start_command,
      .start_read = start_read,
      .start_recovery = start_recovery,
      .poll = poll,
  };
  return FT_OK;
}
