/* Fits to the bit: presses by chance through each kernel, the same that other machines are held
 * against. What changes a result was meant to, or is a mistake; where it was meant, the test says
 * what to put here. */
#include "emulated/fit_bits/fit_bits.h"
#include "support/golden.h"
#include "support/unit.h"

#define PRESSES 4000

TEST(each_kernel_has_its_bits) {
  static const uint32_t golden[FIT_BITS_KERNELS][GOLDEN_BLOCKS] = {
      [FIT_BITS_GRID] = {0xE97B467A, 0x67ABAAE8, 0x8E2909B2, 0xD770AEF9, 0x433F8D74, 0xD2C499AD, 0x6F8F3B04,
                         0xB07BF7E8},
      [FIT_BITS_MASKED] = {0x89ABA6DB, 0x64500DF9, 0xA9C869B1, 0x0267EE9B, 0x50B8DF61, 0x84BE4202, 0xAF66597B,
                           0x90BAD1AE},
      [FIT_BITS_GENERAL] = {0x8D40836E, 0xC739FF9F, 0x4C71C79C, 0x816467EB, 0x707CCA4D, 0x768442AA, 0xA72DD1AE,
                            0x3ABDFC42},
      [FIT_BITS_TANGENTIAL] = {0xE1DCDF06, 0x159E436C, 0x48A5C952, 0x7755F775, 0x056BFB16, 0x74DCC3FC, 0x33FA61A4,
                               0x4B60AB88},
      [FIT_BITS_DOUBT] = {0xC6F47A07, 0x977DAC26, 0x1450DC2C, 0x9546E7E9, 0x86149E79, 0x0345BE24, 0xACB4673A,
                          0xB1D914F3},
      [FIT_BITS_SHAPES] = {0x4A07783F, 0xF4C275E4, 0x7337FA31, 0x3679C58F, 0xF117CE42, 0xBCEA7512, 0xE0223D2A,
                           0xC06EBED7},
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
