#include "tool/cli/page.hpp"

#include "libfingertip/error.hpp"
#include "libfingertip/text.hpp"
#include "tool/cli/installed_files.hpp"

#include <fstream>
#include <optional>
#include <sstream>

namespace fingertip {

namespace {

namespace fs = std::filesystem;

std::optional<fs::path> find_page() {
  return find_installed({"../share/fingertip/web/index.html", "../../web/page/index.html"});
}

} // namespace

fs::path page_folder() {
  if (auto page = find_page()) {
    return page->parent_path();
  }
  throw Error("the page is not built; `sh cmake/bootstrap.sh web` in the project's tree builds and "
              "serves it");
}

std::string page_note(const std::string &tool_version) {
  const auto page = find_page();
  if (!page) {
    return "";
  }
  /* vite.config.ts writes it. */
  const std::string mark = "<meta name=\"fingertip-version\" content=\"";
  std::ostringstream bytes;
  bytes << std::ifstream(*page).rdbuf();
  const std::string text = bytes.str();
  const std::size_t at = text.find(mark);
  const std::size_t begin = at == std::string::npos ? text.size() : at + mark.size();
  const std::string version = text.substr(begin, text.find('"', begin) - begin);
  if (version == tool_version) {
    return "";
  }
  return "the page beside this tool is of " +
         (version.empty() ? "an unknown version" : "version " + printable(version)) + ", the tool of version " +
         tool_version + "; install both from one release";
}

} // namespace fingertip
