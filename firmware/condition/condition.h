/* From absolute readings to pressure on the pad: tare, gains, and the gate that decides whether
 * anything touches the pad. Everything here works in seconds and pascals, at any rate from 0.1 Hz
 * to 1400 Hz and at any oversampling.
 *
 * Zero. At first the zero of a sensor is the mean of its first CONDITION_TARE_FRAMES readings:
 * after start, after a tare, or after another sensor took its place. The smallest and the largest
 * are left out (of three and more when they took a second, at rates below 16 Hz). This zero is good
 * to the noise at once, and then follows the reading:
 * - For some ten seconds it may move by CONDITION_WARM_Pa, since rubber and sensors warm up. Then
 *   it moves at 0.5 Pa/s only: barometers drift by up to 0.22, and a force that rises faster is no
 *   drift.
 * - In a contact it stands, except for the drift of the calm before it. That drift goes on for an
 *   hour.
 * - It stands while the temperature of its sensor is unsettled.
 * - It is measured again if it was measured in the five seconds before its sensor was reset (the
 *   sensor had lost its state), or before the temperature turned out to be another.
 * - No single sensor is tared in a contact that others feel. It waits for eight seconds at most,
 *   since wrong zeros may make that contact. Such a zero is in doubt until the contact ends. Then
 *   it is measured again.
 *
 * Release. Rubber does not let go at once. A sensor stands off by 0.4 to 13 % of its last pressure,
 * or below its zero by 1 to 15 %. It returns within 0.5 to 20 s, and keeps some of it (strips of
 * MPL3115A2 under rubber, JiannnH/MTL-BaroTactileSensor, 2023). This cannot be distinguished from a
 * remaining force. So a contact closes when every sensor is below an eighth of the strongest press
 * that it felt lately (or a sixteenth of what any sensor felt). The zero is then level + remainder.
 * The remainder follows the reading within that band. It rises only for CONDITION_FRESH_s after the
 * release, and never as fast as a press. After that the level follows the remainder by 1/256 of the
 * memory a second. The memory fades with CONDITION_MEMORY_s. A sudden press opens the gate above a
 * sixteenth of it.
 *
 * Doubt. .zero_doubtful says that a press, or its absence, cannot be distinguished from a zero that
 * has moved:
 * - contact, but within the band above: what remains after a release
 * - no contact, but the zero has risen by more than CONDITION_OPEN_Pa: by a remainder now, or by
 *   the level within the last minutes
 * - contact, but less than four times what its zeros had taken when it left the band, or eight
 *   times what they had taken of it
 * - contact no stronger than the drift of so long a contact, or than one and a half times the
 *   recent wander of the sensor's zero. The zero follows this kind slowly, as if nothing touched
 * - contact whose sensors have crept up, by less than 24 Pa/s all the time, 0.005 N/s on 12 mm of
 *   rubber, and to less than 3.9 kPa: some real sensors drift so. The zero does not follow this
 *   kind
 *
 * Below zero. A reading below its band comes from a zero measured under a press, or it is a
 * disturbed reading. It ends .tared while it lasts. The sensor is tared again after
 * CONDITION_BELOW_s, or soon if it is far below.
 *
 * Gate. The gate opens above CONDITION_OPEN_Pa + CONDITION_OPEN_SIGMA standard deviations of the
 * noise, more by the band after a release. It closes below CONDITION_CLOSE_Pa +
 * CONDITION_CLOSE_SIGMA. The pascals are for zeros that move without a touch: the compensation
 * steps by 60 Pa at 10 degC, and a temperature half a second old costs 24 to 48 Pa in fast warming.
 *
 * The constants were chosen on four of that strip's recordings, and on pads of other seeds than the
 * truth report judges. Half or twice of any time leaves that judgement as it is. So does half of
 * any band but the eighth (one of the strips keeps 13 %). Twenty other recordings chose only the
 * limit of creep. On seventeen of them the gate reports a contact without doubt in at most 4.3 % of
 * the time in which nothing touches. Three are worse. One stands off by 15 to 30 % for minutes
 * after presses of 30 kPa and more (69 %). On two, two sensors drift by 2 kPa (10 and 19 to 42 %).
 */
#ifndef CONDITION_CONDITION_H
#define CONDITION_CONDITION_H

#include "frame/frame.h"

#include <stdbool.h>
#include <stdint.h>

#define CONDITION_TARE_FRAMES 16
#define CONDITION_OPEN_Pa 132
#define CONDITION_OPEN_SIGMA 6
#define CONDITION_CLOSE_Pa 90
#define CONDITION_CLOSE_SIGMA 4
#define CONDITION_WARM_Pa 60
#define CONDITION_FRESH_s 2
#define CONDITION_MEMORY_s 20
#define CONDITION_BELOW_s 10
#define CONDITION_SNAPSHOTS 8

struct condition {
  /* These come first, where a load's offset reaches: 240 bytes of code and some cycles less. Times
   * are in units of 1.024 ms and end at a day. */
  uint32_t now_ms;
  uint32_t pressed_ms, released_ms, tared_ms; /* since the contact began or ended, since a tare */
  int32_t due_ms;                             /* tracking that is due, over all sensors */
  int32_t open_Pa_q10;                        /* the gate, but for the margins */
  int32_t warm_Pa_q10;                        /* so far any zero may have moved, fading */
  int32_t pad_memory_Pa_q10, pad_reached_Pa_q10;
  int32_t taken_before_Pa_q10; /* into zeros, when the contact came, in doubt or not */
  int32_t strong_Pa_q10;       /* of this contact: so far above what its zeros may be off by */
  uint32_t taring;             /* bitmap: tare_left is not 0 */
  uint32_t guessed;            /* bitmap: tared in a contact that others feel */
  uint32_t restless;           /* bitmap: the level does not keep up, no calm */
  uint32_t firm;               /* bitmap: stronger than what the zero has wandered */
  uint32_t sudden;             /* bitmap: stronger than what may have crept up */
  uint32_t stands_off;         /* bitmap: taken for a zero that has risen */
  uint32_t below;              /* bitmap: too far below zero */
  uint8_t next;                /* sensor to track */
  bool pressed;                /* contact that is no remainder, */
  bool touched;                /* as .contact of the last frame */
  bool unsure;                 /* but may be a drift */

  int32_t zero_Pa_q10[FT_MAX_SENSORS]; /* [sensor] 1/1024 Pa, as all here: level + remainder */
  int32_t level_Pa_q10[FT_MAX_SENSORS];
  int32_t memory_Pa_q10[FT_MAX_SENSORS];  /* the strongest lately, fading */
  int32_t reached_Pa_q10[FT_MAX_SENSORS]; /* the same of this contact alone */
  int32_t margin_Pa_q10[FT_MAX_SENSORS];  /* by so much the gate is higher */
  int32_t risen_Pa_q10[FT_MAX_SENSORS];   /* of the level lately, fading */
  int32_t slow_Pa_q10[FT_MAX_SENSORS];    /* reading, through a low pass */
  int32_t crept_Pa_q10[FT_MAX_SENSORS];   /* what that rose slowly, fading while nothing touches */
  int32_t before_Pa_q10[FT_MAX_SENSORS];  /* reading when last tracked */
  int32_t sum_Pa_q10[FT_MAX_SENSORS];     /* above the zero, since last tracked */
  int32_t drift_q16[FT_MAX_SENSORS];      /* of the level, 1/1024 Pa in 1.024 ms */
  uint16_t drift_rest_q16[FT_MAX_SENSORS];
  uint16_t below_ms[FT_MAX_SENSORS]; /* readings have been too far below zero */
  uint8_t summed[FT_MAX_SENSORS];    /* readings in the sum */
  uint32_t tracked_ms[FT_MAX_SENSORS];

  int64_t tare_sum[FT_MAX_SENSORS]; /* while taring: sum of the readings */
  int32_t tare_min[FT_MAX_SENSORS]; /* while taring: the smallest and the largest */
  int32_t tare_max[FT_MAX_SENSORS]; /* and the time of the first */
  uint32_t tare_begun_ms[FT_MAX_SENSORS];
  uint8_t tare_left[FT_MAX_SENSORS]; /* readings still to be averaged */

  int32_t snapshot_Pa_q10[CONDITION_SNAPSHOTS][FT_MAX_SENSORS]; /* of the levels, in a calm */
  uint32_t snapshot_ms[CONDITION_SNAPSHOTS];
  uint32_t snapshot_interval_ms;
  uint8_t snapshots;
};

/* What a calibration says of the sensors. */
struct condition_gains {
  uint32_t inverse_q16[FT_MAX_SENSORS]; /* [sensor] 1 / gain, 65536: 1; 0.25..4 */
};

struct conditioned {
  uint32_t usable;     /* bitmap: tared, valid and not saturated */
  bool tared;          /* every valid sensor is, there is one, and none is far below */
  bool contact;        /* the gate */
  bool zero_doubtful;  /* a force and a zero that has moved look alike */
  int32_t peak_Pa_q10; /* strongest usable reading; 0 when none */
  int32_t pressure_Pa_q10[FT_MAX_SENSORS]; /* [sensor] above the zero, 1/1024 Pa, times 1 / gain (of
                                              at most 524288 Pa); 0 if not usable */
};

/* Asks for a tare of all sensors over the next frames. */
void condition_tare(struct condition *condition);

/* Processes one frame, later than the one before by frame->t_us. Do not pass held frames. gains:
 * NULL for sensors that are all alike. Call condition_follow() between two frames. Cost: about 85
 * Cortex-M0+ cycles a sensor in contact, 175 without. */
void condition_frame(struct condition *condition, const struct frame *frame,
                     const struct condition_gains *gains, struct conditioned *conditioned);

/* Follows zeros and remembers presses with the frame just processed. In a contact only the frames
 * to come need it, so its answer can be sent before. A second call does nothing. Cost: about 420
 * cycles a sensor, once in 64 ms. */
void condition_follow(struct condition *condition, const struct frame *frame,
                      const struct conditioned *conditioned);

#endif
