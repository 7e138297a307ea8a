/* The array's layout: three strips of five sensors, 9 mm apart (De Clercq et al., RA-L 2022). */
#include "config/geometry.h"
#include "support/unit.h"

TEST(test_sensors_are_where_the_boards_have_them) {
  TEST_ASSERT_EQUAL(15, geometry.sensor_count);
  TEST_ASSERT_EQUAL_FLOAT(9.0f, geometry.pitch_mm);
  for (int k = 0; k < 15; k++) {
    TEST_ASSERT_EQUAL_FLOAT(9.0f * (float)(k / 5 - 1), geometry.x_mm[k]);
    TEST_ASSERT_EQUAL_FLOAT(9.0f * (float)(k % 5 - 2), geometry.y_mm[k]);
  }
}
