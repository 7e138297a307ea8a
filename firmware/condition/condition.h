/* From absolute readings to pressure on the pad. Everything here works in seconds and pascals, at any rate from 0.1 Hz
 * to 1400 Hz and at any oversampling. ZERO.md has the picture, constants.h the figures.
 *
 * A frame's pressures are its readings less the zero of each sensor, but for what has faded of the remainder. From
 * them the gate decides whether anything touches. Every UPDATE_ms each sensor is updated (update.h): one pass over all
 * that is remembered of it. Its zero has two parts.
 *
 * Baseline: what the sensor reads when nothing touches.
 * - Taken: the mean of ZERO_TARE_FRAMES readings without the smallest and the largest; at rates below 16 Hz of three
 * and more.
 * - Settled: rubber and sensors warm up. A baseline that was just taken may be off by its spread, ZERO_COLD_Pa for a
 * sensor that was off or is another, ZERO_WARM_Pa for one that was steady before. While there is a spread the baseline takes over all
 * readings within it, and the gate is higher by it: a weaker touch is not seen. The spread fades by evidence, to three times what the
 * reading moves in a second. A steady one has none after two seconds, one that creeps after fifteen.
 * - Followed: then the baseline moves at 0.5 Pa/s. A force that rises faster is no drift. In a contact it does not move,
 * except for the drift of the idle time before it (drift.h), for an hour.
 * - Taken again: a reading below what a release explains means that the baseline was taken under a press. The sensor is
 * tared again after ZERO_BELOW_s, or after half a second if it is far below. Rubber that bulged beside that press may be above its zero
 * then, which seems to be a contact: where a sensor is below by more than eight times what any is above, all are tared again.
 *
 * Remainder: what rubber keeps of a press, which cannot be distinguished from a remaining force.
 * - Each sensor remembers its strongest press; the memory fades in 20 s. Three quarters of the pad's strongest
 * memory count for all. An eighth of the memory is the band, or twice the share that this sensor has kept of others: this may remain
 * above the baseline, and a quarter below. A contact closes within it.
 * - After a contact the remainder follows the reading within the band. It rises only for two seconds, and never as fast
 * as a press. Then a sudden press opens the gate above half of the band, and the baseline takes over the remainder slowly.
 * - A long contact leaves a drift too, as far as a barometer may have drifted in it.
 *
 * Hysteresis: what rubber keeps of a press shows at rest, and goes on for 1 to 4 s in the next contact.
 * - A sensor retains a share of the pressure that was released: of by how much it was pressed more than now, fading with RELEASED_ms. This
 * share, of either sign, and where the sensor rests are learnt together from what is left after contacts (ZERO.md). In a contact it is
 * taken off. What else the zero was off at the touch fades. The gate does not know of it: there it would hide a force.
 * - That share is uncertain, and so is what a hold itself changes in this sensor alone: hysteresis_sd_Pa_q10 is the sd of both. The first
 * is a part of what was released. The second rises in a hold and fades with HOLD_ms; its share is the size of what is left after contacts.
 *
 * The baseline of a sensor does not move while the gate is open, nor while the temperature of the sensor is unsettled. It
 * is taken again if it was taken in the five seconds before its sensor was reset as it had lost its state, or stepped
 * alone. No single sensor is tared in a contact that others measure. It waits for eight seconds at most, since wrong
 * zeros may make that contact. Such a zero is a guess until the contact ends. Then it is taken again.
 *
 * Doubt: a zero that has moved and a force may look alike. A zero may be off by what it took: wander is what the baseline
 * moved, taken is what baseline and remainder moved since the zero was proven. A press without doubt proves it: what the
 * zero comes back to after that press is the zero. Without evidence both fade in minutes. Doubtful is
 * - a contact in which no sensor measures more than its zero wandered, half as much again; or no more than barometers
 * drift in such a time; or while a zero is a guess. This one is unsure: the zero follows it slowly, as if nothing touched
 * - a contact whose sensors have crept up, by less than 24 Pa/s all the time, 0.005 N/s on 12 mm of rubber, and to less
 * than 3.9 kPa
 * - a contact less than three times what its zeros had taken when it left the band, or six times what they had taken of
 * it
 * - a contact below an eighth of the strongest press in it: what may remain of that one
 * - a contact beside which a sensor is farther below its zero than a quarter of the strongest press
 * - no contact, but a zero that has taken more than opens the gate, or has not settled to that */
#pragma once

#include "condition/constants.h"
#include "condition/drift.h"
#include "frame/frame.h"

#include <stdbool.h>
#include <stdint.h>

/* Whether anything touches the pad. The gate opens above GATE_OPEN_Pa + GATE_OPEN_SIGMA standard deviations of the noise, and closes below
 * GATE_CLOSE_Pa + GATE_CLOSE_SIGMA. A sensor's margin comes on top of both. The pascals are for zeros that move without a touch. */
struct gate {
  bool pressed;                      /* a contact that is no remainder */
  uint32_t pressed_ms, released_ms;  /* since it began, and since it ended; at most a day */
  int32_t open_Pa_q10, close_Pa_q10; /* without the margins */
};

/* All that is remembered of one sensor. */
struct condition_sensor {
  int32_t baseline_Pa_q10;
  int32_t rests_Pa_q10;         /* where the zero goes in a contact, once what rubber keeps has faded */
  int32_t spread_Pa_q10;        /* 0: settled */
  int32_t memory_Pa_q10;        /* strongest press, fading */
  int32_t reached_Pa_q10;       /* the same of this contact alone */
  int32_t held_Pa_q10;          /* the hold, through a low pass of 3 s */
  int32_t hysteresis_q16;       /* sd of what it changes, 1 / 2^16: the size of what is left after contacts */
  int32_t retained_q16, learnt; /* mean of the same, of either sign, of as many releases, RETAINED_LEARNT_MOST at most */
  int32_t released_Pa_q10;      /* by which it was pressed more than now; fades in 2 s */
  int32_t retained_Pa_q10;      /* released times retained_q16, which faded_Pa_q10 is less by */
  int32_t wander_Pa_q10;
  int32_t taken_Pa_q10;
  int32_t crept_Pa_q10;   /* risen slowly */
  int32_t before_Pa_q10;  /* reading of the last update */
  int32_t slow_Pa_q10;    /* readings, through a low pass of a second */
  uint32_t updated_ms;    /* time of the last update */
  uint16_t below_ms;      /* time for which readings have been too far below */
  uint8_t tare_left;      /* while taring: readings still to be averaged, */
  uint32_t tare_begun_ms; /* time of the first, */
  int32_t tare_min;       /* the smallest and the largest, */
  int32_t tare_max;
  int64_t tare_sum; /* and their sum */
  struct drift drift;
};

struct condition {
  uint32_t now_ms;
  uint32_t tared_ms; /* age of the newest tare */
  int32_t due_ms;    /* updates that are due, over all sensors */
  uint8_t next;      /* sensor to update */
  bool begins;       /* the next frame is the first of a tare of all */
  bool touched;      /* conditioned.contact of the last frame */
  bool unsure;       /* a contact that the zero follows */
  bool sure;         /* a contact without doubt */

  sensor_map taring;     /* bitmap: tare_left is not 0 */
  sensor_map guessed;    /* bitmap: tared in a contact that others measure */
  sensor_map restless;   /* bitmap: the baseline does not keep up, not idle */
  sensor_map below;      /* bitmap: too far below zero */
  sensor_map firm;       /* bitmap: stronger than what the zero has wandered */
  sensor_map sudden;     /* bitmap: stronger than what may have crept up */
  sensor_map to_learn;   /* bitmap: a contact has ended, and its hysteresis_q16 has not learnt from it */
  sensor_map zero_risen; /* bitmap: the zero has taken more than opens the gate */

  /* Of the whole pad. */
  int32_t memory_Pa_q10, reached_Pa_q10; /* as of a sensor, three quarters of the strongest */
  int32_t drifted_Pa_q10;                /* by which any zero may have drifted in a contact; fades after it */
  int32_t taken_before_Pa_q10;           /* taken when the contact came, in doubt or not */
  int32_t strong_Pa_q10;                 /* a contact above it is more than its zeros may be off by */
  int32_t strongest_Pa_q10;              /* of this contact */
  struct gate gate;
  struct snapshot_times snapshot_times;

  int32_t zero_Pa_q10[FT_MAX_SENSORS];          /* [sensor] 1/1024 Pa, as all here: baseline + remainder */
  int32_t faded_Pa_q10[FT_MAX_SENSORS];         /* of the remainder, in this contact, less what the rubber has kept of it */
  int32_t margin_Pa_q10[FT_MAX_SENSORS];        /* by which the gate is higher */
  int32_t hysteresis_sd_Pa_q10[FT_MAX_SENSORS]; /* of a reading: what a press before and this hold leave in it */
  int32_t sum_Pa_q10[FT_MAX_SENSORS];           /* of readings above the zero, since the last update */
  uint8_t summed[FT_MAX_SENSORS];               /* readings in the sum */
  struct condition_sensor sensor[FT_MAX_SENSORS];
};

/* What a calibration has of the sensors. */
struct condition_gains {
  uint32_t inverse_q16[FT_MAX_SENSORS]; /* [sensor] 1 / gain, 65536: 1; 0.25..4 */
};

struct conditioned {
  sensor_map usable;                       /* bitmap: tared, valid and not saturated */
  bool tared;                              /* every valid sensor is, there is one, and none is below what a release explains */
  bool contact;                            /* the gate */
  bool zero_doubtful;                      /* a force and a zero that has moved look alike */
  int32_t peak_Pa_q10;                     /* strongest usable reading; 0 when none */
  int32_t lowest_Pa_q10;                   /* the same of those below 0 */
  int32_t pressure_Pa_q10[FT_MAX_SENSORS]; /* [sensor] above the zero, 1/1024 Pa, times 1 / gain (of
                                              at most 524288 Pa); 0 if not usable */
};

/* Begins with sensors that were off, and asks for a tare of all. */
void condition_start(struct condition *condition);

/* After asleep_ms without a frame: begins again, except in a contact that is sure, whose zeros stay and may have drifted. */
void condition_resume(struct condition *condition, uint32_t asleep_ms);

/* Asks for a tare of all sensors over the next frames. A sensor whose zero had settled is warm. How much its rubber keeps stays known. */
void condition_tare(struct condition *condition);

/* Processes one frame, later than the one before by frame->t_us. Do not pass held frames. gains: NULL for sensors that
 * are all alike. Call condition_follow() between two frames. */
void condition_frame(struct condition *condition, const struct frame *frame, const struct condition_gains *gains,
                     struct conditioned *conditioned);

/* Updates the sensors that are due with the frame just processed. In a contact only the frames to come need it, so its
 * answer can be sent before. A second call does nothing. */
void condition_follow(struct condition *condition, const struct frame *frame, const struct conditioned *conditioned);
