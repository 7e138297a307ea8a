/* CDR as ROS 2 serializes its messages: little-endian, every number aligned to its own size,
 * counted from behind the four bytes of the encapsulation header. */
#pragma once

#include "libfingertip/little_endian.hpp"

#include <limits>

namespace fingertip {

class CdrWriter {
public:
  template <typename Number, typename = std::enable_if_t<std::is_arithmetic_v<Number>>> void put(Number value) {
    align(sizeof value);
    put_number(bytes_, value);
  }
  void put(bool value) { put(static_cast<std::uint8_t>(value)); }
  void put(std::string_view text) {
    put(static_cast<std::uint32_t>(text.size() + 1));
    bytes_ += text;
    bytes_ += '\0';
  }
  void put(const char *text) { put(std::string_view(text)); }
  void count(std::size_t elements) { put(static_cast<std::uint32_t>(elements)); }

  const std::string &bytes() const { return bytes_; }

private:
  void align(std::size_t size) {
    std::size_t over = (bytes_.size() - HEAD_BYTES) % size;
    bytes_.append(over ? size - over : 0, '\0');
  }

  static constexpr std::size_t HEAD_BYTES = 4;
  std::string bytes_{"\0\1\0\0", HEAD_BYTES};
};

/* What is read beyond the end is zero, and is_good false. */
class CdrReader {
public:
  explicit CdrReader(std::string_view bytes) : bytes_(bytes) {
    good_ = bytes.substr(0, HEAD_BYTES) == std::string_view("\0\1\0\0", HEAD_BYTES);
  }

  template <typename Number> void get(Number &value) {
    std::size_t over = (at_ - HEAD_BYTES) % sizeof value;
    at_ += over ? sizeof value - over : 0;
    good_ = good_ && at_ <= bytes_.size() && bytes_.size() - at_ >= sizeof value;
    value = good_ ? number_at<Number>(bytes_, at_) : Number{};
    at_ += sizeof value;
  }
  void get(bool &value) {
    std::uint8_t byte;
    get(byte);
    value = byte != 0;
  }
  void get(std::string &text) {
    std::uint32_t length;
    get(length);
    good_ = good_ && length >= 1 && length <= bytes_.size() - at_;
    text = good_ ? bytes_.substr(at_, length - 1) : std::string_view();
    at_ += good_ ? length : 0;
  }

  bool is_good() const { return good_; }

private:
  static constexpr std::size_t HEAD_BYTES = 4;
  std::string_view bytes_;
  std::size_t at_ = HEAD_BYTES;
  bool good_;
};

} // namespace fingertip
