#include "libfingertip/mcap_writer.hpp"

#include "libfingertip/little_endian.hpp"
#include "libfingertip/mcap_compression.hpp"
#include "libfingertip/mcap_records.hpp"

#include <algorithm>

extern "C" {
#include "common/crc32.h"
}

namespace fingertip::mcap {

namespace {

constexpr std::size_t CHUNK_bytes = 1 << 20;
constexpr std::uint64_t CHUNK_ns = 1'000'000'000;

void put_text(std::string &bytes, std::string_view text) {
  put_number(bytes, static_cast<std::uint32_t>(text.size()));
  bytes += text;
}

void put_pairs(std::string &bytes, const Pairs &pairs) {
  std::string content;
  for (const auto &[key, value] : pairs) {
    put_text(content, key);
    put_text(content, value);
  }
  put_text(bytes, content);
}

std::string record(Opcode opcode, std::string_view content) {
  std::string bytes(1, static_cast<char>(opcode));
  put_number(bytes, std::uint64_t{content.size()});
  bytes += content;
  return bytes;
}

std::string joined(const std::vector<std::string> &parts) {
  std::string all;
  for (const std::string &part : parts) {
    all += part;
  }
  return all;
}

} // namespace

std::uint32_t crc_of(std::string_view bytes) {
  return crc32_iso_hdlc(reinterpret_cast<const std::uint8_t *>(bytes.data()), bytes.size());
}

void Writer::Span::take(const Span &other) {
  first_ns = std::min(first_ns, other.first_ns);
  last_ns = std::max(last_ns, other.last_ns);
}

void Writer::Span::put(std::string &bytes) const {
  put_number(bytes, first_ns <= last_ns ? first_ns : 0);
  put_number(bytes, last_ns);
}

Writer::Writer(Append append, const std::string &profile, const std::string &library) : append_(std::move(append)) {
  std::string content;
  put_text(content, profile);
  put_text(content, library);
  this->append(std::string(MAGIC, sizeof MAGIC) + record(HEADER, content));
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
  std::string content;
  put_number(content, id);
  put_text(content, name);
  put_text(content, encoding);
  put_text(content, data);
  schemas_.push_back(record(SCHEMA, content));
  append(schemas_.back());
  return id;
}

std::uint16_t Writer::channel(const std::string &topic, std::uint16_t schema, const std::string &encoding,
                              const Pairs &metadata) {
  auto id = static_cast<std::uint16_t>(channels_.size() + 1);
  std::string content;
  put_number(content, id);
  put_number(content, schema);
  put_text(content, topic);
  put_text(content, encoding);
  put_pairs(content, metadata);
  channels_.push_back(record(CHANNEL, content));
  append(channels_.back());
  return id;
}

void Writer::metadata(const std::string &name, const Pairs &pairs) {
  std::string content;
  put_text(content, name);
  put_pairs(content, pairs);
  std::string whole = record(METADATA, content), index;
  put_number(index, append(whole));
  put_number(index, std::uint64_t{whole.size()});
  put_text(index, name);
  metadata_.push_back(record(METADATA_INDEX, index));
}

void Writer::attachment(std::uint64_t time_ns, const std::string &name, const std::string &media_type,
                        const std::string &data) {
  std::string content;
  put_number(content, time_ns);
  put_number(content, time_ns);
  put_text(content, name);
  put_text(content, media_type);
  put_number(content, std::uint64_t{data.size()});
  content += data;
  put_number(content, crc_of(content));
  std::string whole = record(ATTACHMENT, content), index;
  put_number(index, append(whole));
  put_number(index, std::uint64_t{whole.size()});
  put_number(index, time_ns);
  put_number(index, time_ns);
  put_number(index, std::uint64_t{data.size()});
  put_text(index, name);
  put_text(index, media_type);
  attachments_.push_back(record(ATTACHMENT_INDEX, index));
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
  std::string content;
  put_number(content, channel);
  put_number(content, static_cast<std::uint32_t>(counts_[channel]++));
  put_number(content, time_ns);
  put_number(content, time_ns);
  content += data;
  records_ += record(MESSAGE, content);
}

void Writer::end_chunk() {
  if (records_.empty()) {
    return;
  }
  std::string packed = compressed(records_);
  std::string content;
  chunk_span_.put(content);
  put_number(content, std::uint64_t{records_.size()});
  put_number(content, crc_of(records_));
  put_text(content, COMPRESSION);
  put_number(content, std::uint64_t{packed.size()});
  content += packed;
  const std::string chunk = record(CHUNK, content);
  std::string indexes, places;
  for (const auto &[channel, entries] : indexes_) {
    put_number(places, channel);
    put_number(places, length_ + chunk.size() + indexes.size());
    std::string times, index;
    for (const auto &[time_ns, offset] : entries) {
      put_number(times, time_ns);
      put_number(times, offset);
    }
    put_number(index, channel);
    put_text(index, times);
    indexes += record(MESSAGE_INDEX, index);
  }
  const std::string whole = chunk + indexes;
  std::string index;
  chunk_span_.put(index);
  put_number(index, append(whole));
  put_number(index, std::uint64_t{chunk.size()});
  put_text(index, places);
  put_number(index, std::uint64_t{indexes.size()});
  put_text(index, COMPRESSION);
  put_number(index, std::uint64_t{packed.size()});
  put_number(index, std::uint64_t{records_.size()});
  chunks_.push_back(record(CHUNK_INDEX, index));
  span_.take(chunk_span_);
  records_.clear();
  indexes_.clear();
  chunk_span_ = Span();
}

void Writer::finish() {
  end_chunk();
  std::string data_end, counts, statistics;
  put_number(data_end, std::uint32_t{0}); /* no CRC over all of it */
  data_end = record(DATA_END, data_end);
  std::uint64_t messages = 0;
  for (const auto &[channel, count] : counts_) {
    put_number(counts, channel);
    put_number(counts, count);
    messages += count;
  }
  put_number(statistics, messages);
  put_number(statistics, static_cast<std::uint16_t>(schemas_.size()));
  for (const auto *each : {&channels_, &attachments_, &metadata_, &chunks_}) {
    put_number(statistics, static_cast<std::uint32_t>(each->size()));
  }
  span_.put(statistics);
  put_text(statistics, counts);
  const std::uint64_t start = length_ + data_end.size();
  std::string summary, offsets;
  const std::pair<Opcode, std::string> groups[] = {
      {SCHEMA, joined(schemas_)},
      {CHANNEL, joined(channels_)},
      {STATISTICS, record(STATISTICS, statistics)},
      {CHUNK_INDEX, joined(chunks_)},
      {ATTACHMENT_INDEX, joined(attachments_)},
      {METADATA_INDEX, joined(metadata_)},
  };
  for (const auto &[opcode, group] : groups) {
    if (!group.empty()) {
      std::string offset;
      put_number(offset, static_cast<std::uint8_t>(opcode));
      put_number(offset, start + summary.size());
      put_number(offset, std::uint64_t{group.size()});
      offsets += record(SUMMARY_OFFSET, offset);
      summary += group;
    }
  }
  /* The footer's CRC is over all of the summary and the footer before it. */
  constexpr std::uint64_t FOOTER_BYTES = 20;
  std::string end = summary + offsets;
  put_number(end, static_cast<std::uint8_t>(FOOTER));
  put_number(end, FOOTER_BYTES);
  put_number(end, start);
  put_number(end, start + summary.size());
  put_number(end, crc_of(end));
  append(data_end + end + std::string(MAGIC, sizeof MAGIC));
}

} // namespace fingertip::mcap
