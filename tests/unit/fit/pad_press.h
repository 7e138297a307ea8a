/* What the sensors of the boards' array read under a contact on a pad, for the tests of what estimates by its profile. */
#pragma once

#include "support/grid.h"
#include "support/pad.h"
#include "support/random.h"
#include "support/unit.h"

struct contact {
  double x_mm, y_mm, force_N, qx_N, qy_N, spread_mm2;
};

struct pad_press {
  struct pad_profile profile;
  double dip_share, dip_sd_mm; /* of the height in the middle of a contact of the profile's spread */
  struct fit_deviation deviations[GRID_SENSORS];
};

/* As common/pad_profile.h has it. A sensor that measures all wider by a factor reads what is nearer by it. */
static inline double pad_press_Pa(const struct pad_press *pad, const struct contact *contact, int sensor) {
  const struct fit_deviation *deviation = &pad->deviations[sensor];
  const double nearer = exp(-deviation->wider_q15 / 32768.0);
  const double dx = nearer * (9.0 * (sensor / 5 - 1 + deviation->off_x_q15 / 32768.0) - contact->x_mm);
  const double dy = nearer * (9.0 * (sensor % 5 - 2 + deviation->off_y_q15 / 32768.0) - contact->y_mm);
  const double r2 = dx * dx + dy * dy;
  const double usual_mm2 = (double)pad->profile.spread_mm2, square_mm2 = pad->dip_sd_mm * pad->dip_sd_mm;
  double sum = 0.0, middle = 0.0;
  for (int j = 0; j < PAD_NORMAL_TERMS; j++) {
    const double share = contact->force_N * (double)pad->profile.normal[j].share;
    const double point = pow((double)pad->profile.normal[j].sd_mm, 2), v = point + contact->spread_mm2;
    sum += share / v * exp(-r2 / (2 * v));
    middle += share / (point + usual_mm2);
  }
  for (int j = 0; j < PAD_TANGENTIAL_TERMS; j++) {
    const double v = pow((double)pad->profile.tangential[j].sd_mm, 2) + 1.3 * contact->spread_mm2;
    sum += (contact->qx_N * dx + contact->qy_N * dy) * (double)pad->profile.tangential[j].moment_mm / (v * v) * exp(-r2 / (2 * v));
  }
  if (pad->dip_share > 0.0) {
    const double v = square_mm2 + contact->spread_mm2 - usual_mm2;
    sum -= pad->dip_share * middle * square_mm2 / v * exp(-r2 / (2 * v));
  }
  return 1e6 * sum / 6.283185307179586;
}

/* Every sensor off its place and wider by at most these. */
static inline void pad_press_draw_deviations(struct pad_press *pad, int32_t off_q15, int32_t wider_q15, struct random *random) {
  for (int k = 0; k < GRID_SENSORS; k++) {
    pad->deviations[k] =
        (struct fit_deviation){(int32_t)random_between(random, -off_q15, off_q15), (int32_t)random_between(random, -off_q15, off_q15),
                               (int32_t)random_between(random, -wider_q15, wider_q15)};
  }
}
