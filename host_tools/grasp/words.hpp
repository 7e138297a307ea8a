// The core's states and troubles as words: short ones for recordings, sentences for people.
#pragma once

#include "grasp/control/grip.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace fingertip {

// "slipping"
std::string state_name(std::uint8_t state);
std::optional<std::uint8_t> state_of_name(std::string_view name);
// "holding, the object slides"
std::string state_text(std::uint8_t state);
// Final states, in which nothing goes on by itself: open, dropped, missed, fault.
bool is_end_state(std::uint8_t state);

// "hand_over"
const char *request_name(GripRequest request);
std::optional<GripRequest> request_of_name(std::string_view name);

// "finger_0_stale at_cap"; "" for none
std::string trouble_names(std::uint32_t trouble);
// Nothing where a word is none of them.
std::optional<std::uint32_t> trouble_of_names(std::string_view names);
// One for each bit of a report's; finger 0 is called left, 1 right. With the numbers that they are about.
std::vector<std::string> trouble_texts(const GripReport &report);

} // namespace fingertip
