// Scenarios on the layer that the tests have tables of.
#pragma once

#include "simulation/twin/scenarios.hpp"

#include <functional>
#include <map>
#include <string>

namespace fingertip::twin {

constexpr double LAYER_mm = 12.0;

inline const ContactTable &table_of(const std::string &name) {
  static std::map<std::string, ContactTable> tables;
  const auto found = tables.find(name);
  if (found != tables.end()) {
    return found->second;
  }
  return tables.emplace(name, ContactTable::load_or_build(indenter(name), silicone(LAYER_mm), FINGERTIP_TEST_TABLES))
      .first->second;
}

inline Scenario scenario_of(const std::string &kind, const std::function<void(ScenarioOptions &)> &change = {}) {
  ScenarioOptions options;
  options.kind = kind;
  if (change) {
    change(options);
  }
  return make_scenario(options, table_of(options.indenter.empty() ? "sphere6" : options.indenter));
}

} // namespace fingertip::twin
