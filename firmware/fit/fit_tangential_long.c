/* Whether a contact is long: seldom asked, so small rather than fast. */
#include "fit/fit_tangential_parts.h"

/* A contact is elongated if its elongation exceeds this share of the widest term's variance with t,
 * and ELONGATED_SURE standard deviations: only where a pad ends near, as elsewhere LONG_MOST is no more. */
#define ELONGATED_LEAST 0.07f
#define ELONGATED_SURE 2.5f
bool fit_tangential_is_elongated(const struct fit_tangential_room *room, const struct outcome *outcome, struct scaled square,
                                 struct scaled round, struct scaled variance) {
  const struct scaled least = {(int32_t)(ELONGATED_LEAST * ELONGATED_LEAST * 8388608.0f), -23};
  if (!exceeds(square, scaled_mul(least, scaled_mul(round, round)))) {
    return false;
  }
  const struct scaled sure = {(int32_t)(ELONGATED_SURE * ELONGATED_SURE * 2048.0f), -12};
  struct scaled twice = scaled_add(variance_of(room, outcome, STRETCH, 0, 0), variance_of(room, outcome, SLANT, 0, 0));
  return exceeds(square, scaled_mul(sure, scaled_mul(twice, variance)));
}
