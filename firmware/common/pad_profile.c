#include "common/pad_profile.h"
bool pad_profile_is_valid(const struct pad_profile *profile) { return profile->thickness_mm > 0; }
