#include "common/pad_profile.h"

#include <stddef.h>
#include <string.h>

_Static_assert(offsetof(struct pad_profile, from_touch) == PAD_PROFILE_FLOATS * sizeof(float), "floats lie behind one another");

/* False for NaN too. */
static bool is_within(float value, float least, float greatest) { return value >= least && value <= greatest; }

bool pad_profile_is_valid(const struct pad_profile *profile) {
  bool valid = is_within(profile->thickness_mm, PAD_THICKNESS_MIN_mm, PAD_THICKNESS_MAX_mm) &&
               is_within(profile->overhang_mm, 0.0f, PAD_OVERHANG_MAX_mm) && is_within(profile->spread_mm2, 0.0f, PAD_SPREAD_MAX_mm2) &&
               is_within(profile->spread_sd_mm2, PAD_SPREAD_SD_MIN_mm2, PAD_SPREAD_SD_MAX_mm2) &&
               is_within(profile->force_ratio, PAD_FORCE_RATIO_MIN, PAD_FORCE_RATIO_MAX) &&
               is_within(profile->tangential_scale, PAD_TANGENTIAL_SCALE_MIN, PAD_TANGENTIAL_SCALE_MAX) &&
               is_within(profile->tangential_scale_sd, 0.0f, PAD_TANGENTIAL_SCALE_SD_MAX) && profile->from_touch <= 1;
  float edges[PAD_EDGE_FLOATS];
  _Static_assert(sizeof edges == sizeof profile->edges, "edges are floats alone");
  memcpy(edges, &profile->edges, sizeof edges);
  for (int i = 0; i < PAD_EDGE_FLOATS; i++) {
    valid = valid && is_within(edges[i], -PAD_EDGE_MAX, PAD_EDGE_MAX);
  }
  float narrowest_mm = PAD_SD_MIN_mm;
  for (int j = 0; j < PAD_NORMAL_TERMS; j++) {
    valid = valid && is_within(profile->normal[j].share, PAD_SHARE_MIN, PAD_SHARE_MAX) &&
            is_within(profile->normal[j].sd_mm, narrowest_mm, PAD_SD_MAX_mm);
    narrowest_mm = profile->normal[j].sd_mm;
  }
  narrowest_mm = PAD_SD_MIN_mm;
  for (int j = 0; j < PAD_TANGENTIAL_TERMS; j++) {
    valid = valid && is_within(profile->tangential[j].moment_mm, PAD_MOMENT_MIN_mm, PAD_MOMENT_MAX_mm) &&
            is_within(profile->tangential[j].sd_mm, narrowest_mm, PAD_SD_MAX_mm);
    narrowest_mm = profile->tangential[j].sd_mm;
  }
  return valid;
}
