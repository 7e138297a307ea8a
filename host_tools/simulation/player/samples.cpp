#include "simulation/player/samples.hpp"

namespace fingertip {

void Samples::seek(double t_s) {
  if (times_s_[row_] > t_s) {
    row_ = 0;
  }
  while (row_ + 1 < times_s_.size() && times_s_[row_ + 1] <= t_s) {
    row_++;
  }
  const bool holds = row_ + 1 >= times_s_.size() || t_s <= times_s_[row_];
  share_ = holds ? 0.0 : (t_s - times_s_[row_]) / (times_s_[row_ + 1] - times_s_[row_]);
}

double Samples::pressure_Pa(unsigned sensor, std::uint64_t t_us) {
  seek(1e-6 * static_cast<double>(t_us));
  const float *here = &pressures_Pa_[row_ * sensors_ + sensor];
  const double value = static_cast<double>(*here);
  if (share_ == 0.0) {
    return ambient_Pa_ + value;
  }
  return ambient_Pa_ + value + share_ * (static_cast<double>(here[sensors_]) - value);
}

double Samples::temperature_degC(std::uint64_t t_us) {
  seek(1e-6 * static_cast<double>(t_us));
  const double value = static_cast<double>(temperatures_degC_[row_]);
  if (share_ == 0.0) {
    return value;
  }
  return value + share_ * (static_cast<double>(temperatures_degC_[row_ + 1]) - value);
}

} // namespace fingertip
