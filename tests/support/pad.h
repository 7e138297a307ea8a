/* The profile of a pad of 12 mm of silicone, for tests of what carries and uses it. */
#ifndef SUPPORT_PAD_H
#define SUPPORT_PAD_H

#include "common/pad_profile.h"

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

#endif
