/* From absolute readings to pressure on the pad. Everything here works in seconds and pascals, at
 * any rate from 0.1 Hz to 1400 Hz and at any oversampling. It has four parts, each with one state
 * for each sensor; ZERO.md has the picture:
 *
 * - zero.h: what a sensor reads when nothing touches
 * - after_effect.h: what rubber keeps of a press
 * - gate.h: whether anything touches the pad
 * - doubt.h: whether a force and a zero that has moved look alike
 *
 * The zero of a sensor is the level of the first and the remainder of the second. It stands while
 * the gate is open, and while the temperature of its sensor is unsettled. It is taken again if it
 * was taken in the five seconds before its sensor was reset (the sensor had lost its state), or
 * before the temperature turned out to be another. No single sensor is tared in a contact that
 * others feel. It waits for eight seconds at most, since wrong zeros may make that contact. Such a
 * zero is in doubt until the contact ends. Then it is taken again. */
#ifndef CONDITION_CONDITION_H
#define CONDITION_CONDITION_H

#include "condition/after_effect.h"
#include "condition/doubt.h"
#include "condition/gate.h"
#include "condition/zero.h"
#include "frame/frame.h"

#include <stdbool.h>
#include <stdint.h>

/* All that is remembered of one sensor. */
struct condition_sensor {
  struct zero zero;
  struct after_effect after;
  struct doubt doubt;
  int32_t before_Pa_q10; /* reading when last looked at */
  int32_t slow_Pa_q10;   /* readings, through a low pass of a second */
  uint32_t looked_ms;
};

struct condition {
  /* These come first, where a load's offset reaches. */
  uint32_t now_ms;
  uint32_t tared_ms; /* since a tare */
  int32_t due_ms;    /* looks that are due, over all sensors */
  struct gate gate;
  struct after_effect_pad after;
  struct doubt_pad doubt;
  uint32_t taring;   /* bitmap: tare_left is not 0 */
  uint32_t guessed;  /* bitmap: tared in a contact that others feel */
  uint32_t restless; /* bitmap: the level does not keep up, no calm */
  uint32_t below;    /* bitmap: too far below zero */
  uint8_t next;      /* sensor to look at */
  bool touched;      /* as .contact of the last frame */

  int32_t zero_Pa_q10[FT_MAX_SENSORS];   /* [sensor] 1/1024 Pa, as all here: level + remainder */
  int32_t margin_Pa_q10[FT_MAX_SENSORS]; /* by so much the gate is higher */
  int32_t sum_Pa_q10[FT_MAX_SENSORS];    /* above the zero, since last looked at */
  uint8_t summed[FT_MAX_SENSORS];        /* readings in the sum */
  struct condition_sensor sensor[FT_MAX_SENSORS];
  struct zero_calm calm;
};

/* What a calibration says of the sensors. */
struct condition_gains {
  uint32_t inverse_q16[FT_MAX_SENSORS]; /* [sensor] 1 / gain, 65536: 1; 0.25..4 */
};

struct conditioned {
  uint32_t usable;                         /* bitmap: tared, valid and not saturated */
  bool tared;                              /* every valid sensor is, there is one, and none is far below */
  bool contact;                            /* the gate */
  bool zero_doubtful;                      /* a force and a zero that has moved look alike */
  int32_t peak_Pa_q10;                     /* strongest usable reading; 0 when none */
  int32_t pressure_Pa_q10[FT_MAX_SENSORS]; /* [sensor] above the zero, 1/1024 Pa, times 1 / gain (of
                                              at most 524288 Pa); 0 if not usable */
};

/* Begins with sensors that were off, and asks for a tare of all. */
void condition_start(struct condition *condition);

/* Asks for a tare of all sensors over the next frames. A sensor whose zero had settled is warm. */
void condition_tare(struct condition *condition);

/* Processes one frame, later than the one before by frame->t_us. Do not pass held frames. gains:
 * NULL for sensors that are all alike. Call condition_follow() between two frames. Cost: about 105
 * Cortex-M0+ cycles a sensor in contact, 190 without. */
void condition_frame(struct condition *condition, const struct frame *frame, const struct condition_gains *gains,
                     struct conditioned *conditioned);

/* Follows zeros and remembers presses with the frame just processed. In a contact only the frames
 * to come need it, so its answer can be sent before. A second call does nothing. Cost: about 420
 * cycles a sensor, once in 64 ms. */
void condition_follow(struct condition *condition, const struct frame *frame, const struct conditioned *conditioned);

#endif
