// What a fingertip's rubber meets: the face of an object, from the twin's tables.
//
// A face is one of the twin's indenters (twin/indenter.hpp) on a layer without end: how deep it
// goes in and how wide it touches under a force, and what the fifteen sensors feel of it wherever
// it is and however it pulls. Or it is `plate`, a flat larger than the pad: plate.hpp.
#pragma once

#include "simulation/cell/plate.hpp"
#include "simulation/twin/traction_table.hpp"
#include "simulation/twin/trajectory.hpp"

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace fingertip::cell {

constexpr std::size_t SENSORS = 15;
using Pressures = std::array<double, SENSORS>; // Pa, on the base

class Face {
public:
  static constexpr double FORCE_MAX_N = 50.0;

  // Solved once and kept in the cache (contact_table.hpp). Throws std::runtime_error for a name
  // that there is not.
  Face(const std::string &name, double layer_mm, const std::filesystem::path &cache);

  // 0..FORCE_MAX_N; beyond, as there.
  double indentation_mm(double force_N) const;
  double radius_mm(double force_N) const; // of contact
  Pressures base_Pa(const twin::Touch &touch) const;

private:
  void make_plate(const twin::Layer &layer);

  std::optional<twin::ContactTable> table_; // or the plate
  std::optional<twin::TractionTable> traction_;
  std::optional<Plate> plate_;
  std::vector<std::array<double, 3>> plate_Pa_N_; // [sensor], down, along x, along y
};

} // namespace fingertip::cell
