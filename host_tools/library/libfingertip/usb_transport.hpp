/* A fingertip reached by libusb, past the system's serial driver.
 *
 * It is found by our vendor and product id and its serial number, at any bus and address. The driver cdc_acm is detached while this is
 * open, and given back at the end. Bulk transfers of one USB packet each wait in the system's queue. So nothing is lost between two reads,
 * and no short packet waits for a longer one. The thread that calls read and write serves them. */
#pragma once

#include "libfingertip/transport.hpp"

#include <memory>

namespace fingertip {

class UsbTransport : public Transport {
public:
  /* serial: empty for any fingertip. Throws Error if it is absent, in use, or not allowed. */
  explicit UsbTransport(const std::string &serial);
  ~UsbTransport() override;
  UsbTransport(const UsbTransport &) = delete;
  UsbTransport &operator=(const UsbTransport &) = delete;

  Result read(std::uint8_t *bytes, std::size_t capacity, std::size_t *length, std::chrono::milliseconds timeout) override;
  bool write(const std::uint8_t *bytes, std::size_t length) override;
  /* Throws Error if it is there but was taken by somebody else. */
  bool reopen() override;
  bool ask_loader() override;
  std::string description() const override;
  std::vector<pollfd> poll_descriptors() const override;

private:
  class Link;
  std::string serial_;
  std::unique_ptr<Link> link_;
};

} // namespace fingertip
