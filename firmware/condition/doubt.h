/* Whether a force and a zero that has moved look alike.
 *
 * A sensor's zero may be off by what it took: its wander is what the level moved, fading in
 * minutes; taken is what level and remainder moved since the zero was proven. A press without doubt
 * proves it: what the zero comes back to after that press is the zero. So doubt ends by evidence,
 * and without any it fades in minutes. crept is what the reading rose as slowly as some real
 * sensors do.
 *
 * Doubtful is
 * - a contact of which no sensor feels more than its zero wandered, half as much again; or no more
 *   than barometers drift in so long a time; or while a zero is a guess. This one is unsure: the
 *   zero follows it slowly, as if nothing touched
 * - a contact whose sensors have crept up, by less than 24 Pa/s all the time, 0.005 N/s on 12 mm of
 *   rubber, and to less than 3.9 kPa
 * - a contact less than three times what its zeros had taken when it left the band, or six times
 *   what they had taken of it
 * - a contact below an eighth of the strongest press in it: what may remain of that one
 * - no contact, but a zero that has taken more than opens the gate, or has not settled to that */
#ifndef CONDITION_DOUBT_H
#define CONDITION_DOUBT_H

#include "condition/steps.h"

#include <stdbool.h>
#include <stdint.h>

/* Of one sensor. */
struct doubt {
  int32_t wander_Pa_q10;
  int32_t taken_Pa_q10;
  int32_t crept_Pa_q10;
};

/* Of all. */
struct doubt_pad {
  int32_t before_Pa_q10;    /* taken when the contact came, in doubt or not */
  int32_t strong_Pa_q10;    /* of this contact: so far above what its zeros may be off by */
  int32_t strongest_Pa_q10; /* of this contact */
  uint32_t firm;            /* bitmap: stronger than what the zero has wandered */
  uint32_t sudden;          /* bitmap: stronger than what may have crept up */
  uint32_t stands_off;      /* bitmap: taken for a zero that has risen */
  bool unsure;              /* a contact that the zero follows */
  bool sure;                /* a contact without doubt */
};

/* What a frame says. */
struct doubt_view {
  uint32_t usable;      /* bitmap */
  int32_t peak_Pa_q10;  /* of them */
  int32_t drift_Pa_q10; /* of barometers in the time of the contact */
  bool pressed, contact, saturated, guessed;
};

void doubt_forget(struct doubt *doubt, struct doubt_pad *pad, uint8_t k);

/* A zero was so far too high, and is taken again: a dip may come back. */
void doubt_return(struct doubt *doubt, int32_t below_Pa_q10);

/* The reading rises slowly, or a sure press relaxes. */
void doubt_creep(struct doubt *doubt, const struct step *step, bool pressed);

/* Compares what a sensor feels with what it may be. */
void doubt_compare(const struct doubt *doubt, struct doubt_pad *pad, uint8_t k, int32_t pressure_Pa_q10,
                   int32_t open_Pa_q10);

/* Free, the zero has moved. spread_Pa_q10: so far it may be off since its tare. */
void doubt_follow(struct doubt *doubt, struct doubt_pad *pad, uint8_t k, int32_t ms, int32_t level_moved_Pa_q10,
                  int32_t zero_moved_Pa_q10, int32_t spread_Pa_q10);

/* In a contact. */
void doubt_hold(struct doubt *doubt, struct doubt_pad *pad, int32_t ms, int32_t steady_Pa_q10);

/* A contact begins, at_once or after it was within the band; its zeros may be off by so much. */
void doubt_press(struct doubt_pad *pad, bool at_once, int32_t taken_Pa_q10);

/* Whether the zero goes on as if nothing touched. */
bool doubt_is_unsure(struct doubt_pad *pad, const struct doubt_view *view);

/* The answer, after all sensors that were due have been looked at. */
bool doubt_is_due(struct doubt_pad *pad, const struct doubt_view *view);

#endif
