/* Files that are installed with this program, and other programs. */
#pragma once

#include <filesystem>
#include <initializer_list>
#include <optional>
#include <string>
#include <vector>

namespace fingertip {

/* The first of these that exists, as seen from this program's folder: where it is installed, or in the tree that it is built in. */
std::optional<std::filesystem::path> find_installed(std::initializer_list<const char *> places);

/* This program's own path. */
std::filesystem::path this_program();

/* The page that is installed with this program. Throws Error: it is not built. */
std::filesystem::path page_folder();
/* What to do where the page is of another version than the tool; "": both fit, or there is no page. */
std::string page_note(const std::string &tool_version);

/* Another program, a path or one of PATH, takes this one's place. Throws Error; missing: its text
 * where there is no such program, else what the system reports. */
[[noreturn]] void become(const std::string &program, const std::vector<std::string> &arguments, const std::string &missing = "");

/* A command of the Python package, which finds by this program what else is installed, takes this one's place. Throws Error. */
[[noreturn]] void run_in_package(const std::string &name, std::vector<std::string> options);

} // namespace fingertip
