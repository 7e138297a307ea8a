#include "gripper/feetech.hpp"
#include "gripper/robotiq.hpp"

namespace fingertip {

std::unique_ptr<Gripper> open_gripper(const GripperWay &way) {
  if (gripper_traits(way.model).model == "sts3215") {
    return std::make_unique<FeetechGripper>(way);
  }
  return std::make_unique<RobotiqGripper>(way);
}

} // namespace fingertip
