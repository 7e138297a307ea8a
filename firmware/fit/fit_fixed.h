/* Fixed-point arithmetic for the fit on a core with a 32 x 32 -> 32 bit multiplier and a 32/32 bit divider. Qn means:
 * the integer is the value times 2^n. Every function is exact to the bit on every machine: it uses nothing but two's
 * complement integers and arithmetic right shifts. */
#pragma once

#include "port/divide.h"

#include <stdint.h>

#define FIXED_INLINE static inline __attribute__((always_inline))

/* 2^(-k/256) in Q30 and log2(1 + k/64) in Q15, rounded to nearest, and the number of bits of k; a
 * unit test compares every entry with the C library. */
extern const int32_t fit_exp2_table[256];
extern const uint16_t fit_log2_table[65];
extern const uint8_t fit_bits_table[256];

/* a + b, a - b and a * b modulo 2^32. Only readings that no contact makes overflow here. */
FIXED_INLINE int32_t wrap_add(int32_t a, int32_t b) { return (int32_t)((uint32_t)a + (uint32_t)b); }
FIXED_INLINE int32_t wrap_sub(int32_t a, int32_t b) { return (int32_t)((uint32_t)a - (uint32_t)b); }
FIXED_INLINE int32_t wrap_mul(int32_t a, int32_t b) { return (int32_t)((uint32_t)a * (uint32_t)b); }

/* a * b / 2^32 for |a|, |b| <= 2^30, error below 2 units: three 16-bit products. */
FIXED_INLINE int32_t fixed_mul_q32(int32_t a, int32_t b) {
  int32_t a_high = a >> 16, a_low = (uint16_t)a;
  int32_t b_high = b >> 16, b_low = (uint16_t)b;
  return a_high * b_high + ((a_high * b_low + a_low * b_high) >> 16);
}

/* a * b / 2^30 in the same way, error below 3 units. |result| < 2^31. */
FIXED_INLINE int32_t fixed_mul_q30(int32_t a, int32_t b) {
  int32_t a_high = a >> 16, a_low = (uint16_t)a;
  int32_t b_high = b >> 16, b_low = (uint16_t)b;
  return a_high * b_high * 4 + ((a_high * b_low + a_low * b_high) >> 14);
}

/* a * b / 2^28 and / 2^26 with all four products, error below 2 units. |result| < 2^31. */
FIXED_INLINE int32_t fixed_mul_q28(int32_t a, int32_t b) {
  int32_t a_high = a >> 16, a_low = (uint16_t)a;
  int32_t b_high = b >> 16, b_low = (uint16_t)b;
  uint32_t low = (uint32_t)a_low * (uint32_t)b_low;
  return a_high * b_high * 16 + ((a_high * b_low + a_low * b_high) >> 12) + (int32_t)(low >> 28);
}
FIXED_INLINE int32_t fixed_mul_q26(int32_t a, int32_t b) {
  int32_t a_high = a >> 16, a_low = (uint16_t)a;
  int32_t b_high = b >> 16, b_low = (uint16_t)b;
  uint32_t low = (uint32_t)a_low * (uint32_t)b_low;
  return a_high * b_high * 64 + ((a_high * b_low + a_low * b_high) >> 10) + (int32_t)(low >> 26);
}

/* a * b / 2^28 from three products, with the mean of the fourth in its place: error below 6 units. */
FIXED_INLINE int32_t fixed_mul_near_q28(int32_t a, int32_t b) {
  int32_t a_high = a >> 16, a_low = (uint16_t)a;
  int32_t b_high = b >> 16, b_low = (uint16_t)b;
  return a_high * b_high * 16 + ((a_high * b_low + a_low * b_high) >> 12) + 4;
}

/* a * b / 2^16 for any a and |b| < 2^15; an int32_t for any b. */
FIXED_INLINE int32_t fixed_mul_16(int32_t a, int32_t b) { return wrap_add(wrap_mul(a >> 16, b), wrap_mul((uint16_t)a, b) >> 16); }

/* Position of the highest set bit plus one; 0 for 0. */
FIXED_INLINE int32_t fixed_bits(uint32_t value) {
  int32_t count = 0;
  if (value >> 16) {
    count = 16;
    value >>= 16;
  }
  if (value >> 8) {
    count += 8;
    value >>= 8;
  }
  return count + fit_bits_table[value];
}

/* |value|, one less for negative values: for comparing sizes. */
FIXED_INLINE uint32_t fixed_magnitude(int32_t value) { return (uint32_t)(value ^ (value >> 31)); }

FIXED_INLINE int32_t fixed_clamp(int32_t value, int32_t low, int32_t high) { return value < low ? low : value > high ? high : value; }

/* sqrt(a^2 + b^2) within 7 %, for weights. */
FIXED_INLINE int32_t fixed_hypot(int32_t a, int32_t b) {
  int32_t longer = a > b ? a : b, shorter = a > b ? b : a;
  return longer + ((3 * shorter) >> 3);
}

/* Unknown j of a least squares after elimination of those before it. Below FIXED_PIVOT_MIN the readings do not separate it from them. */
struct fixed_pivot {
  int32_t half;          /* the element on the diagonal is 2^28 to 2^30 over 2^(2 half) */
  int32_t inverse_q14;   /* of that element, 2^28 to 1; 0: not determined */
  int32_t rhs, quotient; /* right-hand side, Q15, and the quotient of it and the element, Q14 */
};
#define FIXED_PIVOT_MIN (1 << 18) /* 2^-12 */

/* Takes from the unknowns after j what j explains: L D L^T with a power of two between the factors, of 16 bits each.
 * matrix: the lower half, rows of `words`; column j and right[j] stay as they are. factor: the elements of L below j,
 * Q14. What j explains of the square of the residual is 2 rhs quotient. */
FIXED_INLINE struct fixed_pivot fixed_eliminate(int32_t *matrix, int words, int count, int j, int32_t *right, int32_t *factor) {
  struct fixed_pivot pivot = {0, 0, 0, 0};
  int32_t element = matrix[j * words + j];
  if (element < FIXED_PIVOT_MIN) {
    for (int i = j + 1; i < count; i++) {
      factor[i] = 0;
    }
    return pivot;
  }
  pivot.half = element >> 30 ? 0 : (30 - fixed_bits((uint32_t)element)) >> 1;
  int32_t down = 15 - pivot.half, round = 1 << down >> 1;
  pivot.inverse_q14 = port_divide((1 << 29) - 1, (element * (1 << (2 * pivot.half))) >> 15);
  pivot.rhs = fixed_clamp(wrap_add(right[j], round) >> down, -(1 << 15), 1 << 15);
  pivot.quotient = wrap_add(wrap_mul(pivot.rhs, pivot.inverse_q14), 1 << 14) >> 15;
  for (int i = j + 1; i < count; i++) {
    int32_t *row = matrix + i * words;
    int32_t twice = fixed_clamp(wrap_add(row[j], round) >> down, -(1 << 15), 1 << 15) * 2; /* Q16 */
    factor[i] = wrap_add(wrap_mul(twice, pivot.inverse_q14), 1 << 15) >> 16;
    right[i] = wrap_sub(right[i], wrap_mul(twice, pivot.quotient));
    for (int k = j + 1; k <= i; k++) {
      row[k] = wrap_sub(row[k], wrap_mul(twice, factor[k]));
    }
  }
  return pivot;
}

/* numerator / denominator in Q26 from two divisions, for denominator >= 2^13 and a quotient of at
 * most 16. The remainder is exact modulo 2^32, and it is small. */
FIXED_INLINE int32_t fixed_div_q26(int32_t numerator, int32_t denominator) {
  int32_t coarse = denominator >> 13;
  int32_t quotient = port_divide(numerator, coarse);
  int32_t rest = (int32_t)(((uint32_t)numerator << 13) - (uint32_t)quotient * (uint32_t)denominator);
  return (int32_t)((uint32_t)quotient << 13) + port_divide(rest, coarse);
}

/* mantissa * 2^exponent with |mantissa| <= 2^15: relative precision 2^-14, for what scales a step
 * or a standard deviation and never decides where the fit ends. */
struct scaled {
  int32_t mantissa;
  int32_t exponent;
};

/* A struct of two words is returned in memory, 64 bits are in registers. */
FIXED_INLINE uint64_t scaled_pack(struct scaled a) { return (uint64_t)(uint32_t)a.exponent << 32 | (uint32_t)a.mantissa; }
FIXED_INLINE struct scaled scaled_unpack(uint64_t packed) {
  return (struct scaled){(int32_t)(uint32_t)packed, (int32_t)(uint32_t)(packed >> 32)};
}

FIXED_INLINE struct scaled scaled_from(int32_t value, int32_t exponent) {
  int32_t shift = fixed_bits(fixed_magnitude(value) | 1) - 15;
  struct scaled result = {shift >= 0 ? value >> shift : value * (1 << -shift), exponent + shift};
  return result;
}

/* A value up to 2^30 of which 15 bits are enough although it may be smaller. */
FIXED_INLINE struct scaled scaled_near(int32_t value, int32_t exponent) { return (struct scaled){value >> 15, exponent + 15}; }

/* The product of two normalised mantissas keeps 14 of its 15 bits at least. */
FIXED_INLINE struct scaled scaled_mul(struct scaled a, struct scaled b) {
  struct scaled result = {(a.mantissa * b.mantissa + (1 << 14)) >> 15, a.exponent + b.exponent + 15};
  return result;
}

FIXED_INLINE struct scaled scaled_add(struct scaled a, struct scaled b) {
  if (a.mantissa == 0) {
    return b;
  }
  if (b.mantissa == 0) {
    return a;
  }
  int32_t shift = a.exponent - b.exponent;
  struct scaled result;
  if (shift >= 0) {
    result.mantissa = (a.mantissa + (b.mantissa >> (shift < 31 ? shift : 31))) >> 1;
    result.exponent = a.exponent + 1;
  } else {
    result.mantissa = (b.mantissa + (a.mantissa >> (shift > -31 ? -shift : 31))) >> 1;
    result.exponent = b.exponent + 1;
  }
  return result;
}

FIXED_INLINE struct scaled scaled_sub(struct scaled a, struct scaled b) {
  b.mantissa = -b.mantissa;
  return scaled_add(a, b);
}

/* A zero divisor counts as the smallest mantissa. */
FIXED_INLINE struct scaled scaled_div(struct scaled a, struct scaled b) {
  int32_t divisor = b.mantissa != 0 ? b.mantissa : 1;
  return scaled_from(port_divide(a.mantissa * (1 << 15), divisor), a.exponent - b.exponent - 15);
}

/* The value in Qq, saturated to +-2^30. */
FIXED_INLINE int32_t scaled_to_fixed(struct scaled a, int32_t q) {
  int32_t shift = a.exponent + q;
  if (shift > 15) {
    return a.mantissa == 0 ? 0 : a.mantissa < 0 ? -(1 << 30) : 1 << 30;
  }
  if (shift >= 0) {
    return fixed_clamp(a.mantissa, -(1 << 15), 1 << 15) * (1 << shift);
  }
  return a.mantissa >> (shift < -31 ? 31 : -shift);
}

/* Square root of a non-negative value, within 0.06 %: a Newton step from a straight line that is within 3.2 % of it. */
FIXED_INLINE struct scaled scaled_sqrt(struct scaled a) {
  a = scaled_from(a.mantissa, a.exponent);
  if (a.mantissa <= 0) {
    struct scaled zero = {0, 0};
    return zero;
  }
  int32_t odd = a.exponent & 1;
  int32_t square = a.mantissa * (1 << (14 + odd)); /* 2^28 .. 2^30 */
  int32_t root = (((square >> 14) * 5584) >> 14) + 11249;
  root = (root + port_divide(square, root)) >> 1;
  struct scaled result = {root, (a.exponent - odd - 14) / 2};
  return result;
}

/* 15-bit mantissa from one of up to 31 bits. */
FIXED_INLINE struct scaled scaled_short(struct scaled a) { return scaled_from(a.mantissa, a.exponent); }

/* value * 2^shift, saturated to +-2^30. */
FIXED_INLINE int32_t shifted(int32_t value, int32_t shift) {
  if (shift >= 0) {
    int32_t limit = (1 << 30) >> (shift < 30 ? shift : 30);
    return fixed_clamp(value, -limit, limit) * (1 << (shift < 30 ? shift : 30));
  }
  return value >> (shift < -31 ? 31 : -shift);
}
