/* Fits to the bit: presses by chance through each kernel, the same that other machines are held against. What changes a
 * result was meant to, or is a mistake; where it was meant, the test says what to put here. */
#include "emulated/fit_bits/fit_bits.h"
#include "support/golden.h"
#include "support/unit.h"

#define PRESSES 4000

TEST(each_kernel_has_its_bits) {
  static const uint32_t golden[FIT_BITS_KERNELS][GOLDEN_BLOCKS] = {
      [FIT_BITS_GRID] = {0xD5232777, 0xDE2B914B, 0xEB8773A4, 0x5C6F81AF, 0xB2C8E1CE, 0xF4DF0EEE, 0x511F76AB, 0xE87CA06C},
      [FIT_BITS_MASKED] = {0x67DFF11F, 0xCEAB16AB, 0xB2A9F56C, 0x35BA504D, 0x41844E99, 0x86C689B4, 0xA2BFBF6D, 0xB3C13A0D},
      [FIT_BITS_GENERAL] = {0x262BF5E4, 0xF21C40A3, 0xEBF6F2D1, 0xA9E78D3E, 0x64DB51AC, 0x6CCC26A3, 0x5154D694, 0x0D757FA2},
      [FIT_BITS_TANGENTIAL] = {0x6A074892, 0x36F9AB40, 0x9A38194F, 0xBD9CEA7C, 0x0897A1BB, 0xFB3F2215, 0xF61D5E8D, 0xD0AA09D1},
      [FIT_BITS_DOUBT] = {0x8C1A426F, 0x5FEE5957, 0x245FBCF8, 0x0E29CB27, 0x076A7D3D, 0x89BE618E, 0x5BC54123, 0xB3EC5BCA},
      [FIT_BITS_SHAPES] = {0x89C5B717, 0xCC598CD1, 0x705DC29A, 0xBE987BEA, 0x9EC2EB2D, 0xA34647DA, 0xEE96FCBB, 0xAEBA6E8A},
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
