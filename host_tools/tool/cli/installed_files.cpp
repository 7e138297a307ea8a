#include "tool/cli/installed_files.hpp"

#include "libfingertip/error.hpp"

#include <cerrno>
#include <cstring>
#include <unistd.h>

namespace fingertip {

namespace fs = std::filesystem;

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
