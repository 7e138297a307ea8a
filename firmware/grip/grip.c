#include "grip/grip.h"

#include "grip/grip_parts.h"
#include "port/divide.h"

/* Of the zero of the load. */
#define READY_us 150000u
#define READY_FRAMES 3u
/* In which the first force rises. */
#define RISES_us 270000
/* An approach or a release that was kept waiting makes up for no more: a leap would be a blow. */
#define RAMP_us 100000
/* Squeezing to the first force takes no longer, or it is what it is. */
#define SQUEEZE_us 3000000u
/* How near to the first force is there. */
#define SQUEEZED_PERMILLE 850
#define ACTIVATION_us 10000000u
/* Neither fingertip feels anything for so long: the object is gone. */
#define EMPTY_us 60000u
/* A gripper that stands where it was sent for so long has closed on nothing. */
#define STANDS_us 400000u
/* An approach waits for a status that is no older: where the fingers are when they touch, and that
 * they follow, is what all forces are turned into widths by. */
#define WIDTH_STALE_us 100000u
/* A move is to take so long, but where the object slides. */
#define MOVE_us 20000
/* The gripper's own limit of force, in case the fingertips' is not kept: of the cap. */
#define LIMIT_PERMILLE 1250
/* A width of the gripper's own units. */
#define WIDTH_SLACK_um 1000

static bool in_range(int32_t value, int32_t low, int32_t high) {
  return value >= low && value <= high;
}

enum ft_status grip_init(struct grip *grip, const struct grip_settings *settings,
                         const struct grip_traits *traits) {
  const struct grip_settings *s = settings;
  const struct grip_traits *t = traits;
  bool good =
      in_range(t->stroke_um, 1000, 500000) && in_range(t->step_um, 1, 5000) &&
      in_range(t->deadband_um, 0, 10000) && in_range(t->speed_min_um_s, 1, t->speed_max_um_s) &&
      t->speed_max_um_s <= 2000000 && in_range(t->force_min_mN, 0, t->force_max_mN) &&
      in_range(t->latency_us, 0, 1000000) && in_range(t->poll_us, 0, 1000000) &&
      s->mode <= GRIP_MODE_HOLD && in_range(s->touch_mN, 20, 2000) &&
      in_range(s->approach_um_s, 500, 8000) && in_range(s->force_cap_mN, 500, 100000) &&
      in_range(s->travel_cap_um, 500, 100000) && in_range(s->release_um_s, 500, 100000) &&
      in_range(s->release_width_um, 0, t->stroke_um) && s->stale_us >= 5000 &&
      s->stale_us <= 1000000 && s->silent_us >= 20000 && s->silent_us <= 5000000 &&
      in_range(s->differ_permille, 50, 1000) && in_range(s->set_mN, 100, s->force_cap_mN) &&
      in_range(s->gains.kp_um_per_N, 0, 10000) && in_range(s->gains.ki_um_per_Ns, 0, 100000) &&
      in_range(s->gains.kd_um_s_per_N, 0, 10000) && s->control_us >= 500 &&
      s->control_us <= 1000000 && in_range(s->first_mN, 200, s->force_cap_mN) &&
      in_range(s->blind_mN, s->first_mN, s->force_cap_mN) && in_range(s->shift_um, 0, 20000) &&
      in_range(s->friction_permille, 100, 1500) && in_range(s->margin_permille, 1000, 5000) &&
      in_range(s->slid_permille, 1000, 3000) && in_range(s->decay_permille_s, 0, 5000) &&
      s->rest_us <= 60000000;
  if (!good) {
    return FT_ERR_ARGUMENT;
  }
  *grip = (struct grip){.settings = *settings, .traits = *traits};
  return FT_OK;
}

static void enter(struct grip *grip, enum grip_state state) {
  grip->state = (uint8_t)state;
  grip->since_us = grip->now_us;
  grip->is_entered = true;
}

static bool is_grasping(const struct grip *grip) {
  return grip->state == GRIP_SQUEEZE || grip->state == GRIP_READY || grip->state == GRIP_HOLDING ||
         grip->state == GRIP_SLIPPING || (grip->state == GRIP_STILL && grip->still_grasps);
}

bool grip_request(struct grip *grip, enum grip_request request) {
  switch (request) {
  case GRIP_REQUEST_GRASP:
    if (grip->state != GRIP_IDLE && grip->state != GRIP_OPEN && grip->state != GRIP_DROPPED &&
        grip->state != GRIP_MISSED && grip->state != GRIP_STILL) {
      return false;
    }
    grip_hold_begin(grip);
    grip_fixed_begin(grip);
    grip->wanted_mN = grip->tightened_mN = 0;
    grip->may_activate = false;
    enter(grip, GRIP_ACTIVATING);
    return true;
  case GRIP_REQUEST_HOLD:
    if (grip->state == GRIP_FAULT) {
      return false;
    }
    grip->target_um = grip->status.width_um;
    grip->still_grasps = is_grasping(grip);
    enter(grip, GRIP_STILL);
    return true;
  case GRIP_REQUEST_RELEASE:
    if (grip->state == GRIP_FAULT && (grip->fault_trouble & GRIP_GRIPPER_FAULTS) != 0) {
      return false;
    }
    grip->target_um = grip->settings.release_width_um;
    enter(grip, GRIP_RELEASE);
    return true;
  }
  return false;
}

/* Grippers that are gone, or are not what they were. */
static uint32_t gripper_trouble(const struct grip *grip) {
  uint32_t trouble = 0;
  if (!grip->status_is_heard || grip->now_us > grip->status.t_us + grip->settings.silent_us) {
    return GRIP_GRIPPER_SILENT;
  }
  trouble |= grip->status.fault != 0 ? GRIP_GRIPPER_FAULT : 0;
  bool was_active = grip->state > GRIP_ACTIVATING;
  trouble |= was_active && !grip->status.is_active ? GRIP_GRIPPER_INACTIVE : 0;
  return trouble;
}

/* The core may not have been called for an hour. */
static int32_t passed_us(const struct grip *grip, uint64_t since_us) {
  uint64_t passed_us = grip->now_us - since_us;
  return passed_us > INT32_MAX ? INT32_MAX : (int32_t)passed_us;
}

/* A step of the width at this speed since the last. */
static void ramp(struct grip *grip, int32_t to_um, int32_t speed_um_s) {
  if (grip->is_entered) {
    grip->target_um = grip->status.width_um;
    grip->ramped_us = grip->now_us;
  }
  int32_t way_um = grip_scale(speed_um_s, passed_us(grip, grip->ramped_us), 1000000);
  int32_t steps = port_divide(way_um, grip->traits.step_um);
  if (steps < 1) {
    return;
  }
  int32_t most = port_divide(grip_scale(speed_um_s, RAMP_us, 1000000), grip->traits.step_um);
  most = most < 1 ? 1 : most;
  bool paused = steps > most;
  steps = paused ? most : steps;
  int32_t off_um = to_um - grip->target_um, made_um = steps * grip->traits.step_um;
  grip->ramped_us =
      paused ? grip->now_us : grip->ramped_us + (uint64_t)grip_scale(made_um, 1000000, speed_um_s);
  grip->target_um += grip_clamp(off_um, -made_um, made_um);
}

static void approach(struct grip *grip, const struct grip_view *view) {
  if (view->fingers == 0 && view->touches == 0) {
    return; /* blind: no further */
  }
  /* One fingertip alone pushes the object to the other. Where that one is missing, it decides. */
  bool touches = view->fingers == 0 ||
                 (view->touches >= view->fingers && view->low_mN >= grip->settings.touch_mN);
  bool pushes_hard = view->high_mN >= 4 * grip->settings.touch_mN;
  if (grip->now_us > grip->status.t_us + WIDTH_STALE_us) {
    grip->ramped_us = grip->now_us;
    return;
  }
  if (touches || pushes_hard) {
    grip->touch_width_um = grip_width_at(grip, view->t_us);
    grip->aimed_us = grip->now_us; /* the approach is still under way */
    grip->is_blind = grip->is_guessing = false;
    enter(grip, GRIP_SQUEEZE);
    return;
  }
  ramp(grip, 0, grip->settings.approach_um_s);
  if (grip->status.is_moving || grip->target_um != 0) {
    grip->stood_us = grip->now_us;
  } else if (grip->now_us - grip->stood_us > STANDS_us) {
    enter(grip, GRIP_MISSED);
  }
}

static uint32_t squeeze(struct grip *grip, const struct grip_view *view) {
  const struct grip_settings *settings = &grip->settings;
  bool fixed = settings->mode == GRIP_MODE_FIXED;
  int32_t aimed_mN = fixed ? settings->set_mN : grip_first_force(grip);
  bool goes_on = grip->is_blind || grip->is_guessing;
  int32_t from_mN = goes_on ? settings->first_mN : settings->touch_mN;
  int32_t since_us = grip_clamp(passed_us(grip, grip->since_us), 0, RISES_us);
  int32_t risen_mN = from_mN + grip_scale(aimed_mN, since_us, RISES_us);
  uint32_t trouble = fixed ? grip_fixed_step(grip, view)
                           : grip_aim(grip, view, risen_mN < aimed_mN ? risen_mN : aimed_mN);
  bool there = view->low_mN >= grip_scale(aimed_mN, SQUEEZED_PERMILLE, 1000);
  if ((there && !grip->status.is_moving) || grip->now_us - grip->since_us > SQUEEZE_us) {
    grip->is_blind = !fixed && !view->may_tell;
    grip->is_guessing = !fixed && (grip->is_guessing || !view->tells_load);
    if (!fixed && grip_first_force(grip) > aimed_mN) {
      grip->since_us = grip->now_us; /* on to the grip that holds with fewer reports */
    } else {
      grip_zero_begin(grip);
      enter(grip, GRIP_READY);
    }
  }
  return trouble;
}

static uint32_t hold(struct grip *grip, const struct grip_view *view) {
  if (grip->settings.mode == GRIP_MODE_FIXED) {
    return grip_fixed_step(grip, view);
  }
  uint32_t trouble = view->has_load ? 0 : GRIP_NO_LOAD;
  trouble |= grip_aim(grip, view, grip_hold_wants(grip, view));
  if (grip->state == GRIP_HOLDING && grip->hold.sliding) {
    enter(grip, GRIP_SLIPPING);
  } else if (grip->state == GRIP_SLIPPING && !grip->hold.sliding) {
    enter(grip, GRIP_HOLDING);
  }
  return trouble;
}

static uint32_t make_ready(struct grip *grip, const struct grip_view *view) {
  uint32_t trouble = grip->settings.mode == GRIP_MODE_FIXED
                         ? grip_fixed_step(grip, view)
                         : grip_aim(grip, view, grip_first_force(grip));
  if (grip->now_us - grip->since_us >= READY_us && grip_zero_has(grip, READY_FRAMES)) {
    grip_zero_end(grip);
    enter(grip, GRIP_HOLDING);
  }
  return trouble;
}

static bool is_empty(const struct grip_view *view) {
  return view->fingers > 0 && view->touches == 0;
}

static bool is_gone(struct grip *grip, const struct grip_view *view) {
  bool empty = is_empty(view);
  if (!empty) {
    grip->empty_us = grip->now_us;
  }
  return empty && grip->now_us - grip->empty_us >= EMPTY_us;
}

static uint32_t go_on(struct grip *grip, const struct grip_view *view) {
  switch (grip->state) {
  case GRIP_ACTIVATING:
    if (grip->status.is_active) {
      enter(grip, view->touches == 0 ? GRIP_APPROACH : GRIP_SQUEEZE);
      grip->touch_width_um = grip->target_um = grip->status.width_um;
      return 0;
    }
    /* Activating opens a gripper: not with something between its fingers. */
    grip->may_activate = grip->may_activate || (view->fingers > 0 && view->touches == 0);
    return grip->may_activate && grip->now_us - grip->since_us < ACTIVATION_us
               ? 0
               : GRIP_GRIPPER_INACTIVE;
  case GRIP_APPROACH:
    approach(grip, view);
    return 0;
  case GRIP_SQUEEZE:
    return squeeze(grip, view);
  case GRIP_READY:
    return make_ready(grip, view);
  case GRIP_HOLDING:
  case GRIP_SLIPPING:
    return hold(grip, view);
  case GRIP_RELEASE:
    ramp(grip, grip->settings.release_width_um, grip->settings.release_um_s);
    if (grip->status.width_um >= grip->settings.release_width_um - WIDTH_SLACK_um) {
      enter(grip, GRIP_OPEN);
    }
    return 0;
  default:
    return 0;
  }
}

static void tell_command(const struct grip *grip, struct grip_command *command) {
  const struct grip_traits *traits = &grip->traits;
  *command = (struct grip_command){.motion = GRIP_STAY, .width_um = grip->target_um};
  int32_t speed_um_s = traits->speed_max_um_s;
  switch (grip->state) {
  case GRIP_ACTIVATING:
    command->motion = grip->may_activate ? GRIP_ACTIVATE : GRIP_STAY;
    return;
  case GRIP_APPROACH:
    speed_um_s = grip->settings.approach_um_s;
    break;
  case GRIP_RELEASE:
    speed_um_s = grip->settings.release_um_s;
    break;
  case GRIP_SQUEEZE:
  case GRIP_READY:
  case GRIP_HOLDING: {
    int32_t off_um = grip->target_um - grip->status.width_um;
    speed_um_s = grip_scale(off_um < 0 ? -off_um : off_um, 1000000, MOVE_us);
    break;
  }
  case GRIP_SLIPPING:
    break;
  default:
    return;
  }
  if (grip->trouble & (GRIP_GRIPPER_SILENT | GRIP_GRIPPER_FAULTS)) {
    return;
  }
  command->motion = GRIP_MOVE;
  int32_t force_mN = grip_scale(grip->settings.force_cap_mN, LIMIT_PERMILLE, 1000);
  command->force_mN = grip_clamp(force_mN, traits->force_min_mN, traits->force_max_mN);
  command->speed_um_s = grip_clamp(speed_um_s, traits->speed_min_um_s, traits->speed_max_um_s);
}

static void tell_report(const struct grip *grip, const struct grip_view *view,
                        struct grip_report *report) {
  const struct grip_hold *hold = &grip->hold;
  bool is_over = grip->state == GRIP_FAULT && grip->status.fault == 0;
  *report = (struct grip_report){
      .state = grip->state,
      .trouble = grip->trouble,
      .gripper_fault = is_over ? grip->fault_code : grip->status.fault,
      .wanted_mN = grip->wanted_mN,
      .force_mN = view->low_mN,
      .friction_permille = hold->friction_permille,
      .width_um = grip->status.width_um,
      .slides = hold->slides,
  };
  bool loaded = grip->state == GRIP_HOLDING || grip->state == GRIP_SLIPPING;
  if (loaded && view->has_load && grip->settings.mode == GRIP_MODE_HOLD) {
    report->load_mN = view->load_mN;
    report->margin_permille =
        view->load_mN < 1
            ? 0
            : grip_clamp(grip_scale(view->low_mN, hold->friction_permille, view->load_mN), 0,
                         100000);
  }
}

void grip_step(struct grip *grip, uint64_t now_us, struct grip_command *command,
               struct grip_report *report) {
  grip->now_us = now_us > grip->now_us ? now_us : grip->now_us;
  struct grip_view view;
  grip_look(grip, &view);
  grip->trouble = view.trouble | gripper_trouble(grip);
  bool silent = (grip->trouble & GRIP_GRIPPER_SILENT) != 0;
  uint8_t before = grip->state;
  bool grasps = is_grasping(grip);
  if (before != GRIP_IDLE && before != GRIP_FAULT && (grip->trouble & GRIP_GRIPPER_FAULTS) != 0) {
    grip->fault_trouble = grip->trouble;
    grip->fault_code = grip->status.fault;
    enter(grip, GRIP_FAULT);
  } else if (grasps && is_gone(grip, &view)) {
    enter(grip, GRIP_DROPPED);
  } else if (!silent && !(grasps && is_empty(&view))) {
    grip->trouble |= go_on(grip, &view);
  }
  if (grip->state == before) {
    grip->is_entered = false;
  }
  if (grip->state == GRIP_FAULT) {
    grip->trouble |= grip->fault_trouble;
  }
  tell_command(grip, command);
  tell_report(grip, &view, report);
}
