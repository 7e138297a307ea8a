/* What is known of the pad, as it acts on the frames: its calibration and its profile. Both the
 * commands and hosts that have frames of their own set it. */
#ifndef APP_ACTING_H
#define APP_ACTING_H

#include "app/app.h"

#if FT_WITH_FIT
/* This calibration, which is valid and outlives the app, acts from the next frame on; NULL: none. */
void app_use_calibration(struct app *app, const struct calibration *calibration);
#endif

#if FT_WITH_TANGENTIAL
/* The same of a pad's profile. */
void app_use_pad(struct app *app, const struct pad_profile *pad);
#endif

#endif
