/* Writes MCAP files (mcap.dev/spec): chunks compressed by zstd, each with its index. A chunk is
 * appended at once, so that a killed writer leaves every chunk except the one under way. */
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace fingertip::mcap {

using Pairs = std::vector<std::pair<std::string, std::string>>;

class Writer {
public:
  using Append = std::function<void(const std::string &bytes)>;

  /* append may throw; what it threw for is not in the file. */
  Writer(Append append, const std::string &profile, const std::string &library);

  /* Their ids. */
  std::uint16_t schema(const std::string &name, const std::string &encoding, const std::string &data);
  std::uint16_t channel(const std::string &topic, std::uint16_t schema, const std::string &encoding,
                        const Pairs &metadata);

  /* Times are ns since 1970. */
  void metadata(const std::string &name, const Pairs &pairs);
  void attachment(std::uint64_t time_ns, const std::string &name, const std::string &media_type,
                  const std::string &data);
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
    void put(std::string &bytes) const;
  };
  using Index = std::vector<std::pair<std::uint64_t, std::uint64_t>>; /* time, offset in the chunk */

  std::uint64_t append(const std::string &bytes);

  Append append_;
  std::uint64_t length_ = 0;
  std::vector<std::string> schemas_, channels_, attachments_, metadata_, chunks_;
  std::map<std::uint16_t, std::uint64_t> counts_; /* of messages, by channel */
  Span span_;

  std::string records_; /* of the chunk under way */
  std::map<std::uint16_t, Index> indexes_;
  Span chunk_span_;
  std::uint64_t chunk_begin_ns_ = 0;
};

} // namespace fingertip::mcap
