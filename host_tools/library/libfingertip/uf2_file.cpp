#include "libfingertip/error.hpp"
#include "libfingertip/uf2.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>

namespace fingertip {

FirmwareImage read_firmware(const std::string &path) {
  std::ifstream stream(path, std::ios::binary);
  if (!stream) {
    throw Error(ErrorCode::cannot_read, path + ": " + std::strerror(errno));
  }
  using Bytes = std::istreambuf_iterator<char>;
  return firmware_of(path, std::vector<std::uint8_t>(Bytes(stream), Bytes()));
}

} // namespace fingertip
