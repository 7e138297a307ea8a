/* Fits to the bit: presses by chance through each kernel, the same that other machines are held against. What changes a
 * result was meant to, or is a mistake; where it was meant, the test says what to put here. */
#include "emulated/fit_bits/fit_bits.h"
#include "support/golden.h"
#include "support/unit.h"

#define PRESSES 4000

TEST(each_kernel_has_its_bits) {
  static const uint32_t golden[FIT_BITS_KERNELS][GOLDEN_BLOCKS] = {
      [FIT_BITS_GRID] = {0xD5232777, 0xDE2B914B, 0xEB8773A4, 0x5C6F81AF, 0xB2C8E1CE, 0xF4DF0EEE, 0x511F76AB, 0xE87CA06C},
      [FIT_BITS_MASKED] = {0x0EB26E91, 0x8C2FA144, 0xDEB196D6, 0x836484EE, 0x7306DF8D, 0x9202B96F, 0x4CBA5317, 0x3409E3F2},
      [FIT_BITS_GENERAL] = {0x1F659433, 0x6213393E, 0x9F221790, 0x225DB1D1, 0xCF4A284B, 0xDF8B9270, 0xD24B5381, 0xA318E861},
      [FIT_BITS_TANGENTIAL] = {0x6A074892, 0x36F9AB40, 0x9A38194F, 0xBD9CEA7C, 0x0897A1BB, 0xFB3F2215, 0xF61D5E8D, 0xD0AA09D1},
      [FIT_BITS_DOUBT] = {0xFD6DF5A7, 0xDDC9B806, 0x665D9D81, 0x2AA9AF99, 0xB7282512, 0xFBA6B882, 0x0072D6B5, 0x35E6FA64},
      [FIT_BITS_SHAPES] = {0x39B8E7C4, 0x357535AA, 0xBF4F10A4, 0xA983E010, 0xF1111DA7, 0xE2D54482, 0x22ECF723, 0x29DA0D95},
  };
  fit_bits_init();
  for (int kernel = 0; kernel < FIT_BITS_KERNELS; kernel++) {
    uint32_t found[GOLDEN_BLOCKS] = {0};
    for (uint32_t press = 0; press < PRESSES; press++) {
      uint32_t *block = &found[press / (PRESSES / GOLDEN_BLOCKS)];
      *block = golden_join(*block, fit_bits_of((enum fit_bits_kernel)kernel, press));
    }
    golden_assert("presses", PRESSES, golden[kernel], found);
  }
}
