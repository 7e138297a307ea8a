// The pressure on the base under a contact that also drags: the tangential part, for any force, load and place.
//
// Traction has the shape of a difference of two normal pressures of the same indenter,
//   t = Q / (F - S) [p(F) - p(S)],  0 <= S < F
// where F presses, Q is the tangential force of the object on the rubber, and p(S) is that of the
// force S alone. |t| nowhere exceeds |Q| / (F - S) p.
//   S = 0             the whole contact slides, |Q| = mu F; or Q and F have risen together, as
//                     they do in an oblique push: then nothing slides as long as |Q| < mu F
//   S = F - |Q| / mu  Q has risen while F stayed: the contact of S sticks, the ring around it
//                     slides (Cattaneo; Mindlin, J. Appl. Mech. 16, 1949; for any shape:
//                     Ciavarella, Int. J. Solids Structures 35, 1998, and Jaeger, Arch. Appl. Mech.
//                     68, 1998)
// S = 0 is exact for a sliding contact. The other two are exact on a half-space whose tangential displacements follow tractions as its
// normal ones do. On a layer another region sticks; of that the base gets 0.4 % of the field's peak under spheres on 12 mm, 1.2 % under
// wide ones on 6 mm, 2 to 3 % under a cube, whose corners slide first. Contacts wider than the layer is thick stick in the middle and carry
// Q near the rim: under the bottle cap that is 15 % on 12 mm, 40 % on 6 mm. Left out everywhere: rubber rises ahead of what pulls it, which
// moves the pressure ahead. At Q = 0.3 F and 8 N that is 0.01 mm, 1.3 % of the field's peak, under a sphere of 15 mm on 12 mm and nothing
// under one of 6 mm; on 6 mm, 0.06 mm and 13 %. And when Q falls, it leaves tractions behind (Mindlin and Deresiewicz, J. Appl. Mech. 20,
// 1953): after 0.6 mu F, 1 to 2 % of the peak on 12 mm, 6 % on 6 mm.
//
// The base answers waves of t in the proportion Q(H) / T(H) of layer.hpp to those of pressure, so the table comes from the one of pressures
// without another contact solved, in some 30 ms. As that one ends at 45 mm, errors on 12 mm of rubber are 0.3 % of the peak to 30 mm and
// 1.3 % to 45, on 20 mm 2 and 5 %; on 6 mm 0.2 %, and under partial slip of a flat indenter, whose edge takes hold node by node, 0.8 %.
#pragma once

#include "simulation/twin/contact_table.hpp"
#include "simulation/twin/traction.hpp"

namespace fingertip::twin {

class TractionTable {
public:
  TractionTable(const ContactTable &table, const Layer &layer);

  using Load = TractionLoad;
  // The pressure at dx, dy from the middle of the contact, along the same axes.
  double base_pressure_Pa(const Load &load, double dx_mm, double dy_mm) const {
    return traction_pressure_Pa(along_x_, along_y_, load, dx_mm, dy_mm);
  }
  const ForcePlanes &along_x() const { return along_x_; }
  const ForcePlanes &along_y() const { return along_y_; }

private:
  ForcePlanes along_x_, along_y_; // under a traction p, Pa
};

} // namespace fingertip::twin
