/* Files that are installed with this program. */
#pragma once

#include <filesystem>
#include <initializer_list>
#include <optional>

namespace fingertip {

/* The first of these that exists, as seen from this program's folder: where it is installed, or in
 * the tree that it is built in. */
std::optional<std::filesystem::path> beside(std::initializer_list<const char *> places);

} // namespace fingertip
