#include "libfingertip/usb_transport.hpp"

#include "libfingertip/clock.hpp"
#include "libfingertip/discovery.hpp"
#include "libfingertip/error.hpp"
#include "libfingertip/packet_fields.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <deque>
#include <libusb.h>
#include <vector>

namespace fingertip {

namespace {

using std::chrono::milliseconds;

/* 64 packets are the most that full speed brings in about 4 ms, a fingertip in 50. */
constexpr std::size_t TRANSFERS = 64;
constexpr unsigned CONTROL_TIMEOUT_ms = 1000;
constexpr unsigned WRITE_TIMEOUT_ms = 1000;
constexpr milliseconds CANCEL_TIMEOUT{2000};
/* Without stalling for ever on a device that halts its endpoint again and again. */
constexpr int HALTS_BEFORE_GONE = 8;

/* USB Class Definitions for Communications Devices 1.2, PSTN subclass 1.2, table 13. */
constexpr std::uint8_t TO_INTERFACE = 0x21;
constexpr std::uint8_t SET_LINE_CODING = 0x20;
constexpr std::uint8_t SET_CONTROL_LINE_STATE = 0x22;
constexpr std::uint16_t DTR_AND_RTS = 3;
constexpr std::uint32_t BAUD = 115200;
constexpr std::uint32_t LOADER_BAUD = 1200;

struct Layout {
  int control_interface = -1;
  int data_interface = -1;
  std::uint8_t in = 0, out = 0;
  std::uint16_t in_packet_bytes = 0;

  bool is_complete() const { return control_interface >= 0 && in && out && in_packet_bytes; }
};

Layout layout_of(libusb_device *device) {
  Layout layout;
  libusb_config_descriptor *configuration = nullptr;
  if (libusb_get_active_config_descriptor(device, &configuration) != 0) {
    return layout;
  }
  for (int i = 0; i < configuration->bNumInterfaces; i++) {
    if (configuration->interface[i].num_altsetting < 1) {
      continue;
    }
    const libusb_interface_descriptor &each = configuration->interface[i].altsetting[0];
    if (each.bInterfaceClass == LIBUSB_CLASS_COMM) {
      layout.control_interface = each.bInterfaceNumber;
    } else if (each.bInterfaceClass == LIBUSB_CLASS_DATA) {
      layout.data_interface = each.bInterfaceNumber;
      for (int k = 0; k < each.bNumEndpoints; k++) {
        const libusb_endpoint_descriptor &endpoint = each.endpoint[k];
        if (endpoint.bEndpointAddress & LIBUSB_ENDPOINT_IN) {
          layout.in = endpoint.bEndpointAddress;
          layout.in_packet_bytes = endpoint.wMaxPacketSize;
        } else {
          layout.out = endpoint.bEndpointAddress;
        }
      }
    }
  }
  libusb_free_config_descriptor(configuration);
  return layout;
}

std::string failure(const std::string &serial, const std::string &what) { return (serial.empty() ? "usb" : "usb " + serial) + ": " + what; }

} // namespace

/* One opening of one device; complete, or it throws. */
class UsbTransport::Link {
public:
  /* nullptr: not there (any more). denied: there, but this user may not open it. */
  static std::unique_ptr<Link> open(const std::string &serial, bool *denied) {
    auto link = std::unique_ptr<Link>(new Link);
    *denied = false;
    if (!link->find(serial, denied) || !link->claim()) {
      return nullptr;
    }
    link->start();
    return link;
  }

  ~Link() {
    if (handle_) {
      set_lines(0);
      stop();
      give_back();
      libusb_close(handle_);
    }
    if (context_) {
      libusb_exit(context_);
    }
  }
  Link(const Link &) = delete;
  Link &operator=(const Link &) = delete;

  bool is_gone() const { return gone_; }
  bool has_data() const { return !received_.empty(); }
  const std::string &description() const { return description_; }

  std::size_t take(std::uint8_t *bytes, std::size_t capacity) {
    std::size_t length = std::min(capacity, received_.size());
    std::copy_n(received_.begin(), length, bytes);
    received_.erase(received_.begin(), received_.begin() + static_cast<std::ptrdiff_t>(length));
    return length;
  }

  /* Until something happened or this moment has come. False: a signal came. */
  bool serve(HostTime until) {
    if (halted_ && waiting_ == 0) {
      restart_after_halt();
    } else if (halted_) {
      cancel();
    }
    handle_events();
    if (has_data() || is_gone()) {
      return true;
    }
    std::vector<pollfd> descriptors = poll_descriptors();
    const bool is_whole = wait_for(descriptors.data(), descriptors.size(), until) > 0 || host_now() >= until;
    handle_events();
    return is_whole;
  }

  /* Those that are there, without waiting. */
  void handle_events() {
    timeval at_once = {};
    const int result = libusb_handle_events_timeout_completed(context_, &at_once, nullptr);
    if (result != 0 && result != LIBUSB_ERROR_INTERRUPTED && result != LIBUSB_ERROR_TIMEOUT) {
      gone_ = true;
    }
  }

  bool write(const std::uint8_t *bytes, std::size_t length) {
    int sent = 0;
    int result =
        libusb_bulk_transfer(handle_, layout_.out, const_cast<std::uint8_t *>(bytes), static_cast<int>(length), &sent, WRITE_TIMEOUT_ms);
    gone_ = gone_ || result == LIBUSB_ERROR_NO_DEVICE;
    if (result == LIBUSB_ERROR_PIPE) {
      libusb_clear_halt(handle_, layout_.out);
    }
    return result == 0 && static_cast<std::size_t>(sent) == length;
  }

  bool ask_loader() { return set_baud(LOADER_BAUD) && set_lines(0); }

  /* The transfers have no timeouts that would have to be served in time. */
  std::vector<pollfd> poll_descriptors() const {
    std::vector<pollfd> all;
    const libusb_pollfd **list = libusb_get_pollfds(context_);
    for (const libusb_pollfd **each = list; each && *each; each++) {
      all.push_back({(*each)->fd, (*each)->events, 0});
    }
    libusb_free_pollfds(list);
    return all;
  }

private:
  struct Slot {
    Link *link;
    libusb_transfer *transfer;
    std::vector<std::uint8_t> buffer;
    bool waiting;
  };

  /* A context of its own: one that lives through a reconnection sees new devices only where udev runs. */
  Link() {
    if (libusb_init(&context_) != 0) {
      context_ = nullptr;
      throw Error(ErrorCode::usb_failed, "usb: libusb cannot start: is there no /dev/bus/usb?");
    }
  }

  bool find(const std::string &serial, bool *denied) {
    libusb_device **list = nullptr;
    ssize_t count = libusb_get_device_list(context_, &list);
    for (ssize_t i = 0; i < count && !handle_; i++) {
      libusb_device_descriptor descriptor;
      if (libusb_get_device_descriptor(list[i], &descriptor) != 0 || descriptor.idVendor != FINGERTIP_USB_VID ||
          descriptor.idProduct != FINGERTIP_USB_PID) {
        continue;
      }
      libusb_device_handle *handle = nullptr;
      int result = libusb_open(list[i], &handle);
      *denied = *denied || result == LIBUSB_ERROR_ACCESS;
      if (result != 0) {
        continue;
      }
      unsigned char text[128] = {};
      int length = libusb_get_string_descriptor_ascii(handle, descriptor.iSerialNumber, text, sizeof text - 1);
      std::string here(reinterpret_cast<char *>(text), length > 0 ? static_cast<size_t>(length) : 0);
      if (!serial.empty() && !is_same_serial(here, serial)) {
        libusb_close(handle);
        continue;
      }
      handle_ = handle;
      layout_ = layout_of(list[i]);
      char place[32];
      std::snprintf(place, sizeof place, "usb %03u/%03u ", libusb_get_bus_number(list[i]), libusb_get_device_address(list[i]));
      description_ = place + here;
    }
    if (count >= 0) {
      libusb_free_device_list(list, 1);
    }
    return handle_ != nullptr;
  }

  /* False: it vanished meanwhile. */
  bool claim() {
    if (!layout_.is_complete()) {
      throw Error(ErrorCode::not_a_fingertip, description_ + ": its interfaces are not those of a fingertip");
    }
    for (int interface : {layout_.control_interface, layout_.data_interface}) {
      int result = 0;
      if (libusb_kernel_driver_active(handle_, interface) == 1) {
        result = libusb_detach_kernel_driver(handle_, interface);
      }
      if (result == 0 || result == LIBUSB_ERROR_NOT_FOUND) {
        result = libusb_claim_interface(handle_, interface);
      }
      switch (result) {
      case 0: claimed_.push_back(interface); break;
      case LIBUSB_ERROR_NO_DEVICE:
      case LIBUSB_ERROR_NOT_FOUND: return false;
      case LIBUSB_ERROR_BUSY: throw Error(ErrorCode::port_in_use, description_ + ": in use by another program");
      default: throw Error(ErrorCode::usb_failed, description_ + ": cannot claim its interfaces (" + libusb_error_name(result) + ")");
      }
    }
    return true;
  }

  void start() {
    slots_.resize(TRANSFERS);
    for (Slot &slot : slots_) {
      slot = {this, libusb_alloc_transfer(0), std::vector<std::uint8_t>(layout_.in_packet_bytes), false};
      if (!slot.transfer) {
        throw Error(ErrorCode::usb_failed, description_ + ": no memory for its transfers");
      }
      libusb_fill_bulk_transfer(slot.transfer, handle_, layout_.in, slot.buffer.data(), static_cast<int>(slot.buffer.size()), received,
                                &slot, 0);
      submit(slot);
    }
    if (!set_baud(BAUD) || !set_lines(DTR_AND_RTS)) {
      gone_ = true;
    }
  }

  void submit(Slot &slot) {
    if (gone_ || stopping_ || halted_) {
      return;
    }
    int result = libusb_submit_transfer(slot.transfer);
    if (result == 0) {
      slot.waiting = true;
      waiting_++;
    } else if (result == LIBUSB_ERROR_PIPE) {
      halted_ = true;
    } else {
      gone_ = true;
    }
  }

  static void LIBUSB_CALL received(libusb_transfer *transfer) {
    Slot &slot = *static_cast<Slot *>(transfer->user_data);
    Link &link = *slot.link;
    slot.waiting = false;
    link.waiting_--;
    link.received_.insert(link.received_.end(), transfer->buffer, transfer->buffer + transfer->actual_length);
    switch (transfer->status) {
    case LIBUSB_TRANSFER_COMPLETED:
      link.halts_ = 0;
      link.submit(slot);
      break;
    case LIBUSB_TRANSFER_TIMED_OUT: link.submit(slot); break;
    case LIBUSB_TRANSFER_CANCELLED: break;
    case LIBUSB_TRANSFER_STALL: link.halted_ = true; break;
    default: link.gone_ = true; break;
    }
  }

  /* Once every transfer has come back. */
  void restart_after_halt() {
    halted_ = false;
    if (++halts_ > HALTS_BEFORE_GONE || libusb_clear_halt(handle_, layout_.in) != 0) {
      gone_ = true;
    }
    for (Slot &slot : slots_) {
      submit(slot);
    }
  }

  bool set_lines(std::uint16_t lines) {
    return libusb_control_transfer(handle_, TO_INTERFACE, SET_CONTROL_LINE_STATE, lines,
                                   static_cast<std::uint16_t>(layout_.control_interface), nullptr, 0, CONTROL_TIMEOUT_ms) == 0;
  }

  bool set_baud(std::uint32_t baud) {
    /* little-endian rate, 1 stop bit, no parity, 8 bits */
    std::array<unsigned char, 7> coding = {};
    for (std::size_t i = 0; i < 4; i++) {
      coding[i] = static_cast<unsigned char>(baud >> 8 * i);
    }
    coding[6] = 8;
    return libusb_control_transfer(handle_, TO_INTERFACE, SET_LINE_CODING, 0, static_cast<std::uint16_t>(layout_.control_interface),
                                   coding.data(), static_cast<std::uint16_t>(coding.size()),
                                   CONTROL_TIMEOUT_ms) == static_cast<int>(coding.size());
  }

  void cancel() {
    for (Slot &slot : slots_) {
      if (slot.waiting) {
        libusb_cancel_transfer(slot.transfer);
      }
    }
  }

  void stop() {
    stopping_ = true;
    cancel();
    auto deadline = host_now() + CANCEL_TIMEOUT;
    while (waiting_ > 0 && host_now() < deadline) {
      timeval left = {0, 50000};
      libusb_handle_events_timeout_completed(context_, &left, nullptr);
    }
    for (Slot &slot : slots_) {
      if (slot.transfer && !slot.waiting) {
        libusb_free_transfer(slot.transfer);
      }
    }
  }

  /* The driver takes the control interface and finds the data interface free. It is asked for even
   * where none was found: a program that was killed could not give it back. */
  void give_back() {
    while (!claimed_.empty()) {
      libusb_release_interface(handle_, claimed_.back());
      claimed_.pop_back();
    }
    if (!gone_ && layout_.control_interface >= 0) {
      libusb_attach_kernel_driver(handle_, layout_.control_interface);
    }
  }

  libusb_context *context_ = nullptr;
  libusb_device_handle *handle_ = nullptr;
  Layout layout_;
  std::vector<int> claimed_;
  std::vector<Slot> slots_;
  std::size_t waiting_ = 0; /* transfers in the system's queue */
  std::deque<std::uint8_t> received_;
  std::string description_;
  bool halted_ = false; /* no transfer is submitted until the endpoint was freed */
  int halts_ = 0;
  bool gone_ = false;
  bool stopping_ = false;
};

UsbTransport::UsbTransport(const std::string &serial) : serial_(serial) {
  bool denied = false;
  link_ = Link::open(serial, &denied);
  if (!link_) {
    throw Error(denied ? ErrorCode::permission_denied : ErrorCode::no_port,
                failure(serial, denied ? "permission denied" : "no such fingertip"));
  }
}

UsbTransport::~UsbTransport() = default;

Transport::Result UsbTransport::read(std::uint8_t *bytes, std::size_t capacity, std::size_t *length, milliseconds timeout) {
  *length = 0;
  auto deadline = host_now() + timeout;
  while (link_) {
    bool more = true;
    if (!link_->has_data() && !link_->is_gone()) {
      more = link_->serve(deadline);
    }
    if (link_->has_data()) {
      *length = link_->take(bytes, capacity);
      return Result::data;
    }
    if (link_->is_gone()) {
      link_.reset();
    } else if (!more || host_now() >= deadline) {
      return Result::timeout;
    }
  }
  return Result::gone;
}

bool UsbTransport::write(const std::uint8_t *bytes, std::size_t length) { return link_ && link_->write(bytes, length); }

bool UsbTransport::reopen() {
  link_.reset();
  bool denied = false;
  link_ = Link::open(serial_, &denied);
  return link_ != nullptr;
}

bool UsbTransport::ask_loader() { return link_ && link_->ask_loader(); }

std::vector<pollfd> UsbTransport::poll_descriptors() const { return link_ ? link_->poll_descriptors() : std::vector<pollfd>(); }

std::string UsbTransport::description() const { return link_ ? link_->description() : "usb " + serial_; }

} // namespace fingertip
