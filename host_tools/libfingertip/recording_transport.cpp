#include "libfingertip/recording_transport.hpp"

#include "libfingertip/command.hpp"
#include "libfingertip/error.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>

namespace fingertip {

RecordingTransport::RecordingTransport(const std::string &path, bool salvage,
                                       const std::string &device)
    : path_(path) {
  bytes_.open(path, std::ios::binary);
  std::string start(4096, ' '); /* several frames, each of which would end with 0x00 */
  if (!bytes_ || (!bytes_.read(start.data(), 4096) && !bytes_.eof())) {
    throw Error(path + ": " + std::strerror(errno) + "; check the path");
  }
  start.resize(static_cast<std::size_t>(bytes_.gcount()));
  bytes_.clear();
  bytes_.seekg(0);
  if (start.rfind("# fingertip-", 0) == 0) {
    bytes_.close();
    reader_ = std::make_unique<RecordingReader>(path, salvage, device);
  } else if (!start.empty() && start.find('\0') == std::string::npos) {
    throw Error(path + ": neither a recording nor bytes of a fingertip's line; give a file that "
                       "`fingertip record` wrote");
  }
}

Transport::Result RecordingTransport::read(std::uint8_t *bytes, std::size_t capacity,
                                           std::size_t *length, std::chrono::milliseconds) {
  *length = 0;
  if (ended_ || interrupted_) {
    return Result::gone;
  }
  if (!reader_) {
    bytes_.read(reinterpret_cast<char *>(bytes), static_cast<std::streamsize>(capacity));
    *length = static_cast<std::size_t>(bytes_.gcount());
    ended_ = *length == 0;
    return ended_ ? Result::gone : Result::data;
  }
  while (waiting_.empty()) {
    auto item = reader_->next();
    if (!item) {
      ended_ = true;
      return Result::gone;
    }
    if (item->kind == RecordingReader::Item::Kind::packet) {
      waiting_ = frame_bytes(item->packet);
    } else if (item->event.rfind(EVENT_GONE, 0) == 0) {
      interrupted_ = true;
      return Result::gone;
    }
  }
  *length = std::min(capacity, waiting_.size());
  std::copy_n(waiting_.begin(), *length, bytes);
  waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(*length));
  return Result::data;
}

bool RecordingTransport::write(const std::uint8_t *, std::size_t) {
  return false;
}

bool RecordingTransport::reopen() {
  interrupted_ = false;
  return !ended_;
}

} // namespace fingertip
