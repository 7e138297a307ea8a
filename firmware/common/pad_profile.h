/* How the rubber of one pad spreads a press and a pull. The host computes it from the pad's thickness and overhang (`fingertip pad`). The
 * packets carry it, the fingertip keeps it, and the estimate of tangential force uses it (fit_tangential.h).
 *
 * Lengths are those of one bonded layer, so all of them grow with its thickness. Let t2 be the contact's own spread
 * (variance of its pressure along one axis, mm^2). A contact that presses by F gives on the base
 *   F sum_j share_j / (2 pi v_j) exp(-r^2 / 2 v_j),                   v_j = sd_j^2 + t2
 * A contact that pulls by Q along x adds
 *   Q sum_j moment_j x / (2 pi v_j^2) exp(-r^2 / 2 v_j),              v_j = sd_j^2 + 1.3 t2 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

enum { PAD_NORMAL_TERMS = 2, PAD_TANGENTIAL_TERMS = 3, PAD_EDGE_TERMS = 3 };

/* The effect of the pad's ends on the estimate, which assumes none; of a pad without end that of what the sums above
 * miss of the layer. It depends on the estimated place (x, y). With u = x / PAD_EDGE_UNIT_mm and v = y / PAD_EDGE_UNIT_mm
 *   even(c) = c[0] + c[1] u^2 + c[2] v^2
 *   odd(c)  = u even(c) for values along x, v even(c) for values along y
 * An estimate of ratios q = Q / F, place and F then means
 *   q' = (q - odd(ratio)) / (1 + even(gain))
 *   place' = place - odd(place) - q' even(pull)
 *   F' = F / (1 + even(force))
 * All zeros: nothing is known of it. */
struct pad_edges {
  float ratio_x[PAD_EDGE_TERMS], ratio_y[PAD_EDGE_TERMS];
  float gain_x[PAD_EDGE_TERMS], gain_y[PAD_EDGE_TERMS];
  float place_x_mm[PAD_EDGE_TERMS], place_y_mm[PAD_EDGE_TERMS];
  float pull_x_mm[PAD_EDGE_TERMS], pull_y_mm[PAD_EDGE_TERMS];
  float force[PAD_EDGE_TERMS];
};
#define PAD_EDGE_UNIT_mm 10.0f
enum { PAD_EDGE_KINDS = sizeof(struct pad_edges) / sizeof(float[PAD_EDGE_TERMS]) };

struct pad_profile {
  float thickness_mm;
  float overhang_mm; /* of the rubber beyond the outer sensors; 0: not set */
  struct {
    float share, sd_mm;
  } normal[PAD_NORMAL_TERMS];
  struct {
    float moment_mm, sd_mm; /* the moments add up to about the thickness */
  } tangential[PAD_TANGENTIAL_TERMS];
  float spread_mm2, spread_sd_mm2; /* what to expect of t2 */
  float force_ratio;               /* 2 pi p0 sigma^2 of a usual contact over its force: what a calibration's
                                      force scale holds of it */
  float tangential_scale;          /* tangential force is this times the profile's */
  float tangential_scale_sd;       /* standard deviation of tangential_scale */
  struct pad_edges edges;
  uint8_t from_touch; /* 1: the pad's edges spoil the zero, so report the change since the first
                       * touch; 0 */
};

/* The values before from_touch, behind one another. */
#define PAD_EDGE_FLOATS (PAD_EDGE_KINDS * PAD_EDGE_TERMS)
#define PAD_PROFILE_FLOATS (4 + 2 * PAD_NORMAL_TERMS + 2 * PAD_TANGENTIAL_TERMS + 3 + PAD_EDGE_FLOATS)

/* Ranges. */
#define PAD_THICKNESS_MIN_mm 5.0f
#define PAD_THICKNESS_MAX_mm 20.0f
#define PAD_OVERHANG_MAX_mm 100.0f /* from 0 */
/* Limits of one term: a term that holds nothing, or twice all there is, belongs to no layer. */
#define PAD_SHARE_MIN 0.001f
#define PAD_SHARE_MAX 2.0f
#define PAD_MOMENT_MIN_mm 0.01f
#define PAD_MOMENT_MAX_mm 40.0f
#define PAD_SD_MIN_mm 0.5f
#define PAD_SD_MAX_mm 100.0f
#define PAD_SPREAD_MAX_mm2 100.0f /* from 0 */
#define PAD_SPREAD_SD_MIN_mm2 0.1f
#define PAD_SPREAD_SD_MAX_mm2 100.0f
#define PAD_FORCE_RATIO_MIN 0.5f
#define PAD_FORCE_RATIO_MAX 2.0f
#define PAD_TANGENTIAL_SCALE_MIN 0.25f
#define PAD_TANGENTIAL_SCALE_MAX 4.0f
#define PAD_TANGENTIAL_SCALE_SD_MAX 1.0f /* from 0 */
#define PAD_EDGE_MAX 10.0f               /* from -10: each coefficient */

/* Every value of it is finite and in its range, and the terms are in order of width. */
bool pad_profile_is_valid(const struct pad_profile *profile);
