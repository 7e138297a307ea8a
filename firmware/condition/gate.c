#include "condition/gate.h"

static uint32_t older(uint32_t age_ms, int32_t ms) { return age_ms < AGE_MAX_ms ? age_ms + (uint32_t)ms : age_ms; }

void gate_age(struct gate *gate, int32_t ms, int32_t noise_Pa_q10) {
  gate->pressed_ms = older(gate->pressed_ms, ms);
  gate->released_ms = older(gate->released_ms, ms);
  gate->open_Pa_q10 = Pa_q10(GATE_OPEN_Pa) + GATE_OPEN_SIGMA * noise_Pa_q10;
  gate->close_Pa_q10 = Pa_q10(GATE_CLOSE_Pa) + GATE_CLOSE_SIGMA * noise_Pa_q10;
}

/* The strongest decides, except where its own margin is larger than that of others. */
static bool is_over(const struct gate_view *view, int32_t limit) {
  if (view->saturated || view->peak_Pa_q10 > limit + view->margin_Pa_q10[view->strongest]) {
    return true;
  }
  if (view->peak_Pa_q10 <= limit) {
    return false;
  }
  for (uint8_t k = 0; k < view->count; k++) {
    if (view->pressure_Pa_q10[k] > limit + view->margin_Pa_q10[k]) {
      return true;
    }
  }
  return false;
}

bool gate_update(struct gate *gate, const struct gate_view *view) {
  bool over = is_over(view, gate->pressed ? gate->close_Pa_q10 : gate->open_Pa_q10);
  if (over == gate->pressed) {
    return false;
  }
  gate->pressed = over;
  if (over) {
    gate->pressed_ms = 0;
  } else {
    gate->released_ms = 0;
  }
  return true;
}
