/* The grasp's controller, whatever fingertips and gripper say and whenever they say it: it never
 * opens by itself, never aims above the cap, and holds where it cannot know.
 */
#include "fuzz.h"
#include "grip/grip.h"

static struct grip grip;
static struct grip_command command, before;
static struct grip_report report;
static uint64_t now_us;
static bool release_was_asked;
/* The widest that the gripper ever said it was. */
static int32_t widest_um;

static int32_t in_range(struct fuzz_input *input, int32_t low, int32_t high) {
  return low + (int32_t)(fuzz_u32(input) % (uint32_t)(high - low + 1));
}

static bool begin(struct fuzz_input *input) {
  const struct grip_traits usual = {.stroke_um = 85000,
                                    .step_um = 400,
                                    .deadband_um = 0,
                                    .speed_min_um_s = 20000,
                                    .speed_max_um_s = 150000,
                                    .force_min_mN = 20000,
                                    .force_max_mN = 235000,
                                    .latency_us = 30000,
                                    .poll_us = 5000};
  struct grip_traits traits = usual;
  const uint8_t how = fuzz_u8(input);
  if (how & 1) {
    traits.stroke_um = in_range(input, 1000, 500000);
    traits.step_um = in_range(input, 1, 5000);
    traits.deadband_um = in_range(input, 0, 10000);
    traits.speed_max_um_s = in_range(input, 1, 2000000);
    traits.speed_min_um_s = in_range(input, 1, traits.speed_max_um_s);
    traits.latency_us = in_range(input, 0, 1000000);
    traits.poll_us = in_range(input, 0, 1000000);
  }
  struct grip_settings settings;
  grip_default_settings(&settings, &traits);
  settings.mode = how & 2 ? GRIP_MODE_FIXED : GRIP_MODE_HOLD;
  if (how & 4) {
    settings.force_cap_mN = in_range(input, 500, 100000);
    settings.first_mN = in_range(input, 200, settings.force_cap_mN);
    settings.blind_mN = in_range(input, settings.first_mN, settings.force_cap_mN);
    settings.set_mN = in_range(input, 100, settings.force_cap_mN);
    settings.travel_cap_um = in_range(input, 500, 100000);
    settings.friction_permille = in_range(input, 100, 1500);
    settings.margin_permille = in_range(input, 1000, 5000);
    settings.slid_permille = in_range(input, 1000, 3000);
    settings.decay_permille_s = in_range(input, 0, 5000);
    settings.shift_um = in_range(input, 0, 20000);
    settings.rest_us = (uint32_t)in_range(input, 0, 60000000);
  }
  if (how & 8) {
    settings.gains.kp_um_per_N = in_range(input, 0, 10000);
    settings.gains.ki_um_per_Ns = in_range(input, 0, 100000);
    settings.gains.kd_um_s_per_N = in_range(input, 0, 10000);
    settings.control_us = (uint32_t)in_range(input, 500, 1000000);
  }
  if (how & 16) { /* anything: accepted or not */
    uint8_t *field = (uint8_t *)&settings + fuzz_u8(input) % (sizeof settings / 4) * 4;
    const uint32_t value = fuzz_u32(input);
    memcpy(field, &value, sizeof value);
  }
  return grip_init(&grip, &settings, &traits) == FT_OK;
}

/* A newton or a millimetre, or, where the input wants it, anything. */
static int32_t some_value(struct fuzz_input *input) {
  const uint8_t size = fuzz_u8(input);
  return size < 0xF0 ? (int32_t)(size - 0x78) * (1 + fuzz_u8(input)) : (int32_t)fuzz_u32(input);
}

static void touch(struct fuzz_input *input) {
  const uint8_t finger = fuzz_u8(input) % 3;
  struct grip_touch touch = {.t_us = now_us};
  const uint8_t how = fuzz_u8(input);
  touch.flags = how & 1 ? fuzz_u32(input)
                        : CONTACT_FLAG_CONTACT | CONTACT_FLAG_FIT_VALID | CONTACT_FLAG_TARED;
  touch.force_mN = some_value(input);
  if (how & 2) {
    touch.qx_mN = some_value(input);
    touch.qy_mN = some_value(input);
    touch.flags |= CONTACT_FLAG_TANGENTIAL_VALID;
  }
  if (how & 4) {
    touch.x_um = some_value(input);
    touch.y_um = some_value(input);
    touch.force_sd_mN = some_value(input);
    touch.sigma_um = some_value(input);
    touch.q_sd_mN = some_value(input);
  }
  if (how & 16) {
    touch.vx_um_s = some_value(input);
    touch.vy_um_s = some_value(input);
    touch.flags |= CONTACT_FLAG_VELOCITY_VALID | CONTACT_FLAG_SLIDING;
  }
  if (how & 8) { /* late, or by another clock */
    touch.t_us += (uint64_t)(int64_t)(int32_t)fuzz_u32(input);
  }
  grip_take_touch(&grip, finger, &touch);
}

static void status(struct fuzz_input *input) {
  const uint8_t how = fuzz_u8(input);
  struct grip_status status = {.t_us = now_us,
                               .width_um = grip.target_um,
                               .is_active = !(how & 1),
                               .is_moving = how & 2,
                               .object = how >> 2 & 3,
                               .fault = how & 16 ? fuzz_u8(input) : 0};
  if (how & 32) {
    status.width_um = in_range(input, 0, grip.traits.stroke_um);
  } else if (how & 64) {
    status.width_um = (int32_t)fuzz_u32(input);
  }
  if (how & 128) {
    status.t_us += (uint64_t)(int64_t)(int32_t)fuzz_u32(input);
  }
  grip_take_status(&grip, &status);
  widest_um = grip.status.width_um > widest_um ? grip.status.width_um : widest_um;
}

static bool is_grasping(uint8_t state) {
  return state >= GRIP_SQUEEZE && state <= GRIP_SLIPPING;
}

/* As reported lately: a gripper that stands closer than it was sent is on its way to open. */
static int32_t narrowest_width_um(void) {
  int32_t narrowest_um = INT32_MAX;
  for (uint32_t i = 0; i < grip.width_count; i++) {
    const int32_t width_um = grip.widths[(grip.newest_width - i) % GRIP_WIDTHS].width_um;
    narrowest_um = width_um < narrowest_um ? width_um : narrowest_um;
  }
  return narrowest_um;
}

static void check_move(uint8_t state_before) {
  const struct grip_traits *traits = &grip.traits;
  FUZZ_CHECK(command.speed_um_s >= traits->speed_min_um_s &&
             command.speed_um_s <= traits->speed_max_um_s);
  FUZZ_CHECK(command.force_mN >= traits->force_min_mN && command.force_mN <= traits->force_max_mN);
  FUZZ_CHECK(
      (report.trouble & (GRIP_GRIPPER_SILENT | GRIP_GRIPPER_FAULT | GRIP_GRIPPER_INACTIVE)) == 0);
  FUZZ_CHECK(report.state == GRIP_APPROACH || is_grasping(report.state) ||
             report.state == GRIP_RELEASE);
  if (report.state == GRIP_RELEASE) {
    FUZZ_CHECK(release_was_asked);
    return;
  }
  FUZZ_CHECK(command.width_um <= widest_um);
  if (!is_grasping(report.state) || !is_grasping(state_before) || before.motion != GRIP_MOVE) {
    return;
  }
  const bool closes = command.width_um < before.width_um;
  const bool opens = command.width_um > before.width_um && command.width_um > 0;
  FUZZ_CHECK(!opens || command.width_um <= grip.touch_width_um);
  FUZZ_CHECK(!closes || command.width_um >= grip.touch_width_um - grip.settings.travel_cap_um);
  FUZZ_CHECK(!closes || command.width_um >= 0);
  FUZZ_CHECK(!closes || (report.trouble & (GRIP_FINGER_0_OVER | GRIP_FINGER_1_OVER)) == 0);
  FUZZ_CHECK(!closes || report.force_mN < grip.settings.force_cap_mN ||
             command.width_um > narrowest_width_um());
}

static void step(uint32_t us) {
  const uint8_t state_before = grip.state;
  now_us += us;
  before = command;
  grip_step(&grip, now_us, &command, &report);
  FUZZ_CHECK(report.state < GRIP_STATES && report.state == grip.state);
  FUZZ_CHECK(command.motion <= GRIP_MOVE);
  FUZZ_CHECK(report.wanted_mN >= 0 && report.wanted_mN <= grip.settings.force_cap_mN);
  FUZZ_CHECK(report.force_mN >= 0 && report.load_mN >= 0 && report.margin_permille >= 0);
  FUZZ_CHECK(report.state != GRIP_RELEASE || state_before == GRIP_RELEASE);
  FUZZ_CHECK(report.state != GRIP_OPEN || release_was_asked);
  FUZZ_CHECK(state_before != GRIP_FAULT || report.state == GRIP_FAULT);
  FUZZ_CHECK(state_before != GRIP_STILL || report.state == GRIP_STILL ||
             report.state == GRIP_DROPPED || report.state == GRIP_FAULT);
  if (command.motion == GRIP_ACTIVATE) {
    FUZZ_CHECK(report.state == GRIP_ACTIVATING);
  } else if (command.motion == GRIP_MOVE) {
    check_move(state_before);
  }
}

static void ask(struct fuzz_input *input) {
  const uint8_t which = fuzz_u8(input);
  const uint8_t state_before = grip.state;
  const bool heard_fault = (grip.fault_trouble & (GRIP_GRIPPER_FAULT | GRIP_GRIPPER_INACTIVE)) != 0;
  const enum grip_request request = which < 200   ? GRIP_REQUEST_GRASP
                                    : which < 230 ? GRIP_REQUEST_HOLD
                                                  : GRIP_REQUEST_RELEASE;
  if (grip_request(&grip, request)) {
    FUZZ_CHECK(state_before != GRIP_FAULT || (request == GRIP_REQUEST_RELEASE && !heard_fault));
    release_was_asked = request == GRIP_REQUEST_RELEASE;
  } else {
    FUZZ_CHECK(grip.state == state_before);
  }
}

void fuzz_one(const uint8_t *bytes, size_t length) {
  struct fuzz_input input = {bytes, bytes + length};
  now_us = 1000000;
  command = before = (struct grip_command){0};
  release_was_asked = false;
  widest_um = 0;
  if (!begin(&input)) {
    return;
  }
  while (fuzz_left(&input) > 0) {
    switch (fuzz_u8(&input) % 8) {
    case 0:
    case 1:
    case 2:
      touch(&input);
      break;
    case 3:
      status(&input);
      break;
    case 4:
      ask(&input);
      break;
    case 5:
      step(fuzz_u32(&input));
      break;
    default:
      step(fuzz_u8(&input) * 100u);
    }
  }
}
