/* The page that is installed with this program. */
#pragma once

#include <filesystem>
#include <string>

namespace fingertip {

/* Throws Error: it is not built. */
std::filesystem::path page_folder();

/* What to do where the page is of another version than the tool; "" where both fit, or there is no
 * page. */
std::string page_note(const std::string &tool_version);

} // namespace fingertip
