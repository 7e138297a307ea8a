// fingertip_grip_table: prints host_tools/python/fingertip/grip_table.py: settings, grippers, states, troubles, requests.
#include "grasp/gripper/gripper.hpp"
#include "grasp/settings.hpp"
#include "grasp/words.hpp"
#include "libfingertip/text.hpp"

#include <cstdio>

using namespace fingertip;

static void print_settings() {
  std::printf("\n\n@dataclasses.dataclass(frozen=True)\nclass Settings:\n"
              "    \"\"\"None: the default of the gripper. set_N chooses the mode that holds this force.\"\"\"\n\n");
  for (const GraspSetting &setting : grasp_settings()) {
    std::printf("    %s: float | None = None\n    \"\"\"%s; %.10g to %.10g\"\"\"\n", setting.field_name, setting.help,
                setting.low * setting.scale, setting.high * setting.scale);
  }
}

static void print_traits() {
  std::printf("\n\n@dataclasses.dataclass(frozen=True)\nclass Traits:\n"
              "    \"\"\"A gripper of two parallel fingers; lengths and speeds of the width between its pads.\"\"\"\n\n"
              "    stroke_mm: float\n"
              "    step_mm: float\n    \"\"\"of the commanded width\"\"\"\n"
              "    deadband_mm: float\n    \"\"\"moves shorter than this are not made\"\"\"\n"
              "    speed_min_mm_s: float\n    speed_max_mm_s: float\n"
              "    force_min_N: float\n    force_max_N: float\n    \"\"\"of its own limit of force; 0: it has none\"\"\"\n"
              "    latency_s: float\n    \"\"\"from a command to motion\"\"\"\n"
              "    poll_s: float\n    \"\"\"between two answers, at the least\"\"\"\n\n\nTRAITS = {\n");
  for (const GripperTraits &each : gripper_models()) {
    std::printf("    \"%s\": Traits(", each.model.c_str());
    const double values[] = {each.stroke_mm,   each.step_mm,     each.deadband_mm, each.speed_min_mm_s, each.speed_max_mm_s,
                             each.force_min_N, each.force_max_N, each.latency_s,   each.poll_s};
    for (const double &value : values) {
      std::printf("%s%.10g", &value == values ? "" : ", ", value);
    }
    std::printf("),\n");
  }
  std::printf("}\n\"\"\"of the models that the tool drives\"\"\"\n");
}

int main() {
  std::printf("\"\"\"Written by host_tools/grasp/grip_table.cpp; change the tables of host_tools/grasp.\"\"\"\n\n"
              "import dataclasses\nimport enum\n\nfrom .flags import Flags\n");
  print_settings();
  print_traits();
  std::printf("\n\nclass State(enum.IntEnum):\n");
  for (std::uint8_t state = 0; state < GRIP_STATES; state++) {
    std::printf("    %s = %d\n    \"\"\"%s\"\"\"\n", upper(state_name(state)).c_str(), state, state_text(state).c_str());
  }
  std::printf("\n\nclass Trouble(Flags):\n");
  for (std::uint32_t bit = 1; !trouble_names(bit).empty(); bit <<= 1) {
    std::printf("    %s = 0x%X\n", upper(trouble_names(bit)).c_str(), bit);
  }
  std::printf("\n\nclass Request(enum.IntEnum):\n");
  for (std::uint8_t request = 0; request < GRIP_REQUESTS; request++) {
    std::printf("    %s = %d\n", upper(request_name(static_cast<GripRequest>(request))).c_str(), request);
  }
  std::printf("\n\nclass Motion(enum.IntEnum):\n    STAY = %d\n    ACTIVATE = %d\n    MOVE = %d\n", GRIP_STAY, GRIP_ACTIVATE, GRIP_MOVE);
  return 0;
}
