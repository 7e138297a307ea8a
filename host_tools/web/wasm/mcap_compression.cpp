// libfingertip/mcap_compression.hpp for the page: Debian has no zstd for WebAssembly, so it writes
// chunks as they are, and the page unpacks (import fingertip.unpack, of core.mjs).
#include "libfingertip/mcap_compression.hpp"

#include "libfingertip/mcap_reader.hpp"

namespace fingertip::mcap {

extern "C" __attribute__((import_module("fingertip"), import_name("unpack"))) bool
fingertip_unpack(const char *packed, std::size_t packed_bytes, char *to, std::size_t bytes);

const char *const COMPRESSION = "";

std::string compressed(const std::string &bytes) {
  return bytes;
}

std::string unpacked(std::string_view compression, std::string_view packed, std::uint64_t size) {
  constexpr std::uint64_t CHUNK_MOST_bytes = 1 << 26;
  if (compression.empty()) {
    return std::string(packed);
  }
  if (compression != "zstd") {
    throw Damage("compression \"" + std::string(compression.substr(0, 20)) + "\" is unknown");
  }
  if (size > CHUNK_MOST_bytes) {
    throw Damage("a chunk of " + std::to_string(size) + " bytes");
  }
  std::string bytes(static_cast<std::size_t>(size), '\0');
  if (!fingertip_unpack(packed.data(), packed.size(), bytes.data(), bytes.size())) {
    throw Damage("a chunk cannot be unpacked");
  }
  return bytes;
}

} // namespace fingertip::mcap
