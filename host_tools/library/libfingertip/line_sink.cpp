#include "libfingertip/line_sink.hpp"

#include "libfingertip/mcap_recording.hpp"

#include <algorithm>
#include <cctype>
#include <utility>

namespace fingertip {

namespace {

class TextLineSink : public LineSink {
public:
  explicit TextLineSink(std::unique_ptr<ByteSink> file) : file_(std::move(file)) {}

  void line(const std::string &text) override { file_->append((text + "\n").data(), text.size() + 1); }
  void finish() override { file_->finish(); }
  const std::string &path() const override { return file_->path(); }

private:
  std::unique_ptr<ByteSink> file_;
};

} // namespace

std::unique_ptr<LineSink> make_lines(std::unique_ptr<ByteSink> bytes, bool as_mcap) {
  if (as_mcap) {
    return std::make_unique<McapLineSink>(std::move(bytes));
  }
  return std::make_unique<TextLineSink>(std::move(bytes));
}

bool is_mcap_name(const std::string &path) {
  std::string end = path.substr(path.size() - std::min<std::size_t>(path.size(), 5));
  std::transform(end.begin(), end.end(), end.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return end == ".mcap";
}

std::unique_ptr<LineSink> make_lines(const std::string &path, bool replace, OutputFile::Appears appears) {
  return make_lines(std::make_unique<OutputFile>(path, replace, appears), is_mcap_name(path));
}

} // namespace fingertip
