/* Reads the messages of MCAP files (mcap.dev/spec) in the order in which they were written, from
 * the beginning and without the index, so that a file whose end is missing reads as far as it goes.
 */
#pragma once

#include "libfingertip/bytes.hpp"
#include "libfingertip/mcap_records.hpp"

#include <cstdint>
#include <ios>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace fingertip::mcap {

/* What is wrong, and where; reading goes on behind it. */
struct Damage : std::runtime_error {
  using std::runtime_error::runtime_error;
};

class Reader {
public:
  struct Message {
    std::string topic;
    std::string type; /* the name of its schema */
    std::string encoding;
    std::string data;
  };
  struct Place {
    std::streamoff offset = 0;
    std::size_t message = 0; /* messages between the offset and the position */
  };

  explicit Reader(std::unique_ptr<ByteSource> bytes);

  /* False at the end. Throws Damage. */
  bool next(Message &message);
  /* At the end: whether the file breaks off. */
  bool is_torn() const { return torn_; }

  Place place() const { return {record_, at_message_}; }
  void go_to(const Place &place);

private:
  struct Channel {
    std::string topic, encoding, type;
  };

  /* The messages and the channels in the record. Throws Damage. */
  void judge(std::uint8_t opcode, std::string_view content, int depth);
  void read_chunk(std::string_view content);
  bool read_record();

  std::unique_ptr<ByteSource> bytes_;
  std::streamoff record_ = sizeof MAGIC; /* the one whose messages wait */
  std::streamoff next_ = sizeof MAGIC;
  std::vector<Message> messages_;
  std::size_t at_message_ = 0;
  bool torn_ = false;
  bool ended_ = false;
  std::map<std::uint16_t, std::string> schemas_; /* their names */
  std::map<std::uint16_t, Channel> channels_;
};

} // namespace fingertip::mcap
