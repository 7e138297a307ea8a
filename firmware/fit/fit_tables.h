/* 2^(-k/256) in Q30 and log2(1 + k/64) in Q15, rounded to nearest, and the number of bits of k; a
 * unit test compares every entry with the C library. */
#ifndef FIT_FIT_TABLES_H
#define FIT_FIT_TABLES_H

#include <stdint.h>

extern const int32_t fit_exp2_table[256];
extern const uint16_t fit_log2_table[65];
extern const uint8_t fit_bits_table[256];

#endif
