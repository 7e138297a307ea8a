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

// The controller of grasp/control, grasping from the first step on.
class CoreController : public Controller {
public:
  CoreController(const GripSettings &settings, const GripperTraits &traits) : core_(settings, traits) {
    core_.request(GRIP_REQUEST_GRASP);
  }
  void take_touch(std::size_t finger, const GripTouch &touch) override { core_.take(finger, touch); }
  void take_status(const GripperStatus &status) override { core_.take(status); }
  GripReport step(double now_s, GripCommand &command) override { return core_.step(now_s, command); }
  void ask(GripRequest request) override { core_.request(request); }

private:
  Grip core_;
};

} // namespace fingertip::cell
