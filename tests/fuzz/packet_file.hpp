// What holds of every file of packets: what is read is a packet of the wire, going back reads the
// same again, and written as a recording it reads the same too.
#pragma once

#include "fuzz.h"
#include "libfingertip/error.hpp"
#include "libfingertip/packet_file.hpp"
#include "libfingertip/recording_writer.hpp"
#include "line.hpp"
#include "memory_file.hpp"

#include <vector>

namespace fuzz {

using fingertip::PacketFile;
using Item = PacketFile::Item;

inline bool is_same(const Item &a, const Item &b) {
  if (a.kind != b.kind || a.event != b.event) {
    return false;
  }
  return a.kind == Item::Kind::event || encoded(a.packet) == encoded(b.packet);
}

inline std::vector<Item> rest_of(PacketFile &file) {
  std::vector<Item> items;
  while (auto item = file.next()) {
    items.push_back(*item);
  }
  return items;
}

// Throws Error where the file does.
inline std::vector<Item> read_twice(const std::string &path, bool salvage, const std::string &device, std::size_t back_to) {
  PacketFile file(path, salvage, device);
  std::vector<Item> items;
  while (items.size() < back_to) {
    auto item = file.next();
    if (!item) {
      break;
    }
    items.push_back(*item);
  }
  const PacketFile::Place place = file.place();
  const auto rest = rest_of(file);
  FUZZ_CHECK(!file.next());
  const std::string statistics = file.statistics().text();
  const std::uint64_t skipped = file.skipped_lines();
  file.go_to(place);
  const auto again = rest_of(file);
  FUZZ_CHECK(again.size() == rest.size());
  for (std::size_t i = 0; i < rest.size(); i++) {
    FUZZ_CHECK(is_same(rest[i], again[i]));
  }
  FUZZ_CHECK(file.statistics().text() == statistics && file.skipped_lines() == skipped);
  items.insert(items.end(), rest.begin(), rest.end());
  for (const Item &item : items) {
    if (item.kind == Item::Kind::packet) {
      encoded(item.packet);
    }
  }
  return items;
}

} // namespace fuzz
