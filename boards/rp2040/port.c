#include "port/port.h"

#include "rp2040/crash.h"
#include "rp2040/event.h"
#include "rp2040/flash.h"
#include "rp2040/interrupts.h"
#include "rp2040/mpu.h"
#include "rp2040/nvic.h"
#include "rp2040/resets.h"
#include "rp2040/sio_regs.h"
#include "rp2040/timer_regs.h"
#include "rp2040/watchdog_regs.h"

/* ALARM0 compares 32 bits, so nearer than one turn of the low word. */
#define ALARM_HORIZON_us UINT32_C(0x7fffffff)

static struct {
  void (*handler)(void *context);
  void *context;
} event;

static struct {
  uint64_t due_us;
  bool set;
  bool is_far; /* due beyond the horizon: when it fires, arm it again */
} alarm;

static char serial_number[2 * FLASH_ID_BYTES + 1];

uint64_t port_now_us(void) {
  uint32_t high = TIMER_TIMERAWH;
  uint32_t low = TIMER_TIMERAWL;
  uint32_t high_again = TIMER_TIMERAWH;
  if (high != high_again) /* the low word has turned over just now, so a second read is safe */
    low = TIMER_TIMERAWL;
  return (uint64_t)high_again << 32 | low;
}

/* For times within the horizon */
static bool is_past(uint32_t t_us) { return (int32_t)(t_us - TIMER_TIMERAWL) <= 0; }

void port_set_event_handler(void (*handler)(void *context), void *context) {
  uint32_t primask = disable_interrupts();
  event.handler = handler;
  event.context = context;
  restore_interrupts(primask);
}

void rp2040_event(void) {
  if (event.handler)
    event.handler(event.context);
}

/* Call it with interrupts disabled, or in an interrupt. */
static void arm_alarm(void) {
  uint64_t now_us = port_now_us();
  alarm.is_far = alarm.due_us > now_us + ALARM_HORIZON_us;
  uint32_t target_us = alarm.is_far ? (uint32_t)now_us + ALARM_HORIZON_us : (uint32_t)alarm.due_us;
  TIMER_ALARM0 = target_us;
  if (alarm.due_us <= now_us || is_past(target_us)) { /* too late for the comparison, perhaps */
    TIMER_ARMED = TIMER_ALARM0_BIT;
    rp2040_irq_pend(RP2040_IRQ_TIMER_0);
  }
}

void port_alarm_at_us(uint64_t t_us) {
  uint32_t primask = disable_interrupts();
  alarm.due_us = t_us;
  alarm.set = true;
  arm_alarm();
  restore_interrupts(primask);
}

void timer0_irq_handler(void) {
  TIMER_INTR = TIMER_ALARM0_BIT;
  if (!alarm.set)
    return;
  if (alarm.is_far || !is_past((uint32_t)alarm.due_us)) {
    arm_alarm();
    return;
  }
  alarm.set = false;
  rp2040_event();
}

/* Leaving an exception sets the event register (ARMv6-M B1.5.18), so an interrupt between the
 * caller's check and WFE makes WFE return at once. */
void port_sleep(void) { __asm volatile("wfe" ::: "memory"); }

/* Read back, so that it is in force (pico-sdk, multicore_reset_core1). */
void port_worker_stop(void) {
  REG32_SET(PSM_FRCE_OFF) = PSM_PROC1;
  while (!(REG32(PSM_FRCE_OFF) & PSM_PROC1)) {
  }
}

void port_serial_number(char text[17]) {
  for (unsigned i = 0; i < sizeof serial_number; i++)
    text[i] = serial_number[i];
}

size_t port_stack_free_bytes(void) {
  extern const uint32_t __stack_limit[], __stack_top[];
  const uint32_t paint = UINT32_C(0x5aa5c33c); /* start.S */
  const uint32_t *word = __stack_limit;
  // cppcheck-suppress comparePointers ; by the linker script they are of one array
  while (word < __stack_top && *word == paint)
    word++;
  return (size_t)(word - __stack_limit) * sizeof *word;
}

/* RP2040 datasheet 2.8.3: half-word pointers to the function table and to its look-up function, and
 * the code of reset_to_usb_boot(activity pins, disabled interfaces). */
_Noreturn void port_reboot_to_loader(void) {
  typedef void *lookup_fn(const uint16_t *table, uint32_t code);
  typedef void reset_to_usb_boot_fn(uint32_t activity_pins, uint32_t disabled_interfaces);
  const uint32_t code = 'U' | 'B' << 8;

  port_worker_stop();
  disable_interrupts();
  mpu_disable(); /* the boot ROM's tables begin at address 0 */
  WATCHDOG_SCRATCH0 = 0;
  extern const uint16_t __rom_function_table, __rom_function_lookup;
  const uint16_t *table = (const uint16_t *)(uintptr_t)__rom_function_table;
  lookup_fn *lookup = (lookup_fn *)(uintptr_t)__rom_function_lookup;
  reset_to_usb_boot_fn *reset_to_usb_boot;
  *(void **)&reset_to_usb_boot = lookup(table, code);
  reset_to_usb_boot(0, 0);
  port_panic();
}

static void read_serial_number(void) {
  uint8_t id[FLASH_ID_BYTES] = {0};
  if (flash_start() != FT_OK || flash_read_id(id) != FT_OK)
    port_panic();
  for (unsigned i = 0; i < 2 * FLASH_ID_BYTES; i++) {
    unsigned digit = (unsigned)id[i / 2] >> (i % 2 ? 0 : 4) & 15u;
    serial_number[i] = (char)(digit < 10 ? '0' + digit : 'A' + digit - 10);
  }
}

void port_start(void) {
  extern const uint32_t __stack_guard[], __code_end[];
  crash_start();
  mpu_protect(__stack_guard, 12u, __code_end);
  rp2040_irq_set_priorities();
  if (resets_release(RESETS_TIMER) != FT_OK)
    port_panic();
  REG32_SET(TIMER_INTE) = TIMER_ALARM0_BIT;
  rp2040_irq_enable(RP2040_IRQ_TIMER_0);

  read_serial_number();
  crash_watch();
}
