/* What is known of the frame under way: the scan brings the readings, and each stage (stages.h) adds what it finds. A
 * stage reads what earlier stages have written. In a held frame all but .frame and the times keeps its value of the frame before. */
#pragma once

#include "common/crash.h"
#include "condition/condition.h"
#include "contact/contact.h"
#include "contact/motion.h"
#include "contact/shapes.h"
#include "contact/tangential.h"
#include "fit/fit.h"
#include "fit/fit_tangential.h"
#include "frame/frame.h"

#include <stdint.h>

struct findings {
  /* What the main loop has been at in this frame (enum crash_activity), since when, and for how long; times modulo 2^32 */
  uint8_t activity;
  uint32_t taken_us, since_us;
  uint32_t spent_us[CRASH_AT_PACKET];
  uint64_t slept_us; /* in this frame, while the other processor worked */

  struct contact_result contact;            /* contact_stage: flags and slip; all later stages add flags */
  struct contact_input contact_input;       /* contact_stage, but for .tangential */
  struct frame frame;                       /* from the scan */
  struct conditioned conditioned;           /* condition_stage: pressures above the zero, and whether anything touches */
  struct fit_result fit;                    /* location_stage; uncertainty_stage widens its standard deviation */
  struct contact_force force;               /* location_stage: the force of the fit, scaled */
  const struct fit_tangential *tangential;  /* tangential_stage: the estimate; NULL: there is none */
  struct tangential_force tangential_force; /* tangential_stage: the estimate in the scales of the pad */
  struct motion motion;                     /* motion_update */
  struct shapes_location location;          /* shapes_stage: the location to report */
};
