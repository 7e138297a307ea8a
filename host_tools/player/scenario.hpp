/* What the sensors feel over time: the files that fingertip-scenario and the twin write and that
 * the emulator plays.
 *
 *   # fingertip-scenario 1
 *   # key: value                     name, ambient_Pa (101325), temperature_degC (25), sensors (15)
 *   t_s,contact,x_mm,y_mm,force_N,p0_Pa,sigma_mm,slip,s0_Pa,...,s14_Pa[,Qx_N,Qy_N][,temperature_degC]
 *
 * Rows have strictly increasing t_s >= 0; s<k>_Pa is the pressure on sensor k above ambient, at
 * most 1e7 Pa to either side, and so is the ambient pressure; temperatures are at most 1000 degC.
 * The last line ends with a newline. Between rows everything is linear, before the first and after
 * the last it holds. Time 0 is power-on.
 */
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace fingertip {

class Scenario {
public:
  /* Throws Error with file and line. */
  explicit Scenario(const std::string &path);

  unsigned sensors() const { return sensors_; }
  double end_s() const { return times_s_.back(); }
  const std::string &name() const { return name_; }

  /* Absolute. Times that mostly go on are found at once. */
  double pressure_Pa(unsigned sensor, std::uint64_t t_us);
  double temperature_degC(std::uint64_t t_us);

private:
  void seek(double t_s);

  std::string name_;
  unsigned sensors_ = 15;
  double ambient_Pa_ = 101325.0;
  std::vector<double> times_s_;
  std::vector<float> pressures_Pa_;      /* [row * sensors + sensor], above ambient */
  std::vector<float> temperatures_degC_; /* [row] */
  std::size_t row_ = 0;                  /* last one not after the time sought */
  double share_ = 0.0;                   /* of the next row */
};

} // namespace fingertip
