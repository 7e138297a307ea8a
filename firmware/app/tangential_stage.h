/* Stage: the tangential force of the contact, where the pad's profile is known (contact/tangential.h). Reads findings.frame, .conditioned,
 * .fit and .contact_input, and the settings of location_stage. Writes findings.tangential, .tangential_force and .slept_us, and adds flags.
 *
 * The second processor estimates it (jobs.h). Frames that come faster than TANGENTIAL_NO_WAIT_us do not wait: each takes
 * the estimate of the frame before, moved and scaled as the Gaussian has changed since. Slower ones wait for their own. */
#pragma once

#include "app/findings.h"
#include "app/jobs.h"
#include "app/location_stage.h"
#include "common/pad_profile.h"
#include "wire/packet.h"

struct tangential_stage {
  const struct pad_profile *profile; /* in use; NULL: none */
  bool is_asked;                     /* and not answered yet */
  bool same_contact;                 /* as in the question before, and the same pad */
  bool waits;                        /* this frame waits for its own answer; else it has that of the frame before */
  bool is_late;                      /* in this frame */
  uint64_t asked_us;
  uint32_t limit_us; /* longest wait after that */
  struct tangential_settings settings;
  struct tangential_history history;
  struct tangential_job job;
  struct { /* what the question is about: later frames leave it alone */
    int32_t pressure_Pa_q10[FT_MAX_SENSORS];
    struct fit_settings settings;
    struct fit_result fit;
  } question;
  struct fit_tangential estimate; /* the answer, moved to this frame */
};

/* array outlives the stage. */
void tangential_stage_start(struct tangential_stage *stage, const struct fit_array *array, struct jobs *jobs);

/* After the fit: takes the answer of the frame before if this one does not wait, and asks. */
void tangential_stage_ask(struct tangential_stage *stage, const struct location_stage *location, struct jobs *jobs, struct findings *found);

/* Waits for the answer, if this frame does. */
void tangential_stage_wait(struct tangential_stage *stage, struct jobs *jobs, struct findings *found);

/* Scales what was estimated, and adds flags. */
void tangential_stage_scale(struct tangential_stage *stage, const struct location_stage *location, struct findings *found);

/* Fills in what this stage knows of a contact packet. */
void tangential_stage_fill(const struct findings *found, struct wire_contact *packet);

/* This profile, which is valid and outlives the stage, is in use from the next frame on; NULL: none. jobs_cancel was called. */
void tangential_stage_use_profile(struct tangential_stage *stage, const struct pad_profile *profile);

/* The force scale has changed. */
void tangential_stage_use_scale(struct tangential_stage *stage, const struct location_stage *location,
                                const struct contact_settings *contact);

/* jobs_cancel was called: what was asked is forgotten. */
void tangential_stage_forget(struct tangential_stage *stage);
