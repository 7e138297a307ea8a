#include "contact/tangential.h"

#include "common/bytes.h"
#include "common/contact_flags.h"
#include "fit/fit_fixed.h"
#include "fit/fit_math.h"

#include <math.h>
#include <string.h>

/* No residual shows what moves all sensors that a contact presses, some four: their places, and the ends of a pad (report truth, over
 * time). */
#define PLACES_Q26 13          /* (0.44 um)^2 in mm^2: half of the root of the mean square */
#define ENDS_SQUARE_Q26 328833 /* 0.07 mm */

void tangential_configure(struct tangential_settings *tangential, const struct pad_profile *profile,
                          const struct contact_settings *settings, int32_t off_um) {
  /* A calibration's scale was found with 2 pi p0 sigma^2, of which the estimate's force is no
   * part; without one the estimate is the force itself, and as uncertain. */
  const bool calibrated = off_um >= 0;
  const float ratio = calibrated ? profile->force_ratio : 1.0f;
  tangential->force_scale = calibrated ? settings->force_scale * ratio : 1.0f;
  tangential->force_scale_sd = settings->force_scale_sd * ratio;
  tangential->tangential_scale = profile->tangential_scale;
  tangential->tangential_scale_sd = profile->tangential_scale_sd;
  tangential->from_touch = profile->from_touch != 0;
  off_um = calibrated ? off_um : TANGENTIAL_DEFAULT_OFFSET_um;
  tangential->location_variance_q26 = off_um * off_um * PLACES_Q26 + (bytes_from_f32(profile->overhang_mm) != 0 ? ENDS_SQUARE_Q26 : 0);
  float edges[PAD_EDGE_KINDS][PAD_EDGE_TERMS];
  memcpy(edges, &profile->edges, sizeof edges);
  for (int kind = 0; kind < PAD_EDGE_KINDS; kind++) {
    for (int term = 0; term < PAD_EDGE_TERMS; term++) {
      tangential->edges_q20[kind][term] = fit_fixed(edges[kind][term], 20);
    }
  }
}

bool tangential_is_worthwhile(const struct fit_result *fit, sensor_map saturated) {
  return (fit->flags & CONTACT_FLAG_FIT_VALID) && !(fit->flags & (CONTACT_FLAG_FLAT | CONTACT_FLAG_AT_BOUND)) &&
         !contact_is_lower_bound(fit, saturated);
}

void tangential_estimate(void *job) {
  struct tangential_job *own = job;
  const struct tangential_question *question = &own->question;
  struct tangential_course *course = &own->course;
  const bool is_worthwhile = tangential_is_worthwhile(question->fit, question->saturated);
  if (question->begins || !is_worthwhile) {
    memset(course, 0, sizeof *course);
  }
  if (!is_worthwhile) {
    memset(&own->estimate, 0, sizeof own->estimate);
    return;
  }
  bool slow = course->t_us != 0 && question->t_us - course->t_us >= TANGENTIAL_SLOW_us;
  int steps = slow ? FIT_TANGENTIAL_FRAMES : 1;
  course->t_us = question->t_us;
  do {
    fit_tangential_estimate(own->array, &own->pad, question->pressure_Pa_q10, question->settings, question->fit, &course->state,
                            &own->estimate);
  } while (!own->estimate.valid && --steps > 0);
}

void tangential_reset(struct tangential_history *history) { memset(history, 0, sizeof *history); }

/* In the order of struct pad_edges. */
enum edge { RATIO_X, RATIO_Y, GAIN_X, GAIN_Y, PLACE_X_mm, PLACE_Y_mm, PULL_X_mm, PULL_Y_mm, FORCE };
_Static_assert(FORCE + 1 == PAD_EDGE_KINDS, "all of them");

/* Soft float would take a tenth of a frame at OSR 256 for what follows. */
#define UNITS_PER_mm_Q32 429496730 /* of pad_edges */
#define RATIO_MAX_Q26 ((4 << 26) - 1)
#define FACTOR_MAX_Q20 ((16 << 20) - 1)
#define FORCE_MIN_N_Q24 (1 << 14) /* 1 mN */

/* A place in the unit of pad_edges, and its squares. */
struct from_middle {
  int32_t u_q26, v_q26, uu_q26, vv_q26;
};

static int32_t even(const struct tangential_settings *settings, enum edge edge, const struct from_middle *at) {
  const int32_t *terms = settings->edges_q20[edge];
  return terms[0] + fixed_mul_q26(terms[1], at->uu_q26) + fixed_mul_q26(terms[2], at->vv_q26);
}

/* 1 + even. The result shows a tangential force that hides too much of itself. */
static int32_t factor(const struct tangential_settings *settings, enum edge edge, const struct from_middle *at) {
  return fixed_clamp((1 << 20) + even(settings, edge, at), 0, FACTOR_MAX_Q20);
}

static float inverse(int32_t factor_q20) { return fit_float(fixed_div_q26(1 << 26, factor_q20 * 64), -26); }

/* A value over a force, at most 4 of it. */
static int32_t per_force_q26(float value_N, int32_t force_N_q24) {
  int32_t up = 28 - fixed_bits((uint32_t)force_N_q24);
  int32_t force = shifted(force_N_q24, up); /* of many bits for the division */
  return fixed_div_q26(fixed_clamp(shifted(fit_fixed(value_N, 24), up), -4 * force, 4 * force), force);
}

/* Q / F along one axis without what the pad's ends add, all of which is odd. */
static int32_t ratio_q26(float tangential_N, int32_t force_N_q24, int32_t added_q20, int32_t gain_q20) {
  int32_t found_q26 = per_force_q26(tangential_N, force_N_q24);
  int32_t own_q26 = found_q26 - fixed_clamp(added_q20, -FACTOR_MAX_Q20 / 4, FACTOR_MAX_Q20 / 4) * 64;
  return fixed_div_q26(fixed_clamp(own_q26, -RATIO_MAX_Q26, RATIO_MAX_Q26), gain_q20 * 64);
}

/* pad_profile.h has the formulas. False: the tangential force shows too little of itself, or there is hardly a force. */
static bool without_edges(const struct tangential_settings *settings, const struct fit_tangential *found, struct fit_tangential *mended) {
  const int32_t least_q20 = (int32_t)(TANGENTIAL_GAIN_MIN * 1048576.0f);
  const int32_t x_q20 = fit_fixed(found->x_mm, 20), y_q20 = fit_fixed(found->y_mm, 20);
  struct from_middle at = {fixed_mul_q30(x_q20 * 16, UNITS_PER_mm_Q32), fixed_mul_q30(y_q20 * 16, UNITS_PER_mm_Q32), 0, 0};
  at.uu_q26 = fixed_mul_q26(at.u_q26, at.u_q26);
  at.vv_q26 = fixed_mul_q26(at.v_q26, at.v_q26);
  const int32_t gain_x = factor(settings, GAIN_X, &at), gain_y = factor(settings, GAIN_Y, &at);
  const int32_t force = factor(settings, FORCE, &at);
  const int32_t force_N_q24 = fit_fixed(found->force_N, 24);
  if (gain_x < least_q20 || gain_y < least_q20 || force < least_q20 || force_N_q24 < FORCE_MIN_N_Q24) {
    return false;
  }
  const int32_t ratio_x = ratio_q26(found->qx_N, force_N_q24, fixed_mul_q26(at.u_q26, even(settings, RATIO_X, &at)), gain_x);
  const int32_t ratio_y = ratio_q26(found->qy_N, force_N_q24, fixed_mul_q26(at.v_q26, even(settings, RATIO_Y, &at)), gain_y);
  const int32_t dx_q20 = fixed_mul_q26(at.u_q26, even(settings, PLACE_X_mm, &at)) + fixed_mul_q26(ratio_x, even(settings, PULL_X_mm, &at));
  const int32_t dy_q20 = fixed_mul_q26(at.v_q26, even(settings, PLACE_Y_mm, &at)) + fixed_mul_q26(ratio_y, even(settings, PULL_Y_mm, &at));
  const float per_force = inverse(force);
  *mended = *found;
  mended->x_mm = fit_float(x_q20 - dx_q20, -20);
  mended->y_mm = fit_float(y_q20 - dy_q20, -20);
  mended->force_N = found->force_N * per_force;
  mended->force_sd_N = found->force_sd_N * per_force;
  mended->qx_N = fit_float(ratio_x, -26) * mended->force_N;
  mended->qy_N = fit_float(ratio_y, -26) * mended->force_N;
  mended->q_sd_N = found->q_sd_N * per_force * inverse(gain_x < gain_y ? gain_x : gain_y);
  return true;
}

#define NOINLINE __attribute__((noinline)) /* saves flash; cycles hardly count here */

/* Packed, so that arguments and result go in registers. */
NOINLINE static uint64_t packed_sum(uint64_t a, uint64_t b) {
  return scaled_pack(scaled_short(scaled_add(scaled_unpack(a), scaled_unpack(b))));
}
NOINLINE static uint64_t packed_quotient(uint64_t a, uint64_t b) {
  return scaled_pack(scaled_div(scaled_short(scaled_unpack(a)), scaled_short(scaled_unpack(b))));
}
FIXED_INLINE struct scaled sum_of(struct scaled a, struct scaled b) { return scaled_unpack(packed_sum(scaled_pack(a), scaled_pack(b))); }
FIXED_INLINE struct scaled quotient_of(struct scaled a, struct scaled b) {
  return scaled_unpack(packed_quotient(scaled_pack(a), scaled_pack(b)));
}

/* (a^2 + b^2) / 2^(2 q) */
NOINLINE static struct scaled squares_of(int32_t a, int32_t b, int32_t q) {
  const struct scaled x = scaled_from(a, -q), y = scaled_from(b, -q);
  return sum_of(scaled_mul(x, x), scaled_mul(y, y));
}

/* Whether anything pulls, Q14: 2^14 surely. A contact is as likely pulled as not, and what pulls has the standard
 * deviation USUAL along each axis. The estimate's own variance is itself an estimate, of fifteen readings less eight
 * unknowns: so its errors are Student's t of 6 degrees of freedom, in the plane. */
#define USUAL_SQUARE_Q26 671089 /* 0.1^2 */
#define SURE_SDS 16
#define RATIO_SD_MIN_Q26 (1 << 16)
#define RATIO_SURE_Q26 (1 << 26)
static int32_t pulled_q14(int32_t ratio_x_q26, int32_t ratio_y_q26, int32_t sd_q26) {
  const struct scaled one = {1 << 14, -14}, per_6 = {21845, -17};
  const struct scaled usual = {USUAL_SQUARE_Q26 >> 6, 6 - 26};
  uint32_t x = fixed_magnitude(ratio_x_q26), y = fixed_magnitude(ratio_y_q26), size = x > y ? x : y;
  if (size >= RATIO_SURE_Q26 || size >= (uint32_t)sd_q26 * SURE_SDS) {
    return 1 << 14;
  }
  const struct scaled variance = squares_of(sd_q26, 0, 26);
  const struct scaled share = quotient_of(variance, sum_of(variance, usual));
  struct scaled far = quotient_of(squares_of(ratio_x_q26, ratio_y_q26, 26), variance);
  far = scaled_mul(far, per_6);
  struct scaled step = quotient_of(sum_of(one, far), sum_of(one, scaled_mul(far, share)));
  step = scaled_mul(step, step);
  const struct scaled odds = scaled_mul(share, scaled_mul(step, step));
  return scaled_to_fixed(quotient_of(odds, sum_of(one, odds)), 14);
}

/* The place is the mean of that of a contact that is pulled as estimated and of one that is not,
 * each by how likely it is. The standard deviation has what lies between the two. What it loses where nothing pulls is
 * of the same misfit as the place's: else what is left would be mostly the difference of the two factors. */
static void weigh_force(const struct tangential_settings *settings, struct fit_tangential *found) {
  int32_t force_N_q24 = fit_fixed(found->force_N, 24);
  force_N_q24 = force_N_q24 < FORCE_MIN_N_Q24 ? FORCE_MIN_N_Q24 : force_N_q24;
  const int32_t ratio_x_q26 = per_force_q26(found->qx_N, force_N_q24);
  const int32_t ratio_y_q26 = per_force_q26(found->qy_N, force_N_q24);
  int32_t sd_q26 = per_force_q26(found->q_sd_N, force_N_q24);
  sd_q26 = sd_q26 < RATIO_SD_MIN_Q26 ? RATIO_SD_MIN_Q26 : sd_q26;
  const int32_t pulled = pulled_q14(ratio_x_q26, ratio_y_q26, sd_q26);
  const int32_t not_pulled = (1 << 14) - pulled;
  const int32_t *moved = found->shift_q20_mm;
  const int32_t dx_q20 = fixed_mul_q26(ratio_x_q26, moved[0]);
  const int32_t dy_q20 = fixed_mul_q26(ratio_y_q26, moved[1]);
  found->x_mm = fit_float(fit_fixed(found->x_mm, 20) - fixed_mul_16(dx_q20, not_pulled) * 4, -20);
  found->y_mm = fit_float(fit_fixed(found->y_mm, 20) - fixed_mul_16(dy_q20, not_pulled) * 4, -20);
  struct scaled variance = squares_of(fit_fixed(found->location_sd_mm, 20), 0, 20);
  const struct scaled sixteenth = {variance.mantissa, variance.exponent - 4};
  struct scaled of_force = scaled_mul(squares_of(moved[0], moved[1], 20), squares_of(sd_q26, 0, 26));
  of_force = scaled_mul(of_force, scaled_from(fit_fixed(found->variance_per_tangential, 20), -20));
  of_force.mantissa = -of_force.mantissa;
  const struct scaled share = {not_pulled, -14}, other = {pulled, -14};
  const struct scaled between = scaled_mul(squares_of(dx_q20, dy_q20, 20), other);
  variance = sum_of(variance, scaled_mul(sum_of(between, of_force), share));
  const bool small = sum_of(variance, (struct scaled){-sixteenth.mantissa, sixteenth.exponent}).mantissa < 0;
  const struct scaled root = scaled_sqrt(sum_of(small ? sixteenth : variance, scaled_from(settings->location_variance_q26, -26)));
  found->location_sd_mm = fit_float(root.mantissa, root.exponent);
}

/* The zero of the first touch. Returns whether it is settled. */
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

void tangential_update(struct tangential_history *history, const struct tangential_settings *settings, const struct contact_input *input,
                       struct contact_result *result, struct tangential_force *force) {
  struct fit_tangential mended;
  const struct fit_tangential *found = &mended;
  memset(force, 0, sizeof *force);
  if (!input->contact) {
    tangential_reset(history);
  }
  if (!input->tangential || !input->tangential->valid || !(input->tangential->force_N > 0.0f) ||
      !without_edges(settings, input->tangential, &mended)) {
    return;
  }
  weigh_force(settings, &mended);
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
  const float scale_sd = settings->force_scale * settings->tangential_scale_sd;
  force->x_mm = found->x_mm;
  force->y_mm = found->y_mm;
  force->location_sd_mm = found->location_sd_mm;
  force->force_N = settings->force_scale * found->force_N;
  force->force_sd_N = fit_quadrature(settings->force_scale, found->force_sd_N, settings->force_scale_sd, found->force_N);
  force->qx_N = scale * qx_N;
  force->qy_N = scale * qy_N;
  force->q_sd_N = fit_quadrature(scale, found->q_sd_N, scale_sd, size_N);
  force->ratio = settings->tangential_scale * size_N / found->force_N;
  result->flags |= CONTACT_FLAG_TANGENTIAL_VALID;
  result->flags &= ~(uint32_t)(CONTACT_FLAG_UNCERTAIN | CONTACT_FLAG_ELONGATED | (found->at_corner ? 0 : CONTACT_FLAG_MODEL));
  result->flags |= found->elongated ? (uint32_t)CONTACT_FLAG_ELONGATED : 0;
  if (force->location_sd_mm > settings->location_sd_limit_mm) {
    result->flags |= CONTACT_FLAG_UNCERTAIN;
  }
}
