#include "condition/doubt.h"

#include "condition/after_effect.h"
#include "condition/gate.h"

#define WANDER_ms SECONDS(120)
#define RETURN_MAX_Pa 1000

/* What a reading rises by less than 16 Pa/s, 2^4, may be a drift: some real sensors crept by 2 kPa
 * in minutes. Seen through a low pass, or the noise would be clipped too. */
#define CREEPING_SHIFT 4
#define CREPT_MAX_Pa 2500

/* A contact so many times what its zeros have taken is off by a third at most. What they took of it
 * itself counts twice, for where it then moves they are off as before. At 4 a hold of the real
 * strips is in doubt. */
#define TAKEN_FACTOR 3

void doubt_forget(struct doubt *doubt, struct doubt_pad *pad, uint8_t k) {
  doubt->wander_Pa_q10 = 0;
  doubt->taken_Pa_q10 = 0;
  doubt->crept_Pa_q10 = 0;
  set_bit(&pad->stands_off, k, false);
}

void doubt_return(struct doubt *doubt, int32_t below_Pa_q10) {
  doubt->wander_Pa_q10 = doubt->taken_Pa_q10 = larger(below_Pa_q10, -Pa_q10(RETURN_MAX_Pa));
}

void doubt_creep(struct doubt *doubt, const struct step *step, bool pressed) {
  int32_t crept = doubt->crept_Pa_q10;
  crept = pressed ? crept : faded(crept, step->ms, WANDER_ms);
  int32_t most = step->ms << CREEPING_SHIFT;
  doubt->crept_Pa_q10 = clamp(crept + clamp(step->rise_Pa_q10, -most, most), 0, Pa_q10(CREPT_MAX_Pa));
}

static int32_t and_half(int32_t value) {
  return value + (value >> 1);
}

void doubt_compare(const struct doubt *doubt, struct doubt_pad *pad, uint8_t k, int32_t pressure_Pa_q10,
                   int32_t open_Pa_q10) {
  set_bit(&pad->firm, k, pressure_Pa_q10 > open_Pa_q10 + and_half(size_of(doubt->wander_Pa_q10)));
  set_bit(&pad->sudden, k, pressure_Pa_q10 > open_Pa_q10 + and_half(doubt->crept_Pa_q10));
}

void doubt_follow(struct doubt *doubt, struct doubt_pad *pad, uint8_t k, int32_t ms, int32_t level_moved_Pa_q10,
                  int32_t zero_moved_Pa_q10, int32_t spread_Pa_q10) {
  doubt->wander_Pa_q10 = faded(doubt->wander_Pa_q10, ms, WANDER_ms) + level_moved_Pa_q10;
  doubt->taken_Pa_q10 = faded(doubt->taken_Pa_q10, ms, WANDER_ms) + zero_moved_Pa_q10;
  doubt->crept_Pa_q10 = spread_Pa_q10 > 0 ? 0 : doubt->crept_Pa_q10;
  set_bit(&pad->stands_off, k, larger(doubt->taken_Pa_q10, spread_Pa_q10) > Pa_q10(GATE_OPEN_Pa));
}

void doubt_hold(struct doubt *doubt, struct doubt_pad *pad, int32_t ms, int32_t steady_Pa_q10) {
  doubt->wander_Pa_q10 = faded(doubt->wander_Pa_q10, ms, WANDER_ms);
  doubt->taken_Pa_q10 = pad->sure ? 0 : faded(doubt->taken_Pa_q10, ms, WANDER_ms);
  pad->strongest_Pa_q10 = larger(pad->strongest_Pa_q10, steady_Pa_q10);
}

void doubt_press(struct doubt_pad *pad, bool at_once, int32_t taken_Pa_q10) {
  int32_t of_this = at_once ? 0 : taken_Pa_q10 - pad->before_Pa_q10;
  pad->strong_Pa_q10 = TAKEN_FACTOR * (taken_Pa_q10 + larger(of_this, 0));
  pad->strongest_Pa_q10 = 0;
}

bool doubt_is_unsure(struct doubt_pad *pad, const struct doubt_view *view) {
  pad->unsure = view->pressed && !view->saturated &&
                (view->guessed || (pad->firm & view->usable) == 0 || view->peak_Pa_q10 < view->drift_Pa_q10);
  return pad->unsure;
}

bool doubt_is_due(struct doubt_pad *pad, const struct doubt_view *view) {
  if (!view->pressed) {
    pad->sure = false;
    return view->contact || (pad->stands_off & view->usable) != 0;
  }
  bool stands_out = !pad->unsure && (pad->sudden & view->usable) != 0 && view->peak_Pa_q10 >= pad->strong_Pa_q10 &&
                    view->peak_Pa_q10 > pad->strongest_Pa_q10 >> AFTER_EFFECT_BAND_SHIFT;
  pad->sure = stands_out && !view->saturated;
  return !stands_out && !view->saturated;
}
