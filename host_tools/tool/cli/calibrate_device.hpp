/* The fingertip that is calibrated, and its user. */
#pragma once

#include "libfingertip/command.hpp"
#include "libfingertip/session.hpp"
#include "tool/cli/calibrate.hpp"

#include <functional>
#include <memory>
#include <string>

namespace fingertip {

/* Throws Error with `otherwise` unless the answer is yes; Interrupted. */
void ask(const CalibrateOptions &options, const std::string &question, const std::string &otherwise);

class CalibratedDevice {
public:
  explicit CalibratedDevice(const CalibrateOptions &options);
  ~CalibratedDevice();

  /* Throws Error where a sensor does not answer. */
  void check_sensors();
  /* Throws Error where a recording is of another fingertip. */
  void check_is(const wire_info &recorded, const std::string &recording) const;

  /* Streams, with a packet of this type for each frame, until goes_on() is false. Throws Error
   * where no frames come, Interrupted. */
  void follow(std::uint8_t streams, std::uint8_t of_frames, const std::function<void(const wire_packet &)> &take,
              const std::function<bool()> &goes_on);

  /* What is begun is done whole, whatever signals come. Throws Error where it was not kept. */
  void write(const calibration &made);
  void write(const pad_profile &pad);
  void erase() { send(command_erase_calibration()); }

  const wire_info &info() const { return info_; }
  std::string name() const { return transport_->description(); }

private:
  void send(const wire_packet &command);

  std::unique_ptr<Transport> transport_;
  bool ending_ = false;
  Session session_;
  wire_info info_;
  bool streaming_ = false;
};

} // namespace fingertip
