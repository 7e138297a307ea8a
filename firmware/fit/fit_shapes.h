/* The shape of a contact: round, under a tangential force, long, or two contacts.
 *
 * Three models explain the readings of each frame by the pad's profile (common/pad_profile.h) and
 * by the dip that its calibration found (struct fit_settings):
 *   round  one contact, under a tangential force or not
 *   long   one contact along a straight line, the same
 *   two    two contacts with forces of their own
 * Each takes one damped Gauss-Newton step a frame, from where the frame before ended, so the cost is fixed. A contact at rest has its
 * answer after FIT_SHAPES_FRAMES frames, and then in every other one, which does not step. A model with more unknowns is chosen where it
 * makes chi^2 + FIT_SHAPES_ERRORS less by a quarter; NUMERICS.md ("Contact shape") has the models, the choice and its limits. ELONGATED is
 * longer than round by the variance of a line of 0.7 pitches, and explains twice as much as a tangential force: 97 % of limes, fingers and
 * what else is as wide as that are not. What the other models make of the place is part of location_sd_mm, by how likely they are.
 *
 * Fixed point, the same bits on every machine, for the rectangle that the build knows, some sensors missing. No
 * recording of a real pad under two contacts is public: all figures are simulated (host_tools/report/two). */
#pragma once

#include "common/pad_profile.h"
#include "fit/fit.h"
#include "fit/fit_fixed.h"

#define FIT_SHAPES_UNKNOWNS 9
#define FIT_SHAPES_NODES FIT_GRID_MAX_NODES

/* With fewer sensors there are hardly more readings than unknowns. */
#define FIT_SHAPES_SENSORS 12

/* A frame is done in this number of parts, a model each, for a processor that has other work between them. */
#define FIT_SHAPES_PARTS 3

#define FIT_SHAPES_FRAMES 23

/* The stated errors count as this number of readings. Where chi^2 is above it, the model itself may be wrong. */
#define FIT_SHAPES_ERRORS 14

enum fit_shape {
  FIT_SHAPE_UNDECIDED, /* no fit, too few sensors, or too few frames of this contact */
  FIT_SHAPE_ROUND,
  FIT_SHAPE_TANGENTIAL, /* one, under a tangential force */
  FIT_SHAPE_ELONGATED,  /* one along a line, under a tangential force or not; surely, see above */
  FIT_SHAPE_TWO,
  FIT_SHAPE_NONE, /* none of these explains the readings */
};

/* Every member is finite. What a shape does not have is zero. */
struct fit_shapes_result {
  enum fit_shape shape;
  float x_mm[2], y_mm[2], force_N[2]; /* the stronger one first; of one contact its middle */
  float location_sd_mm[2];            /* radial, as in fit_result */
  float force_sd_N[2];
  float length_mm;        /* ELONGATED: of the line that presses evenly */
  float along_x, along_y; /* ELONGATED: its direction, a unit vector, along_x >= 0 */
  float angle_sd_rad;     /* of that direction */
  float qx_N, qy_N;       /* TANGENTIAL, ELONGATED: tangential force */
  float chi_square[3];    /* of round, long and two */
};

/* The unknowns of one model, in pitches and units of the readings, Q20. */
struct fit_shapes_at {
  int32_t value[FIT_SHAPES_UNKNOWNS];
};

/* State of one contact, from frame to frame. All zeros: the next frame is its first. */
struct fit_shapes_state {
  struct fit_shapes_at at[3];
  int32_t fit_x_q20, fit_y_q20;            /* where the Gaussian was */
  int32_t sum_q20;                         /* of the readings, in the unit of amplitude */
  int32_t chi_square_q8[FIT_SHAPES_PARTS]; /* of each model in the frame under way */
  uint8_t frames;
  uint8_t part; /* of the frame under way: which is next */
};

/* Readings and dip of a frame, for all of its parts. */
struct fit_shapes_frame {
  int32_t q28[FIT_SHAPES_NODES], q14[FIT_SHAPES_NODES]; /* in grid order, the largest 0.5 to 1 */
  int32_t shift;                                        /* Q28 = 1/1024 Pa times 2^shift */
  int32_t base_q22;                                     /* error of a reading of weight 1 */
  int32_t dip_share_q16, dip_k_q24;
  bool has_deviations;
};

/* The normal equations of a step, and then the factors of their matrix. */
struct fit_shapes_equations {
  int count;      /* of the unknowns */
  int tangential; /* which is the tangential force along x, before that along y; 0: none */
  uint32_t residual_size;
  int32_t residual_square;
  int8_t q[FIT_SHAPES_UNKNOWNS + 1]; /* of the columns and the residual: value = integer 2^-q */
  int8_t half[FIT_SHAPES_UNKNOWNS];
  int32_t inverse_q14[FIT_SHAPES_UNKNOWNS], right[FIT_SHAPES_UNKNOWNS];
  int32_t matrix[FIT_SHAPES_UNKNOWNS][FIT_SHAPES_UNKNOWNS];
};

/* A profile as the models need it, and their working memory. Fill with fit_shapes_init. */
struct fit_shapes_pad {
  int32_t variance_q26[PAD_NORMAL_TERMS], strength_q26[PAD_NORMAL_TERMS];
  int32_t tangential_variance_q26[PAD_TANGENTIAL_TERMS], tangential_strength_q26[PAD_TANGENTIAL_TERMS];
  int32_t far_k_q24;
  int32_t spread_q20, per_spread_sd_q4, spread_min_q20, spread_max_q20;
  float pitch_mm, per_pitch;
  int32_t pitch_q22_mm, per_pitch_q28, origin_x_q20, origin_y_q20; /* the origin node's place */
  float force_unit_N;                                              /* normal force of amplitude 1 at 1 Pa */
  float widest_mm2;                                                /* variance of the widest normal term */
  struct {
    struct fit_shapes_frame frame;
    int32_t row[FIT_SHAPES_NODES][FIT_SHAPES_UNKNOWNS + 1];
    struct fit_shapes_equations equations[3]; /* of each model */
    int32_t column[FIT_SHAPES_UNKNOWNS + 1][FIT_SHAPES_NODES];
    int32_t weight_q12[FIT_SHAPES_NODES];
    struct fit_deviation deviations[FIT_SHAPES_NODES];
  } work;
};

/* FT_ERR_ARGUMENT: the array is not the full rectangle of this build, the profile is not valid, or it is too narrow for this pitch: the
 * variance of its narrowest normal term must be above FIT_SHAPES_VARIANCE_MIN pitches^2, as on 9 mm of rubber and more at a pitch of 9 mm.
 */
#define FIT_SHAPES_VARIANCE_MIN 0.08f
enum ft_status fit_shapes_init(struct fit_shapes_pad *pad, const struct fit_array *array, const struct pad_profile *profile);

/* Returns whether the result is of this frame. Else the one before remains: every other frame only steps, and so do the first frames of a
 * contact. fit: of the same readings, after their gains. settings: with the pad's dip, and clip_below_sds 0. */
bool fit_shapes(const struct fit_array *array, struct fit_shapes_pad *pad, const int32_t *pressure_Pa_q10,
                const struct fit_settings *settings, const struct fit_result *fit, struct fit_shapes_state *state,
                struct fit_shapes_result *result);

/* The same in parts: call it with the same pad, readings, fit and settings until the frame is done. */
enum fit_shapes_progress {
  FIT_SHAPES_UNFINISHED,
  FIT_SHAPES_STEPPED,  /* the frame is done, and the result of one before remains */
  FIT_SHAPES_ANSWERED, /* the frame is done, and the result is of it */
};
enum fit_shapes_progress fit_shapes_part(const struct fit_array *array, struct fit_shapes_pad *pad, const int32_t *pressure_Pa_q10,
                                         const struct fit_settings *settings, const struct fit_result *fit, struct fit_shapes_state *state,
                                         struct fit_shapes_result *result);
