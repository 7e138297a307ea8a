/* What a tangential force that is not estimated does to the location.
 *
 * A tangential force moves the Gaussian by some 0.38 pitch for each unit of Q / F, and leaves a trace in the residual.
 * The look finds how large that trace is, beyond what noise, gains and model leave by chance. That much of a tangential
 * force is part of the location's error (NUMERICS.md, "A tangential force that is not known").
 *
 * A look is one least squares in fixed point, of the residual of a fit that is done: for every kernel, any layout, any
 * sensors missing. It is in parts, one a frame, for the time after the frame's packet. Until a contact's first look has
 * ended, and where there is none, the tangential force is FIT_DOUBT_USUAL. */
#pragma once

#include "fit/fit.h"
#include "fit/fit_fixed.h"

/* With fewer sensors the residual shows nothing. With more than 24 there is no look, unless they are a rectangle that the build knows. */
#define FIT_DOUBT_SENSORS 8
#define FIT_DOUBT_SENSORS_MAX (FIT_GRID_MOST_NODES > 24 ? FT_MAX_SENSORS : 24)

/* Q / F that is usual in a gripper. */
#define FIT_DOUBT_USUAL 0.2f

/* Parts of a look: with fifteen sensors none takes more than 6700 cycles on a Cortex-M0+, nor all
 * more than 25 000 (test emulated.fit_cycles). */
#define FIT_DOUBT_PARTS 6

#define FIT_DOUBT_UNKNOWNS 7

/* A look under way. Errors of readings are in sixteenths of the unit that the readings have. */
struct fit_doubt_search {
  int count;                             /* of its sensors */
  uint32_t size[FIT_DOUBT_UNKNOWNS + 1]; /* the highest bit: a column's largest */
  int8_t q[FIT_DOUBT_UNKNOWNS + 1];      /* value = integer 2^-q */
  int8_t up[FIT_DOUBT_UNKNOWNS];         /* of q, what the equations have more */
  int32_t base_q4;                       /* error of a reading of weight 1 */
  struct scaled base;                    /* the same, of p0 */
  int32_t dip_q18;                       /* of p0 */
  int32_t dip_per_q26;                   /* sigma^2 over the dip's sd^2 */
  int32_t right[FIT_DOUBT_UNKNOWNS];
  int32_t residual_square;
  int32_t row[FIT_DOUBT_SENSORS_MAX][FIT_DOUBT_UNKNOWNS + 1]; /* weighted; the last: the residual */
  int32_t matrix[FIT_DOUBT_UNKNOWNS][FIT_DOUBT_UNKNOWNS];     /* lower half of the normal matrix */
};

/* Of one contact, from frame to frame. All zeros are as fit_doubt_begin leaves it. */
struct fit_doubt {
  bool known;
  uint8_t part; /* of the look: which is next */
  float ratio;  /* Q / F, if known */
  struct fit_doubt_search look;
};

/* At each frame without a contact, or whose tangential force is estimated otherwise. */
void fit_doubt_begin(struct fit_doubt *doubt);

/* Adds to location_sd_mm what the tangential force does, as far as it is known, and sets UNCERTAIN if that
 * exceeds the limit. Leaves a result alone that is no fit, stopped at a limit, or is FLAT. */
void fit_doubt_widen(const struct fit_doubt *doubt, const struct fit_array *array, const struct fit_settings *settings,
                     struct fit_result *result);

/* The next part of a look. A look begins with these readings, which are those of the result; its
 * later parts do not see them. A result that fit_doubt_widen leaves alone begins none. */
void fit_doubt_follow(struct fit_doubt *doubt, const struct fit_array *array, const int32_t *pressure_Pa_q10,
                      const struct fit_settings *settings, const struct fit_result *result);
