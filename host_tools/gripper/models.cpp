#include "gripper/feetech.hpp"
#include "libfingertip/text.hpp"

namespace fingertip {

namespace {

/* Strokes, speeds and forces: Robotiq, "2F-85 & 2F-140 Instruction Manual" and "Hand-E Instruction
 * Manual", section Specifications. Steps: stroke over the counts of gPO between the ends, which
 * Robotiq's knowledge base (encoder bytes of the adaptive gripper) gives as 3 and 230 for the
 * 2F-85 and which are taken for the other two. Deadband: Kinova's ros2_kortex, issue 227. Exchange:
 * 200 Hz by the manuals. Latencies are assumptions; no figure is public. */
const std::vector<GripperTraits> &models() {
  static const std::vector<GripperTraits> all = {
      {.model = "2f85",
       .stroke_mm = 85.0,
       .step_mm = 85.0 / 227,
       .deadband_mm = 0.4,
       .speed_min_mm_s = 20.0,
       .speed_max_mm_s = 150.0,
       .force_min_N = 20.0,
       .force_max_N = 235.0,
       .latency_s = 0.025,
       .poll_s = 0.005},
      {.model = "2f140",
       .stroke_mm = 140.0,
       .step_mm = 140.0 / 227,
       .deadband_mm = 0.65,
       .speed_min_mm_s = 30.0,
       .speed_max_mm_s = 250.0,
       .force_min_N = 10.0,
       .force_max_N = 125.0,
       .latency_s = 0.025,
       .poll_s = 0.005},
      {.model = "hande",
       .stroke_mm = 50.0,
       .step_mm = 50.0 / 227,
       .deadband_mm = 0.23,
       .speed_min_mm_s = 20.0,
       .speed_max_mm_s = 150.0,
       .force_min_N = 20.0,
       .force_max_N = 185.0,
       .latency_s = 0.025,
       .poll_s = 0.005},
      feetech_traits("sts3215", Jaw(feetech_way({})), GripperWay().jaw_mm),
  };
  return all;
}

} // namespace

std::vector<GripperTraits> gripper_models() {
  return models();
}

const GripperTraits &gripper_traits(const std::string &model) {
  std::string names;
  for (const GripperTraits &traits : models()) {
    if (traits.model == model) {
      return traits;
    }
    names += (names.empty() ? "" : ", ") + traits.model;
  }
  throw Error(ErrorCode::bad_value,
              "no gripper model " + printable(model) + "; there are " + names);
}

} // namespace fingertip
