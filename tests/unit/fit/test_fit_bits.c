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
  static const uint32_t golden[GOLDEN_BLOCKS] = {0x8FDF38BF, 0x923D38F7, 0x5272FA73, 0xBFF36594,
                                                 0xA7611A83, 0x355B299A, 0xD0D4A492, 0x23FF92D4};
  assert_kernel(FIT_BITS_GRID, golden);
}

static void test_masked(void) {
  static const uint32_t golden[GOLDEN_BLOCKS] = {0x89ABA6DB, 0x64500DF9, 0xA9C869B1, 0x0267EE9B,
                                                 0x50B8DF61, 0x84BE4202, 0xAF66597B, 0x90BAD1AE};
  assert_kernel(FIT_BITS_MASKED, golden);
}

static void test_general(void) {
  static const uint32_t golden[GOLDEN_BLOCKS] = {0x9F2CC963, 0x3ADB5C4C, 0xD3EB0C19, 0xAF1A0879,
                                                 0x4745DF5D, 0x8D086F56, 0xDC537A0F, 0xB0209D9A};
  assert_kernel(FIT_BITS_GENERAL, golden);
}

static void test_tangential(void) {
  static const uint32_t golden[GOLDEN_BLOCKS] = {0xA5748E08, 0xA4FF5257, 0xA1D7CD92, 0x0A95D0AA,
                                                 0x7BCB3B30, 0x3CECE19E, 0x892481CD, 0xE4FEAFF6};
  assert_kernel(FIT_BITS_TANGENTIAL, golden);
}

static void test_load(void) {
  static const uint32_t golden[GOLDEN_BLOCKS] = {0xC39D5714, 0x0943CED3, 0x390C9ADD, 0xBD59C99D,
                                                 0x1FAB8159, 0x5B14F104, 0xF91D762F, 0x4377B278};
  assert_kernel(FIT_BITS_LOAD, golden);
}

static void test_shapes(void) {
  static const uint32_t golden[GOLDEN_BLOCKS] = {0x853BD49B, 0x8ACCB6E3, 0x3DABB0FA, 0x32F28E53,
                                                 0xC22DE80F, 0x8D76B0ED, 0xED886D93, 0xDDB32F97};
  assert_kernel(FIT_BITS_SHAPES, golden);
}

int main(void) {
  UNITY_BEGIN();
  fit_bits_init();
  RUN_TEST(test_grid);
  RUN_TEST(test_masked);
  RUN_TEST(test_general);
  RUN_TEST(test_tangential);
  RUN_TEST(test_load);
  RUN_TEST(test_shapes);
  return UNITY_END();
}
