#include "app/sync.h"

#define SAMPLE_us 1000u

static void apply(struct sync *sync) {
  const enum port_sync mode = sync->paused ? PORT_SYNC_OFF : (enum port_sync)sync->mode;
  atomic_store_explicit(&sync->shows_frames, 0, memory_order_relaxed);
  port_sync_set(mode);
  atomic_store_explicit(&sync->shows_frames, mode == PORT_SYNC_FRAME, memory_order_relaxed);
}

enum ft_status sync_set(struct sync *sync, uint8_t mode) {
  if (mode > PORT_SYNC_SECOND) {
    return FT_ERR_ARGUMENT;
  }
  sync->mode = mode;
  apply(sync);
  return FT_OK;
}

void sync_pause(struct sync *sync, bool paused) {
  sync->paused = paused;
  apply(sync);
}

static void send_edge(struct line *line, const struct port_sync_edge *edge) {
  line->packet.body.sync = (struct wire_sync){.number = edge->number, .level = edge->number & 1u};
  line_send(line, &wire_sync_layout, edge->t_us);
}

void sync_send_edges(struct sync *sync, uint64_t now_us, bool streams, struct line *line) {
  if (!sync_is_stamping(sync) || now_us - sync->sampled_us < SAMPLE_us) {
    return;
  }
  sync->sampled_us = now_us;
  struct port_sync_edge edge;
  for (unsigned i = 0; i < SYNC_EDGES_PER_ms && port_sync_take(&edge); i++) {
    if (streams) {
      send_edge(line, &edge);
    }
  }
}
