#include "contact/contact.h"

#include "common/contact_flags.h"

/* An uncertain location shows motion as well as any: what gains and model add to it moves with the contact. What the
 * noise adds does not, and beside a doubtful zero a falling force alone moves it. */
static bool shows_motion(const struct contact_input *input, uint32_t flags) {
  return (flags & CONTACT_FLAG_FIT_VALID) && (flags & CONTACT_FLAG_UNCERTAINTY_VALID) &&
         !(flags & (CONTACT_FLAG_FLAT | CONTACT_FLAG_AT_BOUND | CONTACT_FLAG_ZERO_DOUBTFUL)) &&
         input->fit->location_noise_mm <= CONTACT_JITTER_MAX_mm;
}

struct contact_force contact_scale_force(const struct contact_settings *settings, const struct fit_result *fit, float largest_Pa) {
  const bool is_known = !(fit->flags & CONTACT_FLAG_AT_BOUND) && fit->location_sd_mm <= fit->sigma_mm;
  const bool exceeds = !is_known && fit->p0_Pa > largest_Pa;
  const float force_N = exceeds ? fit->force_N * largest_Pa / fit->p0_Pa : fit->force_N;
  struct contact_force weighed = {settings->force_scale * force_N, 0.0f};
  if (fit->flags & CONTACT_FLAG_UNCERTAINTY_VALID) {
    const float sd_N = exceeds ? fit_quadrature(1.0f, fit->force_sd_N, 1.0f, fit->force_N - force_N) : fit->force_sd_N;
    weighed.force_sd_N = fit_quadrature(settings->force_scale, sd_N, settings->force_scale_sd, force_N);
  }
  return weighed;
}

bool contact_is_lower_bound(const struct fit_result *fit, sensor_map saturated) {
  return saturated && count_sensors(fit->used) < CONTACT_MIN_UNSATURATED;
}

void contact_set_flags(const struct contact_input *input, struct contact_result *result) {
  uint32_t flags = input->fit ? input->fit->flags : 0;
  flags |= input->contact ? (uint32_t)CONTACT_FLAG_CONTACT : 0;
  flags |= input->tared ? (uint32_t)CONTACT_FLAG_TARED : 0;
  flags |= input->calibrated ? (uint32_t)CONTACT_FLAG_CALIBRATED : 0;
  flags |= input->masked ? (uint32_t)CONTACT_FLAG_SENSOR_MASKED : 0;
  flags |= input->zero_doubtful ? (uint32_t)CONTACT_FLAG_ZERO_DOUBTFUL : 0;
  flags |= input->sensor_doubtful ? (uint32_t)CONTACT_FLAG_SENSOR_DOUBTFUL : 0;
  if (input->saturated) {
    flags |= CONTACT_FLAG_SATURATED;
    if (!input->fit || contact_is_lower_bound(input->fit, input->saturated)) {
      flags |= CONTACT_FLAG_FORCE_LOWER_BOUND;
    }
  }
  result->slip_mm = 0.0f;
  result->flags = flags;
}

/* A location that other settled sensors show may be another. One is passed over, a second begins the history again. So are those that no
 * settled sensor shows. */
static bool is_passed_over(struct slip_history *history, sensor_map used) {
  if (used == 0) {
    return true;
  }
  const bool stays = used == history->newest;
  history->newest = used;
  if (used != history->used && history->count != 0) {
    if (!stays) {
      return true;
    }
    slip_reset(history);
  }
  history->used = used;
  return false;
}

void contact_update(struct slip_history *history, const struct contact_settings *settings, const struct contact_input *input,
                    struct contact_result *result) {
  contact_set_flags(input, result);
  uint32_t flags = result->flags;
  if (!input->fit || !shows_motion(input, flags)) {
    slip_reset(history);
  } else if (!is_passed_over(history, input->fit->used & ~input->unsettled) &&
             slip_update(history, input->t_us, input->fit->x_mm, input->fit->y_mm, settings->slip_window_us, &result->slip_mm)) {
    flags |= CONTACT_FLAG_SLIP_VALID;
    if (result->slip_mm > settings->slip_threshold_mm) {
      flags |= CONTACT_FLAG_SLIP;
    }
  }
  result->flags = flags;
}
