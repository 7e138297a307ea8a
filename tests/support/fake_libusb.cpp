#include "support/fake_libusb.hpp"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <libusb.h>
#include <poll.h>
#include <sys/eventfd.h>

namespace fake_libusb {

static std::vector<std::shared_ptr<Device>> devices;
static int balance = 0;
static std::string misused;

static void misuse_if(bool wrong, const char *how) {
  if (wrong && misused.empty()) {
    misused = how;
  }
}

std::vector<std::shared_ptr<Device>> &bus() { return devices; }
int leaks() { return balance; }
const std::string &misuse() { return misused; }
int events_descriptor() {
  static const int fd = eventfd(0, EFD_CLOEXEC);
  return fd;
}

void reset() {
  devices.clear();
  balance = 0;
  misused.clear();
}

} // namespace fake_libusb

using fake_libusb::Device;
using fake_libusb::misuse_if;

struct libusb_device {
  std::shared_ptr<Device> fake;
};
struct libusb_context {
  std::vector<libusb_device> seen;
  std::deque<libusb_transfer *> waiting;
  std::vector<libusb_transfer *> cancelled;
};
struct libusb_device_handle {
  libusb_context *context;
  std::shared_ptr<Device> fake;
};

/* libusb knows the context of a device; here only one is open at a time. */
static libusb_context *current = nullptr;

static bool is_waiting(const libusb_transfer *transfer) {
  return current && std::find(current->waiting.begin(), current->waiting.end(), transfer) != current->waiting.end();
}

static void complete(libusb_transfer *transfer, libusb_transfer_status status) {
  transfer->status = status;
  transfer->callback(transfer);
}

extern "C" {

int LIBUSB_CALL libusb_init(libusb_context **context) {
  fake_libusb::balance++;
  current = *context = new libusb_context;
  for (const auto &device : fake_libusb::devices) {
    if (device->is_plugged_in) {
      current->seen.push_back({device});
    }
  }
  return 0;
}

void LIBUSB_CALL libusb_exit(libusb_context *context) {
  misuse_if(!context->waiting.empty(), "exit with transfers in flight");
  fake_libusb::balance--;
  delete context;
  current = nullptr;
}

ssize_t LIBUSB_CALL libusb_get_device_list(libusb_context *context, libusb_device ***list) {
  *list = new libusb_device *[context->seen.size() + 1];
  for (std::size_t i = 0; i < context->seen.size(); i++) {
    (*list)[i] = &context->seen[i];
  }
  return static_cast<ssize_t>(context->seen.size());
}

void LIBUSB_CALL libusb_free_device_list(libusb_device **list, int) { delete[] list; }

int LIBUSB_CALL libusb_get_device_descriptor(libusb_device *device, libusb_device_descriptor *descriptor) {
  std::memset(descriptor, 0, sizeof *descriptor);
  descriptor->idVendor = device->fake->vendor;
  descriptor->idProduct = device->fake->product;
  descriptor->iSerialNumber = 3;
  return 0;
}

std::uint8_t LIBUSB_CALL libusb_get_bus_number(libusb_device *device) { return device->fake->bus; }
std::uint8_t LIBUSB_CALL libusb_get_device_address(libusb_device *device) { return device->fake->address; }

int LIBUSB_CALL libusb_get_active_config_descriptor(libusb_device *device, libusb_config_descriptor **configuration) {
  static libusb_endpoint_descriptor notify, data[2];
  static libusb_interface_descriptor settings[2];
  static libusb_interface interfaces[2];
  static libusb_config_descriptor whole;
  notify.bEndpointAddress = 0x81;
  notify.wMaxPacketSize = 16;
  data[0].bEndpointAddress = 0x02;
  data[1].bEndpointAddress = 0x82;
  data[0].wMaxPacketSize = data[1].wMaxPacketSize = 64;
  settings[0].bInterfaceNumber = 0;
  settings[0].bInterfaceClass = LIBUSB_CLASS_COMM;
  settings[0].bNumEndpoints = 1;
  settings[0].endpoint = &notify;
  settings[1].bInterfaceNumber = 1;
  settings[1].bInterfaceClass = device->fake->has_cdc_interfaces ? LIBUSB_CLASS_DATA : 0xFF;
  settings[1].bNumEndpoints = 2;
  settings[1].endpoint = data;
  for (int i = 0; i < 2; i++) {
    interfaces[i].altsetting = &settings[i];
    interfaces[i].num_altsetting = 1;
  }
  whole.bNumInterfaces = 2;
  whole.interface = interfaces;
  *configuration = &whole;
  return 0;
}

void LIBUSB_CALL libusb_free_config_descriptor(libusb_config_descriptor *) {}

int LIBUSB_CALL libusb_open(libusb_device *device, libusb_device_handle **handle) {
  if (!device->fake->is_plugged_in) {
    return LIBUSB_ERROR_NO_DEVICE;
  }
  if (device->fake->is_denied) {
    return LIBUSB_ERROR_ACCESS;
  }
  fake_libusb::balance++;
  *handle = new libusb_device_handle{current, device->fake};
  return 0;
}

void LIBUSB_CALL libusb_close(libusb_device_handle *handle) {
  misuse_if(handle->fake->claimed[0] || handle->fake->claimed[1], "close with claimed interfaces");
  fake_libusb::balance--;
  delete handle;
}

int LIBUSB_CALL libusb_get_string_descriptor_ascii(libusb_device_handle *handle, std::uint8_t index, unsigned char *text, int length) {
  const std::string &serial = handle->fake->serial;
  misuse_if(index != 3 || length < static_cast<int>(serial.size()), "string descriptor");
  std::memcpy(text, serial.data(), serial.size());
  return static_cast<int>(serial.size());
}

int LIBUSB_CALL libusb_kernel_driver_active(libusb_device_handle *handle, int interface) { return handle->fake->driver[interface]; }

/* cdc_acm holds both interfaces and lets go of both. */
int LIBUSB_CALL libusb_detach_kernel_driver(libusb_device_handle *handle, int interface) {
  misuse_if(!handle->fake->driver[interface], "detach without a driver");
  handle->fake->driver[0] = handle->fake->driver[1] = false;
  return 0;
}

int LIBUSB_CALL libusb_attach_kernel_driver(libusb_device_handle *handle, int) {
  Device &device = *handle->fake;
  if (device.claimed[0] || device.claimed[1]) {
    return LIBUSB_ERROR_BUSY;
  }
  device.driver[0] = device.driver[1] = true;
  return 0;
}

int LIBUSB_CALL libusb_claim_interface(libusb_device_handle *handle, int interface) {
  Device &device = *handle->fake;
  if (!device.is_plugged_in) {
    return LIBUSB_ERROR_NO_DEVICE;
  }
  if (device.driver[interface] || device.is_claimed) {
    return LIBUSB_ERROR_BUSY;
  }
  device.claimed[interface] = true;
  return 0;
}

int LIBUSB_CALL libusb_release_interface(libusb_device_handle *handle, int interface) {
  misuse_if(!handle->fake->claimed[interface], "release of what was not claimed");
  handle->fake->claimed[interface] = false;
  return 0;
}

int LIBUSB_CALL libusb_control_transfer(libusb_device_handle *handle, std::uint8_t type, std::uint8_t request, std::uint16_t value,
                                        std::uint16_t index, unsigned char *data, std::uint16_t length, unsigned) {
  Device &device = *handle->fake;
  if (!device.is_plugged_in) {
    return LIBUSB_ERROR_NO_DEVICE;
  }
  misuse_if(type != 0x21 || index != 0, "control request to the wrong place");
  if (request == 0x22) {
    device.lines = value;
  } else if (request == 0x20 && length == 7 && data[6] == 8) {
    device.baud = static_cast<std::uint32_t>(data[0] | data[1] << 8 | data[2] << 16);
  } else {
    return LIBUSB_ERROR_PIPE;
  }
  return length;
}

int LIBUSB_CALL libusb_bulk_transfer(libusb_device_handle *handle, unsigned char endpoint, unsigned char *data, int length,
                                     int *transferred, unsigned) {
  Device &device = *handle->fake;
  *transferred = 0;
  if (!device.is_plugged_in) {
    return LIBUSB_ERROR_NO_DEVICE;
  }
  misuse_if(endpoint != 0x02 || !device.claimed[1], "bulk transfer to the wrong place");
  if (!device.takes_bytes) {
    return LIBUSB_ERROR_TIMEOUT;
  }
  device.out.insert(device.out.end(), data, data + length);
  *transferred = length;
  return 0;
}

int LIBUSB_CALL libusb_clear_halt(libusb_device_handle *handle, unsigned char endpoint) {
  misuse_if(endpoint == 0x82 && !handle->context->waiting.empty(), "clear halt with transfers");
  handle->fake->halted = false;
  return handle->fake->is_plugged_in ? 0 : LIBUSB_ERROR_NO_DEVICE;
}

libusb_transfer *LIBUSB_CALL libusb_alloc_transfer(int) {
  fake_libusb::balance++;
  return static_cast<libusb_transfer *>(std::calloc(1, sizeof(libusb_transfer)));
}

void LIBUSB_CALL libusb_free_transfer(libusb_transfer *transfer) {
  misuse_if(is_waiting(transfer), "free of a transfer in flight");
  fake_libusb::balance--;
  std::free(transfer);
}

int LIBUSB_CALL libusb_submit_transfer(libusb_transfer *transfer) {
  libusb_device_handle *handle = transfer->dev_handle;
  if (!handle->fake->is_plugged_in) {
    return LIBUSB_ERROR_NO_DEVICE;
  }
  misuse_if(is_waiting(transfer), "submitted twice");
  misuse_if(transfer->endpoint != 0x82 || !handle->fake->claimed[1], "transfer to the wrong place");
  handle->context->waiting.push_back(transfer);
  handle->fake->most_waiting = std::max(handle->fake->most_waiting, static_cast<int>(handle->context->waiting.size()));
  return 0;
}

int LIBUSB_CALL libusb_cancel_transfer(libusb_transfer *transfer) {
  if (!is_waiting(transfer)) {
    return LIBUSB_ERROR_NOT_FOUND;
  }
  transfer->dev_handle->context->cancelled.push_back(transfer);
  return 0;
}

/* At most one packet's or one round's worth of completions, as the real one returns early. */
int LIBUSB_CALL libusb_handle_events_timeout_completed(libusb_context *context, timeval *, int *) {
  auto take = [&](libusb_transfer *transfer) {
    context->waiting.erase(std::find(context->waiting.begin(), context->waiting.end(), transfer));
  };
  auto cancelled = std::move(context->cancelled);
  context->cancelled.clear();
  for (libusb_transfer *transfer : cancelled) {
    if (is_waiting(transfer)) {
      take(transfer);
      transfer->actual_length = 0;
      complete(transfer, LIBUSB_TRANSFER_CANCELLED);
    }
  }
  if (context->waiting.empty()) {
    return 0;
  }
  libusb_transfer *first = context->waiting.front();
  Device &device = *first->dev_handle->fake;
  first->actual_length = 0;
  if (!device.is_plugged_in) {
    take(first);
    complete(first, LIBUSB_TRANSFER_NO_DEVICE);
  } else if (device.halted) {
    take(first);
    complete(first, LIBUSB_TRANSFER_STALL);
  } else if (!device.in.empty()) {
    take(first);
    std::vector<std::uint8_t> packet = device.in.front();
    device.in.pop_front();
    misuse_if(static_cast<std::size_t>(first->length) < packet.size(), "babble");
    std::copy(packet.begin(), packet.end(), first->buffer);
    first->actual_length = static_cast<int>(packet.size());
    complete(first, LIBUSB_TRANSFER_COMPLETED);
  }
  return 0;
}

const libusb_pollfd **LIBUSB_CALL libusb_get_pollfds(libusb_context *) {
  static libusb_pollfd events = {fake_libusb::events_descriptor(), POLLIN};
  fake_libusb::balance++;
  return new const libusb_pollfd *[2] { &events, nullptr };
}

void LIBUSB_CALL libusb_free_pollfds(const libusb_pollfd **list) {
  fake_libusb::balance--;
  delete[] list;
}

const char *LIBUSB_CALL libusb_error_name(int) { return "LIBUSB_ERROR"; }

} // extern "C"
