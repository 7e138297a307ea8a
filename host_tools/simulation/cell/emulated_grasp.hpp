// One grasp, closed loop, whose fingertips are emulated boards with their release image: the cell,
// the gripper and the controller go on by slices of emulated time, after each of which the boards'
// bytes are handed over (host_tools/simulation/emulator/lockstep.mjs).
//
// The controller takes what came in a slice at its end, so up to a slice late; all else is at its
// own time.
#pragma once

#include "simulation/cell/controller.hpp"
#include "simulation/cell/emulated_fingertip.hpp"
#include "simulation/cell/gripper_line.hpp"
#include "simulation/cell/kinds.hpp"
#include "simulation/cell/slips.hpp"

#include <deque>
#include <memory>
#include <nlohmann/json.hpp>
#include <vector>

namespace fingertip::cell {

// The gains of a pad's sensors: the true ones and the calibration.
struct CalibratedRubber {
  Pressures gain;
  calibration stored;
};
// Cast pads differ by 8 %, a calibration finds that to 1.2 %: the report's part truth.
CalibratedRubber draw_rubber(const pad_profile &profile, Random &random);

struct EmulatedTrial {
  Object object;
  Grasp grasp;
  KindOfGrasp course; // the lift and the events
  GripperMechanics gripper;
  std::array<CalibratedRubber, 2> rubber;
  std::uint64_t seed = 0; // of the gripper's first exchange
};

class EmulatedGrasp {
public:
  // All must outlive it.
  EmulatedGrasp(const EmulatedTrial &trial, const Face &face, const pad_profile &profile);

  // What a board sent at this time, since the last run().
  void take(std::size_t finger, const std::uint8_t *bytes, std::size_t length, double arrived_s);
  // To the end of the next slice.
  void run(double until_s);
  std::vector<std::uint8_t> to_send(std::size_t finger);
  // The present pressures of the sensors.
  Pressures sensed_Pa(std::size_t finger) const;
  bool over() const { return over_; }

  // What happened, and when, of the first slip after the lift:
  //   begin_s  emulated time
  //   by ms after it: measured_ms the first frame that reported it, sent_ms the packet that left its
  //   chip whole, answered_ms the controller's command, asked_ms on the gripper's line, moved_ms
  //   the fingers, reaction_ms 5 % more force; null: never
  // told_by: "SLIDING", or "load" if a fingertip's load rose by a tenth and 0.1 N.
  nlohmann::ordered_json summary() const;

private:
  struct Report {
    double arrived_s, measured_s;
    std::size_t finger;
    bool slides;
    double load_N;
  };
  struct Change {
    double at_s, width_mm;
  };
  void step_controller();
  void advance(double to_s);
  nlohmann::ordered_json answer_to(const Slip &slip) const;

  const EmulatedTrial &trial_;
  const Face &face_;
  Cell cell_;
  GripperLine gripper_;
  std::array<EmulatedFingertip, 2> fingers_;
  std::unique_ptr<CoreController> controller_; // none before both are ready
  std::deque<GripperLine::Answer> line_;
  GripCommand command_{};
  GripReport report_{};
  Slips slips_;
  double t_s_ = 0.0, holds_s_, lift_s_, asked_s_ = 0.0;
  std::uint32_t trouble_ = 0;
  bool over_ = false, dropped_ = false;
  std::array<std::size_t, 2> frames_{}, loads_{}; // since both are ready
  std::vector<Report> reports_;
  std::vector<Change> commanded_, asked_, moved_;
};

} // namespace fingertip::cell
