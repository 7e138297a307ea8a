/* A bus of fingertips behind the functions of libusb that the transport uses, in place of the
 * library: the linker takes those of the program first. Bulk IN packets are what a test queued. */
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <vector>

namespace fake_libusb {

struct Device {
  std::string serial;
  std::uint8_t bus = 1, address = 1;
  std::uint16_t vendor = FINGERTIP_USB_VID, product = FINGERTIP_USB_PID;
  bool is_plugged_in = true;
  bool is_denied = false;  /* to this user */
  bool is_claimed = false; /* by another program */
  bool has_cdc_interfaces = true;
  bool driver[2] = {true, true}; /* the kernel's, of each interface */
  bool claimed[2] = {false, false};
  bool halted = false;
  bool takes_bytes = true;
  std::deque<std::vector<std::uint8_t>> in; /* packets to come */
  std::vector<std::uint8_t> out;
  std::uint16_t lines = 0;
  std::uint32_t baud = 0;
  int most_waiting = 0; /* bulk IN transfers at once */
};

/* What is waited for; nothing ever comes there. */
int events_descriptor();

/* The bus; a context sees what was plugged in when it was made. */
std::vector<std::shared_ptr<Device>> &bus();
/* Contexts, handles and transfers that were not given back. */
int leaks();
/* Whether any function was used against the rules of libusb, and how. */
const std::string &misuse();
void reset();

} // namespace fake_libusb
