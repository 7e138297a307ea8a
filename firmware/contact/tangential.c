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
  tangential->edges = profile->edges;
}

bool tangential_is_worthwhile(const struct fit_result *fit, uint32_t saturated) {
  return (fit->flags & CONTACT_FLAG_FIT_VALID) &&
         !(fit->flags & (CONTACT_FLAG_FLAT | CONTACT_FLAG_AT_BOUND)) &&
         !contact_is_lower_bound(fit, saturated);
}

void tangential_reset(struct tangential_history *history) {
  memset(history, 0, sizeof *history);
}

/* Of a place: its squares, in the unit of pad_edges. */
struct from_middle {
  float u, v, uu, vv;
};

static float even(const float *terms, const struct from_middle *at) {
  return terms[0] + terms[1] * at->uu + terms[2] * at->vv;
}

/* pad_profile.h has the formulas. False: the load shows too little of itself. */
static bool without_edges(const struct pad_edges *edges, const struct fit_tangential *found,
                          struct fit_tangential *mended) {
  const float u = found->x_mm * (1.0f / PAD_EDGE_UNIT_mm);
  const float v = found->y_mm * (1.0f / PAD_EDGE_UNIT_mm);
  const struct from_middle at = {u, v, u * u, v * v};
  const float gain_x = 1.0f + even(edges->gain_x, &at), gain_y = 1.0f + even(edges->gain_y, &at);
  const float force = 1.0f + even(edges->force, &at);
  if (!(gain_x >= TANGENTIAL_GAIN_MIN && gain_y >= TANGENTIAL_GAIN_MIN &&
        force >= TANGENTIAL_GAIN_MIN)) {
    return false;
  }
  const float per_force = 1.0f / found->force_N;
  const float ratio_x = (found->qx_N * per_force - u * even(edges->ratio_x, &at)) / gain_x;
  const float ratio_y = (found->qy_N * per_force - v * even(edges->ratio_y, &at)) / gain_y;
  *mended = *found;
  mended->force_N = found->force_N / force;
  mended->force_sd_N = found->force_sd_N / force;
  mended->x_mm -= u * even(edges->place_x_mm, &at) + ratio_x * even(edges->pull_x_mm, &at);
  mended->y_mm -= v * even(edges->place_y_mm, &at) + ratio_y * even(edges->pull_y_mm, &at);
  mended->qx_N = ratio_x * mended->force_N;
  mended->qy_N = ratio_y * mended->force_N;
  mended->q_sd_N = found->q_sd_N / (force * (gain_x < gain_y ? gain_x : gain_y));
  return true;
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
  struct fit_tangential mended;
  const struct fit_tangential *found = &mended;
  memset(load, 0, sizeof *load);
  if (!input->contact) {
    tangential_reset(history);
  }
  if (!input->tangential || !input->tangential->valid || !(input->tangential->force_N > 0.0f) ||
      !without_edges(&settings->edges, input->tangential, &mended)) {
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
  result->flags &= ~(uint32_t)(CONTACT_FLAG_UNCERTAIN | CONTACT_FLAG_ELONGATED);
  result->flags |= found->elongated ? (uint32_t)CONTACT_FLAG_ELONGATED : 0;
  if (load->location_sd_mm > settings->location_sd_limit_mm) {
    result->flags |= CONTACT_FLAG_UNCERTAIN;
  }
}
