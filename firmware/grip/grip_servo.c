#include "grip/grip_parts.h"
#include "port/divide.h"

/* Rubber's force grows as its indentation to the 1.6: layers of 12 mm under spheres of 6 to 30 mm,
 * 1 to 10 N (host_tools/simulation/twin). */
#define EXPONENT_PERMILLE 1600
#define INDENTATION_MIN_um 300
#define FORCE_MIN_mN 50
#define STIFFNESS_MIN_mN_mm 200
#define STIFFNESS_MAX_mN_mm 20000

/* Further than any gripper opens. */
#define WIDTH_MAX_um 1000000

/* Opening waits until the last move shows in the force, whatever the clocks of force and width
 * differ by. */
#define SETTLES_us 30000u

/* Forces that are newer than the newest width by more tell nothing while the gripper moves. */
#define WIDTH_LAGS_us 8000u

/* Of what a step makes: less than that is missing, and none is made; so much may be missing after
 * one that opens. */
#define TIGHTEN_PERMILLE 500
#define LOOSEN_PERMILLE 300
#define FOR_LESS_PERMILLE 300
#define OPENS_MOST_um 300 /* at once */
#define MUCH_PERMILLE 1600
/* While it still opens no less is missing than what may be: else what was loosened a moment ago
 * would be taken back, and more. */
#define OPENING_PERMILLE 1000
/* Of the cap: so much of it is asked for, as the last step may make more than is known. */
#define CAP_PERMILLE 970
/* And of the force that is wanted, for grippers of fine steps. */
#define TOLERANCE_PERMILLE 15

void grip_take_status(struct grip *grip, const struct grip_status *status) {
  if (grip->status_is_heard && status->t_us <= grip->status.t_us) {
    return;
  }
  /* Between what was said before a silence and after it no width is known. */
  if (grip->status_is_heard && status->t_us - grip->status.t_us > grip->settings.silent_us) {
    grip->width_count = 0;
  }
  grip->status = *status;
  grip->status.width_um = grip_clamp(status->width_um, -WIDTH_MAX_um, WIDTH_MAX_um);
  grip->status_is_heard = true;
  /* The ring spans what a force may be old. */
  uint32_t before = (grip->newest_width - 1) % GRIP_WIDTHS;
  if (grip->width_count < 2 || grip->widths[grip->newest_width].t_us - grip->widths[before].t_us >=
                                   grip->settings.stale_us / (GRIP_WIDTHS - 4)) {
    grip->newest_width = (grip->newest_width + 1) % GRIP_WIDTHS;
    grip->width_count += grip->width_count < GRIP_WIDTHS;
  }
  grip->widths[grip->newest_width] = (struct grip_width){status->t_us, grip->status.width_um};
}

/* Whether the ring tells the width of then. */
static bool knows_width(const struct grip *grip, uint64_t t_us) {
  uint32_t oldest = (grip->newest_width - (grip->width_count - 1)) % GRIP_WIDTHS;
  return grip->width_count > 0 && grip->widths[oldest].t_us <= t_us;
}

int32_t grip_width_at(const struct grip *grip, uint64_t t_us) {
  struct grip_width after = grip->widths[grip->newest_width];
  if (after.t_us <= t_us) {
    return after.width_um;
  }
  for (uint32_t back = 1; back < grip->width_count; back++) {
    struct grip_width before = grip->widths[(grip->newest_width - back) % GRIP_WIDTHS];
    if (before.t_us <= t_us) {
      int32_t span_us = (int32_t)(after.t_us - before.t_us);
      return before.width_um +
             grip_scale(after.width_um - before.width_um, (int32_t)(t_us - before.t_us), span_us);
    }
    after = before;
  }
  return after.width_um;
}

static int32_t indentation_at(const struct grip *grip, int32_t width_um) {
  int32_t indentation_um = grip->touch_width_um - width_um;
  return indentation_um < INDENTATION_MIN_um ? INDENTATION_MIN_um : indentation_um;
}

int32_t grip_stiffness(const struct grip *grip, int32_t force_mN, int32_t width_um) {
  int32_t stiffness = grip_scale(force_mN, EXPONENT_PERMILLE, indentation_at(grip, width_um));
  return grip_clamp(stiffness, STIFFNESS_MIN_mN_mm, STIFFNESS_MAX_mN_mm);
}

static uint32_t root_of(uint32_t square) {
  uint32_t root = 0;
  for (uint32_t bit = UINT32_C(1) << 15; bit != 0; bit >>= 1) {
    uint32_t tried = root | bit;
    root = tried * tried <= square ? tried : root;
  }
  return root;
}

/* The way to close from an indentation, for a force that is to grow from one to the other: by the
 * power law its indentation grows to (to / from)^(5/8). */
static int32_t way_to(const struct grip *grip, int32_t width_um, int32_t from_mN, int32_t to_mN) {
  int32_t indentation_um = indentation_at(grip, width_um);
  from_mN = from_mN < FORCE_MIN_mN ? FORCE_MIN_mN : from_mN;
  int32_t ratio_q12 = grip_clamp(grip_scale(to_mN, 4096, from_mN), 4096, (1 << 20) - 1);
  uint32_t half_q12 = root_of((uint32_t)ratio_q12 << 12);
  uint32_t eighth_q12 = root_of(root_of(half_q12 << 12) << 12);
  int32_t grown_q12 = (int32_t)((half_q12 * eighth_q12) >> 12);
  return grip_scale(indentation_um, grown_q12 - 4096, 4096);
}

int32_t grip_allowed_width(const struct grip *grip, const struct grip_view *view, int32_t width_um,
                           uint32_t *trouble) {
  int32_t least_um = grip->touch_width_um - grip->settings.travel_cap_um;
  if (width_um < least_um) {
    width_um = least_um;
    *trouble |= GRIP_AT_TRAVEL_CAP;
  }
  /* What is not believed to be below the cap is not added to. */
  if (width_um < grip->target_um && (view->over || view->fingers == 0)) {
    width_um = grip->target_um;
  }
  /* Where it touched is as far as it opens without being asked to. */
  int32_t most_um = grip->target_um > grip->touch_width_um ? grip->target_um : grip->touch_width_um;
  return grip_clamp(width_um, 0, most_um);
}

/* So many steps that the gripper moves at all. */
static int32_t least_steps(const struct grip *grip, bool tighten) {
  int32_t off_um =
      tighten ? grip->status.width_um - grip->target_um : grip->target_um - grip->status.width_um;
  int32_t missing_um = grip->traits.deadband_um - off_um;
  return missing_um <= grip->traits.step_um
             ? 1
             : port_divide(missing_um + grip->traits.step_um - 1, grip->traits.step_um);
}

/* What was sent last has been made, as far as an answer tells that is itself so late. */
static bool has_come(const struct grip *grip, uint32_t settles_us) {
  uint64_t late_us = grip->now_us > grip->status.t_us ? grip->now_us - grip->status.t_us : 0;
  return !grip->status.is_moving && grip->status.t_us > grip->aimed_us +
                                                            (uint64_t)grip->traits.latency_us +
                                                            settles_us + late_us;
}

/* The way that is still to come of the width then. Where the gripper stands, it makes none shorter
 * than its deadband. */
static int32_t coming_way(const struct grip *grip, int32_t width_um) {
  int32_t off_um = grip->status.width_um - grip->target_um;
  int32_t deadband_um = grip->traits.deadband_um;
  bool stays = has_come(grip, SETTLES_us) && off_um <= deadband_um && off_um >= -deadband_um;
  return width_um - (stays ? grip->status.width_um : grip->target_um);
}

uint32_t grip_aim(struct grip *grip, const struct grip_view *view, int32_t wanted_mN) {
  uint32_t trouble = 0;
  const struct grip_settings *settings = &grip->settings;
  if (wanted_mN >= settings->force_cap_mN) {
    wanted_mN = settings->force_cap_mN;
    trouble |= GRIP_AT_CAP;
  }
  grip->wanted_mN = wanted_mN;
  if (view->fingers == 0 || !knows_width(grip, view->t_us)) {
    return trouble;
  }
  if (!has_come(grip, 0) && view->t_us > grip->status.t_us + WIDTH_LAGS_us) {
    return trouble; /* one move at a time */
  }
  /* Where the force will be once the gripper is where it was sent. */
  int32_t width_um = grip_width_at(grip, view->t_us);
  int32_t stiffness = grip_stiffness(grip, view->mean_mN, width_um);
  int32_t coming_mN = grip_scale(stiffness, coming_way(grip, width_um), 1000);
  int32_t low_mN = view->low_mN + coming_mN, high_mN = view->high_mN + coming_mN;
  int32_t step_mN = grip_scale(stiffness, grip->traits.step_um, 1000);
  step_mN = step_mN < 1 ? 1 : step_mN;
  int32_t tolerance_mN = grip_scale(wanted_mN, TOLERANCE_PERMILLE, 1000);
  int32_t missing_mN = wanted_mN - low_mN;
  int32_t steps = 0;
  bool opens = grip->target_um - grip->status.width_um > grip->traits.step_um / 2;
  /* What slides is answered by a step at least. */
  int32_t share = grip->hold.sliding ? 0 : opens ? OPENING_PERMILLE : TIGHTEN_PERMILLE;
  if (missing_mN > tolerance_mN && missing_mN > grip_scale(step_mN, share, 1000)) {
    int32_t way_um = way_to(grip, grip->target_um, low_mN, wanted_mN);
    int32_t linear = port_divide(missing_mN + step_mN / 2, step_mN);
    steps = port_divide(way_um + grip->traits.step_um / 2, grip->traits.step_um);
    steps = steps < linear ? steps : linear;
    /* To open less needs no more than that. */
    bool closes = grip->target_um - steps * grip->traits.step_um < grip->status.width_um;
    int32_t least = closes ? least_steps(grip, true) : 1;
    steps = steps < least ? least : steps;
    int32_t most_mN = grip_scale(settings->force_cap_mN, CAP_PERMILLE, 1000);
    int32_t room = high_mN >= most_mN ? 0 : port_divide(most_mN - high_mN, step_mN);
    if (steps > room) {
      steps = room;
      trouble |= GRIP_AT_CAP;
    }
  } else if (-missing_mN > tolerance_mN &&
             view->t_us > grip->aimed_us + (uint64_t)grip->traits.latency_us + SETTLES_us) {
    int32_t least = least_steps(grip, false);
    int32_t spare = port_divide(-missing_mN + grip_scale(step_mN, LOOSEN_PERMILLE, 1000), step_mN);
    /* A step makes more than is known: for the same force it is not taken back. */
    bool for_less = wanted_mN < grip->tightened_mN - grip_scale(step_mN, FOR_LESS_PERMILLE, 1000);
    bool much = -missing_mN > grip_scale(step_mN, MUCH_PERMILLE, 1000) * least;
    int32_t most = port_divide(OPENS_MOST_um, grip->traits.step_um);
    most = !for_less || most < least ? least : most;
    steps = spare < least || !(for_less || much) ? 0 : spare < most ? -spare : -most;
  }
  if (steps != 0) {
    int32_t aimed_um = grip->target_um - steps * grip->traits.step_um;
    grip->target_um = grip_allowed_width(grip, view, aimed_um, &trouble);
    grip->aimed_us = grip->now_us;
    grip->tightened_mN = steps > 0 ? wanted_mN : grip->tightened_mN;
  }
  return trouble;
}
