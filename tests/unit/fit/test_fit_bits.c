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
  static const uint32_t golden[GOLDEN_BLOCKS] = {0xC6F24B07, 0xB303E0A9, 0xDAF434F5, 0xE8DBC3C0,
                                                 0x0FF30D0D, 0x37F8A40A, 0x037B1BE4, 0x7DEFB2A1};
  assert_kernel(FIT_BITS_GRID, golden);
}

static void test_masked(void) {
  static const uint32_t golden[GOLDEN_BLOCKS] = {0x757740FD, 0x04766BC7, 0x38DB261C, 0x38C01F48,
                                                 0x92491547, 0x5D7DF5BC, 0xE1D169CF, 0xAAA57124};
  assert_kernel(FIT_BITS_MASKED, golden);
}

static void test_general(void) {
  static const uint32_t golden[GOLDEN_BLOCKS] = {0xF71353EF, 0xD4AABC0D, 0x422D4287, 0x00659324,
                                                 0x0B82AE0F, 0xCF7A1182, 0x6171BA0A, 0xBB1F4F24};
  assert_kernel(FIT_BITS_GENERAL, golden);
}

static void test_tangential(void) {
  static const uint32_t golden[GOLDEN_BLOCKS] = {0x9E8EA1A3, 0x5A280169, 0x8299E09D, 0xAAAEE3E4,
                                                 0xAC30B6AE, 0x73833EC2, 0x61BDF3CB, 0x79C67C9A};
  assert_kernel(FIT_BITS_TANGENTIAL, golden);
}

static void test_load(void) {
  static const uint32_t golden[GOLDEN_BLOCKS] = {0x61B1DBEC, 0x8D6A68EB, 0xD172BFF5, 0xC177C4EC,
                                                 0xE86C680E, 0x9F902A16, 0xB66F2FED, 0x3837C84A};
  assert_kernel(FIT_BITS_LOAD, golden);
}

static void test_shapes(void) {
  static const uint32_t golden[GOLDEN_BLOCKS] = {0x6CA2301C, 0x58412975, 0x9D4657A7, 0x8924C546,
                                                 0x66673E27, 0x24C7DFD4, 0xAD8E2BFC, 0xC036D5B9};
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
