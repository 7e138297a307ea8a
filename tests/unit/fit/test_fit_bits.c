/* Fits to the bit: presses by chance through each kernel, the same that other machines are held
 * against. What changes a result was meant to, or is a mistake; where it was meant, the test says
 * what to put here. */
#include "emulated/fit_bits/fit_bits.h"
#include "support/golden.h"
#include "support/unit.h"

#define PRESSES 4000

TEST(each_kernel_has_its_bits) {
  static const uint32_t golden[FIT_BITS_KERNELS][GOLDEN_BLOCKS] = {
      [FIT_BITS_GRID] = {0x687BC250, 0x2F74E62F, 0x6CD39F1E, 0x08643779, 0xC28EB28A, 0x1237EBCF, 0x22C64CF2,
                         0xFB1D661D},
      [FIT_BITS_MASKED] = {0x7CB09718, 0xD83C2FD0, 0x811BB3F8, 0xCCA2400A, 0xDD1B2093, 0x47FE70CD, 0x309CE048,
                           0xC0250697},
      [FIT_BITS_GENERAL] = {0x1F659433, 0x6213393E, 0x9F221790, 0x225DB1D1, 0xCF4A284B, 0xDF8B9270, 0xD24B5381,
                            0xA318E861},
      [FIT_BITS_TANGENTIAL] = {0xCBD43395, 0x8ACDCFAF, 0x3CD474A4, 0x0B72DB39, 0xF9CED3ED, 0x05984698, 0xBD8CBA05,
                               0x2D4AD7FD},
      [FIT_BITS_DOUBT] = {0x3D08903E, 0x301F042C, 0x3177F747, 0x7EA1A19F, 0x8742703B, 0xDD5D6063, 0xF0F1E3B8,
                          0x74D21670},
      [FIT_BITS_SHAPES] = {0x39B8E7C4, 0x357535AA, 0xBF4F10A4, 0xA983E010, 0xF1111DA7, 0xE2D54482, 0x22ECF723,
                           0x29DA0D95},
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
