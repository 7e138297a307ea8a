/* Where the sensors are. The one table of the array's layout; everything else takes it from here.
 *
 * Coordinates in mm in the plane of the pad, origin in its centre, x across the strips, y along them. Sensor k = 5 *
 * strip + position along the strip, as the boards wire them. */
#pragma once

#include "common/limits.h"

#include <stdint.h>

struct geometry {
  uint8_t sensor_count;       /* 1..FT_MAX_SENSORS */
  float pitch_mm;             /* distance of neighbours; the length scale of the fit */
  float x_mm[FT_MAX_SENSORS]; /* [sensor] */
  float y_mm[FT_MAX_SENSORS];
};

/* Three strips of five MS5840, pitch 9 mm (De Clercq et al., RA-L 2022, section III.A). */
extern const struct geometry geometry;
