/* The USB device before a host that keeps no rule: any sequence of transactions on its control and bulk endpoints, resets and suspensions,
 * while its main loop reads and writes. A breach of the controller's contract stops it (fake_controller.h). */
#include "fuzz.h"
#include "unit/usb/enumerate.h"
#include "unit/usb/fake_controller.h"
#include "usb/cdc.h"

#include <unity.h>

enum { BULK_IN = 0x82, BULK_OUT = 0x02, CONTROL_IN = 0x80, TRANSMIT_BYTES = 4096, RECEIVE_BYTES = 256 };

/* What has been written and not yet been delivered, either way. */
struct queue {
  uint8_t bytes[2 * TRANSMIT_BYTES];
  size_t length;
};
static struct queue to_host, to_device;
/* What the host gets next begins with the mark of a cut: cdc.h. */
static bool was_cut = true;
enum { MARK_BYTES = 4 };
/* Since the program began: where the device's rings stand. */
static uint32_t ever_written, ever_received;
static uint32_t close_count;
static uint8_t next_byte;

static void put(struct queue *queue, const uint8_t *bytes, size_t length) {
  FUZZ_CHECK(queue->length + length <= sizeof queue->bytes);
  if (length > 0) {
    memcpy(queue->bytes + queue->length, bytes, length);
  }
  queue->length += length;
}

/* In order, and nothing else. */
static void check_taken(struct queue *queue, const uint8_t *bytes, size_t length) {
  FUZZ_CHECK(length <= queue->length);
  FUZZ_CHECK(length == 0 || memcmp(queue->bytes, bytes, length) == 0);
  queue->length -= length;
  memmove(queue->bytes, queue->bytes + length, queue->length);
}

static void cut(void) {
  to_host.length = 0;
  was_cut = true;
}

/* What was on its way to the host ends with the port. */
static void follow_closings(void) {
  uint32_t count = cdc_close_count();
  if (count != close_count) {
    cut();
  }
  close_count = count;
}

static enum ft_status device_writes(size_t length) {
  uint8_t bytes[TRANSMIT_BYTES + 1];
  for (size_t i = 0; i < length; i++) {
    bytes[i] = next_byte++;
  }
  bool open = cdc_is_open();
  enum ft_status status = cdc_write(bytes, length);
  FUZZ_CHECK(status == FT_OK || (status == FT_ERR_SPACE && open) || (status == FT_ERR_ARGUMENT && length > TRANSMIT_BYTES));
  if (status == FT_OK && open) {
    put(&to_host, bytes, length);
    ever_written += (uint32_t)length;
  }
  return status;
}

static size_t device_reads(size_t capacity) {
  uint8_t bytes[RECEIVE_BYTES];
  size_t length = cdc_read(bytes, capacity < sizeof bytes ? capacity : sizeof bytes);
  FUZZ_CHECK(length <= capacity);
  check_taken(&to_device, bytes, length);
  return length;
}

/* Bytes, or HOST_. */
static int host_reads(uint8_t endpoint) {
  uint8_t packet[64];
  int length = host_in(endpoint, packet);
  if (endpoint == BULK_IN && length > 0) {
    const size_t mark = was_cut ? MARK_BYTES : 0;
    FUZZ_CHECK((size_t)length > mark && memcmp(packet, "\0\0\0\0", mark) == 0);
    check_taken(&to_host, packet + mark, (size_t)length - mark);
    was_cut = false;
  }
  return length;
}

static int host_writes(uint8_t endpoint, size_t length) {
  uint8_t packet[64];
  for (size_t i = 0; i < length; i++) {
    packet[i] = next_byte++;
  }
  int refused = host_out(endpoint, packet, length);
  if (endpoint == BULK_OUT && refused == 0) {
    put(&to_device, packet, length);
    ever_received += (uint32_t)length;
    FUZZ_CHECK(to_device.length <= RECEIVE_BYTES);
  }
  return refused;
}

static void bring_up(void) {
  enumerate();
  host_follow_toggles();
  set_dtr(1);
  follow_closings();
  FUZZ_CHECK(cdc_is_open());
}

/* The rings go on where the run before left them. So that each run is as the first: to a place that never changes. */
static void begin(void) {
  plug_in();
  bring_up();
  device_writes((0u - ever_written) % TRANSMIT_BYTES);
  while (ever_received % RECEIVE_BYTES != 0) {
    size_t missing = (0u - ever_received) % RECEIVE_BYTES;
    FUZZ_CHECK(host_writes(BULK_OUT, missing < 64 ? missing : 64) == 0);
    device_reads(RECEIVE_BYTES);
  }
  next_byte = 0;
  host_bus_reset();
  follow_closings();
  host_address(0);
}

/* Whatever came before, both ways work after a reset. */
static void check_is_alive(void) {
  fake_run_interrupts();
  bring_up();
  while (device_reads(RECEIVE_BYTES) > 0) {
  }
  FUZZ_CHECK(device_writes(100) == FT_OK);
  FUZZ_CHECK(host_reads(BULK_IN) == 64 && host_reads(BULK_IN) == 36 + MARK_BYTES && host_reads(BULK_IN) == HOST_NAK);
  for (int i = 0; i < 5; i++) {
    FUZZ_CHECK(host_writes(BULK_OUT, 64) == (i < 4 ? 0 : HOST_NAK));
  }
  while (device_reads(100) > 0) {
  }
  FUZZ_CHECK(to_host.length == 0 && to_device.length == 0);
  host_bus_reset();
  follow_closings();
  FUZZ_CHECK(!cdc_is_open());
}

struct setup {
  uint8_t type, request;
  uint16_t value, index, length;
};

/* One that the device knows, or any. */
static struct setup some_setup(struct fuzz_input *input) {
  static const struct setup known[] = {
      {0x80, 6, 0x0100, 0, 64}, {0x80, 6, 0x0200, 0, 255}, {0x80, 6, 0x0302, 0x0409, 255},
      {0x00, 5, 7, 0, 0},       {0x00, 9, 1, 0, 0},        {0x00, 9, 0, 0, 0},
      {0x80, 8, 0, 0, 1},       {0x80, 0, 0, 0, 2},        {0x02, 3, 0, 0x82, 0},
      {0x02, 1, 0, 0x82, 0},    {0x02, 3, 0, 0x02, 0},     {0x02, 1, 0, 0x02, 0},
      {0x02, 3, 0, 0x81, 0},    {0x01, 11, 0, 1, 0},       {0x81, 10, 0, 1, 1},
      {0x21, 0x20, 0, 0, 7},    {0xa1, 0x21, 0, 0, 7},     {0x21, 0x22, 1, 0, 0},
      {0x21, 0x22, 0, 0, 0},    {0x21, 0x23, 0, 0, 0},
  };
  enum { KNOWN = sizeof known / sizeof known[0] };
  uint8_t which = fuzz_u8(input);
  struct setup setup = known[which % KNOWN];
  if (which >= 200) {
    setup = (struct setup){fuzz_u8(input), fuzz_u8(input), fuzz_u16(input), fuzz_u16(input), fuzz_u16(input)};
  } else if (which >= 120) {
    setup.length = fuzz_u8(input);
  }
  return setup;
}

/* SET_INTERFACE of the data interface, obeyed, begins again what the host gets. */
static void begin_transfer(const struct setup *setup) {
  host_setup(setup->type, setup->request, setup->value, setup->index, setup->length);
  bool obeyed = fake_accepts(CONTROL_IN);
  if (obeyed && setup->type == 0x01 && setup->request == 11 && setup->index == 1) {
    cut();
  }
}

static void transfer(struct fuzz_input *input, bool whole) {
  static uint8_t data[65536];
  const struct setup setup = some_setup(input);
  int result = 0;
  if (!whole || (setup.length == 0 && !(setup.type & 0x80))) {
    begin_transfer(&setup);
    result = whole ? host_reads(CONTROL_IN) : 0;
  } else if (setup.type & 0x80) {
    result = host_control_in(setup.type, setup.request, setup.value, setup.index, setup.length, data);
  } else {
    size_t given = setup.length;
    const uint8_t *bytes = fuzz_bytes(input, &given);
    memset(data, 0, setup.length);
    memcpy(data, bytes, given);
    result = host_control_out(setup.type, setup.request, setup.value, setup.index, data, setup.length);
  }
  FUZZ_CHECK(result <= setup.length);
  if (whole && result == 0 && setup.type == 0x00 && setup.request == 5) {
    host_address((uint8_t)setup.value);
  }
}

static uint8_t some_endpoint(struct fuzz_input *input) {
  static const uint8_t endpoints[] = {BULK_IN, BULK_OUT, BULK_IN, BULK_OUT, 0x00, CONTROL_IN, 0x81, 0x01};
  return endpoints[fuzz_u8(input) % sizeof endpoints];
}

static void step(struct fuzz_input *input) {
  switch (fuzz_u8(input) % 14) {
  case 0: transfer(input, false); break;
  case 1:
  case 2: transfer(input, true); break;
  case 3:
  case 4: host_reads(some_endpoint(input) | 0x80); break;
  case 5:
  case 6: host_writes(some_endpoint(input) & 0x7F, fuzz_u8(input) % 65); break;
  case 7: device_writes(fuzz_u16(input) % (TRANSMIT_BYTES + 2)); break;
  case 8: device_reads(fuzz_u8(input)); break;
  case 9: host_bus_reset(); break;
  case 10: host_suspend(); break;
  case 11: host_resume(); break;
  case 12:
    if (fuzz_u8(input) & 1) {
      fake_hold_interrupts();
    } else {
      fake_run_interrupts();
    }
    break;
  default: bring_up();
  }
  follow_closings();
}

void fuzz_one(const uint8_t *bytes, size_t length) {
  struct fuzz_input input = {bytes, bytes + length};
  Unity.TestFile = __FILE__;
  Unity.CurrentTestName = "fuzz_one";
  if (!TEST_PROTECT()) {
    fflush(stdout);
    abort(); /* an assertion of the fake controller, which has said which */
  }
  begin();
  while (fuzz_left(&input) > 0) {
    step(&input);
  }
  check_is_alive();
}

/* Unity's runner would call them. */
void setUp(void);
void tearDown(void);
void setUp(void) {}
void tearDown(void) {}
