#include "grip/grip_parts.h"
#include "port/divide.h"

/* A fingertip whose values stay to the last bit for so long, and over so many frames, is stuck:
 * noise changes them with every frame. */
#define FROZEN_us 50000u
#define FROZEN_FRAMES 5u

/* A hundred kilograms: no fingertip measures more. */
#define FORCE_MAX_mN 1000000
/* A metre, at most. */
#define PLACE_MAX_um 1000000
#define SIGMA_MAX_um 100000
#define ZERO_FRAMES_MAX 2000u

/* A location counts as a load only if none was reported for so long, and for no more than this
 * share of the force. What is beyond is a slide. */
#define PULLED_us 300000u
#define GUESSED_MOST_PERMILLE 600
#define GUESSED_TOLD_PERMILLE 500
#define GUESSED_AFTER_PERMILLE 300
/* Of what a load moves it by, so much is pressure that is uneven by Q / F, and the rest rubber that
 * has given way and stays there however the force grows. */
#define UNEVEN_Q20 629146 /* 0.6 */
#define GUESS_MAX (1 << 30)

/* Reported slides below this, of either fingertip, are a contact that settles, until they have
 * lasted. Above the last limit they are slides however the load over force falls. */
#define CREEPS_um_s 4000u
#define CREEPS_us 150000u
#define RUNS_um_s 20000u
#define SPEED_MAX_um_s 46340 /* squares of two fit 32 bits */

/* A force with a larger standard deviation is no measurement. */
#define FORCE_SD_MAX_PERMILLE 1000

/* What neither location nor load is to be believed with. */
#define FORCE_ONLY                                                                                 \
  (CONTACT_FLAG_UNCERTAIN | CONTACT_FLAG_FLAT | CONTACT_FLAG_AT_BOUND | CONTACT_FLAG_SATURATED |   \
   CONTACT_FLAG_ZERO_DOUBTFUL)
/* Without a location that moves as the contact does. */
#define NO_PLACE                                                                                   \
  (CONTACT_FLAG_FLAT | CONTACT_FLAG_AT_BOUND | CONTACT_FLAG_SATURATED | CONTACT_FLAG_ZERO_DOUBTFUL)
/* A contact with a larger sigma lies across all of the pad: its location is that of the pad. On
 * 12 mm of rubber round objects of up to 20 N have 4.5 to 9 mm, plates 21 to 22. */
#define WIDE_um 15000
/* A Gaussian that wide reaches far beyond the pad, whose rubber takes no more of its force than
 * that on so much of it: a block of 36 by 54 mm does. */
#define WIDE_AREA_mm2 1400
#define OVER (CONTACT_FLAG_SATURATED | CONTACT_FLAG_FORCE_LOWER_BOUND)

int32_t grip_clamp(int32_t value, int32_t low, int32_t high) {
  return value < low ? low : value > high ? high : value;
}

int32_t grip_scale(int32_t value, int32_t numerator, int32_t denominator) {
  int64_t product = (int64_t)value * numerator;
  if (product >= INT32_MIN && product <= INT32_MAX) {
    return port_divide((int32_t)product, denominator); /* a tenth of the cycles */
  }
  int64_t result = product / denominator;
  return result > INT32_MAX ? INT32_MAX : result < INT32_MIN ? INT32_MIN : (int32_t)result;
}

static uint32_t root_of(uint64_t square) {
  uint32_t root = 0;
  for (uint32_t bit = UINT32_C(1) << 31; bit != 0; bit >>= 1) {
    uint64_t tried = root | bit;
    if (tried * tried <= square) {
      root |= bit;
    }
  }
  return root;
}

static int32_t length_of(int32_t x, int32_t y) {
  return (int32_t)root_of((uint64_t)((int64_t)x * x) + (uint64_t)((int64_t)y * y));
}

static bool tells_force(const struct grip_touch *touch) {
  if (!(touch->flags & CONTACT_FLAG_CONTACT)) {
    return true; /* none */
  }
  return (touch->flags & CONTACT_FLAG_FIT_VALID) != 0 &&
         (!(touch->flags & CONTACT_FLAG_UNCERTAINTY_VALID) ||
          touch->force_sd_mN <= grip_scale(touch->force_mN, FORCE_SD_MAX_PERMILLE, 1000));
}

static bool is_same(const struct grip_touch *a, const struct grip_touch *b) {
  return a->force_mN == b->force_mN && a->force_sd_mN == b->force_sd_mN && a->x_um == b->x_um &&
         a->y_um == b->y_um && a->qx_mN == b->qx_mN && a->qy_mN == b->qy_mN;
}

static bool is_wide(const struct grip_touch *touch) {
  return (touch->flags & CONTACT_FLAG_FIT_VALID) != 0 && touch->sigma_um > WIDE_um;
}

/* Of a wide contact, what of the fitted force lies on the pad. */
static int32_t force_on_pad(const struct grip_touch *touch) {
  if (!is_wide(touch)) {
    return touch->force_mN;
  }
  int32_t sigma_um = grip_clamp(touch->sigma_um, WIDE_um, SIGMA_MAX_um);
  int32_t spread_mm2 = (int32_t)((int64_t)sigma_um * sigma_um / 187000); /* 0.85 2 pi sigma^2 */
  return grip_scale(touch->force_mN, WIDE_AREA_mm2, WIDE_AREA_mm2 + spread_mm2);
}

static void add_to_zero(struct grip_zero *zero, int32_t x, int32_t y) {
  if (zero->sums < ZERO_FRAMES_MAX) {
    zero->x_sum += x;
    zero->y_sum += y;
    zero->sums++;
  }
}

/* No larger than this of the force. */
static void limit_guess(const struct grip *grip, struct grip_finger *own, int32_t permille) {
  int32_t ratio_um = grip_scale(grip->settings.shift_um, permille, 1000);
  int32_t most = grip_scale(own->force_mN, ratio_um, 64);
  int32_t size = length_of(own->guess_x, own->guess_y);
  if (size > most) {
    own->guess_x = grip_scale(own->guess_x, most, size);
    own->guess_y = grip_scale(own->guess_y, most, size);
  }
}

static void guess_at(struct grip_finger *own, int32_t x_um, int32_t y_um) {
  own->at_x_um = x_um;
  own->at_y_um = y_um;
  own->at_mN = own->force_mN;
  own->has_told = false;
  own->has_place = true;
}

/* From now on the location gives changes of the last reported load. */
static void guess_from(const struct grip *grip, struct grip_finger *own) {
  own->guess_x = grip_scale(own->told_x_mN, grip->settings.shift_um, 64);
  own->guess_y = grip_scale(own->told_y_mN, grip->settings.shift_um, 64);
  limit_guess(grip, own, GUESSED_TOLD_PERMILLE);
  guess_at(own, own->touch.x_um, own->touch.y_um);
}

static int32_t guess_after(const struct grip_finger *own, int32_t guess, int32_t moved_um) {
  int32_t more_q20 =
      own->at_mN < 1 ? 0 : grip_scale(own->force_mN - own->at_mN, UNEVEN_Q20, own->at_mN);
  int64_t grown = ((int64_t)guess * more_q20 + (1 << 19)) >> 20;
  int64_t sum = guess + grown + grip_scale(own->force_mN, moved_um, 64);
  return sum > GUESS_MAX ? GUESS_MAX : sum < -GUESS_MAX ? -GUESS_MAX : (int32_t)sum;
}

static void guess_load(const struct grip *grip, struct grip_finger *own) {
  const struct grip_touch *touch = &own->touch;
  if (own->has_told) {
    guess_from(grip, own);
  } else if (own->has_place) {
    own->guess_x = guess_after(own, own->guess_x, touch->x_um - own->at_x_um);
    own->guess_y = guess_after(own, own->guess_y, touch->y_um - own->at_y_um);
    guess_at(own, touch->x_um, touch->y_um);
  }
  int32_t load_mN = grip_scale(length_of(own->guess_x, own->guess_y), 64, grip->settings.shift_um);
  int32_t most_mN = grip_scale(own->force_mN, GUESSED_MOST_PERMILLE, 1000);
  own->shifts = load_mN > most_mN;
  own->load_mN = own->shifts ? most_mN : load_mN;
  add_to_zero(&own->place, touch->x_um, touch->y_um);
}

static bool told_lately(const struct grip_finger *own) {
  return own->has_pulled && own->touch.t_us - own->pulled_us < PULLED_us;
}

/* The load: as reported, or, for contacts too long to report it, from the motion of the location
 * since the zero. */
static void take_load(const struct grip *grip, struct grip_finger *own) {
  const struct grip_touch *touch = &own->touch;
  bool contact = (touch->flags & CONTACT_FLAG_CONTACT) != 0;
  own->tells_load =
      (touch->flags & CONTACT_FLAG_TANGENTIAL_VALID) != 0 && (touch->flags & FORCE_ONLY) == 0;
  own->guesses_load = false;
  if (own->tells_load) {
    own->pulled_us = touch->t_us;
    own->has_pulled = own->has_told = true;
    /* For a contact that reported none when the grasp stood, the zero is the guess. */
    if (own->has_place && own->pull.sums == 0) {
      own->pull.x = touch->qx_mN - grip_scale(own->guess_x, 64, grip->settings.shift_um);
      own->pull.y = touch->qy_mN - grip_scale(own->guess_y, 64, grip->settings.shift_um);
    }
    int32_t x_mN = touch->qx_mN - own->pull.x, y_mN = touch->qy_mN - own->pull.y;
    own->load_mN = length_of(x_mN, y_mN);
    own->told_x_mN = x_mN;
    own->told_y_mN = y_mN;
    add_to_zero(&own->pull, touch->qx_mN, touch->qy_mN);
  } else if (contact && !is_wide(touch) && (touch->flags & CONTACT_FLAG_FIT_VALID) != 0 &&
             (touch->flags & (NO_PLACE | CONTACT_FLAG_TANGENTIAL_VALID)) == 0 &&
             !told_lately(own) && grip->settings.shift_um > 0) {
    own->guesses_load = true;
    guess_load(grip, own);
  }
}

void grip_take_touch(struct grip *grip, unsigned finger, const struct grip_touch *touch) {
  if (finger >= GRIP_FINGERS ||
      (grip->finger[finger].is_heard && touch->t_us <= grip->finger[finger].touch.t_us)) {
    return;
  }
  struct grip_finger *own = &grip->finger[finger];
  bool says_something =
      (touch->flags & CONTACT_FLAG_CONTACT) != 0 && (touch->flags & CONTACT_FLAG_HELD) == 0;
  if (!own->is_heard || !says_something || !is_same(&own->touch, touch)) {
    own->changed_us = touch->t_us;
    own->unchanged = 0;
  } else {
    own->unchanged++;
  }
  own->touch = *touch;
  own->touch.force_mN = grip_clamp(touch->force_mN, 0, FORCE_MAX_mN);
  own->touch.force_mN = force_on_pad(&own->touch);
  own->touch.x_um = grip_clamp(touch->x_um, -PLACE_MAX_um, PLACE_MAX_um);
  own->touch.y_um = grip_clamp(touch->y_um, -PLACE_MAX_um, PLACE_MAX_um);
  own->touch.qx_mN = grip_clamp(touch->qx_mN, -FORCE_MAX_mN, FORCE_MAX_mN);
  own->touch.qy_mN = grip_clamp(touch->qy_mN, -FORCE_MAX_mN, FORCE_MAX_mN);
  own->is_heard = true;
  own->is_new = true;
  if (!(touch->flags & CONTACT_FLAG_SLIDING)) {
    own->still_us = touch->t_us;
  }
  if (tells_force(touch)) {
    own->told_us = touch->t_us;
    own->force_mN = touch->flags & CONTACT_FLAG_CONTACT ? own->touch.force_mN : 0;
  }
  take_load(grip, own);
}

static void end_zero(struct grip_zero *zero) {
  if (zero->sums > 0) {
    zero->x = port_divide(zero->x_sum, (int32_t)zero->sums);
    zero->y = port_divide(zero->y_sum, (int32_t)zero->sums);
  }
}

void grip_zero_begin(struct grip *grip) {
  for (int i = 0; i < GRIP_FINGERS; i++) {
    grip->finger[i].pull = grip->finger[i].place = (struct grip_zero){0};
  }
}

void grip_zero_end(struct grip *grip) {
  for (int i = 0; i < GRIP_FINGERS; i++) {
    struct grip_finger *own = &grip->finger[i];
    end_zero(&own->pull);
    end_zero(&own->place);
    own->has_place = false;
    own->has_told = own->pull.sums > 0;
    own->guess_x = own->guess_y = 0;
    if (own->place.sums > 0) {
      guess_at(own, own->place.x, own->place.y);
    }
    /* The report against the zero before. */
    own->load_mN = own->told_x_mN = own->told_y_mN = 0;
    own->shifts = false;
  }
}

void grip_guess_anew(struct grip *grip) {
  for (int i = 0; i < GRIP_FINGERS; i++) {
    struct grip_finger *own = &grip->finger[i];
    if (own->guesses_load && own->has_pulled) {
      guess_from(grip, own);
    } else if (own->guesses_load) {
      limit_guess(grip, own, GUESSED_AFTER_PERMILLE);
    }
  }
}

bool grip_zero_has(const struct grip *grip, uint32_t frames) {
  for (int i = 0; i < GRIP_FINGERS; i++) {
    const struct grip_finger *own = &grip->finger[i];
    if ((own->tells_load && own->pull.sums < frames) ||
        (own->guesses_load && own->place.sums < frames)) {
      return false;
    }
  }
  return true;
}

static bool is_frozen(const struct grip *grip, const struct grip_finger *own) {
  return own->unchanged >= FROZEN_FRAMES && own->touch.t_us - own->changed_us >= FROZEN_us &&
         grip->state != GRIP_IDLE;
}

/* Eq. (7) takes loads for slides: it counts only where nothing else tells either. */
static bool slides(const struct grip_finger *own) {
  if (own->tells_load) {
    return (own->touch.flags & CONTACT_FLAG_SLIDING) != 0;
  }
  return own->guesses_load && own->has_place ? own->shifts
                                             : (own->touch.flags & CONTACT_FLAG_SLIP) != 0;
}

static uint32_t squared(int32_t value) {
  value = grip_clamp(value, -SPEED_MAX_um_s, SPEED_MAX_um_s);
  return (uint32_t)(value * value);
}

/* The speed of a reported slide. */
static void look_at_speed(const struct grip_finger *own, struct grip_view *view, bool *lasts) {
  const struct grip_touch *touch = &own->touch;
  if (!own->tells_load) {
    *lasts = *lasts || slides(own);
  } else if (touch->flags & CONTACT_FLAG_VELOCITY_VALID) {
    uint32_t speed2 = squared(touch->vx_um_s) + squared(touch->vy_um_s);
    view->creeps = view->creeps || speed2 < CREEPS_um_s * CREEPS_um_s;
    view->runs = view->runs || (slides(own) && speed2 >= RUNS_um_s * RUNS_um_s);
  }
  *lasts = *lasts || touch->t_us - own->still_us >= CREEPS_us;
}

void grip_look(struct grip *grip, struct grip_view *view) {
  *view = (struct grip_view){.low_mN = INT32_MAX, .t_us = UINT64_MAX};
  int32_t loads = 0, load_sum_mN = 0, load_most_mN = 0;
  int32_t force_sum_mN = 0;
  bool lasts = false;
  for (int i = 0; i < GRIP_FINGERS; i++) {
    struct grip_finger *own = &grip->finger[i];
    bool stale = !own->is_heard || grip->now_us > own->touch.t_us + grip->settings.stale_us;
    bool frozen = !stale && is_frozen(grip, own);
    bool untold = !stale && grip->now_us > own->told_us + grip->settings.stale_us;
    view->fresh = view->fresh || own->is_new;
    own->is_new = false;
    view->trouble |= stale ? (uint32_t)GRIP_FINGER_0_STALE << i : 0;
    view->trouble |= frozen ? (uint32_t)GRIP_FINGER_0_FROZEN << i : 0;
    view->trouble |= untold ? (uint32_t)GRIP_FINGER_0_UNTOLD << i : 0;
    if (stale || frozen) {
      continue;
    }
    if (own->touch.flags & OVER) {
      view->over = true;
      view->trouble |= (uint32_t)GRIP_FINGER_0_OVER << i;
    }
    bool contact = (own->touch.flags & CONTACT_FLAG_CONTACT) != 0;
    if (contact && (own->touch.flags & FORCE_ONLY) != 0) {
      view->trouble |= (uint32_t)GRIP_FINGER_0_FORCE_ONLY << i;
    }
    if (contact) {
      view->slides = view->slides || slides(own);
      look_at_speed(own, view, &lasts);
      view->may_tell = view->may_tell || own->guesses_load || told_lately(own);
      bool guesses = own->guesses_load && own->has_place;
      if (own->tells_load && !view->tells_load) {
        loads = load_sum_mN = load_most_mN = 0; /* a reported load counts, not a guess */
        view->tells_load = true;
      }
      if (own->tells_load || (guesses && !view->tells_load)) {
        loads++;
        load_sum_mN += own->load_mN;
        load_most_mN = own->load_mN > load_most_mN ? own->load_mN : load_most_mN;
      }
    }
    view->touches += contact;
    if (!untold) {
      view->fingers++;
      force_sum_mN += own->force_mN;
      view->low_mN = own->force_mN < view->low_mN ? own->force_mN : view->low_mN;
      view->high_mN = own->force_mN > view->high_mN ? own->force_mN : view->high_mN;
      view->t_us = own->told_us < view->t_us ? own->told_us : view->t_us;
    }
  }
  view->creeps = view->creeps && view->slides && !lasts;
  if (view->fingers == 0) {
    view->low_mN = 0;
    view->t_us = grip->now_us;
  } else {
    view->mean_mN = force_sum_mN / view->fingers;
  }
  if (view->high_mN > grip->settings.touch_mN * 4 &&
      view->high_mN - view->low_mN >
          grip_scale(view->high_mN, grip->settings.differ_permille, 1000)) {
    view->trouble |= GRIP_FINGERS_DIFFER;
  }
  if (loads > 0) {
    /* Fingertips share a load; where one carries far more, it is that one's that slides. */
    int32_t mean_mN = load_sum_mN / loads;
    int32_t least_mN = grip_scale(load_most_mN, 800, 1000);
    view->load_mN = mean_mN > least_mN ? mean_mN : least_mN;
    view->has_load = true;
  }
}
