/* Judging contacts to the bit: slip, tangential load and motion of contacts by chance, which rest, creep, slide, are pulled and let go.
 * What changes a result was meant to, or is a mistake; where it was meant, the test says what to put here. */
#include "common/contact_flags.h"
#include "contact/contact.h"
#include "contact/motion.h"
#include "contact/tangential.h"
#include "support/draw.h"
#include "support/golden.h"
#include "support/unit.h"

enum { COURSES = 104, FRAMES = 1200 };
#define ONE_IN(n) (draw_between(1, (n)) == 1)

static struct contact_settings settings;
static struct tangential_settings tangential_settings;
static struct slip_history slip_history;
static struct tangential_history tangential_history;
static struct motion_history motion_history;
static struct fit_result fit;
static struct fit_tangential found;
static struct contact_input input;

/* In a frame: of location in mm, of load and force in N. */
static struct {
  float x, y, qx, qy, force, noise_mm;
  int32_t left;
} course;

static float between(float low, float high) { return low + (high - low) * (float)(draw() >> 8) / 16777216.0f; }

static void change_course(void) {
  course.left = draw_between(5, 300);
  const float speed = ONE_IN(3) ? 0.0f : ONE_IN(2) ? 0.002f : ONE_IN(2) ? 0.1f : 0.5f;
  course.x = between(-speed, speed);
  course.y = between(-speed, speed);
  const float pull = ONE_IN(2) ? 0.0f : 0.02f;
  course.qx = between(-pull, pull);
  course.qy = between(-pull, pull);
  course.force = ONE_IN(2) ? 0.0f : between(-0.02f, 0.03f);
  input.contact = !ONE_IN(12);
}

static void draw_settings(void) {
  settings.slip_threshold_mm = between(0.2f, 2.0f);
  settings.slip_window_us = (uint32_t)draw_between(0, 400000);
  settings.force_scale = between(0.5f, 2.0f);
  settings.force_scale_sd = between(0.0f, 0.2f);
  struct pad_profile profile;
  memset(&profile, 0, sizeof profile);
  profile.tangential_scale = between(0.5f, 2.0f);
  profile.tangential_scale_sd = between(0.0f, 0.2f);
  tangential_configure(&tangential_settings, &profile, &settings, ONE_IN(2) ? 113 : -1);
  for (int kind = 0; kind < PAD_EDGE_KINDS && ONE_IN(2); kind++) {
    for (int term = 0; term < PAD_EDGE_TERMS; term++) {
      tangential_settings.edges_q20[kind][term] = draw_between(-200000, 200000);
    }
  }
  tangential_settings.location_sd_limit_mm = between(0.1f, 1.0f);
}

static void begin(void) {
  memset(&slip_history, 0, sizeof slip_history);
  memset(&tangential_history, 0, sizeof tangential_history);
  memset(&motion_history, 0, sizeof motion_history);
  memset(&course, 0, sizeof course);
  memset(&fit, 0, sizeof fit);
  memset(&found, 0, sizeof found);
  draw_settings();
  input = (struct contact_input){.t_us = draw(), .contact = true, .tared = true, .fit = &fit};
  course.noise_mm = between(0.0f, 0.05f);
  found.x_mm = between(-15.0f, 15.0f);
  found.y_mm = between(-25.0f, 25.0f);
  found.force_N = between(0.2f, 8.0f);
  found.shift_q20_mm[0] = draw_between(-(8 << 20), 8 << 20);
  found.shift_q20_mm[1] = draw_between(-(8 << 20), 8 << 20);
  found.variance_per_tangential = 1.0f;
}

static void draw_frame(int32_t period_us) {
  if (course.left-- <= 0) {
    change_course();
  }
  input.t_us += (uint32_t)period_us;
  input.t_us += ONE_IN(200) ? draw() % 300000 : 0;
  input.zero_doubtful = ONE_IN(60);
  input.sensor_doubtful = ONE_IN(60);
  input.masked = ONE_IN(60);
  input.saturated = ONE_IN(60) ? draw() & 0x7FFF : 0;
  input.unsettled = ONE_IN(60) ? draw() & 0x7FFF : 0;
  input.tangential = ONE_IN(40) ? NULL : &found;
  found.valid = !ONE_IN(40);
  /* No fit goes further, and no load is above the force. */
  course.x = found.x_mm > 18.0f || found.x_mm < -18.0f ? found.x_mm * -0.01f : course.x;
  course.y = found.y_mm > 27.0f || found.y_mm < -27.0f ? found.y_mm * -0.01f : course.y;
  found.x_mm += course.x;
  found.y_mm += course.y;
  course.qx = found.qx_N > found.force_N || found.qx_N < -found.force_N ? found.qx_N * -0.1f : course.qx;
  course.qy = found.qy_N > found.force_N || found.qy_N < -found.force_N ? found.qy_N * -0.1f : course.qy;
  found.qx_N += course.qx;
  found.qy_N += course.qy;
  found.force_N += found.force_N < 0.2f ? 0.1f : found.force_N > 20.0f ? -0.1f : course.force;
  found.force_N = ONE_IN(300) ? between(0.002f, 0.05f) : found.force_N;
  found.force_sd_N = 0.05f * found.force_N;
  found.q_sd_N = between(0.0f, 0.1f) * found.force_N;
  found.location_sd_mm = between(0.0f, 0.8f);
  found.location_noise_mm = course.noise_mm;
  found.elongated = ONE_IN(50);
  fit.x_mm = found.x_mm + between(-course.noise_mm, course.noise_mm);
  fit.y_mm = found.y_mm + between(-course.noise_mm, course.noise_mm);
  fit.p0_Pa = 1000.0f * found.force_N;
  fit.sigma_mm = 6.0f;
  fit.force_N = found.force_N;
  fit.force_sd_N = found.force_sd_N;
  fit.location_sd_mm = found.location_sd_mm;
  fit.location_noise_mm = ONE_IN(40) ? between(0.0f, 0.4f) : course.noise_mm;
  fit.used = ONE_IN(80) ? draw() & 0x7FFF : 0x7FFF;
  fit.flags = CONTACT_FLAG_FIT_VALID | CONTACT_FLAG_UNCERTAINTY_VALID;
  fit.flags |= ONE_IN(40) ? draw() & (CONTACT_FLAG_LOW_SIGNAL | CONTACT_FLAG_FLAT | CONTACT_FLAG_UNCERTAIN | CONTACT_FLAG_MODEL |
                                      CONTACT_FLAG_AT_BOUND | CONTACT_FLAG_ELONGATED)
                          : 0;
  fit.flags &= ONE_IN(100) ? 0u : UINT32_MAX;
}

static uint32_t judge(uint32_t crc) {
  struct {
    uint32_t crc;
    struct contact_result result;
    struct contact_force force;
    struct tangential_force load;
    struct motion motion;
  } told;
  memset(&told, 0, sizeof told);
  told.crc = crc;
  contact_update(&slip_history, &settings, &input, &told.result);
  tangential_update(&tangential_history, &tangential_settings, &input, &told.result, &told.load);
  motion_update(&motion_history, &tangential_settings, &input, &told.result, &told.motion);
  told.force = contact_scale_force(&settings, &fit, 1e9f);
  return crc32_iso_hdlc((const uint8_t *)&told, sizeof told);
}

TEST(test_contacts_are_judged_the_same_to_the_bit) {
  static const uint32_t golden[GOLDEN_BLOCKS] = {0x709FBFD5, 0x265C400F, 0xEA13C940, 0xC04971C8,
                                                 0x023FA38B, 0xDD598F62, 0x7097B203, 0xE9931CDD};
  uint32_t crcs[GOLDEN_BLOCKS] = {0};
  draw_from(UINT64_C(0x736C6964));
  for (int i = 0; i < COURSES; i++) {
    begin();
    const int32_t period_us = draw_between(700, 50000);
    uint32_t *block = &crcs[i / (COURSES / GOLDEN_BLOCKS)];
    for (int frame = 0; frame < FRAMES; frame++) {
      draw_frame(period_us);
      *block = judge(*block);
    }
  }
  golden_assert("courses", COURSES, golden, crcs);
}
