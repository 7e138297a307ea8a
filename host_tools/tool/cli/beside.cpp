#include "tool/cli/beside.hpp"

namespace fingertip {

std::optional<std::filesystem::path> beside(std::initializer_list<const char *> places) {
  namespace fs = std::filesystem;
  std::error_code none;
  const fs::path bin = fs::read_symlink("/proc/self/exe", none).parent_path();
  for (const char *place : places) {
    fs::path path = (bin / place).lexically_normal();
    if (fs::exists(path, none)) {
      return path;
    }
  }
  return std::nullopt;
}

} // namespace fingertip
