/* The level that a sensor reads when nothing touches: taken once, settled, then followed. It is the
 * zero but for what a press has left there (after_effect.h).
 *
 * Taken. The level is the mean of ZERO_TARE_FRAMES readings without the smallest and the largest;
 * of three and more when they took a second, at rates below 16 Hz.
 *
 * Settled. Rubber and sensors warm up: after power-up some sensors rise by 0.6 kPa, most of it in
 * the first second. So a level that was just taken comes with what it may be off by, its spread:
 * ZERO_COLD_Pa for a sensor that was off or is another, ZERO_WARM_Pa for one that was calm before.
 * While there is a spread the level takes over all readings within it, and the gate is higher by
 * it. The spread fades by evidence, to three times what the reading moves in a second. A calm
 * sensor has none after two seconds, one that creeps after fifteen. A touch weaker than the spread
 * is not seen.
 *
 * Followed. Then the level moves at 0.5 Pa/s: barometers drift by up to 0.22 Pa/s, and a force that
 * rises faster is no drift. In a contact it stands, except for the drift of the calm before it,
 * which goes on for an hour.
 *
 * Taken again. A reading below what a release explains means that the level was taken under a
 * press. The sensor is tared again after ZERO_BELOW_s, or after half a second if it is far below.
 */
#ifndef CONDITION_ZERO_H
#define CONDITION_ZERO_H

#include "condition/steps.h"

#include <stdbool.h>
#include <stdint.h>

#define ZERO_TARE_FRAMES 16
#define ZERO_COLD_Pa 350
#define ZERO_WARM_Pa 60
#define ZERO_BELOW_s 10
#define ZERO_SNAPSHOTS 8

/* Of one sensor. */
struct zero {
  int32_t level_Pa_q10;
  int32_t spread_Pa_q10; /* 0: settled */
  int32_t drift_q16;     /* of the level, 1/1024 Pa in 1.024 ms */
  uint16_t drift_rest_q16;
  uint16_t below_ms; /* readings have been too far below */
  int64_t tare_sum;  /* while taring: sum of the readings, */
  int32_t tare_min;  /* the smallest and the largest */
  int32_t tare_max;  /* and the time of the first */
  uint32_t tare_begun_ms;
  uint8_t tare_left;                       /* readings still to be averaged */
  int32_t snapshot_Pa_q10[ZERO_SNAPSHOTS]; /* of the level, in a calm */
};

/* When the snapshots were taken, of all sensors at once. */
struct zero_calm {
  uint32_t snapshot_ms[ZERO_SNAPSHOTS];
  uint32_t interval_ms;
  uint8_t snapshots;
};

struct zero_snapshot {
  uint8_t slot;    /* it goes there, */
  uint8_t first;   /* after the older ones have moved up: of these the first, */
  uint8_t every;   /* and every so many after it; 0: none has to move */
  int32_t span_ms; /* from the oldest that is left */
};

/* How much more than 0.5 Pa/s a level may take over, each second. */
struct zero_pace {
  int32_t above_Pa_q10;     /* of what the reading is above the zero */
  int32_t remainder_Pa_q10; /* of what a press has left */
  bool keeps;               /* any of that */
};

void zero_begin_tare(struct zero *zero, uint32_t now_ms, int32_t spread_Pa_q10);

/* Takes a reading. Returns whether the level is known now. */
bool zero_take(struct zero *zero, uint32_t now_ms, int32_t reading_Pa_q10);

/* Whether the level is settling: then it has taken over the reading, and nothing remains of a
 * press. */
bool zero_settle(struct zero *zero, const struct step *step);

/* Moves a settled level, and takes what it takes of the remainder. Returns by how much it moved. */
int32_t zero_follow(struct zero *zero, const struct step *step, const struct zero_pace *pace,
                    int32_t *remainder_Pa_q10);

/* In a contact. Returns by how much the level moved. */
int32_t zero_drift_on(struct zero *zero, int32_t ms);

/* under_Pa_q10: so far the reading is below all that a release explains. Returns whether the level
 * is to be taken again. */
bool zero_is_below(struct zero *zero, int32_t ms, int32_t under_Pa_q10, bool *far);

/* It may have been taken under a press. gives_in: it is taken again when its sensor is looked at
 * next, if that is below. */
void zero_unsettle(struct zero *zero, bool gives_in);

/* In a calm: whether a snapshot of all levels is due, and which. */
bool zero_snapshot_due(struct zero_calm *calm, uint32_t now_ms, struct zero_snapshot *snapshot);

/* Takes it of one sensor, and sees its drift. */
void zero_take_snapshot(struct zero *zero, const struct zero_snapshot *snapshot);

#endif
