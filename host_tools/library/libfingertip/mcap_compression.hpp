/* How the chunks of MCAP files are packed. */
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace fingertip::mcap {

/* The name in the file of the compression of compressed(). */
extern const char *const COMPRESSION;
std::string compressed(const std::string &bytes);

/* Throws Damage unless size bytes come of it. */
std::string unpacked(std::string_view compression, std::string_view packed, std::uint64_t size);

} // namespace fingertip::mcap
