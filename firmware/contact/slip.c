#include "contact/slip.h"

#include "port/divide.h"

#include <math.h>

#define SIXTEENTHS_PER_mm 16000.0f

void slip_reset(struct slip_history *history) {
  history->oldest = 0;
  history->count = 0;
  history->spans = false;
  history->x_sum = 0;
  history->y_sum = 0;
}

/* Place in the ring of what entered this many locations after the oldest. */
static uint32_t place_of(const struct slip_history *history, uint32_t age) {
  uint32_t at = history->oldest + age;
  return at < SLIP_CAPACITY ? at : at - SLIP_CAPACITY;
}

static void drop_oldest(struct slip_history *history) {
  history->x_sum -= history->x_16th_um[history->oldest];
  history->y_sum -= history->y_16th_um[history->oldest];
  history->oldest = (uint16_t)place_of(history, 1);
  history->count--;
}

static void append(struct slip_history *history, uint64_t t_us, int32_t x, int32_t y) {
  uint32_t at = place_of(history, history->count);
  history->t_us[at] = t_us;
  history->x_16th_um[at] = x;
  history->y_16th_um[at] = y;
  history->x_sum += x;
  history->y_sum += y;
  history->count++;
}

bool slip_update(struct slip_history *history, uint64_t t_us, float x_mm, float y_mm, uint32_t window_us, float *distance_mm) {
  int32_t x = (int32_t)(x_mm * SIXTEENTHS_PER_mm);
  int32_t y = (int32_t)(y_mm * SIXTEENTHS_PER_mm);
  bool full = false;
  if (history->count > 0) {
    uint64_t interval_us = t_us - history->t_us[place_of(history, history->count - 1u)];
    uint64_t reach_us = window_us + interval_us / 2;
    while (history->count > 1 && t_us - history->t_us[history->oldest] > reach_us) {
      drop_oldest(history);
    }
    /* Once filled, only a pause empties the window: a single longer interval does not. */
    history->spans = (history->spans && history->count > 1) || history->count == SLIP_CAPACITY ||
                     t_us - history->t_us[history->oldest] + interval_us > reach_us;
    full = history->spans;
  }
  if (full) {
    float dx = (float)(x - port_divide(history->x_sum, history->count));
    float dy = (float)(y - port_divide(history->y_sum, history->count));
    *distance_mm = sqrtf(dx * dx + dy * dy) * (1.0f / SIXTEENTHS_PER_mm);
  }
  if (history->count == SLIP_CAPACITY) {
    drop_oldest(history);
  }
  append(history, t_us, x, y);
  return full;
}
