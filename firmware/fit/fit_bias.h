/* Bias of the location by a tangential force that the firmware does not estimate.
 *
 * A tangential force moves the Gaussian by some 0.38 pitch for each unit of Q / F, and leaves a trace in the residual. The search measures
 * that trace, beyond what noise, gains and model leave by chance. The shift that it implies is part of location_sd_mm (NUMERICS.md, "A
 * tangential force that is not known").
 *
 * A search is one least squares in fixed point, of the residual of a finished fit: for every kernel and layout, with any sensors missing.
 * It has parts, one a frame, for the time after the frame's packet. Until a contact's first search has ended, Q / F is assumed to be
 * FIT_BIAS_ASSUMED_RATIO. */
#pragma once

#include "fit/fit.h"
#include "fit/fit_fixed.h"

/* With fewer sensors the residual shows nothing. With more than 24 there is no search, unless they are a rectangle that the build knows. */
#define FIT_BIAS_SENSORS 8
#define FIT_BIAS_SENSORS_MAX (FIT_GRID_MAX_NODES > 24 ? FT_MAX_SENSORS : 24)

/* A usual Q / F in a gripper. */
#define FIT_BIAS_ASSUMED_RATIO 0.2f

/* Parts of a search. Cost with fifteen sensors: 6700 Cortex-M0+ cycles a part, 25 000 in all (test emulated.fit_cycles). */
#define FIT_BIAS_PARTS 6

#define FIT_BIAS_UNKNOWNS 7

/* A search under way. Errors of readings are in 1/16 of the readings' unit. */
struct fit_bias_search {
  int count;                            /* of its sensors */
  uint32_t size[FIT_BIAS_UNKNOWNS + 1]; /* the highest bit: a column's largest */
  int8_t q[FIT_BIAS_UNKNOWNS + 1];      /* value = integer 2^-q */
  int8_t up[FIT_BIAS_UNKNOWNS];         /* of q, what the equations have more */
  int32_t base_q4;                      /* error of a reading of weight 1 */
  struct scaled base;                   /* the same, of p0 */
  int32_t dip_q18;                      /* of p0 */
  int32_t dip_per_q26;                  /* sigma^2 over the dip's sd^2 */
  int32_t right[FIT_BIAS_UNKNOWNS];
  int32_t residual_square;
  int32_t row[FIT_BIAS_SENSORS_MAX][FIT_BIAS_UNKNOWNS + 1]; /* weighted; the last: the residual */
  int32_t matrix[FIT_BIAS_UNKNOWNS][FIT_BIAS_UNKNOWNS];     /* lower half of the normal matrix */
};

/* State of one contact, from frame to frame. All zeros: as fit_bias_begin leaves it. */
struct fit_bias {
  bool known;
  uint8_t part; /* of the search: which is next */
  float ratio;  /* Q / F, if known */
  struct fit_bias_search search;
};

/* Call it at each frame without a contact, or whose tangential force is estimated (fit_tangential.h). */
void fit_bias_begin(struct fit_bias *bias);

/* Adds the bias to location_sd_mm, and sets UNCERTAIN above the limit. It leaves alone a result that is no fit, stopped at a limit, or is
 * FLAT. */
void fit_bias_add(const struct fit_bias *bias, const struct fit_array *array, const struct fit_settings *settings,
                  struct fit_result *result);

/* Does the next part of a search. The first part takes the readings, which are those of the result. A result that fit_bias_add leaves
 * alone begins no search. */
void fit_bias_step(struct fit_bias *bias, const struct fit_array *array, const int32_t *pressure_Pa_q10,
                   const struct fit_settings *settings, const struct fit_result *result);
