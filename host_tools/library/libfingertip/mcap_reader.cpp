#include "libfingertip/mcap_reader.hpp"

#include "libfingertip/little_endian.hpp"
#include "libfingertip/mcap_compression.hpp"

#include <algorithm>
#include <utility>

namespace fingertip::mcap {

namespace {

/* Largest record; it bounds the memory that a false size costs. Others write chunks of up to some MB. */
constexpr std::uint64_t RECORD_MOST_bytes = (1 << 26) + (1 << 16);

/* The fields of a record's content. */
class Fields {
public:
  explicit Fields(std::string_view bytes) : bytes_(bytes) {}

  template <typename Number> Number get() {
    std::string_view bytes = take(sizeof(Number));
    return number_at<Number>(bytes, 0);
  }
  template <typename Length = std::uint32_t> std::string_view text() {
    auto length = get<Length>();
    return take(length);
  }
  std::string_view rest() { return take(bytes_.size()); }

private:
  std::string_view take(std::uint64_t length) {
    if (length > bytes_.size()) {
      throw Damage("a record ends within a field");
    }
    std::string_view taken = bytes_.substr(0, length);
    bytes_.remove_prefix(length);
    return taken;
  }
  std::string_view bytes_;
};

} // namespace

Reader::Reader(std::unique_ptr<ByteSource> bytes) : bytes_(std::move(bytes)) {}

bool Reader::next(Message &message) {
  while (at_message_ == messages_.size()) {
    if (!read_record()) {
      return false;
    }
  }
  message = messages_[at_message_++];
  return true;
}

/* False at the end. Changes nothing where the source throws. */
bool Reader::read_record() {
  messages_.clear();
  at_message_ = 0;
  record_ = next_;
  if (ended_) {
    return false;
  }
  const auto at = static_cast<std::uint64_t>(record_);
  const std::uint64_t size = bytes_->size(), left = size > at ? size - at : 0;
  char head[RECORD_HEAD_BYTES];
  if (left < sizeof head || bytes_->read(at, head, sizeof head) < sizeof head) {
    torn_ = left > 0; /* a killed writer leaves whole chunks */
    ended_ = true;
    return false;
  }
  auto opcode = static_cast<std::uint8_t>(head[0]);
  auto length = number_at<std::uint64_t>({head, sizeof head}, 1);
  if (length > left - sizeof head) {
    torn_ = ended_ = true;
    return false;
  }
  const auto next = record_ + static_cast<std::streamoff>(sizeof head + length);
  if (opcode == DATA_END) {
    next_ = next;
    ended_ = true;
    return false;
  }
  if (opcode != SCHEMA && opcode != CHANNEL && opcode != MESSAGE && opcode != CHUNK) {
    next_ = next;
    return true;
  }
  if (length > RECORD_MOST_bytes) {
    next_ = next;
    record_ = next;
    throw Damage("byte " + std::to_string(at) + ": a record of " + std::to_string(length) + " bytes");
  }
  std::string content(length, '\0');
  const bool whole = bytes_->read(at + sizeof head, content.data(), content.size()) == length;
  next_ = next;
  try {
    if (!whole) {
      throw Damage("it cannot be read");
    }
    judge(opcode, content, 0);
  } catch (const Damage &damage) {
    messages_.clear();
    record_ = next_;
    throw Damage("byte " + std::to_string(at) + ": " + damage.what());
  }
  return true;
}

void Reader::judge(std::uint8_t opcode, std::string_view content, int depth) {
  Fields fields(content);
  if (opcode == SCHEMA) {
    auto id = fields.get<std::uint16_t>();
    schemas_[id] = fields.text();
  } else if (opcode == CHANNEL) {
    auto id = fields.get<std::uint16_t>();
    auto schema = fields.get<std::uint16_t>();
    Channel channel;
    channel.topic = fields.text();
    channel.encoding = fields.text();
    channel.type = schemas_[schema];
    channels_[id] = channel;
  } else if (opcode == MESSAGE) {
    auto channel = channels_.find(fields.get<std::uint16_t>());
    if (channel == channels_.end()) {
      throw Damage("a message on an unknown channel");
    }
    fields.get<std::uint32_t>(); /* sequence */
    fields.get<std::uint64_t>(); /* times */
    fields.get<std::uint64_t>();
    const Channel &found = channel->second;
    messages_.push_back({found.topic, found.type, found.encoding, std::string(fields.rest())});
  } else if (opcode == CHUNK && depth == 0) {
    read_chunk(content);
  }
}

void Reader::read_chunk(std::string_view content) {
  Fields fields(content);
  fields.get<std::uint64_t>(); /* times */
  fields.get<std::uint64_t>();
  auto size = fields.get<std::uint64_t>();
  auto crc = fields.get<std::uint32_t>();
  std::string_view compression = fields.text();
  std::string_view packed = fields.text<std::uint64_t>();
  const std::string records = unpacked(compression, packed, size);
  if (records.size() != size || (crc != 0 && crc_of(records) != crc)) {
    throw Damage("a chunk's CRC is wrong");
  }
  std::string_view rest = records;
  while (!rest.empty()) {
    Fields record(rest);
    auto opcode = record.get<std::uint8_t>();
    std::string_view inner = record.text<std::uint64_t>();
    judge(opcode, inner, 1);
    rest.remove_prefix(RECORD_HEAD_BYTES + inner.size());
  }
}

void Reader::go_to(const Place &place) {
  next_ = place.offset;
  ended_ = torn_ = false;
  messages_.clear();
  at_message_ = 0;
  if (place.message > 0) {
    read_record();
    at_message_ = std::min(place.message, messages_.size());
  }
}

} // namespace fingertip::mcap
