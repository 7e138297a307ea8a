#include "library/pad/table_file.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <unistd.h>
#include <utility>

namespace fingertip::twin {

static std::uint64_t fnv1a(const void *data, std::size_t length) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (std::size_t i = 0; i < length; i++) {
    hash = (hash ^ static_cast<const unsigned char *>(data)[i]) * 0x100000001b3u;
  }
  return hash;
}

// A file holds the key, the values, and a hash of both.
TableFile::TableFile(const std::filesystem::path &directory, const std::string &name, std::string key) : key_(std::move(key)) {
  char hash[24];
  std::snprintf(hash, sizeof hash, "-%016llx", static_cast<unsigned long long>(fnv1a(key_.data(), key_.size())));
  path_ = directory / (name + hash + ".table");
}

bool TableFile::read(std::vector<float> &values) const {
  const std::size_t value_bytes = values.size() * sizeof(float);
  std::vector<char> file(key_.size() + value_bytes + sizeof(std::uint64_t));
  std::ifstream in(path_, std::ios::binary);
  if (!in.read(file.data(), static_cast<std::streamsize>(file.size()))) {
    return false;
  }
  std::uint64_t hash = 0;
  std::memcpy(&hash, file.data() + key_.size() + value_bytes, sizeof hash);
  std::memcpy(values.data(), file.data() + key_.size(), value_bytes);
  return std::equal(key_.begin(), key_.end(), file.begin()) && hash == fnv1a(file.data(), key_.size() + value_bytes);
}

void TableFile::write(const std::vector<float> &values) const {
  const std::size_t value_bytes = values.size() * sizeof(float);
  std::vector<char> file(key_.size() + value_bytes + sizeof(std::uint64_t));
  std::copy(key_.begin(), key_.end(), file.begin());
  std::memcpy(file.data() + key_.size(), values.data(), value_bytes);
  const std::uint64_t hash = fnv1a(file.data(), key_.size() + value_bytes);
  std::memcpy(file.data() + key_.size() + value_bytes, &hash, sizeof hash);
  std::filesystem::create_directories(path_.parent_path());
  const std::filesystem::path temporary = path_.string() + "." + std::to_string(getpid());
  std::ofstream out(temporary, std::ios::binary);
  out.write(file.data(), static_cast<std::streamsize>(file.size()));
  out.close();
  if (!out) {
    std::filesystem::remove(temporary);
    throw std::runtime_error("cannot write " + temporary.string() + "; make room or give another --cache");
  }
  std::filesystem::rename(temporary, path_);
}

std::filesystem::path default_cache_directory() {
  const char *cache = std::getenv("XDG_CACHE_HOME"), *home = std::getenv("HOME");
  const std::filesystem::path base =
      cache && *cache ? std::filesystem::path(cache) : std::filesystem::path(home && *home ? home : ".") / ".cache";
  return base / "fingertip" / "contact-tables";
}

} // namespace fingertip::twin
