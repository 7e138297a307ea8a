// What decides in a trial.
#pragma once

#include "grasp/control/grip.hpp"

#include <cstddef>

namespace fingertip::cell {

class Controller {
public:
  virtual ~Controller() = default;
  virtual void take_touch(std::size_t finger, const GripTouch &touch) = 0;
  virtual void take_status(const GripperStatus &status) = 0;
  virtual GripReport step(double now_s, GripCommand &command) = 0;
  virtual void ask(GripRequest) {}
};

} // namespace fingertip::cell
