/* Stage: the shape of the contact, where the pad's profile is known: round, long, or two contacts (contact/shapes.h).
 * Reads findings.frame, .conditioned, .fit and .tangential_force, and the settings of earlier stages. Writes
 * findings.location, may take away .tangential, and adds flags.
 *
 * The second processor fits it part by part (jobs.h), so what this stage reports is of an earlier frame. */
#pragma once

#include "app/findings.h"
#include "app/jobs.h"
#include "app/location_stage.h"
#include "common/pad_profile.h"
#include "wire/packet.h"

struct shapes_stage {
  struct shapes_job job;
  bool is_in_use;              /* the profile is one that the fit of shapes can use */
  bool begins;                 /* the next question is of another contact or pad */
  uint32_t starts;             /* of the second processor, when last asked */
  struct shapes_report report; /* of the contact under way */
};

/* array outlives the stage. */
void shapes_stage_start(struct shapes_stage *stage, const struct fit_array *array, struct jobs *jobs);

/* After the tangential question: takes what is known of the shape, and asks for more. scales: the tangential stage's. */
void shapes_stage_ask(struct shapes_stage *stage, const struct location_stage *location, const struct tangential_settings *scales,
                      struct jobs *jobs, const struct findings *found);

/* After the tangential answer: two contacts have no tangential force in common. */
void shapes_stage_judge_tangential(const struct shapes_stage *stage, struct findings *found);

/* After all others: sets the location to report, and adds flags. */
void shapes_stage_locate(const struct shapes_stage *stage, const struct location_stage *location, struct findings *found);

/* Fills in what this stage knows of a contact packet. */
void shapes_stage_fill(const struct shapes_stage *stage, const struct findings *found, struct wire_contact *packet);

/* Sets the profile, as tangential_stage_use_profile does. */
void shapes_stage_use_profile(struct shapes_stage *stage, const struct pad_profile *profile);

/* jobs_cancel was called: the contact is forgotten. */
void shapes_stage_forget(struct shapes_stage *stage);
