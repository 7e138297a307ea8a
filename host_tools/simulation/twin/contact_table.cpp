#include "simulation/twin/contact_table.hpp"

#include <cmath>
#include <cstdio>
#include <string>

namespace fingertip::twin {

constexpr int FORCES = ForcePlanes::FORCES, NODES = ForcePlanes::NODES;
constexpr double STEP_mm = ForcePlanes::STEP_mm;
constexpr std::size_t PLANE = ForcePlanes::PLANE;
constexpr std::size_t VALUES = FORCES * PLANE;
// To be raised whenever a solution changes.
constexpr int VERSION = 1;

// All that the numbers depend on.
static std::string key_of(const Indenter &indenter, const Layer &layer, const Grid &grid) {
  char text[256];
  std::snprintf(text, sizeof text,
                "contact-table %d: %d %.9g %.9g %.9g %.9g %.9g on %.9g %.9g %.9g grid %d %.9g "
                "forces %d %.9g %.9g step %.9g %d",
                VERSION, static_cast<int>(indenter.shape), indenter.size_x_mm, indenter.size_y_mm, indenter.size_z_mm, indenter.edge_mm,
                indenter.youngs_modulus_Pa, layer.thickness_mm, layer.youngs_modulus_Pa, layer.poisson, grid.nodes, grid.step_mm, FORCES,
                ContactTable::FORCE_MIN_N, ContactTable::FORCE_MAX_N, STEP_mm, NODES);
  return text;
}

double ContactTable::base_pressure_Pa(double force_N, double dx_mm, double dy_mm, double dip_share) const {
  double pressure_Pa = base_pressure_Pa(force_N, dx_mm, dy_mm);
  if (dip_share > 0.0 && force_N > 0.0) {
    const double middle_Pa = base_pressure_Pa(force_N, 0.0, 0.0);
    const double square_mm2 = 1e6 * force_N / (2.0 * M_PI * middle_Pa);
    pressure_Pa -= dip_share * middle_Pa * std::exp(-(dx_mm * dx_mm + dy_mm * dy_mm) / (2.0 * DIP_WIDTHS * DIP_WIDTHS * square_mm2));
  }
  return pressure_Pa;
}

double ContactTable::indentation_mm(double force_N) const {
  return force_N > 0.0 ? ForcePlanes::between_forces(indentation_mm_, force_N) : 0.0;
}

double ContactTable::contact_radius_mm(double force_N) const {
  return force_N > 0.0 ? ForcePlanes::between_forces(radius_mm_, force_N) : 0.0;
}

ContactTable ContactTable::load_or_build(const Indenter &indenter, const Layer &layer, const std::filesystem::path &cache_directory) {
  const Grid grid = grid_for(indenter, layer);
  char name[64];
  std::snprintf(name, sizeof name, "%s-h%g", indenter.name.c_str(), layer.thickness_mm);
  const TableFile file(cache_directory, name, key_of(indenter, layer, grid));
  std::vector<float> values(VALUES + 2 * FORCES);
  if (!file.read(values)) {
    ContactSolver solver(indenter, layer, grid);
    const int stride = static_cast<int>(std::lround(STEP_mm / grid.step_mm));
    for (int f = 0; f < FORCES; f++) {
      const Contact contact = solver.solve(ForcePlanes::force_at(f));
      for (int i = 0; i < NODES; i++) {
        for (int j = 0; j < NODES; j++) {
          const std::size_t from =
              std::size_t(grid.nodes / 2 + i * stride) * std::size_t(grid.nodes) + std::size_t(grid.nodes / 2 + j * stride);
          values[std::size_t(f) * PLANE + std::size_t(i * NODES + j)] = static_cast<float>(contact.base_Pa[from] / contact.force_N);
        }
      }
      values[VALUES + std::size_t(f)] = static_cast<float>(contact.indentation_mm);
      values[VALUES + FORCES + std::size_t(f)] = static_cast<float>(std::sqrt(contact.contact_area_mm2 / M_PI));
    }
    file.write(values);
  }
  ContactTable table;
  const auto begin = values.begin();
  table.pressure_ = {{begin, begin + VALUES}, ForcePlanes::Symmetry::even, ForcePlanes::Symmetry::even};
  table.indentation_mm_.assign(begin + VALUES, begin + VALUES + FORCES);
  table.radius_mm_.assign(begin + VALUES + FORCES, values.end());
  return table;
}

} // namespace fingertip::twin
