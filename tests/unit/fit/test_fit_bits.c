/* Fits to the bit: presses by chance through each kernel, the same that other machines are held against. What changes a
 * result was meant to, or is a mistake; where it was meant, the test says what to put here. */
#include "emulated/fit_bits/fit_bits.h"
#include "support/golden.h"
#include "support/unit.h"

#define PRESSES 4000

TEST(each_kernel_has_its_bits) {
  static const uint32_t golden[FIT_BITS_KERNELS][GOLDEN_BLOCKS] = {
      [FIT_BITS_GRID] = {0xD5232777, 0xDE2B914B, 0xEB8773A4, 0x5C6F81AF, 0xB2C8E1CE, 0xF4DF0EEE, 0x511F76AB, 0xE87CA06C},
      [FIT_BITS_MASKED] = {0x0AEA4786, 0x765582D6, 0x3A9BA157, 0x3B2DD774, 0xB461A86E, 0x6BFA0916, 0xF4037D35, 0x2A37F48E},
      [FIT_BITS_GENERAL] = {0x4BE81A6A, 0x7E28B013, 0xBFA802CD, 0xEFDC0209, 0xD26FF555, 0xD9EBDA6C, 0x049CF477, 0x25EB5ABF},
      [FIT_BITS_TANGENTIAL] = {0x6A074892, 0x36F9AB40, 0x9A38194F, 0xBD9CEA7C, 0x0897A1BB, 0xFB3F2215, 0xF61D5E8D, 0xD0AA09D1},
      [FIT_BITS_DOUBT] = {0x483AD4B7, 0x0D045054, 0x5AEEAD40, 0xBB4B37AE, 0x764DF7F1, 0x8B783243, 0xFF4E15D7, 0x46B384E2},
      [FIT_BITS_SHAPES] = {0x4B71657C, 0x942B305E, 0x9D6EA631, 0x98F2EBCA, 0x232B17C8, 0x828557FB, 0x057F8CC2, 0x865509D5},
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
