/* Numbers as bytes, the lowest first, as MCAP and CDR have them. */
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>

namespace fingertip {

template <std::size_t SIZE> struct BitsOf;
template <> struct BitsOf<1> { using Type = std::uint8_t; };
template <> struct BitsOf<2> { using Type = std::uint16_t; };
template <> struct BitsOf<4> { using Type = std::uint32_t; };
template <> struct BitsOf<8> { using Type = std::uint64_t; };

template <typename Number> void put_number(std::string &bytes, Number value) {
  typename BitsOf<sizeof value>::Type bits;
  std::memcpy(&bits, &value, sizeof bits);
  for (std::size_t i = 0; i < sizeof bits; i++) {
    bytes += static_cast<char>(bits >> (8 * i) & 0xFF);
  }
}

/* There are as many bytes as it takes. */
template <typename Number> Number number_at(std::string_view bytes, std::size_t at) {
  typename BitsOf<sizeof(Number)>::Type bits = 0;
  for (std::size_t i = 0; i < sizeof bits; i++) {
    bits = static_cast<decltype(bits)>(bits | std::uint64_t{static_cast<unsigned char>(bytes[at + i])} << (8 * i));
  }
  Number value;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

} // namespace fingertip
