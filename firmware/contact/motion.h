/* How the contact moves, and whether it slides. Both come from the location that is corrected for
 * the tangential force, and from that force.
 *
 * Motion alone does not show a slide. Rubber that takes over a tangential force gives way, and the contact creeps
 * along: by 1 to 5 mm for each unit of Q / F, tangential over normal force, as Mindlin's contact does ("Compliance of
 * elastic bodies in contact", J. Appl. Mech. 16, 1949). It always creeps with the tangential force, never against it.
 * If all of the contact slides, it goes on while Q / F stays or comes down, as friction falls once it has given way. So
 * the measure is how far the contact has moved beyond what the change of its tangential force explains:
 *   |d| - MOTION_PER_RATIO_mm dq . d / |d|,    d: displacement, dq: change of Q / F, both vectors
 * from an earlier span of time to the latest. Location and tangential force are means over the same frames, so
 * that no course of a tangential force makes an elastic contact slide.
 *
 * There are three pairs of spans. The brief one shows a slide of 7 mm/s or more. The brisk one shows one of 15 mm/s or
 * more sooner, and within a lift: it does not reach back to where the tangential force still rose. The slow one is for
 * a creep of 1 mm/s or more. It counts only as long as the contact still moves.
 *
 * Limits: a contact that rolls moves without a tangential force as a sliding one does. So does one carried along by an
 * object that is held elsewhere too. Friction that rises with a slide by more than 1 / MOTION_PER_RATIO_mm for each mm
 * hides it. A location that jumps because another set of sensors is in use is no motion: then the history is dropped.
 *
 * Sums are integers modulo 2^32. Their difference over a span is exact however long they have run. The cost does not
 * grow with the number of frames in a span. Main context only: it divides with port/divide.h. */
#pragma once

#include "contact/contact.h"
#include "contact/tangential.h"

#include <stdbool.h>
#include <stdint.h>

/* Shortest span of the least squares, and fewest frames: at 410 frames a second, 0.3 mm/s of noise where one location has 0.01 mm. */
#define MOTION_VELOCITY_us 30000u
#define MOTION_VELOCITY_FRAMES 3u
/* MOVING begins and ends. */
#define MOTION_MOVING_mm_s 8
#define MOTION_MOVING_ENDS_mm_s 6
/* Standard deviations that count as motion. One frame of a weak contact in a million exceeds them by noise, all of
 * which may lie along one line. The fixed limits protect other contacts better. */
#define MOTION_NOISE_SDS 5
#define MOTION_NOISE_MAX_um 400 /* of one location; noisier ones are ignored */

/* A contact that sticks moves by 2/3 of its dead travel per friction for each unit of Q / F: 1.3 mm at 1 mm and 0.5. At
 * nine tenths of what friction holds it moves twice that. In lifts and slides of the twin, seeds 201 to 213, dead
 * travel 0.2, 1 and 2 mm, values of 6, 8 and 10 gave the same. */
#define MOTION_PER_RATIO_mm 8
/* SLIDING ends after this time without a slide: a caught object rings. */
#define MOTION_SLIDING_ENDS_us 15000u

/* 64 frames span the brief pair at 1280 frames a second; with more the spans get shorter. */
#define MOTION_ENTRIES 64u
#define MOTION_SLOW_STEP_us 5000u
/* Frames nearer to the last that was judged enter, and report what it did: most of the cost is the judging's. */
#define MOTION_JUDGED_us 2000u
/* After a longer interval between two locations the history is dropped. */
#define MOTION_PAUSE_us 125000u

/* Sums over all frames before one. */
struct motion_sums {
  uint32_t t_us;             /* of that frame */
  uint32_t count;            /* of frames */
  uint32_t x, y;             /* location, mm / 2^11 */
  uint32_t ratio_x, ratio_y; /* integral of dQ / F, 1 / 2^12 */
  uint32_t variance;         /* of the location's noise, um^2 */
};

/* Integral of dQ / F along one axis: Q / F as long as F stays. A grip that tightens while the tangential force
 * grows leaves Q / F as it is, though the rubber gives way. */
struct motion_ratio {
  uint32_t ratio_q12;            /* modulo 2^32 */
  int32_t newest_q24, remainder; /* Q as last entered; what is below the integral's last bit */
};

/* The same for the least squares: time in 64 us. */
struct motion_moments {
  uint32_t t, tt, tx, ty;
};

struct motion_ring {
  uint32_t newest, count; /* newest counts on; its entry is at newest % MOTION_ENTRIES */
  struct motion_sums sums[MOTION_ENTRIES];
};

/* Zeros unless VELOCITY_VALID. */
struct motion {
  float vx_mm_s, vy_mm_s;
};

/* Zero-initialise before the first use. */
struct motion_history {
  struct motion_sums now;        /* with the newest frame in them */
  struct motion_moments moments; /* the same */
  struct motion_ratio ratio_x, ratio_y;
  uint64_t newest_us;
  uint64_t judged_us, last_slide_us; /* when last; of the last slide */
  struct motion motion;              /* as judged */
  int32_t scale_q8;                  /* of the tangential force, newest frame */
  int32_t crosstalk_q8;              /* the same: see motion.c */
  sensor_map used;                   /* bitmap: sensors in use */
  bool velocity_valid, moving, sliding;
  bool stepped;                                         /* slow has an entry that is not judged yet */
  bool slow_slides;                                     /* at the newest that is */
  struct motion_ring brief, slow;                       /* every frame; MOTION_SLOW_STEP_us apart */
  struct motion_moments moments_before[MOTION_ENTRIES]; /* beside brief.sums */
};

/* Forgets all frames. */
void motion_reset(struct motion_history *history);

/* After tangential_update, of the same input: enters the location and adds VELOCITY_VALID, MOVING and SLIDING to result->flags. */
void motion_update(struct motion_history *history, const struct tangential_settings *settings, const struct contact_input *input,
                   struct contact_result *result, struct motion *motion);
