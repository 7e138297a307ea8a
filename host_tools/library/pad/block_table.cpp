#include "library/pad/block_table.hpp"

#include "library/pad/table_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace fingertip::twin {

// Raise it whenever a solution changes.
constexpr int VERSION = 1;
// The fields bend over 3 mm and more: the cubic is good to 1e-4 of them.
constexpr double STEP_mm = 0.5;
// Mean square of the distance from its middle, of a contact's force, in squares of its radius: 0.4
// for Hertz's pressure, 0.5 if even, 0.67 under a stiff flat end.
constexpr double SPREAD = 0.5;

static std::string key_of(const Block &block, const std::vector<Place> &places) {
  const BlockGrid grid;
  char text[256];
  std::snprintf(text, sizeof text, "block-table %d: %.9g %.9g %.9g %.9g grid %d %.9g %.9g %.9g %.9g step %.9g at", VERSION,
                block.layer.thickness_mm, block.layer.poisson, block.half_x_mm, block.half_y_mm, grid.degree, grid.element_mm,
                grid.element_thicknesses, grid.edge_thicknesses, grid.growth, STEP_mm);
  std::string key = text;
  for (const Place &place : places) {
    std::snprintf(text, sizeof text, " %.9g,%.9g", place.x_mm, place.y_mm);
    key += text;
  }
  return key;
}

// On a line from -half to half.
static Cubic between(double place, double half, int nodes) {
  return cubic_at((std::clamp(place / half, -1.0, 1.0) + 1.0) * 0.5 * (nodes - 1), nodes);
}

BlockTable::BlockTable(const Block &block, const std::vector<Place> &sensors) : block_(block) {
  for (const Place &sensor : sensors) {
    const Place mirror{std::abs(sensor.x_mm), std::abs(sensor.y_mm)};
    const auto same = [&](const Place &place) { return place.x_mm == mirror.x_mm && place.y_mm == mirror.y_mm; };
    const auto found = std::find_if(places_.begin(), places_.end(), same);
    sensors_.push_back({static_cast<std::size_t>(found - places_.begin()), sensor.x_mm < 0.0 ? -1.0 : 1.0, sensor.y_mm < 0.0 ? -1.0 : 1.0});
    if (found == places_.end()) {
      places_.push_back(mirror);
    }
  }
  nodes_x_ = block_nodes(block.half_x_mm, STEP_mm);
  nodes_y_ = block_nodes(block.half_y_mm, STEP_mm);
  values_.resize(3 * places_.size() * std::size_t(nodes_x_) * std::size_t(nodes_y_));
}

BlockTable BlockTable::load_or_build(const Block &block, const std::vector<Place> &sensors, const std::filesystem::path &cache_directory,
                                     const std::function<void(double)> &on_progress) {
  BlockTable table(block, sensors);
  char name[64];
  std::snprintf(name, sizeof name, "block%gx%g-h%g", 2.0 * block.half_x_mm, 2.0 * block.half_y_mm, block.layer.thickness_mm);
  const TableFile file(cache_directory, name, key_of(block, table.places_));
  if (!file.read(table.values_)) {
    table.values_.clear();
    for (const BlockAnswer &answer : solve_block(block, table.places_, STEP_mm, {}, on_progress)) {
      for (std::size_t n = 0; n < answer.down.size(); n++) {
        for (const std::vector<float> *field : {&answer.down, &answer.along_x, &answer.along_y}) {
          table.values_.push_back((*field)[n]);
        }
      }
    }
    file.write(table.values_);
  }
  return table;
}

double BlockTable::added_Pa(std::size_t sensor, const Load &load, double x_mm, double y_mm) const {
  const Sensor &at = sensors_[sensor];
  const std::array<double, 3> by{load.force_N, at.sign_x * load.x_N, at.sign_y * load.y_N};
  const float *values = values_.data() + 3 * at.place * std::size_t(nodes_x_) * std::size_t(nodes_y_);
  // The root mean square distance of the force from the middle.
  const double away_mm = std::sqrt(SPREAD) * load.radius_mm;
  double sum = 0.0;
  for (const auto &[dx, dy] : {std::pair{away_mm, 0.0}, {-away_mm, 0.0}, {0.0, away_mm}, {0.0, -away_mm}}) {
    const Cubic x = between(at.sign_x * (x_mm + dx), block_.half_x_mm, nodes_x_);
    const Cubic y = between(at.sign_y * (y_mm + dy), block_.half_y_mm, nodes_y_);
    for (int i = 0; i < 4; i++) {
      const float *node = values + 3 * ((x.first + i) * nodes_y_ + y.first);
      for (int j = 0; j < 4; j++) {
        double here = 0.0;
        for (std::size_t c = 0; c < 3; c++) {
          here += by[c] * static_cast<double>(*node++);
        }
        sum += 0.25 * x.weight[std::size_t(i)] * y.weight[std::size_t(j)] * here;
      }
    }
  }
  return sum;
}

} // namespace fingertip::twin
