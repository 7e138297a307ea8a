/* Numbers by chance, the same on every machine. */
#ifndef FIT_BITS_DRAW_H
#define FIT_BITS_DRAW_H

#include <stdint.h>

void draw_from(uint64_t seed);
uint32_t draw(void);
/* low..high, both included. */
int32_t draw_between(int32_t low, int32_t high);

#endif
