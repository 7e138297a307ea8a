#include "condition/after_effect.h"

#define MEMORY_ms SECONDS(AFTER_EFFECT_MEMORY_s)
#define SATURATED_Pa 100000

#define DIP_SHIFT 2    /* of the memory: the remainder below zero, */
#define REOPEN_SHIFT 4 /* and what a sudden press must exceed later */
/* Share of the strongest sensor's memory that counts for all: far sensors stand off by 2 % of a
 * peak that they hardly felt. */
#define CROSS_SHIFT 1

#define FOLLOW_ms MS(700)
#define FOLLOW_DOWN_ms MS(100) /* when a force goes at last */

#define KEEP_SHIFT 8    /* share of the memory that the level takes of the remainder in a second, */
#define CREEP_SHIFT 10  /* of what the remainder does not follow, */
#define DRIFTED_SHIFT 3 /* and of what it may have drifted */

/* What drifted in a contact is taken to be up to 0.24 Pa/s of it. */
#define DRIFT_SHIFT 2
#define DRIFT_MAX_Pa 900
#define DRIFTED_ms SECONDS(8)

void after_effect_press(struct after_effect_pad *pad) {
  pad->reached_Pa_q10 = 0;
}

int32_t after_effect_drift(uint32_t pressed_ms) {
  uint32_t drift = pressed_ms >> DRIFT_SHIFT;
  return drift < Pa_q10(DRIFT_MAX_Pa) ? (int32_t)drift : Pa_q10(DRIFT_MAX_Pa);
}

void after_effect_release(struct after_effect_pad *pad, uint32_t pressed_ms) {
  pad->drifted_Pa_q10 = larger(pad->drifted_Pa_q10, after_effect_drift(pressed_ms));
}

void after_effect_fade(struct after_effect_pad *pad, int32_t ms, bool pressed) {
  pad->memory_Pa_q10 = faded(pad->memory_Pa_q10, ms, MEMORY_ms);
  pad->reached_Pa_q10 = faded(pad->reached_Pa_q10, ms, MEMORY_ms);
  if (!pressed) {
    pad->drifted_Pa_q10 = faded(pad->drifted_Pa_q10, ms, DRIFTED_ms);
  }
}

void after_effect_remember(struct after_effect *after, struct after_effect_pad *pad, int32_t ms, int32_t steady_Pa_q10,
                           bool pressed) {
  int32_t memory = faded(after->memory_Pa_q10, ms, MEMORY_ms);
  if (pressed && steady_Pa_q10 > memory) {
    memory = steady_Pa_q10 < Pa_q10(SATURATED_Pa) ? steady_Pa_q10 : Pa_q10(SATURATED_Pa);
  }
  after->memory_Pa_q10 = memory;
  pad->memory_Pa_q10 = larger(pad->memory_Pa_q10, memory);
}

int32_t after_effect_saturate(struct after_effect *after) {
  after->memory_Pa_q10 = after->reached_Pa_q10 = Pa_q10(SATURATED_Pa);
  return Pa_q10(SATURATED_Pa) >> AFTER_EFFECT_BAND_SHIFT;
}

int32_t after_effect_hold(struct after_effect *after, struct after_effect_pad *pad, int32_t ms, int32_t steady_Pa_q10) {
  int32_t steady = steady_Pa_q10 < Pa_q10(SATURATED_Pa) ? steady_Pa_q10 : Pa_q10(SATURATED_Pa);
  int32_t reached = larger(faded(after->reached_Pa_q10, ms, MEMORY_ms), steady);
  after->reached_Pa_q10 = reached;
  pad->reached_Pa_q10 = larger(pad->reached_Pa_q10, reached);
  return larger(reached, pad->reached_Pa_q10 >> CROSS_SHIFT) >> AFTER_EFFECT_BAND_SHIFT;
}

void after_effect_look(const struct after_effect *after, const struct after_effect_pad *pad, bool fresh,
                       struct after_effect_band *band) {
  int32_t memory = larger(after->memory_Pa_q10, pad->memory_Pa_q10 >> CROSS_SHIFT);
  int32_t drifted = pad->drifted_Pa_q10;
  band->fresh = fresh;
  band->lowest_Pa_q10 = -((memory >> DIP_SHIFT) + drifted);
  band->highest_Pa_q10 = (memory >> AFTER_EFFECT_BAND_SHIFT) + drifted;
  band->margin_Pa_q10 = fresh ? band->highest_Pa_q10 : (memory >> REOPEN_SHIFT) + (drifted >> 2);
  band->pace.above_Pa_q10 = (memory >> CREEP_SHIFT) + (drifted >> DRIFTED_SHIFT);
  band->pace.remainder_Pa_q10 = (fresh ? 0 : memory >> KEEP_SHIFT) + (drifted >> DRIFTED_SHIFT);
  band->pace.keeps = true;
}

int32_t after_effect_follow(const struct after_effect_band *band, const struct step *step, int32_t remainder_Pa_q10) {
  int32_t goal = clamp(step->above_Pa_q10 + remainder_Pa_q10, band->lowest_Pa_q10, band->highest_Pa_q10);
  int32_t highest = larger(remainder_Pa_q10, 0);
  if ((!band->fresh || step->moves) && goal > highest) {
    goal = highest;
  }
  bool down = goal <= remainder_Pa_q10 && remainder_Pa_q10 >= 0;
  int32_t share = share_in(step->ms, down ? FOLLOW_DOWN_ms : FOLLOW_ms);
  return remainder_Pa_q10 + part_of(goal - remainder_Pa_q10, share);
}
