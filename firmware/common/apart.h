/* Which of several measurements of one quantity is apart from the others.
 *
 * Apart is what differs from the median by more than a floor and APART_SPREADS times the median of the differences. So
 * the others show how far apart is far: bare barometers agree to 0.4 kPa, moulded ones to some kPa. In four real strips
 * under rubber one sensor was up to 8.2 times the median difference off (JiannnH/MTL-BaroTactileSensor, 2023), and that
 * is no fault. With fewer than APART_VOTERS_MIN nothing is apart. */
#pragma once

#include "common/limits.h"

#include <stdint.h>

#define APART_SPREADS 10
#define APART_VOTERS_MIN 4

/* Of count values, at least one, which are put in order. */
int32_t apart_median(int32_t values[], int count);

/* value: [sensor], of a size below 1e8; which: bitmap of those that count, of sensor_count. Returns
 * the bitmap of those apart. Cost: up to 250 Cortex-M0+ cycles a sensor. */
sensor_map apart_find(const int32_t value[], sensor_map which, uint8_t sensor_count, int32_t floor);
