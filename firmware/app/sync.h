/* The sync pin: its setting, and its edges as packets. With capability sync only. */
#pragma once

#include "app/line.h"
#include "port/sync.h"
#include "scan/scan.h"

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

struct sync {
  uint8_t mode; /* enum port_sync, as it is set */
  bool paused;
  uint64_t sampled_us;           /* last time the edges were taken */
  _Atomic uint32_t shows_frames; /* for the event context */
};

/* mode: an enum port_sync. FT_ERR_ARGUMENT: there is no such mode, and the pin is as before. */
enum ft_status sync_set(struct sync *sync, uint8_t mode);

/* Paused: the pin is off whatever is set, since the processor saves power. */
void sync_pause(struct sync *sync, bool paused);

/* Each round, after the frame: sends the edges that came, if any stream is on. At most SYNC_EDGES_PER_ms, so that edges
 * that come too fast cannot delay the frames. */
#define SYNC_EDGES_PER_ms 2
void sync_send_edges(struct sync *sync, uint64_t now_us, bool streams, struct line *line);

/* The edges have to be taken each millisecond. */
static inline bool sync_is_stamping(const struct sync *sync) {
  return !sync->paused && (sync->mode == PORT_SYNC_IN || sync->mode == PORT_SYNC_SECOND);
}

/* Event context, after scan_step: the output of mode frame. */
static inline void sync_show_scan(const struct sync *sync, const struct scan *scan) {
  if (atomic_load_explicit(&sync->shows_frames, memory_order_relaxed) != 0) {
    port_sync_write(scan_is_converting_frame(scan));
  }
}
