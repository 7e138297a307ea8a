/* The packets about the fingertip itself: what it is, how it is, and how it last ended. */
#pragma once

#include "app/app.h"

void status_send_info(struct app *app, uint64_t now_us);
void status_send_health(struct app *app, uint64_t now_us);
void status_send_crash(struct line *line, uint64_t now_us);
