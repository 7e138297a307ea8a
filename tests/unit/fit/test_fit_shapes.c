/* One contact, a long one, one that pulls, two, and what is none of these. */
#include "common/contact_flags.h"
#include "fit/fit_shapes.h"
#include "fit/fit_shapes_parts.h"
#include "pad_press.h"

#define SENSORS GRID_SENSORS
#define ALL ((UINT32_C(1) << SENSORS) - 1)
#define NOISE_Pa 4.0
#define PI 3.14159265358979

static struct fit_array array;
static struct fit_shapes_pad pad;
static struct random noise;
static double reading_Pa[SENSORS], noise_Pa;
static struct pad_press rubber;
static struct fit_shapes_state state;
static struct fit_shapes_result result;
static float worst_line; /* chi^2 of that model, of all answers since it was 0 */

static void clear(void) { memset(reading_Pa, 0, sizeof reading_Pa); }

void setUp(void) {
  make_grid_of_15(&array);
  rubber = (struct pad_press){.profile = pad_of_12_mm(), .dip_sd_mm = 14.0};
  TEST_ASSERT_EQUAL(FT_OK, fit_shapes_init(&pad, &array, &rubber.profile));
  noise = (struct random){UINT64_C(20221015)};
  noise_Pa = NOISE_Pa;
  clear();
}

static double any(double low, double high) { return random_between(&noise, low, high); }

/* Adds a contact with a spread of 4 mm^2 to the readings. */
static void pull(double x_mm, double y_mm, double force_N, double qx_N, double qy_N) {
  const struct contact contact = {x_mm, y_mm, force_N, qx_N, qy_N, 4.0};
  for (int k = 0; k < SENSORS; k++) {
    reading_Pa[k] += pad_press_Pa(&rubber, &contact, k);
  }
}

static void press(double x_mm, double y_mm, double force_N) { pull(x_mm, y_mm, force_N, 0.0, 0.0); }

static void line(double x_mm, double y_mm, double length_mm, double angle_rad, double force_N) {
  const int parts = 60;
  for (int i = 0; i < parts; i++) {
    double at = length_mm * ((i + 0.5) / parts - 0.5);
    press(x_mm + at * cos(angle_rad), y_mm + at * sin(angle_rad), force_N / parts);
  }
}

static void spread_gains(double spread) {
  for (int k = 0; k < SENSORS; k++) {
    reading_Pa[k] *= 1.0 + spread * any(-1.7, 1.7);
  }
}

static struct fit_settings usual(void) {
  struct fit_settings settings = {.iterations = 4, .noise_Pa_q10 = (int32_t)(1024 * NOISE_Pa)};
  fit_set_errors(&settings, 0.01f, 0.0065f);
  settings.dip_share = (float)rubber.dip_share;
  settings.dip_sd_mm = 14.0f;
  settings.deviations = rubber.deviations;
  return settings;
}

static void read_q10(int32_t *pressure_Pa_q10) {
  for (int k = 0; k < SENSORS; k++) {
    pressure_Pa_q10[k] = (int32_t)lround(1024.0 * (reading_Pa[k] + noise_Pa * any(-1.7, 1.7)));
  }
}

static bool frame(uint32_t usable) {
  const struct fit_settings settings = usual();
  int32_t pressure_Pa_q10[SENSORS];
  struct fit_result fit;
  read_q10(pressure_Pa_q10);
  fit_gaussian(&array, pressure_Pa_q10, usable, &settings, &fit);
  const bool answers = fit_shapes(&array, &pad, pressure_Pa_q10, &settings, &fit, &state, &result);
  worst_line = fmaxf(worst_line, result.chi_square[LONG]);
  return answers;
}

static void begin(void) {
  memset(&state, 0, sizeof state);
  memset(&result, 0xFF, sizeof result);
  worst_line = 0.0f;
}

static enum fit_shape hold(uint32_t usable, int frames) {
  begin();
  for (int i = 0; i < frames; i++) {
    frame(usable);
  }
  return result.shape;
}

static enum fit_shape held(void) { return hold(ALL, FIT_SHAPES_FRAMES); }

TEST(test_a_round_press_is_one_at_its_place_and_force) {
  for (int i = 0; i < 100; i++) {
    double x = any(-8.0, 8.0), y = any(-17.0, 17.0), force = any(2.0, 12.0);
    rubber.dip_share = i % 2 ? 0.015 : 0.0;
    clear();
    press(x, y, force);
    TEST_ASSERT_EQUAL(FIT_SHAPE_ROUND, held());
    TEST_ASSERT_FLOAT_WITHIN(0.15f, (float)x, result.x_mm[0]);
    TEST_ASSERT_FLOAT_WITHIN(0.15f, (float)y, result.y_mm[0]);
    TEST_ASSERT_FLOAT_WITHIN(0.02f * (float)force, (float)force, result.force_N[0]);
    TEST_ASSERT_TRUE(result.location_sd_mm[0] > 0.0f && result.location_sd_mm[0] < 0.6f);
    TEST_ASSERT_TRUE(result.force_sd_N[0] > 0.0f);
  }
}

/* Each sensor is off its place by 0.16 mm at most, and 6 % wider or narrower. */
TEST(test_what_is_the_sensors_own_is_taken_out) {
  int right[2] = {0}; /* round, pairs */
  for (int i = 0; i < 100; i++) {
    pad_press_draw_deviations(&rubber, 600, 2000, &noise);
    double x = any(-6.0, 6.0);
    clear();
    press(x, i % 2 ? -8.0 : any(-16.0, 16.0), 6.0);
    if (i % 2) {
      press(-x, 8.0, 6.0);
    }
    right[i % 2] += held() == (i % 2 ? FIT_SHAPE_TWO : FIT_SHAPE_ROUND);
  }
  TEST_ASSERT_GREATER_OR_EQUAL_INT(47, right[0]);
  TEST_ASSERT_GREATER_OR_EQUAL_INT(47, right[1]);
}

TEST(test_a_pull_is_no_pair) {
  for (int i = 0; i < 60; i++) {
    double x = any(-6.0, 6.0), y = any(-15.0, 15.0), direction = any(0.0, 2.0 * PI);
    double qx = 1.8 * cos(direction), qy = 1.8 * sin(direction);
    clear();
    pull(x, y, 6.0, qx, qy);
    held();
    TEST_ASSERT_EQUAL(FIT_SHAPE_TANGENTIAL, result.shape);
    TEST_ASSERT_FLOAT_WITHIN(0.6f, (float)x, result.x_mm[0]);
    TEST_ASSERT_FLOAT_WITHIN(0.6f, (float)y, result.y_mm[0]);
    TEST_ASSERT_FLOAT_WITHIN(0.8f, (float)qx, result.qx_N);
    TEST_ASSERT_FLOAT_WITHIN(0.8f, (float)qy, result.qy_N);
  }
}

/* The longest are as long as the array: the blobs are near enough to each other to be a line. */
TEST(test_a_line_has_its_length_and_direction) {
  for (int i = 0; i < 100; i++) {
    const bool longest = i >= 60;
    double angle = longest ? any(0.4 * PI, 0.6 * PI) : any(-0.5 * PI, 0.5 * PI);
    double length = longest ? any(24.0, 32.0) : any(14.0, 22.0);
    clear();
    line(any(-3.0, 3.0), longest ? any(-2.0, 2.0) : any(-9.0, 9.0), length, angle, 8.0);
    TEST_ASSERT_EQUAL(FIT_SHAPE_ELONGATED, held());
    TEST_ASSERT_FLOAT_WITHIN(longest ? 2.0f : 1.5f, (float)length, result.length_mm);
    TEST_ASSERT_TRUE(result.along_x >= 0.0f);
    TEST_ASSERT_FLOAT_WITHIN(0.01f, 1.0f, result.along_x * result.along_x + result.along_y * result.along_y);
    double off = fabs((double)result.along_x * sin(angle) - (double)result.along_y * cos(angle));
    TEST_ASSERT_TRUE(off < 0.06);
    TEST_ASSERT_TRUE(off < 4.0 * (double)result.angle_sd_rad);
    TEST_ASSERT_TRUE(result.angle_sd_rad < 0.15f);
  }
}

/* Noise drives a line that the readings hardly show no further than they allow. With three seeds
 * chi^2 stays below 15, and is 32 to 79 where steps have the damping of answers. */
TEST(test_models_stay_where_they_have_settled) {
  for (int i = 0; i < 400; i++) {
    clear();
    line(any(-9.0, 9.0), (i % 2 ? 1 : -1) * any(12.0, 18.0), 3.0, any(-0.5 * PI, 0.5 * PI), 4.0);
    spread_gains(0.02);
    TEST_ASSERT_NOT_EQUAL(FIT_SHAPE_TWO, hold(ALL, FIT_SHAPES_FRAMES + 40));
    CHECK(worst_line < 22.0f, "chi^2 up to %.1f", (double)worst_line);
  }
}

/* Behind one another: three columns do not tell every pair beside one another from a line. */
TEST(test_two_have_their_places_and_forces) {
  for (int i = 0; i < 60; i++) {
    double angle = any(0.25 * PI, 0.75 * PI), half = any(6.5, 9.0);
    double middle_x = any(-2.0, 2.0), middle_y = any(-8.0, 8.0), x[2], y[2], force[2];
    rubber.dip_share = i % 2 ? 0.015 : 0.0;
    clear();
    for (int c = 0; c < 2; c++) {
      x[c] = middle_x + (c ? -1.0 : 1.0) * half * cos(angle);
      y[c] = middle_y + (c ? -1.0 : 1.0) * half * sin(angle);
      force[c] = c ? any(2.0, 4.0) : any(5.0, 8.0);
      press(x[c], y[c], force[c]);
    }
    TEST_ASSERT_EQUAL(FIT_SHAPE_TWO, held());
    for (int c = 0; c < 2; c++) { /* the stronger one first */
      TEST_ASSERT_FLOAT_WITHIN(0.5f, (float)x[c], result.x_mm[c]);
      TEST_ASSERT_FLOAT_WITHIN(0.5f, (float)y[c], result.y_mm[c]);
      TEST_ASSERT_FLOAT_WITHIN(0.06f * (float)force[c], (float)force[c], result.force_N[c]);
      TEST_ASSERT_TRUE(result.location_sd_mm[c] > 0.01f && result.location_sd_mm[c] < 1.0f);
      TEST_ASSERT_TRUE(result.force_sd_N[c] > 0.0f);
    }
  }
}

/* Where its Gaussian moves from frame to frame, the pair itself does not. */
TEST(test_a_pair_that_rests_is_not_moved) {
  for (int i = 0; i < 200; i++) {
    double x = any(-6.0, 6.0), y = any(-6.0, 6.0);
    clear();
    press(x, y + 10.0, 2.0);
    press(x - 3.0, y - 10.0, 2.0);
    spread_gains(0.01);
    TEST_ASSERT_EQUAL(FIT_SHAPE_TWO, held());
  }
}

/* The same contact becomes one of another shape. */
TEST(test_what_a_shape_does_not_have_is_zero) {
  noise_Pa = 0.0;
  begin();
  for (int i = 0; i < 4 * FIT_SHAPES_FRAMES; i++) {
    const double half = i < FIT_SHAPES_FRAMES ? 8.0 : i < 60 ? 0.2 * (59 - i) : 0.0;
    clear();
    press(0.0, half, 4.0);
    press(0.0, -half, 4.0);
    frame(ALL);
    if (i == FIT_SHAPES_FRAMES - 1) {
      TEST_ASSERT_EQUAL(FIT_SHAPE_TWO, result.shape);
      TEST_ASSERT_TRUE(result.force_N[1] > 3.0f);
    }
  }
  TEST_ASSERT_EQUAL(FIT_SHAPE_ROUND, result.shape);
  TEST_ASSERT_EQUAL_FLOAT(0.0f, result.force_N[1]);
  TEST_ASSERT_EQUAL_FLOAT(0.0f, result.y_mm[1]);
  TEST_ASSERT_EQUAL_FLOAT(0.0f, result.length_mm);
}

/* They lack the variance of a line of 6.3 mm beyond that across. */
TEST(test_what_is_short_or_as_wide_is_no_edge) {
  for (int i = 0; i < 40; i++) {
    clear();
    line(0.0, any(-8.0, 8.0), i % 2 ? 7.0 : 8.5, any(-0.5 * PI, 0.5 * PI), 8.0);
    TEST_ASSERT_EQUAL(FIT_SHAPE_ROUND, held());
  }
}

TEST(test_a_short_pair_is_a_long_contact_not_one) {
  press(4.0, 1.0, 4.0);
  press(-4.0, 1.0, 4.0);
  TEST_ASSERT_EQUAL(FIT_SHAPE_ELONGATED, held());
  TEST_ASSERT_FLOAT_WITHIN(0.05f, 1.0f, result.along_x);
}

TEST(test_three_are_none_of_these) {
  press(7.0, -14.0, 4.0);
  press(-7.0, 0.0, 4.0);
  press(7.0, 14.0, 4.0);
  TEST_ASSERT_EQUAL(FIT_SHAPE_NONE, held());
  TEST_ASSERT_EQUAL_FLOAT(0.0f, result.force_N[0]);
}

TEST(test_what_moves_is_followed) {
  noise_Pa = 0.0;
  begin();
  for (int i = 0; i < 80; i++) {
    double y = -12.0 + 0.3 * i, force = 3.0 + 0.05 * i;
    clear();
    press(1.0, y, force);
    if (frame(ALL) && i > 13) {
      TEST_ASSERT_EQUAL(FIT_SHAPE_ROUND, result.shape);
      TEST_ASSERT_FLOAT_WITHIN(0.2f, (float)y, result.y_mm[0]);
      TEST_ASSERT_FLOAT_WITHIN(0.04f * (float)force, (float)force, result.force_N[0]);
    }
  }
}

TEST(test_an_answer_takes_its_frames_its_sensors_and_a_press) {
  press(2.0, 3.0, 5.0);
  TEST_ASSERT_EQUAL(FIT_SHAPE_UNDECIDED, hold(ALL, FIT_SHAPES_FRAMES - 1));
  TEST_ASSERT_EQUAL(FIT_SHAPE_ROUND, hold(ALL & ~0x4001u, FIT_SHAPES_FRAMES));
  TEST_ASSERT_EQUAL(FIT_SHAPE_UNDECIDED, hold(ALL & ~0x3u, 1));
  TEST_ASSERT_EQUAL(FIT_SHAPE_UNDECIDED, hold(ALL & ~0x4013u, FIT_SHAPES_FRAMES));
  clear();
  press(2.0, 3.0, 0.02);
  TEST_ASSERT_EQUAL(FIT_SHAPE_UNDECIDED, held());
}

/* Within a thousandth of each limit. */
TEST(test_rubber_beyond_the_limits_is_refused) {
  for (int side = -1; side <= 1; side += 2) {
    const float share = 1.0f + 0.001f * (float)side;
    struct pad_profile others[] = {rubber.profile, rubber.profile, rubber.profile};
    others[0].normal[PAD_NORMAL_TERMS - 1].sd_mm = share * 1.5f * 9.0f;
    others[1].tangential[PAD_TANGENTIAL_TERMS - 1].sd_mm = share * 4.0f * 9.0f;
    others[2].normal[0].sd_mm = 9.0f * sqrtf(FIT_SHAPES_VARIANCE_MIN / share);
    for (int i = 0; i < 3; i++) {
      TEST_ASSERT_EQUAL(side > 0 ? FT_ERR_ARGUMENT : FT_OK, fit_shapes_init(&pad, &array, &others[i]));
    }
  }
  struct pad_profile wrong = rubber.profile;
  wrong.normal[0].share = NAN;
  TEST_ASSERT_EQUAL(FT_ERR_ARGUMENT, fit_shapes_init(&pad, &array, &wrong));
  struct fit_array line;
  const float along_mm[4] = {0, 9, 18, 27};
  TEST_ASSERT_EQUAL(FT_OK, fit_array_init(&line, 4, along_mm, along_mm, 9.0f));
  TEST_ASSERT_EQUAL(FT_ERR_ARGUMENT, fit_shapes_init(&pad, &line, &rubber.profile));
}

/* chi^2 + 14 must fall by a quarter. */
static int32_t limit_q8(int32_t unexplained_q8) { return 4 * (unexplained_q8 + (FIT_SHAPES_ERRORS << 8)) / 3 - (FIT_SHAPES_ERRORS << 8); }

/* Of these chi^2, and a pair and a line with these spans. */
static int32_t pair[FIT_SHAPES_UNKNOWNS], straight[FIT_SHAPES_UNKNOWNS];
static int best(int32_t of_round, int32_t of_line, int32_t of_pair) {
  struct fit_shapes_at at[MODELS] = {{{0}}};
  memcpy(at[TWO].value, pair, sizeof pair);
  memcpy(at[LONG].value, straight, sizeof straight);
  return fit_shapes_best((const int32_t[MODELS]){of_round, of_line, of_pair}, at);
}
static void set_pair(int32_t span_x, int32_t span_y) {
  memset(pair, 0, sizeof pair);
  memset(straight, 0, sizeof straight);
  pair[SPAN_X] = span_x;
  pair[SPAN_Y] = span_y;
}
/* Whether it is two if nothing but where they are stands against it. */
static bool is_two(void) { return best(1 << 20, 1 << 20, 0) == TWO; }

/* The pair needs the better of the two others to leave more than this. */
static void assert_limit(int32_t limit, int32_t of_pair) {
  const int32_t more = limit + 4096;
  TEST_ASSERT_NOT_EQUAL(TWO, best(limit, more, of_pair));
  TEST_ASSERT_NOT_EQUAL(TWO, best(more, limit, of_pair));
  TEST_ASSERT_EQUAL(TWO, best(limit + 1, more, of_pair));
  TEST_ASSERT_EQUAL(TWO, best(more, limit + 1, of_pair));
}

TEST(test_more_unknowns_must_explain_more) {
  const int32_t unexplained[] = {0, DEGREES_OF_FREEDOM << 8, (4 * DEGREES_OF_FREEDOM) << 8};
  const int32_t most = 1 << 30; /* chi^2 is no larger */
  set_pair(ONE_Q20 / 2, ONE_Q20 / 2);
  for (int i = 0; i < 3; i++) {
    assert_limit(limit_q8(unexplained[i]), unexplained[i]);
  }
  TEST_ASSERT_EQUAL(ROUND, best(most, most, most)); /* what no model explains */
  set_pair(0, 0);
  TEST_ASSERT_EQUAL(ROUND, best(limit_q8(DEGREES_OF_FREEDOM << 8), DEGREES_OF_FREEDOM << 8, 0));
  TEST_ASSERT_EQUAL(LONG, best(limit_q8(DEGREES_OF_FREEDOM << 8) + 1, DEGREES_OF_FREEDOM << 8, 0));
}

/* 25 mm at a pitch of 9 mm, as a pair across the array looks. */
TEST(test_a_pair_that_looks_too_long_may_explain_a_little_less) {
  const int32_t half = 11 * (ONE_Q20 / 8), step = ONE_Q20 / 512;
  const int32_t of_line = DEGREES_OF_FREEDOM << 8, most = of_line + (of_line + (FIT_SHAPES_ERRORS << 8)) / 8;
  for (int axis = SPAN_X; axis <= SPAN_Y; axis++) {
    set_pair(ONE_Q20 / 2, 0);
    straight[axis] = half;
    TEST_ASSERT_EQUAL(LONG, best(1 << 20, of_line, of_line));
    straight[axis] = -half - step;
    TEST_ASSERT_EQUAL(TWO, best(1 << 20, of_line, most - 1));
    TEST_ASSERT_EQUAL(LONG, best(1 << 20, of_line, most));
    pair[SPREAD] = ONE_Q20 / 80 + 1; /* wider than the contacts of balls that touch each other */
    TEST_ASSERT_EQUAL(LONG, best(1 << 20, of_line, most - 1));
    TEST_ASSERT_EQUAL(ROUND, best(of_line, of_line, of_line)); /* what a round contact explains is none */
  }
}

TEST(test_a_pair_is_apart_and_on_the_array) {
  const int32_t quarter = ONE_Q20 / 4, step = ONE_Q20 / 1024, half = ONE_Q20 / 2;
  const int32_t near[][2] = {{quarter, 0}, {0, -quarter}, {quarter / 2, quarter / 2}};
  const int32_t far[][2] = {{quarter + step, 0}, {0, -quarter - step}, {quarter, quarter / 2}};
  for (int i = 0; i < 3; i++) {
    set_pair(near[i][0], near[i][1]);
    TEST_ASSERT_FALSE(is_two());
    set_pair(far[i][0], far[i][1]);
    TEST_ASSERT_TRUE(is_two());
  }
  set_pair(3 * (ONE_Q20 / 8), 0);
  for (int touching = 0; touching < 2; touching++) {
    pair[SPREAD] = 9 * (ONE_Q20 / 64) / 3 - 1 + touching;
    TEST_ASSERT_EQUAL(touching == 0, is_two());
  }
  for (int i = 0; i < 16; i++) {
    const int axis = i & 1, sign = i & 2 ? 1 : -1, side = i & 4 ? 1 : -1, even = i & 8 ? 1 : 0;
    const struct fit_grid_shape grid = {.columns = (uint8_t)(3 + even), .rows = (uint8_t)(5 + even)}; /* whose middle is no node */
    fit_use_rectangle(&grid);
    set_pair(0, 0);
    pair[SPAN_X + axis] = side * half;
    pair[LOCATION_X] = pair[LOCATION_Y] = -even * half;
    pair[LOCATION_X + axis] += sign * ((axis ? grid.rows : grid.columns) * half - half - 1);
    TEST_ASSERT_TRUE(is_two());
    pair[LOCATION_X + axis] += 3 * sign;
    TEST_ASSERT_FALSE(is_two());
  }
}

/* Beside a square of sixteen, when the Gaussian jumps far from it. */
TEST(test_a_place_is_held_as_far_beside_each_side) {
  for (int i = 0; i < 4; i++) {
    struct fit_settings settings = usual();
    struct fit_result fit;
    float x_mm[16], y_mm[16];
    int32_t pressure_Pa_q10[16];
    const float side = i & 2 ? 1.0f : -1.0f;
    settings.deviations = NULL;
    for (int k = 0; k < 16; k++) {
      x_mm[k] = 9.0f * ((float)(k / 4) - 1.5f);
      y_mm[k] = 9.0f * ((float)(k % 4) - 1.5f);
      const double dx_mm = (double)(x_mm[k] - side * 9.0f), dy_mm = (double)(y_mm[k] - side * 9.0f);
      pressure_Pa_q10[k] = (int32_t)(1024.0 * pad_pressure_Pa(&rubber.profile, 4.0, dx_mm, dy_mm, (struct pad_load){5.0, 0.0, 0.0}));
    }
    TEST_ASSERT_EQUAL(FT_OK, fit_array_init(&array, 16, x_mm, y_mm, 9.0f));
    TEST_ASSERT_EQUAL(FT_OK, fit_shapes_init(&pad, &array, &rubber.profile));
    fit_gaussian(&array, pressure_Pa_q10, 0xFFFF, &settings, &fit);
    begin();
    fit_shapes(&array, &pad, pressure_Pa_q10, &settings, &fit, &state, &result);
    *(i & 1 ? &fit.y_mm : &fit.x_mm) += side * 50.0f;
    fit_shapes(&array, &pad, pressure_Pa_q10, &settings, &fit, &state, &result);
    const int32_t place_q20 = state.at[ROUND].value[i & 1 ? LOCATION_Y : LOCATION_X] + ONE_Q20 / 2;
    TEST_ASSERT_INT32_WITHIN(ONE_Q20 / 4, (int32_t)side * 3 * ONE_Q20, place_q20);
  }
}

/* How many frames a contact has after two of these readings, of a fit with these flags. */
static int frames_after(const int32_t frames_q10[2][SENSORS], uint32_t flags, int32_t noise_q10) {
  struct fit_settings settings = usual();
  settings.noise_Pa_q10 = noise_q10;
  const struct fit_result fit = {.flags = flags, .used = ALL};
  begin();
  for (int i = 0; i < 2; i++) {
    fit_shapes(&array, &pad, frames_q10[i], &settings, &fit, &state, &result);
  }
  return state.frames;
}

TEST(test_sums_that_no_contact_has_or_that_jump_begin_again) {
  /* 256 Pa where the largest reading, of 1000 Pa, is 0.98 of a unit; what the contact has then */
  static const int32_t sums_Pa[][3] = {{256, 256, 2}, {262, 262, 2}, {262, 250, 1}, {250, 262, 1}};
  for (int i = 0; i < 4; i++) {
    int32_t frames[2][SENSORS] = {{[7] = 1000 << 10}, {[7] = 1000 << 10}};
    frames[0][0] = (sums_Pa[i][0] - 1000) * 1024;
    frames[1][0] = (sums_Pa[i][1] - 1000) * 1024;
    TEST_ASSERT_EQUAL(sums_Pa[i][2], frames_after(frames, CONTACT_FLAG_FIT_VALID, 4096));
  }
  /* Four times as much against the largest reading, or a quarter, is another contact's: 3.9 and 4.1 times that. */
  static const int32_t others_Pa[] = {207, 222};
  for (int i = 0; i < 4; i++) {
    int32_t frames[2][SENSORS] = {{0}};
    for (int k = 0; k < SENSORS; k++) {
      frames[i % 2][k] = k == 7 ? 1000 << 10 : others_Pa[i / 2] << 10;
      frames[1 - i % 2][k] = k == 7 ? 1000 << 10 : 0;
    }
    TEST_ASSERT_EQUAL(i / 2 == 0 ? 2 : 1, frames_after(frames, CONTACT_FLAG_FIT_VALID, 4096));
  }
}

TEST(test_what_has_no_fit_or_no_noise_is_no_frame) {
  const int32_t frames[2][SENSORS] = {{[6] = 900 << 10, [7] = 1000 << 10, [8] = 900 << 10},
                                      {[6] = 900 << 10, [7] = 1000 << 10, [8] = 900 << 10}};
  TEST_ASSERT_EQUAL(2, frames_after(frames, CONTACT_FLAG_FIT_VALID, 1));
  TEST_ASSERT_EQUAL(0, frames_after(frames, CONTACT_FLAG_FIT_VALID, 0));
  TEST_ASSERT_EQUAL(0, frames_after(frames, 0, 1));
}

/* What a frame does in parts is what it does at once, and each ends when it should. */
TEST(test_parts_add_up_to_a_frame) {
  struct fit_shapes_state parts = {.frames = 0};
  struct fit_shapes_result of_parts = {FIT_SHAPE_UNDECIDED};
  static struct fit_shapes_pad other;
  rubber.dip_share = 0.015;
  const struct fit_settings settings = usual();
  TEST_ASSERT_EQUAL(FT_OK, fit_shapes_init(&other, &array, &rubber.profile));
  press(1.0, 8.0, 4.0);
  press(-2.0, -6.0, 4.0);
  begin();
  result = of_parts;
  for (int i = 0; i < 3 * FIT_SHAPES_FRAMES; i++) {
    int32_t pressure_Pa_q10[SENSORS];
    struct fit_result fit;
    read_q10(pressure_Pa_q10);
    fit_gaussian(&array, pressure_Pa_q10, ALL, &settings, &fit);
    const bool answers = fit_shapes(&array, &pad, pressure_Pa_q10, &settings, &fit, &state, &result);
    enum fit_shapes_progress progress;
    int count = 0;
    do {
      progress = fit_shapes_part(&array, &other, pressure_Pa_q10, &settings, &fit, &parts, &of_parts);
      count++;
    } while (progress == FIT_SHAPES_UNFINISHED);
    TEST_ASSERT_EQUAL(i == 0 ? 2 : FIT_SHAPES_PARTS, count);
    TEST_ASSERT_EQUAL(answers ? FIT_SHAPES_ANSWERED : FIT_SHAPES_STEPPED, progress);
    TEST_ASSERT_EQUAL_MEMORY(&state, &parts, sizeof parts);
    TEST_ASSERT_EQUAL_MEMORY(&result, &of_parts, sizeof of_parts);
    const int after = i + 1 - FIT_SHAPES_FRAMES;
    TEST_ASSERT_EQUAL(i == 0 || (after >= 0 && after % 2 == 0), answers);
  }
  TEST_ASSERT_EQUAL(FIT_SHAPE_TWO, of_parts.shape);
  /* Too few sensors: the contact is forgotten. */
  const struct fit_result none = {.flags = 0};
  const int32_t zeros[SENSORS] = {0};
  TEST_ASSERT_EQUAL(FIT_SHAPES_ANSWERED, fit_shapes_part(&array, &other, zeros, &settings, &none, &parts, &of_parts));
  TEST_ASSERT_EQUAL(FIT_SHAPE_UNDECIDED, of_parts.shape);
  TEST_ASSERT_EQUAL(0, parts.frames);
  TEST_ASSERT_EQUAL(0, parts.part);
}
