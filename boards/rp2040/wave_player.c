#include "rp2040/wave_player.h"

#include "rp2040/dma_regs.h"
#include "rp2040/event.h"
#include "rp2040/gpio.h"
#include "rp2040/nvic.h"
#include "rp2040/pio_regs.h"
#include "rp2040/resets.h"

enum {
  LINES = 16,
  CYCLE_ns = 40, /* of the state machine: clk_sys at 125 MHz, divided by 5 */
  CLOCK_DIVIDER = 5,
  CHANNEL_STEPS = 0,
  CHANNEL_SAMPLES = 1,
};
/* The delay of an instruction for a step of this length: the instruction itself is a cycle. */
#define DELAY(ns) ((ns) / CYCLE_ns - 1)

static const uint16_t program[] = {
    PIO_OUT_PINDIRS(LINES, DELAY(WAVE_STEP0_ns - CYCLE_ns)),
    PIO_IN_PINS(LINES, 0),
    PIO_OUT_PINDIRS(LINES, DELAY(WAVE_STEP1_ns)),
    PIO_OUT_PINDIRS(LINES, DELAY(WAVE_STEP2_ns)),
    PIO_OUT_PINDIRS(LINES, DELAY(WAVE_STEP3_ns)),
};
enum { PROGRAM_LENGTH = sizeof program / sizeof program[0] };
_Static_assert(DELAY(WAVE_STEP3_ns) <= 31, "a delay has five bits");
_Static_assert(WAVE_STEP0_ns % CYCLE_ns == 0 && WAVE_STEP1_ns % CYCLE_ns == 0 && WAVE_STEP2_ns % CYCLE_ns == 0 &&
                   WAVE_STEP3_ns % CYCLE_ns == 0,
               "steps are whole cycles");

static unsigned cells; /* of the wave under way */

enum ft_status wave_player_open(void) {
  rp2040_irq_disable(RP2040_IRQ_DMA_0);
  resets_assert(RESETS_PIO0 | RESETS_DMA);
  const enum ft_status status = resets_release(RESETS_IO_BANK0 | RESETS_PADS_BANK0 | RESETS_PIO0 | RESETS_DMA);
  if (status != FT_OK) {
    return status;
  }

  for (unsigned i = 0; i < PROGRAM_LENGTH; i++) {
    PIO_INSTR_MEM(PIO0_BASE, i) = program[i];
  }
  PIO_SM0_CLKDIV(PIO0_BASE) = PIO_CLKDIV_INT(CLOCK_DIVIDER);
  PIO_SM0_EXECCTRL(PIO0_BASE) = PIO_EXECCTRL_WRAP(0, PROGRAM_LENGTH - 1);
  PIO_SM0_PINCTRL(PIO0_BASE) = PIO_PINCTRL_OUT(0, LINES) | PIO_PINCTRL_IN(0);
  PIO_SM0_INSTR(PIO0_BASE) = PIO_MOV_PINS_NULL; /* a driven line is low; after the reset none is driven */
  PIO_SM0_SHIFTCTRL(PIO0_BASE) = PIO_SHIFTCTRL_OUT_RIGHT | PIO_SHIFTCTRL_IN_RIGHT | PIO_SHIFTCTRL_AUTOPULL | PIO_SHIFTCTRL_AUTOPUSH;
  for (unsigned pin = 0; pin < LINES; pin++) {
    gpio_set_pad(pin, GPIO_PULL_UP);
    gpio_set_function(pin, GPIO_FUNCTION_PIO0);
  }
  PIO_CTRL(PIO0_BASE) = PIO_CTRL_SM0_ENABLE;

  DMA_INTE0 = 1u << CHANNEL_SAMPLES;
  rp2040_irq_enable(RP2040_IRQ_DMA_0);
  return FT_OK;
}

/* A word holds two steps or two samples, the first in its low half, which leaves the shift register first and enters it first. */
/* NOLINTNEXTLINE(readability-non-const-parameter): DMA writes the samples */
void wave_player_start(const uint16_t *steps, uint16_t *samples, unsigned cell_count) {
  cells = cell_count;
  DMA_READ_ADDR(CHANNEL_SAMPLES) = PIO_RXF0_ADDRESS(PIO0_BASE);
  DMA_WRITE_ADDR(CHANNEL_SAMPLES) = (uint32_t)(uintptr_t)samples;
  DMA_TRANS_COUNT(CHANNEL_SAMPLES) = cell_count / 2;
  DMA_CTRL_TRIG(CHANNEL_SAMPLES) =
      DMA_CTRL_EN | DMA_CTRL_WORDS | DMA_CTRL_INCR_WRITE | DMA_CTRL_CHAIN_TO(CHANNEL_SAMPLES) | DMA_CTRL_TREQ(DMA_DREQ_PIO0_RX0);
  DMA_READ_ADDR(CHANNEL_STEPS) = (uint32_t)(uintptr_t)steps;
  DMA_WRITE_ADDR(CHANNEL_STEPS) = PIO_TXF0_ADDRESS(PIO0_BASE);
  DMA_TRANS_COUNT(CHANNEL_STEPS) = WAVE_STEPS_PER_CELL * cell_count / 2;
  DMA_CTRL_TRIG(CHANNEL_STEPS) = DMA_CTRL_EN | DMA_CTRL_WORDS | DMA_CTRL_INCR_READ | DMA_CTRL_CHAIN_TO(CHANNEL_STEPS) |
                                 DMA_CTRL_TREQ(DMA_DREQ_PIO0_TX0) | DMA_CTRL_IRQ_QUIET;
}

unsigned wave_player_sampled(void) { return cells - 2 * DMA_TRANS_COUNT(CHANNEL_SAMPLES); }

bool wave_player_has_ended(void) { return (DMA_CTRL_TRIG(CHANNEL_SAMPLES) & DMA_CTRL_BUSY) == 0; }

void dma0_irq_handler(void) {
  DMA_INTS0 = 1u << CHANNEL_SAMPLES;
  rp2040_event();
}
