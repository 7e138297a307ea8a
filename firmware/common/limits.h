/* Sizes that several modules share. */
#ifndef COMMON_LIMITS_H
#define COMMON_LIMITS_H

/* Sensors of one array; a bitmap of sensors is a uint32_t, bit k = sensor k. */
#define FT_MAX_SENSORS 32

#endif
