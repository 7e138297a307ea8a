/* What the app asks of its worker: each frame's tangential load, which the frame waits for, and what
 * presses, part by part beside the frames that follow. Without a processor of its own for it the
 * main loop does both, the second after the frame's packet. The answers have the same bits. */
#ifndef APP_WORKING_H
#define APP_WORKING_H

#include "app/app.h"

#if FT_WITH_TANGENTIAL
/* Starts the worker, whatever it was at before: its jobs are free, and what they were about is
 * forgotten. */
void working_start(struct app *app);

/* After the frame's fit: sets app->tangential, app->tangential_is_late and app->shapes. Two
 * contacts have no load in common, so they have none. */
void working_estimate(struct app *app);

/* After the frame's packets. */
void working_follow(struct app *app);
#endif

#endif
