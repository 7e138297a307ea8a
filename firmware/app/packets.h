/* The packets that the app sends of itself. */
#ifndef APP_PACKETS_H
#define APP_PACKETS_H

#include "app/app.h"

/* Each sends one packet, or drops it where the queue is full. */
void packets_send_info(struct app *app, uint64_t now_us);
void packets_send_health(struct app *app, uint64_t now_us);
void packets_send_crash(struct app *app, uint64_t now_us);
void packets_send_ack(struct app *app, const struct wire_ack *ack, uint64_t now_us);
#if FT_WITH_FIT
void packets_send_contact(struct app *app, const struct wire_stages *stages);
#endif
#if FT_WITH_RAW_STREAM
void packets_send_raw(struct app *app);
#endif
#if FT_WITH_SYNC
void packets_send_sync(struct app *app, const struct port_sync_edge *edge);
#endif

static inline uint32_t read_counter(const _Atomic uint32_t *counter) {
  return atomic_load_explicit(counter, memory_order_relaxed);
}

static inline uint16_t saturate_u16(uint64_t value) {
  return value < UINT16_MAX ? (uint16_t)value : UINT16_MAX;
}

#endif
