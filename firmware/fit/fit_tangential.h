/* Tangential force from the normal pressures. A tangential force presses the base ahead of it and relieves it behind. This pattern is
 * broader than that of a shifted contact.
 *
 * Eight unknowns: normal force, location, the contact's own spread and its two elongations, and the tangential force
 * along x and y. Each frame takes one Gauss-Newton step: in a contact's first frame from the Gaussian fit, later from
 * where the previous frame ended, moved as the Gaussian has moved and scaled by its force. An estimate after a long
 * step is not reported. After some frames without a report the estimate starts from the Gaussian again.
 *
 * The pad's profile (common/pad_profile.h) describes how its rubber spreads normal and tangential force; the dip that a
 * calibration has found (fit_settings) is in the model too, as a term that takes. A prior holds elongation near round.
 * Readings count by their noise, gain error and model error. Fixed point, the same bits on every machine, any sensors
 * missing. NUMERICS.md has the derivation, the conditioning and the limits.
 *
 * At most 43 100 cycles a frame on a Cortex-M0+ (test emulated.fit_cycles).
 *
 * The layers are infinite and exactly known. The effect of a pad that ends is subtracted afterwards (pad_profile.h,
 * pad_edges). No measurement on a real pad confirms it yet. */
#pragma once

#include "common/pad_profile.h"
#include "fit/fit.h"
#include "fit/fit_fixed.h"

#define FIT_TANGENTIAL_UNKNOWNS 8
#define FIT_TANGENTIAL_TERMS (PAD_NORMAL_TERMS + PAD_TANGENTIAL_TERMS)
#define FIT_TANGENTIAL_NODES FIT_GRID_MAX_NODES

/* Working memory of one estimate. It holds nothing from one to the next. */
union fit_tangential_node {
  struct fit_tangential_terms { /* with the weight, for amplitude 1 */
    int32_t unused[3], normal_q28[PAD_NORMAL_TERMS], tangential_q28[PAD_TANGENTIAL_TERMS];
  } terms;
  struct fit_tangential_sums { /* over w / v^i of the normal and the tangential terms, in an order
                                  in which the columns overwrite what is no longer needed */
    int32_t s0_q14, s1_q25, s3_q8, s4_q14, s2_q22;
    int32_t f1_q12, f0_q14, f2_q22;
  } sums;
  int32_t column[FIT_TANGENTIAL_UNKNOWNS]; /* what the Jacobian has there */
};
struct fit_tangential_work {
  int32_t weight_q12[FIT_TANGENTIAL_NODES];
  union fit_tangential_node node[FIT_TANGENTIAL_NODES];
  int32_t residual[FIT_TANGENTIAL_NODES];
  int32_t matrix[FIT_TANGENTIAL_UNKNOWNS][FIT_TANGENTIAL_UNKNOWNS];
};

/* A profile as the estimate needs it, and its working memory. Fill with fit_pad_init. */
struct fit_pad {
  /* Unit of length of all below: about twice the widest normal term's sd. */
  int32_t unit_q25_mm, per_unit_q30;
  int32_t origin_x_q24_mm, origin_y_q24_mm;   /* the grid's origin node */
  int32_t variance_q26[FIT_TANGENTIAL_TERMS]; /* of each term without the contact's own */
  int32_t strength_q26[FIT_TANGENTIAL_TERMS]; /* share, or moment */
  int32_t pitch_q26, pitch_square_q26;
  int32_t spread_q26, spread_sd_q26;          /* prior of the contact's own variance */
  int32_t peak_q26;                           /* of the model's middle with it, for amplitude 1 */
  int32_t elongation_sd_q26;                  /* and of its elongations */
  struct scaled force_unit;                   /* N, normal force of amplitude 1 at 1 Pa: all of its bits */
  struct scaled per_force;                    /* amplitude of the Gaussian's 1 N at 1 Pa */
  int32_t chi_square_max, elongation_max_q15; /* no report beyond these */
  struct scaled thin;                         /* by which variances grow on a pad thinner than the pitch */
  struct fit_tangential_work work;
};

/* FT_ERR_ARGUMENT: the array is no full rectangle of the grid that this build knows, or the profile
 * is not valid (pad_profile.h), or it is no layer's: its terms are narrower, stronger or wider than
 * those of layers of PAD_THICKNESS_MIN_mm to PAD_THICKNESS_MAX_mm on this pitch. */
enum ft_status fit_pad_init(struct fit_pad *pad, const struct fit_array *array, const struct pad_profile *profile);

struct fit_tangential_unknowns {
  int32_t amplitude_q24; /* of the unit of readings */
  int32_t x_q26, y_q26;  /* from the grid's origin node */
  int32_t t_q26, e1_q26, e2_q26;
  int32_t tangential_x_q24, tangential_y_q24;
};

/* State of one contact, from frame to frame. All zeros: the next frame is its first. Set it to
 * zeros when a contact has ended, and at frames without an estimate. */
struct fit_tangential_state {
  struct fit_tangential_unknowns at; /* where the last step ended */
  int32_t fit_x_q26, fit_y_q26;      /* where the Gaussian was */
  int32_t sum_q20;                   /* of the readings, in the unit of amplitude */
  uint8_t steps;                     /* since the beginning, 2 means 2 or more */
  uint8_t unreported;                /* frames in a row without a report */
};

/* Every member is finite. Where `valid` is off all are zero. */
struct fit_tangential {
  bool valid;
  float x_mm, y_mm;
  float location_sd_mm, location_noise_mm; /* as in fit_result */
  float force_N, force_sd_N;               /* normal force */
  float qx_N, qy_N;                        /* of the object on the rubber, along x and y */
  float q_sd_N;                            /* standard deviation of either */
  int32_t shift_q20_mm[2];                 /* how far along x the place would lie elsewhere if qx / force were larger
                                              by 1, and along y of qy; what moves across is a tenth of that */
  float variance_per_tangential;           /* by what more than q_sd_N^2 the misfit has widened location_sd_mm^2 */
  bool at_corner; /* within a quarter of a pitch of two outer rows of sensors, or beyond: other shapes fit as well */
  bool elongated; /* the contact is not round, whatever the Gaussian makes of its tangential force */
};

/* A contact at rest is at its optimum after this number of frames. */
#define FIT_TANGENTIAL_FRAMES 5

/* fit: of the same readings. `valid` stays off without FIT_VALID, with fewer than FIT_TANGENTIAL_SENSORS in use, at the
 * first step and after a long one, and where a parameter ends at its limit. It also stays off where the contact is
 * clearly longer than wide, or the readings are not those of one contact on this pad (NUMERICS.md has the limits, and
 * how they widen where the pad ends near), and where q_sd_N exceeds FIT_TANGENTIAL_SD_MAX of the force. */
#define FIT_TANGENTIAL_SENSORS 8
#define FIT_TANGENTIAL_SD_MAX 0.2f
void fit_tangential_estimate(const struct fit_array *array, struct fit_pad *pad, const int32_t *pressure_Pa_q10,
                             const struct fit_settings *settings, const struct fit_result *fit, struct fit_tangential_state *state,
                             struct fit_tangential *result);
