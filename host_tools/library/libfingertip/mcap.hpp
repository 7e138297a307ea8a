/* MCAP files (mcap.dev/spec). The writer packs chunks by zstd, each with its index. It appends a chunk at once, so that a killed one leaves
 * every chunk except the one under way. The reader gives messages in the order in which they are in the file, so that one whose end is
 * missing reads as far as it goes; chunks that are in another order than that of time it reads by the index. */
#pragma once

#include "libfingertip/line_source.hpp"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <ios>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace fingertip::mcap {

inline constexpr char MAGIC[8] = {'\x89', 'M', 'C', 'A', 'P', '0', '\r', '\n'};
inline constexpr std::size_t RECORD_HEAD_BYTES = 9; /* opcode and length */

/* How chunks are packed: mcap_compression.cpp here, another file in the page. */
extern const char *const COMPRESSION; /* of packed(), its name in the file */
std::string packed(const std::string &bytes);
/* All frames of zstd in it; how many bytes come of them, or nothing where they are damaged, or `to` has no room for all. */
std::optional<std::size_t> unpack(std::string_view packed, std::string &to);

using Pairs = std::vector<std::pair<std::string, std::string>>;

class Writer {
public:
  using Append = std::function<void(const std::string &bytes)>;

  /* append may throw; what it threw for is not in the file. */
  Writer(Append append, const std::string &profile, const std::string &library);

  /* Their ids. */
  std::uint16_t schema(const std::string &name, const std::string &encoding, const std::string &data);
  std::uint16_t channel(const std::string &topic, std::uint16_t schema, const std::string &encoding, const Pairs &metadata);

  /* Times are ns since 1970. */
  void metadata(const std::string &name, const Pairs &pairs);
  /* Ends the chunk before it once that is a second long or a megabyte large. */
  void message(std::uint16_t channel, std::uint64_t time_ns, std::string_view data);
  /* Content until now outlives the writer. */
  void end_chunk();
  /* Last of all. */
  void finish();

private:
  struct Span {
    std::uint64_t first_ns = UINT64_MAX, last_ns = 0;
    void take(const Span &other);
    std::string bytes() const;
  };
  using Index = std::vector<std::pair<std::uint64_t, std::uint64_t>>; /* time, offset in the chunk */

  std::uint64_t append(const std::string &bytes);

  Append append_;
  std::uint64_t length_ = 0;
  std::vector<std::string> schemas_, channels_, metadata_, chunks_;
  std::map<std::uint16_t, std::uint64_t> counts_; /* of messages, by channel */
  Span span_;

  std::string records_; /* of the chunk under way */
  std::map<std::uint16_t, Index> indexes_;
  Span chunk_span_;
  std::uint64_t chunk_begin_ns_ = 0;
};

/* What is wrong, and where; reading goes on behind it. */
struct Damage : std::runtime_error {
  using std::runtime_error::runtime_error;
};

class Reader {
public:
  struct Message {
    std::string topic, type; /* the name of its schema */
    std::string data;
    std::uint64_t time_ns;
  };
  using IsNeeded = std::function<bool(const std::string &topic, const std::string &type)>;
  struct Place {
    std::streamoff offset = 0;
    std::size_t message = 0; /* messages between the offset and the position */
  };

  explicit Reader(std::unique_ptr<ByteSource> bytes) : bytes_(std::move(bytes)) {}

  /* False at the end. Throws Damage. */
  bool next(Message &message);
  /* The last one, and those that were read together with it. */
  const std::vector<Message> &together() const { return messages_; }
  /* Whether a channel has it. */
  bool knows(const std::string &type) const;
  /* From now on chunks outside of these times are left out, if there is an index, unless a needed channel is in them. */
  void want(std::uint64_t from_ns, std::uint64_t to_ns, IsNeeded is_needed);
  /* Whether one was, since this was asked. */
  bool has_left_out() { return std::exchange(has_left_out_, false); }
  /* Whether the file breaks off; known at its end. */
  bool is_torn() const { return torn_; }

  Place place() const { return {record_, at_message_}; }
  void go_to(const Place &place);

private:
  struct Channel {
    std::string topic, type;
  };

  /* The messages and the channels in the record. Throws Damage. */
  void judge(std::uint8_t opcode, std::string_view content, int depth);
  void read_chunk(std::string_view content);
  bool read_record();
  void read_index();
  bool is_left_out() const;

  std::unique_ptr<ByteSource> bytes_;
  std::streamoff record_ = sizeof MAGIC; /* the one whose messages wait */
  std::streamoff next_ = sizeof MAGIC;
  std::vector<Message> messages_;
  std::size_t at_message_ = 0;
  bool torn_ = false;
  bool ended_ = false;
  bool has_index_ = false;                         /* it was read, if there is one */
  std::optional<std::uint64_t> summary_;           /* where it begins, once that is known; 0: there is none */
  bool is_behind_ = false;                         /* behind the data */
  std::map<std::streamoff, std::streamoff> after_; /* from a chunk's place to that of another, by time; empty: as in the file */
  struct Span {
    std::uint64_t begin_ns;
    std::vector<std::uint16_t> channels;
  };
  std::map<std::streamoff, Span> spans_; /* of chunks, by the index */
  std::uint64_t from_ns_ = 0, to_ns_ = UINT64_MAX;
  IsNeeded is_needed_;
  bool has_left_out_ = false;
  std::map<std::uint16_t, std::string> schemas_; /* their names */
  std::map<std::uint16_t, Channel> channels_;
};

} // namespace fingertip::mcap
