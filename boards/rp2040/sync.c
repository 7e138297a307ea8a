#include "rp2040/sync.h"

#include "port/port.h"
#include "port/sync.h"
#include "rp2040/dma_regs.h"
#include "rp2040/gpio.h"
#include "rp2040/interrupts.h"
#include "rp2040/nvic.h"
#include "rp2040/pio_regs.h"
#include "rp2040/resets.h"
#include "rp2040/timer_regs.h"

enum {
  CHANNEL_NUMBERS = 2,
  CHANNEL_TIMES = 3,
  SLOTS_LOG2 = 6,
  SLOTS = 1 << SLOTS_LOG2,
  SAMPLES = 15, /* of a level, three cycles apart, before its edge counts */
};
_Static_assert(PORT_SYNC_CAPACITY + 8 < SLOTS, "a reader has time before what it reads is overwritten");

#define SECOND_us 1000000u
#define PULSE_us 100000u

/* Y counts down from 0, so that its complement is the number of the edge, less one. */
enum { LOW_FIRST = 0, RISE = 1, FALL = 9 };
static const uint16_t program[] = {
    [LOW_FIRST] = PIO_WAIT_PIN(0),
    [RISE] = PIO_WAIT_PIN(1),
    [2] = PIO_SET_X(SAMPLES - 1),
    [3] = PIO_JMP_PIN(5),
    [4] = PIO_JMP(RISE),
    [5] = PIO_JMP_X_DECREMENTED(3, 1),
    [6] = PIO_JMP_Y_DECREMENTED(7),
    [7] = PIO_MOV_ISR_NOT_Y,
    [8] = PIO_PUSH_IF_ROOM,
    [FALL] = PIO_WAIT_PIN(0),
    [10] = PIO_SET_X(SAMPLES - 1),
    [11] = PIO_JMP_PIN(FALL),
    [12] = PIO_JMP_X_DECREMENTED(11, 1),
    [13] = PIO_JMP_Y_DECREMENTED(14),
    [14] = PIO_MOV_ISR_NOT_Y,
    [15] = PIO_PUSH_IF_ROOM,
};
enum { PROGRAM_LENGTH = sizeof program / sizeof program[0] };

/* Written by DMA; a slot of both belongs to one edge. The number is one less than it is called. DMA
 * wraps within aligned addresses only, and the sections that are cleared are not aligned so. */
#define RING __attribute__((section(".noinit.rings"), aligned(4 * SLOTS)))
static volatile uint32_t numbers[SLOTS] RING;
static volatile uint32_t times_us[SLOTS] RING;

static struct {
  enum port_sync mode;
  uint32_t taken;   /* number of the last edge that was taken, or given up */
  uint32_t next_us; /* of the output in mode second, the low word */
  bool is_high;     /* the same output */
} sync;

static bool stamps(enum port_sync mode) { return mode == PORT_SYNC_IN || mode == PORT_SYNC_SECOND; }

/* Once armed, one of the two is always busy: an edge makes the first chain to the second, and back at once. Both could
 * be read idle if an edge came between the two reads, so the first is read again: the next edge is some time off. */
static bool is_armed(void) {
  uint32_t busy = DMA_CTRL_TRIG(CHANNEL_NUMBERS);
  busy |= DMA_CTRL_TRIG(CHANNEL_TIMES);
  busy |= DMA_CTRL_TRIG(CHANNEL_NUMBERS);
  return (busy & DMA_CTRL_BUSY) != 0;
}

/* Nothing has come since the edge that was taken last. */
static void empty_rings(void) {
  for (unsigned i = 0; i < SLOTS; i++)
    numbers[i] = sync.taken - 1;
}

/* What the FIFO holds came before its time could be fetched, so it is lost. */
static void arm(void) {
  empty_rings();
  const uint32_t primask = disable_interrupts();
  PIO_SM0_SHIFTCTRL(PIO1_BASE) = 0;
  PIO_SM0_SHIFTCTRL(PIO1_BASE) = PIO_SHIFTCTRL_JOIN_RX;
  if (!is_armed()) {
    DMA_READ_ADDR(CHANNEL_TIMES) = TIMER_TIMERAWL_ADDRESS;
    DMA_WRITE_ADDR(CHANNEL_TIMES) = (uint32_t)(uintptr_t)times_us;
    DMA_TRANS_COUNT(CHANNEL_TIMES) = 1;
    DMA_CTRL(CHANNEL_TIMES) = DMA_CTRL_EN | DMA_CTRL_WORDS | DMA_CTRL_INCR_WRITE | DMA_CTRL_RING_WRITE(SLOTS_LOG2 + 2) |
                              DMA_CTRL_IRQ_QUIET | DMA_CTRL_CHAIN_TO(CHANNEL_NUMBERS) | DMA_CTRL_TREQ(DMA_DREQ_NONE);
    DMA_READ_ADDR(CHANNEL_NUMBERS) = PIO_RXF0_ADDRESS(PIO1_BASE);
    DMA_WRITE_ADDR(CHANNEL_NUMBERS) = (uint32_t)(uintptr_t)numbers;
    DMA_TRANS_COUNT(CHANNEL_NUMBERS) = 1;
    DMA_CTRL_TRIG(CHANNEL_NUMBERS) = DMA_CTRL_EN | DMA_CTRL_WORDS | DMA_CTRL_INCR_WRITE | DMA_CTRL_RING_WRITE(SLOTS_LOG2 + 2) |
                                     DMA_CTRL_IRQ_QUIET | DMA_CTRL_CHAIN_TO(CHANNEL_TIMES) | DMA_CTRL_TREQ(DMA_DREQ_PIO1_RX0);
  }
  restore_interrupts(primask);
}

static void start_stamping(void) {
  if (resets_release(RESETS_PIO1 | RESETS_DMA) != FT_OK)
    port_panic();
  for (unsigned i = 0; i < PROGRAM_LENGTH; i++)
    PIO_INSTR_MEM(PIO1_BASE, i) = program[i];
  PIO_SM0_CLKDIV(PIO1_BASE) = PIO_CLKDIV_INT(1);
  PIO_SM0_EXECCTRL(PIO1_BASE) = PIO_EXECCTRL_WRAP(RISE, PROGRAM_LENGTH - 1) | PIO_EXECCTRL_JUMP_PIN(sync_pin);
  PIO_SM0_PINCTRL(PIO1_BASE) = PIO_PINCTRL_IN(sync_pin);
  PIO_CTRL(PIO1_BASE) = PIO_CTRL_SM0_RESTART;
  PIO_SM0_INSTR(PIO1_BASE) = PIO_SET_Y(0);
  PIO_SM0_INSTR(PIO1_BASE) = PIO_JMP(LOW_FIRST);
  sync.taken = 0;
  arm();
  PIO_CTRL(PIO1_BASE) = PIO_CTRL_SM0_ENABLE;
}

/* Bit by bit, as in writing: a division of 64 bits is code that nothing else here needs. */
static uint32_t since_second_us(uint64_t t_us) {
  uint32_t rest_us = 0;
  for (int bit = 63; bit >= 0; bit--) {
    rest_us = 2 * rest_us + (uint32_t)(t_us >> bit & 1u);
    rest_us -= rest_us >= SECOND_us ? SECOND_us : 0;
  }
  return rest_us;
}

/* Alarms compare the low word. A second that is about to begin is left out. */
static void start_pulses(void) {
  const uint64_t now_us = port_now_us();
  const uint32_t left_us = SECOND_us - since_second_us(now_us);
  sync.next_us = (uint32_t)now_us + left_us + (left_us < 100 ? SECOND_us : 0);
  sync.is_high = false;
  REG32_SET(TIMER_INTE) = TIMER_ALARM3_BIT;
  rp2040_irq_enable(RP2040_IRQ_TIMER_3);
  TIMER_ALARM3 = sync.next_us;
}

void timer3_irq_handler(void) {
  TIMER_INTR = TIMER_ALARM3_BIT;
  sync.is_high = !sync.is_high;
  gpio_write(sync_pin, sync.is_high);
  sync.next_us += sync.is_high ? PULSE_us : SECOND_us - PULSE_us;
  TIMER_ALARM3 = sync.next_us;
}

static void stop(void) {
  if (sync.mode == PORT_SYNC_SECOND) {
    rp2040_irq_disable(RP2040_IRQ_TIMER_3);
    TIMER_ARMED = TIMER_ALARM3_BIT;
    TIMER_INTR = TIMER_ALARM3_BIT;
  }
  if (stamps(sync.mode))
    PIO_CTRL(PIO1_BASE) = 0;
  gpio_drive(sync_pin, false);
  gpio_set_function(sync_pin, GPIO_FUNCTION_NULL);
}

void port_sync_set(enum port_sync mode) {
  if (sync.mode != PORT_SYNC_OFF)
    stop();
  sync.mode = mode;
  if (mode == PORT_SYNC_OFF)
    return;
  gpio_write(sync_pin, false);
  gpio_set_pad(sync_pin, GPIO_PULL_DOWN);
  gpio_set_function(sync_pin, GPIO_FUNCTION_SIO);
  gpio_drive(sync_pin, mode != PORT_SYNC_IN);
  if (stamps(mode))
    start_stamping();
  if (mode == PORT_SYNC_SECOND)
    start_pulses();
}

void port_sync_write(bool high) { gpio_write(sync_pin, high); }

/* The bus of a board may reset DMA, and both channels with it. */
bool port_sync_take(struct port_sync_edge *edge) {
  if (!is_armed()) {
    arm();
    return false;
  }
  const uint32_t next = (DMA_WRITE_ADDR(CHANNEL_TIMES) - (uint32_t)(uintptr_t)times_us) / 4u;
  if (next >= SLOTS) /* it was reset just now */
    return false;
  const uint32_t newest = numbers[(next - 1u) % SLOTS] + 1u;
  if (newest - sync.taken > PORT_SYNC_CAPACITY)
    sync.taken = newest - PORT_SYNC_CAPACITY;
  if (newest == sync.taken)
    return false;
  const uint32_t slot = (next - (newest - sync.taken)) % SLOTS;
  const uint32_t number = sync.taken + 1u;
  const bool was_there = numbers[slot] + 1u == number;
  const uint32_t time_us = times_us[slot];
  if (!was_there || numbers[slot] + 1u != number) { /* overwritten meanwhile */
    sync.taken = newest;
    return false;
  }
  const uint64_t now_us = port_now_us();
  sync.taken = number;
  edge->number = number;
  edge->t_us = now_us - ((uint32_t)now_us - time_us);
  return true;
}
