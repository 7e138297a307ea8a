/* Sizes that several modules share. */
#pragma once

#include <stdint.h>

/* Sensors of one array: 36 where the pad has more than 32, and on a host, which takes any pad. */
#ifndef FT_MAX_SENSORS
#define FT_MAX_SENSORS 32
#endif

/* Stack of the main loop and the interrupts of a board's image, in bytes: what is reserved, and what any scene may use
 * at most, by the array's sensors. The checks of the images prove both by the call graph (tests/checks), and the report on
 * pads for arrays that no board has. */
#define FT_STACK_RESERVED_bytes 4096
#define FT_STACK_USED_MAX_bytes(sensors) ((sensors) > 15 ? 3584 : 2608)

/* Of any air in which a hand works: sea level in a storm is 108 kPa, 9 km up 30 kPa. */
#define FT_AIR_MIN_Pa 30000
#define FT_AIR_MAX_Pa 120000

/* Moulding presses on the sensors: at rest those of four real strips differed by 2 to 12 kPa. A sensitivity that is off by 1 % moves the
 * reading at 1 bar by 2.9 kPa: what is apart by less than this is no worse than the gains of a pad may be. */
#define FT_APART_MAX_Pa 20000

/* A map of sensors: bit k is sensor k. */
#if FT_MAX_SENSORS > 32
typedef uint64_t sensor_map;
#else
typedef uint32_t sensor_map;
#endif

static inline sensor_map sensor_bit(unsigned sensor) { return (sensor_map)1 << sensor; }

/* Sensors 0 to count - 1; count: 1..FT_MAX_SENSORS. */
static inline sensor_map first_sensors(unsigned count) {
  /* NOLINTNEXTLINE(clang-analyzer-core.UndefinedBinaryOperatorResult): at least one sensor */
  return ~(sensor_map)0 >> (8 * sizeof(sensor_map) - count);
}

static inline unsigned count_sensors(sensor_map map) {
  unsigned count = 0;
  for (; map; map &= map - 1) {
    count++;
  }
  return count;
}
