#include "libfingertip/line_source.hpp"
#include "libfingertip/uf2.hpp"

namespace fingertip {

FirmwareImage read_firmware(const std::string &path) { return firmware_of(path, all_bytes(path)); }

} // namespace fingertip
