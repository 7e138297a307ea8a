/* The sync pin: its setting, and its edges as packets. With capability sync only. */
#ifndef APP_SYNC_H
#define APP_SYNC_H

#include "app/app.h"

#if FT_WITH_SYNC
/* An enum port_sync. False: there is no such mode, and the pin is as before. */
bool sync_set(struct app *app, uint8_t mode);

/* Paused: the pin is off whatever is set, since the processor saves power. */
void sync_pause(struct app *app, bool paused);

/* Each round, after the frame: sends the edges that came, if any stream is on. At most
 * SYNC_EDGES_PER_ms, so that edges that come too fast cannot starve the frames. */
#define SYNC_EDGES_PER_ms 2
void sync_follow(struct app *app, uint64_t now_us);

/* The edges are to be looked at each millisecond. */
static inline bool sync_is_stamping(const struct app *app) {
  return !app->sync.paused && (app->sync.mode == PORT_SYNC_IN || app->sync.mode == PORT_SYNC_SECOND);
}

/* Event context, after scan_step: the output of mode frame. */
static inline void sync_show_scan(struct app *app) {
  if (atomic_load_explicit(&app->sync.shows_frames, memory_order_relaxed) != 0) {
    port_sync_write(scan_is_converting_frame(&app->scan));
  }
}
#endif

#endif
