#include "usb/device.h"

#include "common/bytes.h"
#include "port/usb_controller.h"

enum standard_request {
  GET_STATUS = 0,
  CLEAR_FEATURE = 1,
  SET_FEATURE = 3,
  SET_ADDRESS = 5,
  GET_DESCRIPTOR = 6,
  GET_CONFIGURATION = 8,
  SET_CONFIGURATION = 9,
  GET_INTERFACE = 10,
  SET_INTERFACE = 11,
};

enum request_type {
  TO_DEVICE = 0x00,
  TO_INTERFACE = 0x01,
  TO_ENDPOINT = 0x02,
  DIRECTION_IN = 0x80,
  KIND_MASK = 0x60,
  KIND_STANDARD = 0x00,
};

enum { FEATURE_ENDPOINT_HALT = 0 };

enum device_state { STATE_DEFAULT, STATE_ADDRESS, STATE_CONFIGURED };

enum stage { STAGE_IDLE, STAGE_DATA_IN, STAGE_DATA_OUT, STAGE_STATUS_IN, STAGE_STATUS_OUT };

struct endpoint {
  uint8_t address;
  uint8_t interface;
  enum usb_endpoint_type type;
};

static const struct endpoint endpoints[] = {
    {CDC_ENDPOINT_NOTIFY, CDC_INTERFACE_CONTROL, USB_ENDPOINT_INTERRUPT},
    {CDC_ENDPOINT_IN, CDC_INTERFACE_DATA, USB_ENDPOINT_BULK},
    {CDC_ENDPOINT_OUT, CDC_INTERFACE_DATA, USB_ENDPOINT_BULK},
};
enum { ENDPOINTS = sizeof endpoints / sizeof endpoints[0] };

static struct {
  const struct cdc_identity *identity;
  enum device_state state;
  bool halted[ENDPOINTS];

  /* The control transfer under way */
  enum stage stage;
  struct usb_setup setup;
  _Alignas(4) uint8_t data[DESCRIPTOR_MAX_BYTES];
  size_t length; /* of the data stage */
  size_t done;
} device;

static int find_endpoint(uint16_t address) {
  for (int i = 0; i < ENDPOINTS; i++) {
    if (endpoints[i].address == address)
      return i;
  }
  return -1;
}

bool device_endpoint_is_halted(uint8_t endpoint) {
  int i = find_endpoint(endpoint);
  return i >= 0 && device.halted[i];
}

static void open_interface(uint16_t interface) {
  for (int i = 0; i < ENDPOINTS; i++) {
    if (endpoints[i].interface == interface) {
      device.halted[i] = false;
      usb_controller_open(endpoints[i].address, endpoints[i].type);
    }
  }
}

static enum control_answer send_status(bool halted, size_t *length) {
  bytes_put_u16(device.data, halted ? 1 : 0);
  *length = 2;
  return CONTROL_SEND;
}

static enum control_answer set_halt(const struct usb_setup *setup, bool halted) {
  int i = find_endpoint(setup->index);
  if (setup->value != FEATURE_ENDPOINT_HALT || device.state != STATE_CONFIGURED || i < 0)
    return CONTROL_STALL;
  cdc_before_halt_change(endpoints[i].address);
  device.halted[i] = halted;
  if (halted)
    usb_controller_stall(endpoints[i].address);
  else
    usb_controller_unstall(endpoints[i].address);
  cdc_after_halt_change();
  return CONTROL_DONE;
}

static enum control_answer set_configuration(uint16_t value) {
  if (device.state == STATE_DEFAULT || value > 1)
    return CONTROL_STALL;
  bool configured = value == 1;
  if (configured) {
    open_interface(CDC_INTERFACE_CONTROL);
    open_interface(CDC_INTERFACE_DATA);
  } else {
    usb_controller_close_all();
  }
  device.state = configured ? STATE_CONFIGURED : STATE_ADDRESS;
  cdc_on_configured(configured);
  return CONTROL_DONE;
}

static enum control_answer on_device_request(const struct usb_setup *setup, size_t *length) {
  switch (setup->request) {
  case GET_STATUS: return send_status(false, length); /* powered by the bus, no remote wake-up */
  case SET_ADDRESS:
    if (device.state == STATE_CONFIGURED || setup->value > 127)
      return CONTROL_STALL;
    return CONTROL_DONE; /* takes effect after the status stage */
  case GET_DESCRIPTOR:
    *length = descriptor_write(device.identity, setup->value, device.data);
    return *length ? CONTROL_SEND : CONTROL_STALL;
  case GET_CONFIGURATION:
    device.data[0] = device.state == STATE_CONFIGURED ? 1 : 0;
    *length = 1;
    return CONTROL_SEND;
  case SET_CONFIGURATION: return set_configuration(setup->value);
  default: return CONTROL_STALL;
  }
}

static enum control_answer on_interface_request(const struct usb_setup *setup, size_t *length) {
  if (device.state != STATE_CONFIGURED || setup->index >= CDC_INTERFACES)
    return CONTROL_STALL;
  switch (setup->request) {
  case GET_STATUS: return send_status(false, length);
  case GET_INTERFACE:
    device.data[0] = 0;
    *length = 1;
    return CONTROL_SEND;
  case SET_INTERFACE:
    if (setup->value != 0)
      return CONTROL_STALL;
    open_interface(setup->index);
    if (setup->index == CDC_INTERFACE_DATA)
      cdc_on_interface_set();
    return CONTROL_DONE;
  default: return CONTROL_STALL;
  }
}

static enum control_answer on_endpoint_request(const struct usb_setup *setup, size_t *length) {
  switch (setup->request) {
  case GET_STATUS: {
    int i = find_endpoint(setup->index);
    bool control = (setup->index & ~USB_ENDPOINT_IN) == 0;
    if (!control && (device.state != STATE_CONFIGURED || i < 0))
      return CONTROL_STALL;
    return send_status(!control && device.halted[i], length);
  }
  case CLEAR_FEATURE: return set_halt(setup, false);
  case SET_FEATURE: return set_halt(setup, true);
  default: return CONTROL_STALL;
  }
}

static enum control_answer on_request(const struct usb_setup *setup, size_t *length) {
  if ((setup->type & KIND_MASK) != KIND_STANDARD) {
    if (device.state != STATE_CONFIGURED)
      return CONTROL_STALL;
    return cdc_on_request(setup, device.data, length);
  }
  /* The direction is fixed for each standard request, and 1 where it answers with data. */
  bool answers = setup->request == GET_STATUS || setup->request == GET_DESCRIPTOR || setup->request == GET_CONFIGURATION ||
                 setup->request == GET_INTERFACE;
  if (answers != ((setup->type & DIRECTION_IN) != 0) || (!answers && setup->length != 0))
    return CONTROL_STALL;
  switch (setup->type & ~DIRECTION_IN) {
  case TO_DEVICE: return on_device_request(setup, length);
  case TO_INTERFACE: return on_interface_request(setup, length);
  case TO_ENDPOINT: return on_endpoint_request(setup, length);
  default: return CONTROL_STALL;
  }
}

static void stall_control(void) {
  device.stage = STAGE_IDLE;
  usb_controller_stall(0);
}

static void start_status_in(void) {
  device.stage = STAGE_STATUS_IN;
  usb_controller_send(USB_ENDPOINT_IN, NULL, 0);
}

static size_t next_packet_bytes(void) {
  size_t rest = device.length - device.done;
  return rest < USB_MAX_PACKET_BYTES ? rest : USB_MAX_PACKET_BYTES;
}

static void send_next_packet(void) { usb_controller_send(USB_ENDPOINT_IN, device.data + device.done, next_packet_bytes()); }

void usb_device_on_setup(const uint8_t packet[USB_SETUP_BYTES]) {
  struct usb_setup *setup = &device.setup;
  setup->type = packet[0];
  setup->request = packet[1];
  setup->value = bytes_get_u16(packet + 2);
  setup->index = bytes_get_u16(packet + 4);
  setup->length = bytes_get_u16(packet + 6);

  device.stage = STAGE_IDLE;
  device.done = 0;
  size_t length = 0;
  switch (on_request(setup, &length)) {
  case CONTROL_STALL: stall_control(); break;
  case CONTROL_DONE: start_status_in(); break;
  case CONTROL_SEND:
    device.length = length < setup->length ? length : setup->length;
    device.stage = STAGE_DATA_IN;
    send_next_packet();
    usb_controller_receive(0); /* the host may end the data stage early */
    break;
  case CONTROL_RECEIVE:
    device.length = setup->length;
    device.stage = STAGE_DATA_OUT;
    usb_controller_receive(0);
    break;
  }
}

static void on_control_sent(void) {
  if (device.stage == STAGE_DATA_IN) {
    size_t sent = next_packet_bytes();
    device.done += sent;
    /* A packet below the maximum, empty perhaps, ends an answer shorter than was asked for. */
    if (sent < USB_MAX_PACKET_BYTES || device.done == device.setup.length)
      device.stage = STAGE_STATUS_OUT;
    else
      send_next_packet();
  } else if (device.stage == STAGE_STATUS_IN) {
    device.stage = STAGE_IDLE;
    if (device.setup.type == TO_DEVICE && device.setup.request == SET_ADDRESS) {
      usb_controller_set_address((uint8_t)device.setup.value);
      device.state = device.setup.value ? STATE_ADDRESS : STATE_DEFAULT;
    }
  }
}

static void on_control_received(const uint8_t *bytes, size_t length) {
  if (device.stage == STAGE_DATA_OUT && length <= device.length - device.done) {
    memcpy(device.data + device.done, bytes, length);
    device.done += length;
    if (device.done < device.length && length == USB_MAX_PACKET_BYTES) {
      usb_controller_receive(0);
    } else if (device.done == device.length) {
      cdc_on_request_data(&device.setup, device.data);
      start_status_in();
    } else {
      stall_control();
    }
  } else if ((device.stage == STAGE_DATA_IN || device.stage == STAGE_STATUS_OUT) && length == 0) {
    usb_controller_withdraw(USB_ENDPOINT_IN);
    device.stage = STAGE_IDLE;
  } else {
    stall_control();
  }
}

void usb_device_on_sent(uint8_t endpoint) {
  if (endpoint == USB_ENDPOINT_IN)
    on_control_sent();
  else
    cdc_on_sent(endpoint);
}

void usb_device_on_received(uint8_t endpoint, const uint8_t *bytes, size_t length) {
  if (endpoint == 0)
    on_control_received(bytes, length);
  else
    cdc_on_received(endpoint, bytes, length);
}

void usb_device_on_bus_reset(void) {
  device.state = STATE_DEFAULT;
  device.stage = STAGE_IDLE;
  cdc_on_configured(false);
  cdc_on_suspended(false);
}

void usb_device_on_suspend(void) { cdc_on_suspended(true); }

void usb_device_on_resume(void) { cdc_on_suspended(false); }

void usb_device_on_service(void) { cdc_on_service(); }

void device_start(const struct cdc_identity *identity) {
  device.identity = identity;
  device.state = STATE_DEFAULT;
  device.stage = STAGE_IDLE;
  usb_controller_start();
}
