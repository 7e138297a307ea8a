/* Stage: location, force and width of the contact, by the fit of a Gaussian (fit/fit.h).
 * Reads findings.frame and .conditioned. Writes findings.fit and .force. Later stages read its array and settings. */
#pragma once

#include "app/findings.h"
#include "common/calibration.h"
#include "common/status.h"
#include "wire/packet.h"

struct location_stage {
  uint32_t frame_us; /* time of the last frame */
  uint32_t failures;
  float prior_sigma_mm, prior_sd_mm;     /* set by the user: width to expect of a contact; sd 0: not set */
  const struct calibration *calibration; /* in use; NULL: none */
  bool has_profile;                      /* a pad's profile is in use */
  struct fit_array array;
  struct fit_settings settings;
  struct fit_deviation deviations[FT_MAX_SENSORS]; /* sensor positions and widths of the calibration in use */
  struct fit_outlier_state outliers;               /* search for an outlier among the sensors, of the contact under way */
};

void location_stage_start(struct location_stage *stage);

/* hysteresis_sd_Pa_q10: of each sensor, as condition.h has it. */
void location_stage_process(struct location_stage *stage, const int32_t *hysteresis_sd_Pa_q10, struct findings *found);

/* Scales the force. */
void location_stage_set_force(const struct contact_settings *contact, struct findings *found);

/* Fills in what this stage knows of a contact packet. */
void location_stage_fill(const struct findings *found, struct wire_contact *packet);

/* FT_ERR_ARGUMENT: out of the range of the command. */
enum ft_status location_stage_set_prior(struct location_stage *stage, float sigma_mm, float sd_mm);
enum ft_status location_stage_set_limit(struct location_stage *stage, float limit_mm);

/* This calibration, which is valid and outlives the stage, is in use from the next frame on; NULL: none. */
void location_stage_use_calibration(struct location_stage *stage, const struct calibration *calibration);

/* Whether a pad's profile is in use. With one the prior and the dip limit of the calibration are left out: the
 * tangential estimate was judged without them, and it distinguishes a wide contact from a tangential force. */
void location_stage_use_profile(struct location_stage *stage, bool has_profile);

/* Sets the force scale of the calibration in use. Its standard deviation grows with the difference between the air
 * pressure, which the zeros show, and that of the calibration. Some 20 us, once a second. */
void location_stage_set_force_scale(const struct location_stage *stage, const struct condition *condition, bool tared,
                                    struct contact_settings *contact);
