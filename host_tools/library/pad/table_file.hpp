// Tables that take long to solve, kept in a folder: floats, each table in a file of its own.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace fingertip::twin {

class TableFile {
public:
  // key: all that the numbers depend on. name: what a user sees of it.
  TableFile(const std::filesystem::path &directory, const std::string &name, std::string key);

  // Reads as many as `values` holds. False, with undefined values, if there is no such table or it is damaged.
  bool read(std::vector<float> &values) const;
  // Whole or not at all. Throws std::filesystem::filesystem_error or std::runtime_error.
  void write(const std::vector<float> &values) const;

private:
  std::filesystem::path path_;
  std::string key_;
};

// Where the tables of a user are kept, by default: fingertip/contact-tables in XDG_CACHE_HOME or ~/.cache.
std::filesystem::path default_cache_directory();

} // namespace fingertip::twin
