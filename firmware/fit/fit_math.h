/* Exponential and logarithm to base 2 in integers: five to ten times faster than the C library's on a core without FPU,
 * and the same bits on every machine. */
#pragma once

#include <stdint.h>

/* 2^-z for z >= 0, relative error below 2^-23 beside the rounding of z itself; 0 for z >= 100. A z that is negative or NaN counts as 0. */
float fit_exp2_negative(float z);

/* value 2^q, towards zero; what does not fit, and what is not finite, at most +-(2^31 - 1). A
 * multiplication and a conversion less than in soft float. */
int32_t fit_fixed(float value, int q);

/* mantissa * 2^exponent, rounded to nearest, as a float; what is too large becomes FIT_HUGE. */
float fit_float(int32_t mantissa, int32_t exponent);

/* log2(value) in 1/2^24, error below 2e-4; value >= 1. */
int32_t fit_log2_q24(uint32_t value);
