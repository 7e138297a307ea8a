#include "grasp/gripper/feetech.hpp"
#include "grasp/gripper/robotiq_urcap.hpp"
#include "libfingertip/text.hpp"

namespace fingertip {

namespace {

struct Range {
  double low, high;
};

GripperTraits robotiq_traits(const char *model, double stroke_mm, double deadband_mm, Range speed_mm_s, Range force_N) {
  constexpr double LATENCY_s = 0.025, POLL_s = 0.005;
  return {{stroke_mm, stroke_mm / 227, deadband_mm, speed_mm_s.low, speed_mm_s.high, force_N.low, force_N.high, LATENCY_s, POLL_s}, model};
}

} // namespace

/* Strokes, speeds and forces: Robotiq, "2F-85 & 2F-140 Instruction Manual" and "Hand-E Instruction Manual", section
 * Specifications. Steps: stroke over the counts of gPO between the ends, which Robotiq's knowledge base (encoder bytes
 * of the adaptive gripper) gives as 3 and 230 for the 2F-85 and which are taken for the other two. Deadband: Kinova's
 * ros2_kortex, issue 227. Exchange: 200 Hz by the manuals. Latencies are assumptions; no figure is public. */
const std::vector<GripperTraits> &gripper_models() {
  static const std::vector<GripperTraits> all = {
      robotiq_traits("2f85", 85.0, 0.4, {20.0, 150.0}, {20.0, 235.0}),
      robotiq_traits("2f140", 140.0, 0.65, {30.0, 250.0}, {10.0, 125.0}),
      robotiq_traits("hande", 50.0, 0.23, {20.0, 150.0}, {20.0, 185.0}),
      feetech_traits("sts3215", feetech_way({})),
  };
  return all;
}

std::string gripper_model_names() {
  return joined(gripper_models(), ", ", [](const GripperTraits &traits) { return traits.model; });
}

const GripperTraits &gripper_traits(const std::string &model) {
  if (const GripperTraits *found = find_in(gripper_models(), [&](const GripperTraits &traits) { return traits.model == model; })) {
    return *found;
  }
  throw Error(ErrorCode::bad_value, "no gripper model " + printable(model) + "; there are " + gripper_model_names());
}

std::unique_ptr<Gripper> open_gripper(const GripperWay &way) {
  if (gripper_traits(way.model).driver == GripperDriver::feetech) {
    return std::make_unique<FeetechGripper>(way);
  }
  if (RobotiqUrcap::has(way.port)) {
    return std::make_unique<RobotiqUrcap>(way);
  }
  return std::make_unique<RobotiqGripper>(way);
}

} // namespace fingertip
