#include "gripper/gripper.hpp"
#include "libfingertip/text.hpp"

namespace fingertip {

namespace {

/* Strokes, speeds and forces: Robotiq, "2F-85 & 2F-140 Instruction Manual" and "Hand-E Instruction
 * Manual", section Specifications. Steps: stroke over the counts of gPO between the ends, which
 * Robotiq's knowledge base (encoder bytes of the adaptive gripper) gives as 3 and 230 for the
 * 2F-85 and which are taken for the other two. Deadband: Kinova's ros2_kortex, issue 227. Exchange:
 * 200 Hz by the manuals. Latencies are assumptions; no figure is public.
 *
 * STS3215 on a jaw of 100 mm that turns by a radian (feetech.hpp): 0.088 degrees a count, 45
 * revolutions a minute without load and 1.9 Nm stalled at 7.4 V. */
const GripperTraits MODELS[] = {
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
    {.model = "sts3215",
     .stroke_mm = 96.0,
     .step_mm = 0.153,
     .speed_min_mm_s = 1.0,
     .speed_max_mm_s = 470.0,
     .force_max_N = 19.0,
     .latency_s = 0.008,
     .poll_s = 0.001},
};

} // namespace

std::vector<GripperTraits> gripper_models() {
  return {std::begin(MODELS), std::end(MODELS)};
}

const GripperTraits &gripper_traits(const std::string &model) {
  std::string names;
  for (const GripperTraits &traits : MODELS) {
    if (traits.model == model) {
      return traits;
    }
    names += (names.empty() ? "" : ", ") + traits.model;
  }
  throw Error(ErrorCode::bad_value,
              "no gripper model " + printable(model) + "; there are " + names);
}

} // namespace fingertip
