/* Whether a contact is long. It is called rarely, so it is built small rather than fast. */
#include "fit/fit_tangential_parts.h"

/* A contact is elongated if its elongation exceeds this share of the widest term's variance with t, and ELONGATED_SDS standard deviations.
 * This is used where a pad ends near; elsewhere ELONGATION_MAX is as small. */
#define ELONGATED_MIN 0.07f
#define ELONGATED_SDS 2.5f
bool fit_tangential_is_elongated(const struct fit_tangential_work *work, const struct outcome *outcome, struct scaled square,
                                 struct scaled round, struct scaled variance) {
  const struct scaled least = {(int32_t)(ELONGATED_MIN * ELONGATED_MIN * 8388608.0f), -23};
  if (!exceeds(square, scaled_mul(least, scaled_mul(round, round)))) {
    return false;
  }
  const struct scaled sure = {(int32_t)(ELONGATED_SDS * ELONGATED_SDS * 2048.0f), -12};
  struct scaled twice = scaled_add(variance_of(work, outcome, ELONGATION_1, 0, 0), variance_of(work, outcome, ELONGATION_2, 0, 0));
  return exceeds(square, scaled_mul(sure, scaled_mul(twice, variance)));
}
