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
  static const uint32_t golden[GOLDEN_BLOCKS] = {0x16D554F7, 0x38A4DDEE, 0xE4906E78, 0x87262455,
                                                 0x46F57D2A, 0xB1F1C0EF, 0x636F5702, 0xEC2A9AEB};
  assert_kernel(FIT_BITS_GRID, golden);
}

static void test_masked(void) {
  static const uint32_t golden[GOLDEN_BLOCKS] = {0xBC544CD9, 0xEA3039E8, 0x2C82C0D9, 0xA41AD9E2,
                                                 0x506957BD, 0x9A51CEB1, 0xB7C6BEC7, 0xEA224022};
  assert_kernel(FIT_BITS_MASKED, golden);
}

static void test_general(void) {
  static const uint32_t golden[GOLDEN_BLOCKS] = {0x4AB24F96, 0x230D306A, 0x4B445F3A, 0x49A9EA71,
                                                 0x862B78C9, 0x23F10E75, 0x43BCB503, 0x7B8D708D};
  assert_kernel(FIT_BITS_GENERAL, golden);
}

static void test_tangential(void) {
  static const uint32_t golden[GOLDEN_BLOCKS] = {0x64F44E82, 0x6E50DDB7, 0x1871A7C7, 0x7379EA3D,
                                                 0x69BF7109, 0x032BA012, 0x71878F01, 0x5A54756A};
  assert_kernel(FIT_BITS_TANGENTIAL, golden);
}

static void test_load(void) {
  static const uint32_t golden[GOLDEN_BLOCKS] = {0xD9087FD7, 0x28A84B74, 0xC1E6BE10, 0x7F79C1C5,
                                                 0x267E674D, 0xE53C9600, 0x872F22ED, 0x0CCBE805};
  assert_kernel(FIT_BITS_LOAD, golden);
}

int main(void) {
  UNITY_BEGIN();
  fit_bits_init();
  RUN_TEST(test_grid);
  RUN_TEST(test_masked);
  RUN_TEST(test_general);
  RUN_TEST(test_tangential);
  RUN_TEST(test_load);
  return UNITY_END();
}
