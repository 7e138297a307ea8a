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
  static const uint32_t golden[GOLDEN_BLOCKS] = {0x16D554F7, 0x38A4DDEE, 0xE4906E78, 0xC72C8BFF,
                                                 0x46F57D2A, 0xCF0529BB, 0x636F5702, 0xEC2A9AEB};
  assert_kernel(FIT_BITS_GRID, golden);
}

static void test_masked(void) {
  static const uint32_t golden[GOLDEN_BLOCKS] = {0x7E0E5AF5, 0x1DEA48DD, 0x141351F3, 0x8193F1B9,
                                                 0xF327A2E4, 0x80437C48, 0xBD0CEF7C, 0x33A28C32};
  assert_kernel(FIT_BITS_MASKED, golden);
}

static void test_general(void) {
  static const uint32_t golden[GOLDEN_BLOCKS] = {0x9AAC81BC, 0x649AE5ED, 0x1A998F8B, 0xB414C158,
                                                 0xD2C275D1, 0xC682644B, 0x552FB367, 0xA52E87F3};
  assert_kernel(FIT_BITS_GENERAL, golden);
}

static void test_tangential(void) {
  static const uint32_t golden[GOLDEN_BLOCKS] = {0xC3E2BE01, 0xCCB0098B, 0x147FA51A, 0xE77D65E3,
                                                 0x47112CD6, 0xF21DD318, 0x12D341CA, 0x5E5E4C58};
  assert_kernel(FIT_BITS_TANGENTIAL, golden);
}

static void test_load(void) {
  static const uint32_t golden[GOLDEN_BLOCKS] = {0x7B5C99A9, 0xC513D023, 0xFBB1218A, 0x2E7E065B,
                                                 0x0E288113, 0xE2692AEA, 0xF770BEA5, 0x30E014AF};
  assert_kernel(FIT_BITS_LOAD, golden);
}

static void test_shapes(void) {
  static const uint32_t golden[GOLDEN_BLOCKS] = {0x49751DC8, 0x7DEDB468, 0x2E25B439, 0x598C8D50,
                                                 0xD7AF6A85, 0x59C8029D, 0xB1FB3C64, 0x90F7F615};
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
