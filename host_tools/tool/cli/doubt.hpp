/* A contact's warning flags in words. */
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace fingertip {

/* Those of the flags that are warnings. */
std::uint32_t warnings_of(std::uint32_t flags);

/* "UNCERTAIN, may be off by more than 0.6 mm": each that is set. limit_mm: that of UNCERTAIN; 0:
 * not known. */
std::vector<std::string> warnings_in_words(std::uint32_t flags, float limit_mm);

/* Those names alone. */
std::vector<std::string> warning_names(std::uint32_t flags);

} // namespace fingertip
