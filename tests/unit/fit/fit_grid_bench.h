/* A grid of sensors of the size that the kernels are built for, not in the order of a grid: rows
 * run from top to bottom, columns are interleaved. */
#ifndef FIT_GRID_BENCH_H
#define FIT_GRID_BENCH_H

#include "common/contact_flags.h"
#include "fit/fit.h"

enum { COLUMNS = FIT_GRID_COLUMNS, ROWS = FIT_GRID_ROWS, SENSORS = COLUMNS * ROWS };
#define PITCH_mm 9.0f
#define ALL (UINT32_MAX >> (32 - SENSORS))

/* Of the array that Unity's setUp() begins. */
extern float x_mm[SENSORS], y_mm[SENSORS];
extern struct fit_array array;
extern int32_t readings[SENSORS];
extern const struct fit_settings usual;

#endif
