/* What the app asks of its worker: each frame's tangential load, and what presses, part by part.
 * Frames that come faster than TANGENTIAL_BESIDE_us do not wait: each takes the load of the frame
 * before, moved and scaled as the Gaussian has since. Slower ones wait for their own. Without a
 * processor of its own for it the main loop does the same work after the frame's packet, or before
 * it where that waits. The answers have the same bits. */
#ifndef APP_WORKING_H
#define APP_WORKING_H

#include "app/app.h"

#if FT_WITH_TANGENTIAL
/* Starts the worker, whatever it was at before: its jobs are free, and what they were about is
 * forgotten. */
void working_start(struct app *app);

/* After the frame's fit: asks, and sets app->shapes. */
void working_ask(struct app *app);

/* Sets app->tangential and app->tangential_is_late. Two contacts have no load in common, so they
 * have none. */
void working_wait(struct app *app);

/* Before another profile acts: nothing is at the jobs, and the contact is forgotten. */
void working_forget(struct app *app);

/* After the frame's packets. */
void working_follow(struct app *app);
#endif

#endif
