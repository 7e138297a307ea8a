#include "fit/fit_math.h"

#include "common/bytes.h"
#include "fit/fit_fixed.h"
#include "fit/fit_limits.h"

#include <string.h>

#define LN2_Q30 744261118
#define ONE_THIRD_Q30 357913941

float fit_exp2_negative(float z) {
  if (!(z > 0.0f)) {
    return 1.0f;
  }
  if (z >= 100.0f) {
    return 0.0f;
  }
  int32_t z_q24 = (int32_t)(z * 16777216.0f);
  int32_t whole = z_q24 >> 24;
  int32_t head = fit_exp2_table[(z_q24 >> 16) & 0xF8];
  /* e^-t for the rest t < ln 2 / 32: third order leaves 1e-8. */
  int32_t t = fixed_mul_q30((z_q24 & 0x7FFFF) << 6, LN2_Q30);
  int32_t t_squared_half = fixed_mul_q30(t, t) >> 1;
  int32_t t_cubed_sixth = fixed_mul_q30(fixed_mul_q30(t_squared_half, t), ONE_THIRD_Q30);
  int32_t mantissa_q30 = head - fixed_mul_q30(head, t - t_squared_half + t_cubed_sixth);

  /* mantissa_q30 * 2^-30 lies in (1/2, 1]; its float's exponent takes the rest. */
  float result = (float)mantissa_q30;
  uint32_t bits;
  memcpy(&bits, &result, sizeof bits);
  bits -= (uint32_t)(whole + 30) << 23;
  memcpy(&result, &bits, sizeof result);
  return result;
}

int32_t fit_log2_q24(uint32_t value) {
  int32_t whole = 31 - __builtin_clz(value);
  int32_t f_q28 = (int32_t)((whole > 28 ? value >> (whole - 28) : value << (28 - whole)) & 0x0FFFFFFF);
  /* Least-squares polynomial of log2(1 + f) on Chebyshev nodes of [0, 1], coefficients Q28. */
  int32_t f_q30 = f_q28 << 2;
  int32_t sum = -22242749;
  sum = fixed_mul_q30(sum, f_q30) + 86403926;
  sum = fixed_mul_q30(sum, f_q30) - 181930323;
  sum = fixed_mul_q30(sum, f_q30) + 386181455;
  sum = fixed_mul_q30(sum, f_q30);
  return (whole << 24) + (sum >> 4);
}

int32_t fit_fixed(float value, int q) {
  uint32_t pattern = bytes_from_f32(value);
  int shift = (int)(pattern >> 23 & 0xFFu) - 150 + q;
  uint32_t size = (pattern & 0x7FFFFFu) | 0x800000u;
  if (shift > 7) {
    size = INT32_MAX;
  } else if (shift >= 0) {
    size <<= shift;
  } else {
    size = shift > -24 ? size >> -shift : 0;
  }
  return pattern >> 31 ? -(int32_t)size : (int32_t)size;
}

float fit_float(int32_t mantissa, int32_t exponent) {
  if (mantissa == 0) {
    return 0.0f;
  }
  uint32_t sign = mantissa < 0 ? UINT32_C(1) << 31 : 0;
  uint32_t size = mantissa < 0 ? 0u - (uint32_t)mantissa : (uint32_t)mantissa;
  int32_t bits = fixed_bits(size);
  if (bits > 24) {
    int32_t shift = bits - 24;
    size = (size + (UINT32_C(1) << (shift - 1))) >> shift;
  } else {
    size <<= 24 - bits;
  }
  int32_t biased = exponent + bits - 1 + 127;
  if (biased <= 0) {
    return 0.0f;
  }
  if (biased >= 156) { /* 2^29: more than any result can mean */
    return sign ? -FIT_HUGE : FIT_HUGE;
  }
  uint32_t word = sign | (((uint32_t)biased << 23) + size - (UINT32_C(1) << 23));
  float value;
  memcpy(&value, &word, sizeof value);
  return value;
}
