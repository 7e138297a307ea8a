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

std::optional<std::size_t> unpack(std::string_view packed, std::string &to) {
  const std::size_t length = ZSTD_decompress(to.data(), to.size(), packed.data(), packed.size());
  return ZSTD_isError(length) ? std::nullopt : std::optional(length);
}

} // namespace fingertip::mcap
