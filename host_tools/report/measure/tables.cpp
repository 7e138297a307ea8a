#include "report/measure/tables.hpp"

#include "simulation/twin/scenarios.hpp"

namespace fingertip::measure {

const twin::ContactTable &contact_table(const twin::Indenter &indenter, double layer_mm, const std::string &cache) {
  return once_for(std::make_pair(indenter.name, layer_mm),
                  [&] { return twin::ContactTable::load_or_build(indenter, twin::silicone(layer_mm), cache); });
}

const twin::TractionTable &traction_table(const twin::Indenter &indenter, double layer_mm, const std::string &cache) {
  return once_for(std::make_pair(indenter.name, layer_mm),
                  [&] { return twin::TractionTable(contact_table(indenter, layer_mm, cache), twin::silicone(layer_mm)); });
}

const twin::BlockTable &block_table(double layer_mm, double overhang_mm, const std::string &cache) {
  return once_for(std::make_pair(layer_mm, overhang_mm), [&] {
    const auto block = twin::block_around(twin::silicone(layer_mm), overhang_mm);
    return twin::BlockTable::load_or_build(block, twin::sensor_places(), cache);
  });
}

} // namespace fingertip::measure
