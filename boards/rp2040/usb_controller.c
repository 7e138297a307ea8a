/* The controller keeps no toggles and no state of its own worth speaking of: each packet's PID is in its buffer control word, and software
 * reads from BUFF_STATUS what has happened (RP2040 datasheet 4.1.2). Every endpoint is single-buffered.
 *
 * Errata: E2 (an abort blocks the controller for good) and E5 (a busy bus hides the end of a bus reset) are fixed in revision B2 of the
 * chip. On B0 and B1 aborts are left out, and against E5 the bus is made to look idle after a reset, if the board can spare GPIO15 for it:
 * else the device may not enumerate there behind a hub with traffic (pico-sdk, rp2040_usb_device_enumeration.c). E15 (some bus errors in an
 * IN transfer hang the device) is in all revisions: no bulk IN packet is offered in the last 200 us of a frame, where such errors come
 * from. It can still strike (TinyUSB pull request 1779, embassy issue 2880), and then nothing but a reset of the block helps, not even a
 * bus reset. So the block is reset, and the device attached again, when the bus is silent and not suspended, or when frames but no request
 * follow a reset of the bus. A hung controller that goes on seeing frames, under a host that resets nothing, is not noticed.
 *
 * The number of resets before the request shows nothing. An EHCI controller sends no frame after its own reset of a full-speed device; its
 * companion then resets the device again (Linux, ehci-hub.c check_reset_complete()). And the erratum strikes a controller that answers, so
 * one that has not yet heard a request since its block was reset waits for as long as the host takes. */
#include "rp2040/usb_controller.h"

#include "port/port.h"
#include "port/usb_controller.h"
#include "rp2040/gpio.h"
#include "rp2040/nvic.h"
#include "rp2040/resets.h"
#include "rp2040/timer_regs.h"
#include "rp2040/usb_regs.h"

#include <string.h>

#define ENDPOINT_NUMBERS 3
enum { PIN_DP = 15, FEIGNED_MAX_ms = 5 };

#define SYSINFO_CHIP_ID REG32(0x40000000u)
#define SYSINFO_CHIP_ID_REVISION(id) ((id) >> 28)
#define REVISION_B2 2u

/* Frame time, counted from its start, in which nothing is offered: erratum E15 */
#define FRAME_TAIL_BEGIN_us 800u
#define FRAME_TAIL_END_us 998u

/* A full packet and its handshake take 50 us on the bus. */
#define PACKET_us 60u
#define ABORT_LIMIT_us 200u

/* How often the bus is checked, and how long it may be silent: each millisecond a frame begins. */
#define WATCH_us 250000u
#define SILENCE_us 1000000u
/* From the first frame after a reset to the request. Linux takes 60 ms (hub.c hub_port_reset()),
 * and resets a device that is deaf several times before it gives up after about a second. */
#define UNASKED_us 500000u
/* Where no host is SILENCE_us rises by this factor. */
#define PATIENCE_MAX 8u
/* Ample for a hub to notice, which debounces for 100 ms (USB 2.0, TATTDB). */
#define DETACHED_us 100000u

#define CONTROL_BITS (USB_BIT(USB_ENDPOINT_IN) | USB_BIT(0))

/* What the controller's interrupt leaves to the service interrupt, masked until then. */
#define SERVED (USB_INT_BUS_RESET | USB_INT_SETUP_REQ | USB_INT_BUFF_STATUS | USB_INT_DEV_SUSPEND | USB_INT_DEV_RESUME)

/* One bit for each endpoint, as in BUFF_STATUS */
static uint32_t data1;    /* the next packet is DATA1 */
static uint32_t held;     /* it offers a packet, or accepts one */
static uint32_t deferred; /* held, but not before the next frame */
static uint32_t bulk;

/* The controller's own interrupt writes these two; all else belongs to the service interrupt. */
static volatile uint32_t frame_start_us;
static volatile bool frame_began;

static bool suspended;
static bool is_old; /* before revision B2 */

/* What alarm 1 is for */
static enum { WATCH, ATTACH, AWAIT_END_OF_RESET, FEIGN_IDLE } next;
static uint32_t feigned_ms;
static uint32_t alive_us; /* when last the bus was not silent, or was asleep */
static uint32_t patience = 1;
/* What is awaited of the host: a first request to a block just reset, nothing, a frame or a request after a reset of the bus. */
static enum { AWAIT_SETUP_AFTER_ATTACH, AWAIT_NOTHING, AWAIT_FRAME, AWAIT_SETUP } awaited;
static uint32_t asking_us; /* the first frame after the reset: AWAIT_SETUP */

/* The controller reads the control word in its own clock domain, so AVAILABLE is written once the
 * other fields are certain to have arrived there: datasheet 4.1.2.5.1. */
static void hand_over(uint8_t endpoint, uint32_t fields) {
  USB_BUFFER_CONTROL(endpoint) = fields;
  __asm volatile("nop\n nop\n nop\n nop\n nop\n nop\n"
                 "nop\n nop\n nop\n nop\n nop\n nop" ::
                     : "memory");
  USB_BUFFER_CONTROL(endpoint) = fields | USB_BUFFER_AVAILABLE;
}

static uint32_t pid(uint8_t endpoint) { return data1 & USB_BIT(endpoint) ? USB_BUFFER_DATA1 : 0; }

static bool in_frame_tail(void) {
  uint32_t frame_us = TIMER_TIMERAWL - frame_start_us;
  return frame_us >= FRAME_TAIL_BEGIN_us && frame_us < FRAME_TAIL_END_us;
}

static void start_frame(void) {
  frame_began = false;
  alive_us = frame_start_us;
  if (awaited == AWAIT_FRAME) {
    awaited = AWAIT_SETUP;
    asking_us = frame_start_us;
  }
  for (uint8_t number = 1; deferred && number < ENDPOINT_NUMBERS; number++) {
    uint8_t endpoint = USB_ENDPOINT_IN | number;
    if (deferred & USB_BIT(endpoint))
      hand_over(endpoint, USB_BUFFER_CONTROL(endpoint));
  }
  deferred = 0;
}

/* Stops the controller from touching the buffer. Where an abort cannot be used the buffer is no
 * longer available, and a packet that was under way then gets the time to end. */
static void begin_abort(uint8_t endpoint) {
  uint32_t bit = USB_BIT(endpoint);
  if (is_old)
    USB_BUFFER_CONTROL(endpoint) &= ~USB_BUFFER_AVAILABLE;
  else
    REG32_SET(USB_EP_ABORT) = bit;
  uint32_t limit_us = is_old ? PACKET_us : ABORT_LIMIT_us;
  uint32_t start_us = TIMER_TIMERAWL;
  while ((is_old || (REG32(USB_EP_ABORT_DONE) & bit) == 0) && TIMER_TIMERAWL - start_us < limit_us) {
  }
}

/* Not of endpoint 0 while a SETUP waits: see silence_control(). */
static void end_abort(uint32_t bits) {
  if (is_old)
    return;
  if (REG32(USB_SIE_STATUS) & USB_SIE_STATUS_SETUP_REC)
    bits &= ~CONTROL_BITS;
  REG32_CLEAR(USB_EP_ABORT_DONE) = bits;
  REG32_CLEAR(USB_EP_ABORT) = bits;
}

/* What a control transfer that the host has abandoned left must not answer for the one that
 * follows: until on_setup() has taken it back, endpoint 0 answers with NAK. TinyUSB too aborts
 * endpoint 0 at a SETUP (dcd_rp2040.c reset_ep0()), and waits for the end of it there and then. */
static void silence_control(void) {
  if (is_old) {
    USB_BUFFER_CONTROL(USB_ENDPOINT_IN) &= ~USB_BUFFER_AVAILABLE;
    USB_BUFFER_CONTROL(0) &= ~USB_BUFFER_AVAILABLE;
  } else {
    REG32_SET(USB_EP_ABORT) = CONTROL_BITS;
  }
}

bool usb_controller_withdraw(uint8_t endpoint) {
  uint32_t bit = USB_BIT(endpoint);
  if ((held & bit) == 0)
    return false;
  held &= ~bit;
  if (deferred & bit) {
    deferred &= ~bit;
    return true;
  }
  begin_abort(endpoint);
  bool done = REG32(USB_BUFF_STATUS) & bit; /* just before, and not yet seen here */
  REG32_CLEAR(USB_BUFF_STATUS) = bit;
  USB_BUFFER_CONTROL(endpoint) = 0;
  end_abort(bit);
  if (done)
    data1 ^= bit;
  return !done;
}

void usb_controller_set_address(uint8_t address) { USB_ADDR_ENDP = address; }

void usb_controller_open(uint8_t endpoint, enum usb_endpoint_type type) {
  usb_controller_withdraw(endpoint);
  data1 &= ~USB_BIT(endpoint);
  if (type == USB_ENDPOINT_BULK)
    bulk |= USB_BIT(endpoint);
  USB_BUFFER_CONTROL(endpoint) = 0;
  USB_ENDPOINT_CONTROL(endpoint) =
      USB_ENDPOINT_CONTROL_ENABLE | USB_ENDPOINT_CONTROL_INTERRUPT | USB_ENDPOINT_CONTROL_TYPE(type) | USB_BUFFER_OFFSET(endpoint);
}

static void close(uint8_t endpoint) {
  usb_controller_withdraw(endpoint);
  USB_ENDPOINT_CONTROL(endpoint) = 0;
  USB_BUFFER_CONTROL(endpoint) = 0;
}

void usb_controller_close_all(void) {
  for (uint8_t number = 1; number < ENDPOINT_NUMBERS; number++) {
    close(number);
    close(USB_ENDPOINT_IN | number);
  }
}

void usb_controller_send(uint8_t endpoint, const uint8_t *bytes, size_t length) {
  volatile uint32_t *buffer = (volatile uint32_t *)(uintptr_t)(USB_DPRAM_BASE + USB_BUFFER_OFFSET(endpoint));
  for (size_t i = 0; i < length; i += 4) {
    uint32_t word;
    memcpy(&word, __builtin_assume_aligned(bytes + i, 4), sizeof word);
    *buffer++ = word;
  }
  uint32_t bit = USB_BIT(endpoint);
  uint32_t fields = USB_BUFFER_FULL | pid(endpoint) | (uint32_t)length;
  held |= bit;
  if ((bulk & bit) && in_frame_tail()) {
    USB_BUFFER_CONTROL(endpoint) = fields;
    deferred |= bit;
  } else {
    hand_over(endpoint, fields);
  }
}

void usb_controller_receive(uint8_t endpoint) {
  if (held & USB_BIT(endpoint))
    return;
  held |= USB_BIT(endpoint);
  hand_over(endpoint, pid(endpoint) | USB_MAX_PACKET_BYTES);
}

void usb_controller_stall(uint8_t endpoint) {
  if (endpoint == 0) {
    usb_controller_withdraw(USB_ENDPOINT_IN);
    usb_controller_withdraw(0);
    USB_EP_STALL_ARM = USB_EP_STALL_ARM_BOTH;
    USB_BUFFER_CONTROL(USB_ENDPOINT_IN) = USB_BUFFER_STALL;
    USB_BUFFER_CONTROL(0) = USB_BUFFER_STALL;
  } else {
    usb_controller_withdraw(endpoint);
    USB_BUFFER_CONTROL(endpoint) = USB_BUFFER_STALL;
  }
}

void usb_controller_unstall(uint8_t endpoint) {
  usb_controller_withdraw(endpoint);
  USB_BUFFER_CONTROL(endpoint) = 0;
  data1 &= ~USB_BIT(endpoint);
}

static void look_in(uint32_t us) { TIMER_ALARM1 = TIMER_TIMERAWL + us; }

/* Erratum E5: after a reset of the bus the controller waits for 800 us of idle bus, which it may
 * never see. So it is shown the state J for a millisecond: D+ high, through GPIO15. */
static void feign_idle(void) {
  gpio_set_function_reading_high(PIN_DP, GPIO_FUNCTION_USB);
  REG32_SET(USB_PHY_DIRECT) = USB_PHY_DIRECT_DP_PULLUP_EN;
  REG32_SET(USB_PHY_DIRECT_OVERRIDE) = USB_PHY_DIRECT_OVERRIDE_DP_PULLUP_EN;
  USB_MUXING = USB_MUXING_TO_PADS | USB_MUXING_SOFTCON;
}

static void show_bus(void) {
  USB_MUXING = USB_MUXING_TO_PHY | USB_MUXING_SOFTCON;
  REG32_CLEAR(USB_PHY_DIRECT_OVERRIDE) = USB_PHY_DIRECT_OVERRIDE_DP_PULLUP_EN;
  gpio_set_function(PIN_DP, GPIO_FUNCTION_NULL);
}

static void watch(void) {
  next = WATCH;
  look_in(WATCH_us);
}

static void attach(void) {
  if (resets_release(RESETS_USBCTRL | RESETS_SYSINFO) != FT_OK)
    port_panic();
  is_old = SYSINFO_CHIP_ID_REVISION(SYSINFO_CHIP_ID) < REVISION_B2;
  for (uint32_t offset = 0; offset < USB_DPRAM_BYTES; offset += 4)
    REG32(USB_DPRAM_BASE + offset) = 0;

  USB_MUXING = USB_MUXING_TO_PHY | USB_MUXING_SOFTCON;
  USB_PWR = USB_PWR_VBUS_DETECT | USB_PWR_VBUS_DETECT_OVERRIDE_EN; /* powered by the bus */
  USB_MAIN_CTRL = USB_MAIN_CTRL_CONTROLLER_EN;
  REG32(USB_SIE_CTRL) = USB_SIE_CTRL_EP0_INT_1BUF;
  REG32(USB_INTE) = SERVED | USB_INT_DEV_SOF;
  rp2040_irq_enable(RP2040_IRQ_USBCTRL);
  REG32_SET(USB_SIE_CTRL) = USB_SIE_CTRL_PULLUP_EN;
  alive_us = TIMER_TIMERAWL;
  watch();
}

static void start_over(void) {
  patience = patience < PATIENCE_MAX ? 2 * patience : PATIENCE_MAX;
  rp2040_irq_disable(RP2040_IRQ_USBCTRL);
  resets_assert(RESETS_USBCTRL);
  held = 0;
  deferred = 0;
  data1 = 0;
  suspended = false;
  frame_began = false;
  awaited = AWAIT_SETUP_AFTER_ATTACH;
  next = ATTACH;
  usb_device_on_bus_reset();
  look_in(DETACHED_us);
}

/* It sleeps, or the host holds a reset for longer than it needs: low at two checks in a row. */
static bool bus_may_be_silent(void) {
  static bool was_low;
  uint32_t status = REG32(USB_SIE_STATUS);
  bool is_low = (status & USB_SIE_STATUS_LINES) == 0;
  bool stays_low = is_low && was_low;
  was_low = is_low;
  return (status & USB_SIE_STATUS_SUSPENDED) || stays_low;
}

static bool is_deaf(void) { return awaited == AWAIT_SETUP && TIMER_TIMERAWL - asking_us >= UNASKED_us; }

void timer1_irq_handler(void) {
  TIMER_INTR = TIMER_ALARM1_BIT;
  switch (next) {
  case WATCH:
    if (bus_may_be_silent())
      alive_us = TIMER_TIMERAWL;
    if (is_deaf() || TIMER_TIMERAWL - alive_us >= patience * SILENCE_us)
      start_over();
    else
      watch();
    break;
  case ATTACH: attach(); break;
  case AWAIT_END_OF_RESET:
    if (REG32(USB_SIE_STATUS) & USB_SIE_STATUS_LINES) {
      feign_idle();
      feigned_ms = 0;
      next = FEIGN_IDLE;
    }
    look_in(1000);
    break;
  case FEIGN_IDLE:
    feigned_ms++;
    if (REG32(USB_SIE_STATUS) & USB_SIE_STATUS_CONNECTED || feigned_ms == FEIGNED_MAX_ms) {
      show_bus();
      watch();
    } else {
      look_in(1000);
    }
    break;
  }
  rp2040_irq_pend(RP2040_IRQ_USB_SERVICE);
}

static void on_bus_reset(void) {
  REG32_CLEAR(USB_SIE_STATUS) = USB_SIE_STATUS_BUS_RESET;
  USB_ADDR_ENDP = 0;
  if (is_old) { /* nothing is under way that had to be waited for */
    REG32_CLEAR(USB_BUFF_STATUS) = held;
    held = 0;
    deferred = 0;
  }
  usb_controller_close_all();
  usb_controller_withdraw(USB_ENDPOINT_IN);
  usb_controller_withdraw(0);
  suspended = false;
  if (awaited == AWAIT_NOTHING)
    awaited = AWAIT_FRAME;
  usb_device_on_bus_reset();
  if (is_old && usb_controller_has_gpio15) {
    next = AWAIT_END_OF_RESET;
    look_in(1000);
  }
}

static void on_setup(void) {
  REG32_CLEAR(USB_SIE_STATUS) = USB_SIE_STATUS_SETUP_REC;
  awaited = AWAIT_NOTHING;
  patience = 1;
  uint8_t packet[USB_SETUP_BYTES];
  for (unsigned i = 0; i < sizeof packet; i++)
    packet[i] = *(volatile uint8_t *)(uintptr_t)(USB_SETUP_PACKET + i);

  usb_controller_withdraw(USB_ENDPOINT_IN);
  usb_controller_withdraw(0);
  USB_BUFFER_CONTROL(USB_ENDPOINT_IN) = 0; /* a stall ends here */
  USB_BUFFER_CONTROL(0) = 0;
  end_abort(CONTROL_BITS);
  data1 |= USB_BIT(USB_ENDPOINT_IN) | USB_BIT(0);
  usb_device_on_setup(packet);
}

static void on_buffer(uint8_t endpoint) {
  uint32_t bit = USB_BIT(endpoint);
  REG32_CLEAR(USB_BUFF_STATUS) = bit;
  if ((held & bit) == 0)
    return;
  held &= ~bit;
  data1 ^= bit;
  if (endpoint & USB_ENDPOINT_IN) {
    usb_device_on_sent(endpoint);
    return;
  }
  uint8_t packet[USB_MAX_PACKET_BYTES];
  size_t length = USB_BUFFER_CONTROL(endpoint) & USB_BUFFER_LENGTH;
  const volatile uint8_t *buffer = (const volatile uint8_t *)(uintptr_t)(USB_DPRAM_BASE + USB_BUFFER_OFFSET(endpoint));
  for (size_t i = 0; i < length && i < sizeof packet; i++)
    packet[i] = buffer[i];
  usb_device_on_received(endpoint, packet, length);
}

static void set_suspended(bool now) {
  if (suspended == now)
    return;
  suspended = now;
  if (now)
    usb_device_on_suspend();
  else
    usb_device_on_resume();
}

/* What was finished before a SETUP is handled before it, so that an address set counts. */
static void serve(void) {
  uint32_t interrupts = USB_INTR & SERVED;
  if (frame_began) {
    start_frame();
    interrupts |= USB_INT_DEV_SOF;
  }
  if (interrupts & USB_INT_BUS_RESET)
    on_bus_reset();
  if (interrupts & USB_INT_DEV_SUSPEND) {
    REG32_CLEAR(USB_SIE_STATUS) = USB_SIE_STATUS_SUSPENDED;
    set_suspended(REG32(USB_SIE_STATUS) & USB_SIE_STATUS_SUSPENDED);
  }
  if (interrupts & USB_INT_DEV_RESUME)
    REG32_CLEAR(USB_SIE_STATUS) = USB_SIE_STATUS_RESUME;
  if (interrupts & (USB_INT_DEV_RESUME | USB_INT_DEV_SOF | USB_INT_SETUP_REQ | USB_INT_BUFF_STATUS))
    set_suspended(false);
  if (interrupts & USB_INT_BUFF_STATUS) {
    uint32_t finished = REG32(USB_BUFF_STATUS);
    for (uint8_t number = 0; number < ENDPOINT_NUMBERS; number++) {
      if (finished & USB_BIT(USB_ENDPOINT_IN | number))
        on_buffer(USB_ENDPOINT_IN | number);
      if (finished & USB_BIT(number))
        on_buffer(number);
    }
  }
  if (interrupts & USB_INT_SETUP_REQ)
    on_setup();
  REG32_SET(USB_INTE) = SERVED;
}

void usb_service_irq_handler(void) {
  if (next != ATTACH)
    serve();
  usb_device_on_service();
}

/* What cannot wait, and nothing else: it interrupts the handling of the rest too. A token that follows a SETUP comes 3 us later. */
void usbctrl_irq_handler(void) {
  uint32_t interrupts = USB_INTS;
  if (interrupts & USB_INT_SETUP_REQ)
    silence_control();
  if (interrupts & USB_INT_DEV_SOF) {
    frame_start_us = TIMER_TIMERAWL;
    (void)USB_SOF_RD;
    frame_began = true;
  }
  REG32_CLEAR(USB_INTE) = interrupts & SERVED;
  rp2040_irq_pend(RP2040_IRQ_USB_SERVICE);
}

void usb_controller_request_service(void) { rp2040_irq_pend(RP2040_IRQ_USB_SERVICE); }

void usb_controller_start(void) {
  resets_assert(RESETS_USBCTRL);
  REG32_SET(TIMER_INTE) = TIMER_ALARM1_BIT;
  rp2040_irq_enable(RP2040_IRQ_TIMER_1);
  rp2040_irq_enable(RP2040_IRQ_USB_SERVICE);
  attach();
}
