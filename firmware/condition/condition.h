/* From absolute readings to pressure on the pad: tare, and the gate that says whether anything
 * touches it at all.
 *
 * The zero of each sensor is the mean of its first CONDITION_TARE_FRAMES readings after start,
 * after a tare, or after another sensor took its place, the smallest and the largest left out. Then
 * it follows the readings slowly while nothing touches the pad (time constant
 * CONDITION_TRACK_FRAMES frames): barometers drift by some 150 Pa in a quarter of an hour, and the
 * paper sets its readings to zero between contacts (section IV.A).
 *
 * A reading more than CONDITION_OPEN_SIGMA below zero while nothing touches the pad is no drift: a
 * disturbed reading, or a zero taken under a press. It does not move the zero and ends .tared while
 * it lasts; after CONDITION_BELOW_FRAMES in a row the sensor is tared anew.
 *
 * The gate opens when the strongest reading exceeds CONDITION_OPEN_SIGMA standard deviations of the
 * sensor noise and closes below CONDITION_CLOSE_SIGMA. Below it a fit would only describe noise.
 */
#ifndef CONDITION_CONDITION_H
#define CONDITION_CONDITION_H

#include "frame/frame.h"

#include <stdbool.h>
#include <stdint.h>

#define CONDITION_TARE_FRAMES 16
#define CONDITION_TRACK_FRAMES 256
#define CONDITION_BELOW_FRAMES 32
#define CONDITION_OPEN_SIGMA 20
#define CONDITION_CLOSE_SIGMA 12

struct condition {
  int64_t zero_sum[FT_MAX_SENSORS]; /* while taring: sum of the readings, 1/1024 Pa */
  int32_t zero_min[FT_MAX_SENSORS]; /* while taring: the smallest and the largest */
  int32_t zero_max[FT_MAX_SENSORS];
  int32_t zero_Pa_q10[FT_MAX_SENSORS]; /* [sensor] the tare */
  int32_t
      zero_rest[FT_MAX_SENSORS]; /* part of the tare below 1/1024 Pa, 1/CONDITION_TRACK_FRAMES */
  uint8_t tare_left[FT_MAX_SENSORS]; /* readings still to be averaged */
  uint8_t below[FT_MAX_SENSORS];     /* readings in a row that were too far below zero */
  bool contact;
};

/* What a calibration says of the sensors. */
struct condition_gains {
  uint32_t inverse_q16[FT_MAX_SENSORS]; /* [sensor] 1 / gain, 65536: 1; 0.25..4 */
};

struct conditioned {
  uint32_t usable;     /* bitmap: tared, valid and not saturated */
  bool tared;          /* every valid sensor is, there is one, and none is far below */
  bool contact;        /* the gate */
  bool zero_doubtful;  /* a force and a zero that has moved cannot be told apart */
  int32_t peak_Pa_q10; /* strongest usable reading; 0 when none */
  int32_t pressure_Pa_q10[FT_MAX_SENSORS]; /* [sensor] above the tare, 1/1024 Pa; 0 if not usable */
};

/* Asks for a tare of all sensors over the next frames. */
void condition_tare(struct condition *condition);

/* Processes one frame. gains: NULL for sensors that are all alike. Cost: about 60 Cortex-M0+ cycles
 * a sensor. */
void condition_frame(struct condition *condition, const struct frame *frame,
                     const struct condition_gains *gains, struct conditioned *conditioned);

#endif
