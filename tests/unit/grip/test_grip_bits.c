/* Control to the bit: every command and report of grasps by chance, half of them plausible. What
 * changes one of them was meant to, or is a mistake; where it was meant, the test says what to put
 * here. */
#include "common/crc32.h"
#include "emulated/fit_bits/draw.h"
#include "emulated/fit_bits/grip_bits.h"
#include "unity.h"

#define GRASPS 600

void setUp(void) {}
void tearDown(void) {}

void grip_bits_count(bool on) {
  (void)on;
}

static void test_grasps_are_the_same_to_the_bit(void) {
  uint32_t found[2] = {0, 0}; /* plausible or not */
  draw_from(UINT64_C(0x67726970));
  for (uint32_t grasp = 0; grasp < GRASPS; grasp++) {
    const uint32_t both[2] = {found[grasp % 2], grip_bits_of(grasp)};
    found[grasp % 2] = crc32_iso_hdlc((const uint8_t *)both, sizeof both);
  }
  TEST_ASSERT_EQUAL_HEX32(0x7DDFF3A5, found[0]);
  TEST_ASSERT_EQUAL_HEX32(0xEB5144CE, found[1]);
}

int main(void) {
  UNITY_BEGIN();
  RUN_TEST(test_grasps_are_the_same_to_the_bit);
  return UNITY_END();
}
