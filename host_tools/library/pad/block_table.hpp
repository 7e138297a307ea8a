// The difference between a block (block.hpp) and a layer without end at each sensor: the effect of the pad's edges, for any load and place.
// It is solved once, kept in a file, and interpolated. Add it to the results of contact_table.hpp and traction_table.hpp.
//
// The load counts by its force, its place and its breadth: the field's mean over a disc, from four points. Compared with all of the
// contact's own pressure, this costs the following, in parts of the layer's peak, above the corner's sensor at 8 N on 12 mm:
//   9 mm of rubber beyond   0.1 % under a sphere of 6 mm, 0.3 % under one of 15 mm
//   6 mm                    0.4 and 1.2 %, 1 % under a cube
// The middle alone costs three to five times that. Nodes 0.5 mm apart add less than 0.05 %.
//
// The spread of a contact's pressure about its middle is that of the layer without end. Near an edge rubber yields
// more, so an object presses less on that side than on the layer. Its axis is then not at its pressure's middle, which
// is the place here. The distance between the two is unknown.
#pragma once

#include "library/pad/block.hpp"

#include <filesystem>

namespace fingertip::twin {

class BlockTable {
public:
  // Reads the table from the cache if it is there, else it is solved (block.hpp: seconds, half a minute at
  // most) and kept there; a damaged file is solved again. on_progress gets the share done, 0..1.
  // Throws std::filesystem::filesystem_error or std::runtime_error if the cache cannot be written.
  static BlockTable load_or_build(const Block &block, const std::vector<Place> &sensors, const std::filesystem::path &cache_directory,
                                  const std::function<void(double)> &on_progress = {});

  struct Load {
    double force_N = 0.0, x_N = 0.0, y_N = 0.0; // down, along x, along y
    double radius_mm = 0.0;                     // of the contact
  };
  // On the base at a sensor, in the order given, by a load at this place. Beyond the sides, as at them. Some 0.2 us.
  double added_Pa(std::size_t sensor, const Load &load, double x_mm, double y_mm) const;

  const Block &block() const { return block_; }

private:
  BlockTable(const Block &block, const std::vector<Place> &sensors);

  struct Sensor {
    std::size_t place;     // of those solved for, whose coordinates are not negative
    double sign_x, sign_y; // which way its mirror is
  };
  Block block_;
  std::vector<Place> places_;
  std::vector<Sensor> sensors_;
  int nodes_x_, nodes_y_;
  std::vector<float> values_; // [place][x][y][down, along x, along y], Pa / N
};

} // namespace fingertip::twin
