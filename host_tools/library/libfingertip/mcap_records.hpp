/* Numbers of the MCAP format, and its checksum. */
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace fingertip::mcap {

inline constexpr char MAGIC[8] = {'\x89', 'M', 'C', 'A', 'P', '0', '\r', '\n'};
inline constexpr std::size_t RECORD_HEAD_BYTES = 9; /* opcode and length */

enum Opcode : std::uint8_t {
  HEADER = 1,
  FOOTER,
  SCHEMA,
  CHANNEL,
  MESSAGE,
  CHUNK,
  MESSAGE_INDEX,
  CHUNK_INDEX,
  ATTACHMENT,
  ATTACHMENT_INDEX,
  STATISTICS,
  METADATA,
  METADATA_INDEX,
  SUMMARY_OFFSET,
  DATA_END,
};

std::uint32_t crc_of(std::string_view bytes);

} // namespace fingertip::mcap
