/* The one place of a contact: the Gaussian's, the load's or its shape's. And how much of the work on shapes a frame has time for. */
#include "contact/shapes.h"
#include "support/unit.h"

static struct shapes_report report;
static struct fit_result fit;
static struct tangential_force load;

void setUp(void) {
  report = (struct shapes_report){.shape = FIT_SHAPE_UNDECIDED};
  fit = (struct fit_result){.x_mm = 2.0f, .y_mm = -5.0f, .location_sd_mm = 0.3f};
  load = (struct tangential_force){.x_mm = 4.0f, .y_mm = -8.0f, .location_sd_mm = 0.4f};
}

/* Each as long as the longest, and the load, which takes several steps of slow frames. */
TEST(parts_and_the_load_take_no_longer_than_frames_are_apart) {
  for (uint64_t apart_us = 765; apart_us < 100000; apart_us += 5) {
    const uint8_t parts = shapes_parts(apart_us);
    const unsigned load_us = apart_us < 4500 ? 450 : 2250;
    TEST_ASSERT_TRUE(parts == 1 || (parts >= FIT_SHAPES_PARTS && parts * SHAPES_PART_us + load_us <= apart_us));
  }
  TEST_ASSERT_EQUAL(1, shapes_parts(1499));
  TEST_ASSERT_EQUAL(FIT_SHAPES_PARTS, shapes_parts(1500));
  TEST_ASSERT_EQUAL(FIT_SHAPES_FRAMES * FIT_SHAPES_PARTS, shapes_parts(UINT64_MAX));
}

static void has_middle(enum fit_shape shape) {
  report.shape = shape;
  report.from_fit_x_mm = -1.0f;
  report.from_fit_y_mm = 0.5f;
}

static void is_at(float x_mm, float y_mm, float sd_mm, const struct tangential_force *of) {
  const struct shapes_location place = shapes_locate(&report, &fit, of);
  TEST_ASSERT_FLOAT_WITHIN(1e-6f, x_mm, place.x_mm);
  TEST_ASSERT_FLOAT_WITHIN(1e-6f, y_mm, place.y_mm);
  TEST_ASSERT_FLOAT_WITHIN(2e-3f * sd_mm, sd_mm, place.location_sd_mm);
}

TEST(what_presses_is_where_the_load_or_the_Gaussian_has_it) {
  static const enum fit_shape shapes[] = {FIT_SHAPE_UNDECIDED, FIT_SHAPE_TWO, FIT_SHAPE_NONE};
  for (unsigned i = 0; i < sizeof shapes / sizeof shapes[0]; i++) {
    report.shape = shapes[i];
    is_at(2.0f, -5.0f, 0.3f, NULL);
    is_at(4.0f, -8.0f, 0.4f, &load);
  }
}

TEST(what_the_gaussian_and_a_long_or_pulled_shape_differ_by_is_part_of_the_error) {
  static const enum fit_shape shapes[] = {FIT_SHAPE_TANGENTIAL, FIT_SHAPE_ELONGATED};
  for (unsigned i = 0; i < sizeof shapes / sizeof shapes[0]; i++) {
    has_middle(shapes[i]);
    is_at(2.0f, -5.0f, 1.15758f, NULL); /* 0.3, 1 and 0.5 mm */
    fit.y_mm += 0.25f;                  /* both move */
    is_at(2.0f, -4.75f, 1.15758f, NULL);
    fit.y_mm -= 0.25f;
  }
}

TEST(what_the_load_and_a_long_shape_differ_by_is_part_of_the_error) {
  has_middle(FIT_SHAPE_ELONGATED);
  is_at(4.0f, -8.0f, 4.62709f, &load); /* 0.4, 3 and 3.5 mm */
  load.x_mm = 0.0f;
  is_at(0.0f, -8.0f, 3.66197f, &load); /* 0.4, 1 and 3.5 mm */
  report.shape = FIT_SHAPE_TANGENTIAL; /* the load's estimate knows that */
  is_at(0.0f, -8.0f, 0.4f, &load);
}

TEST(what_a_round_shape_leaves_is_doubt) {
  report.shape = FIT_SHAPE_ROUND;
  report.chi_square_ratio = 1.0f;
  is_at(2.0f, -5.0f, 0.3f, NULL);
  report.chi_square_ratio = 2.5f;
  is_at(2.0f, -5.0f, 0.75f, NULL);
  is_at(4.0f, -8.0f, 1.0f, &load);
}
