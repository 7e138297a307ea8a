// Tables of the twin, each solved or read once, whichever thread asks first. cache: their folder.
#pragma once

#include "library/pad/block_table.hpp"
#include "simulation/twin/traction_table.hpp"

#include <map>
#include <mutex>
#include <string>

namespace fingertip::measure {

// What make() makes is made once for each key, by one thread at a time.
template <class Key, class Make> auto &once_for(const Key &key, const Make &make) {
  static std::map<Key, decltype(make())> all;
  static std::mutex mutex;
  const std::lock_guard<std::mutex> lock(mutex);
  const auto found = all.find(key);
  return found == all.end() ? all.emplace(key, make()).first->second : found->second;
}

const twin::ContactTable &contact_table(const twin::Indenter &indenter, double layer_mm, const std::string &cache);
const twin::TractionTable &traction_table(const twin::Indenter &indenter, double layer_mm, const std::string &cache);
// Of a block around the firmware's sensors.
const twin::BlockTable &block_table(double layer_mm, double overhang_mm, const std::string &cache);

} // namespace fingertip::measure
