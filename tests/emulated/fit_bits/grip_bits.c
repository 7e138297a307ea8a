#include "grip_bits.h"

#include "common/contact_flags.h"
#include "common/crc32.h"
#include "draw.h"
#include "grip/grip.h"

#include <string.h>

#define REPORT_WORDS 15
#define ONE_IN(n) (draw_between(1, (n)) == 1)

static struct grip grip;

/* 2F-85, servo, ideal. */
static const struct grip_traits grippers[] = {
    {85000, 374, 400, 20000, 150000, 20000, 235000, 25000, 4000},
    {80000, 153, 0, 1000, 200000, 0, 0, 8000, 2000},
    {85000, 10, 0, 100, 250000, 0, 200000, 3000, 1000}};

static uint32_t with_step(uint32_t crc, uint64_t now_us, struct grip_command *told) {
  struct grip_command command;
  struct grip_report report;
  grip_bits_count(true);
  grip_step(&grip, now_us, &command, &report);
  grip_bits_count(false);
  const int32_t words[REPORT_WORDS] = {(int32_t)crc,
                                       command.motion,
                                       command.width_um,
                                       command.speed_um_s,
                                       command.force_mN,
                                       report.state,
                                       (int32_t)report.trouble,
                                       report.gripper_fault,
                                       report.wanted_mN,
                                       report.force_mN,
                                       report.load_mN,
                                       report.margin_permille,
                                       report.friction_permille,
                                       report.width_um,
                                       (int32_t)report.slides};
  *told = command;
  return crc32_iso_hdlc((const uint8_t *)words, sizeof words);
}

/* Any number of any size. */
static int32_t any(void) {
  return draw_between(INT32_MIN, INT32_MAX) >> draw_between(0, 31);
}

static int32_t any_positive(void) {
  return (int32_t)(draw() >> draw_between(1, 31));
}

static struct grip_touch feel(uint64_t t_us, int32_t force_mN, int32_t load_mN, bool slides,
                              bool tells_load) {
  struct grip_touch touch = {.t_us = t_us};
  if (force_mN < 20) {
    return touch;
  }
  touch.flags = CONTACT_FLAG_CONTACT | CONTACT_FLAG_FIT_VALID | CONTACT_FLAG_UNCERTAINTY_VALID;
  touch.flags |= slides ? CONTACT_FLAG_SLIDING : 0;
  touch.flags |= tells_load && !ONE_IN(20) ? CONTACT_FLAG_TANGENTIAL_VALID : 0;
  touch.flags |= ONE_IN(100) ? draw() : 0;
  touch.force_mN = force_mN + draw_between(-20, 20);
  touch.force_sd_mN = force_mN / 20;
  touch.x_um = load_mN + draw_between(-100, 100);
  touch.y_um = draw_between(-100, 100);
  touch.qx_mN = load_mN + draw_between(-30, 30);
  touch.qy_mN = draw_between(-30, 30);
  touch.flags |= ONE_IN(4) ? 0 : CONTACT_FLAG_VELOCITY_VALID;
  touch.vx_um_s = draw_between(-2000, 2000) * draw_between(1, slides ? 20 : 3);
  touch.vy_um_s = draw_between(-2000, 2000);
  return touch;
}

static uint32_t plausible_grasp(void) {
  const struct grip_traits *traits = &grippers[draw_between(0, 2)];
  struct grip_settings settings;
  grip_default_settings(&settings, traits);
  settings.mode = ONE_IN(4) ? GRIP_MODE_FIXED : GRIP_MODE_HOLD;
  grip_init(&grip, &settings, traits);
  grip_request(&grip, GRIP_REQUEST_GRASP);

  const int32_t frame_us = draw_between(2000, 10000), friction_permille = draw_between(250, 1000);
  const int32_t stiffness_mN_mm = draw_between(500, 6000), object_um = draw_between(20000, 60000);
  const int32_t mass_load_mN = draw_between(200, 4000), lift_at = draw_between(80, 140);
  const int32_t fault_at = ONE_IN(3) ? draw_between(0, GRIP_BITS_STEPS) : GRIP_BITS_STEPS;
  const int32_t fault = draw_between(0, 6), asked_at = draw_between(100, 2 * GRIP_BITS_STEPS);
  const bool tells_load = !ONE_IN(4);
  const int32_t active_at = ONE_IN(3) ? draw_between(5, 100) : 0;
  struct grip_touch frozen = {0};
  int32_t width_um = object_um + draw_between(200, 1500), sent_um = width_um;
  int32_t speed_um_s = 0;
  uint32_t crc = 0;
  uint64_t now_us = 1000000;
  for (int32_t step = 0; step < GRIP_BITS_STEPS; step++) {
    now_us += (uint32_t)frame_us;
    int32_t way_um = (int32_t)((int64_t)speed_um_s * frame_us / 1000000);
    int32_t off_um = sent_um - width_um;
    width_um += off_um > way_um ? way_um : off_um < -way_um ? -way_um : off_um;
    bool faulty = step >= fault_at;
    bool is_gone = faulty && fault == 0;
    int32_t squeezed_um = is_gone ? 0 : object_um - width_um;
    int32_t force_mN =
        squeezed_um > 0 ? (int32_t)((int64_t)stiffness_mN_mm * squeezed_um / 2000) : 0;
    int32_t lifted = step - lift_at > 20 ? 20 : step - lift_at;
    int32_t load_mN = lifted > 0 ? mass_load_mN * lifted / 20 : 0;
    bool slides = (int64_t)load_mN * 1000 > (int64_t)force_mN * friction_permille;
    for (unsigned finger = 0; finger < GRIP_FINGERS; finger++) {
      struct grip_touch touch =
          feel(now_us - (uint32_t)frame_us / 2, force_mN, load_mN, slides, tells_load);
      if (faulty && fault == 6 && finger == 0) {
        frozen.t_us = touch.t_us;
        touch = frozen;
      } else if (finger == 0) {
        frozen = touch;
      }
      touch.flags |= faulty && fault == 1 ? CONTACT_FLAG_SATURATED : 0;
      if (!(faulty && (fault == 2 || (fault == 3 && finger == 0)))) {
        grip_take_touch(&grip, finger, &touch);
      }
    }
    struct grip_status status = {.t_us = now_us - 1500,
                                 .width_um = width_um / traits->step_um * traits->step_um,
                                 .is_active = step >= active_at,
                                 .is_moving = width_um != sent_um,
                                 .fault = faulty && fault == 4 ? 9 : 0};
    if (!(faulty && fault == 5)) {
      grip_take_status(&grip, &status);
    }
    if (step == asked_at) {
      grip_request(&grip, ONE_IN(2) ? GRIP_REQUEST_HOLD : GRIP_REQUEST_RELEASE);
    }
    struct grip_command command;
    crc = with_step(crc, now_us, &command);
    if (command.motion == GRIP_MOVE) {
      sent_um = command.width_um;
      speed_um_s = command.speed_um_s;
    }
  }
  return crc;
}

static void draw_settings(struct grip_settings *settings, struct grip_traits *traits) {
  do {
    *traits = grippers[draw_between(0, 2)];
    if (ONE_IN(2)) {
      traits->stroke_um = draw_between(1000, 500000);
      traits->step_um = draw_between(1, 5000);
      traits->deadband_um = draw_between(0, 10000);
      traits->speed_max_um_s = draw_between(1, 2000000);
      traits->speed_min_um_s = draw_between(1, traits->speed_max_um_s);
      traits->latency_us = draw_between(0, 1000000);
      traits->poll_us = draw_between(0, 1000000);
    }
    grip_default_settings(settings, traits);
    settings->mode = (uint8_t)draw_between(GRIP_MODE_FIXED, GRIP_MODE_HOLD);
    if (ONE_IN(2)) {
      settings->touch_mN = draw_between(20, 2000);
      settings->approach_um_s = draw_between(500, 8000);
      settings->force_cap_mN = draw_between(8000, 100000);
      settings->travel_cap_um = draw_between(500, 100000);
      settings->release_um_s = draw_between(500, 100000);
      settings->stale_us = (uint32_t)draw_between(5000, 1000000);
      settings->silent_us = (uint32_t)draw_between(20000, 5000000);
      settings->set_mN = draw_between(100, settings->force_cap_mN);
      settings->gains.kp_um_per_N = draw_between(0, 10000);
      settings->gains.ki_um_per_Ns = draw_between(0, 100000);
      settings->gains.kd_um_s_per_N = draw_between(0, 10000);
      settings->control_us = (uint32_t)draw_between(500, 1000000);
      settings->shift_um = draw_between(0, 20000);
      settings->friction_permille = draw_between(100, 1500);
      settings->margin_permille = draw_between(1000, 5000);
      settings->slid_permille = draw_between(1000, 3000);
      settings->decay_permille_s = draw_between(0, 5000);
      settings->rest_us = (uint32_t)draw_between(0, 60000000);
    }
  } while (grip_init(&grip, settings, traits) != FT_OK);
}

static uint32_t implausible_grasp(void) {
  struct grip_settings settings;
  struct grip_traits traits;
  draw_settings(&settings, &traits);
  grip_request(&grip, GRIP_REQUEST_GRASP);
  uint32_t crc = 0;
  uint64_t now_us = (UINT64_C(1) << 33) + draw();
  /* Nothing but a contact that is felt and a gripper that is active gets far. */
  uint32_t usual = CONTACT_FLAG_CONTACT | CONTACT_FLAG_FIT_VALID | CONTACT_FLAG_TANGENTIAL_VALID;
  for (int step = 0; step < GRIP_BITS_STEPS; step++) {
    now_us += ONE_IN(50) ? (uint64_t)draw() << draw_between(0, 8) : draw() % 20000;
    for (unsigned finger = 0; finger < GRIP_FINGERS; finger++) {
      struct grip_touch touch = {.t_us = now_us - (ONE_IN(20) ? draw() : draw() % 5000),
                                 .flags = ONE_IN(3)    ? draw()
                                          : ONE_IN(20) ? 0
                                                       : usual,
                                 .force_mN = ONE_IN(5) ? any() : draw_between(0, 6000),
                                 .force_sd_mN = ONE_IN(5) ? any() : 100,
                                 .x_um = any(),
                                 .y_um = any(),
                                 .sigma_um = any(),
                                 .qx_mN = any(),
                                 .qy_mN = any(),
                                 .q_sd_mN = any(),
                                 .vx_um_s = any(),
                                 .vy_um_s = any()};
      if (!ONE_IN(4)) {
        grip_take_touch(&grip, finger + (ONE_IN(50) ? draw() : 0), &touch);
      }
    }
    struct grip_status status = {.t_us = now_us - (ONE_IN(20) ? draw() : draw() % 5000),
                                 .width_um = ONE_IN(5) ? any() : any_positive() % 85000,
                                 .is_active = !ONE_IN(500),
                                 .is_moving = ONE_IN(2),
                                 .object = (uint8_t)draw(),
                                 .fault = (uint8_t)(ONE_IN(500) ? draw() : 0)};
    if (!ONE_IN(4)) {
      grip_take_status(&grip, &status);
    }
    if (ONE_IN(60)) {
      grip_request(&grip, (enum grip_request)draw_between(0, 2));
    }
    struct grip_command command;
    crc = with_step(crc, now_us - (ONE_IN(20) ? draw() : 0), &command);
  }
  return crc;
}

uint32_t grip_bits_of(uint32_t grasp) {
  memset(&grip, 0, sizeof grip);
  return grasp % 2 ? implausible_grasp() : plausible_grasp();
}
