#include "common/contact_flags.h"
#include "contact/tangential.h"
#include "support/pad.h"
#include "support/random.h"
#include "support/unit.h"

static struct tangential_settings settings;
static struct tangential_history history;
static struct fit_tangential found;
static struct contact_input input;
static struct contact_result result;
static struct tangential_force load;

void setUp(void) {
  settings = (struct tangential_settings){
      .force_scale = 1.0f, .tangential_scale = 1.0f, .location_variance_q26 = 167772, .location_sd_limit_mm = 0.6f};
  tangential_reset(&history);
  found = (struct fit_tangential){.valid = true,
                                  .x_mm = 2.5f,
                                  .y_mm = -7.0f,
                                  .location_sd_mm = 0.15f,
                                  .force_N = 4.0f,
                                  .force_sd_N = 0.128f,
                                  .qx_N = 0.75f,
                                  .qy_N = -1.0f,
                                  .q_sd_N = 0.04f,
                                  .variance_per_tangential = 1.0f};
  input = (struct contact_input){.t_us = 5000000, .contact = true, .tangential = &found};
}

static void find(float force_N, float qx_N, float qy_N) {
  found.force_N = force_N;
  found.qx_N = qx_N;
  found.qy_N = qy_N;
}

static uint32_t update(uint32_t flags) {
  memset(&load, 0xA5, sizeof load);
  result = (struct contact_result){.flags = flags, .slip_mm = 0.25f};
  tangential_update(&history, &settings, &input, &result, &load);
  input.t_us += 1000;
  TEST_ASSERT_EQUAL_FLOAT(0.25f, result.slip_mm);
  return result.flags;
}

static void assert_nothing(uint32_t flags) {
  static const struct tangential_force none;
  TEST_ASSERT_EQUAL_HEX32(flags, update(flags));
  TEST_ASSERT_EQUAL_MEMORY(&none, &load, sizeof load);
}

TEST(an_estimate_that_is_not_there_says_nothing) {
  const uint32_t flags = CONTACT_FLAG_CONTACT | CONTACT_FLAG_UNCERTAIN;
  found.valid = false;
  assert_nothing(flags);
  input.tangential = NULL;
  assert_nothing(flags);
  setUp();
  found.force_N = 0.0f; /* no ratio to it */
  assert_nothing(flags);
}

TEST(an_estimate_passes_as_it_is_with_scales_of_one) {
  TEST_ASSERT_EQUAL_HEX32(CONTACT_FLAG_CONTACT | CONTACT_FLAG_TANGENTIAL_VALID, update(CONTACT_FLAG_CONTACT));
  TEST_ASSERT_EQUAL_FLOAT(2.5f, load.x_mm);
  TEST_ASSERT_EQUAL_FLOAT(-7.0f, load.y_mm);
  TEST_ASSERT_FLOAT_WITHIN(1e-4f, sqrtf(0.15f * 0.15f + 0.0025f), load.location_sd_mm); /* sensors are off their places */
  TEST_ASSERT_EQUAL_FLOAT(4.0f, load.force_N);
  TEST_ASSERT_FLOAT_WITHIN(0.001f * 0.128f, 0.128f, load.force_sd_N);
  TEST_ASSERT_EQUAL_FLOAT(0.75f, load.qx_N);
  TEST_ASSERT_EQUAL_FLOAT(-1.0f, load.qy_N);
  TEST_ASSERT_FLOAT_WITHIN(0.001f * 0.04f, 0.04f, load.q_sd_N);
  TEST_ASSERT_FLOAT_WITHIN(0.001f * 0.3125f, 0.3125f, load.ratio); /* 1.25 of 4 N */
}

#define MOVED_mm 3.5

static void use_moved(void) { found.shift_q20_mm[0] = found.shift_q20_mm[1] = (int32_t)(MOVED_mm * 1048576.0); }

/* A load of 0.1 either way is usual; one that the estimate hardly sees is likely none. */
TEST(a_small_load_may_be_none_and_the_place_knows_it) {
  use_moved();
  found.location_sd_mm = 0.25f;
  found.q_sd_N = 0.2f; /* 0.05 of the force */
  found.qy_N = 0.0f;
  double before = 0.0;
  for (int i = 0; i <= 40; i++) {
    found.qx_N = 0.05f * (float)i;
    update(0);
    double whole_mm = MOVED_mm * (double)found.qx_N / 4.0; /* to where nothing pulls */
    double way_mm = 2.5 - (double)load.x_mm;
    double share = i == 0 ? 1.0 : way_mm / whole_mm;
    TEST_ASSERT_EQUAL_FLOAT(-7.0f, load.y_mm);
    TEST_ASSERT_EQUAL_FLOAT(found.qx_N, load.qx_N); /* the load itself is as estimated */
    TEST_ASSERT_TRUE(share >= 0.0 && share <= 1.0);
    TEST_ASSERT_TRUE(i < 2 || share <= before + 1e-3);
    TEST_ASSERT_TRUE(i > 2 || share > 0.7);   /* half a standard deviation */
    TEST_ASSERT_TRUE(i < 32 || share < 0.03); /* eight */
    before = share;
  }
  TEST_ASSERT_TRUE(load.location_sd_mm > 0.25f && load.location_sd_mm < 0.35f);
}

/* What a pull that is likely none takes from the place's variance is in the measure of the place. */
TEST(a_misfit_widens_what_goes_as_it_widens_the_place) {
  use_moved();
  found.qx_N = found.qy_N = 0.0f;
  found.location_sd_mm = 0.5f;
  found.q_sd_N = 0.2f;
  float taken[2];
  for (int i = 0; i < 2; i++) {
    found.variance_per_tangential = 1.0f + 1.25f * (float)i;
    update(0);
    taken[i] = 0.25f + 0.0025f - load.location_sd_mm * load.location_sd_mm;
  }
  TEST_ASSERT_FLOAT_WITHIN(0.02f * taken[1], taken[1], 2.25f * taken[0]);
}

/* Half of the contacts are pulled, by 0.1 of the force along each axis. Errors of the load and of the place go
 * together, and their standard deviation is known as well as 15 readings less 8 unknowns tell it. */
TEST(places_are_nearer_than_with_any_load_or_none) {
  enum { CONTACTS = 20000 };
  const double sd = 0.03, own_mm = 0.05, force_N = 4.0;
  struct random random = {UINT64_C(0x6C6F6164)};
  use_moved();
  double mean = 0.0, as_estimated = 0.0, of_none = 0.0, said = 0.0;
  int within = 0, within_2 = 0;
  for (int i = 0; i < CONTACTS; i++) {
    double square = 0.0;
    for (int k = 0; k < 6; k++) {
      square += pow(random_normal(&random), 2) / 6.0;
    }
    double told = sd * sqrt(square), q[2], off_mm[2], none_mm[2];
    int pulled = i % 2;
    for (int axis = 0; axis < 2; axis++) {
      double error = sd * random_normal(&random);
      q[axis] = pulled * 0.1 * random_normal(&random) + error;
      off_mm[axis] = MOVED_mm * error + own_mm * random_normal(&random);
      none_mm[axis] = off_mm[axis] - MOVED_mm * q[axis];
    }
    find((float)force_N, (float)(q[0] * force_N), (float)(q[1] * force_N));
    found.q_sd_N = (float)(told * force_N);
    found.location_sd_mm = (float)(told / sd * sqrt(2.0 * (pow(MOVED_mm * sd, 2) + own_mm * own_mm)));
    found.x_mm = (float)off_mm[0];
    found.y_mm = (float)off_mm[1];
    update(0);
    double off = hypot((double)load.x_mm, (double)load.y_mm);
    mean += off * off / CONTACTS;
    as_estimated += (pow(off_mm[0], 2) + pow(off_mm[1], 2)) / CONTACTS;
    of_none += (pow(none_mm[0], 2) + pow(none_mm[1], 2)) / CONTACTS;
    said += (pow((double)load.location_sd_mm, 2) - 0.0025) / CONTACTS; /* without sensors off their places */
    within += off < (double)load.location_sd_mm;
    within_2 += off < 2.0 * (double)load.location_sd_mm;
  }
  TEST_ASSERT_TRUE(mean < 0.8 * as_estimated);
  TEST_ASSERT_TRUE(mean < 0.2 * of_none);
  TEST_ASSERT_DOUBLE_WITHIN(0.25 * mean, mean, said);
  TEST_ASSERT_INT_WITHIN(CONTACTS / 10, CONTACTS * 66 / 100, within);
  TEST_ASSERT_INT_WITHIN(CONTACTS / 30, CONTACTS * 96 / 100, within_2);
}

static void use_edges(const struct pad_edges *edges) {
  struct pad_profile pad = pad_of_12_mm();
  pad.edges = *edges;
  pad.tangential_scale = 1.0f;
  pad.tangential_scale_sd = 0.0f;
  tangential_configure(&settings, &pad, &(struct contact_settings){.force_scale = 1.0f}, -1);
}

/* At u = 0.25, v = -0.75: u^2 = 0.0625, v^2 = 0.5625. */
TEST(edges_are_taken_back) {
  found.x_mm = 2.5f;
  found.y_mm = -7.5f;
  const struct pad_edges edges = {
      .ratio_x = {0.25f, 0.0f, 0.0f},
      .ratio_y = {0.0f, 0.0f, 0.25f},
      .gain_x = {-0.5f, 0.0f, 0.0f},
      .gain_y = {0.0f, 4.0f, 0.0f},
      .place_x_mm = {1.0f, 16.0f, 0.0f},
      .place_y_mm = {0.0f, 0.0f, 1.0f},
      .pull_x_mm = {2.0f, 0.0f, 0.0f},
      .pull_y_mm = {0.0f, 8.0f, 0.0f},
      .force = {0.0f, 4.0f, 0.0f},
  };
  use_edges(&edges);
  TEST_ASSERT_EQUAL_HEX32(CONTACT_FLAG_TANGENTIAL_VALID, update(0));
  /* 4 N of which 1.25 is 1; (0.1875 - 0.0625) / 0.5 and (-0.25 + 0.10546875) / 1.25 of it. */
  TEST_ASSERT_FLOAT_WITHIN(1e-5f, 3.2f, load.force_N);
  TEST_ASSERT_FLOAT_WITHIN(1e-5f, 0.25f * 3.2f, load.qx_N);
  TEST_ASSERT_FLOAT_WITHIN(1e-5f, -0.115625f * 3.2f, load.qy_N);
  TEST_ASSERT_FLOAT_WITHIN(1e-5f, 2.5f - 0.5f - 0.5f, load.x_mm);
  TEST_ASSERT_FLOAT_WITHIN(1e-5f, -7.5f + 0.421875f + 0.115625f * 0.5f, load.y_mm);
  TEST_ASSERT_FLOAT_WITHIN(0.001f * 0.064f, 0.064f, load.q_sd_N); /* 0.04 / (1.25 0.5) */
}

TEST(a_load_that_edges_hide_is_not_told) {
  struct pad_edges edges = {.gain_y = {-0.74f, 0.0f, 0.0f}};
  use_edges(&edges);
  TEST_ASSERT_EQUAL_HEX32(CONTACT_FLAG_TANGENTIAL_VALID, update(0));
  edges.gain_y[0] = -0.76f;
  use_edges(&edges);
  assert_nothing(0);
}

TEST(scales_and_their_uncertainties_enter) {
  settings.force_scale = 1.25f;
  settings.force_scale_sd = 0.03f;
  settings.tangential_scale = 0.8f;
  settings.tangential_scale_sd = 0.05f;
  update(0);
  TEST_ASSERT_EQUAL_FLOAT(5.0f, load.force_N);
  TEST_ASSERT_FLOAT_WITHIN(0.001f * 0.2f, 0.2f, load.force_sd_N); /* 0.16 and 0.12 */
  TEST_ASSERT_EQUAL_FLOAT(0.75f, load.qx_N);                      /* 1.25 times 0.8 is 1 */
  TEST_ASSERT_EQUAL_FLOAT(-1.0f, load.qy_N);
  const float of_scale = 1.25f * 0.05f / 0.8f; /* of 1.25 N; that of the force is in the force's */
  const float expected = sqrtf(0.04f * 0.04f + of_scale * of_scale);
  TEST_ASSERT_FLOAT_WITHIN(0.002f * expected, expected, load.q_sd_N);
  TEST_ASSERT_FLOAT_WITHIN(0.001f * 0.25f, 0.25f, load.ratio);
}

TEST(a_calibration_scales_what_its_force_scale_was_found_with) {
  struct pad_profile pad = pad_of_12_mm();
  pad.tangential_scale = 1.5f;
  pad.from_touch = 1;
  const struct contact_settings scales = {.force_scale = 1.25f, .force_scale_sd = 0.04f};
  tangential_configure(&settings, &pad, &scales, 160);
  TEST_ASSERT_FLOAT_WITHIN(1e-6f, 1.25f * 0.9375f, settings.force_scale);
  TEST_ASSERT_FLOAT_WITHIN(1e-6f, 0.04f * 0.9375f, settings.force_scale_sd);
  TEST_ASSERT_EQUAL_FLOAT(1.5f, settings.tangential_scale);
  TEST_ASSERT_EQUAL_FLOAT(0.125f, settings.tangential_scale_sd);
  TEST_ASSERT_TRUE(settings.from_touch);
  TEST_ASSERT_EQUAL_FLOAT(0.6f, settings.location_sd_limit_mm);
  pad.from_touch = 0;
  tangential_configure(&settings, &pad, &scales, -1);
  TEST_ASSERT_EQUAL_FLOAT(1.0f, settings.force_scale);
  TEST_ASSERT_EQUAL_FLOAT(0.04f, settings.force_scale_sd);
  TEST_ASSERT_FALSE(settings.from_touch);
}

static float place_sd_mm(float overhang_mm, int32_t off_um) {
  struct pad_profile pad = pad_of_12_mm();
  pad.overhang_mm = overhang_mm;
  tangential_configure(&settings, &pad, &(struct contact_settings){.force_scale = 1.0f}, off_um);
  return sqrtf((float)settings.location_variance_q26 / 67108864.0f);
}

TEST(places_and_ends_are_in_the_sd_of_a_location) {
  TEST_ASSERT_EQUAL_FLOAT(0.0f, place_sd_mm(0.0f, 0));
  TEST_ASSERT_FLOAT_WITHIN(5e-4f, 0.05f, place_sd_mm(0.0f, 113));
  TEST_ASSERT_FLOAT_WITHIN(5e-4f, sqrtf(0.0025f + 0.0049f), place_sd_mm(9.0f, 113));
}

TEST(warnings_speak_of_the_estimate) {
  TEST_ASSERT_EQUAL_HEX32(CONTACT_FLAG_TANGENTIAL_VALID, update(CONTACT_FLAG_UNCERTAIN | CONTACT_FLAG_MODEL));
  found.at_corner = true;
  TEST_ASSERT_EQUAL_HEX32(CONTACT_FLAG_TANGENTIAL_VALID | CONTACT_FLAG_MODEL, update(CONTACT_FLAG_MODEL));
  found.elongated = true;
  TEST_ASSERT_EQUAL_HEX32(CONTACT_FLAG_TANGENTIAL_VALID | CONTACT_FLAG_ELONGATED, update(0));
  found.elongated = false;
  TEST_ASSERT_EQUAL_HEX32(CONTACT_FLAG_TANGENTIAL_VALID, update(CONTACT_FLAG_ELONGATED));
  found.location_sd_mm = 0.61f;
  TEST_ASSERT_EQUAL_HEX32(CONTACT_FLAG_TANGENTIAL_VALID | CONTACT_FLAG_UNCERTAIN, update(0));
}

/* 1000 frames a second; the ratio wavers about (0.1, -0.05) for 100 ms. */
static void touch(void) {
  for (int i = 0; i < 100; i++) {
    const float force_N = 2.0f + 0.01f * (float)i, waver = i % 2 ? 0.02f : -0.02f;
    find(force_N, (0.1f + waver) * force_N, (-0.05f - waver) * force_N);
    assert_nothing(CONTACT_FLAG_CONTACT);
  }
}

static void assert_from_touch(float qx_N, float qy_N) {
  TEST_ASSERT_EQUAL_HEX32(CONTACT_FLAG_CONTACT | CONTACT_FLAG_TANGENTIAL_VALID | CONTACT_FLAG_TANGENTIAL_FROM_TOUCH,
                          update(CONTACT_FLAG_CONTACT));
  TEST_ASSERT_FLOAT_WITHIN(1e-4f, qx_N, load.qx_N);
  TEST_ASSERT_FLOAT_WITHIN(1e-4f, qy_N, load.qy_N);
  TEST_ASSERT_FLOAT_WITHIN(1e-3f, sqrtf(qx_N * qx_N + qy_N * qy_N) / load.force_N, load.ratio);
}

TEST(from_touch_takes_the_first_100_ms_for_none) {
  settings.from_touch = true;
  touch();
  find(5.0f, 0.5f, -0.25f);
  assert_from_touch(0.0f, 0.0f);
  found.qx_N = 0.5f + 1.0f;
  assert_from_touch(1.0f, 0.0f);
  TEST_ASSERT_EQUAL_FLOAT(2.5f, load.x_mm);
  find(10.0f, 0.0f, 0.0f); /* the zero is one of Q / F */
  assert_from_touch(-1.0f, 0.5f);
}

TEST(a_new_contact_has_a_zero_of_its_own) {
  settings.from_touch = true;
  touch();
  found.valid = false; /* for a while only: the contact goes on */
  for (int i = 0; i < 500; i++) {
    assert_nothing(CONTACT_FLAG_CONTACT);
  }
  found.valid = true;
  find(5.0f, 1.5f, -0.25f);
  assert_from_touch(1.0f, 0.0f);
  input.contact = false;
  input.tangential = NULL;
  assert_nothing(0);
  input.contact = true;
  input.tangential = &found;
  touch();
  find(5.0f, 0.5f, 0.75f);
  assert_from_touch(0.0f, 1.0f);
}

TEST(slow_frames_settle_with_those_there_were) {
  settings.from_touch = true;
  assert_nothing(0);
  input.t_us += 2000000;
  found.qx_N = 1.75f;
  TEST_ASSERT_BITS_HIGH(CONTACT_FLAG_TANGENTIAL_VALID, update(0));
  TEST_ASSERT_FLOAT_WITHIN(1e-5f, 1.0f, load.qx_N);
  TEST_ASSERT_FLOAT_WITHIN(1e-5f, 0.0f, load.qy_N);
}

TEST(fits_that_an_estimate_is_worthwhile_for) {
  struct fit_result fit = {.flags = CONTACT_FLAG_FIT_VALID, .used = 0x7FFF};
  TEST_ASSERT_TRUE(tangential_is_worthwhile(&fit, 0));
  TEST_ASSERT_TRUE(tangential_is_worthwhile(&fit, 1));
  fit.used = 0xF;
  TEST_ASSERT_TRUE(tangential_is_worthwhile(&fit, 0));
  TEST_ASSERT_FALSE(tangential_is_worthwhile(&fit, 0x10));
  static const uint32_t spoilers[] = {CONTACT_FLAG_FLAT, CONTACT_FLAG_AT_BOUND};
  fit.used = 0x7FFF;
  for (size_t i = 0; i < 2; i++) {
    fit.flags = CONTACT_FLAG_FIT_VALID | spoilers[i];
    TEST_ASSERT_FALSE(tangential_is_worthwhile(&fit, 0));
  }
  fit.flags = 0;
  TEST_ASSERT_FALSE(tangential_is_worthwhile(&fit, 0));
}

enum { SENSORS = 15 };

/* A contact of the pad's own, pressing there. */
static struct fit_tangential frame(struct tangential_job *job, float x_mm, float y_mm, uint64_t t_us, uint32_t flags) {
  const struct pad_profile profile = pad_of_12_mm();
  float at_x_mm[SENSORS], at_y_mm[SENSORS];
  int32_t readings[SENSORS];
  for (int k = 0; k < SENSORS; k++) {
    at_x_mm[k] = 9.0f * (float)(k / 5 - 1);
    at_y_mm[k] = 9.0f * (float)(k % 5 - 2);
    const double dx_mm = (double)(at_x_mm[k] - x_mm), dy_mm = (double)(at_y_mm[k] - y_mm);
    readings[k] = (int32_t)(1024.0 * pad_pressure_Pa(&profile, 4.0, dx_mm, dy_mm, (struct pad_load){2.5, 0, 0}));
  }
  static struct fit_array array;
  TEST_ASSERT_EQUAL(FT_OK, fit_array_init(&array, SENSORS, at_x_mm, at_y_mm, 9.0f));
  TEST_ASSERT_EQUAL(FT_OK, fit_pad_init(&job->pad, &array, &profile));
  struct fit_settings fitting = {.iterations = 4, .noise_Pa_q10 = 4096};
  struct fit_result fit;
  fit_gaussian(&array, readings, UINT32_MAX, &fitting, &fit);
  TEST_ASSERT_BITS_HIGH(CONTACT_FLAG_FIT_VALID, fit.flags);
  fit.flags |= flags;
  job->array = &array;
  job->question = (struct tangential_question){
      .begins = job->question.begins,
      .t_us = t_us,
      .pressure_Pa_q10 = readings,
      .settings = &fitting,
      .fit = &fit,
  };
  memset(&job->estimate, 0xFF, sizeof job->estimate);
  tangential_estimate(job);
  return job->estimate;
}

TEST(slow_frames_have_time_for_more_steps) {
  for (int slow = 0; slow < 2; slow++) {
    const uint64_t interval_us = slow ? TANGENTIAL_SLOW_us : TANGENTIAL_SLOW_us - 1;
    struct tangential_job job = {0};
    uint64_t t_us = 9000000;
    TEST_ASSERT_FALSE(frame(&job, 2.0f, 3.0f, t_us, 0).valid);
    for (int i = 0; i < FIT_TANGENTIAL_FRAMES; i++) {
      frame(&job, 2.0f, 3.0f, t_us += interval_us, 0);
    }
    TEST_ASSERT_TRUE(frame(&job, 2.0f, 3.0f, t_us += interval_us, 0).valid);
    struct fit_tangential jumped = frame(&job, -3.0f, -8.0f, t_us += interval_us, 0);
    TEST_ASSERT_EQUAL_INT(slow, jumped.valid);
    TEST_ASSERT_FLOAT_WITHIN(0.05f, slow ? -3.0f : 0.0f, jumped.x_mm);
  }
}

TEST(what_is_not_worthwhile_ends_the_course) {
  static const struct tangential_course none;
  static const struct fit_tangential nothing;
  struct tangential_job job = {0};
  frame(&job, 2.0f, 3.0f, 1000, 0);
  TEST_ASSERT_TRUE(memcmp(&job.course, &none, sizeof none) != 0);
  struct fit_tangential estimate = frame(&job, 2.0f, 3.0f, 2000, CONTACT_FLAG_FLAT);
  TEST_ASSERT_EQUAL_MEMORY(&none, &job.course, sizeof none);
  TEST_ASSERT_EQUAL_MEMORY(&nothing, &estimate, sizeof estimate);
}

TEST(a_question_that_begins_forgets_the_contact_before) {
  struct tangential_job job = {0}, fresh = {0};
  uint64_t t_us = 9000000;
  for (int i = 0; i < FIT_TANGENTIAL_FRAMES + 1; i++) {
    frame(&job, 2.0f, 3.0f, t_us += 1000, 0);
  }
  TEST_ASSERT_TRUE(frame(&job, 2.0f, 3.0f, t_us += 1000, 0).valid);
  job.question.begins = true;
  TEST_ASSERT_FALSE(frame(&job, 2.0f, 3.0f, t_us += 1000, 0).valid);
  frame(&fresh, 2.0f, 3.0f, t_us, 0);
  TEST_ASSERT_EQUAL_MEMORY(&fresh.course, &job.course, sizeof job.course);
}
