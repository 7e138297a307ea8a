/* Fits to the bit: presses by chance through each kernel, the same that other machines are held
 * against. What changes a result was meant to, or is a mistake; where it was meant, the test says
 * what to put here. */
#include "emulated/fit_bits/fit_bits.h"
#include "emulated/fit_bits/grip_bits.h"
#include "support/golden.h"
#include "unity.h"

#define PRESSES 4000

void setUp(void) {}
void tearDown(void) {}

void grip_bits_count(bool on) {
  (void)on;
}

static void assert_kernel(enum fit_bits_kernel kernel, const uint32_t golden[GOLDEN_BLOCKS]) {
  uint32_t found[GOLDEN_BLOCKS] = {0};
  for (uint32_t press = 0; press < PRESSES; press++) {
    uint32_t *block = &found[press / (PRESSES / GOLDEN_BLOCKS)];
    *block = golden_join(*block, fit_bits_of(kernel, press));
  }
  golden_assert("presses", PRESSES, golden, found);
}

static void test_grid(void) {
  static const uint32_t golden[GOLDEN_BLOCKS] = {0x978AE685, 0x8083E9F9, 0xF827D807, 0xD5BE9C6A,
                                                 0xC8ACBA54, 0x7FE77188, 0x649912D5, 0x898DD352};
  assert_kernel(FIT_BITS_GRID, golden);
}

static void test_masked(void) {
  static const uint32_t golden[GOLDEN_BLOCKS] = {0xF0410D41, 0x912B69FF, 0x838B8ECF, 0xEE414FE3,
                                                 0x0FA3A8A1, 0xA02B9C2F, 0x724ACC64, 0x44829DB5};
  assert_kernel(FIT_BITS_MASKED, golden);
}

static void test_general(void) {
  static const uint32_t golden[GOLDEN_BLOCKS] = {0xF6246B14, 0x5737B5F2, 0x1875AD72, 0xB39D2A6F,
                                                 0x73185244, 0xCACDA96B, 0x81F28B59, 0x55D3C4E6};
  assert_kernel(FIT_BITS_GENERAL, golden);
}

static void test_tangential(void) {
  static const uint32_t golden[GOLDEN_BLOCKS] = {0x2AA10738, 0xD15E993E, 0x95F7C692, 0x41F6E70F,
                                                 0x47969BEE, 0xA1B45187, 0x2B127E2C, 0xCF0CFBE6};
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
