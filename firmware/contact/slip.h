/* Slip distance: how far the contact has moved away from its recent mean (De Clercq et al., RA-L 2022, eq. (7)):
 *   eps_i = | r_i - (r_{i-1} + ... + r_{i-n}) / n |
 * It is a slip if eps_i exceeds a threshold.
 *
 * The paper counts n steps. Here the history is a span of time, so that the metric means the same at any frame rate. n
 * is the number of frames within the window, with half a frame interval granted for jitter. At 20 Hz a window of 100 ms
 * gives n = 2, the paper's setting. At constant speed v the distance is v (window + one interval) / 2.
 *
 * Positions are integers of 1/16 um, so the running sums are exact however long they run. The cost does not grow with n. */
#pragma once

#include "common/limits.h"

#include <stdbool.h>
#include <stdint.h>

/* 160 frames span 100 ms at 1600 frames a second. A window that holds more is shortened to them. A
 * window shorter than the frame interval compares with the frame before. */
#define SLIP_CAPACITY 160

struct slip_history {
  uint16_t oldest, count;  /* ring */
  bool spans;              /* the window has been filled since the last reset or pause */
  int32_t x_sum, y_sum;    /* over the ring */
  sensor_map used, newest; /* bitmaps: settled sensors of the locations, and of the newest frame; contact.c */
  uint64_t t_us[SLIP_CAPACITY];
  int32_t x_16th_um[SLIP_CAPACITY], y_16th_um[SLIP_CAPACITY];
};

/* Forgets all locations. Call it when contact is lost or the location cannot be trusted. */
void slip_reset(struct slip_history *history);

/* Enters a location and gives its distance from the mean of those in the window before it. t_us must increase from call
 * to call; |x_mm|, |y_mm| <= 800. Returns false, with *distance_mm untouched, until the history spans the window. */
bool slip_update(struct slip_history *history, uint64_t t_us, float x_mm, float y_mm, uint32_t window_us, float *distance_mm);
