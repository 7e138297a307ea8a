/* The stages of a frame: stages.c lists them in their order, and what each scene leaves out. A stage owns its state;
 * its header lists what it reads and writes. What a stage hands on is in findings.h.
 *
 *   condition_stage    pressure above the zero; whether anything touches
 *   location_stage     location, force and width, by a fit
 *   tangential_stage   tangential force, which the second processor estimates meanwhile
 *   shapes_stage       shape of the contact, the same
 *   contact_stage      flags, slip
 *   uncertainty_stage        error by a tangential force that is not estimated
 *   motion_update      velocity, slide
 *
 * Beside them the sync pin (sync.h) is a capability of some scenes. */
#pragma once

#include "app/condition_stage.h"
#include "app/contact_stage.h"
#include "app/findings.h"
#include "app/jobs.h"
#include "app/line.h"
#include "app/location_stage.h"
#include "app/shapes_stage.h"
#include "app/sync.h"
#include "app/tangential_stage.h"
#include "app/uncertainty_stage.h"
#include "condition/plausibility.h"
#include "store/store.h"

struct stages {
  struct condition_stage condition;
#if FT_WITH_FIT
  struct plausibility plausibility;
  struct location_stage location;
  struct contact_settings contact_settings; /* the force scale, and what the user has set of slip */
#endif
#if FT_WITH_TANGENTIAL
  struct motion_history motion;
#endif
#if FT_WITH_SLIP
  struct slip_history slip;
#endif
#if FT_WITH_TANGENTIAL_BIAS
  struct uncertainty_stage uncertainty;
#endif
#if FT_WITH_SYNC
  struct sync sync;
#endif
#if FT_WITH_TANGENTIAL
  struct jobs jobs; /* the second processor writes to it and to what follows only (port.h) */
  struct tangential_stage tangential;
#if FT_WITH_SHAPES
  struct shapes_stage shapes;
#endif
#endif
};

/* Sets what the scene starts with. Zero-initialise before. */
void stages_start(struct stages *stages);

/* Takes a frame from its readings to what its packets report. taken_us: when the frame was taken, modulo 2^32. */
void stages_process(struct stages *stages, struct findings *found, uint32_t taken_us);

/* Sends the packets that these streams ask for (enum wire_stream). */
void stages_send(const struct stages *stages, const struct findings *found, uint8_t streams, struct line *line);

/* Fills in what the stages know of a contact packet. A scene without the fit has none. */
void stages_fill_contact(const struct stages *stages, const struct findings *found, struct wire_contact *packet);

/* After the packets: updates what only later frames need. */
void stages_after_send(struct stages *stages, const struct findings *found, struct scan *scan);

/* Once a second. */
void stages_each_second(struct stages *stages, const struct findings *found);

/* Each round of the main loop. */
void stages_each_round(struct stages *stages, uint64_t now_us, uint8_t streams, struct line *line);

/* Event context, after scan_step. */
void stages_on_event(const struct stages *stages, const struct scan *scan);

/* The processor saves power, or no longer. */
void stages_pause(struct stages *stages, bool paused);

/* Whether stages_each_round is needed each millisecond. */
bool stages_need_fast_rounds(const struct stages *stages);

/* Calibration and profile, which are valid and outlive the stages, are in use from the next frame on; NULL: none. */
void stages_use_calibration(struct stages *stages, const struct findings *found, const struct calibration *calibration);
void stages_use_profile(struct stages *stages, const struct pad_profile *profile);

/* What is stored of the pad is in use. */
void stages_use_stored_pad(struct stages *stages, const struct findings *found, const struct store_content *content);

/* Settings that are stored, and those that are to be. What this firmware refuses stays as it is. */
void stages_use_settings(struct stages *stages, const struct store_settings *settings);
void stages_get_settings(const struct stages *stages, struct store_settings *settings);

/* The set of commands that this scene knows, and the result of one of the stages: FT_OK; FT_PENDING: it is being
 * stored; FT_ERR_ARGUMENT: out of range; FT_ERR_BUSY; FT_ERR_TYPE: no command of the stages. */
extern const struct wire_layout *const stages_commands[];
enum ft_status stages_execute(struct stages *stages, const struct wire_packet *command, struct store *store);

/* Fills in what the stages know of these packets. */
void stages_fill_info(const struct stages *stages, struct wire_info *info);
void stages_fill_health(const struct stages *stages, struct wire_health *health);
