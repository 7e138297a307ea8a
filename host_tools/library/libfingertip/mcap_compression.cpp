/* Chunks packed by zstd. */
#include "libfingertip/mcap.hpp"

#include <zstd.h>

namespace fingertip::mcap {

const char *const COMPRESSION = "zstd";

std::string packed(const std::string &bytes) {
  constexpr int LEVEL = 3;
  std::string packed(ZSTD_compressBound(bytes.size()), '\0');
  std::size_t length = ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), LEVEL);
  if (ZSTD_isError(length)) {
    throw std::runtime_error(std::string("zstd: ") + ZSTD_getErrorName(length));
  }
  packed.resize(length);
  return packed;
}

bool unpack(std::string_view packed, std::string &to) {
  return ZSTD_decompress(to.data(), to.size(), packed.data(), packed.size()) == to.size();
}

} // namespace fingertip::mcap
