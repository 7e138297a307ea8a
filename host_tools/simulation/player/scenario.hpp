/* What the sensors feel over time: the files that fingertip-scenario and the twin write and that the emulator applies.
 *
 *   # fingertip-scenario 1
 *   # key: value                     name, ambient_Pa (101325), temperature_degC (25), sensors (15)
 *   t_s,contact,x_mm,y_mm,force_N,p0_Pa,sigma_mm,slip,s0_Pa,...,s14_Pa[,Qx_N,Qy_N][,temperature_degC]
 *
 * Rows have strictly increasing t_s >= 0; s<k>_Pa is the pressure on sensor k above ambient, at most 1e7 Pa to either
 * side, and so is the ambient pressure; temperatures are at most 1000 degC. The last line ends with a newline. Between
 * rows everything is linear, before the first and after the last it holds. Time 0 is power-on. */
#pragma once

#include "simulation/player/samples.hpp"

#include <string>

namespace fingertip {

class Scenario : public Samples {
public:
  /* Throws Error with file and line. */
  explicit Scenario(const std::string &path);

  const std::string &name() const { return name_; }

private:
  std::string name_;
};

} // namespace fingertip
