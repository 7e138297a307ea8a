#include "grip/grip_parts.h"
#include "port/divide.h"

#include <stddef.h>

/* Of the load's rate. */
#define RATE_us 20000
/* Beyond the actuator's latency, until what is wanted acts. */
#define AHEAD_us 8000
#define AHEAD_MIN_us 20000
#define AHEAD_MAX_us 80000

/* A slide raises the grip at once, and by more again each time the gripper has had the time to
 * answer and it goes on: the more the later the gripper answers, for a slide gains speed. */
#define REFLEX_PERMILLE 1100
#define REFLEX_PERMILLE_ms 16 /* of latency */
#define REFLEX_MIN_PERMILLE 1200
#define REFLEX_MAX_PERMILLE 1500
#define GOES_ON_PERMILLE 200
#define REFLEX_AGAIN_us 35000
/* All raises of a slide together ask for no more than this of what is felt: a late gripper has not
 * done yet what was asked before. */
#define RAISED_MOST_PERMILLE 2000
/* The Q / F of a sliding object is its friction, however hard the grip. The Q / F of an object that
 * rests falls as the grip grows, and squeezed rubber moves the contact as a slide does. So no slide
 * begins below this share of the recent largest Q / F, and none goes on below that share of the
 * last raise's. */
#define BEGINS_AT_PERMILLE 850
#define LOAD_NOISE_mN 60
#define GOES_ON_AT_PERMILLE 800
/* A creep raises the grip by so much of the measured force, and teaches nothing. */
#define CREEP_PERMILLE 1080
/* This much of the grip that ended a slide is not given up where no load tells what is needed. */
#define FLOOR_PERMILLE 850

/* Where loads are guessed from the start, the first grip is so much of what it is elsewhere; and
 * what a guess needs is taken so many times, for it may be that far off. */
#define GUESSING_PERMILLE 1500
#define GUESSED_PERMILLE 1300

/* Grip comes down in steps of so long. */
#define DECAY_us 50000u

/* An object that slides at less than this of Q / F pulls more than the fingertips report. Then only
 * the grip that stopped it is known, and the grip grows by more at once. Otherwise its load and
 * friction are known. */
#define BELIEVED_PERMILLE 150
#define BELIEVED_OF_PERMILLE 400
#define UNTOLD_REFLEX_PERMILLE 1500
#define UNTOLD_AGAIN_PERMILLE 2000
/* What has just been caught swings on the rubber. */
#define CAUGHT_us 300000u

/* Time constant of the recent largest Q / F. */
#define SHARE_us 200000
#define FRICTION_MIN_PERMILLE 150
#define FRICTION_MAX_PERMILLE 1500

void grip_hold_begin(struct grip *grip) {
  grip->hold = (struct grip_hold){.friction_permille = grip->settings.friction_permille};
}

static int32_t share_of(const struct grip_view *view, int32_t more_mN) {
  return view->low_mN > 0 ? grip_scale(view->load_mN + more_mN, 1000, view->low_mN) : 0;
}

/* A slide is reported late, when the grip may hold again. So the recent largest share counts. */
static void follow_share(struct grip *grip, const struct grip_view *view, int32_t step_us) {
  struct grip_hold *hold = &grip->hold;
  hold->share_permille -= grip_scale(hold->share_permille, step_us, SHARE_us);
  if (view->low_mN >= grip->settings.touch_mN * 2) {
    int32_t share = share_of(view, 0);
    hold->share_permille = share > hold->share_permille ? share : hold->share_permille;
  }
}

static void follow_load(struct grip *grip, const struct grip_view *view) {
  struct grip_hold *hold = &grip->hold;
  int32_t step_us =
      grip->now_us - hold->load_us > 100000 ? 100000 : (int32_t)(grip->now_us - hold->load_us);
  hold->load_us = grip->now_us;
  hold->has_told = true;
  hold->load_mN = view->load_mN;
  int32_t lag_mN = view->load_mN - hold->slow_load_mN;
  hold->rate_mN_s = lag_mN > 0 ? grip_scale(lag_mN, 1000000, RATE_us) : 0;
  follow_share(grip, view, step_us > SHARE_us ? SHARE_us : step_us);
  hold->slow_load_mN += step_us >= RATE_us ? lag_mN : grip_scale(lag_mN, step_us, RATE_us);
}

static void learn_friction(struct grip *grip, const struct grip_view *view, bool slides) {
  struct grip_hold *hold = &grip->hold;
  if (!view->has_load || hold->sliding) {
    return;
  }
  int32_t seen = grip_clamp(hold->share_permille, FRICTION_MIN_PERMILLE, FRICTION_MAX_PERMILLE);
  if (!slides) {
    hold->friction_permille = seen > hold->friction_permille ? seen : hold->friction_permille;
    return;
  }
  int32_t least = grip_scale(hold->friction_permille, BELIEVED_OF_PERMILLE, 1000);
  bool again = hold->slides > 0 && grip->now_us - hold->slid_us < CAUGHT_us;
  if (again || hold->share_permille < (least > BELIEVED_PERMILLE ? least : BELIEVED_PERMILLE)) {
    return;
  }
  hold->load_is_believed = true;
  hold->friction_permille = seen < hold->friction_permille ? seen : hold->friction_permille;
}

static int32_t reflex_permille(const struct grip *grip, bool begins) {
  int32_t later = grip_scale(grip->traits.latency_us, REFLEX_PERMILLE_ms, 1000);
  int32_t permille = grip_clamp(REFLEX_PERMILLE + later, REFLEX_MIN_PERMILLE, REFLEX_MAX_PERMILLE);
  permille += begins ? 0 : GOES_ON_PERMILLE;
  int32_t untold = grip->hold.share_permille >= BELIEVED_PERMILLE ? 0
                   : begins                                       ? UNTOLD_REFLEX_PERMILLE
                                                                  : UNTOLD_AGAIN_PERMILLE;
  return permille > untold ? permille : untold;
}

static bool is_slide(const struct grip_hold *hold, const struct grip_view *view) {
  int32_t least = grip_scale(hold->share_permille, BEGINS_AT_PERMILLE, 1000);
  int32_t share = share_of(view, LOAD_NOISE_mN);
  return view->slides && (hold->sliding || !view->tells_load || view->runs || share >= least);
}

/* Since the last raise the gripper has had the time to answer. */
static bool may_be_raised(const struct grip *grip) {
  return grip->now_us - grip->hold.raised_us > (uint64_t)grip->traits.latency_us + REFLEX_AGAIN_us;
}

static bool goes_on(const struct grip_hold *hold, const struct grip_view *view) {
  int32_t least = grip_scale(hold->raised_share_permille, GOES_ON_AT_PERMILLE, 1000);
  return !view->has_load || view->runs || share_of(view, LOAD_NOISE_mN) >= least;
}

static void raise_grip(struct grip *grip, const struct grip_view *view) {
  struct grip_hold *hold = &grip->hold;
  bool begins = !hold->sliding;
  int32_t from_mN = !begins && grip->wanted_mN > view->low_mN ? grip->wanted_mN : view->low_mN;
  int32_t raised_mN = grip_scale(from_mN, reflex_permille(grip, begins), 1000);
  int32_t most_mN = grip_scale(view->low_mN, RAISED_MOST_PERMILLE, 1000);
  most_mN = grip_clamp(most_mN, 0, grip->settings.force_cap_mN);
  raised_mN = raised_mN < most_mN ? raised_mN : most_mN;
  hold->floor_mN = raised_mN > hold->floor_mN ? raised_mN : hold->floor_mN;
  hold->raised_us = grip->now_us;
  hold->raised_share_permille = view->has_load ? share_of(view, 0) : 0;
  hold->slides += begins;
}

static void answer_slide(struct grip *grip, const struct grip_view *view) {
  struct grip_hold *hold = &grip->hold;
  bool slides = is_slide(hold, view) && (hold->sliding || !view->creeps);
  learn_friction(grip, view, slides);
  if (slides) {
    if (!hold->sliding || (may_be_raised(grip) && goes_on(hold, view))) {
      raise_grip(grip, view);
    }
    hold->slid_us = grip->now_us;
    hold->has_slid = true;
  } else if (hold->sliding) {
    hold->floor_mN = hold->load_is_believed ? 0 : grip_scale(hold->floor_mN, FLOOR_PERMILLE, 1000);
    grip_guess_anew(grip);
  }
  hold->sliding = slides;
}

static int32_t least_felt(const struct grip *grip) {
  int32_t permille = grip->is_guessing ? GUESSING_PERMILLE : 1000;
  int32_t least_mN = grip_scale(grip->settings.first_mN, permille, 1000);
  return grip_clamp(least_mN, 0, grip->settings.force_cap_mN);
}

int32_t grip_first_force(const struct grip *grip) {
  return grip->is_blind ? grip->settings.blind_mN : least_felt(grip);
}

/* Without a reported load since GRASP: the grip that is set for that. */
static int32_t least_force(const struct grip *grip, bool told) {
  const struct grip_hold *hold = &grip->hold;
  int32_t least_mN = told || hold->has_told ? least_felt(grip) : grip->settings.blind_mN;
  return hold->floor_mN > least_mN ? hold->floor_mN : least_mN;
}

/* Against what creeps. */
static int32_t creep_force(struct grip *grip, const struct grip_view *view) {
  struct grip_hold *hold = &grip->hold;
  if (!view->fresh || !view->creeps || hold->sliding || !is_slide(hold, view) ||
      !may_be_raised(grip)) {
    return 0;
  }
  hold->raised_us = grip->now_us;
  int32_t force_mN = grip_scale(view->low_mN, CREEP_PERMILLE, 1000);
  return grip_clamp(force_mN, 0, grip->settings.force_cap_mN);
}

/* What the load of some time ahead needs. */
static int32_t load_force(const struct grip *grip, const struct grip_view *view) {
  const struct grip_hold *hold = &grip->hold;
  int32_t ahead_us = grip_clamp(grip->traits.latency_us + AHEAD_us, AHEAD_MIN_us, AHEAD_MAX_us);
  int32_t load_mN = hold->load_mN + grip_scale(hold->rate_mN_s, ahead_us, 1000000);
  int32_t force_mN = grip_scale(load_mN, grip->settings.margin_permille, hold->friction_permille);
  force_mN = hold->has_slid ? grip_scale(force_mN, grip->settings.slid_permille, 1000) : force_mN;
  bool is_guess = view->has_load && !view->tells_load;
  return is_guess ? grip_scale(force_mN, GUESSED_PERMILLE, 1000) : force_mN;
}

int32_t grip_hold_wants(struct grip *grip, const struct grip_view *view) {
  struct grip_hold *hold = &grip->hold;
  if (view->fresh) {
    if (view->has_load) {
      follow_load(grip, view);
    }
    answer_slide(grip, view);
  }
  const int32_t forces_mN[] = {load_force(grip, view), least_force(grip, view->has_load),
                               creep_force(grip, view)};
  int32_t wanted_mN = 0;
  for (size_t i = 0; i < sizeof forces_mN / sizeof *forces_mN; i++) {
    wanted_mN = forces_mN[i] > wanted_mN ? forces_mN[i] : wanted_mN;
  }
  bool rests = view->has_load && !view->slides &&
               !(hold->has_slid && grip->now_us - hold->slid_us < grip->settings.rest_us);
  uint64_t step_us = grip->now_us - hold->decayed_us;
  if (wanted_mN >= grip->wanted_mN || !rests || step_us > 2 * DECAY_us) {
    hold->decayed_us = grip->now_us;
    return wanted_mN > grip->wanted_mN ? wanted_mN : grip->wanted_mN;
  }
  if (step_us < DECAY_us) {
    return grip->wanted_mN;
  }
  hold->decayed_us = grip->now_us;
  int32_t share = port_divide(grip->settings.decay_permille_s * (int32_t)step_us, 1000);
  return grip->wanted_mN - grip_scale(grip->wanted_mN - wanted_mN, share, 1000000);
}
