#include "libfingertip/line_sink.hpp"

#include "libfingertip/mcap_recording.hpp"

#include <algorithm>
#include <cctype>

namespace fingertip {

namespace {

class TextLineSink : public LineSink {
public:
  TextLineSink(const std::string &path, bool replace, OutputFile::Appears appears)
      : file_(path, replace, appears) {}

  void line(const std::string &text) override { torn_line(text + "\n"); }
  void torn_line(const std::string &text) override { file_.append(text.data(), text.size()); }
  void finish() override { file_.finish(); }
  const std::string &path() const override { return file_.path(); }

private:
  OutputFile file_;
};

} // namespace

bool is_mcap_name(const std::string &path) {
  std::string end = path.substr(path.size() - std::min<std::size_t>(path.size(), 5));
  std::transform(end.begin(), end.end(), end.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return end == ".mcap";
}

std::unique_ptr<LineSink> make_lines(const std::string &path, bool replace,
                                     OutputFile::Appears appears) {
  if (is_mcap_name(path)) {
    return std::make_unique<McapLineSink>(path, replace, appears);
  }
  return std::make_unique<TextLineSink>(path, replace, appears);
}

} // namespace fingertip
