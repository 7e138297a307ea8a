#include "contact/motion.h"

#include "common/contact_flags.h"
#include "fit/fit_math.h"
#include "port/divide.h"

#include <string.h>

#define TICK_SHIFT 6 /* 64 us */

/* Ages of the frames that make a pair, and by how much what the tangential force explains may be wrong over it. Of the
 * brief ones tried, from 20 to 65 ms in all, this finds slides as soon as any; but it includes the lift that came
 * before, for as long as it reaches back. The brisk one does not. Of 312 lifts with a dead travel of 2 mm (seed 211)
 * half of what BRIEF leaves unexplained, or two thirds of FLOOR_um, let one to two pass for slides. */
struct pair_spans {
  uint32_t latest_us, gap_end_us, begin_us;
  int32_t unexplained_um;
};
static const struct pair_spans BRISK = {4000u, 8000u, 16000u, 150};
static const struct pair_spans BRIEF = {5000u, 20000u, 50000u, 200};
static const struct pair_spans SLOW = {40000u, 120000u, 300000u, 200};
static const struct pair_spans SLOW_LATEST = {40000u, 40000u, 80000u, 0};

#define FLOOR_um 30 /* less is no motion */
/* Squares, in 1/256, of mm for each 8 mm that the tangential force explains: a tangential force moves the estimated
 * location by up to 0.3 mm for each unit of Q / F on calibrated pads. 1.5 mm is not believed, nor 5
 * times the location's standard deviation, which pads that were never calibrated need. */
#define CROSSTALK_q8 9
#define CROSSTALK_PER_SD2_q8 100
/* The slow pair is overruled where the brief one's way is below 1 / 22 of its own, a quarter of
 * what steady motion gives, or its latest span's share below 1 / 8, a half of it. */
#define CREEP_SHIFT 9
#define GOES_ON 8

/* Squares and products of this fit 32 bits. */
#define CHANGE_MAX_um 20000

void motion_reset(struct motion_history *history) {
  history->brief.count = 0;
  history->slow.count = 0;
  history->velocity_valid = false;
  history->moving = false;
  history->sliding = false;
  history->stepped = false;
  history->slow_slides = false;
}

/* Place of the entry with this age, counted from the newest. */
static uint32_t place_of(const struct motion_ring *ring, uint32_t back) { return (ring->newest - back) % MOTION_ENTRIES; }

static uint32_t enter(struct motion_ring *ring, const struct motion_sums *sums) {
  ring->newest++;
  if (ring->count < MOTION_ENTRIES) {
    ring->count++;
  }
  uint32_t place = place_of(ring, 0);
  ring->sums[place] = *sums;
  return place;
}

static uint32_t age_us(const struct motion_ring *ring, uint32_t back, uint32_t now_us) {
  return now_us - ring->sums[place_of(ring, back)].t_us;
}

/* How many entries before the newest the oldest is that is of at most this age. */
static uint32_t back_to(const struct motion_ring *ring, uint32_t now_us, uint32_t most_us) {
  uint32_t within = 0, beyond = ring->count;
  while (beyond - within > 1) {
    uint32_t middle = (within + beyond) / 2;
    if (age_us(ring, middle, now_us) <= most_us) {
      within = middle;
    } else {
      beyond = middle;
    }
  }
  return within;
}

static bool reaches(const struct motion_ring *ring, uint32_t now_us, uint32_t span_us) {
  return ring->count == MOTION_ENTRIES || (ring->count > 1 && age_us(ring, ring->count - 1u, now_us) >= span_us);
}

/* The change from one span of time to another. */
struct change {
  int32_t x_um, y_um, ratio_x_um, ratio_y_um;
  int32_t variance_um2; /* of the noise of x and y together */
};

static int32_t clamped(int32_t value, int32_t most) { return value > most ? most : value < -most ? -most : value; }

static int32_t mean_of(uint32_t to, uint32_t from, int32_t count) { return port_divide((int32_t)(to - from), count); }

static int32_t um_from_q11(int32_t mm_q11) { return clamped(mm_q11 * 125 / 256, CHANGE_MAX_um); }

/* Beyond every CHANGE_MAX_um, whatever the scale: a force that vanishes within a frame leaves dQ / F of any size. */
#define RATIO_CHANGE_MAX_q12 500000

/* What the tangential force explains. */
static int32_t um_from_ratio(int32_t ratio_q12, int32_t scale_q8) {
  ratio_q12 = clamped(ratio_q12, RATIO_CHANGE_MAX_q12);
  return clamped(ratio_q12 * (MOTION_PER_RATIO_mm * 125) / 512 * scale_q8 / 256, CHANGE_MAX_um);
}

static struct change change_of(const struct motion_history *history, const struct motion_ring *ring, const struct pair_spans *spans) {
  const struct motion_sums *now = &history->now;
  uint32_t latest = back_to(ring, now->t_us, spans->latest_us);
  uint32_t end = back_to(ring, now->t_us, spans->gap_end_us);
  uint32_t begin = back_to(ring, now->t_us, spans->begin_us);
  /* Where frames are far apart, those before. */
  begin = begin > latest ? begin : latest + 1;
  end = end < begin ? end : begin - 1;
  const struct motion_sums *a = &ring->sums[place_of(ring, begin)];
  const struct motion_sums *b = &ring->sums[place_of(ring, end)];
  const struct motion_sums *c = &ring->sums[place_of(ring, latest)];
  int32_t before = (int32_t)(b->count - a->count), since = (int32_t)(now->count - c->count);
  struct change change;
  change.x_um = um_from_q11(mean_of(now->x, c->x, since) - mean_of(b->x, a->x, before));
  change.y_um = um_from_q11(mean_of(now->y, c->y, since) - mean_of(b->y, a->y, before));
  change.ratio_x_um = um_from_ratio(mean_of(now->ratio_x, c->ratio_x, since) - mean_of(b->ratio_x, a->ratio_x, before), history->scale_q8);
  change.ratio_y_um = um_from_ratio(mean_of(now->ratio_y, c->ratio_y, since) - mean_of(b->ratio_y, a->ratio_y, before), history->scale_q8);
  change.variance_um2 =
      port_divide(mean_of(now->variance, c->variance, since), since) + port_divide(mean_of(b->variance, a->variance, before), before);
  return change;
}

static int32_t squared_way(const struct change *change) { return change->x_um * change->x_um + change->y_um * change->y_um; }

/* Squared way that is not to be believed; of a slide under way, a quarter of it. */
static int32_t squared_allowance(const struct change *change, bool already) {
  int32_t allowance = FLOOR_um * FLOOR_um + MOTION_NOISE_SDS * MOTION_NOISE_SDS * change->variance_um2;
  return already ? allowance / 4 : allowance;
}

static bool slides(const struct change *change, const struct pair_spans *spans, int32_t crosstalk_q8, bool already) {
  int32_t way2 = squared_way(change);
  int32_t ratio2 = change->ratio_x_um * change->ratio_x_um + change->ratio_y_um * change->ratio_y_um;
  if (way2 <= squared_allowance(change, already) + (ratio2 >> 8) * crosstalk_q8) {
    return false;
  }
  int32_t beyond = way2 - change->x_um * change->ratio_x_um - change->y_um * change->ratio_y_um; /* times way */
  int32_t least_um = already ? spans->unexplained_um / 2 : spans->unexplained_um;
  return beyond > 0 && (uint64_t)beyond * (uint32_t)beyond > (uint64_t)(uint32_t)(least_um * least_um) * (uint32_t)way2;
}

static bool slides_slowly(const struct motion_history *history, const struct change *brief) {
  if (!reaches(&history->slow, history->now.t_us, SLOW.begin_us)) {
    return false;
  }
  struct change slow = change_of(history, &history->slow, &SLOW);
  if (!slides(&slow, &SLOW, history->crosstalk_q8, history->sliding) ||
      squared_way(&slow) >> CREEP_SHIFT > squared_way(brief) + squared_allowance(brief, false)) {
    return false;
  }
  struct change latest = change_of(history, &history->slow, &SLOW_LATEST);
  return squared_way(&latest) > squared_allowance(&latest, true) &&
         latest.x_um * slow.x_um + latest.y_um * slow.y_um > squared_way(&slow) / GOES_ON;
}

static bool shows_slide(struct motion_history *history) {
  if (!reaches(&history->brief, history->now.t_us, BRIEF.begin_us)) {
    return false;
  }
  struct change brief = change_of(history, &history->brief, &BRIEF);
  if (history->stepped) {
    history->slow_slides = slides_slowly(history, &brief);
    history->stepped = false;
  }
  if (history->slow_slides || slides(&brief, &BRIEF, history->crosstalk_q8, history->sliding)) {
    return true;
  }
  struct change brisk = change_of(history, &history->brief, &BRISK);
  return slides(&brisk, &BRISK, history->crosstalk_q8, history->sliding);
}

/* numerator / denominator in Q10, within 2^-11 of it; denominator > 0. */
static int32_t quotient_q10(int64_t numerator, int32_t denominator) {
  uint64_t size = numerator < 0 ? 0u - (uint64_t)numerator : (uint64_t)numerator;
  for (size <<= 10; size >> 31 && denominator > 1; size >>= 1) {
    denominator >>= 1;
  }
  int32_t quotient = size >> 31 ? INT32_MAX : port_divide((int32_t)size, denominator);
  return numerator < 0 ? -quotient : quotient;
}

/* 2^-11 mm in 64 us, Q10: a thousandth of it is 0.0075 mm/s. */
#define mm_s_PER_QUOTIENT 0.0074505806f
#define QUOTIENTS_PER_mm_s 134
#define QUOTIENT_MAX 30000 /* squares fit: 220 mm/s */

/* Least squares over the frames of the span; false as long as there are too few. */
static bool find_velocity(struct motion_history *history) {
  const struct motion_ring *ring = &history->brief;
  const struct motion_sums *now = &history->now;
  if (ring->count < MOTION_VELOCITY_FRAMES || !reaches(ring, now->t_us, MOTION_VELOCITY_us)) {
    return false;
  }
  uint32_t back = back_to(ring, now->t_us, MOTION_VELOCITY_us);
  back = back > MOTION_VELOCITY_FRAMES - 1u ? back : MOTION_VELOCITY_FRAMES - 1u;
  const struct motion_sums *from = &ring->sums[place_of(ring, back)];
  const struct motion_sums *last = &ring->sums[place_of(ring, 0)];
  const struct motion_moments *before = &history->moments_before[place_of(ring, back)];
  /* Times and places count from the newest frame's, so that all but products fit 32 bits. */
  uint32_t tick = (uint32_t)(history->newest_us >> TICK_SHIFT);
  uint32_t x = now->x - last->x, y = now->y - last->y;
  uint32_t n = now->count - from->count;
  uint32_t t_sum = history->moments.t - before->t;
  uint32_t x_sum = now->x - from->x, y_sum = now->y - from->y;
  int32_t t = (int32_t)(t_sum - n * tick);
  int32_t tt = (int32_t)(history->moments.tt - before->tt - tick * (2u * t_sum - n * tick));
  int32_t tx = (int32_t)(history->moments.tx - before->tx - tick * x_sum - x * (uint32_t)t);
  int32_t ty = (int32_t)(history->moments.ty - before->ty - tick * y_sum - y * (uint32_t)t);
  int64_t spread = (int64_t)n * tt - (int64_t)t * t;
  if (spread <= 0 || spread > INT32_MAX) {
    return false;
  }
  int64_t along_x = (int64_t)(int32_t)n * tx - (int64_t)t * (int32_t)(x_sum - n * x);
  int64_t along_y = (int64_t)(int32_t)n * ty - (int64_t)t * (int32_t)(y_sum - n * y);
  int32_t vx_q10 = quotient_q10(along_x, (int32_t)spread);
  int32_t vy_q10 = quotient_q10(along_y, (int32_t)spread);
  history->motion.vx_mm_s = mm_s_PER_QUOTIENT * (float)vx_q10;
  history->motion.vy_mm_s = mm_s_PER_QUOTIENT * (float)vy_q10;
  vx_q10 = clamped(vx_q10, QUOTIENT_MAX);
  vy_q10 = clamped(vy_q10, QUOTIENT_MAX);
  /* The slope's variance is that of one location times n / spread: um^2 to the quotient's square. */
  const uint32_t per_um2 = 4398047u * MOTION_NOISE_SDS * MOTION_NOISE_SDS;
  int32_t least = QUOTIENTS_PER_mm_s * (history->moving ? MOTION_MOVING_ENDS_mm_s : MOTION_MOVING_mm_s);
  uint32_t v2 = (uint32_t)(vx_q10 * vx_q10) + (uint32_t)(vy_q10 * vy_q10);
  history->moving =
      v2 > (uint32_t)(least * least) && (uint64_t)v2 * (uint32_t)spread > (uint64_t)(now->variance - from->variance) * per_um2;
  return true;
}

#define PULL_MAX_q24 (32 << 24)

/* Enters a tangential force: what it has changed by, over the force of now. The normal force's own scale is in
 * both. Exact over any number of frames of one force. */
static void follow_ratio(struct motion_ratio *ratio, int32_t tangential_N_q24, int32_t force_N_q12, bool first) {
  if (first) {
    ratio->remainder = 0;
  } else {
    int32_t change = tangential_N_q24 - ratio->newest_q24 + ratio->remainder;
    int32_t ratio_q12 = port_divide(change, force_N_q12);
    ratio->remainder = change - ratio_q12 * force_N_q12;
    ratio->ratio_q12 += (uint32_t)ratio_q12;
  }
  ratio->newest_q24 = tangential_N_q24;
}

static int32_t noise_um(const struct fit_tangential *found) {
  return clamped(fit_fixed(found->location_noise_mm, 20), 1 << 20) * 125 / (1 << 17);
}

/* force_N_q12 > 0. */
static void add(struct motion_history *history, const struct tangential_settings *settings, uint64_t t_us,
                const struct fit_tangential *found, int32_t force_N_q12) {
  bool first = history->brief.count == 0;
  history->now.t_us = (uint32_t)t_us;
  history->moments_before[enter(&history->brief, &history->now)] = history->moments;
  if (history->slow.count == 0 || age_us(&history->slow, 0, history->now.t_us) >= MOTION_SLOW_STEP_us) {
    enter(&history->slow, &history->now);
    history->stepped = true;
  }
  uint32_t x = (uint32_t)fit_fixed(found->x_mm, 11), y = (uint32_t)fit_fixed(found->y_mm, 11);
  uint32_t noise = (uint32_t)noise_um(found);
  uint32_t tick = (uint32_t)(t_us >> TICK_SHIFT);
  int32_t sd_mm_q8 = clamped(fit_fixed(found->location_sd_mm, 8), 2 << 8);
  history->scale_q8 = fit_fixed(settings->tangential_scale, 8);
  history->crosstalk_q8 = CROSSTALK_q8 + (sd_mm_q8 * sd_mm_q8 * CROSSTALK_PER_SD2_q8 >> 16);
  history->now.count++;
  history->now.x += x;
  history->now.y += y;
  follow_ratio(&history->ratio_x, clamped(fit_fixed(found->qx_N, 24), PULL_MAX_q24), force_N_q12, first);
  follow_ratio(&history->ratio_y, clamped(fit_fixed(found->qy_N, 24), PULL_MAX_q24), force_N_q12, first);
  history->now.ratio_x += history->ratio_x.ratio_q12;
  history->now.ratio_y += history->ratio_y.ratio_q12;
  history->now.variance += noise * noise;
  history->moments.t += tick;
  history->moments.tt += tick * tick;
  history->moments.tx += tick * x;
  history->moments.ty += tick * y;
  history->newest_us = t_us;
}

static void judge(struct motion_history *history, uint64_t t_us) {
  history->judged_us = t_us;
  history->velocity_valid = find_velocity(history);
  if (shows_slide(history)) {
    history->sliding = true;
    history->last_slide_us = t_us;
  } else if (history->sliding && t_us - history->last_slide_us > MOTION_SLIDING_ENDS_us) {
    history->sliding = false;
    history->slow.count = 0; /* what rings after a slide is not to be compared with before it */
    history->slow_slides = false;
  }
}

static bool starts_again(const struct motion_history *history, const struct contact_input *input) {
  return history->brief.count > 0 &&
         (input->fit->used != history->used || input->t_us <= history->newest_us || input->t_us - history->newest_us > MOTION_PAUSE_us);
}

static void report(const struct motion_history *history, struct contact_result *result, struct motion *motion) {
  if (history->velocity_valid) {
    *motion = history->motion;
    result->flags |= CONTACT_FLAG_VELOCITY_VALID;
    result->flags |= history->moving ? (uint32_t)CONTACT_FLAG_MOVING : 0;
  }
  result->flags |= history->sliding ? (uint32_t)CONTACT_FLAG_SLIDING : 0;
}

void motion_update(struct motion_history *history, const struct tangential_settings *settings, const struct contact_input *input,
                   struct contact_result *result, struct motion *motion) {
  const struct fit_tangential *found = input->tangential;
  memset(motion, 0, sizeof *motion);
  if (!input->contact || input->zero_doubtful) {
    motion_reset(history);
    return;
  }
  int32_t force_N_q12 = found && found->valid ? fit_fixed(found->force_N, 12) : 0;
  if (force_N_q12 <= 0 || noise_um(found) > MOTION_NOISE_MAX_um) {
    return;
  }
  if (starts_again(history, input)) {
    motion_reset(history);
  }
  history->used = input->fit->used;
  add(history, settings, input->t_us, found, force_N_q12);
  if (history->brief.count == 1 || input->t_us - history->judged_us >= MOTION_JUDGED_us) {
    judge(history, input->t_us);
  }
  report(history, result, motion);
}
