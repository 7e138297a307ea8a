#include "fake_controller.h"

#include "port/port.h"
#include "port/usb_controller.h"
#include "unity.h"

#include <string.h>

enum { NUMBERS = 3 };

struct endpoint {
  bool open;
  bool stalled;
  bool held;
  bool data1;
  bool host_data1;
  uint8_t packet[USB_MAX_PACKET_BYTES];
  size_t length;
};

static struct {
  struct endpoint endpoints[NUMBERS][2];
  uint8_t address;
  uint8_t host_address;
  bool attached;
  bool in_interrupt;
  bool interrupts_held;
  bool service_requested;
  bool take_at_next_withdrawal;
  bool host_follows;
  unsigned signs_of_life;
} fake;

static struct endpoint *find(uint8_t endpoint) {
  TEST_ASSERT_LESS_THAN(NUMBERS, endpoint & 15);
  return &fake.endpoints[endpoint & 15][endpoint >> 7];
}

#define IN_INTERRUPT(call)                                                                                                                 \
  do {                                                                                                                                     \
    TEST_ASSERT_FALSE(fake.in_interrupt);                                                                                                  \
    fake.in_interrupt = true;                                                                                                              \
    call;                                                                                                                                  \
    fake.in_interrupt = false;                                                                                                             \
  } while (0)

static void assert_device_context(void) { TEST_ASSERT_TRUE_MESSAGE(fake.in_interrupt, "called outside the interrupt context"); }

/* usb_controller.h ------------------------------------------------------------------------------ */

void usb_controller_start(void) { fake.attached = true; }

void usb_controller_request_service(void) {
  TEST_ASSERT_FALSE(fake.in_interrupt);
  fake.service_requested = true;
  if (!fake.interrupts_held)
    fake_run_interrupts();
}

void port_report_alive(enum port_part part) {
  TEST_ASSERT_EQUAL(PORT_PART_USB, part);
  TEST_ASSERT_TRUE(fake.in_interrupt);
  fake.signs_of_life++;
}

unsigned fake_signs_of_life(void) { return fake.signs_of_life; }

void fake_service(void) { IN_INTERRUPT(usb_device_on_service()); }

void usb_controller_set_address(uint8_t address) {
  assert_device_context();
  fake.address = address;
}

void usb_controller_open(uint8_t endpoint, enum usb_endpoint_type type) {
  assert_device_context();
  TEST_ASSERT_EQUAL(endpoint == 0x81 ? USB_ENDPOINT_INTERRUPT : USB_ENDPOINT_BULK, type);
  struct endpoint *e = find(endpoint);
  bool host_data1 = e->host_data1;
  *e = (struct endpoint){.open = true, .host_data1 = host_data1};
}

void usb_controller_close_all(void) {
  assert_device_context();
  for (int number = 1; number < NUMBERS; number++) {
    fake.endpoints[number][0].open = fake.endpoints[number][0].held = false;
    fake.endpoints[number][1].open = fake.endpoints[number][1].held = false;
  }
}

void usb_controller_send(uint8_t endpoint, const uint8_t *bytes, size_t length) {
  assert_device_context();
  TEST_ASSERT_TRUE(endpoint & USB_ENDPOINT_IN);
  TEST_ASSERT_LESS_OR_EQUAL(USB_MAX_PACKET_BYTES, length);
  struct endpoint *e = find(endpoint);
  TEST_ASSERT_TRUE_MESSAGE(e->open, "send on a closed endpoint");
  TEST_ASSERT_FALSE_MESSAGE(e->held, "send on an endpoint that holds a packet");
  TEST_ASSERT_FALSE_MESSAGE(e->stalled, "send on a stalled endpoint");
  e->held = true;
  e->length = length;
  if (length)
    memcpy(e->packet, bytes, length);
}

void usb_controller_receive(uint8_t endpoint) {
  assert_device_context();
  TEST_ASSERT_FALSE(endpoint & USB_ENDPOINT_IN);
  struct endpoint *e = find(endpoint);
  TEST_ASSERT_TRUE_MESSAGE(e->open, "receive on a closed endpoint");
  TEST_ASSERT_FALSE_MESSAGE(e->stalled, "receive on a stalled endpoint");
  e->held = true;
}

bool usb_controller_withdraw(uint8_t endpoint) {
  assert_device_context();
  struct endpoint *e = find(endpoint);
  bool held = e->held;
  e->held = false;
  if (held && fake.take_at_next_withdrawal) {
    fake.take_at_next_withdrawal = false;
    e->data1 = !e->data1;
    e->host_data1 = !e->host_data1;
    return false;
  }
  return held;
}

void usb_controller_stall(uint8_t endpoint) {
  assert_device_context();
  find(endpoint)->held = false;
  find(endpoint)->stalled = true;
  if (endpoint == 0) {
    find(USB_ENDPOINT_IN)->held = false;
    find(USB_ENDPOINT_IN)->stalled = true;
  }
}

void usb_controller_unstall(uint8_t endpoint) {
  assert_device_context();
  struct endpoint *e = find(endpoint);
  e->stalled = false;
  e->held = false;
  e->data1 = false;
}

/* Test side -------------------------------------------------------------------------------------- */

void fake_power_on(void) {
  memset(&fake, 0, sizeof fake);
  find(0)->open = true;
  find(USB_ENDPOINT_IN)->open = true;
}

bool fake_is_attached(void) { return fake.attached; }

void fake_hold_interrupts(void) { fake.interrupts_held = true; }

void fake_run_interrupts(void) {
  fake.interrupts_held = false;
  if (fake.service_requested) {
    fake.service_requested = false;
    IN_INTERRUPT(usb_device_on_service());
  }
}

void fake_take_at_next_withdrawal(void) { fake.take_at_next_withdrawal = true; }

bool fake_accepts(uint8_t endpoint) { return find(endpoint)->held; }

void host_bus_reset(void) {
  fake.address = 0;
  fake.host_address = 0;
  IN_INTERRUPT(usb_controller_close_all());
  find(0)->held = false;
  find(USB_ENDPOINT_IN)->held = false;
  IN_INTERRUPT(usb_device_on_bus_reset());
}

void host_suspend(void) { IN_INTERRUPT(usb_device_on_suspend()); }

void host_resume(void) { IN_INTERRUPT(usb_device_on_resume()); }

/* What it answers instead of a packet, or 0: then the buffer is the device's again. */
static int exchange(struct endpoint *e) {
  if (fake.host_address != fake.address || !e->open)
    return HOST_NO_ANSWER;
  if (e->stalled)
    return HOST_STALL;
  if (!e->held)
    return HOST_NAK;
  e->host_data1 = fake.host_follows ? e->data1 : e->host_data1;
  TEST_ASSERT_EQUAL_MESSAGE(e->host_data1, e->data1, "wrong data PID");
  e->held = false;
  e->data1 = !e->data1;
  e->host_data1 = !e->host_data1;
  return 0;
}

int host_in(uint8_t endpoint, uint8_t packet[64]) {
  struct endpoint *e = find(endpoint);
  int refused = exchange(e);
  if (refused)
    return refused;
  size_t length = e->length;
  if (length)
    memcpy(packet, e->packet, length);
  IN_INTERRUPT(usb_device_on_sent(endpoint));
  return (int)length;
}

int host_out(uint8_t endpoint, const void *bytes, size_t length) {
  int refused = exchange(find(endpoint));
  if (refused)
    return refused;
  IN_INTERRUPT(usb_device_on_received(endpoint, bytes, length));
  return 0;
}

void host_setup(uint8_t type, uint8_t request, uint16_t value, uint16_t index, uint16_t length) {
  const uint8_t packet[USB_SETUP_BYTES] = {
      type, request, (uint8_t)value, (uint8_t)(value >> 8), (uint8_t)index, (uint8_t)(index >> 8), (uint8_t)length, (uint8_t)(length >> 8)};
  for (int in = 0; in < 2; in++) {
    struct endpoint *e = &fake.endpoints[0][in];
    e->stalled = e->held = false;
    e->data1 = e->host_data1 = true;
  }
  IN_INTERRUPT(usb_device_on_setup(packet));
}

int host_control_in(uint8_t type, uint8_t request, uint16_t value, uint16_t index, uint16_t length, uint8_t *answer) {
  host_setup(type, request, value, index, length);
  int total = 0;
  for (;;) {
    uint8_t packet[64];
    int n = host_in(USB_ENDPOINT_IN, packet);
    if (n < 0)
      return n;
    TEST_ASSERT_LESS_OR_EQUAL_MESSAGE(length, total + n, "more than wLength");
    memcpy(answer + total, packet, (size_t)n);
    total += n;
    if (n < 64 || total == length)
      break;
  }
  find(0)->host_data1 = true;
  int status = host_out(0, NULL, 0);
  return status < 0 ? status : total;
}

int host_control_out(uint8_t type, uint8_t request, uint16_t value, uint16_t index, const void *bytes, uint16_t length) {
  host_setup(type, request, value, index, length);
  for (uint16_t done = 0; done < length;) {
    size_t n = length - done < 64 ? (size_t)(length - done) : 64;
    int status = host_out(0, (const uint8_t *)bytes + done, n);
    if (status < 0)
      return status;
    done = (uint16_t)(done + n);
  }
  uint8_t packet[64];
  find(USB_ENDPOINT_IN)->host_data1 = true;
  int n = host_in(USB_ENDPOINT_IN, packet);
  TEST_ASSERT_LESS_OR_EQUAL_MESSAGE(0, n, "status stage with data");
  return n;
}

void host_address(uint8_t address) { fake.host_address = address; }

void host_reset_toggles(void) {
  for (int number = 1; number < NUMBERS; number++)
    fake.endpoints[number][0].host_data1 = fake.endpoints[number][1].host_data1 = false;
}

void host_reset_toggle(uint8_t endpoint) { find(endpoint)->host_data1 = false; }

void host_follow_toggles(void) { fake.host_follows = true; }
