/* Stage: the error of the location by a tangential force that is not estimated (fit/fit_bias.h), and the gains of a
 * pad that was never calibrated (fit/fit_gains.h). Reads findings.frame, .conditioned and .tangential. Widens
 * findings.fit.location_sd_mm, adds a flag, and sets the gains' standard deviation in the settings of location_stage. */
#pragma once

#include "app/findings.h"
#include "app/location_stage.h"
#include "fit/fit_bias.h"
#include "fit/fit_gains.h"

struct uncertainty_stage {
  bool gains_are_due; /* of this contact, between two searches for a tangential force */
  uint32_t frame_us;  /* time of the last frame */
  struct fit_bias force;
  struct fit_gains gains; /* learnt while no calibration is in use */
};

void uncertainty_stage_process(const struct uncertainty_stage *stage, const struct location_stage *location, struct findings *found);

/* After the frame's packets, for the frames that follow: some parts of the search. */
void uncertainty_stage_after_send(struct uncertainty_stage *stage, struct location_stage *location, const struct findings *found);

/* Another calibration is in use, or none: the gains are forgotten. */
void uncertainty_stage_forget_gains(struct uncertainty_stage *stage);
