/* The pad's calibration and profile, as they act on the frames. The commands set them, and so do
 * hosts that have frames of their own. */
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
