// The firmware's three looks at motion, side by side on the same frames, and what each is worth on
// one act.
#pragma once

#include "shear/motion/plays.hpp"

#include <array>
#include <optional>
#include <vector>

namespace fingertip::shear {

// SLIP: eq. (7) on the Gaussian's location. MOVING: least-squares velocity. SLIDING:
// contact/motion.h.
enum Detector { EQ7, MOVING, SLIDING, DETECTORS };
constexpr std::array<const char *, DETECTORS> DETECTOR_NAMES{"eq7", "moving", "sliding"};

// Whether each detector speaks of a frame, and the velocity that it gives.
struct Said {
  std::array<bool, DETECTORS> flags;
  bool velocity_valid;
  float velocity_x_mm_s, velocity_y_mm_s;
};

// What an image keeps from frame to frame.
class Watch {
public:
  Watch();
  ~Watch();
  Said look(const Felt &felt);

private:
  struct Histories;
  std::unique_ptr<Histories> histories_;
};

// All of the contact slides, from the first moment to the last; what goes on after less than
// JOINED_s of rest is one slip.
struct Slip {
  static constexpr double JOINED_s = 0.03;
  double begin_s, end_s; // from the act's beginning
  double way_mm, speed_mm_s;
  double shows_s; // when it has gone SHOWS_mm; the end if it has not
  static constexpr double SHOWS_mm = 0.1;
};
std::vector<Slip> slips_of(const twin::Act &act);

struct Judged {
  // What one detector said of one slip. Latencies count to when the frame is known.
  struct Found {
    Slip slip;
    std::array<std::optional<double>, DETECTORS> latency_s;
    std::array<int, DETECTORS> gaps;       // how often it fell silent and spoke again meanwhile
    std::array<double, DETECTORS> lasts_s; // how long after the slip's end it still spoke
  };
  std::vector<Found> slips;
  std::array<bool, DETECTORS> spoke, falsely; // at all; where nothing slips, nor has just now
  double lift_s = 0.0;                        // how long the lift takes, if it is one
};

// A detector that speaks so long after a slip still speaks of it, and so long before one of its
// beginning: by then more than nine tenths of the contact slide.
constexpr double LATE_s = 0.08, EARLY_s = 0.02;

Judged judge(Player &player, const twin::Act &act, std::uint64_t number);

} // namespace fingertip::shear
