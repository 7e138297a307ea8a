/* Fits to the bit: presses by chance through each kernel, the same that other machines are held
 * against. What changes a result was meant to, or is a mistake; where it was meant, the test says
 * what to put here. */
#include "emulated/fit_bits/fit_bits.h"
#include "support/golden.h"
#include "unity.h"

#define PRESSES 4000

void setUp(void) {}
void tearDown(void) {}

static void assert_kernel(enum fit_bits_kernel kernel, const uint32_t golden[GOLDEN_BLOCKS]) {
  uint32_t found[GOLDEN_BLOCKS] = {0};
  for (uint32_t press = 0; press < PRESSES; press++) {
    uint32_t *block = &found[press / (PRESSES / GOLDEN_BLOCKS)];
    *block = golden_join(*block, fit_bits_of(kernel, press));
  }
  golden_assert("presses", PRESSES, golden, found);
}

static void test_grid(void) {
  static const uint32_t golden[GOLDEN_BLOCKS] = {0x24FA5860, 0x65D4BD2D, 0xE3B7F043, 0xA5EEB1C5,
                                                 0x15F49F8B, 0x9813D133, 0xC2408C85, 0x2DFCC8C2};
  assert_kernel(FIT_BITS_GRID, golden);
}

static void test_masked(void) {
  static const uint32_t golden[GOLDEN_BLOCKS] = {0x16201206, 0x47FB630D, 0x9BDC9398, 0xF0EFBF65,
                                                 0xE55724E1, 0x1301732F, 0x8DEF2726, 0xB7915B8A};
  assert_kernel(FIT_BITS_MASKED, golden);
}

static void test_general(void) {
  static const uint32_t golden[GOLDEN_BLOCKS] = {0xA54705FB, 0xDB5896E2, 0xF466DD85, 0x1BEE272B,
                                                 0x7C9EFA99, 0x51853014, 0xEE16BF17, 0xA93816DE};
  assert_kernel(FIT_BITS_GENERAL, golden);
}

static void test_tangential(void) {
  static const uint32_t golden[GOLDEN_BLOCKS] = {0x64F44E82, 0x6E50DDB7, 0x1871A7C7, 0x7379EA3D,
                                                 0x69BF7109, 0x032BA012, 0x71878F01, 0x5A54756A};
  assert_kernel(FIT_BITS_TANGENTIAL, golden);
}

int main(void) {
  UNITY_BEGIN();
  fit_bits_init();
  RUN_TEST(test_grid);
  RUN_TEST(test_masked);
  RUN_TEST(test_general);
  RUN_TEST(test_tangential);
  return UNITY_END();
}
