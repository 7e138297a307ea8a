// A hand that follows the steps of `fingertip validate` on a simulated pad: an empty minute, a weight
// on a ball at the marks of the template, a hold, a rest, and pulls where they are wanted. With the
// errors of real pads, and with one fault of those that the card is to find.
#pragma once

#include "simulation/cell/face.hpp"
#include "simulation/twin/effects.hpp"
#include "simulation/twin/traction_table.hpp"

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace fingertip::cell {

enum class PadFault {
  none,
  dead_sensor,   // one measures nothing, or (odd seeds) answers nothing
  loose_sensor,  // one measures another share of each press, sd 20 %
  tilted_skin,   // 9 % thicker at one end than in the middle, along x or y, and as much thinner
  thin_skin,     // 8 mm of rubber where 12 are stated
  drift,         // three zeros move by 60 to 180 Pa in a minute
  wrong_weight,  // two thirds or three halves of what is stated
  swapped_wires, // two sensors
};
const std::vector<std::string> &pad_fault_names(); // in this order

double smooth(double share); // 0 to 1 within 0 to 1, smooth at both ends

// As the recordings of real strips and grids have them (twin/README.md, effects).
twin::EffectValues usual_effects();

struct Pulling {
  double weight_g = 0.0;  // on the thread; 0: no pulls
  double height_mm = 2.0; // of the thread above the rubber
};

struct ValidatedOptions {
  PadFault fault = PadFault::none;
  double weight_g = 300.0; // as stated
  double hand_sd_mm = 0.3; // from the marks, each way
  Pulling pulling = {};
  twin::EffectValues effects = usual_effects();
  std::uint64_t seed = 1;
  std::filesystem::path cache;
};

class ValidatedPad {
public:
  explicit ValidatedPad(const ValidatedOptions &options);

  // When each step begins, s, and its event (host_tools/python/fingertip/validation/protocol.py); the
  // last is the end. All touches are in between.
  const std::vector<std::pair<double, std::string>> &plan() const { return plan_; }
  double end_s() const { return plan_.back().first; }
  // Above ambient, what the sensor with this number reads; times may not fall by more than STEP_s.
  double pressure_Pa(std::size_t sensor, double t_s);

  // The truth.
  struct Truth {
    double x_mm, y_mm, force_N;
  };
  const std::vector<Truth> &presses() const { return truth_; } // as in the plan; the hold is not there
  // A pull that the rubber shears under: the ball moves by way_mm along it. The thread's moment
  // moves the pressure, and not the tangential force, by the thread's height times the pull over the weight.
  struct TruePull {
    double toward_deg, pull_N, force_N, way_mm;
  };
  const std::vector<TruePull> &pulls() const { return true_pulls_; }
  // What a reading from 0.5 to 1 s after a placement is multiplied by, over the sensors' mean.
  const std::vector<double> &gains() const { return gains_; }        // [sensor]
  const std::vector<std::size_t> &faulty() const { return faulty_; } // sensors
  bool is_absent(std::size_t sensor) const { return absent_[sensor]; }

private:
  struct Touch {
    double begin_s, rests_s;
    std::vector<double> base_Pa;        // [sensor], under the whole weight
    std::vector<double> share;          // [sensor] of it that a loose one measures
    std::vector<double> pulled_Pa = {}; // [sensor] the same when it is pulled; empty: it is not
  };
  void choose_fault();
  void draw_plan();
  void step();
  std::vector<double> base_Pa(double x_mm, double y_mm) const;
  std::vector<double> pulled_Pa(double x_mm, double y_mm, const TruePull &pull) const;
  double width_at(double x_mm, double y_mm) const;
  double way_mm(double pull_N) const;

  static constexpr double STEP_s = 0.005;
  ValidatedOptions options_;
  twin::Layer layer_;
  twin::ContactTable table_;
  std::optional<twin::TractionTable> traction_;
  double weight_N_;
  twin::Pad rubber_;
  std::vector<double> x_mm_, y_mm_;
  double tilt_x_ = 0.0, tilt_y_ = 0.0;     // of the thickness, a share at the outer sensors
  std::vector<std::size_t> faulty_, wire_; // wire_: [sensor] whose pressure it reads
  std::vector<double> deaf_, drift_Pa_s_, gains_;
  std::vector<bool> absent_;
  std::vector<std::pair<double, std::string>> plan_;
  std::vector<Touch> touches_;
  std::vector<Truth> truth_;
  std::vector<TruePull> true_pulls_;
  std::size_t touch_ = 0; // the next or present one
  std::int64_t steps_ = 0;
  std::vector<double> before_Pa_, after_Pa_; // [sensor] at the last two steps
};

} // namespace fingertip::cell
