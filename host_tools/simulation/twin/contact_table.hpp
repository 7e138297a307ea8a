// The pressure on the base under one indenter on one layer, for any force and place: computed once
// (contact.hpp), kept in a file, interpolated.
//
// force_planes.hpp has the range of forces and places; the tests hold it to 0.2 % of the peak of a solution of its own;
// a flat indenter, whose edge takes hold node by node, needs that much. Some 0.2 us per pressure.
#pragma once

#include "library/pad/table_file.hpp"
#include "simulation/twin/contact.hpp"
#include "simulation/twin/force_planes.hpp"

#include <filesystem>
#include <vector>

namespace fingertip::twin {

class ContactTable {
public:
  static constexpr double FORCE_MIN_N = ForcePlanes::FORCE_MIN_N;
  static constexpr double FORCE_MAX_N = ForcePlanes::FORCE_MAX_N;

  // From the cache if it holds this very table, else solved (a second) and kept there; a damaged file is solved again.
  // Throws std::filesystem::filesystem_error or std::runtime_error if the cache cannot be written.
  static ContactTable load_or_build(const Indenter &indenter, const Layer &layer, const std::filesystem::path &cache_directory);

  // On the base, by dx, dy from the middle of the contact, along the indenter's own axes.
  double base_pressure_Pa(double force_N, double dx_mm, double dy_mm) const { return pressure_.at(force_N, dx_mm, dy_mm); }
  // Less the dip of cast rubber, effect "dip" of effects.hpp: this share of the pressure in the
  // middle times exp(-r^2 / (2 (DIP_WIDTHS s)^2)). s: of the Gaussian of that pressure and force.
  static constexpr double DIP_WIDTHS = 2.5;
  double base_pressure_Pa(double force_N, double dx_mm, double dy_mm, double dip_share) const;
  const ForcePlanes &pressure() const { return pressure_; } // Pa
  double indentation_mm(double force_N) const;
  double contact_radius_mm(double force_N) const; // of a disc of the contact's area

private:
  ForcePlanes pressure_;
  std::vector<float> indentation_mm_, radius_mm_; // [force]
};

} // namespace fingertip::twin
