/* What rubber keeps of a press. It does not let go at once: a sensor stands off by 0.4 to 13 % of
 * its last pressure, or below its zero by 1 to 15 %. It returns within 0.5 to 20 s, and keeps some
 * of it (strips of MPL3115A2 under rubber, JiannnH/MTL-BaroTactileSensor, 2023). That cannot be
 * distinguished from a remaining force.
 *
 * Each sensor remembers the strongest press that it felt lately; the memory fades in
 * AFTER_EFFECT_MEMORY_s. Sensors far from a press stand off by a share of what others felt, so half
 * of the pad's memory counts for all. An eighth of the memory is the band: so much may remain above
 * the level, and twice as much below. A contact closes within the band.
 *
 * After it the remainder follows the reading within the band. It rises only for
 * AFTER_EFFECT_FRESH_s, and never as fast as a press. Then a sudden press opens the gate above half
 * of the band, and the level takes over the remainder by 1/256 of the memory a second.
 *
 * A long contact leaves a drift too, as far as a barometer may have drifted in it. */
#ifndef CONDITION_AFTER_EFFECT_H
#define CONDITION_AFTER_EFFECT_H

#include "condition/steps.h"
#include "condition/zero.h"

#include <stdbool.h>
#include <stdint.h>

#define AFTER_EFFECT_FRESH_s 2
#define AFTER_EFFECT_MEMORY_s 20
#define AFTER_EFFECT_BAND_SHIFT 3 /* of the memory */

/* Of one sensor. */
struct after_effect {
  int32_t memory_Pa_q10;  /* the strongest lately, fading */
  int32_t reached_Pa_q10; /* the same of this contact alone */
};

/* Of all. */
struct after_effect_pad {
  int32_t memory_Pa_q10, reached_Pa_q10;
  int32_t drifted_Pa_q10; /* so far any zero may have in a contact, fading after it */
};

/* A contact begins, or is over after so long. */
void after_effect_press(struct after_effect_pad *pad);
void after_effect_release(struct after_effect_pad *pad, uint32_t pressed_ms);

/* So far a barometer may drift in so long a contact. */
int32_t after_effect_drift(uint32_t pressed_ms);

void after_effect_fade(struct after_effect_pad *pad, int32_t ms, bool pressed);

/* steady_Pa_q10: no disturbed reading. */
void after_effect_remember(struct after_effect *after, struct after_effect_pad *pad, int32_t ms, int32_t steady_Pa_q10,
                           bool pressed);

/* Beyond what a sensor can measure. Returns the band. */
int32_t after_effect_saturate(struct after_effect *after);

/* Of a sensor in a contact. Returns the band of this contact. */
int32_t after_effect_hold(struct after_effect *after, struct after_effect_pad *pad, int32_t ms, int32_t steady_Pa_q10);

/* After a contact: what may remain, and how the level takes it over. */
struct after_effect_band {
  int32_t lowest_Pa_q10, highest_Pa_q10;
  int32_t margin_Pa_q10; /* by so much a press has to be stronger */
  struct zero_pace pace;
  bool fresh;
};
void after_effect_look(const struct after_effect *after, const struct after_effect_pad *pad, bool fresh,
                       struct after_effect_band *band);

/* Follows the reading. Returns the new remainder. */
int32_t after_effect_follow(const struct after_effect_band *band, const struct step *step, int32_t remainder_Pa_q10);

#endif
