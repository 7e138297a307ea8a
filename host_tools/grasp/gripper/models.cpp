#include "grasp/gripper/feetech.hpp"
#include "grasp/gripper/robotiq.hpp"
#include "libfingertip/text.hpp"

namespace fingertip {

namespace {

/* A gripper, and what drives it. */
struct Model {
  GripperTraits traits;
  std::unique_ptr<Gripper> (*open)(const GripperWay &way);
};

template <typename Driver> Model driven_by(GripperTraits traits) {
  return {std::move(traits),
          [](const GripperWay &way) -> std::unique_ptr<Gripper> { return std::make_unique<Driver>(way); }};
}

/* Strokes, speeds and forces: Robotiq, "2F-85 & 2F-140 Instruction Manual" and "Hand-E Instruction
 * Manual", section Specifications. Steps: stroke over the counts of gPO between the ends, which
 * Robotiq's knowledge base (encoder bytes of the adaptive gripper) gives as 3 and 230 for the
 * 2F-85 and which are taken for the other two. Deadband: Kinova's ros2_kortex, issue 227. Exchange:
 * 200 Hz by the manuals. Latencies are assumptions; no figure is public. */
const std::vector<Model> &models() {
  static const std::vector<Model> all = {
      driven_by<RobotiqGripper>({.model = "2f85",
                                 .stroke_mm = 85.0,
                                 .step_mm = 85.0 / 227,
                                 .deadband_mm = 0.4,
                                 .speed_min_mm_s = 20.0,
                                 .speed_max_mm_s = 150.0,
                                 .force_min_N = 20.0,
                                 .force_max_N = 235.0,
                                 .latency_s = 0.025,
                                 .poll_s = 0.005}),
      driven_by<RobotiqGripper>({.model = "2f140",
                                 .stroke_mm = 140.0,
                                 .step_mm = 140.0 / 227,
                                 .deadband_mm = 0.65,
                                 .speed_min_mm_s = 30.0,
                                 .speed_max_mm_s = 250.0,
                                 .force_min_N = 10.0,
                                 .force_max_N = 125.0,
                                 .latency_s = 0.025,
                                 .poll_s = 0.005}),
      driven_by<RobotiqGripper>({.model = "hande",
                                 .stroke_mm = 50.0,
                                 .step_mm = 50.0 / 227,
                                 .deadband_mm = 0.23,
                                 .speed_min_mm_s = 20.0,
                                 .speed_max_mm_s = 150.0,
                                 .force_min_N = 20.0,
                                 .force_max_N = 185.0,
                                 .latency_s = 0.025,
                                 .poll_s = 0.005}),
      driven_by<FeetechGripper>(feetech_traits("sts3215", Jaw(feetech_way({})), GripperWay().jaw_mm)),
  };
  return all;
}

const Model &model_of(const std::string &name) {
  for (const Model &model : models()) {
    if (model.traits.model == name) {
      return model;
    }
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
