/* Firmware images as cmake/bin2uf2.py writes them: UF2 (https://github.com/microsoft/uf2) for the boot ROM of the
 * RP2040 (its datasheet, 2.8.4). The boot ROM takes any well-formed block without a look at its content. */
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace fingertip {

struct FirmwareImage {
  std::vector<std::uint8_t> file; /* as it goes to the loader's drive */
  std::string board;
  std::string version; /* "0.1.0" */
  std::string git_hash;
};

/* Throws Error unless the file is a whole, undamaged firmware of ours for the RP2040. name: for messages. */
FirmwareImage read_firmware(const std::string &path);
FirmwareImage firmware_of(const std::string &name, std::vector<std::uint8_t> file);
/* CRC-32/MPEG-2, as the boot ROM checks its first page (RP2040 datasheet 2.8.1.3.1). */
std::uint32_t boot2_crc(const std::uint8_t *bytes, std::size_t length);

} // namespace fingertip
