// The contact shapes of the simulated pad, as a file: the pressure on the base of the rubber per force of each object, from the twin's
// tables (twin/contact_table.hpp, simulation/twin/traction_table.hpp), at places farther apart and in 16 bits.
//
// All values are little-endian. The file begins with 8 bytes "FTPAD 1\n" and the number of objects as a uint32; each object has
//   name       16 bytes, zero-padded: of simulation/twin/indenter.hpp
//   radius     [force] floats, mm, of the contact
//   indented   [force] floats, mm
//   fields     3 times: under a force down, along x, along y: [force] of a float, the largest value, Pa / N, and
//              [x][y] int16, parts of 32767 of it
// with forces and symmetries as in simulation/twin/force_planes.hpp. The rest are the bytes of the
// command that sets the fingertip's pad profile.
#pragma once

#include "simulation/twin/force_planes.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace fingertip::web {

struct Object {
  std::string name;
  std::vector<float> radius_mm, indentation_mm; // [force]
  twin::ForcePlanes normal, along_x, along_y;   // Pa / N
};

struct ObjectsFile {
  static constexpr int NODES = 32;
  static constexpr double STEP_mm = 1.5;
  static constexpr std::size_t NAME_BYTES = 16;

  std::vector<Object> objects;
  std::vector<std::uint8_t> pad_command; // a frame of the line
};

std::vector<std::uint8_t> written(const ObjectsFile &file);
// Throws std::runtime_error unless it is one.
ObjectsFile read_objects(const std::uint8_t *bytes, std::size_t length);

} // namespace fingertip::web
