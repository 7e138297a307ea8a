#include "grasp/gripper/feetech.hpp"
#include "grasp/gripper/robotiq_urcap.hpp"
#include "libfingertip/text.hpp"

namespace fingertip {

namespace {

/* A gripper, and what drives it. */
struct Model {
  GripperTraits traits;
  std::unique_ptr<Gripper> (*open)(const GripperWay &way);
};

template <typename Driver> std::unique_ptr<Gripper> driven_by(const GripperWay &way) { return std::make_unique<Driver>(way); }

std::unique_ptr<Gripper> open_robotiq(const GripperWay &way) {
  return RobotiqUrcap::has(way.port) ? driven_by<RobotiqUrcap>(way) : driven_by<RobotiqGripper>(way);
}

struct Range {
  double low, high;
};

Model robotiq_traits(const char *model, double stroke_mm, double deadband_mm, Range speed_mm_s, Range force_N) {
  constexpr double LATENCY_s = 0.025, POLL_s = 0.005;
  return {{{stroke_mm, stroke_mm / 227, deadband_mm, speed_mm_s.low, speed_mm_s.high, force_N.low, force_N.high, LATENCY_s, POLL_s}, model},
          open_robotiq};
}

/* Strokes, speeds and forces: Robotiq, "2F-85 & 2F-140 Instruction Manual" and "Hand-E Instruction Manual", section
 * Specifications. Steps: stroke over the counts of gPO between the ends, which Robotiq's knowledge base (encoder bytes
 * of the adaptive gripper) gives as 3 and 230 for the 2F-85 and which are taken for the other two. Deadband: Kinova's
 * ros2_kortex, issue 227. Exchange: 200 Hz by the manuals. Latencies are assumptions; no figure is public. */
const std::vector<Model> &models() {
  static const std::vector<Model> all = {
      robotiq_traits("2f85", 85.0, 0.4, {20.0, 150.0}, {20.0, 235.0}),
      robotiq_traits("2f140", 140.0, 0.65, {30.0, 250.0}, {10.0, 125.0}),
      robotiq_traits("hande", 50.0, 0.23, {20.0, 150.0}, {20.0, 185.0}),
      {feetech_traits("sts3215", feetech_way({})), driven_by<FeetechGripper>},
  };
  return all;
}

const Model &model_of(const std::string &name) {
  if (const Model *found = find_in(models(), [&](const Model &model) { return model.traits.model == name; })) {
    return *found;
  }
  throw Error(ErrorCode::bad_value, "no gripper model " + printable(name) + "; there are " + gripper_model_names());
}

} // namespace

std::vector<GripperTraits> gripper_models() {
  std::vector<GripperTraits> all;
  for (const Model &model : models()) {
    all.push_back(model.traits);
  }
  return all;
}

std::string gripper_model_names() {
  return joined(models(), ", ", [](const Model &model) { return model.traits.model; });
}

const GripperTraits &gripper_traits(const std::string &model) { return model_of(model).traits; }

std::unique_ptr<Gripper> open_gripper(const GripperWay &way) { return model_of(way.model).open(way); }

} // namespace fingertip
