#include "pico_parallel/parallel_bus.h"

#include "rp2040/wave_player.h"

#include <string.h>

/* The longest wave, and ample time for what the caller did between now_us and the start, such as checking fifteen PROMs, and for the way to
 * the event handler. No wave waits for anything, so one that is not over by then will never be. */
#define LONGEST_us (I2C_WAVE_READ_CELLS * WAVE_CELL_ns / 1000u + 700u)
/* From the start of a read to the samples of this byte, which come in pairs, and a little later */
#define LOOK_us(index) (uint8_t)((I2C_WAVE_CELLS_WITH_BYTE(index) + 2u) * WAVE_CELL_ns / 1000u)
/* From the look at the clock that a read is started with to its first step, which takes more than 300 cycles of clk_sys at 125 MHz */
#define START_ns 2000u
#define FREE_INTERVAL_MAX 1024u

static void play(struct parallel_bus *bus, const uint16_t *steps, unsigned cell_count, uint64_t now_us) {
  bus->deadline_us = now_us + LONGEST_us;
  wave_player_start(steps, bus->samples, cell_count);
}

static void play_operation(struct parallel_bus *bus, uint64_t now_us) {
  if (bus->operation == PARALLEL_BUS_COMMAND) {
    play(bus, bus->command_steps, I2C_WAVE_COMMAND_CELLS, now_us);
  } else {
    play(bus, bus->read_steps, bus->read_cells, now_us);
  }
}

static void play_recovery(struct parallel_bus *bus, uint16_t lines, uint64_t now_us) {
  i2c_wave_recovery(bus->recovery_steps, lines);
  play(bus, bus->recovery_steps, I2C_WAVE_RECOVERY_CELLS, now_us);
}

/* Whether this command is one before which the stuck lines get their clocks. */
static bool must_free(struct parallel_bus *bus) {
  if (bus->stuck == 0) {
    bus->free_interval = 1;
    bus->free_wait = 0;
    return false;
  }
  if (bus->free_wait > 0) {
    bus->free_wait--;
    return false;
  }
  bus->free_wait = bus->free_interval;
  if (bus->free_interval < FREE_INTERVAL_MAX) {
    bus->free_interval = (uint16_t)(2 * bus->free_interval);
  }
  return true;
}

static enum ft_status start_command(void *context, uint8_t command, uint64_t now_us) {
  struct parallel_bus *bus = context;
  if (bus->operation != PARALLEL_BUS_IDLE) {
    return FT_ERR_BUSY;
  }
  bus->operation = PARALLEL_BUS_COMMAND;
  if (bus->failed) {
    return FT_OK;
  }
  if (command != bus->command) {
    bus->command = command;
    i2c_wave_set_command(bus->command_steps, command);
  }
  bus->freeing = must_free(bus);
  if (bus->freeing) {
    play_recovery(bus, bus->stuck, now_us);
  } else {
    play_operation(bus, now_us);
  }
  return FT_OK;
}

static enum ft_status start_read(void *context, uint8_t command, uint8_t byte_count, uint64_t now_us) {
  struct parallel_bus *bus = context;
  if (byte_count < 1 || byte_count > ARRAY_BUS_MAX_READ_BYTES) {
    return FT_ERR_ARGUMENT;
  }
  if (bus->operation != PARALLEL_BUS_IDLE) {
    return FT_ERR_BUSY;
  }
  bus->operation = PARALLEL_BUS_READ;
  bus->in_bytes = UINT16_MAX;
  if (bus->failed) {
    return FT_OK;
  }
  if (byte_count != bus->read_count) {
    bus->read_count = byte_count;
    bus->read_cells = (uint8_t)i2c_wave_read(bus->read_steps, command, byte_count);
    bus->read_look_us = byte_count > 1 ? LOOK_us(byte_count - 2u) : 0;
  } else if (command != bus->read_command) {
    i2c_wave_set_command(bus->read_steps, command);
  }
  bus->read_command = command;
  bus->bytes_taken = 0;
  bus->look_us = now_us + bus->read_look_us;
  play_operation(bus, now_us);
  return FT_OK;
}

static enum ft_status start_recovery(void *context, uint64_t now_us) {
  struct parallel_bus *bus = context;
  bus->operation = PARALLEL_BUS_RECOVERY;
  bus->look_us = now_us;
  bus->freeing = false;
  bus->failed = wave_player_open() != FT_OK;
  if (!bus->failed) {
    play_recovery(bus, BOARD_SDA_LINES, now_us);
  }
  return FT_OK;
}

/* Takes the bytes that are complete; most of them while the last one is still on its way, so that little is left to do at the end. */
static void take_bytes(struct parallel_bus *bus, struct array_bus_result *result) {
  const unsigned cells = wave_player_sampled();
  while (bus->bytes_taken < bus->read_count && cells >= I2C_WAVE_CELLS_WITH_BYTE(bus->bytes_taken)) {
    bus->in_bytes &= i2c_wave_byte(bus->samples, bus->bytes_taken, result->bytes);
    bus->bytes_taken++;
  }
}

/* The nine clocks are over: takes note of the lines that are still held. False if SCL is. */
static bool look_at_idle_lines(struct parallel_bus *bus) {
  const unsigned levels = bus->samples[I2C_WAVE_RECOVERY_CELLS - 1];
  bus->stuck = (uint16_t)(~levels & BOARD_SDA_LINES);
  return (levels & BOARD_SCL_LINE) != 0;
}

static enum ft_status judge(struct parallel_bus *bus, struct array_bus_result *result) {
  if (bus->operation == PARALLEL_BUS_RECOVERY) {
    return look_at_idle_lines(bus) ? FT_OK : FT_ERR_STUCK;
  }
  const bool is_read = bus->operation == PARALLEL_BUS_READ;
  if (is_read) {
    take_bytes(bus, result);
  }
  const struct i2c_reply reply =
      is_read ? i2c_wave_reply(bus->samples, bus->read_count, bus->in_bytes) : i2c_wave_reply(bus->samples, 0, UINT16_MAX);
  if (!reply.scl_follows) {
    return FT_ERR_TIMEOUT;
  }
  bus->stuck = reply.held;
  result->acknowledged = reply.acknowledged;
  result->nacks = count_sensors(BOARD_SDA_LINES & ~reply.acknowledged);
  return FT_OK;
}

static enum ft_status poll(void *context, uint64_t now_us, struct array_bus_result *result, uint64_t *wake_us) {
  struct parallel_bus *bus = context;
  enum ft_status status;
  if (bus->operation == PARALLEL_BUS_IDLE) {
    return FT_ERR_ARGUMENT;
  }
  if (bus->failed) {
    status = bus->operation == PARALLEL_BUS_RECOVERY ? FT_ERR_STUCK : FT_ERR_TIMEOUT;
  } else if (!wave_player_has_ended()) {
    if (now_us < bus->deadline_us) {
      *wake_us = bus->deadline_us;
      if (now_us < bus->look_us) {
        *wake_us = bus->look_us;
      } else if (bus->operation == PARALLEL_BUS_READ) {
        take_bytes(bus, result);
      }
      return FT_PENDING;
    }
    status = bus->operation == PARALLEL_BUS_RECOVERY ? FT_ERR_STUCK : FT_ERR_TIMEOUT;
  } else if (bus->freeing && look_at_idle_lines(bus)) {
    bus->freeing = false;
    play_operation(bus, now_us);
    *wake_us = bus->deadline_us;
    return FT_PENDING;
  } else {
    status = bus->freeing ? FT_ERR_TIMEOUT : judge(bus, result);
  }
  bus->failed = status != FT_OK;
  bus->operation = PARALLEL_BUS_IDLE;
  return status;
}

enum ft_status parallel_bus_init(struct parallel_bus *bus, struct array_bus *array_bus) {
  memset(bus, 0, sizeof *bus);
  const enum ft_status status = wave_player_open();
  if (status != FT_OK) {
    return status;
  }
  i2c_wave_command(bus->command_steps, bus->command);
  bus->stuck = BOARD_SDA_LINES; /* a reset of this chip alone leaves sensors in mid-byte */
  *array_bus = (struct array_bus){
      .context = bus,
      .read_lead_us = (I2C_WAVE_COMMAND_ns + START_ns) / 1000u,
      .answers_are_single = true,
      .start_command = start_command,
      .start_read = start_read,
      .start_recovery = start_recovery,
      .poll = poll,
  };
  return FT_OK;
}
