#include "grasp/words.hpp"

#include "libfingertip/text.hpp"

namespace fingertip {

namespace {

struct State {
  const char *name, *text;
};
constexpr State STATES[GRIP_STATES] = {
    {"idle", "idle, the width stays"},
    {"activating", "the gripper is being activated"},
    {"approach", "closing until both fingertips feel the object"},
    {"squeeze", "squeezing up to the first force"},
    {"ready", "squeezed; the present load counts as zero"},
    {"holding", "holding"},
    {"slipping", "holding, the object slides"},
    {"placing", "holding until a table has the load, then opening"},
    {"handing", "holding until it is pulled, then opening"},
    {"still", "the width stays, nothing is controlled"},
    {"release", "opening"},
    {"open", "open"},
    {"dropped", "nothing is between the fingertips any more; the width stays"},
    {"missed", "closed, and nothing was there"},
    {"fault", "fault; the width stays"},
};

constexpr const char *REQUESTS[GRIP_REQUESTS] = {"grasp", "hold", "release", "place", "hand_over"};

struct Trouble {
  GripTrouble bit;
  const char *name, *text;
};
constexpr Trouble TROUBLES[] = {
    {GRIP_FINGER_0_STALE, "finger_0_stale", "left: no frames"},
    {GRIP_FINGER_1_STALE, "finger_1_stale", "right: no frames"},
    {GRIP_FINGER_0_FROZEN, "finger_0_frozen", "left: its values never change"},
    {GRIP_FINGER_1_FROZEN, "finger_1_frozen", "right: its values never change"},
    {GRIP_FINGER_0_FORCE_ONLY, "finger_0_force_only", "left: reports force only"},
    {GRIP_FINGER_1_FORCE_ONLY, "finger_1_force_only", "right: reports force only"},
    {GRIP_FINGER_0_OVER, "finger_0_over", "left: beyond its range, not tightened further"},
    {GRIP_FINGER_1_OVER, "finger_1_over", "right: beyond its range, not tightened further"},
    {GRIP_FINGERS_DIFFER, "fingers_differ", "the fingertips' forces differ"},
    {GRIP_AT_CAP, "at_cap", "more force than the cap is wanted"},
    {GRIP_AT_TRAVEL_CAP, "at_travel_cap", "closed as far as the travel cap allows"},
    {GRIP_GRIPPER_SILENT, "gripper_silent", "the gripper does not answer"},
    {GRIP_GRIPPER_FAULT, "gripper_fault", "the gripper reports a fault"},
    {GRIP_GRIPPER_INACTIVE, "gripper_inactive", "the gripper is not active"},
    {GRIP_NO_LOAD, "no_load", "no load can be estimated"},
    {GRIP_FINGER_0_NO_FORCE, "finger_0_no_force", "left: no force can be estimated"},
    {GRIP_FINGER_1_NO_FORCE, "finger_1_no_force", "right: no force can be estimated"},
    {GRIP_FINGER_0_LATE, "finger_0_late", "left: late"},
    {GRIP_FINGER_1_LATE, "finger_1_late", "right: late"},
    {GRIP_FINGER_0_EMPTY, "finger_0_empty", "left: reports nothing, while the other is pressed"},
    {GRIP_FINGER_1_EMPTY, "finger_1_empty", "right: reports nothing, while the other is pressed"},
    {GRIP_NO_GRIP, "no_grip", "squeezed, and less than half of the wanted force has come"},
};

} // namespace

std::string state_name(std::uint8_t state) { return state < GRIP_STATES ? STATES[state].name : std::to_string(state); }

std::optional<std::uint8_t> state_of_name(std::string_view name) {
  const State *found = find_in(STATES, [&](const State &state) { return name == state.name; });
  return found ? std::optional(static_cast<std::uint8_t>(found - STATES)) : std::nullopt;
}

std::string state_text(std::uint8_t state) { return state < GRIP_STATES ? STATES[state].text : std::to_string(state); }

bool is_end_state(std::uint8_t state) { return state == GRIP_OPEN || state == GRIP_DROPPED || state == GRIP_MISSED || state == GRIP_FAULT; }

const char *request_name(GripRequest request) { return REQUESTS[request]; }

std::optional<GripRequest> request_of_name(std::string_view name) {
  const auto *found = find_in(REQUESTS, [&](const char *each) { return name == each; });
  return found ? std::optional(static_cast<GripRequest>(found - REQUESTS)) : std::nullopt;
}

std::string trouble_names(std::uint32_t trouble) {
  return joined(TROUBLES, " ", [&](const Trouble &each) { return (trouble & each.bit) != 0 ? each.name : ""; });
}

std::optional<std::uint32_t> trouble_of_names(std::string_view names) {
  std::uint32_t trouble = 0;
  for (const std::string_view name : split(names, ' ')) {
    const Trouble *found = find_in(TROUBLES, [&](const Trouble &each) { return name == each.name; });
    if (!found && !names.empty()) {
      return std::nullopt;
    }
    trouble |= found ? std::uint32_t{found->bit} : 0u;
  }
  return trouble;
}

std::vector<std::string> trouble_texts(const GripReport &report) {
  std::vector<std::string> texts;
  for (const Trouble &each : TROUBLES) {
    if ((report.trouble & each.bit) == 0) {
      continue;
    }
    std::string text = each.text;
    if (each.bit == GRIP_FINGERS_DIFFER) {
      text += ", " + fixed(report.finger_N[0], 1) + " and " + fixed(report.finger_N[1], 1) +
              " N: let the object move freely between them, or fingertip calibrate";
    } else if (each.bit == GRIP_FINGER_0_LATE || each.bit == GRIP_FINGER_1_LATE) {
      text += " by " + fixed(1e3 * report.delay_s, 0) + " ms";
    }
    texts.push_back(text);
  }
  return texts;
}

} // namespace fingertip
