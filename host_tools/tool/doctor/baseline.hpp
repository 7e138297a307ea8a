/* What a fingertip does while nothing touches it: its rate, and the noise and drift of each sensor.
 *
 * Noise is that between one reading and the next, less what all sensors do together, for doors and lifts move the air; the root of half the
 * mean square or, in a measurement that was touched, where a press would count, 1.05 times the median. Drift is the slope of ten means,
 * less what all sensors do together; its standard deviation is what the means scatter about the line. */
#pragma once

#include "libfingertip/edge_counter.hpp"
#include "libfingertip/wire.hpp"

#include <cstdint>
#include <optional>
#include <vector>

namespace fingertip {

struct Slope {
  double Pa_per_s, sd_Pa_per_s;
};

struct SensorBaseline {
  std::size_t readings = 0;
  double valid_share = 0;     /* of the frames that measured pressures */
  double doubtful_share = 0;  /* the same */
  double saturated_share = 0; /* the same */
  double mean_Pa = 0;         /* absolute; of no readings 0 */
  std::optional<double> noise_Pa;
  std::optional<Slope> drift;
};

struct Baseline {
  double seconds = 0;             /* device time from the first frame to the last */
  std::uint32_t frames_made = 0;  /* in that time, by their numbers */
  std::size_t frames_touched = 0; /* of those received: in contact */
  std::size_t frames_received = 0;
  std::uint32_t last_flags = 0;               /* enum contact_flag */
  std::vector<SensorBaseline> sensors;        /* none where no readings are streamed */
  std::optional<Slope> common_drift;          /* of all sensors together */
  std::uint64_t edges = 0, edges_missing = 0; /* at the sync pin, by EdgeCounter */
};

class BaselineMeter {
public:
  /* Contact, raw and sync packets, in order; others are nothing to it. */
  void add(const wire_packet &packet);

  double seconds() const;
  Baseline result() const;

private:
  struct Reading {
    double t_s;
    sensor_map valid;
    float pressure_Pa[FT_MAX_SENSORS];
  };

  std::optional<double> noise(unsigned sensor, const std::vector<double> &together) const;
  std::vector<double> steps_together() const;

  bool any_ = false;
  std::uint64_t first_us_ = 0, last_us_ = 0;
  std::uint32_t first_frame_ = 0, last_frame_ = 0;
  Baseline counted_;
  std::uint8_t sensor_count_ = 0;
  EdgeCounter edges_;
  std::vector<Reading> readings_;
  std::vector<std::size_t> doubtful_, saturated_; /* [sensor] */
};

} // namespace fingertip
