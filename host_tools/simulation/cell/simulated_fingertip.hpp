// A simulated fingertip: the pressures of a touch on the base, the errors of its
// sensors, then the firmware's own fit, estimate of tangential force, slip and motion, as app.c
// has them do it, to what the controller of a grasp takes.
//
// What condition does is left out: readings are relative to the true zero, and no frame is given
// to temperatures.
#pragma once

#include "grasp/control/grip.hpp"
#include "libfingertip/random.hpp"
#include "simulation/cell/face.hpp"

#include <cstdint>
#include <memory>

struct motion; // of firmware/contact

namespace fingertip::cell {

double speed_of(const ::motion &motion); // mm/s

// What sets one pad apart, and its firmware's calibration.
struct Rubber {
  Pressures gain, gain_sd; // share that a reading has of the true one; sd of the calibration
};

struct Sensing {
  std::uint16_t osr = 1024;
  double rate_Hz = 410.0;
  double tangential = 1.0; // share of a tangential force's field that reaches the readings
};

// A frame takes its conversion, of which the middle is its time; then it is read, fitted and sent
// in PROCESSING_s and comes by the line with a jitter, half of a normal one of this sd. Assumed:
// stages of the emulated chip at 410 Hz add up to some 1.6 ms after the conversion; less where
// frames are shorter than that.
constexpr double PROCESSING_s = 1.6e-3, JITTER_s = 2e-4;

class SimulatedFingertip {
public:
  // rubber's gains hold the error of the force's scale too.
  SimulatedFingertip(const Face &face, const Rubber &rubber, const Sensing &sensing, Random random);
  ~SimulatedFingertip();
  SimulatedFingertip(SimulatedFingertip &&) noexcept;

  // When the next frame is measured, and when it will be known.
  double next_s() const { return next_s_; }
  struct Frame {
    double known_s;
    GripTouch touch;
  };
  // The frame of this touch at next_s.
  Frame measure(const twin::Touch &touch);

private:
  struct Firmware;
  const Face *face_;
  Rubber rubber_;
  Sensing sensing_;
  Random random_;
  double noise_Pa_, conversion_s_, next_s_, last_known_s_ = 0.0;
  std::unique_ptr<Firmware> firmware_;
};

} // namespace fingertip::cell
