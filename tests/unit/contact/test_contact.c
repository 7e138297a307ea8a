#include "common/contact_flags.h"
#include "contact/contact.h"
#include "support/unit.h"

#include <string.h>

#define GOOD_FIT (CONTACT_FLAG_FIT_VALID | CONTACT_FLAG_UNCERTAINTY_VALID)

static const struct contact_settings settings = {.slip_threshold_mm = 0.75f, .slip_window_us = 100000};
static struct slip_history history;
static struct fit_result fit;
static struct contact_input input;
static struct contact_result result;

void setUp(void) {
  slip_reset(&history);
  memset(&fit, 0, sizeof fit);
  fit.flags = GOOD_FIT;
  fit.used = 0x7FFF;
  fit.location_sd_mm = 0.5f;
  fit.sigma_mm = 5.5f;
  fit.location_noise_mm = 0.01f;
  input = (struct contact_input){.contact = true, .tared = true, .fit = &fit};
}

static uint32_t update(void) {
  memset(&result, 0xA5, sizeof result);
  input.t_us += 50000;
  contact_update(&history, &settings, &input, &result);
  return result.flags;
}

static void fill_history(void) {
  update();
  update();
  TEST_ASSERT_BITS_HIGH(CONTACT_FLAG_SLIP_VALID, update());
}

TEST(test_nothing_fitted) {
  input = (struct contact_input){.fit = NULL};
  TEST_ASSERT_EQUAL_HEX32(0, update());
  TEST_ASSERT_EQUAL_FLOAT(0.0f, result.slip_mm);
  input.contact = true;
  TEST_ASSERT_EQUAL_HEX32(CONTACT_FLAG_CONTACT, update());
  input.contact = false;
  input.tared = true;
  TEST_ASSERT_EQUAL_HEX32(CONTACT_FLAG_TARED, update());
  input.masked = true;
  TEST_ASSERT_EQUAL_HEX32(CONTACT_FLAG_TARED | CONTACT_FLAG_SENSOR_MASKED, update());
  input.calibrated = true;
  TEST_ASSERT_EQUAL_HEX32(CONTACT_FLAG_TARED | CONTACT_FLAG_SENSOR_MASKED | CONTACT_FLAG_CALIBRATED, update());
  input = (struct contact_input){.sensor_doubtful = true};
  TEST_ASSERT_EQUAL_HEX32(CONTACT_FLAG_SENSOR_DOUBTFUL, update());
  input = (struct contact_input){.zero_doubtful = true};
  TEST_ASSERT_EQUAL_HEX32(CONTACT_FLAG_ZERO_DOUBTFUL, update());
}

TEST(test_the_force_is_scaled_and_its_uncertainty_holds_that_of_the_scale) {
  const struct contact_settings scaled = {.force_scale = 1.25f, .force_scale_sd = 0.03f};
  fit.force_N = 4.0f;
  fit.force_sd_N = 0.128f; /* times 1.25 0.16; 0.03 of 4 N is 0.12 */
  struct contact_force force = contact_scale_force(&scaled, &fit, 1000.0f);
  TEST_ASSERT_FLOAT_WITHIN(1e-6f, 5.0f, force.force_N);
  TEST_ASSERT_FLOAT_WITHIN(0.001f * 0.2f, 0.2f, force.force_sd_N);
  fit.p0_Pa = 8000.0f; /* beyond the array */
  TEST_ASSERT_EQUAL_FLOAT(5.0f, contact_scale_force(&scaled, &fit, 1000.0f).force_N);
  fit.flags |= CONTACT_FLAG_AT_BOUND;
  force = contact_scale_force(&scaled, &fit, 1000.0f);
  TEST_ASSERT_EQUAL_FLOAT(0.625f, force.force_N);
  TEST_ASSERT_FLOAT_WITHIN(0.01f, 1.25f * 3.5f, force.force_sd_N);
  TEST_ASSERT_FLOAT_WITHIN(0.01f, 0.2f, contact_scale_force(&scaled, &fit, 7920.0f).force_sd_N); /* 1 % is cut */
  fit.flags &= ~(uint32_t)CONTACT_FLAG_AT_BOUND;
  fit.location_sd_mm = 1.1f * fit.sigma_mm;
  TEST_ASSERT_EQUAL_FLOAT(0.625f, contact_scale_force(&scaled, &fit, 1000.0f).force_N);
  fit.flags &= ~(uint32_t)CONTACT_FLAG_UNCERTAINTY_VALID;
  TEST_ASSERT_EQUAL_FLOAT(0.0f, contact_scale_force(&scaled, &fit, 1000.0f).force_sd_N);
}

TEST(test_slip_flag_and_threshold) {
  TEST_ASSERT_BITS_LOW(CONTACT_FLAG_SLIP_VALID, update());
  TEST_ASSERT_EQUAL_FLOAT(0.0f, result.slip_mm);
  TEST_ASSERT_BITS_LOW(CONTACT_FLAG_SLIP_VALID, update());
  uint32_t flags = update();
  TEST_ASSERT_BITS_HIGH(CONTACT_FLAG_SLIP_VALID, flags);
  TEST_ASSERT_BITS_LOW(CONTACT_FLAG_SLIP, flags);
  fit.x_mm = 0.749f;
  flags = update();
  TEST_ASSERT_FLOAT_WITHIN(1e-3f, 0.749f, result.slip_mm);
  TEST_ASSERT_BITS_LOW(CONTACT_FLAG_SLIP, flags);
  fit.x_mm = 0.3745f + 0.751f;
  flags = update();
  TEST_ASSERT_FLOAT_WITHIN(1e-3f, 0.751f, result.slip_mm);
  TEST_ASSERT_BITS_HIGH(CONTACT_FLAG_SLIP, flags);
  setUp();
  fill_history();
  fit.x_mm = 0.75f;
  update();
  fit.x_mm = 2.0f;
  TEST_ASSERT_BITS_HIGH(CONTACT_FLAG_SLIP | CONTACT_FLAG_SLIP_VALID, update());
  TEST_ASSERT_FLOAT_WITHIN(1e-3f, 2.0f - 0.375f, result.slip_mm);
}

TEST(test_doubtful_locations_end_the_history) {
  static const struct {
    uint32_t flags;
    bool zero_doubtful, none;
  } spoilers[] = {{GOOD_FIT | CONTACT_FLAG_FLAT, false, false},
                  {GOOD_FIT | CONTACT_FLAG_AT_BOUND, false, false},
                  {GOOD_FIT, true, false},
                  {0, false, false},
                  {GOOD_FIT, false, true}};
  for (size_t i = 0; i < sizeof spoilers / sizeof spoilers[0]; i++) {
    fill_history();
    fit.flags = spoilers[i].flags;
    input.zero_doubtful = spoilers[i].zero_doubtful;
    input.fit = spoilers[i].none ? NULL : &fit;
    for (int n = 0; n < 3; n++) {
      TEST_ASSERT_BITS_LOW(CONTACT_FLAG_SLIP_VALID | CONTACT_FLAG_SLIP, update());
      TEST_ASSERT_EQUAL_UINT16(n, history.count);
      TEST_ASSERT_EQUAL_FLOAT(0.0f, result.slip_mm);
      fit.flags = GOOD_FIT;
      input.zero_doubtful = false;
      input.fit = &fit;
    }
  }
}

TEST(test_a_location_that_noise_moves_ends_the_history) {
  fill_history();
  fit.location_noise_mm = 0.99f * CONTACT_JITTER_MAX_mm;
  TEST_ASSERT_BITS_HIGH(CONTACT_FLAG_SLIP_VALID, update());
  fit.location_noise_mm = 1.01f * CONTACT_JITTER_MAX_mm;
  TEST_ASSERT_BITS_LOW(CONTACT_FLAG_SLIP_VALID, update());
  TEST_ASSERT_EQUAL_UINT16(0, history.count);
  setUp();
  fill_history();
  fit.flags = CONTACT_FLAG_FIT_VALID; /* and it is unknown how far */
  TEST_ASSERT_BITS_LOW(CONTACT_FLAG_SLIP_VALID, update());
}

TEST(test_other_warnings_keep_the_history) {
  static const uint32_t warnings[] = {CONTACT_FLAG_LOW_SIGNAL, CONTACT_FLAG_MODEL, CONTACT_FLAG_SENSOR_MASKED, CONTACT_FLAG_UNCERTAIN,
                                      CONTACT_FLAG_ELONGATED};
  for (size_t i = 0; i < sizeof warnings / sizeof warnings[0]; i++) {
    setUp();
    fill_history();
    fit.flags = GOOD_FIT | warnings[i];
    TEST_ASSERT_BITS_HIGH(CONTACT_FLAG_SLIP_VALID | fit.flags, update());
  }
  static const sensor_map unsettled[] = {2, 0, 0x7FFF, 0x7FFF, 0x7FFF, 0}; /* one is passed over, and all of the array */
  for (size_t i = 0; i < sizeof unsettled / sizeof unsettled[0]; i++) {
    input.unsettled = unsettled[i];
    TEST_ASSERT_EQUAL(!unsettled[i], (update() & CONTACT_FLAG_SLIP_VALID) != 0);
  }
}

TEST(test_saturation_and_lower_bound) {
  TEST_ASSERT_BITS_LOW(CONTACT_FLAG_SATURATED | CONTACT_FLAG_FORCE_LOWER_BOUND, update());
  input.saturated = 0x80;
  fit.used = 0x7F7F;
  uint32_t flags = update();
  TEST_ASSERT_BITS_HIGH(CONTACT_FLAG_SATURATED, flags);
  TEST_ASSERT_BITS_LOW(CONTACT_FLAG_FORCE_LOWER_BOUND, flags);
  for (uint32_t sensors = 1; sensors <= 15; sensors++) {
    fit.used = 0x7FFFu >> (15 - sensors);
    flags = update();
    TEST_ASSERT_EQUAL(sensors < 5, (flags & CONTACT_FLAG_FORCE_LOWER_BOUND) != 0);
  }
  input.fit = NULL;
  TEST_ASSERT_BITS_HIGH(CONTACT_FLAG_SATURATED | CONTACT_FLAG_FORCE_LOWER_BOUND, update());
  input.saturated = 0;
  TEST_ASSERT_BITS_LOW(CONTACT_FLAG_SATURATED | CONTACT_FLAG_FORCE_LOWER_BOUND, update());
}
