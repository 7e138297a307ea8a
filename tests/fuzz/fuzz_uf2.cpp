// Firmware files: images that are whole but for what the input damages.
#include "fuzz.h"
#include "libfingertip/error.hpp"
#include "libfingertip/uf2.hpp"
#include "memory_file.hpp"

#include <algorithm>

extern "C" {
#include "common/bytes.h"
#include "common/crc32.h"
}

using namespace fingertip;

using Bytes = std::vector<std::uint8_t>;
constexpr std::size_t BLOCK_BYTES = 512, PAGE_BYTES = 256, PAGE_AT = 32;

static Bytes file_of(const Bytes &flash) {
  Bytes file(flash.size() / PAGE_BYTES * BLOCK_BYTES);
  const std::size_t count = flash.size() / PAGE_BYTES;
  const std::uint32_t crc = crc32_iso_hdlc(flash.data(), flash.size());
  for (std::size_t i = 0; i < count; i++) {
    std::uint8_t *block = &file[i * BLOCK_BYTES];
    const auto put = [block](std::size_t word, std::size_t value) { bytes_put_u32(block + 4 * word, static_cast<std::uint32_t>(value)); };
    put(0, 0x0A324655);
    put(1, 0x9E5D5157);
    put(2, 0x2000);
    put(3, 0x10000000 + i * PAGE_BYTES);
    put(4, PAGE_BYTES);
    put(5, i);
    put(6, count);
    put(7, 0xE48BFF56);
    std::copy_n(&flash[i * PAGE_BYTES], PAGE_BYTES, block + PAGE_AT);
    memcpy(block + PAGE_AT + PAGE_BYTES, "CRC ", 4);
    bytes_put_u32(block + PAGE_AT + PAGE_BYTES + 4, crc);
    put(127, 0x0AB16F30);
  }
  return file;
}

static bool is_word(const std::string &text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) { return c > ' ' && c <= '~'; });
}

void fuzz_one(const uint8_t *bytes, size_t length) {
  fuzz_input input = {bytes, bytes + length};
  const std::uint8_t how = fuzz_u8(&input);
  struct Damage {
    std::uint32_t at;
    std::uint8_t bits;
  } damages[3] = {};
  for (Damage &damage : damages) {
    damage = {fuzz_u32(&input), fuzz_u8(&input)};
  }
  Bytes file(input.at, input.end);
  if (how & 1) {
    Bytes flash = std::move(file);
    flash.resize((flash.size() / PAGE_BYTES + 1) * PAGE_BYTES);
    bytes_put_u32(&flash[PAGE_BYTES - 4], boot2_crc(flash.data(), PAGE_BYTES - 4));
    file = file_of(flash);
  }
  bool damaged = false;
  for (const Damage &damage : damages) {
    if (how & 2 && !file.empty()) {
      file[damage.at % file.size()] ^= damage.bits;
      damaged = damaged || damage.bits != 0;
    }
  }
  const fuzz::MemoryFile stored(file.data(), file.size());
  try {
    const FirmwareImage image = read_firmware(stored.path());
    FUZZ_CHECK(image.file == file);
    FUZZ_CHECK(is_word(image.board) && is_word(image.version) && is_word(image.git_hash));
  } catch (const Error &error) {
    // What is whole is refused only for being somebody else's.
    FUZZ_CHECK(!(how & 1) || damaged || error.code() == ErrorCode::not_firmware);
  }
}
