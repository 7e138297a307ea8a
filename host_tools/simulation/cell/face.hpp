// What a fingertip's rubber meets: the face of an object, from the twin's tables.
//
// A face is one of the twin's indenters (twin/indenter.hpp) on a layer without end: how deep it
// goes in and how wide it touches under a force, and what the fifteen sensors feel of it wherever
// it is and however it pulls. Or it is `plate`, a flat larger than the pad: plate.hpp.
//
// The twin's planes, every second node of them, with the three fields side by side: within 0.2 % of
// the peak of the twin's own on layers of 9 mm and more. Some 2 us per touch, all sensors.
#pragma once

#include "library/pad/layer.hpp"
#include "simulation/twin/trajectory.hpp"

#include <array>
#include <filesystem>
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

  const std::string &name() const { return name_; }
  double layer_mm() const { return layer_mm_; }
  // 0..FORCE_MAX_N; beyond, as there.
  double indentation_mm(double force_N) const { return at(indentation_mm_, force_N); }
  double radius_mm(double force_N) const { return at(radius_mm_, force_N); } // of contact
  Pressures base_Pa(const twin::Touch &touch) const;

private:
  static constexpr int STRIDE = 2; // of the twin's nodes
  enum Field { NORMAL, ALONG_X, ALONG_Y, FIELDS };
  static double at(const std::vector<float> &values, double force_N);
  void make_plate(const twin::Layer &layer);

  std::string name_;
  double layer_mm_;
  std::vector<float> indentation_mm_, radius_mm_; // equally spaced in the root of the force
  std::vector<float> values_;                     // [x][y][force][field], Pa / N
  std::vector<std::array<double, FIELDS>> plate_; // [sensor], Pa / N; empty: none
};

} // namespace fingertip::cell
