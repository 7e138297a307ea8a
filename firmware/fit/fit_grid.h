/* The parameters of a full rectangular grid for the fixed-point kernel; filled by fit_array_init.
 */
#ifndef FIT_FIT_GRID_H
#define FIT_FIT_GRID_H

#include "common/limits.h"

#include <stdint.h>

#define FIT_GRID_MAX_NODES 6

struct fit_grid_shape {
  uint8_t columns, rows;               /* nodes along x and y, 2..FIT_GRID_MAX_NODES; 0: no grid */
  uint8_t sensor[FT_MAX_SENSORS];      /* [column * rows + row] */
  int32_t x_min, x_max;                /* box of the location, Q26 pitches from node (columns / 2, */
  int32_t y_min, y_max;                /* rows / 2) */
  int32_t pitch, pitch_exponent;       /* the pitch is pitch * 2^(pitch_exponent - 6) mm */
  int32_t x_origin, y_origin;          /* that node, 2^pitch_exponent mm */
  int32_t force_scale, force_exponent; /* 2 pi 1e-6 pitch^2, mantissa * 2^exponent */
  int32_t settled_square;              /* half the square of the settled step, Q22 pitches */
};

#endif
