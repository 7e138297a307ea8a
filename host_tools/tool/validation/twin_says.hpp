/* What healthy pads of the twin score in the same validation: 12 mm of rubber over the firmware's
 * own sensors, with the errors of real pads (host_tools/simulation/cell/validated.cpp), pressed by
 * a hand that misses the marks by 0.3 mm each way. Written by
 * host_tools/report/validation/cards.py. */
#pragma once

#include <optional>
#include <string>

namespace fingertip::validating {

constexpr double TWIN_SKIN_mm = 12.0;
/* A pad whose skin is so much thicker or thinner is still compared. */
constexpr double TWIN_SKIN_OFF_mm = 2.0;
/* Figures of a pull that is estimated are those of pads whose sensors differ in their gains alone,
 * calibrated and with their profile: on the others the firmware mostly estimates none.
 * Pulled by so much of the weight; a pad that is pulled by so much more or less is compared. */
constexpr double TWIN_PULL = 1.0 / 3.0, TWIN_PULL_OFF = 0.05;

struct TwinSays {
  const char *key; /* of the figure */
  bool is_calibrated;
  double low, middle, high; /* nine pads in ten are between low and high, half below middle */
};

std::optional<TwinSays> twin_says(const std::string &key, bool is_calibrated);

} // namespace fingertip::validating
