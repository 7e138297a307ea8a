/* The commands that the host sends, and what the fingertip keeps of them. */
#ifndef APP_COMMANDS_H
#define APP_COMMANDS_H

#include "app/app.h"

/* Lets the acknowledgement out before the device leaves for the loader. */
#define LOADER_DELAY_us 50000u

/* Once, after store_init: what is stored acts. */
void commands_start(struct app *app);

/* Obeys what has arrived, at most one USB packet's worth, so that a flood of commands cannot starve
 * the frames. Returns whether anything had. Its bytes must not lie on the stack below a fit. */
bool commands_receive(struct app *app);

/* Each round: takes a write to the store a step further, and answers its command at the end. */
void commands_follow_store(struct app *app, uint64_t now_us);

/* Sets how often the main loop looks at the clock: more often while something is being stored, and
 * while edges of the sync pin are stamped. Whenever that changes. */
void commands_set_pace(struct app *app);

/* The host that sent commands is gone. */
void commands_end_session(struct app *app);

#endif
