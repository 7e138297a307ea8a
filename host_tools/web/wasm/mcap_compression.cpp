// libfingertip/mcap_compression.cpp for the page: Debian has no zstd for WebAssembly, so it writes
// chunks as they are, and the page unpacks (import fingertip.unpack, of core.mjs).
#include "libfingertip/mcap.hpp"

#include <optional>

namespace fingertip::mcap {
namespace {

/* The content size that a zstd frame declares (RFC 8878, 3.1.1.1), which the page does not compare;
 * none: it declares none. */
std::optional<std::uint64_t> declared_size(std::string_view frame) {
  constexpr std::size_t MAGIC_bytes = 4, DICTIONARY_bytes[] = {0, 1, 2, 4};
  const auto byte = [&](std::size_t at) -> std::uint64_t {
    return at < frame.size() ? static_cast<unsigned char>(frame[at]) : 0;
  };
  const std::uint64_t descriptor = byte(MAGIC_bytes), width = descriptor >> 6;
  const bool is_single = (descriptor >> 5 & 1) != 0;
  if (width == 0 && !is_single) {
    return std::nullopt;
  }
  const std::size_t begin = MAGIC_bytes + 1 + !is_single + DICTIONARY_bytes[descriptor & 3];
  std::uint64_t size = width == 1 ? 256 : 0;
  for (std::size_t i = 0; i < std::size_t{1} << width; i++) {
    size += byte(begin + i) << (8 * i);
  }
  return size;
}

} // namespace

extern "C" __attribute__((import_module("fingertip"), import_name("unpack"))) bool
fingertip_unpack(const char *packed, std::size_t packed_bytes, char *to, std::size_t bytes);

const char *const COMPRESSION = "";

std::string packed(const std::string &bytes) { return bytes; }

bool unpack(std::string_view packed, std::string &to) {
  return declared_size(packed).value_or(to.size()) == to.size() &&
         fingertip_unpack(packed.data(), packed.size(), to.data(), to.size());
}

} // namespace fingertip::mcap
