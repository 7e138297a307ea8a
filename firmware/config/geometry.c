#include "config/geometry.h"

const struct geometry geometry = {
    .sensor_count = 15,
    .pitch_mm = 9.0f,
    .x_mm = {-9, -9, -9, -9, -9, 0, 0, 0, 0, 0, 9, 9, 9, 9, 9},
    .y_mm = {-18, -9, 0, 9, 18, -18, -9, 0, 9, 18, -18, -9, 0, 9, 18},
};
