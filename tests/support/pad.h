/* The profile of a pad of 12 mm of silicone, for tests of what carries and uses it. */
#pragma once

#include "common/pad_profile.h"

#include <math.h>
#include <string.h>

static inline struct pad_profile pad_of_12_mm(void) {
  struct pad_profile pad;
  memset(&pad, 0, sizeof pad);
  pad.thickness_mm = 12.0f;
  pad.overhang_mm = 9.0f;
  pad.normal[0].share = 0.0952f;
  pad.normal[0].sd_mm = 3.554f;
  pad.normal[1].share = 0.8216f;
  pad.normal[1].sd_mm = 5.737f;
  pad.tangential[0].moment_mm = 1.1231f;
  pad.tangential[0].sd_mm = 4.8537f;
  pad.tangential[1].moment_mm = 4.0308f;
  pad.tangential[1].sd_mm = 7.9913f;
  pad.tangential[2].moment_mm = 5.5624f;
  pad.tangential[2].sd_mm = 20.39f;
  pad.spread_mm2 = 4.0f;
  pad.spread_sd_mm2 = 6.0f;
  pad.force_ratio = 0.9375f;
  pad.tangential_scale = 1.0f;
  pad.tangential_scale_sd = 0.125f;
  return pad;
}

struct pad_load {
  double force_N, qx_N, qy_N;
};

/* Pressure under the pad this far from the middle of a contact with this spread, by the definition in pad_profile.h. */
static inline double pad_pressure_Pa(const struct pad_profile *pad, double spread_mm2, double dx_mm, double dy_mm, struct pad_load load) {
  const double two_pi = 6.28318530717958, r2 = dx_mm * dx_mm + dy_mm * dy_mm;
  double sum = 0.0; /* N/mm^2 */
  for (int j = 0; j < PAD_NORMAL_TERMS; j++) {
    const double v = (double)pad->normal[j].sd_mm * (double)pad->normal[j].sd_mm + spread_mm2;
    sum += load.force_N * (double)pad->normal[j].share / (two_pi * v) * exp(-r2 / (2 * v));
  }
  for (int j = 0; j < PAD_TANGENTIAL_TERMS; j++) {
    const double v = (double)pad->tangential[j].sd_mm * (double)pad->tangential[j].sd_mm + 1.3 * spread_mm2;
    sum += (load.qx_N * dx_mm + load.qy_N * dy_mm) * (double)pad->tangential[j].moment_mm / (two_pi * v * v) * exp(-r2 / (2 * v));
  }
  return sum * 1e6;
}
