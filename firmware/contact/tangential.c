#include "contact/tangential.h"

#include "common/contact_flags.h"

#include <math.h>
#include <string.h>

void tangential_use(struct tangential_settings *tangential, const struct pad_profile *profile,
                    const struct contact_settings *settings, bool calibrated) {
  /* A calibration's scale was found with 2 pi p0 sigma^2, of which the estimate's force is no
   * part; without one the estimate is the force itself, and as uncertain. */
  const float ratio = calibrated ? profile->force_ratio : 1.0f;
  tangential->force_scale = calibrated ? settings->force_scale * ratio : 1.0f;
  tangential->force_scale_sd = settings->force_scale_sd * ratio;
  tangential->tangential_scale = profile->tangential_scale;
  tangential->tangential_scale_sd = profile->tangential_scale_sd;
  tangential->from_touch = profile->from_touch != 0;
}

bool tangential_is_worthwhile(const struct fit_result *fit, uint32_t saturated) {
  return (fit->flags & CONTACT_FLAG_FIT_VALID) &&
         !(fit->flags & (CONTACT_FLAG_FLAT | CONTACT_FLAG_AT_BOUND)) &&
         !contact_is_lower_bound(fit, saturated);
}

void tangential_reset(struct tangential_history *history) {
  memset(history, 0, sizeof *history);
}

/* Of the first touch; whether it stands. */
static bool settle_zero(struct tangential_history *history, uint64_t t_us, float x, float y) {
  if (history->count == 0) {
    history->first_us = t_us;
  }
  if (!history->settled && t_us - history->first_us >= TANGENTIAL_ZERO_us) {
    history->settled = true;
    history->zero_x = history->x_sum / (float)history->count;
    history->zero_y = history->y_sum / (float)history->count;
  } else if (!history->settled) {
    history->count++;
    history->x_sum += x;
    history->y_sum += y;
  }
  return history->settled;
}

void tangential_update(struct tangential_history *history,
                       const struct tangential_settings *settings,
                       const struct contact_input *input, struct contact_result *result,
                       struct tangential_load *load) {
  const struct fit_tangential *found = input->tangential;
  memset(load, 0, sizeof *load);
  if (!input->contact) {
    tangential_reset(history);
  }
  if (!found || !found->valid || !(found->force_N > 0.0f)) {
    return;
  }
  float qx_N = found->qx_N, qy_N = found->qy_N;
  if (settings->from_touch) {
    if (!settle_zero(history, input->t_us, qx_N / found->force_N, qy_N / found->force_N)) {
      return;
    }
    qx_N -= history->zero_x * found->force_N;
    qy_N -= history->zero_y * found->force_N;
    result->flags |= CONTACT_FLAG_TANGENTIAL_FROM_TOUCH;
  }
  const float size_N = fit_quadrature(fabsf(qx_N), 1.0f, fabsf(qy_N), 1.0f);
  const float scale = settings->force_scale * settings->tangential_scale;
  /* Both scales' share of the standard deviation, along the load, where it is the whole. */
  const float scale_sd = fit_quadrature(settings->force_scale, settings->tangential_scale_sd,
                                        settings->tangential_scale, settings->force_scale_sd);
  load->x_mm = found->x_mm;
  load->y_mm = found->y_mm;
  load->location_sd_mm = found->location_sd_mm;
  load->force_N = settings->force_scale * found->force_N;
  load->force_sd_N = fit_quadrature(settings->force_scale, found->force_sd_N,
                                    settings->force_scale_sd, found->force_N);
  load->qx_N = scale * qx_N;
  load->qy_N = scale * qy_N;
  load->q_sd_N = fit_quadrature(scale, found->q_sd_N, scale_sd, size_N);
  load->ratio = settings->tangential_scale * size_N / found->force_N;
  result->flags |= CONTACT_FLAG_TANGENTIAL_VALID;
  result->flags &= ~(uint32_t)CONTACT_FLAG_UNCERTAIN;
  if (load->location_sd_mm > settings->location_sd_limit_mm) {
    result->flags |= CONTACT_FLAG_UNCERTAIN;
  }
}
