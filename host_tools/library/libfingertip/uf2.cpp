#include "libfingertip/uf2.hpp"

#include "libfingertip/error.hpp"

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <utility>

extern "C" {
#include "common/bytes.h"
#include "common/crc32.h"
}

namespace fingertip {

constexpr std::size_t BLOCK_BYTES = 512;
constexpr std::size_t HEAD_BYTES = 32;
constexpr std::size_t PAGE_BYTES = 256;
constexpr std::uint32_t MAGIC_FIRST = 0x0A324655, MAGIC_SECOND = 0x9E5D5157, MAGIC_END = 0x0AB16F30;
constexpr std::uint32_t FAMILY_PRESENT = 0x2000;
constexpr std::uint32_t FAMILY_RP2040 = 0xE48BFF56;
constexpr std::uint32_t FLASH_BASE = 0x10000000;
constexpr std::uint32_t FLASH_BYTES = 2u << 20;
/* After the page of each block: this and the CRC-32 of all pages. */
constexpr char CHECKSUM_MARK[] = "CRC ";

std::uint32_t boot2_crc(const std::uint8_t *bytes, std::size_t length) {
  std::uint32_t crc = 0xFFFFFFFF;
  for (std::size_t i = 0; i < length; i++) {
    crc ^= static_cast<std::uint32_t>(bytes[i]) << 24;
    for (int bit = 0; bit < 8; bit++) {
      crc = crc << 1 ^ (crc & 0x80000000u ? 0x04C11DB7u : 0);
    }
  }
  return crc;
}

/* What follows this mark up to a zero or a blank; cmake/write_build_info.cmake puts it there. */
static std::string after(const std::vector<std::uint8_t> &flash, const std::string &mark) {
  auto at = std::search(flash.begin(), flash.end(), mark.begin(), mark.end());
  if (at == flash.end()) {
    return "";
  }
  at += static_cast<std::ptrdiff_t>(mark.size());
  auto end = std::find_if(at, flash.end(), [](std::uint8_t c) { return c <= ' ' || c > '~'; });
  return std::string(at, end);
}

FirmwareImage firmware_of(const std::string &name, std::vector<std::uint8_t> file) {
  FirmwareImage image;
  image.file = std::move(file);
  std::size_t count = image.file.size() / BLOCK_BYTES;
  auto damaged = [&](std::size_t block, const std::string &what) {
    return Error(ErrorCode::damaged_firmware, name + ": damaged (block " + std::to_string(block) + ": " + what + ")");
  };
  if (image.file.size() < BLOCK_BYTES || bytes_get_u32(image.file.data()) != MAGIC_FIRST) {
    throw Error(ErrorCode::not_firmware, name + ": no UF2 file");
  }
  if (image.file.size() % BLOCK_BYTES != 0) {
    throw damaged(count, "cut off");
  }
  std::vector<std::uint8_t> flash;
  for (std::size_t i = 0; i < count; i++) {
    const std::uint8_t *block = image.file.data() + i * BLOCK_BYTES;
    auto word = [block](std::size_t k) { return bytes_get_u32(block + 4 * k); };
    if (word(0) != MAGIC_FIRST || word(1) != MAGIC_SECOND || word(127) != MAGIC_END) {
      throw damaged(i, "no UF2 block");
    }
    if (!(word(2) & FAMILY_PRESENT) || word(7) != FAMILY_RP2040) {
      char family[16];
      std::snprintf(family, sizeof family, "0x%08x", static_cast<unsigned>(word(7)));
      throw Error(ErrorCode::other_chip, name + ": for another chip (UF2 family " + family + ")");
    }
    if (word(5) != i || word(6) != count) {
      throw damaged(i, "numbered " + std::to_string(word(5)) + " of " + std::to_string(word(6)));
    }
    if (word(4) != PAGE_BYTES || word(3) != FLASH_BASE + i * PAGE_BYTES || (i + 1) * PAGE_BYTES > FLASH_BYTES) {
      throw damaged(i, "not the next page of the flash");
    }
    flash.insert(flash.end(), block + HEAD_BYTES, block + HEAD_BYTES + PAGE_BYTES);
  }
  if (boot2_crc(flash.data(), PAGE_BYTES - 4) != bytes_get_u32(&flash[PAGE_BYTES - 4])) {
    throw damaged(0, "the boot ROM would refuse the second boot stage");
  }
  image.board = after(flash, "fingertip-board=");
  image.version = after(flash, "fingertip-version=");
  image.git_hash = after(flash, "fingertip-git=");
  if (image.board.empty() || image.version.empty() || image.git_hash.empty()) {
    throw Error(ErrorCode::not_firmware, name + ": no Fingertip firmware");
  }
  std::uint32_t crc = crc32_iso_hdlc(flash.data(), flash.size());
  for (std::size_t i = 0; i < count; i++) {
    const std::uint8_t *mark = image.file.data() + i * BLOCK_BYTES + HEAD_BYTES + PAGE_BYTES;
    if (std::memcmp(mark, CHECKSUM_MARK, 4) != 0 || bytes_get_u32(mark + 4) != crc) {
      throw damaged(i, "the CRC of the image differs");
    }
  }
  return image;
}

} // namespace fingertip
