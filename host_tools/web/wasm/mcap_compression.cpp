// libfingertip/mcap_compression.cpp for the page: Debian has no zstd for WebAssembly, so it writes
// chunks as they are, and the page unpacks (import fingertip.unpack, of core.mjs).
#include "libfingertip/mcap.hpp"

namespace fingertip::mcap {
extern "C" __attribute__((import_module("fingertip"), import_name("unpack"))) bool
fingertip_unpack(const char *packed, std::size_t packed_bytes, char *to, std::size_t bytes);

const char *const COMPRESSION = "";

std::string packed(const std::string &bytes) { return bytes; }

bool unpack(std::string_view packed, std::string &to) {
  return declared_size(packed).value_or(0) <= to.size() && fingertip_unpack(packed.data(), packed.size(), to.data(), to.size());
}

} // namespace fingertip::mcap
