#include "libfingertip/mcap_compression.hpp"

#include "libfingertip/mcap_reader.hpp"

#include <stdexcept>
#include <zstd.h>

namespace fingertip::mcap {

namespace {

constexpr int LEVEL = 3;
/* Largest chunk; it bounds the memory that a false size costs. Others write up to some MB. */
constexpr std::uint64_t CHUNK_MOST_bytes = 1 << 26;

} // namespace

const char *const COMPRESSION = "zstd";

std::string compressed(const std::string &bytes) {
  std::string packed(ZSTD_compressBound(bytes.size()), '\0');
  std::size_t length = ZSTD_compress(packed.data(), packed.size(), bytes.data(), bytes.size(), LEVEL);
  if (ZSTD_isError(length)) {
    throw std::runtime_error(std::string("zstd: ") + ZSTD_getErrorName(length));
  }
  packed.resize(length);
  return packed;
}

std::string unpacked(std::string_view compression, std::string_view packed, std::uint64_t size) {
  if (compression.empty()) {
    return std::string(packed);
  }
  if (compression != "zstd") {
    throw Damage("compression \"" + std::string(compression.substr(0, 20)) + "\" is unknown");
  }
  if (size > CHUNK_MOST_bytes) {
    throw Damage("a chunk of " + std::to_string(size) + " bytes");
  }
  unsigned long long declared = ZSTD_getFrameContentSize(packed.data(), packed.size());
  if (declared != size && declared != ZSTD_CONTENTSIZE_UNKNOWN) {
    throw Damage("a chunk's length is wrong");
  }
  std::string bytes(size, '\0');
  std::size_t length = ZSTD_decompress(bytes.data(), bytes.size(), packed.data(), packed.size());
  if (ZSTD_isError(length) || length != size) {
    throw Damage("a chunk cannot be unpacked");
  }
  return bytes;
}

} // namespace fingertip::mcap
