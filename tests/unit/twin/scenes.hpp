// Scenarios on the layer that the tests have tables of.
#pragma once

#include "simulation/twin/scenarios.hpp"
#include "simulation/twin/traction_table.hpp"

extern "C" {
#include "config/geometry.h"
}

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <string>

namespace fingertip::twin {

constexpr double LAYER_mm = 12.0;

inline const ContactTable &table_of(const std::string &name) {
  static std::map<std::string, ContactTable> tables;
  if (const auto found = tables.find(name); found != tables.end()) {
    return found->second;
  }
  return tables.emplace(name, ContactTable::load_or_build(indenter(name), silicone(LAYER_mm), FINGERTIP_TEST_TABLES)).first->second;
}

inline const TractionTable &traction_of(const std::string &name) {
  static std::map<std::string, TractionTable> tables;
  return tables.try_emplace(name, table_of(name), silicone(LAYER_mm)).first->second;
}

// What the sensors feel of a touch.
inline std::array<double, 15> base_Pa(const Touch &touch, const ContactTable &table, const TractionTable *traction,
                                      double dip_share = 0.0) {
  const double c = std::cos(touch.angle_rad), s = std::sin(touch.angle_rad);
  const TractionTable::Load load{touch.force_N, touch.stuck_N, c * touch.pull_x_N + s * touch.pull_y_N,
                                 c * touch.pull_y_N - s * touch.pull_x_N};
  std::array<double, 15> felt_Pa{};
  for (std::size_t k = 0; k < felt_Pa.size(); k++) {
    const double dx = double(geometry.x_mm[k]) - touch.x_mm, dy = double(geometry.y_mm[k]) - touch.y_mm;
    const double along_x = c * dx + s * dy, along_y = c * dy - s * dx;
    felt_Pa[k] = table.base_pressure_Pa(touch.force_N, along_x, along_y, dip_share) +
                 (traction == nullptr ? 0.0 : traction->base_pressure_Pa(load, along_x, along_y));
  }
  return felt_Pa;
}

inline const Phase &phase_of(const Episode &episode, const std::string &name) {
  return *std::find_if(episode.phases.begin(), episode.phases.end(), [&](const Phase &one) { return one.name == name; });
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
