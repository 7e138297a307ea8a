#include "rp2040/i2c.h"

#include "rp2040/gpio.h"
#include "rp2040/i2c_regs.h"
#include "rp2040/nvic.h"
#include "rp2040/resets.h"

/* Timing in cycles of ic_clk = clk_sys = 125 MHz, 8 ns (datasheet 4.3.14):
 *   SCL low = LCNT + 1,  SCL high = HCNT + SPKLEN + 7,  tHD;STA = HCNT + 3.
 * Fast mode asks for tLOW >= 1.3 us, tHIGH >= 0.6 us, tHD;STA >= 0.6 us and spikes of 50 ns to be ignored. The low time is counted from the
 * moment the controller begins to pull, so the longest fall time allowed, 0.3 us, is added to it. 1600 ns + 904 ns = 2504 ns: 399.4 kHz,
 * less the rise time of the bus. The SDA hold bridges the same fall time of SCL. */
#define CYCLES(ns) (((ns) + 7u) / 8u)
enum {
  SPIKE_CYCLES = CYCLES(50),
  LOW_CYCLES = CYCLES(1300 + 300),
  HIGH_CYCLES = CYCLES(2500) - LOW_CYCLES,
  SDA_HOLD_CYCLES = CYCLES(300),
  LCNT = LOW_CYCLES - 1,
  HCNT = HIGH_CYCLES - SPIKE_CYCLES - 7,
};
_Static_assert(LOW_CYCLES + HIGH_CYCLES >= CYCLES(2500), "SCL above 400 kHz");
_Static_assert(HIGH_CYCLES >= CYCLES(600), "SCL high time too short");
_Static_assert(HCNT + 3 >= CYCLES(600), "START hold time too short");
_Static_assert(LCNT > SPIKE_CYCLES + 7 && HCNT > SPIKE_CYCLES + 5, "limits of the controller");
_Static_assert(SDA_HOLD_CYCLES <= LOW_CYCLES - 2, "limit of the controller");

static struct i2c_owner owner;

static struct {
  uint8_t address;
  uint8_t byte;
  uint8_t read_count;
  bool loaded;
} transaction;

enum ft_status i2c_open(const struct i2c_pins *pins, struct i2c_owner new_owner) {
  owner = new_owner;
  resets_assert(RESETS_I2C0);
  enum ft_status status = resets_release(RESETS_IO_BANK0 | RESETS_PADS_BANK0 | RESETS_I2C0);
  if (status != FT_OK) {
    return status;
  }

  IC_CON = IC_CON_MASTER_MODE | IC_CON_SPEED_FAST | IC_CON_RESTART_EN | IC_CON_SLAVE_DISABLE;
  IC_FS_SCL_HCNT = HCNT;
  IC_FS_SCL_LCNT = LCNT;
  IC_FS_SPKLEN = SPIKE_CYCLES;
  IC_SDA_HOLD = SDA_HOLD_CYCLES | IC_SDA_HOLD_RX(1u);
  IC_INTR_MASK = 0;
  rp2040_irq_enable(RP2040_IRQ_I2C0);

  const uint8_t both[] = {pins->sda, pins->scl};
  for (unsigned i = 0; i < 2; i++) {
    gpio_set_pad(both[i], GPIO_PULL_UP);
    gpio_set_function(both[i], GPIO_FUNCTION_I2C);
  }
  return FT_OK;
}

void i2c_close_to_lines(const struct i2c_pins *pins) {
  rp2040_irq_disable(RP2040_IRQ_I2C0);
  const uint8_t both[] = {pins->sda, pins->scl};
  for (unsigned i = 0; i < 2; i++) {
    gpio_drive(both[i], false);
    gpio_write(both[i], false);
    gpio_set_function(both[i], GPIO_FUNCTION_SIO);
  }
  resets_assert(RESETS_I2C0);
}

/* After a STOP the controller keeps the bus free for LOW_CYCLES, and only then is disabled and lets IC_TAR be written.
 * Often that time has passed before the next transaction is known; the rest of it is shorter than an alarm, so it is
 * polled: at five cycles or more a read, for at most 2 us unless the bus is held. */
enum { IDLE_POLLS = 50 };

static enum ft_status load_when_idle(void) {
  for (int polls = 0; (IC_ENABLE_STATUS & IC_ENABLE_STATUS_IC_EN) != 0; polls++) {
    if (polls == IDLE_POLLS) {
      return FT_ERR_BUSY;
    }
  }
  IC_TAR = transaction.address;
  (void)IC_CLR_TX_ABRT;
  (void)IC_CLR_INTR;
  IC_ENABLE = 1;
  if (transaction.read_count == 0) {
    IC_DATA_CMD = transaction.byte | IC_DATA_CMD_STOP;
  }
  for (unsigned i = 1; i <= transaction.read_count; i++) {
    IC_DATA_CMD = IC_DATA_CMD_READ | (i == transaction.read_count ? IC_DATA_CMD_STOP : 0);
  }
  IC_INTR_MASK = IC_INTR_STOP_DET | IC_INTR_TX_ABRT;
  transaction.loaded = true;
  return FT_PENDING;
}

static enum ft_status start(uint8_t address, uint8_t byte, uint8_t read_count) {
  transaction.address = address;
  transaction.byte = byte;
  transaction.read_count = read_count;
  transaction.loaded = false;
  IC_ENABLE = 0;
  return load_when_idle();
}

enum ft_status i2c_start_write(uint8_t address, uint8_t byte) { return start(address, byte, 0); }

enum ft_status i2c_start_read(uint8_t address, uint8_t byte_count) { return start(address, 0, byte_count); }

static enum ft_status end(enum ft_status status) {
  IC_INTR_MASK = 0;
  IC_ENABLE = 0;
  return status;
}

enum ft_status i2c_poll(uint8_t bytes[I2C_MAX_READ_BYTES]) {
  if (!transaction.loaded) {
    return load_when_idle();
  }

  const uint32_t events = IC_RAW_INTR_STAT;
  if ((events & IC_INTR_TX_ABRT) != 0) {
    const uint32_t nack = IC_TX_ABRT_7B_ADDR_NOACK | IC_TX_ABRT_TXDATA_NOACK;
    if ((IC_TX_ABRT_SOURCE & nack) == 0) {
      return end(FT_ERR_TIMEOUT);
    }
    if ((events & IC_INTR_STOP_DET) != 0) {
      return end(FT_ERR_NACK);
    }
    IC_INTR_MASK = IC_INTR_STOP_DET; /* the controller sends its STOP by itself */
    return FT_PENDING;
  }
  if ((events & IC_INTR_STOP_DET) == 0) {
    IC_INTR_MASK = IC_INTR_STOP_DET | IC_INTR_TX_ABRT;
    return FT_PENDING;
  }
  if (IC_RXFLR != transaction.read_count) {
    return end(FT_ERR_TIMEOUT);
  }
  for (unsigned i = 0; i < transaction.read_count; i++) {
    bytes[i] = (uint8_t)IC_DATA_CMD;
  }
  return end(FT_OK);
}

static uint8_t pin_of(const struct i2c_pins *pins, enum i2c_line line) { return line == I2C_LINE_SDA ? pins->sda : pins->scl; }

void i2c_line_pull_low(const struct i2c_pins *pins, enum i2c_line line) { gpio_drive(pin_of(pins, line), true); }

void i2c_line_release(const struct i2c_pins *pins, enum i2c_line line) { gpio_drive(pin_of(pins, line), false); }

bool i2c_line_is_high(const struct i2c_pins *pins, enum i2c_line line) { return gpio_read(pin_of(pins, line)); }

/* The interrupts are levels, cleared by the next transaction: masked until i2c_poll has read them. */
void i2c0_irq_handler(void) {
  IC_INTR_MASK = 0;
  owner.on_event(owner.context);
}
