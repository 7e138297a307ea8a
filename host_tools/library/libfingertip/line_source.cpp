#include "libfingertip/line_source.hpp"

#include "libfingertip/error.hpp"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

namespace fingertip {

namespace {

class FileBytes : public ByteSource {
public:
  explicit FileBytes(const std::string &path) : path_(path), file_(path, std::ios::binary) {
    if (file_ && !std::filesystem::is_regular_file(path)) {
      throw Error(ErrorCode::cannot_read, path + ": is a folder, a device or a pipe, no file");
    }
    file_.seekg(0, std::ios::end);
    size_ = static_cast<std::uint64_t>(file_.tellg());
    check();
  }

  std::size_t read(std::uint64_t at, char *to, std::size_t length) override {
    file_.clear();
    file_.seekg(static_cast<std::streamoff>(at));
    file_.read(to, static_cast<std::streamsize>(length));
    check();
    return static_cast<std::size_t>(file_.gcount());
  }
  std::uint64_t size() const override { return size_; }

private:
  void check() const {
    if (!file_ && !file_.eof()) {
      throw Error(ErrorCode::cannot_read, path_ + ": " + std::strerror(errno));
    }
  }

  std::string path_;
  std::ifstream file_;
  std::uint64_t size_ = 0;
};

} // namespace

std::unique_ptr<ByteSource> open_bytes(const std::string &path) { return std::make_unique<FileBytes>(path); }

std::vector<std::uint8_t> all_bytes(const std::string &path) {
  FileBytes file(path);
  std::vector<std::uint8_t> bytes(file.size());
  bytes.resize(file.read(0, reinterpret_cast<char *>(bytes.data()), bytes.size()));
  return bytes;
}

std::unique_ptr<LineSource> open_lines(const std::string &path) { return lines_of(path, open_bytes(path)); }

} // namespace fingertip
