#include "libfingertip/line_source.hpp"

#include "libfingertip/error.hpp"
#include "libfingertip/mcap_recording.hpp"

#include <cerrno>
#include <cstring>
#include <fstream>

namespace fingertip {

namespace {

class TextLines : public LineSource {
public:
  explicit TextLines(const std::string &path) : file_(path, std::ios::binary) {
    if (!file_) {
      throw Error(ErrorCode::cannot_read, path + ": " + std::strerror(errno));
    }
  }

  bool next(Line &line) override {
    if (!std::getline(file_, line.text)) {
      return false;
    }
    line.number = ++number_;
    line.torn = file_.eof();
    return true;
  }
  Place place() override {
    file_.clear(); /* of the end */
    return {file_.tellg(), 0, number_};
  }
  void go_to(const Place &place) override {
    file_.clear();
    file_.seekg(place.offset);
    number_ = place.number;
  }

private:
  std::ifstream file_;
  std::uint64_t number_ = 0;
};

class FileBytes : public ByteSource {
public:
  explicit FileBytes(const std::string &path) : file_(path, std::ios::binary) {
    file_.seekg(0, std::ios::end);
    size_ = static_cast<std::uint64_t>(file_.tellg());
    if (!file_) {
      throw Error(ErrorCode::cannot_read, path + ": " + std::strerror(errno));
    }
  }

  std::size_t read(std::uint64_t at, char *to, std::size_t length) override {
    file_.clear();
    file_.seekg(static_cast<std::streamoff>(at));
    file_.read(to, static_cast<std::streamsize>(length));
    return static_cast<std::size_t>(file_.gcount());
  }
  std::uint64_t size() const override { return size_; }

private:
  std::ifstream file_;
  std::uint64_t size_ = 0;
};

} // namespace

bool is_mcap(const std::string &path) {
  std::ifstream file(path, std::ios::binary);
  char begin[sizeof mcap::MAGIC];
  return file.read(begin, sizeof begin) && std::memcmp(begin, mcap::MAGIC, sizeof begin) == 0;
}

std::unique_ptr<LineSource> open_lines(const std::string &path) {
  if (is_mcap(path)) {
    return std::make_unique<McapLineSource>(path, std::make_unique<FileBytes>(path));
  }
  return std::make_unique<TextLines>(path);
}

} // namespace fingertip
