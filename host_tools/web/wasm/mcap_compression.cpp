// libfingertip/mcap_compression.cpp for the page: Debian has no zstd for WebAssembly, so it writes
// chunks as they are, and the page unpacks (import fingertip.unpack, of core.mjs).
#include "libfingertip/mcap.hpp"

namespace fingertip::mcap {
extern "C" __attribute__((import_module("fingertip"), import_name("unpack"))) int
fingertip_unpack(const char *packed, std::size_t packed_bytes, char *to, std::size_t bytes);

const char *const COMPRESSION = "";

std::string packed(const std::string &bytes) { return bytes; }

std::optional<std::size_t> unpack(std::string_view packed, std::string &to) {
  const int length = fingertip_unpack(packed.data(), packed.size(), to.data(), to.size());
  return length < 0 ? std::nullopt : std::optional(static_cast<std::size_t>(length));
}

} // namespace fingertip::mcap
