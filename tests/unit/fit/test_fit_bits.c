/* Fits to the bit: presses by chance through each kernel, the same that other machines are held against. What changes a
 * result was meant to, or is a mistake; where it was meant, the test says what to put here. */
#include "emulated/fit_bits/fit_bits.h"
#include "support/golden.h"
#include "support/unit.h"

#define PRESSES 4000

TEST(each_kernel_has_its_bits) {
  static const uint32_t golden[FIT_BITS_KERNELS][GOLDEN_BLOCKS] = {
      [FIT_BITS_GRID] = {0xD5232777, 0xDE2B914B, 0xEB8773A4, 0x5C6F81AF, 0xB2C8E1CE, 0xF4DF0EEE, 0x511F76AB, 0xE87CA06C},
      [FIT_BITS_MASKED] = {0xC29F3EC8, 0xF7B12730, 0xE0D8825D, 0x0722076A, 0x145E4667, 0x18CE20C2, 0xFB00CA6C, 0xC10D060A},
      [FIT_BITS_GENERAL] = {0xD9BCAA40, 0x3707B18F, 0x5F70C255, 0x8C2D577F, 0xE85F5D49, 0x4AFFF284, 0x40897FAB, 0x90132BFE},
      [FIT_BITS_TANGENTIAL] = {0x6A074892, 0x36F9AB40, 0x9A38194F, 0xBD9CEA7C, 0x0897A1BB, 0xFB3F2215, 0xF61D5E8D, 0xD0AA09D1},
      [FIT_BITS_BIAS] = {0x3736008E, 0x84FDD662, 0xB7CDF52F, 0x2737716D, 0x179FB2AB, 0x66C1DAE7, 0x781D479F, 0x312115AA},
      [FIT_BITS_SHAPES] = {0xAAC2ACCE, 0x0EE401E5, 0xC01ED08D, 0x58F689F0, 0x18D92BB4, 0x461FA925, 0xCF84E1BA, 0x4E12C747},
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
