/* What the fingertip reports about the tangential force of one frame: the estimate of fit_tangential.h in the scales of
 * the pad. Where the pad's edges spoil the zero, it reports only the change since the first touch. */
#pragma once

#include "contact/contact.h"
#include "fit/fit_tangential.h"

#include <stdbool.h>
#include <stdint.h>

struct tangential_settings {
  float force_scale; /* force is this times the estimate's */
  float force_scale_sd;
  float tangential_scale; /* tangential force is this and force_scale times the estimate's */
  float tangential_scale_sd;
  bool from_touch;
  int32_t location_variance_q26;                     /* mm^2, variance that no residual shows, of sensors' places and of ends */
  int32_t edges_q20[PAD_EDGE_KINDS][PAD_EDGE_TERMS]; /* of the profile, in the order there */
  float location_sd_limit_mm;                        /* UNCERTAIN above it */
};

#define TANGENTIAL_DEFAULT_OFFSET_um 160 /* of others' arrays on boards: 0.1 to 0.23 mm each way */

/* The scales of this profile, with the calibration whose scales are in settings. off_um: how far that has sensors off their places, mean of
 * |x| + |y|, at most 4000; -1: not calibrated. */
void tangential_configure(struct tangential_settings *tangential, const struct pad_profile *profile,
                          const struct contact_settings *settings, int32_t off_um);

/* The tangential force at the beginning of a contact counts as zero: the mean of Q / F over this time after its
 * first estimate. Long enough for the mean of a hundred frames, short before any lift. */
#define TANGENTIAL_ZERO_us 100000u

/* State of the contact under way. */
struct tangential_history {
  uint64_t first_us; /* of its first estimate */
  uint32_t count;    /* of estimates in the sums; 0: none yet */
  bool settled;      /* the zero is complete */
  float x_sum, y_sum;
  float zero_x, zero_y; /* Q / F */
};

/* All zeros unless TANGENTIAL_VALID. The place is the mean of that of a contact that is pulled as estimated and of one that nothing pulls,
 * each by how likely it is: a small tangential force may be none, and chance tangential forces would move it. location_sd_mm has what lies
 * between the two. The tangential force itself is reported as estimated, however small: its mean is right, and who controls by it has
 * q_sd_N. Pictures draw one from two standard deviations on. */
struct tangential_force {
  float x_mm, y_mm, location_sd_mm;
  float force_N, force_sd_N;
  float qx_N, qy_N; /* of the object on the rubber */
  float q_sd_N;     /* of either where force_N is right: q_sd_N over force_N is that of the ratio */
  float ratio;      /* |Q| / F */
};

/* Whether an estimate from this fit is worth its time; saturated: bitmap of the sensors that were left out for it. */
bool tangential_is_worthwhile(const struct fit_result *fit, sensor_map saturated);

/* The estimate of a contact from frame to frame; of all zeros: of none. */
struct tangential_course {
  uint64_t t_us; /* of the last frame */
  struct fit_tangential_state state;
};

/* The estimate of one frame: a job of worker/worker.h. What the pointers lead to is handed over
 * with it: it is not written before the answer. The course is the worker's own. */
struct tangential_job {
  const struct fit_array *array;
  struct fit_pad pad;
  struct tangential_question {
    bool begins;          /* a course: forget the one before */
    sensor_map saturated; /* bitmap of the sensors that were left out for it */
    uint64_t t_us;
    const int32_t *pressure_Pa_q10;
    const struct fit_settings *settings;
    const struct fit_result *fit; /* of the same readings */
  } question;
  struct fit_tangential estimate; /* the answer */
  struct tangential_course course;
};

/* A frame this time after the last has time for more than one step, and the contact has moved
 * further. So it takes up to FIT_TANGENTIAL_FRAMES steps until an estimate can be reported. */
#define TANGENTIAL_SLOW_us 4500u

/* Frames nearer to each other than this leave no time to wait for an answer. The one of the frame
 * before is taken, whose tangential force has changed little since. */
#define TANGENTIAL_NO_WAIT_us 1500u

/* A Cortex-M0+ at 125 MHz answers within 330 us, and within 1.6 ms after a slow frame
 * (fit_tangential.h). What takes longer than this is not waited for. */
#define TANGENTIAL_TIMEOUT_us 450u
#define TANGENTIAL_SLOW_TIMEOUT_us 2250u

/* Answers the question of a struct tangential_job. Where the fit is not worthwhile there is no estimate, and the course starts again. */
void tangential_estimate(void *job);

/* Forgets the contact. */
void tangential_reset(struct tangential_history *history);

/* Call after contact_set_flags or contact_update, with the same input. Adds TANGENTIAL_VALID and TANGENTIAL_FROM_TOUCH to result->flags.
 * With the former, UNCERTAIN is about the corrected location, and ELONGATED about the estimate, which a tangential force does not make look
 * long. Where the pad's edges hide a tangential force such that it shows less than TANGENTIAL_GAIN_MIN of itself, there is none. */
#define TANGENTIAL_GAIN_MIN 0.25f
void tangential_update(struct tangential_history *history, const struct tangential_settings *settings, const struct contact_input *input,
                       struct contact_result *result, struct tangential_force *force);
