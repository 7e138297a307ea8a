/* The pad's calibration and profile, as they act on the frames. The commands set them, and so do
 * hosts that have frames of their own. */
#ifndef APP_ACTING_H
#define APP_ACTING_H

#include "app/app.h"

#if FT_WITH_FIT
/* This calibration, which is valid and outlives the app, acts from the next frame on; NULL: none. */
void app_use_calibration(struct app *app, const struct calibration *calibration);
/* Tells the fit the prior that is set, or else the calibration's, and the calibration's dip. Where
 * a profile acts, those of the calibration are left out, for the tangential estimate was judged
 * without them. */
void app_use_shape(struct app *app);
/* Doubts the calibration's force scale by how far the air is from that in which it was found. Now
 * and then; some 20 us. */
void app_use_air(struct app *app);
#endif

#if FT_WITH_TANGENTIAL
/* The same of a pad's profile. */
void app_use_pad(struct app *app, const struct pad_profile *pad);
#endif

#endif
