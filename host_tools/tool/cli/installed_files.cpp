#include "tool/cli/installed_files.hpp"

#include "libfingertip/error.hpp"
#include "libfingertip/text.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>
#include <unistd.h>

namespace fingertip {

namespace fs = std::filesystem;

static std::optional<fs::path> find_page() { return find_installed({"../share/fingertip/web/index.html", "../../web/page/index.html"}); }

fs::path this_program() {
  std::error_code none;
  return fs::read_symlink("/proc/self/exe", none);
}

std::optional<fs::path> find_installed(std::initializer_list<const char *> places) {
  std::error_code none;
  for (const char *place : places) {
    fs::path path = (this_program().parent_path() / place).lexically_normal();
    if (fs::exists(path, none)) {
      return path;
    }
  }
  return std::nullopt;
}

fs::path page_folder() {
  if (auto page = find_page()) {
    return page->parent_path();
  }
  throw Error("the page is not built; `sh cmake/bootstrap.sh web` in the project's tree builds and serves it");
}

std::string page_note(const std::string &tool_version) {
  const auto page = find_page();
  if (!page) {
    return "";
  }
  /* vite.config.ts writes it. */
  const std::string mark = "<meta name=\"fingertip-version\" content=\"";
  std::ostringstream bytes;
  bytes << std::ifstream(*page).rdbuf();
  const std::string text = bytes.str();
  const std::size_t at = text.find(mark);
  const std::size_t begin = at == std::string::npos ? text.size() : at + mark.size();
  const std::string version = text.substr(begin, text.find('"', begin) - begin);
  if (version == tool_version) {
    return "";
  }
  return "the page beside this tool is of " + (version.empty() ? "an unknown version" : "version " + printable(version)) +
         ", the tool of version " + tool_version + "; install both from one release";
}

void become(const std::string &program, const std::vector<std::string> &arguments, const std::string &missing) {
  std::vector<char *> words = {const_cast<char *>(program.c_str())};
  for (const std::string &argument : arguments) {
    words.push_back(const_cast<char *>(argument.c_str()));
  }
  words.push_back(nullptr);
  execvp(program.c_str(), words.data());
  const int why = errno;
  if (why == ENOENT && !missing.empty()) {
    throw Error(missing);
  }
  throw Error(ErrorCode::cannot_read, program + ": " + std::strerror(why));
}

} // namespace fingertip
