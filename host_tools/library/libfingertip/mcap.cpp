#include "libfingertip/mcap.hpp"

#include "libfingertip/error.hpp"
#include "libfingertip/little_endian.hpp"
#include "libfingertip/text.hpp"

#include <algorithm>

extern "C" {
#include "common/crc32.h"
}

namespace fingertip::mcap {

namespace {

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

constexpr std::size_t CHUNK_bytes = 1 << 20;
constexpr std::uint64_t CHUNK_ns = 1'000'000'000;

struct Raw { /* without its length */
  std::string_view bytes;
};

template <typename Number> std::enable_if_t<std::is_arithmetic_v<Number>> put(std::string &bytes, Number number) {
  put_number(bytes, number);
}
void put(std::string &bytes, Raw raw) { bytes += raw.bytes; }
void put(std::string &bytes, std::string_view text) {
  put_number(bytes, static_cast<std::uint32_t>(text.size()));
  bytes += text;
}

template <typename... Fields> std::string bytes_of(const Fields &...fields) {
  std::string bytes;
  (put(bytes, fields), ...);
  return bytes;
}

template <typename... Fields> std::string record(Opcode opcode, const Fields &...fields) {
  const std::string content = bytes_of(fields...);
  return bytes_of(static_cast<std::uint8_t>(opcode), std::uint64_t{content.size()}, Raw{content});
}

std::string text_of(const Pairs &pairs) {
  std::string content;
  for (const auto &[key, value] : pairs) {
    content += bytes_of(key, value);
  }
  return content;
}

std::uint32_t crc_of(std::string_view bytes) { return crc32_iso_hdlc(reinterpret_cast<const std::uint8_t *>(bytes.data()), bytes.size()); }

/* Largest chunk and record; they bound the memory that a false size costs. Recorders of cameras write some 100 MB. */
constexpr std::uint64_t CHUNK_MOST_bytes = 1 << 28, RECORD_MOST_bytes = CHUNK_MOST_bytes + (1 << 16);

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
  std::string_view rest() const { return bytes_; }
  std::string_view take(std::uint64_t length) {
    if (length > bytes_.size()) {
      throw Damage("a record ends within a field");
    }
    std::string_view taken = bytes_.substr(0, length);
    bytes_.remove_prefix(length);
    return taken;
  }

private:
  std::string_view bytes_;
};

/* One more block of an LZ4 frame, to at most this size (lz4_Block_format.md of github.com/lz4/lz4). Throws Damage. */
void unpack_lz4_block(std::string_view block, std::string &bytes, std::uint64_t size) {
  constexpr std::size_t LONG = 15, MATCH_LEAST = 4;
  Fields fields(block);
  const auto length = [&](std::size_t begin) {
    for (std::uint8_t more = begin == LONG ? 255 : 0; more == 255; begin += more) {
      more = fields.get<std::uint8_t>();
    }
    return begin;
  };
  while (!fields.rest().empty()) {
    const auto token = fields.get<std::uint8_t>();
    bytes += fields.take(length(token >> 4));
    if (fields.rest().empty()) {
      return; /* the last sequence has no match */
    }
    const std::size_t back = fields.get<std::uint16_t>(), count = length(token & LONG) + MATCH_LEAST;
    if (back == 0 || back > bytes.size() || count > size - std::min<std::uint64_t>(size, bytes.size())) {
      throw Damage("a chunk cannot be unpacked");
    }
    for (std::size_t i = 0; i < count; i++) { /* may overlap */
      bytes += bytes[bytes.size() - back];
    }
  }
}

/* The content of an LZ4 frame (lz4_Frame_format.md), whose own checksums are left to the chunk's. Throws Damage. */
std::string unpacked_lz4(std::string_view frame, std::uint64_t size) {
  constexpr std::uint32_t BEGIN = 0x184D2204, IS_PLAIN = 1u << 31;
  enum : std::uint8_t { HAS_DICTIONARY = 1, HAS_SIZE = 8, HAS_BLOCK_CHECKSUMS = 16 };
  Fields fields(frame);
  if (fields.get<std::uint32_t>() != BEGIN) {
    throw Damage("a chunk cannot be unpacked");
  }
  const auto flags = fields.get<std::uint8_t>();
  fields.take(1u + (flags & HAS_SIZE ? 8u : 0u) + (flags & HAS_DICTIONARY ? 4u : 0u) + 1u);
  std::string bytes;
  while (const auto length = fields.get<std::uint32_t>()) {
    const std::string_view block = fields.take(length & ~IS_PLAIN);
    if (length & IS_PLAIN) {
      bytes += block;
    } else {
      unpack_lz4_block(block, bytes, size);
    }
    fields.take(flags & HAS_BLOCK_CHECKSUMS ? 4 : 0);
  }
  return bytes;
}

std::string unpacked(std::string_view compression, std::string_view packed, std::uint64_t size) {
  if (compression.empty()) {
    return std::string(packed);
  }
  if (size > CHUNK_MOST_bytes) {
    throw Damage("a chunk of " + std::to_string(size) + " bytes");
  }
  if (compression == "lz4") {
    return unpacked_lz4(packed, size);
  }
  if (compression != "zstd") {
    throw Damage("compression \"" + std::string(compression.substr(0, 20)) + "\" is unknown");
  }
  std::string bytes(static_cast<std::size_t>(size), '\0');
  if (unpack(packed, bytes) != size) {
    throw Damage("a chunk cannot be unpacked");
  }
  return bytes;
}

} // namespace

void Writer::Span::take(const Span &other) {
  first_ns = std::min(first_ns, other.first_ns);
  last_ns = std::max(last_ns, other.last_ns);
}

std::string Writer::Span::bytes() const { return bytes_of(first_ns <= last_ns ? first_ns : 0, last_ns); }

Writer::Writer(Append append, const std::string &profile, const std::string &library) : append_(std::move(append)) {
  this->append(std::string(MAGIC, sizeof MAGIC) + record(HEADER, profile, library));
}

/* Where it begins. */
std::uint64_t Writer::append(const std::string &bytes) {
  append_(bytes);
  std::uint64_t at = length_;
  length_ += bytes.size();
  return at;
}

std::uint16_t Writer::schema(const std::string &name, const std::string &encoding, const std::string &data) {
  auto id = static_cast<std::uint16_t>(schemas_.size() + 1);
  schemas_.push_back(record(SCHEMA, id, name, encoding, data));
  append(schemas_.back());
  return id;
}

std::uint16_t Writer::channel(const std::string &topic, std::uint16_t schema, const std::string &encoding, const Pairs &metadata) {
  auto id = static_cast<std::uint16_t>(channels_.size() + 1);
  channels_.push_back(record(CHANNEL, id, schema, topic, encoding, text_of(metadata)));
  append(channels_.back());
  return id;
}

void Writer::metadata(const std::string &name, const Pairs &pairs) {
  const std::string whole = record(METADATA, name, text_of(pairs));
  metadata_.push_back(record(METADATA_INDEX, append(whole), std::uint64_t{whole.size()}, name));
}

void Writer::message(std::uint16_t channel, std::uint64_t time_ns, std::string_view data) {
  std::uint64_t passed_ns = time_ns > chunk_begin_ns_ ? time_ns - chunk_begin_ns_ : chunk_begin_ns_ - time_ns;
  if (!records_.empty() && (records_.size() >= CHUNK_bytes || passed_ns >= CHUNK_ns)) {
    end_chunk();
  }
  if (records_.empty()) {
    chunk_begin_ns_ = time_ns;
  }
  chunk_span_.take({time_ns, time_ns});
  indexes_[channel].emplace_back(time_ns, records_.size());
  records_ += record(MESSAGE, channel, static_cast<std::uint32_t>(counts_[channel]++), time_ns, time_ns, Raw{data});
}

void Writer::end_chunk() {
  if (records_.empty()) {
    return;
  }
  const std::string chunk_bytes = packed(records_);
  const std::uint64_t size = records_.size(), packed_size = chunk_bytes.size();
  const std::string span = chunk_span_.bytes();
  const std::string chunk = record(CHUNK, Raw{span}, size, crc_of(records_), COMPRESSION, packed_size, Raw{chunk_bytes});
  std::string indexes, places;
  for (const auto &[channel, entries] : indexes_) {
    places += bytes_of(channel, length_ + chunk.size() + indexes.size());
    std::string times;
    for (const auto &[time_ns, offset] : entries) {
      times += bytes_of(time_ns, offset);
    }
    indexes += record(MESSAGE_INDEX, channel, times);
  }
  const std::uint64_t at = append(chunk + indexes), chunk_size = chunk.size(), indexes_size = indexes.size();
  chunks_.push_back(record(CHUNK_INDEX, Raw{span}, at, chunk_size, places, indexes_size, COMPRESSION, packed_size, size));
  span_.take(chunk_span_);
  records_.clear();
  indexes_.clear();
  chunk_span_ = Span();
}

void Writer::finish() {
  end_chunk();
  const std::string data_end = record(DATA_END, std::uint32_t{0}); /* no CRC over all of it */
  std::string counts;
  std::uint64_t messages = 0;
  for (const auto &[channel, count] : counts_) {
    counts += bytes_of(channel, count);
    messages += count;
  }
  const auto count = [](const auto &all) { return static_cast<std::uint32_t>(all.size()); };
  const std::string statistics = record(STATISTICS, messages, static_cast<std::uint16_t>(schemas_.size()), count(channels_),
                                        std::uint32_t{0} /* attachments */, count(metadata_), count(chunks_), Raw{span_.bytes()}, counts);
  const std::uint64_t start = length_ + data_end.size();
  std::string summary, offsets;
  const std::pair<Opcode, std::string> groups[] = {
      {SCHEMA, joined(schemas_, "")},     {CHANNEL, joined(channels_, "")},        {STATISTICS, statistics},
      {CHUNK_INDEX, joined(chunks_, "")}, {METADATA_INDEX, joined(metadata_, "")},
  };
  for (const auto &[opcode, group] : groups) {
    if (!group.empty()) {
      offsets += record(SUMMARY_OFFSET, static_cast<std::uint8_t>(opcode), start + summary.size(), std::uint64_t{group.size()});
      summary += group;
    }
  }
  /* The footer's CRC is over all of the summary and the footer before it. */
  constexpr std::uint64_t FOOTER_BYTES = 20;
  std::string end = summary + offsets + bytes_of(static_cast<std::uint8_t>(FOOTER), FOOTER_BYTES, start, start + summary.size());
  put_number(end, crc_of(end));
  append(data_end + end + std::string(MAGIC, sizeof MAGIC));
}

bool Reader::next(Message &message) {
  if (!has_index_) {
    read_index();
    has_index_ = true;
  }
  while (at_message_ == messages_.size()) {
    if (!read_record()) {
      return false;
    }
  }
  message = messages_[at_message_++];
  return true;
}

bool Reader::knows(const std::string &type) const {
  return std::any_of(channels_.begin(), channels_.end(), [&](const auto &each) { return each.second.type == type; });
}

/* A sound index at the end has all channels, and the order of chunks by time, if they are in another one. Changes
 * nothing of what a second call needs where the source throws. */
void Reader::read_index() {
  constexpr std::size_t FOOTER_bytes = 20, END_bytes = RECORD_HEAD_BYTES + FOOTER_bytes + sizeof MAGIC;
  constexpr std::uint64_t SUMMARY_MOST_bytes = 1 << 28;
  const std::uint64_t size = bytes_->size();
  if (size < sizeof MAGIC + END_bytes) {
    return;
  }
  const std::uint64_t footer = size - END_bytes;
  if (!summary_) {
    char end[END_bytes];
    const bool is_whole = bytes_->read(footer, end, sizeof end) == sizeof end && end[0] == FOOTER &&
                          std::equal(std::begin(MAGIC), std::end(MAGIC), end + END_bytes - sizeof MAGIC);
    summary_ = is_whole ? number_at<std::uint64_t>({end, sizeof end}, RECORD_HEAD_BYTES) : 0;
  }
  if (*summary_ < sizeof MAGIC || *summary_ >= footer || footer - *summary_ > SUMMARY_MOST_bytes) {
    return;
  }
  std::string summary(footer - *summary_ + RECORD_HEAD_BYTES + FOOTER_bytes, '\0');
  if (bytes_->read(*summary_, summary.data(), summary.size()) < summary.size()) {
    return;
  }
  const std::string_view all = summary;
  const auto crc = number_at<std::uint32_t>(all, all.size() - 4);
  if (crc != 0 && crc != crc_of(all.substr(0, all.size() - 4))) {
    return;
  }
  try {
    for (Fields records(all); !records.rest().empty();) {
      const auto opcode = records.get<std::uint8_t>();
      const std::string_view content = records.text<std::uint64_t>();
      Fields fields(content);
      if (opcode == SCHEMA || opcode == CHANNEL) {
        judge(opcode, content, 1);
      } else if (opcode == CHUNK_INDEX) {
        const auto begin_ns = fields.get<std::uint64_t>();
        fields.get<std::uint64_t>(); /* the end */
        const auto at = fields.get<std::uint64_t>();
        fields.get<std::uint64_t>(); /* the length */
        if (at >= *summary_) {
          throw Damage("a chunk behind all");
        }
        Span &span = spans_[static_cast<std::streamoff>(at)] = {begin_ns, {}};
        for (Fields channels(fields.text()); !channels.rest().empty(); channels.get<std::uint64_t>()) {
          span.channels.push_back(channels.get<std::uint16_t>());
        }
      }
    }
  } catch (const Damage &) {
    schemas_.clear();
    channels_.clear();
    spans_.clear();
    return;
  }
  std::vector<std::pair<std::uint64_t, std::streamoff>> by_time;
  std::vector<std::streamoff> ends; /* of what is read in a row: from a chunk to the next one in the file */
  for (const auto &[at, span] : spans_) {
    by_time.emplace_back(span.begin_ns, at);
    ends.push_back(at);
  }
  ends.push_back(static_cast<std::streamoff>(*summary_));
  if (std::is_sorted(by_time.begin(), by_time.end())) {
    return;
  }
  std::sort(by_time.begin(), by_time.end());
  by_time.emplace_back(0, ends.back());
  after_[ends[0]] = by_time[0].second;
  for (std::size_t i = 0; i + 1 < by_time.size(); i++) {
    after_[*std::upper_bound(ends.begin(), ends.end(), by_time[i].second)] = by_time[i + 1].second;
  }
}

void Reader::want(std::uint64_t from_ns, std::uint64_t to_ns, IsNeeded is_needed) {
  from_ns_ = from_ns;
  to_ns_ = to_ns;
  is_needed_ = std::move(is_needed);
}

/* The chunk that is read. */
bool Reader::is_left_out() const {
  const auto found = spans_.find(record_);
  if (!is_needed_ || found == spans_.end()) {
    return false;
  }
  char own[2 * sizeof(std::uint64_t)]; /* its times, where the index is wrong */
  const bool has_own = bytes_->read(static_cast<std::uint64_t>(record_) + RECORD_HEAD_BYTES, own, sizeof own) == sizeof own;
  const std::string_view times(own, sizeof own);
  return has_own && (number_at<std::uint64_t>(times, sizeof own / 2) < from_ns_ || number_at<std::uint64_t>(times, 0) > to_ns_) &&
         std::none_of(found->second.channels.begin(), found->second.channels.end(), [&](std::uint16_t id) {
           const auto channel = channels_.find(id);
           return channel == channels_.end() || is_needed_(channel->second.topic, channel->second.type);
         });
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
    torn_ = left > 0 && !is_behind_; /* a killed writer leaves whole chunks */
    ended_ = true;
    return false;
  }
  auto opcode = static_cast<std::uint8_t>(head[0]);
  auto length = number_at<std::uint64_t>({head, sizeof head}, 1);
  if (length > left - sizeof head) {
    torn_ = !is_behind_;
    ended_ = true;
    return false;
  }
  auto end = record_ + static_cast<std::streamoff>(sizeof head + length);
  if (opcode == FOOTER && is_behind_) {
    char behind[sizeof MAGIC];
    const auto begin = static_cast<std::uint64_t>(end) + sizeof MAGIC;
    const bool is_whole = size >= begin + sizeof behind && bytes_->read(begin, behind, sizeof behind) == sizeof behind;
    ended_ = true;
    if (is_whole && std::equal(std::begin(MAGIC), std::end(MAGIC), behind)) {
      throw Damage("byte " + std::to_string(begin) + ": another MCAP file begins; head -c " + std::to_string(begin) + " and tail -c +" +
                   std::to_string(begin + 1) + " take them apart");
    }
    return false;
  }
  const auto summary = static_cast<std::streamoff>(summary_.value_or(0));
  end = opcode == DATA_END && !after_.empty() ? summary : end;
  const auto within = after_.upper_bound(record_);
  if (within != after_.end() && within->first < end) {
    after_.clear(); /* it would lead round in circles */
  }
  const auto jump = after_.find(end);
  const auto next = jump == after_.end() ? end : jump->second;
  const auto go_on = [&] {
    next_ = next;
    is_behind_ = is_behind_ || (after_.empty() ? opcode == DATA_END : next == summary);
  };
  if (is_behind_ || (opcode != SCHEMA && opcode != CHANNEL && opcode != MESSAGE && opcode != CHUNK)) {
    go_on();
    return true;
  }
  if (opcode == CHUNK && is_left_out()) {
    has_left_out_ = true;
    go_on();
    return true;
  }
  if (length > RECORD_MOST_bytes) {
    go_on();
    record_ = next;
    throw Damage("byte " + std::to_string(at) + ": a record of " + std::to_string(length) + " bytes");
  }
  std::string content(length, '\0');
  const bool whole = bytes_->read(at + sizeof head, content.data(), content.size()) == length;
  go_on();
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
    const std::string_view name = fields.text(); /* "package/msg/Name"; some writers leave the middle out */
    schemas_[id] = std::string(name.substr(0, name.find('/'))) + std::string(name.substr(std::min(name.rfind('/'), name.size())));
  } else if (opcode == CHANNEL) {
    auto id = fields.get<std::uint16_t>();
    auto schema = fields.get<std::uint16_t>();
    Channel channel;
    channel.topic = fields.text();
    fields.text(); /* encoding */
    channel.type = schemas_[schema];
    channels_[id] = channel;
  } else if (opcode == MESSAGE) {
    auto channel = channels_.find(fields.get<std::uint16_t>());
    if (channel == channels_.end()) {
      throw Damage("a message on an unknown channel");
    }
    fields.get<std::uint32_t>(); /* sequence */
    const auto time_ns = fields.get<std::uint64_t>();
    fields.get<std::uint64_t>(); /* of publishing */
    const Channel &found = channel->second;
    messages_.push_back({found.topic, found.type, std::string(fields.rest()), time_ns});
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
  ended_ = torn_ = is_behind_ = false;
  messages_.clear();
  at_message_ = 0;
  if (place.message > 0) {
    read_record();
    at_message_ = std::min(place.message, messages_.size());
  }
}

} // namespace fingertip::mcap
