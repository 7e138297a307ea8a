/* Pressures on sensors, and their temperature, over time: linear between rows, held before the first and after the last. */
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace fingertip {

class Samples {
public:
  unsigned sensors() const { return sensors_; }
  double end_s() const { return times_s_.back(); }

  /* Absolute. Times that mostly go on are found at once. There is a row at least. */
  double pressure_Pa(unsigned sensor, std::uint64_t t_us);
  double temperature_degC(std::uint64_t t_us);

protected:
  unsigned sensors_ = 15;
  double ambient_Pa_ = 101325.0;
  std::vector<double> times_s_;          /* [row], rising */
  std::vector<float> pressures_Pa_;      /* [row * sensors + sensor], above ambient */
  std::vector<float> temperatures_degC_; /* [row] */

private:
  void seek(double t_s);

  std::size_t row_ = 0; /* last one not after the time sought */
  double share_ = 0.0;  /* of the next row */
};

} // namespace fingertip
