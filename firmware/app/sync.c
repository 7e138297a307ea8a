#include "app/sync.h"

#include "app/packets.h"

#if FT_WITH_SYNC

#define LOOK_us 1000u

static void apply(struct app *app) {
  const enum port_sync mode = app->sync.paused ? PORT_SYNC_OFF : (enum port_sync)app->sync.mode;
  atomic_store_explicit(&app->sync.shows_frames, 0, memory_order_relaxed);
  port_sync_set(mode);
  atomic_store_explicit(&app->sync.shows_frames, mode == PORT_SYNC_FRAME, memory_order_relaxed);
}

bool sync_set(struct app *app, uint8_t mode) {
  if (mode > PORT_SYNC_SECOND) {
    return false;
  }
  app->sync.mode = mode;
  apply(app);
  return true;
}

void sync_pause(struct app *app, bool paused) {
  app->sync.paused = paused;
  apply(app);
}

void sync_follow(struct app *app, uint64_t now_us) {
  if (!sync_is_stamping(app) || now_us - app->sync.looked_us < LOOK_us) {
    return;
  }
  app->sync.looked_us = now_us;
  struct port_sync_edge edge;
  for (unsigned i = 0; i < SYNC_EDGES_PER_ms && port_sync_take(&edge); i++) {
    if (app->streams != 0) {
      packets_send_sync(app, &edge);
    }
  }
}
#endif
