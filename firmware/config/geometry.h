/* Where the sensors are: of the pad that is built for (FINGERTIP_PAD, boards/pads/README.md).
 *
 * Coordinates in mm in the plane of the pad, origin in its centre, x across the strips, y along them. On the boards'
 * own pad sensor k = 5 * strip + position along the strip. */
#pragma once

#include "common/limits.h"

#include <stdint.h>

struct geometry {
  uint8_t sensor_count;       /* 1..FT_MAX_SENSORS */
  float pitch_mm;             /* distance of neighbours; the length scale of the fit */
  float x_mm[FT_MAX_SENSORS]; /* [sensor] */
  float y_mm[FT_MAX_SENSORS];
};

extern const struct geometry geometry;
