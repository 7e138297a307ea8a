#include "contact/motion.h"

#include "common/contact_flags.h"
#include "port/divide.h"

#include <string.h>

#define SIXTEENTHS_PER_mm 16000.0f
#define TICK_SHIFT 6 /* 64 us */
#define TICKS_PER_s 15625.0f

/* Ages of the frames that make a pair. Of the brief ones tried, from 20 to 65 ms in all, this finds
 * slides as soon as any; longer ones still feel the lift that came before. */
struct pair_spans {
  uint32_t latest_us, gap_end_us, begin_us;
};
static const struct pair_spans BRIEF = {5000u, 20000u, 50000u};
static const struct pair_spans SLOW = {40000u, 120000u, 300000u};
static const struct pair_spans SLOW_LATEST = {40000u, 40000u, 80000u};

/* Less is no motion, and what the load explains may be wrong by so much. Lifts of 1 to 10 N stayed
 * below a half of the latter, slides are above both within some ms of each other. */
#define FLOOR_um 30
#define UNEXPLAINED_um 200
/* Squares, in 1/256, of mm for each 8 mm that the load explains: a load moves the estimated
 * location by 0.3 mm for each unit of Q / F on calibrated pads. 1.5 mm is not believed, nor 5 times
 * the location's standard deviation, which pads that were never calibrated need. */
#define CROSSTALK_q8 9
#define CROSSTALK_PER_SD2_q8 100.0f
/* The slow pair is overruled where the brief one's way is below 1 / 22 of its own, a quarter of
 * what steady motion gives, or its latest span's share below 1 / 8, a half of it. */
#define STANDS_SHIFT 9
#define GOES_ON 8

/* Squares and products of so much fit 32 bits. */
#define CHANGE_MAX_um 20000

void motion_reset(struct motion_history *history) {
  history->brief.count = 0;
  history->slow.count = 0;
  history->moving = false;
  history->sliding = false;
}

/* Place of what was entered so many entries before the newest. */
static uint32_t place_of(const struct motion_ring *ring, uint32_t back) {
  return (ring->newest - back) % MOTION_ENTRIES;
}

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
  return ring->count == MOTION_ENTRIES ||
         (ring->count > 1 && age_us(ring, ring->count - 1u, now_us) >= span_us);
}

/* From one span of time to another. */
struct change {
  int32_t x_um, y_um, load_x_um, load_y_um;
  int32_t variance_um2; /* of the noise of x and y together */
};

static int32_t clamped(int32_t value, int32_t most) {
  return value > most ? most : value < -most ? -most : value;
}

static int32_t mean_of(uint32_t to, uint32_t from, int32_t count) {
  return port_divide((int32_t)(to - from), count);
}

static int32_t um_from(int32_t to_16th_um, int32_t from_16th_um) {
  return clamped((to_16th_um - from_16th_um) / 16, CHANGE_MAX_um);
}

static struct change change_of(const struct motion_ring *ring, const struct motion_sums *now,
                               const struct pair_spans *spans) {
  uint32_t latest = back_to(ring, now->t_us, spans->latest_us);
  uint32_t end = back_to(ring, now->t_us, spans->gap_end_us);
  uint32_t begin = back_to(ring, now->t_us, spans->begin_us);
  /* Of frames far apart, the ones before. */
  begin = begin > latest ? begin : latest + 1;
  end = end < begin ? end : begin - 1;
  const struct motion_sums *a = &ring->sums[place_of(ring, begin)];
  const struct motion_sums *b = &ring->sums[place_of(ring, end)];
  const struct motion_sums *c = &ring->sums[place_of(ring, latest)];
  int32_t before = (int32_t)(b->count - a->count), since = (int32_t)(now->count - c->count);
  struct change change;
  change.x_um = um_from(mean_of(now->x, c->x, since), mean_of(b->x, a->x, before));
  change.y_um = um_from(mean_of(now->y, c->y, since), mean_of(b->y, a->y, before));
  change.load_x_um =
      um_from(mean_of(now->load_x, c->load_x, since), mean_of(b->load_x, a->load_x, before));
  change.load_y_um =
      um_from(mean_of(now->load_y, c->load_y, since), mean_of(b->load_y, a->load_y, before));
  change.variance_um2 = port_divide(mean_of(now->variance, c->variance, since), since) +
                        port_divide(mean_of(b->variance, a->variance, before), before);
  return change;
}

static int32_t squared_way(const struct change *change) {
  return change->x_um * change->x_um + change->y_um * change->y_um;
}

/* Squared way that is not to be believed; of a slide under way, a quarter of it. */
static int32_t squared_doubt(const struct change *change, bool already) {
  int32_t doubt = FLOOR_um * FLOOR_um + MOTION_NOISE_SDS * MOTION_NOISE_SDS * change->variance_um2;
  return already ? doubt / 4 : doubt;
}

static bool slides(const struct change *change, int32_t crosstalk_q8, bool already) {
  int32_t way2 = squared_way(change);
  int32_t load2 = change->load_x_um * change->load_x_um + change->load_y_um * change->load_y_um;
  if (way2 <= squared_doubt(change, already) + (load2 >> 8) * crosstalk_q8) {
    return false;
  }
  int32_t beyond =
      way2 - change->x_um * change->load_x_um - change->y_um * change->load_y_um; /* times way */
  int32_t least_um = already ? UNEXPLAINED_um / 2 : UNEXPLAINED_um;
  return beyond > 0 && (uint64_t)beyond * (uint32_t)beyond >
                           (uint64_t)(uint32_t)(least_um * least_um) * (uint32_t)way2;
}

static bool is_sliding(const struct motion_history *history) {
  const struct motion_sums *now = &history->now;
  if (!reaches(&history->brief, now->t_us, BRIEF.begin_us)) {
    return false;
  }
  struct change brief = change_of(&history->brief, now, &BRIEF);
  if (slides(&brief, history->crosstalk_q8, history->sliding)) {
    return true;
  }
  if (!reaches(&history->slow, now->t_us, SLOW.begin_us)) {
    return false;
  }
  struct change slow = change_of(&history->slow, now, &SLOW);
  if (!slides(&slow, history->crosstalk_q8, history->sliding) ||
      squared_way(&slow) >> STANDS_SHIFT > squared_way(&brief) + squared_doubt(&brief, false)) {
    return false;
  }
  struct change latest = change_of(&history->slow, now, &SLOW_LATEST);
  return squared_way(&latest) > squared_doubt(&latest, true) &&
         latest.x_um * slow.x_um + latest.y_um * slow.y_um > squared_way(&slow) / GOES_ON;
}

/* Within 2^-23; the compiler's own conversion brings double arithmetic into an image. */
static float float_from(int64_t value) {
  uint64_t size = value < 0 ? 0u - (uint64_t)value : (uint64_t)value;
  float magnitude = (float)(uint32_t)(size >> 32) * 4294967296.0f + (float)(uint32_t)size;
  return value < 0 ? -magnitude : magnitude;
}

/* Least squares over the frames of the span; false as long as there are too few. */
static bool find_velocity(struct motion_history *history, struct motion *motion) {
  const struct motion_ring *ring = &history->brief;
  const struct motion_sums *now = &history->now;
  if (ring->count < MOTION_VELOCITY_FRAMES || !reaches(ring, now->t_us, MOTION_VELOCITY_us)) {
    return false;
  }
  uint32_t back = back_to(ring, now->t_us, MOTION_VELOCITY_us);
  back = back > MOTION_VELOCITY_FRAMES - 1u ? back : MOTION_VELOCITY_FRAMES - 1u;
  const struct motion_sums *from = &ring->sums[place_of(ring, back)];
  const struct motion_moments *before = &history->moments_before[place_of(ring, back)];
  /* Times count from the newest frame, so that all of it is small. */
  uint64_t origin = history->newest_us >> TICK_SHIFT;
  uint32_t low = (uint32_t)origin;
  uint32_t n = now->count - from->count;
  uint32_t t_wrapped = history->moments.t - before->t;
  int32_t t = (int32_t)(t_wrapped - n * low);
  int32_t tt = (int32_t)(history->moments.tt - before->tt - 2u * low * t_wrapped + n * low * low);
  int32_t x = (int32_t)(now->x - from->x), y = (int32_t)(now->y - from->y);
  int64_t tx = (int64_t)(history->moments.tx - before->tx - origin * (uint64_t)(int64_t)x);
  int64_t ty = (int64_t)(history->moments.ty - before->ty - origin * (uint64_t)(int64_t)y);
  int64_t spread = (int64_t)n * tt - (int64_t)t * t;
  if (spread <= 0) {
    return false;
  }
  float per_spread = 1.0f / float_from(spread);
  float scale = TICKS_PER_s / SIXTEENTHS_PER_mm * per_spread;
  float vx = float_from((int64_t)n * tx - (int64_t)t * x) * scale;
  float vy = float_from((int64_t)n * ty - (int64_t)t * y) * scale;
  motion->vx_mm_s = vx;
  motion->vy_mm_s = vy;
  /* The slope's variance is that of one location times n / spread. */
  float variance_mm2 = 1e-6f * (float)(int32_t)(now->variance - from->variance);
  float noise2 = (float)(MOTION_NOISE_SDS * MOTION_NOISE_SDS) * TICKS_PER_s * TICKS_PER_s *
                 variance_mm2 * per_spread;
  float least = history->moving ? MOTION_STANDS_mm_s : MOTION_MOVING_mm_s;
  float v2 = vx * vx + vy * vy;
  history->moving = v2 > least * least && v2 > noise2;
  return true;
}

static int32_t load_from(float load_16th_um) {
  const float most = 16.0f * CHANGE_MAX_um;
  return (int32_t)(load_16th_um > most ? most : load_16th_um < -most ? -most : load_16th_um);
}

static void add(struct motion_history *history, const struct tangential_settings *settings,
                uint64_t t_us, const struct fit_tangential *found) {
  history->now.t_us = (uint32_t)t_us;
  history->moments_before[enter(&history->brief, &history->now)] = history->moments;
  if (history->slow.count == 0 ||
      age_us(&history->slow, 0, history->now.t_us) >= MOTION_SLOW_STEP_us) {
    enter(&history->slow, &history->now);
  }
  int32_t x = (int32_t)(found->x_mm * SIXTEENTHS_PER_mm);
  int32_t y = (int32_t)(found->y_mm * SIXTEENTHS_PER_mm);
  /* The normal force's scale is in both forces. */
  float per_N =
      (float)MOTION_PER_LOAD_mm * SIXTEENTHS_PER_mm * settings->tangential_scale / found->force_N;
  float sd_mm = found->location_sd_mm < 2.0f ? found->location_sd_mm : 2.0f;
  history->crosstalk_q8 = CROSSTALK_q8 + (int32_t)(CROSSTALK_PER_SD2_q8 * sd_mm * sd_mm);
  int32_t noise_um = (int32_t)(found->location_noise_mm * 1000.0f);
  uint64_t tick = t_us >> TICK_SHIFT;
  history->now.count++;
  history->now.x += (uint32_t)x;
  history->now.y += (uint32_t)y;
  history->now.load_x += (uint32_t)load_from(found->qx_N * per_N);
  history->now.load_y += (uint32_t)load_from(found->qy_N * per_N);
  history->now.variance += (uint32_t)(noise_um * noise_um);
  history->moments.t += (uint32_t)tick;
  history->moments.tt += (uint32_t)tick * (uint32_t)tick;
  history->moments.tx += tick * (uint64_t)(int64_t)x;
  history->moments.ty += tick * (uint64_t)(int64_t)y;
  history->newest_us = t_us;
}

static bool starts_anew(const struct motion_history *history, const struct contact_input *input) {
  return history->brief.count > 0 &&
         (input->fit->used != history->used || input->t_us <= history->newest_us ||
          input->t_us - history->newest_us > MOTION_PAUSE_us);
}

void motion_update(struct motion_history *history, const struct tangential_settings *settings,
                   const struct contact_input *input, struct contact_result *result,
                   struct motion *motion) {
  const struct fit_tangential *found = input->tangential;
  memset(motion, 0, sizeof *motion);
  if (!input->contact || input->zero_doubtful) {
    motion_reset(history);
    return;
  }
  if (!found || !found->valid || !(found->force_N > 0.0f) ||
      !(found->location_noise_mm <= MOTION_NOISE_MAX_mm)) {
    return;
  }
  if (starts_anew(history, input)) {
    motion_reset(history);
  }
  history->used = input->fit->used;
  add(history, settings, input->t_us, found);
  if (find_velocity(history, motion)) {
    result->flags |= CONTACT_FLAG_VELOCITY_VALID;
    result->flags |= history->moving ? (uint32_t)CONTACT_FLAG_MOVING : 0;
  }
  if (is_sliding(history)) {
    history->sliding = true;
    history->slid_us = input->t_us;
  } else if (input->t_us - history->slid_us > MOTION_SLIDING_ENDS_us) {
    history->sliding = false;
  }
  result->flags |= history->sliding ? (uint32_t)CONTACT_FLAG_SLIDING : 0;
}
