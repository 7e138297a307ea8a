#include "usb/cdc.h"

#include "common/bytes.h"
#include "port/port.h"
#include "port/usb_controller.h"
#include "usb/device.h"
#include "usb/ring.h"

/* Class requests, PSTN 1.2 section 6.3, all to the control interface */
enum { TO_CONTROL_INTERFACE = 0x21, FROM_CONTROL_INTERFACE = 0xa1 };
enum class_request { SET_LINE_CODING = 0x20, GET_LINE_CODING = 0x21, SET_CONTROL_LINE_STATE = 0x22, SEND_BREAK = 0x23 };
enum { LINE_CODING_BYTES = 7, CONTROL_LINE_DTR = 1, LOADER_BAUD = 1200 };

enum { TRANSMIT_BYTES = 4096, RECEIVE_BYTES = 256 };
enum { CUT_MARK_BYTES = 4 }; /* one would do, but whole words cost less */
static _Alignas(4) uint8_t transmit_bytes[TRANSMIT_BYTES];
static uint8_t receive_bytes[RECEIVE_BYTES];
static struct ring transmit_ring = {.bytes = transmit_bytes, .size = TRANSMIT_BYTES};
static struct ring receive_ring = {.bytes = receive_bytes, .size = RECEIVE_BYTES};

/* Written in interrupt context, read in the main context */
static _Atomic uint32_t is_open;
static _Atomic uint32_t is_suspended;
static _Atomic uint32_t close_count;
static _Atomic uint32_t closed_at; /* receive_ring.put when the port was closed last */
static _Atomic uint32_t loader_requested;
static _Atomic uint32_t news;

enum packet_state { PACKET_NONE, PACKET_HELD, PACKET_OFFERED };

/* Interrupt context only */
static struct {
  uint8_t line_coding[LINE_CODING_BYTES];
  bool configured;
  bool dtr;

  /* The packet at the head of the stream: taken from the ring, not yet acknowledged */
  _Alignas(4) uint8_t packet[USB_MAX_PACKET_BYTES];
  size_t packet_bytes;
  enum packet_state packet_state;
  bool transfer_is_open; /* the last packet was full, so the host waits for more */
  bool was_cut;          /* the host may have the beginning of what it will not get the end of */
} port;

static const uint8_t default_line_coding[LINE_CODING_BYTES] = {0x00, 0xc2, 0x01, 0x00, 0, 0, 8};

static void add_news(void) {
  uint32_t count = atomic_load_explicit(&news, memory_order_relaxed);
  atomic_store_explicit(&news, count + 1, memory_order_release);
}

static __attribute__((noinline, cold)) size_t take_after_cut(void) {
  const uint32_t length = ring_take(&transmit_ring, port.packet + CUT_MARK_BYTES, USB_MAX_PACKET_BYTES - CUT_MARK_BYTES);
  if (length == 0)
    return 0;
  memset(port.packet, 0, CUT_MARK_BYTES);
  port.was_cut = false;
  return length + CUT_MARK_BYTES;
}

/* The host gets what there is at once: it reads in transfers of several packets, which a packet
 * below the maximum ends, so when the ring runs dry after a full one an empty one follows. */
static void transmit(void) {
  if (!atomic_load_explicit(&is_open, memory_order_relaxed) || port.packet_state == PACKET_OFFERED ||
      device_endpoint_is_halted(CDC_ENDPOINT_IN))
    return;
  if (port.packet_state == PACKET_NONE) {
    size_t length = port.was_cut ? take_after_cut() : ring_take(&transmit_ring, port.packet, USB_MAX_PACKET_BYTES);
    if (length == 0 && !port.transfer_is_open)
      return;
    port.packet_bytes = length;
    port.transfer_is_open = length == USB_MAX_PACKET_BYTES;
  }
  port.packet_state = PACKET_OFFERED;
  usb_controller_send(CDC_ENDPOINT_IN, port.packet, port.packet_bytes);
}

/* While the ring lacks room for a whole packet the endpoint accepts none and the host waits. */
static void accept_packet(void) {
  if (port.configured && !device_endpoint_is_halted(CDC_ENDPOINT_OUT) && ring_space(&receive_ring) >= USB_MAX_PACKET_BYTES)
    usb_controller_receive(CDC_ENDPOINT_OUT);
}

static void drop_stream(void) {
  port.packet_state = PACKET_NONE;
  port.transfer_is_open = false;
  port.was_cut = true;
  ring_clear(&transmit_ring);
}

static void update_open(void) {
  bool was_open = atomic_load_explicit(&is_open, memory_order_relaxed);
  bool now_open = port.configured && port.dtr && !cdc_is_suspended();
  if (was_open && !now_open) {
    atomic_store_explicit(&is_open, 0, memory_order_relaxed);
    atomic_store_explicit(&closed_at, atomic_load_explicit(&receive_ring.put, memory_order_relaxed), memory_order_relaxed);
    uint32_t count = atomic_load_explicit(&close_count, memory_order_relaxed);
    atomic_store_explicit(&close_count, count + 1, memory_order_release);
    add_news();
    usb_controller_withdraw(CDC_ENDPOINT_IN);
    drop_stream();
  } else if (!was_open && now_open) {
    drop_stream();
    atomic_store_explicit(&is_open, 1, memory_order_release);
  }
}

static void set_control_lines(uint16_t lines) {
  bool dtr = lines & CONTROL_LINE_DTR;
  if (dtr != port.dtr && bytes_get_u32(port.line_coding) == LOADER_BAUD) {
    atomic_store_explicit(&loader_requested, 1, memory_order_relaxed);
    add_news();
  }
  port.dtr = dtr;
  update_open();
}

enum control_answer cdc_on_request(const struct usb_setup *setup, uint8_t *data, size_t *length) {
  if (setup->index != CDC_INTERFACE_CONTROL)
    return CONTROL_STALL;
  switch (setup->type << 8 | setup->request) {
  case TO_CONTROL_INTERFACE << 8 | SET_LINE_CODING: return setup->length == LINE_CODING_BYTES ? CONTROL_RECEIVE : CONTROL_STALL;
  case FROM_CONTROL_INTERFACE << 8 | GET_LINE_CODING:
    memcpy(data, port.line_coding, LINE_CODING_BYTES);
    *length = LINE_CODING_BYTES;
    return CONTROL_SEND;
  case TO_CONTROL_INTERFACE << 8 | SET_CONTROL_LINE_STATE:
    if (setup->length != 0)
      return CONTROL_STALL;
    set_control_lines(setup->value);
    return CONTROL_DONE;
  case TO_CONTROL_INTERFACE << 8 | SEND_BREAK: return setup->length == 0 ? CONTROL_DONE : CONTROL_STALL;
  default: return CONTROL_STALL;
  }
}

void cdc_on_request_data(const struct usb_setup *setup, const uint8_t *data) {
  if (setup->request == SET_LINE_CODING)
    memcpy(port.line_coding, data, LINE_CODING_BYTES);
}

void cdc_on_configured(bool configured) {
  port.configured = false;
  port.dtr = false;
  update_open();
  memcpy(port.line_coding, default_line_coding, LINE_CODING_BYTES);
  port.configured = configured;
  accept_packet();
}

void cdc_on_interface_set(void) {
  drop_stream();
  accept_packet();
}

void cdc_before_halt_change(uint8_t endpoint) {
  if (endpoint == CDC_ENDPOINT_IN && port.packet_state == PACKET_OFFERED)
    port.packet_state = usb_controller_withdraw(endpoint) ? PACKET_HELD : PACKET_NONE;
}

void cdc_after_halt_change(void) {
  transmit();
  accept_packet();
}

void cdc_on_suspended(bool suspended) {
  if (suspended != cdc_is_suspended()) {
    atomic_store_explicit(&is_suspended, suspended, memory_order_relaxed);
    add_news();
  }
  update_open();
}

void cdc_on_sent(uint8_t endpoint) {
  if (endpoint == CDC_ENDPOINT_IN) {
    port.packet_state = PACKET_NONE;
    transmit();
  }
}

void cdc_on_received(uint8_t endpoint, const uint8_t *bytes, size_t length) {
  if (endpoint == CDC_ENDPOINT_OUT) {
    ring_put(&receive_ring, bytes, (uint32_t)length);
    add_news();
    accept_packet();
  }
}

void cdc_on_service(void) {
  port_report_alive(PORT_PART_USB);
  transmit();
  accept_packet();
}

void cdc_start(const struct cdc_identity *identity) {
  memcpy(port.line_coding, default_line_coding, LINE_CODING_BYTES);
  device_start(identity);
}

bool cdc_is_open(void) { return atomic_load_explicit(&is_open, memory_order_acquire); }

bool cdc_is_suspended(void) { return atomic_load_explicit(&is_suspended, memory_order_relaxed) != 0; }

uint32_t cdc_event_count(void) { return atomic_load_explicit(&news, memory_order_acquire); }

uint32_t cdc_close_count(void) { return atomic_load_explicit(&close_count, memory_order_acquire); }

enum ft_status cdc_write(const uint8_t *bytes, size_t length) {
  if (length > TRANSMIT_BYTES)
    return FT_ERR_ARGUMENT;
  if (!cdc_is_open())
    return FT_OK;
  if (length > ring_space(&transmit_ring))
    return FT_ERR_SPACE;
  ring_put(&transmit_ring, bytes, (uint32_t)length);
  usb_controller_request_service();
  return FT_OK;
}

size_t cdc_read(uint8_t *bytes, size_t capacity) {
  const uint32_t dropped = ring_drop(&receive_ring, atomic_load_explicit(&closed_at, memory_order_acquire));
  const uint32_t length = ring_take(&receive_ring, bytes, capacity < RECEIVE_BYTES ? (uint32_t)capacity : RECEIVE_BYTES);
  if (dropped || length)
    usb_controller_request_service();
  return length;
}

bool cdc_loader_requested(void) { return atomic_load_explicit(&loader_requested, memory_order_relaxed); }
