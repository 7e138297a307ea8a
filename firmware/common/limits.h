/* Sizes that several modules share. */
#pragma once

/* Sensors of one array; a bitmap of sensors is a uint32_t, bit k = sensor k. */
#define FT_MAX_SENSORS 32

/* Stack of the main loop and the interrupts of a board's image, in bytes: what is reserved, and what any scene may use
 * at most. The checks of the images prove both by the call graph (tests/checks). */
#define FT_STACK_RESERVED_bytes 4096
#define FT_STACK_USED_MAX_bytes 2608
